//! A CiA 402 servo, without I/O: it is lent the dictionary of its device.
//!
//! ```text
//! measure(now, od)  before each frame or deadline of the device: puts into the dictionary what is measured then
//! update(now, od)   after it: takes the orders of the dictionary
//! sync(now, od)     SYNC came, and its RPDOs are in the dictionary
//! set_point()       an RPDO with a set-point came
//! next_event()      when to call update
//! next_emergency()  what to send
//! ```
//!
//! [`follow`] and [`report`] do it for a [`Device`](lexican_runtime::device::Device). Positions are those of 6064h; the axis moves in closed form, so nothing
//! depends on how often it is asked.
//!
//! # What CiA 402 leaves open
//!
//! | question | here |
//! |---|---|
//! | an edge of bit 4 that comes with the command to enable | starts nothing |
//! | another mode while the axis moves | the axis brakes with 6084h; the velocity and torque modes go on from its velocity |
//! | bit 10 while OPERATION ENABLED and nothing was ordered | set: the axis is where it is to be, unless [`ServoModel::rest_is_reached`] says otherwise |
//! | several causes of faults or warnings | each has its EMCY; the end of one beside others has what they leave in 1001h; the last fault stays until it is reset |
//! | a set-point beyond 607Dh | travels to the limit, with bit 11 |
//! | a limit switch in the direction of motion | brakes with 6085h, with bit 11; a travel is over |
//! | a shaft that is free again | the travel is planned anew from where it is |
//! | a set-point of a cyclic mode that is further away than 6065h | a following error at once |
//! | a cyclic mode without a new set-point | goes on with its velocity; after [`ServoModel::missed_cycles`] a fault |
//! | torque | turns the axis in proportion: a load like a fan |
//! | homing without the switch that it needs | bit 13 at once |
//! | where homing ends | at the home position, which 607Ch then is |
//!
//! Profiles are trapezoidal (6086h is not looked at), and 6082h is taken as 0.

mod cyclic;
mod follow;
mod homing;
mod inputs;
mod model;
mod objects;
mod order;
mod parameters;
mod parts;
mod points;
mod power;
mod probe;
pub mod script;
mod status;
mod update;
mod watch;

pub use follow::{follow, report};
pub use inputs::{Causes, Inputs, Machine};
pub use model::{FaultCodes, Scales, Servo, ServoModel};
pub use parameters::DEFAULTS;
pub use parts::Emergency;
pub use status::measures;
