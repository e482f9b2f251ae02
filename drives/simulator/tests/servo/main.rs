//! A simulated CiA 402 servo, in virtual time.

mod cyclic;
mod positions;
mod states;
mod support;
mod velocities;
