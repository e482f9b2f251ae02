//! The interface between a sequence and the shell that runs it.
//!
//! A sequence is an `async fn` that is lent a [`DriveContext`]. It leaves there what is to be sent, and waits for the
//! answers. It does no I/O, reads no clock and wakes no task: it is a state machine written by the compiler, which
//! [`Session`](crate::Session) polls after each frame and deadline. So the same sequences serve blocking and
//! asynchronous shells.

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
    /// A sequence waits for the answer to its SDO request.
    pub(crate) is_transferring: bool,
    /// When to poll the sequence even if nothing has come.
    pub(crate) wake: Option<Instant>,
    pub(crate) status: Reports,
    /// The last fault that came by emergency; `NO_ERROR` (0) after a reset.
    pub(crate) emergency: Option<u16>,
    /// The COB-ID of the drive's emergencies, if it sends any.
    pub(crate) emergencies: Option<CobId>,
    /// The last notice, an emergency code that is not a fault.
    pub(crate) warning: Option<u16>,
    /// The last frame of each TPDO that the description does not name, until it is asked for.
    pub(crate) pdos: [Option<Frame>; 4],
    pub(crate) restarted: bool,
    /// The drive has booted since it was last recovered.
    pub(crate) booted: bool,
    /// What was last seen of the drive.
    pub(crate) seen: Seen,
    pub(crate) motion: Motion,
    /// The target of a PDO that was sent together with a control word, until the drive has been seen to take it. A
    /// drive whose PDO waits for SYNC obeys that word at the next SYNC, so each later control word has to replace it.
    pub(crate) held: Option<i32>,
    /// The control word of a stop that was ordered, until the drive has been seen to stand.
    pub(crate) stop: Option<u16>,
    /// Until when the drive may still report its state before the last order.
    pub(crate) settles: Instant,
    /// The drive has reported something that can only come of the last order.
    pub(crate) settled: bool,
    /// The values that objects held before they were written to protect the drive.
    pub(crate) before: Vec<(Number, i64)>,
    /// How much later than on CAN the drive answers and obeys.
    pub(crate) latency: Duration,
    /// How long a travel may take.
    pub(crate) patience: Duration,
    /// A follower keeps the drive alive from now on, and disarms its protection.
    pub(crate) is_handed_over: bool,
}

/// The status words of the drive.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    /// The last one that the drive has sent by itself.
    pub(crate) last: u16,
    /// The last status word, sent by the drive or read; `None` when it is out of date, and always for a drive that
    /// sends none by itself.
    pub(crate) known: Option<u16>,
    /// How many have come, by which a sequence notices the next one.
    pub(crate) count: u64,
    /// Some have been lost, so the next one must be read.
    pub(crate) missed: bool,
}

/// The result of waiting for a status word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Awaited {
    /// The last status word.
    pub status_word: u16,
    /// Whether it is one that was waited for, and not only the last one before the time was over.
    pub came: bool,
}

