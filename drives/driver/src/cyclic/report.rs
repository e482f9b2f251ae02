//! How a path ended, and the result of each axis.

use std::fmt;

use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, NodeId};

use crate::fault::Cause;

/// Why all axes are stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Reason {
    /// The program has cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The follower missed cycles: the program, or its machine, was held up.
    #[error("the program was late for its cycle by {late}")]
    CycleMissed {
        /// By how much the last one was late.
        late: Duration,
    },
    /// The frames of a cycle were still unsent at the next one: the bus has no room, or carries no frames.
    #[error("the frames of a cycle had not left by the next one")]
    BusFull,
    /// The SYNC of the other producer is missing.
    #[error("no SYNC has come for {silent}")]
    SyncLost {
        /// For how long.
        silent: Duration,
    },
    /// The program had no set-points.
    #[error("the program had no set-points for {cycles} cycles")]
    SetPointsLate {
        /// In how many cycles in a row.
        cycles: u32,
    },
    /// A set-point is too far from the previous one. No set-point of this cycle was sent.
    #[error("node {node}: a step from {from} to {to} is larger than {most}")]
    StepTooLarge {
        node: NodeId,
        /// The previous set-point.
        from: i32,
        to: i32,
        /// [`AxisSettings::max_step`](super::AxisSettings::max_step).
        most: u32,
    },
    /// A set-point is outside the limits of travel (607Dh). No set-point of this cycle was sent.
    #[error("node {node}: the set-point {to} is outside the limits, {low} to {high}")]
    OutsideLimits {
        node: NodeId,
        /// The set-point that is refused.
        to: i32,
        /// The lower limit.
        low: i32,
        /// The upper limit.
        high: i32,
    },
    /// The PDO of an axis is missing: it is lost or late, or the drive is gone.
    #[error("node {node}: its PDO has not come for {cycles} cycles")]
    PdoMissing {
        node: NodeId,
        /// In how many cycles in a row.
        cycles: u32,
    },
    /// An axis is too far from its set-points, or reports a following error (bit 13).
    #[error("node {node}: a following error of {error}")]
    FollowingError {
        node: NodeId,
        /// The distance from its last four set-points.
        error: u32,
    },
    /// An axis has a fault.
    #[error("node {node}: in fault: {cause}")]
    Fault {
        node: NodeId,
        /// From its emergency, if one has come.
        cause: Cause,
    },
    /// An axis has left OPERATION ENABLED.
    #[error("node {node}: it has left OPERATION ENABLED for {state}")]
    LeftOperationEnabled { node: NodeId, state: State },
    /// An axis is in OPERATION ENABLED, but reports that it does not follow its set-points
    #[error("node {node}: it does not follow its set-points (status word {status_word:04X})")]
    Ignores { node: NodeId, status_word: u16 },
    /// An axis has not reached OPERATION ENABLED in time.
    #[error("node {node}: it stays in {state}")]
    NotEnabled { node: NodeId, state: State },
    /// An axis has restarted: it was reset, or its power failed.
    #[error("node {node}: it has restarted")]
    Restarted { node: NodeId },
    /// An axis has left NMT OPERATIONAL.
    #[error("node {node}: it is {state:?}, and exchanges no PDOs")]
    NotOperational {
        node: NodeId,
        /// According to its heartbeat.
        state: NmtState,
    },
}

/// The state of an axis at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It has been seen to stand, in this state.
    AtRest(State),
    /// It has a fault, and has been seen to stand.
    Fault(Cause),
    /// It moved by its last PDO, and its motor has been released.
    Moving,
    /// It sent nothing any more, so its motion is not known.
    Silent,
    /// It has restarted, and has been sent nothing since.
    Restarted,
}

/// The result of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct AxisReport {
    pub node: NodeId,
    pub end: End,
    /// The last position that it sent.
    pub position: i32,
    pub set_point: i32,
    /// The largest distance from its last four set-points while it followed.
    pub following_error: u32,
    /// In how many cycles its PDO did not come.
    pub missing: u64,
    /// How many PDOs came only after the next SYNC.
    pub late: u64,
}

/// How a path ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Why it was stopped; `None` if it has been followed to its end.
    pub reason: Option<Reason>,
    /// How many cycles took set-points of the path before the stop.
    pub cycles: u64,
    /// How many cycles the follower missed.
    pub missed: u64,
    /// The largest delay of a cycle as the state machine saw it; the interface adds to it.
    pub latest: Duration,
    /// In the order of [`Follower::new`](super::Follower::new).
    pub axes: Vec<AxisReport>,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            End::AtRest(state) => write!(f, "at rest, {state}"),
            End::Fault(cause) => write!(f, "at rest, in fault: {cause}"),
            End::Moving => f.write_str("released while it moved"),
            End::Silent => f.write_str("silent"),
            End::Restarted => f.write_str("restarted"),
        }
    }
}

/// One line for the path, and one for each axis.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.reason {
            Some(reason) => write!(f, "stopped after {} cycles: {reason}", self.cycles)?,
            None => write!(f, "followed to its end in {} cycles", self.cycles)?,
        }
        for axis in &self.axes {
            let AxisReport { node, end, position, set_point, following_error, missing, late } = axis;
            write!(
                f,
                "\nnode {node}: {end}, at {position} of {set_point}, following error {following_error}, \
                 {missing} PDOs missing, {late} late"
            )?;
        }
        Ok(())
    }
}
