//! Where a sequence and whoever runs it meet.
//!
//! A sequence is an `async fn` that is lent a [`Desk`]. It leaves there what is to be sent, and waits for what
//! comes back. It does no I/O, reads no clock and wakes nobody: it is a state machine that the compiler
//! writes, and [`Session`](super::Session) polls it after each frame and deadline. So the same sequences serve
//! blocking and asynchronous shells.

use std::collections::VecDeque;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use lexican_runtime::object::{Address, Object, Readable, Value, Writable};
use lexican_runtime::service::sdo_client::{Scalar, SdoError};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::description::Description;
use super::error::Error;
use crate::od;
use crate::state::Command;

/// One drive, as a sequence sees it; clones are the same desk.
#[derive(Clone, Debug)]
pub struct Desk {
    node: NodeId,
    description: &'static Description,
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug, Default)]
pub(super) struct Shared {
    pub(super) now: Instant,
    pub(super) outbox: VecDeque<Frame>,
    pub(super) access: Option<Access>,
    pub(super) answer: Option<Result<Scalar, SdoError>>,
    /// When the sequence wants to be polled even though nothing came.
    pub(super) wake: Option<Instant>,
    pub(super) status_word: u16,
    /// How many status words have come: a sequence waits for the next one.
    pub(super) status_words: u64,
    /// What the drive said has been lost: what is known of it must be asked for.
    pub(super) missed: bool,
    pub(super) emergency: Option<u16>,
    pub(super) restarted: bool,
    /// Something that moves has been started, and nothing has shown yet that it stands still.
    pub(super) moving: bool,
    pub(super) paused: bool,
    /// Velocity mode has been started and not stopped.
    pub(super) running: bool,
}

/// An access to an object, for the SDO client.
#[derive(Clone, Copy, Debug)]
pub(super) struct Access {
    pub(super) address: Address,
    pub(super) payload: Scalar,
    pub(super) writes: bool,
}

impl Desk {
    pub(super) fn new(node: NodeId, description: &'static Description) -> Self {
        Desk { node, description, shared: Arc::default() }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Shared> {
        // A panic elsewhere has already failed whatever this belongs to; it need not fail twice.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets what an operation before has left behind.
    pub(super) fn begin(&self, now: Instant) {
        let mut shared = self.lock();
        shared.now = now;
        shared.outbox.clear();
        shared.access = None;
        shared.answer = None;
        shared.restarted = false;
    }

    /// Ends work at the desk: what a sequence has left unsent is forgotten, since it may be what starts the
    /// drive. The frame that stops it, when it may be moving.
    pub(super) fn let_go(&self) -> Option<Frame> {
        self.begin(self.now());
        self.lock().moving.then(|| self.control_frame(self.description.word(Command::EnableOperation)))
    }

    /// Lets a sequence go on as far as it can.
    pub(super) fn poll<F: Future>(&self, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
        {
            let mut shared = self.lock();
            shared.now = now;
            shared.wake = None;
        }
        // Nobody needs to be woken: whoever calls this knows when something has happened.
        sequence.poll(&mut Context::from_waker(Waker::noop()))
    }

    /// Takes note of what the drive says unasked; whether the frame was that.
    pub(super) fn hear(&self, frame: &Frame) -> bool {
        let of = |base| frame.id() == CobId::of_node(base, self.node);
        if of(0x180) || of(0x380) || of(0x480) {
            // All three carry the status word first.
            if let Ok(pdo) = od::Tpdo1::unpack(frame.data()) {
                self.lock().saw_status(pdo.statusword.0);
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

    pub(super) fn heard_emergency(&self, emergency: Emergency) {
        self.lock().emergency = Some(emergency.code.0);
    }

    pub(super) fn heard_boot_up(&self) {
        let mut shared = self.lock();
        shared.restarted = true;
        shared.moving = false;
        shared.paused = false;
        shared.running = false;
    }

    /// Something that the drive said has been lost, perhaps that it has booted. Nothing that was known is taken
    /// for granted: the edges that start something are made anew, and the status word is read.
    #[cfg(feature = "tokio")]
    pub(super) fn missed(&self) {
        let mut shared = self.lock();
        shared.missed = true;
        shared.emergency = None;
        shared.paused = false;
        shared.running = false;
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

    /// Sends an NMT command.
    pub fn command(&self, command: NmtCommand) {
        self.send(Frame::from_array(CobId::NMT, [command.code(), self.node.get()]));
    }

    /// Sends a control word (RPDO1).
    pub fn control(&self, word: u16) {
        self.send(self.control_frame(word));
    }

    /// Sends a control word with a target position (RPDO3).
    pub fn control_position(&self, word: u16, target: i32) {
        let pdo = od::Rpdo3 { controlword: od::Controlword(word), target_position: od::Position(target) };
        self.send(Frame::from_array(CobId::of_node(0x400, self.node), pdo.pack()));
    }

    /// Sends a control word with a target velocity (RPDO4).
    pub fn control_velocity(&self, word: u16, target: i32) {
        let pdo = od::Rpdo4 { controlword: od::Controlword(word), target_velocity: od::Velocity(target) };
        self.send(Frame::from_array(CobId::of_node(0x500, self.node), pdo.pack()));
    }

    fn control_frame(&self, word: u16) -> Frame {
        let pdo = od::Rpdo1 { controlword: od::Controlword(word) };
        Frame::from_array(CobId::of_node(0x200, self.node), pdo.pack())
    }

    fn send(&self, frame: Frame) {
        self.lock().outbox.push_back(frame);
    }

    /// Reads an object.
    ///
    /// # Errors
    ///
    /// [`Error::Sdo`], [`Error::DataSheet`], or [`Error::Restarted`].
    pub async fn read<T: Value, A: Readable, M>(&self, object: Object<T, A, M>) -> Result<T, Error> {
        let address = object.address();
        let payload = self.transfer(Access { address, payload: Scalar::room_for::<T>(), writes: false }).await?;
        payload.get().map_err(|error| Error::DataSheet { address, error })
    }

    /// Writes an object.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] before anything is sent; [`Error::Sdo`], or [`Error::Restarted`].
    pub async fn write<T: Value, A: Writable, M>(&self, object: Object<T, A, M>, value: T) -> Result<(), Error> {
        object.check(value)?;
        let access = Access { address: object.address(), payload: Scalar::of(value), writes: true };
        self.transfer(access).await?;
        Ok(())
    }

    /// Reads a status word, from the drive and not from memory.
    ///
    /// # Errors
    ///
    /// As [`Desk::read`].
    pub async fn status(&self) -> Result<u16, Error> {
        Ok(self.read(od::STATUSWORD).await?.0)
    }

    /// The next status word that the drive sends; when it sends none, reads it.
    ///
    /// # Errors
    ///
    /// As [`Desk::read`].
    pub async fn next_status(&self) -> Result<u16, Error> {
        let seen = self.lock().status_words;
        let until = self.now() + self.description.status_period;
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
        let until = self.now() + self.description.reaction;
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

    pub(super) async fn transfer(&self, access: Access) -> Result<Scalar, Error> {
        {
            let mut shared = self.lock();
            shared.answer = None;
            shared.access = Some(access);
        }
        let answer = self.wait(Instant::from_micros(u64::MAX), |shared| shared.answer.take()).await?;
        // The SDO client gives up by itself long before the end of time.
        Ok(answer.unwrap_or(Err(SdoError::TimedOut { address: access.address }))?)
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
    pub(super) fn saw_status(&mut self, word: u16) {
        self.status_word = word;
        self.status_words += 1;
    }
}
