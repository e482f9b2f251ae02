//! The tokio shell for programs that block.

use std::fmt;
use std::future::Future;
use std::io;
use std::sync::Arc;
use std::thread::JoinHandle;

use tokio::runtime::{Builder, Runtime};
use tokio::sync::oneshot;

use super::Network;
use crate::host::Link;

/// Runs a [`Network`] for callers that block: each call runs it until its own future is done, in any number of threads. Between
/// the calls a thread runs it, so that it keeps watching, booting and sending heartbeats; in virtual time nothing passes between
/// them. Clones run the same network, and it ends with the last of them.
#[derive(Clone)]
pub struct Runner(Arc<Inner>);

struct Inner {
    /// `None` while it is dropped.
    runtime: Option<Arc<Runtime>>,
    between: Option<(oneshot::Sender<()>, JoinHandle<()>)>,
}

impl Runner {
    /// A network over `link`, and what runs it. Nothing is sent.
    pub fn spawn<L: Link + Send + 'static>(link: L) -> io::Result<(Runner, Network)> {
        let is_real_time = link.is_real_time();
        let runtime = Arc::new(Builder::new_current_thread().enable_all().build()?);
        let network = runtime.block_on(async { Network::spawn(link) })?;
        let mut between = None;
        if is_real_time {
            let (sender, ended) = oneshot::channel::<()>();
            let runtime = Arc::clone(&runtime);
            // It is an error that the sender is gone.
            let run = move || drop(runtime.block_on(ended));
            between = Some((sender, std::thread::Builder::new().spawn(run)?));
        }
        Ok((Runner(Arc::new(Inner { runtime: Some(runtime), between })), network))
    }

    /// Runs the network until `future` is done.
    ///
    /// # Panics
    ///
    /// In a task of tokio, which must not block.
    pub fn block_on<F: Future>(&self, future: F) -> F::Output {
        self.0.runtime.as_ref().expect("it is there until it is dropped").block_on(future)
    }
}

/// The thread has ended when this returns, and what was posted has reached the link: the program may end next.
impl Drop for Inner {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.between.take() {
            drop(sender);
            // A panic of it has been reported.
            let _ = thread.join();
        }
        self.runtime = None;
    }
}

impl fmt::Debug for Runner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runner").field("runs_between_calls", &self.0.between.is_some()).finish()
    }
}
