//! Answers that come later.

use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::sync::oneshot;

use crate::command::{Answer, Refused};

/// The answer to a command, when it is there.
pub struct Reply(pub(super) oneshot::Receiver<Result<Answer, Refused>>);

impl Reply {
    /// Blocks until the answer is there.
    ///
    /// # Errors
    ///
    /// Why the command was not carried out.
    pub fn wait(self) -> Result<Answer, Refused> {
        self.0.blocking_recv().unwrap_or_else(|_| Err(gone()))
    }

    /// The answer, if it is there.
    pub fn take(&mut self) -> Option<Result<Answer, Refused>> {
        match self.0.try_recv() {
            Ok(result) => Some(result),
            Err(oneshot::error::TryRecvError::Empty) => None,
            Err(oneshot::error::TryRecvError::Closed) => Some(Err(gone())),
        }
    }
}

impl Future for Reply {
    type Output = Result<Answer, Refused>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.0).poll(context).map(|answer| answer.unwrap_or_else(|_| Err(gone())))
    }
}

fn gone() -> Refused {
    Refused::new("a stop came first, or the bench has ended").with_remedy("ask again")
}
