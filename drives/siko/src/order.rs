//! Orders as interfaces without the control words of CiA 402 give them, one by one, and why one is refused.

use lexican_driver::Direction;

/// What an interface without the state machine of CiA 402 can order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The motor comes under control and holds its position.
    Enable,
    /// Brakes fully and keeps control, but takes no travel orders until it is enabled again.
    Hold,
    /// The motor loses its torque; what moves runs out.
    Release,
    /// Travels to the target, or, in velocity mode, turns with the target velocity.
    Start,
    /// Stops a travel, which can be resumed; anything else that moves is brought to a standstill.
    Interrupt(Braking),
    /// Goes on with a travel that was interrupted.
    Resume,
    /// Stops and forgets the job. The motor stays under control.
    Abort(Braking),
    /// Inching operation 1: one step.
    Step,
    /// Inching operation 2, until [`Order::StopInching`].
    Inch(Direction),
    /// Ends inching operation 2, as parameter 25 says.
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
    /// There is a fault, or its cause is still there.
    Fault,
    /// The motor is not enabled.
    NotEnabled,
    /// The output stage is not supplied, or the input that enables it is not active.
    NoPower,
    /// A job is under way, or there is none to be resumed.
    Busy,
    /// Positioning mode has this order, velocity mode does not.
    Mode,
    /// The limit switch at the end that this direction leads to is active.
    Switch(Direction),
    /// The position is beyond the limit at the end that this direction leads to.
    Limit(Direction),
    /// The target lies beyond a limit.
    Target,
}
