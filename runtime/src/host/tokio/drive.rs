//! Who runs the network: a task in the background, and each call that waits outside of a task.
//!
//! Tokio polls the future of `block_on` only after a look at its descriptors. If a call there waited for the task, every
//! answer would take two looks: one that wakes the task, and one before the call is polled. So the call runs the network
//! itself. Each event wakes both of them, since a call may be dropped, or left unpolled, at any point.

use std::boxed::Box;
use std::fmt;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};

use tokio::runtime::{Handle, Id};

type Network = Pin<Box<dyn Future<Output = ()> + Send>>;

/// A network that the background task and calls take turns to run. It is the waker of the network.
pub(super) struct Drive {
    /// That of the background task, which has the network's descriptor and timers.
    runtime: Id,
    /// Calls may run it, too. In virtual time they may not, since time passes when the network is run.
    lets_calls: bool,
    state: Mutex<State>,
}

struct State {
    network: Running,
    /// Something has happened since the network was run.
    is_woken: bool,
    task: Option<Waker>,
    /// That of the call that has run the network last. If it has ended since, it is woken for nothing once.
    call: Option<Waker>,
}

enum Running {
    Idle(Network),
    /// Somebody has a [`Turn`], and looks at `is_woken` when it ends.
    Lent,
    Ended,
}

impl Drive {
    /// Starts the background task on the current runtime.
    pub(super) fn spawn(network: impl Future<Output = ()> + Send + 'static, lets_calls: bool) -> Arc<Self> {
        let network = Running::Idle(Box::pin(network));
        let state = Mutex::new(State { network, is_woken: true, task: None, call: None });
        let drive = Arc::new(Drive { runtime: Handle::current().id(), lets_calls, state });
        let background = Background(Arc::clone(&drive));
        tokio::spawn(async move { poll_fn(|context| background.0.poll_task(context)).await });
        drive
    }

    /// Runs the network while `call` waits, if that is in `block_on`.
    pub(super) async fn attend<T>(self: &Arc<Self>, call: impl Future<Output = T>) -> T {
        let mut call = pin!(call);
        poll_fn(|context| {
            // Before the call hands in its request, so that this does not wake the background task.
            let turn = if self.may_attend() { self.turn(self.lock()) } else { None };
            let Some(mut turn) = turn else { return call.as_mut().poll(context) };
            // It is polled again below, so its answer need not wake it.
            let before = call.as_mut().poll(&mut Context::from_waker(Waker::noop()));
            if before.is_ready() {
                return before;
            }
            turn.run();
            let after = call.as_mut().poll(context);
            if after.is_pending() {
                turn.call = Some(context.waker().clone());
            }
            after
        })
        .await
    }

    /// A task need not: tokio polls it right after the background task.
    fn may_attend(&self) -> bool {
        let is_here = || Handle::try_current().is_ok_and(|runtime| runtime.id() == self.runtime);
        self.lets_calls && tokio::task::try_id().is_none() && is_here()
    }

    fn poll_task(self: &Arc<Self>, context: &Context<'_>) -> Poll<()> {
        let mut state = self.lock();
        if matches!(state.network, Running::Ended) {
            return Poll::Ready(());
        }
        state.task = Some(context.waker().clone());
        if state.is_woken
            && let Some(mut turn) = self.turn(state)
        {
            turn.run();
        }
        Poll::Pending
    }

    /// `None` when somebody else has it, or when the network has ended.
    fn turn(self: &Arc<Self>, mut state: MutexGuard<'_, State>) -> Option<Turn<'_>> {
        match core::mem::replace(&mut state.network, Running::Lent) {
            Running::Idle(network) => Some(Turn { drive: self, network: Some(network), call: None }),
            other => {
                state.network = other;
                None
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive").finish_non_exhaustive()
    }
}

impl Wake for Drive {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        let mut state = self.lock();
        state.is_woken = true;
        if !matches!(state.network, Running::Lent) {
            wake(state);
        }
    }
}

/// Wakes the call and the background task.
fn wake(mut state: MutexGuard<'_, State>) {
    let wakers = [state.call.take(), state.task.take()];
    drop(state);
    wakers.into_iter().flatten().for_each(Waker::wake);
}

/// The right to run the network, until it is dropped.
struct Turn<'a> {
    drive: &'a Arc<Drive>,
    /// `None` when it has ended.
    network: Option<Network>,
    /// The call that waits from now on.
    call: Option<Waker>,
}

impl Turn<'_> {
    /// Runs the network until it waits.
    fn run(&mut self) {
        if !core::mem::take(&mut self.drive.lock().is_woken) {
            return;
        }
        // The network is dropped, and so ends, if it panics.
        let Some(mut network) = self.network.take() else { return };
        let waker = Waker::from(Arc::clone(self.drive));
        if network.as_mut().poll(&mut Context::from_waker(&waker)).is_pending() {
            self.network = Some(network);
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        let mut state = self.drive.lock();
        // The runtime may have shut down meanwhile.
        if matches!(state.network, Running::Lent) {
            state.network = self.network.take().map_or(Running::Ended, Running::Idle);
        }
        if self.call.is_some() {
            state.call = self.call.take();
        }
        if state.is_woken || matches!(state.network, Running::Ended) {
            wake(state);
        }
    }
}

/// Ends the network with its background task: at the latest when the runtime shuts down.
struct Background(Arc<Drive>);

impl Drop for Background {
    fn drop(&mut self) {
        let network = core::mem::replace(&mut self.0.lock().network, Running::Ended);
        // Dropping it sends what was posted and fails the calls, which wakes this.
        drop(network);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicUsize, Ordering};
    use tokio::sync::oneshot;

    #[derive(Default)]
    struct Wakes(AtomicUsize);

    impl Wake for Wakes {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Tokio would look at its descriptors once more.
    #[tokio::test]
    async fn a_call_is_not_woken_for_an_answer_that_it_gets_itself() {
        let ((ask, asked), (reply, answer)) = (oneshot::channel(), oneshot::channel());
        let network = async move {
            reply.send(asked.await.unwrap()).unwrap();
            core::future::pending::<()>().await;
        };
        let drive = Drive::spawn(network, true);
        let mut call = pin!(drive.attend(async move {
            ask.send(7).unwrap();
            answer.await
        }));
        let wakes = Arc::<Wakes>::default();
        let waker = Waker::from(Arc::clone(&wakes));
        let polled = poll_fn(|_| Poll::Ready(call.as_mut().poll(&mut Context::from_waker(&waker)))).await;
        assert_eq!(polled, Poll::Ready(Ok(7)));
        assert_eq!(wakes.0.load(Ordering::Relaxed), 0);
    }
}
