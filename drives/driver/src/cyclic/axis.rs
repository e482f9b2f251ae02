//! One axis: its settings and its present state.

use lexican_runtime::profile::cia402::{Cause as How, Command, State, control, status};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::report::{AxisReport, End, Reason};
use super::settings::AxisSettings;
use crate::context::DriveContext;
use crate::description::{Description, Number};
use crate::fault::Cause;
use crate::mode::Mode;
use crate::protection::Protection;

/// How long an axis must not move to count as standing.
const STANDING: Duration = Duration::from_millis(20);

/// How many set-points an axis may lag without a following error: one is on its way, one is being interpolated to, one
/// is the last position, and one is the age of that position.
const BEHIND: usize = 4;

/// A drive that is set up for a cyclic mode.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    pub(super) node: NodeId,
    pub(super) description: &'static Description,
    pub(super) settings: AxisSettings,
    pub(super) position: i32,
    pub(super) limits: Option<[i32; 2]>,
    pub(super) protection: Protection,
    /// The writes that disarm it, in this order.
    pub(super) disarming: [Option<(Number, i64)>; DISARMING],
}

/// The most writes that disarm a drive: life guarding is switched off, and both of its objects are restored.
pub(super) const DISARMING: usize = 3;

impl Axis {
    /// A drive at `node` that was set up by something else, such as its DCF. The PDOs of `settings` have the COB-IDs of
    /// the predefined connection set (CiA 301, 7.3.5), are synchronous, and carry control word and set-point, and
    /// status word and position. The drive stands at `position`, is not enabled, is in the mode and in NMT OPERATIONAL,
    /// and its set-point is its position.
    #[must_use]
    pub const fn new(node: NodeId, description: &'static Description, settings: AxisSettings, position: i32) -> Self {
        Axis {
            node,
            description,
            settings,
            position,
            limits: None,
            protection: Protection::None,
            disarming: [None; DISARMING],
        }
    }

    /// With limits of travel: no set-point is sent beyond them.
    #[must_use]
    pub const fn within(self, low: i32, high: i32) -> Self {
        Axis { limits: Some([low, high]), ..self }
    }

    /// With the protection that [`sequence::protect`](crate::sequence::protect) has armed: the follower sends the signs
    /// of life, and writes 0 to disarm it at the end, when the axis stands.
    #[must_use]
    pub const fn protected_by(self, protection: Protection) -> Self {
        let disarming = match protection.switch() {
            Some(switch) => [Some((switch, 0)), None, None],
            None => [None; DISARMING],
        };
        Axis { protection, disarming, ..self }
    }

    /// The same, but at the end the objects also get their former values again.
    pub(crate) fn protected_in(self, drive: &DriveContext, protection: Protection) -> Self {
        let mut axis = self.protected_by(protection);
        let steps = drive.disarming(protection).into_iter().map(Some);
        axis.disarming.iter_mut().zip(steps).for_each(|(to, step)| *to = step);
        axis
    }

    /// How the drive notices that its follower is gone.
    #[must_use]
    pub const fn protection(&self) -> Protection {
        self.protection
    }

    /// The node-ID of the drive.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The position at which the drive stood when the axis was set up.
    #[must_use]
    pub const fn position(&self) -> i32 {
        self.position
    }

    /// The COB-ID of the PDO with its set-points.
    #[must_use]
    pub fn rpdo(&self) -> CobId {
        CobId::of_node(0x100 + 0x100 * u16::from(self.settings.rpdo), self.node)
    }

    /// The COB-ID of the PDO with its position.
    #[must_use]
    pub fn tpdo(&self) -> CobId {
        CobId::of_node(0x080 + 0x100 * u16::from(self.settings.tpdo), self.node)
    }
}

/// The command that an axis is sent with its set-point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    /// Stay in OPERATION ENABLED and follow the set-points.
    Hold,
    Command(Command),
}

/// An axis of a follower.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) axis: Axis,
    /// The status word and the position that came last.
    status_word: Option<u16>,
    pub(super) position: i32,
    /// The PDO has come since the last SYNC.
    fresh: bool,
    missing: u32,
    all_missing: u64,
    late: u64,
    emergency: Option<u16>,
    nmt: Option<NmtState>,
    restarted: bool,
    /// When it entered its state, or was first waited for.
    since: Instant,
    /// The position around which it stands, and since when.
    stands_at: i32,
    stands_since: Instant,
    /// Its last set-points, the newest first.
    recent: [i32; BEHIND],
    following_error: u32,
    order: Order,
    pub(super) set_point: i32,
}

