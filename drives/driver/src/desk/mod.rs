//! Where a sequence and whoever runs it meet.
//!
//! A sequence is an `async fn` that is lent a [`Desk`]. It leaves there what is to be sent, and waits for what
//! comes back. It does no I/O, reads no clock and wakes nobody: it is a state machine that the compiler
//! writes, and [`Session`](crate::Session) polls it after each frame and deadline. So the same sequences serve
//! blocking and asynchronous shells.

mod objects;
mod orders;

pub(crate) use objects::narrow;

use std::collections::VecDeque;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Command, State};
use lexican_runtime::service::sdo_client::{Scalar, SdoError};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::description::Description;
use crate::error::{Capability, Error};

/// One drive, as a sequence sees it; clones are the same desk.
#[derive(Clone, Debug)]
pub struct Desk {
    node: NodeId,
    description: &'static Description,
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) now: Instant,
    pub(crate) outbox: VecDeque<Frame>,
    pub(crate) access: Option<Access>,
    pub(crate) answer: Option<Result<Scalar, SdoError>>,
    /// When the sequence wants to be polled even though nothing came.
    pub(crate) wake: Option<Instant>,
    pub(crate) status_word: u16,
    /// The same, or a later one that was asked for, as long as nothing tells that it is out of date; `None` too for a
    /// drive that says nothing unasked.
    pub(crate) told: Option<u16>,
    /// How many status words have come: a sequence waits for the next one.
    pub(crate) status_words: u64,
    /// What the drive said has been lost: what is known of it must be asked for.
    pub(crate) missed: bool,
    pub(crate) emergency: Option<u16>,
    pub(crate) restarted: bool,
    /// Something that moves has been started, and nothing has shown yet that it stands still.
    pub(crate) moving: bool,
    pub(crate) paused: bool,
    /// An edge that was to go on with the interrupted travel has not been seen to.
    pub(crate) unheeded: bool,
    /// A travel has been started, and nothing has shown yet that it is over.
    pub(crate) travelling: bool,
    /// Until when the drive may tell of what was before the last order.
    pub(crate) settles: Instant,
    /// It has told what it can only tell of that order.
    pub(crate) settled: bool,
    /// Velocity mode has been started and not stopped.
    pub(crate) running: bool,
    /// What has been started is a step of inching operation: an edge, which no bit takes back.
    pub(crate) stepping: bool,
    /// How long travels may take.
    pub(crate) patience: Duration,
}

/// An access to an object, for the SDO client.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Access {
    pub(crate) address: Address,
    pub(crate) payload: Scalar,
    pub(crate) writes: bool,
}

