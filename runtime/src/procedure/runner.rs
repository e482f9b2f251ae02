//! The runner of procedures.

use super::step::{Data, Decision, Step};
use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::Address;
use crate::service::sdo_client::{self, Scalar, SdoClient, SdoError};
use crate::time::{Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtMessage, NmtState};

/// Carries out the steps of a procedure on one node, one after another.
#[derive(Clone, Debug)]
pub struct Runner<'a, I> {
    node: NodeId,
    client: SdoClient,
    steps: I,
    /// How many steps have begun.
    count: usize,
    step: Option<Step<'a>>,
    /// The value that the step has written last.
    written: Option<u64>,
    activity: Activity,
    /// Whether the node has booted since the last command.
    booted: bool,
}

/// How a procedure ended.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// All steps succeeded.
    Finished {
        /// How many there were.
        steps: usize,
    },
    /// A step failed; the following ones were not begun.
    Failed(Failure<'a>),
}

/// Which step failed, and why.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error("step {number} ({step}): {error}")]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Failure<'a> {
    /// Counted from 1.
    pub number: usize,
    pub step: Step<'a>,
    pub error: StepError,
}

/// Why a step failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum StepError {
    #[error(transparent)]
    Sdo(#[from] SdoError),
    /// An entry has another value than expected.
    #[error("{address} is {got:X}h")]
    Mismatch {
        address: Address,
        /// The value, with only the compared bits.
        got: u64,
    },
    /// The awaited event did not happen in time.
    #[error("it did not happen within {within}")]
    TimedOut { within: Duration },
    /// No command leads to the goal.
    #[error("no way leads on from {observed:X}h")]
    Impossible { observed: u64 },
}

/// The runner's present activity.
#[derive(Clone, Copy, Debug)]
enum Activity {
    /// Begins the next step.
    Next,
    /// Reads or writes a value. `until` is the time-out of a step that repeats.
    Transfer { value: Scalar, until: Instant },
    /// Writes the bytes of the step.
    Bytes,
    /// Has a command to send.
    Command,
    /// Waits until `resume`, within the time-out of the step.
    Pause { resume: Instant, until: Instant },
    /// Waits until the node boots.
    Listen { until: Instant },
    /// Has ended.
    Over,
}