/// An SDO access, for the client.
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
        // Whichever call panicked has already failed; the others need not fail with it.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Discards what the previous operation has left behind.
    pub(crate) fn begin(&self, now: Instant) {
        let mut shared = self.lock();
        shared.now = now;
        shared.outbox.clear();
        shared.access = None;
        shared.answer = None;
        shared.is_transferring = false;
        shared.restarted = false;
    }

    /// Ends the work of a sequence: discards its unsent frames, which might start the drive. Returns the frames that
    /// stop the drive, if it may be moving; outside OPERATION ENABLED there are none, since they would enable it.
    pub(crate) fn let_go(&self) -> impl Iterator<Item = Frame> {
        self.begin(self.now());
        let obeys = self.known_state().is_none_or(|state| state == State::OperationEnabled);
        let word = (self.may_move() && obeys).then(|| self.stop_word());
        word.into_iter().flat_map(|word| self.replacing_frame(word).into_iter().chain([self.control_frame(word)]))
    }

    /// The control word that stops what was ordered. A step has no bit that stops it, so it takes a quick stop.
    pub(crate) fn stop_word(&self) -> u16 {
        match self.lock().motion {
            Motion::Stepping { .. } => self.description.word(Command::QuickStop),
            _ => self.description.stopping(),
        }
    }

    /// Whether the drive may be moving, judged by the orders and what it reported.
    #[must_use]
    pub fn may_move(&self) -> bool {
        self.lock().motion.may_move()
    }

    /// Whether the drive reports that a travel is under way.
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

    /// Handles a frame that the drive sends by itself; returns whether it was one.
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

    /// `emergency.code` is in the byte order of CiA 301; the description knows whether the drive's is another one.
    pub(crate) fn heard_emergency(&self, emergency: Emergency) {
        let code = emergency.code.0;
        let is_notice = matches!(self.description.codes.cause(code), Cause::Notice(_));
        let mut shared = self.lock();
        *(if is_notice { &mut shared.warning } else { &mut shared.emergency }) = Some(code);
        // The matching status word may come later, by the cycle or the inhibit time of its PDO.
        shared.status.missed |= !is_notice;
    }

    pub(crate) fn heard_boot_up(&self) {
        let mut shared = self.lock();
        shared.restarted = true;
        shared.booted = true;
        // A restart clears state and faults.
        shared.status.known = None;
        shared.emergency = None;
        shared.held = None;
        shared.warning = None;
        shared.rest();
    }

    /// Frames of the drive have been lost, perhaps its boot-up. Nothing known before is relied on: edges that start
    /// something are made anew, and the status word is read. Only an interruption of the travel is kept, if the drive
    /// itself does not report it.
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

    /// The description of this kind of drive.
    #[must_use]
    pub fn description(&self) -> &'static Description {
        self.description
    }

    /// The time.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.lock().now
    }

    /// By when a command that is sent now shows in the drive's reports.
    #[must_use]
    pub fn reacts_by(&self) -> Instant {
        let shared = self.lock();
        shared.now + self.description.times.reaction + shared.latency
    }

    /// The capability, or [`Error::Unsupported`].
    pub fn need<T>(&self, capability: Option<T>, what: Capability) -> Result<T, Error> {
        capability.ok_or(Error::Unsupported { drive: self.description.name, what })
    }

    /// The last values that operations have seen, each with its time.
    #[must_use]
    pub fn seen(&self) -> Seen {
        self.lock().seen
    }

    /// Whether a sequence waits for the answer to an SDO request: until it comes, no other may be sent.
    #[must_use]
    pub fn is_transferring(&self) -> bool {
        self.lock().is_transferring
    }

    /// How long a travel may take before it counts as timed out.
    #[must_use]
    pub fn patience(&self) -> Duration {
        self.lock().patience
    }

    /// Reads the status word from the drive.
    pub async fn status(&self) -> Result<u16, Error> {
        let word = self.get(self.description.objects.status_word).await? as u16;
        // The drive's own PDO may be later than this answer, by its inhibit time.
        let mut shared = self.lock();
        shared.status.known = shared.status.known.map(|_| word);
        shared.saw_state(word);
        Ok(word)
    }

    /// Whether a control word that stops the drive may be sent. In any state but OPERATION ENABLED it would enable the
    /// drive, or end its quick stop. A drive that does not answer is sent the word, since nothing else could stop it.
    ///
    /// Errors: as [`DriveContext::read`], except for [`Error::Sdo`].
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

    /// To call before an order: for a while, the drive may still report its former state.
    pub fn unsettle(&self) {
        let until = self.now() + self.description.times.settling;
        let mut shared = self.lock();
        shared.settles = until;
        shared.settled = false;
    }

    /// Whether the drive's reports belong to the last order: once `changed` was true, which says that the drive reports
    /// what it cannot have reported before, or once the settling time is over.
    pub fn settled(&self, changed: bool) -> bool {
        let mut shared = self.lock();
        shared.settled |= changed || shared.now >= shared.settles;
        shared.settled
    }

    /// Waits until the settling time of the last order is over.
    pub async fn settle(&self) -> Result<(), Error> {
        let until = self.lock().settles;
        self.wait(until, |_| None::<()>).await.map(|_| ())
    }

    /// Whether the settling time of the last order is over.
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

    /// Reads the status word and waits until `wanted` accepts it, no longer than a reaction takes.
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

    /// Waits for `span`.
    pub async fn pass(&self, span: Duration) -> Result<(), Error> {
        let until = self.now() + span;
        self.wait(until, |_| None::<()>).await.map(|_| ())
    }

    /// The last TPDO of this number (1 to 4) since the previous call, or the next one; `None` if none comes within a
    /// reaction time.
    pub(crate) async fn next_pdo(&self, number: u16) -> Result<Option<Frame>, Error> {
        let until = self.reacts_by();
        let place = usize::from(number).wrapping_sub(1);
        self.wait(until, |shared| shared.pdos.get_mut(place).and_then(Option::take)).await
    }

    /// Waits until `look` finds something, at most until `until`.
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

    /// To call before something is ordered to move.
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