impl Desk {
    pub(crate) fn new(node: NodeId, description: &'static Description) -> Self {
        let shared = Shared {
            now: Instant::ZERO,
            outbox: VecDeque::new(),
            access: None,
            answer: None,
            wake: None,
            status_word: 0,
            told: None,
            status_words: 0,
            missed: false,
            emergency: None,
            restarted: false,
            moving: false,
            paused: false,
            unheeded: false,
            travelling: false,
            settles: Instant::ZERO,
            settled: true,
            running: false,
            stepping: false,
            patience: Duration::from_secs(600),
        };
        Desk { node, description, shared: Arc::new(Mutex::new(shared)) }
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Shared> {
        // A panic elsewhere has already failed whatever this belongs to; it need not fail twice.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets what an operation before has left behind.
    pub(crate) fn begin(&self, now: Instant) {
        let mut shared = self.lock();
        shared.now = now;
        shared.outbox.clear();
        shared.access = None;
        shared.answer = None;
        shared.restarted = false;
    }

    /// Ends work at the desk: what a sequence has left unsent is forgotten, since it may be what starts the
    /// drive. The frame that stops it, when it may be moving: outside OPERATION ENABLED the frame would enable it.
    pub(crate) fn let_go(&self) -> Option<Frame> {
        self.begin(self.now());
        let obeys = self.told_state().is_none_or(|state| state == State::OperationEnabled);
        let (moving, stepping) = {
            let shared = self.lock();
            (shared.moving, shared.stepping)
        };
        let quick = self.description.word(Command::QuickStop);
        (moving && obeys).then(|| self.control_frame(if stepping { quick } else { self.description.stopping() }))
    }

    /// Lets a sequence go on as far as it can.
    pub(crate) fn poll<F: Future>(&self, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
        {
            let mut shared = self.lock();
            shared.now = now;
            shared.wake = None;
        }
        // Nobody needs to be woken: whoever calls this knows when something has happened.
        sequence.poll(&mut Context::from_waker(Waker::noop()))
    }

    /// Takes note of what the drive says unasked; whether the frame was that.
    pub(crate) fn hear(&self, frame: &Frame) -> bool {
        let of = |base| frame.id() == CobId::of_node(base, self.node);
        if let Some(pdo) = self.description.inputs.iter().find(|pdo| of(pdo.base)) {
            if let Some(word) = pdo.status_word(self.description, frame.data()) {
                self.lock().saw_status(word);
            }
        } else if of(0x080) {
            if let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) {
                self.heard_emergency(emergency);
            }
        } else if of(0x700) {
            if ErrorControl::parse(frame.data()).is_some_and(|control| control.state == NmtState::Initialising) {
                self.heard_boot_up();
            }
        } else {
            return false;
        }
        true
    }

    /// The code is as CiA 301 orders its bytes; the description knows whether the drive does so.
    pub(crate) fn heard_emergency(&self, emergency: Emergency) {
        self.lock().emergency = Some(emergency.code.0);
    }

    pub(crate) fn heard_boot_up(&self) {
        let mut shared = self.lock();
        shared.restarted = true;
        // Neither its state nor its fault has outlived that.
        shared.told = None;
        shared.emergency = None;
        shared.rest();
    }

    /// Something that the drive said has been lost, perhaps that it has booted. Nothing that was known is taken
    /// for granted: the edges that start something are made anew, and the status word is read. But whether a travel
    /// is interrupted is not forgotten where the drive does not tell.
    #[cfg(feature = "tokio")]
    pub(crate) fn missed(&self) {
        let mut shared = self.lock();
        shared.missed = true;
        shared.told = None;
        shared.emergency = None;
        shared.paused &= self.description.status.positioning.is_none();
        shared.running = false;
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.node
    }

    /// What kind of drive it is.
    #[must_use]
    pub fn description(&self) -> &'static Description {
        self.description
    }

