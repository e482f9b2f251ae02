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
//! [`follow()`] and [`report`] do all this for a [`Device`](lexican_runtime::device::Device). Positions are those of
//! 6064h. Motion is calculated in closed form, so nothing depends on how often the servo is called.
//!
//! # Decisions where CiA 402 is silent
//!
//! | question | here |
//! |---|---|
//! | a rising edge of bit 4 in the control word that enables | starts nothing |
//! | another mode while the axis moves | the axis brakes with 6084h; the velocity and torque modes continue from its velocity |
//! | bit 10 in OPERATION ENABLED before any order | set, since the axis is where it is to be, unless [`ServoModel::rest_is_reached`] says otherwise |
//! | several causes of faults or warnings | each sends its EMCY; when one ends, its EMCY has the 1001h that the others leave; the last fault stays until it is reset |
//! | a set-point beyond 607Dh | travels to the limit, with bit 11 |
//! | a limit switch in the direction of motion | brakes with 6085h, with bit 11; a travel is over |
//! | a blocked shaft that becomes free | the travel is planned anew from its position |
//! | a set-point of a cyclic mode that is further away than 6065h | a following error at once |
//! | a cyclic mode without a new set-point | goes on with its velocity; after [`ServoModel::missed_cycles`] a fault |
//! | torque | turns the axis at a proportional velocity, as a fan does |
//! | homing without the switch that it needs | bit 13 at once |
//! | where homing ends | at the home position, which then has the position 607Ch |
//!
//! Profiles are trapezoidal whatever 6086h says, and 6082h is taken as 0.

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
