//! Orders of interfaces without the control words of CiA 402, and why one is refused.

use lexican_driver::Direction;

/// An order of an interface without the state machine of CiA 402.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The motor comes under control and holds its position.
    Enable,
    /// Brakes fully and keeps control, but takes no travel orders until it is enabled again.
    Hold,
    /// The motor loses its torque; a moving shaft coasts.
    Release,
    /// Travels to the target, or in velocity mode turns at the target velocity.
    Start,
    /// Interrupts a travel, which can be resumed, or stops any other motion.
    Interrupt(Braking),
    /// Goes on with a travel that was interrupted.
    Resume,
    /// Stops and drops the job. The motor stays under control.
    Abort(Braking),
    /// Inching operation 1: one step.
    Step,
    /// Inching operation 2, until [`Order::StopInching`].
    Inch(Direction),
    /// Ends inching operation 2, in the way that parameter 25 says.
    StopInching,
    /// Acknowledges faults.
    ResetFault,
}

/// How to brake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Braking {
    /// With the largest deceleration.
    Full,
    /// With the deceleration of the job.
    Programmed,
}

/// Why an order is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There is a fault, or its cause persists.
    Fault,
    /// The motor is not enabled.
    NotEnabled,
    /// The output stage is not supplied, or the enable input is not active.
    NoPower,
    /// A job is under way, or there is no job to resume.
    Busy,
    /// The order belongs to positioning mode, and the drive is in velocity mode.
    Mode,
    /// The limit switch in this direction is active.
    Switch(Direction),
    /// The position is beyond the limit in this direction.
    Limit(Direction),
    /// The target lies beyond a limit.
    Target,
}