    /// The time.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.lock().now
    }

    /// A capability of the drive.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] when it does not have it.
    pub fn need<T>(&self, capability: Option<T>, what: Capability) -> Result<T, Error> {
        capability.ok_or(Error::Unsupported { drive: self.description.name, what })
    }

    /// How long travels may take until they count as timed out.
    #[must_use]
    pub fn patience(&self) -> Duration {
        self.lock().patience
    }

    /// Reads a status word, from the drive and not from memory.
    ///
    /// # Errors
    ///
    /// As [`Desk::read`].
    pub async fn status(&self) -> Result<u16, Error> {
        let word = self.get(self.description.objects.status_word).await? as u16;
        // What the drive says unasked may be late, by the inhibit time of its PDO.
        let mut shared = self.lock();
        shared.told = shared.told.map(|_| word);
        Ok(word)
    }

    /// Whether a word that stops the drive may be sent. In any state but OPERATION ENABLED the word would enable it,
    /// or end its quick stop. A drive that cannot be asked is told: the word stops it, if anything does.
    ///
    /// # Errors
    ///
    /// As [`Desk::read`], but for [`Error::Sdo`].
    pub async fn may_be_stopped(&self) -> Result<bool, Error> {
        if self.told_state() == Some(State::OperationEnabled) {
            return Ok(true);
        }
        match self.status().await {
            Ok(word) => Ok(State::from_status_word(word).is_none_or(|state| state == State::OperationEnabled)),
            Err(Error::Sdo(_)) => Ok(true),
            Err(error) => Err(error),
        }
    }

    /// The state in which the drive is by what it last said.
    fn told_state(&self) -> Option<State> {
        State::from_status_word(self.lock().told?)
    }

    /// Something is about to be ordered: what tells its end may tell the end of what was before, for a while.
    pub fn unsettle(&self) {
        let until = self.now() + self.description.times.settling;
        let mut shared = self.lock();
        shared.settles = until;
        shared.settled = false;
    }

    /// Whether what the drive tells belongs to the last order: `changed` is whether it tells what it cannot have told
    /// since before.
    pub fn settled(&self, changed: bool) -> bool {
        let mut shared = self.lock();
        shared.settled |= changed || shared.now >= shared.settles;
        shared.settled
    }

    /// Waits until what the drive tells belongs to the last order for sure.
    ///
    /// # Errors
    ///
    /// [`Error::Restarted`].
    pub async fn settle(&self) -> Result<(), Error> {
        let until = self.lock().settles;
        self.wait(until, |_| None::<()>).await.map(|_| ())
    }

    /// Whether that is so already.
    #[must_use]
    pub fn has_settled(&self) -> bool {
        let shared = self.lock();
        shared.now >= shared.settles
    }

    /// The next status word that the drive sends; when it sends none, reads it.
    ///
    /// # Errors
    ///
    /// As [`Desk::read`].
    pub async fn next_status(&self) -> Result<u16, Error> {
        let seen = self.lock().status_words;
        let mut until = self.now() + self.description.times.status_period;
        if !self.settled(false) {
            until = until.min(self.lock().settles);
        }
        let came = self.wait(until, |shared| {
            let came = shared.status_words != seen;
            (came || shared.missed).then(|| (!std::mem::take(&mut shared.missed)).then_some(shared.status_word))
        });
        match came.await?.flatten() {
            Some(word) => Ok(word),
            None => self.status().await,
        }
    }

    /// Waits until the status word, read anew at first, is as wanted; the last one seen otherwise.
    ///
    /// # Errors
    ///
    /// As [`Desk::read`].
    pub async fn await_status(&self, wanted: impl Fn(u16) -> bool) -> Result<Result<u16, u16>, Error> {
        let until = self.now() + self.description.times.reaction;
        let mut word = self.status().await?;
        while !wanted(word) {
            if self.now() >= until {
                return Ok(Err(word));
            }
            word = self.next_status().await?;
        }
        Ok(Ok(word))
    }

    /// Lets time pass.
    ///
    /// # Errors
    ///
    /// [`Error::Restarted`].
    pub async fn pass(&self, span: Duration) -> Result<(), Error> {
        let until = self.now() + span;
        self.wait(until, |_| None::<()>).await.map(|_| ())
    }

    /// Waits for something to be on the desk, no longer than `until`.
    async fn wait<T>(
        &self,
        until: Instant,
        mut look: impl FnMut(&mut Shared) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        poll_fn(|_| {
            let mut shared = self.lock();
            if shared.restarted {
                return Poll::Ready(Err(Error::Restarted));
            }
            match look(&mut shared) {
                Some(found) => Poll::Ready(Ok(Some(found))),
                None if shared.now >= until => Poll::Ready(Ok(None)),
                None => {
                    shared.wake = Some(until);
                    Poll::Pending
                }
            }
        })
        .await
    }
}

impl Shared {
    pub(crate) fn saw_status(&mut self, word: u16) {
        self.status_word = word;
        self.told = Some(word);
        self.status_words += 1;
    }

    /// The drive stands, and nothing is under way.
    pub(crate) fn rest(&mut self) {
        self.moving = false;
        self.paused = false;
        self.unheeded = false;
        self.travelling = false;
        self.settled = true;
        self.running = false;
        self.stepping = false;
    }
}
