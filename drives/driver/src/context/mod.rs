//! The interface between a sequence and the shell that runs it.
//!
//! A sequence is an `async fn` that is lent a [`DriveContext`]. It leaves there what is to be sent, and waits for what
//! comes back. It does no I/O, reads no clock and wakes no task: it is a state machine that the compiler
//! writes, and [`Session`](crate::Session) polls it after each frame and deadline. So the same sequences serve
//! blocking and asynchronous shells.

mod motion;
mod objects;
mod orders;
mod payload;
mod seen;

pub(crate) use motion::{Motion, Pause, Travel};
pub(crate) use objects::narrow;
pub(crate) use payload::Bytes;
pub use seen::Seen;

use std::collections::VecDeque;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Command, State};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, Measured, NodeId};

use crate::description::{Description, Number};
use crate::error::{Capability, Error};
use crate::fault::Cause;

/// One drive, as a sequence sees it; clones share its state.
#[derive(Clone, Debug)]
pub struct DriveContext {
    node: NodeId,
    description: &'static Description,
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) now: Instant,
    pub(crate) outbox: VecDeque<Frame>,
    pub(crate) access: Option<Access>,
    pub(crate) answer: Option<Result<Bytes, SdoError>>,
    /// A sequence waits for that answer.
    pub(crate) is_transferring: bool,
    /// When the sequence wants to be polled even though nothing came.
    pub(crate) wake: Option<Instant>,
    pub(crate) status: Reports,
    /// The last fault, or that there is none.
    pub(crate) emergency: Option<u16>,
    /// The COB-ID of the drive's emergencies, if it sends any.
    pub(crate) emergencies: Option<CobId>,
    /// The last notice that is no fault.
    pub(crate) warning: Option<u16>,
    /// The last one of each TPDO that the description does not name, until it is asked for.
    pub(crate) pdos: [Option<Frame>; 4],
    pub(crate) restarted: bool,
    /// It has been heard to boot since it was last recovered.
    pub(crate) booted: bool,
    /// What was last seen of it.
    pub(crate) seen: Seen,
    pub(crate) motion: Motion,
    /// The target of a PDO that has been sent with a control word in it, until the drive has been seen to take it: one
    /// whose PDO waits for SYNC obeys that word with the next one, and so each later word replaces it.
    pub(crate) held: Option<i32>,
    /// The control word of a stop that has been ordered, until the drive has been seen to stand.
    pub(crate) stop: Option<u16>,
    /// Until when the drive may report what was before the last order.
    pub(crate) settles: Instant,
    /// It has reported what it can only report of that order.
    pub(crate) settled: bool,
    /// What the objects held that have been written to protect the drive.
    pub(crate) before: Vec<(Number, i64)>,
    /// How much later than on CAN the drive answers and obeys.
    pub(crate) latency: Duration,
    /// How long travels may take.
    pub(crate) patience: Duration,
    /// A follower keeps the drive going from now on, and disarms what protects it.
    pub(crate) is_handed_over: bool,
}

/// What is known of the status word.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    /// The last one that the drive has sent by itself.
    pub(crate) last: u16,
    /// The same, or a later one that was read, unless something says that it is out of date; `None` too for a drive
    /// that sends none by itself.
    pub(crate) known: Option<u16>,
    /// How many have come: a sequence waits for the next one.
    pub(crate) count: u64,
    /// Some have been lost, so that the next one must be read.
    pub(crate) missed: bool,
}

/// What waiting for a status word has led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Awaited {
    /// The last status word.
    pub status_word: u16,
    /// Whether it is one that was waited for.
    pub came: bool,
}

/// An access to an object, for the SDO client.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Access {
    pub(crate) address: Address,
    pub(crate) payload: Bytes,
    pub(crate) writes: bool,
}

