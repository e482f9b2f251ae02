//! The state shared by requests and pages.

use std::sync::Arc;

use tokio::sync::{Semaphore, watch};

use super::changes::Fields;
use super::downloads::Downloads;
use super::files::Files;
use super::guard::{Names, Token};
use crate::Bench;

/// The state shared by all requests.
pub(super) struct Shared {
    pub(super) bench: Bench,
    pub(super) token: Token,
    pub(super) names: Names,
    pub(super) files: Files,
    pub(super) downloads: Downloads,
    pub(super) fields: watch::Sender<Fields>,
    pub(super) clients: Arc<Semaphore>,
    pub(super) end: watch::Sender<bool>,
}

/// Waits for the end of the server.
pub(super) async fn ended(end: &mut watch::Receiver<bool>) {
    // If the sender is dropped, nobody can end the server any more; that counts as the end.
    let _ = end.wait_for(|is_ended| *is_ended).await;
}