impl<'a, I: Iterator<Item = Step<'a>>> Runner<'a, I> {
    /// Runs `steps` on `node` through `client`. The first step begins with the first [`Runner::handle_timeout`], which
    /// is due at once.
    #[must_use]
    pub fn new(node: NodeId, client: SdoClient, steps: I) -> Self {
        Runner { node, client, steps, count: 0, step: None, written: None, activity: Activity::Next, booted: false }
    }

    /// The node.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The step under way, and its number, counted from 1.
    #[must_use]
    pub fn step(&self) -> Option<(usize, Step<'a>)> {
        self.step.map(|step| (self.count, step))
    }

    /// Whether the procedure has ended.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        matches!(self.activity, Activity::Over)
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event<'a>> {
        let boot_up = ErrorControl::heartbeat(NmtState::Initialising).frame(self.node);
        if *frame == boot_up {
            if matches!(self.activity, Activity::Listen { .. }) {
                return self.begin_next(now);
            }
            // The node has booted before the step that waits for it.
            self.booted = true;
            return None;
        }
        let event = match &mut self.activity {
            Activity::Transfer { value, .. } => self.client.handle_frame(now, frame, value)?,
            Activity::Bytes => {
                let mut bytes = self.step.map_or(&[][..], bytes_of);
                self.client.handle_frame(now, frame, &mut bytes)?
            }
            _ => return None,
        };
        self.handle_transfer(now, event)
    }

    /// Begins the first step, goes on after a pause, or ends a step that has timed out.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event<'a>> {
        match self.activity {
            Activity::Next => self.begin_next(now),
            Activity::Pause { resume, until } if resume <= now => self.resume(now, until),
            Activity::Listen { until } if until <= now => self.fail_late(),
            Activity::Transfer { .. } | Activity::Bytes => {
                let event = self.client.handle_timeout(now)?;
                self.handle_transfer(now, event)
            }
            _ => None,
        }
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        match &mut self.activity {
            Activity::Transfer { value, .. } => self.client.poll_transmit(now, value),
            Activity::Bytes => {
                let mut bytes = self.step.map_or(&[][..], bytes_of);
                self.client.poll_transmit(now, &mut bytes)
            }
            Activity::Command => {
                self.activity = Activity::Next;
                let Some(Step::Nmt(command)) = self.step else { return None };
                Some(NmtMessage { command, node: Some(self.node) }.frame())
            }
            // The previous transfer may have left an abort.
            _ => self.client.poll_transmit(now, &mut [0; 0]),
        }
    }

    /// When to call [`Runner::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        match self.activity {
            Activity::Next => Some(Instant::ZERO),
            Activity::Pause { resume, .. } => Some(resume),
            Activity::Listen { until } => Some(until),
            Activity::Transfer { .. } | Activity::Bytes => self.client.poll_timeout(),
            Activity::Command | Activity::Over => None,
        }
    }

    fn begin_next(&mut self, now: Instant) -> Option<Event<'a>> {
        self.step = self.steps.next();
        self.written = None;
        let Some(step) = self.step else {
            self.activity = Activity::Over;
            return Some(Event::Finished { steps: self.count });
        };
        self.count += 1;
        match step {
            Step::Write { address, data: Data::Value(value) } => self.write(now, address, value, now),
            Step::Write { address, data: Data::Bytes(bytes) } => {
                self.activity = Activity::Bytes;
                let len = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
                // The client is idle, since each step takes one transfer.
                let _ = self.client.write(now, address, len);
            }
            Step::Expect { address, .. } => self.read(now, address, now),
            Step::Await { address, timeout, .. } => self.read(now, address, now + timeout),
            Step::Steer { observed, timeout, .. } => self.read(now, observed, now + timeout),
            Step::Nmt(_) => {
                self.booted = false;
                self.activity = Activity::Command;
            }
            Step::AwaitBootUp { .. } if core::mem::take(&mut self.booted) => self.activity = Activity::Next,
            Step::AwaitBootUp { timeout } => self.activity = Activity::Listen { until: now + timeout },
            Step::Wait(span) => self.activity = Activity::Pause { resume: now + span, until: now + span },
        }
        None
    }

    fn read(&mut self, now: Instant, address: Address, until: Instant) {
        self.activity = Activity::Transfer { value: Scalar::room_for::<u64>(), until };
        let _ = self.client.read(now, address);
    }

    fn write(&mut self, now: Instant, address: Address, value: Scalar, until: Instant) {
        self.activity = Activity::Transfer { value, until };
        let _ = self.client.write(now, address, value.len());
    }

    fn handle_transfer(&mut self, now: Instant, event: sdo_client::Event) -> Option<Event<'a>> {
        let address = match event {
            sdo_client::Event::Done { address, .. } => address,
            sdo_client::Event::Failed(error) => return self.fail(error.into()),
        };
        let Activity::Transfer { value, until } = self.activity else { return self.begin_next(now) };
        let got = value.number();
        match self.step {
            Some(Step::Expect { address, mask, value }) if got & mask != value & mask => {
                self.fail(StepError::Mismatch { address, got: got & mask })
            }
            Some(Step::Await { mask, value, poll, .. }) if got & mask != value & mask => self.pause(now, poll, until),
            // The control word was written: its effect is read next.
            Some(Step::Steer { acted, poll, .. }) if address == acted => self.pause(now, poll, until),
            Some(Step::Steer { acted, steer, poll, .. }) => {
                let decision = steer.decide(got, self.written);
                self.steer(now, decision, got, acted, poll, until)
            }
            _ => self.begin_next(now),
        }
    }

    fn steer(
        &mut self,
        now: Instant,
        decision: Decision,
        observed: u64,
        acted: Address,
        poll: Duration,
        until: Instant,
    ) -> Option<Event<'a>> {
        match decision {
            Decision::Reached => self.begin_next(now),
            Decision::Wait => self.pause(now, poll, until),
            Decision::Impossible => self.fail(StepError::Impossible { observed }),
            Decision::Write(value) => {
                self.written = Some(value);
                self.write(now, acted, Scalar::of(value as u16), until);
                None
            }
        }
    }

    fn pause(&mut self, now: Instant, span: Duration, until: Instant) -> Option<Event<'a>> {
        if until <= now {
            return self.fail_late();
        }
        self.activity = Activity::Pause { resume: now + span, until };
        None
    }

    fn resume(&mut self, now: Instant, until: Instant) -> Option<Event<'a>> {
        match self.step {
            Some(Step::Await { address, .. } | Step::Steer { observed: address, .. }) => {
                self.read(now, address, until);
                None
            }
            _ => self.begin_next(now),
        }
    }

    fn fail_late(&mut self) -> Option<Event<'a>> {
        let within = match self.step {
            Some(Step::Await { timeout, .. } | Step::Steer { timeout, .. } | Step::AwaitBootUp { timeout }) => timeout,
            _ => Duration::ZERO,
        };
        self.fail(StepError::TimedOut { within })
    }

    fn fail(&mut self, error: StepError) -> Option<Event<'a>> {
        self.activity = Activity::Over;
        let step = self.step.take()?;
        Some(Event::Failed(Failure { number: self.count, step, error }))
    }
}

fn bytes_of(step: Step<'_>) -> &[u8] {
    match step {
        Step::Write { data: Data::Bytes(bytes), .. } => bytes,
        _ => &[],
    }
}
