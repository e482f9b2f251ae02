//! A simulated CiA 402 servo, in virtual time.

mod any_orders;
mod cyclic;
mod homing;
mod node;
mod positions;
mod script;
mod states;
mod support;
mod velocities;
mod ways;
