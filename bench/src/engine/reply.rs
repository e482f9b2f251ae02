//! Answers that come later.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};

use tokio::sync::oneshot;

use super::lock::lock;
use crate::request::{Answer, Refused};

/// The answer to a request, which comes later.
pub struct Reply(pub(super) oneshot::Receiver<Result<Answer, Refused>>);

impl Reply {
    /// Blocks until the answer has come.
    pub fn wait(self) -> Result<Answer, Refused> {
        self.0.blocking_recv().unwrap_or_else(|_| Err(gone()))
    }

    /// The answer, if it has come.
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

/// Receives an answer.
pub(super) type Waiter = Box<dyn FnOnce(Result<Answer, Refused>) + Send>;

/// Combines several answers into one: done if all are, else the first refusal.
pub(super) struct Gathered(Mutex<Gathering>);

struct Gathering {
    missing: usize,
    refused: Option<Refused>,
    done: Option<Waiter>,
}

impl Gathered {
    /// `done` is called when all `answers` are taken, or when nobody is left to give one.
    pub(super) fn new(answers: usize, done: impl FnOnce(Result<Answer, Refused>) + Send + 'static) -> Arc<Self> {
        Arc::new(Gathered(Mutex::new(Gathering { missing: answers, refused: None, done: Some(Box::new(done)) })))
    }

    /// Takes an answer.
    pub(super) fn take(&self, answer: Result<Answer, Refused>) {
        let mut gathering = lock(&self.0);
        gathering.missing -= 1;
        if let Err(refused) = answer {
            gathering.refused.get_or_insert(refused);
        }
    }
}

impl Drop for Gathered {
    fn drop(&mut self) {
        let gathering = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        let refused = gathering.refused.take().or_else(|| (gathering.missing > 0).then(gone));
        if let Some(done) = gathering.done.take() {
            done(refused.map_or(Ok(Answer::Done), Err));
        }
    }
}

fn gone() -> Refused {
    Refused::new("a stop came first, or the bench has ended").with_remedy("ask again")
}
