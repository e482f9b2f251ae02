//! The simulated AG03/1, as a [`Model`] of [`siko::sim`].
//!
//! # Decisions where the manual is silent
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
//! | a target out of range in an RPDO | not taken; its control word may stop, but starts nothing |
//! | loop positioning whose turn lies beyond a limit | travels there |
//! | inching that passes a limit | stops behind it |
//! | inching outwards from exactly at a limit, where the drive is not beyond it | is not started |
//! | inching with Stop (bit 8) set | is not started |
//! | inching, and "no active travel job" | clears the ready bits of 1002h and 6041h, but not bit 14; the driver relies on it |
//! | the deceleration of inching 1, and d-Pos (parameter 31) during inching | a-Inch; d-Pos is of no meaning |
//! | the end of inching 1, and bit 10 of 6041h | is a target reached |
//! | torque deactivation (2.3) and in-position mode (parameter 26) in inching | are for travels only |
//! | 2450h, 2410h:08, :09 and 2416h while the drive inches | hold from the next inching on |
//! | the loop length (parameter 27) | counts behind the gear, in increments |
//! | 607Eh is written | the position changes its sign |
//! | 1011h:01, :02 and the calibration value | 607Ch becomes 0; the position stays |
//! | the tolerance of the supply (table 21, bit 4) | 18 V to 35 V: no fault A, no fault G |
//! | guarding requests while 100Ch or 100Dh is 0 | are answered; nothing expires |
//! | FAULT when NMT leaves OPERATIONAL (7.2.2.3, 7.2.2.5) | stays, until it is reset |
//! | a start in velocity mode while a job is active (2.2.2; bit 14 is 0 there) | changes the velocity |
//! | the abort code where table 19 has none | the nearest of its eight |
//! | 8120h, when the bus is well again | is over, with an EMCY 0000h |
//! | the target that "in position" refers to | that of the last travel, or else 607Ah |
//! | 6040h by SDO outside OPERATIONAL | 0800 0022h |
//! | 2412h, 6060h, 607Eh, 6091h and 1011h during a travel | 0800 0022h |
//! | the order of the bytes of an EMCY code (table 20) | as in CiA 301 |
//! | where the absolute encoder jumps, and what a flat battery does to it | nowhere, and nothing |
//! | "reaching the positioning window" (parameter 26) | the end of the travel |
//! | shorted windings (parameter 26, mode 1) | hold against a hand, take no current, and do not show in 1002h, bit 7 |
//! | parameters 1 to 3 (P, I, D) | are kept; the shaft follows its ramp exactly |
//! | the NMT state after a missing guarding request (7.2.11) | PRE-OPERATIONAL, as in CiA 301 |
//! | the positions of SW1 to SW8 that restore factory settings (2.4) | see [`Restore`] |
//! | the drive while it says that it has restored them | is not on the bus |
//! | the status LED with one of the two supplies | off |
//! | the times of the blink codes | as the flashes of CiA 303-3 |
//! | a drive whose bit rate is not that of the bus | is not heard, and hears nothing |
//!
//! # In pictures
//!
//! Drawn by the example `motion_plots`.
//!
#![doc = include_str!("../docs/positioning.svg")]
//!
#![doc = include_str!("../docs/loop.svg")]
//!
#![doc = include_str!("../docs/inching.svg")]
//!
#![doc = include_str!("../docs/velocity.svg")]
//!
#![doc = include_str!("../docs/stops.svg")]
//!
#![doc = include_str!("../docs/fault.svg")]

pub use siko::sim::*;

pub use crate::model::MODEL;