impl DriveContext {
    pub(crate) fn new(node: NodeId, description: &'static Description) -> Self {
        let shared = Shared {
            now: Instant::ZERO,
            outbox: VecDeque::new(),
            access: None,
            answer: None,
            is_transferring: false,
            wake: None,
            status: Reports::default(),
            emergency: None,
            emergencies: Some(CobId::of_node(0x080, node)),
            warning: None,
            pdos: [None; 4],
            restarted: false,
            booted: false,
            seen: Seen::default(),
            motion: Motion::Resting,
            held: None,
            stop: None,
            settles: Instant::ZERO,
            settled: true,
            before: Vec::new(),
            latency: Duration::ZERO,
            patience: Duration::from_secs(600),
            is_handed_over: false,
        };
        DriveContext { node, description, shared: Arc::new(Mutex::new(shared)) }
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Shared> {
        // A panic elsewhere has already failed the operation; it need not fail twice.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets what an operation before has left behind.
    pub(crate) fn begin(&self, now: Instant) {
        let mut shared = self.lock();
        shared.now = now;
        shared.outbox.clear();
        shared.access = None;
        shared.answer = None;
        shared.is_transferring = false;
        shared.restarted = false;
    }

    /// Ends the work of a sequence: what it has left unsent is forgotten, since it may be what starts the
    /// drive. The frames that stop it, if it may be moving: outside OPERATION ENABLED they would enable it.
    pub(crate) fn let_go(&self) -> impl Iterator<Item = Frame> {
        self.begin(self.now());
        let obeys = self.known_state().is_none_or(|state| state == State::OperationEnabled);
        let word = (self.may_move() && obeys).then(|| self.stop_word());
        word.into_iter().flat_map(|word| self.replacing_frame(word).into_iter().chain([self.control_frame(word)]))
    }

    /// The control word that stops what has been ordered: no bit takes a step back.
    pub(crate) fn stop_word(&self) -> u16 {
        match self.lock().motion {
            Motion::Stepping { .. } => self.description.word(Command::QuickStop),
            _ => self.description.stopping(),
        }
    }

    /// Whether the drive may be moving, by what has been ordered and seen.
    #[must_use]
    pub fn may_move(&self) -> bool {
        self.lock().motion.may_move()
    }

    /// Whether the description has the drive report that a travel is under way.
    pub(crate) fn reports_travels(&self) -> bool {
        self.description.status.positioning.is_some()
    }

    /// Lets a sequence go on as far as it can.
    pub(crate) fn poll<F: Future>(&self, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
        {
            let mut shared = self.lock();
            shared.now = now;
            shared.wake = None;
        }
        // No waker is needed: the shell polls after every frame and deadline.
        sequence.poll(&mut Context::from_waker(Waker::noop()))
    }

    /// Takes note of what the drive says unasked; whether the frame was that.
    pub(crate) fn hear(&self, frame: &Frame) -> bool {
        let of = |base| frame.id() == CobId::of_node(base, self.node);
        if let Some(pdo) = self.description.inputs.iter().find(|pdo| of(pdo.base)) {
            if let Some(word) = pdo.status_word(self.description, frame.data()) {
                self.lock().saw_status(word);
            }
        } else if self.lock().emergencies == Some(frame.id()) {
            if let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) {
                self.heard_emergency(emergency);
            }
        } else if of(0x700) {
            if ErrorControl::parse(frame.data()).is_some_and(|control| control.state == NmtState::Initialising) {
                self.heard_boot_up();
            }
        } else if let Some(place) = (0..4_u16).find(|place| of(0x180 + 0x100 * place)) {
            if let Some(last) = self.lock().pdos.get_mut(usize::from(place)) {
                *last = Some(*frame);
            }
        } else {
            return false;
        }
        true
    }

    /// The code is as CiA 301 orders its bytes; the description knows whether the drive does so.
    pub(crate) fn heard_emergency(&self, emergency: Emergency) {
        let code = emergency.code.0;
        let is_notice = matches!(self.description.codes.cause(code), Cause::Notice(_));
        let mut shared = self.lock();
        *(if is_notice { &mut shared.warning } else { &mut shared.emergency }) = Some(code);
        // The status word that goes with a fault may come later, by the cycle or the inhibit time of its PDO.
        shared.status.missed |= !is_notice;
    }

    pub(crate) fn heard_boot_up(&self) {
        let mut shared = self.lock();
        shared.restarted = true;
        shared.booted = true;
        // Neither its state nor its fault has outlived that.
        shared.status.known = None;
        shared.emergency = None;
        shared.held = None;
        shared.warning = None;
        shared.rest();
    }

    /// Frames of the drive have been lost, perhaps its boot-up. Nothing that was known is taken for granted: the edges
    /// that start something are made anew, and the status word is read. But whether a travel is interrupted is not
    /// forgotten if the drive does not report it.
    pub(crate) fn missed(&self) {
        let mut shared = self.lock();
        shared.status.missed = true;
        shared.status.known = None;
        shared.emergency = None;
        shared.warning = None;
        shared.motion = match shared.motion {
            Motion::Running => Motion::Unknown,
            motion @ Motion::Travelling(_) if self.reports_travels() => motion.with_pause(Pause::None),
            motion => motion,
        };
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

    /// By when a command that is sent now shows in what the drive reports.
    #[must_use]
    pub fn reacts_by(&self) -> Instant {
        let shared = self.lock();
        shared.now + self.description.times.reaction + shared.latency
    }

    /// A capability of the drive.
    pub fn need<T>(&self, capability: Option<T>, what: Capability) -> Result<T, Error> {
        capability.ok_or(Error::Unsupported { drive: self.description.name, what })
    }

    /// What was last seen of the drive.
    #[must_use]
    pub fn seen(&self) -> Seen {
        self.lock().seen
    }

    /// Whether a sequence waits for the answer to an SDO request: until then no other may be sent.
    #[must_use]
    pub fn is_transferring(&self) -> bool {
        self.lock().is_transferring
    }

    /// How long travels may take until they count as timed out.
    #[must_use]
    pub fn patience(&self) -> Duration {
        self.lock().patience
    }

    /// Reads a status word, from the drive and not from memory.
    pub async fn status(&self) -> Result<u16, Error> {
        let word = self.get(self.description.objects.status_word).await? as u16;
        // What the drive sends by itself may be late, by the inhibit time of its PDO.
        let mut shared = self.lock();
        shared.status.known = shared.status.known.map(|_| word);
        shared.saw_state(word);
        Ok(word)
    }

    /// Whether a word that stops the drive may be sent. In any state but OPERATION ENABLED the word would enable it,
    /// or end its quick stop. A drive that does not answer is sent the word: it stops the drive, if anything does.
    ///
    /// Errors: as [`DriveContext::read`], but for [`Error::Sdo`].
    pub async fn may_be_stopped(&self) -> Result<bool, Error> {
        if self.known_state() == Some(State::OperationEnabled) {
            return Ok(true);
        }
        match self.status().await {
            Ok(word) => Ok(State::from_status_word(word).is_none_or(|state| state == State::OperationEnabled)),
            Err(Error::Sdo(_)) => Ok(true),
            Err(error) => Err(error),
        }
    }

    /// The state of the drive by its last status word.
    fn known_state(&self) -> Option<State> {
        State::from_status_word(self.lock().status.known?)
    }

    /// Something is about to be ordered: for a while, the drive may still report the end of what was before.
    pub fn unsettle(&self) {
        let until = self.now() + self.description.times.settling;
        let mut shared = self.lock();
        shared.settles = until;
        shared.settled = false;
    }

    /// Whether what the drive reports belongs to the last order: `changed` is whether it reports what it cannot have
    /// reported before.
    pub fn settled(&self, changed: bool) -> bool {
        let mut shared = self.lock();
        shared.settled |= changed || shared.now >= shared.settles;
        shared.settled
    }

    /// Waits until what the drive reports belongs to the last order for sure.
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

    /// The next status word that the drive sends; reads it if none comes.
    pub async fn next_status(&self) -> Result<u16, Error> {
        let until = self.now() + self.description.times.status_period;
        self.next_status_before(until).await
    }

    /// The next status word that the drive sends before `until`; reads it if none comes.
    pub(crate) async fn next_status_before(&self, until: Instant) -> Result<u16, Error> {
        let seen = self.lock().status.count;
        let until = if self.settled(false) { until } else { until.min(self.lock().settles) };
        let came = self.wait(until, |shared| {
            let came = shared.status.count != seen;
            (came || shared.status.missed)
                .then(|| (!std::mem::take(&mut shared.status.missed)).then_some(shared.status.last))
        });
        match came.await?.flatten() {
            Some(word) => Ok(word),
            None => self.status().await,
        }
    }

    /// Waits until the status word, read anew at first, is as wanted, no longer than a reaction takes.
    pub async fn await_status(&self, wanted: impl Fn(u16) -> bool) -> Result<Awaited, Error> {
        let until = self.reacts_by();
        let mut status_word = self.status().await?;
        while !wanted(status_word) {
            if self.now() >= until {
                return Ok(Awaited { status_word, came: false });
            }
            status_word = self.next_status().await?;
        }
        Ok(Awaited { status_word, came: true })
    }

    /// Lets time pass.
    pub async fn pass(&self, span: Duration) -> Result<(), Error> {
        let until = self.now() + span;
        self.wait(until, |_| None::<()>).await.map(|_| ())
    }

    /// The last TPDO of this number (1 to 4) since it was asked for before, or the next one; `None` if none comes within a
    /// reaction.
    pub(crate) async fn next_pdo(&self, number: u16) -> Result<Option<Frame>, Error> {
        let until = self.reacts_by();
        let place = usize::from(number).wrapping_sub(1);
        self.wait(until, |shared| shared.pdos.get_mut(place).and_then(Option::take)).await
    }

    /// Waits until `look` finds something, no longer than `until`.
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
        self.status.last = word;
        self.status.known = Some(word);
        self.saw_state(word);
        self.status.count += 1;
    }

    fn saw_state(&mut self, word: u16) {
        self.seen.state = State::from_status_word(word).map(|state| Measured::new(state, self.now));
    }

    /// Something is about to move.
    pub(crate) fn order(&mut self, motion: Motion) {
        self.motion = motion;
        self.stop = None;
    }

    /// The drive stands, and nothing is under way.
    pub(crate) fn rest(&mut self) {
        self.order(Motion::Resting);
        self.settled = true;
    }
}
