//! The simulated AG02, as a [`Model`] of [`siko::sim`].
//!
//! # Decisions where the manual is silent
//!
//! Where both manuals are silent, it does the same as the simulated AG03/1. In addition:
//!
//! | Question | Here |
//! |---|---|
//! | which limit switch is at which end | 1 where positions are high |
//! | how a drive stops on a limit switch | with full deceleration; a positioning is over then |
//! | what the calibration switch does | makes the calibration value the position when it becomes active, unless a job is |
//! | SDO commands 2Fh, 2Bh, 27h, 22h and 21h (table 18 has 23h only) | 0601 0000h |
//! | 23h with a number that the object has no room for | 0601 0000h |
//! | the code of fault F in 1003h (table 20 has none) | 8120h, beside which it names the fault |
//! | 1001h after 8001h to 8004h | as after 8120h: bit 4, until the bus is said to be well, or a fault is reset |
//! | which EMCY bytes are high (table 20) | as in CiA 301 |
//! | the default 50 of 2410h:05 and :09 with the gear 135:1, which allows 35 | 35 |
//! | TPDO3 and TPDO4 of type 254 | are sent when anything in them changes, and not by the event timer, nor when OPERATIONAL begins |
//! | parameter 25, which no object holds | 0: full deceleration |
//! | the base of accelerations in per cent | that of the AG03/1: 4 rev/s² |
//! | the version of the firmware | 2.00 |

pub use siko::sim::*;

pub use crate::model::MODEL;