impl Member {
    pub(super) fn new(axis: Axis, now: Instant) -> Self {
        let position = axis.position;
        let set_point = if axis.settings.follows_positions() { position } else { 0 };
        Member {
            axis,
            status_word: None,
            position,
            fresh: false,
            missing: 0,
            all_missing: 0,
            late: 0,
            emergency: None,
            nmt: None,
            restarted: false,
            since: now,
            stands_at: position,
            stands_since: now,
            recent: [set_point; BEHIND],
            following_error: 0,
            order: Order::Command(Command::DisableVoltage),
            set_point,
        }
    }

    pub(super) fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let node = self.axis.node;
        if frame.id() == self.axis.tpdo() {
            self.handle_report(now, frame.data());
        } else if frame.id() == CobId::of_node(0x080, node) {
            if let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) {
                self.handle_emergency(emergency);
            }
        } else if frame.id() == CobId::of_node(0x700, node)
            && let Some(control) = ErrorControl::parse(frame.data())
        {
            self.handle_nmt_state(control.state);
        }
    }

    pub(super) fn handle_emergency(&mut self, emergency: Emergency) {
        self.emergency = Some(emergency.code.0);
    }

    pub(super) fn handle_nmt_state(&mut self, state: NmtState) {
        self.nmt = Some(state);
        self.restarted |= state == NmtState::Initialising;
    }

    fn handle_report(&mut self, now: Instant, data: &[u8]) {
        let &[low, high, a, b, c, d, ..] = data else { return };
        let (status_word, position) = (u16::from_le_bytes([low, high]), i32::from_le_bytes([a, b, c, d]));
        if self.status_word.and_then(State::from_status_word) != State::from_status_word(status_word) {
            self.since = now;
        }
        if position.abs_diff(self.stands_at) > self.axis.settings.standing {
            (self.stands_at, self.stands_since) = (position, now);
        }
        // The PDO is sent in OPERATIONAL only, so an earlier heartbeat is out of date.
        self.nmt = None;
        self.late += u64::from(self.fresh);
        (self.status_word, self.position, self.fresh) = (Some(status_word), position, true);
    }

    /// Counts at the end of a cycle whether the PDO has come.
    pub(super) fn end_cycle(&mut self) {
        if std::mem::take(&mut self.fresh) {
            self.missing = 0;
        } else {
            self.missing += 1;
            self.all_missing += 1;
        }
    }

    /// The state of its state machine, by the last status word.
    pub(super) fn state(&self) -> Option<State> {
        State::from_status_word(self.status_word?)
    }

    fn shown_state(&self) -> State {
        self.state().unwrap_or(State::NotReadyToSwitchOn)
    }

    fn cause(&self) -> Cause {
        self.emergency.map_or(Cause::NoError, |code| self.axis.description.codes.cause(code))
    }

    fn has_fault(&self) -> bool {
        matches!(self.state(), Some(State::Fault | State::FaultReactionActive))
            || matches!(self.cause(), Cause::Fault(_))
    }

    /// Whether its PDO still comes, with at most `tolerated` missing in a row.
    pub(super) fn is_heard(&self, tolerated: u32) -> bool {
        !self.restarted && self.status_word.is_some() && self.missing <= tolerated
    }

    /// Whether it has restarted: it is then no longer led.
    pub(super) fn is_gone(&self) -> bool {
        self.restarted
    }

    /// Whether it is in OPERATION ENABLED, and reports that it follows the set-points.
    pub(super) fn follows(&self) -> bool {
        let follows = self.axis.settings.follows;
        self.state() == Some(State::OperationEnabled) && self.status_word.is_some_and(|word| word & follows == follows)
    }

    /// What is wrong with it, whether or not it follows the path.
    pub(super) fn trouble(&self, now: Instant, tolerated: u32) -> Option<Reason> {
        let node = self.axis.node;
        if self.restarted {
            return Some(Reason::Restarted { node });
        }
        if self.has_fault() {
            return Some(Reason::Fault { node, cause: self.cause() });
        }
        // Its first PDO may take a while, and its heartbeat may be out of date.
        let begins = self.status_word.is_none() && now.since(self.since) <= self.axis.description.times.reaction;
        match self.nmt {
            _ if begins => None,
            Some(state @ (NmtState::Stopped | NmtState::PreOperational)) => {
                Some(Reason::NotOperational { node, state })
            }
            _ if self.status_word.is_none() || self.missing > tolerated => {
                Some(Reason::PdoMissing { node, cycles: self.missing })
            }
            _ => None,
        }
    }

    /// What is wrong with it, as far as it matters only on the path.
    pub(super) fn trouble_following(&mut self) -> Option<Reason> {
        let (node, settings) = (self.axis.node, self.axis.settings);
        let status_word = self.status_word?;
        let state = self.shown_state();
        if state != State::OperationEnabled {
            return Some(Reason::LeftOperationEnabled { node, state });
        }
        let error = self.distance();
        self.following_error = self.following_error.max(error);
        // Mode 7 does not have this bit (CiA 402-2, 12.2.2).
        let reported = settings.mode == Mode::CyclicPosition && status_word & status::FOLLOWING_ERROR != 0;
        if reported || error > settings.following_error {
            return Some(Reason::FollowingError { node, error });
        }
        (!self.follows()).then_some(Reason::Ignores { node, status_word })
    }

    /// The distance of its position from the range of its last set-points.
    fn distance(&self) -> u32 {
        if !self.axis.settings.follows_positions() {
            return 0;
        }
        let (low, high) = self.recent.iter().fold((i32::MAX, i32::MIN), |(low, high), &it| (low.min(it), high.max(it)));
        self.position.abs_diff(self.position.clamp(low, high))
    }

    /// Leads it to OPERATION ENABLED; returns the reason if it does not get there in time.
    pub(super) fn lead(&mut self, now: Instant) -> Option<Reason> {
        let Axis { node, description, .. } = self.axis;
        let state = self.state()?;
        if state == State::OperationEnabled {
            self.hold();
        } else {
            let next = description.transitions.next(state, State::OperationEnabled).map(|arrow| arrow.cause);
            let Some(How::Command(command)) = next else {
                return self.late_for(now, Reason::NotEnabled { node, state });
            };
            // Once Enable operation is sent, the set-point stays: otherwise it would follow an axis that sinks.
            let enables = Order::Command(Command::EnableOperation);
            if self.axis.settings.follows_positions() && self.order != enables {
                self.set_point = self.position;
                self.recent = [self.position; BEHIND];
            }
            self.command(command);
            return self.late_for(now, Reason::NotEnabled { node, state });
        }
        let status_word = self.status_word.filter(|_| !self.follows())?;
        self.late_for(now, Reason::Ignores { node, status_word })
    }

    fn late_for(&self, now: Instant, reason: Reason) -> Option<Reason> {
        (now.since(self.since) > self.axis.description.times.reaction).then_some(reason)
    }

    /// Keeps it in OPERATION ENABLED at its set-points.
    pub(super) fn hold(&mut self) {
        self.order = Order::Hold;
    }

    /// Takes the next set-point.
    pub(super) fn go_to(&mut self, set_point: i32) {
        self.set_point = set_point;
        self.recent.rotate_right(1);
        if let Some(newest) = self.recent.first_mut() {
            *newest = set_point;
        }
    }

    /// Sends it this command, which must not lead to OPERATION ENABLED.
    pub(super) fn command(&mut self, command: Command) {
        self.order = Order::Command(command);
    }

    /// Decided when the frame leaves, since the frame may have waited for room: in the meantime the axis may have left
    /// OPERATION ENABLED, and the word that holds it would enable it again.
    fn control_word(&self) -> u16 {
        let description = self.axis.description;
        let command = match (self.order, self.state()) {
            (Order::Hold, Some(State::OperationEnabled)) => {
                // In mode 7 the bit enables the interpolation (CiA 402-2, 12.2.1).
                let interpolates = self.axis.settings.mode == Mode::InterpolatedPosition;
                return description.moving() | if interpolates { control::NEW_SET_POINT } else { 0 };
            }
            (Order::Hold, Some(State::QuickStopActive)) => Command::QuickStop,
            (Order::Hold, _) => Command::DisableVoltage,
            (Order::Command(command), _) => command,
        };
        description.word(command)
    }

    /// Whether it has stood since `since`, for long enough.
    pub(super) fn stands(&self, now: Instant, since: Instant) -> bool {
        now.since(self.stands_since.max(since)) >= STANDING
    }

    /// Whether its motor had torque by the last status word.
    pub(super) fn has_torque(&self) -> bool {
        matches!(self.state(), Some(State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive))
    }

    /// The frame with its set-point; `None` after a restart, since its PDOs may then be mapped differently.
    pub(super) fn frame(&self) -> Option<Frame> {
        let ([low, high], [a, b, c, d]) = (self.control_word().to_le_bytes(), self.set_point.to_le_bytes());
        (!self.restarted).then(|| Frame::from_array(self.axis.rpdo(), [low, high, a, b, c, d]))
    }

    pub(super) fn report(&self, tolerated: u32, stood: bool) -> AxisReport {
        let end = if self.restarted {
            End::Restarted
        } else if !self.is_heard(tolerated) {
            End::Silent
        } else if !stood {
            End::Moving
        } else if self.has_fault() {
            End::Fault(self.cause())
        } else {
            End::AtRest(self.shown_state())
        };
        AxisReport {
            node: self.axis.node,
            end,
            position: self.position,
            set_point: self.set_point,
            following_error: self.following_error,
            missing: self.all_missing,
            late: self.late,
        }
    }
}
