//! A drive that exists only in software: it serves the dictionary generated from the data sheet, moves as
//! chapter 2 of the manual says, and fails on demand as chapter 5 says.
//!
//! From the bottom up: [`trajectory`] solves ways in closed form, [`motion`] makes travel jobs of them,
//! [`controller`] adds state machine, status and faults; [`SimulatedDrive`] puts all of it on a bus.
//!
//! # What the manual leaves open
//!
//! | Question | Here |
//! |---|---|
//! | "maximum deceleration" of quick stop, fault, inching stop mode 0 | 100 %: 4 rev/s² |
//! | how a shaft without torque runs out (2.5) | with 2 rev/s² |
//! | a shaft that is blocked becomes fault B (the number in table 2 is lost) | after 500 ms |
//! | the supply of the output stage counts as present (table 1, bit 10) | from 10 V |
//! | the battery counts as low (table 1, bit 12) | below 2.6 V |
//! | 100 % of torque deactivation (2.3) | 2 A |
//! | the current that holds a position | 50 mA |
//! | a control word that enables the drive and starts a travel at once | only enables |
//! | New Setpoint together with Stop, or beyond the limits | not acknowledged |
//! | loop positioning whose turn lies beyond a limit | travels there |
//! | inching that passes a limit | stops behind it |
//! | the target that "in position" refers to | that of the last travel, or else 607Ah |
//! | 6040h by SDO outside OPERATIONAL | 0800 0022h |
//! | 2412h, 6060h, 607Eh, 6091h during a travel | 0800 0022h |
//! | the order of the bytes of an EMCY code (table 20) | as CiA 301 has it |
//! | where the absolute encoder jumps | nowhere |

pub mod controller;
mod drive;
pub mod inputs;
pub mod motion;
mod objects;
pub mod parameters;
mod setup;
mod status;
pub mod trajectory;

pub use drive::{SimulatedDrive, StatusLed};
pub use setup::{BEHAVIOUR, Gear, NonVolatile, NotNonVolatile, Setup};
