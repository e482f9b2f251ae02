//! PROFIBUS-DP for drives, without I/O: telegrams and their state machines, and a simulated slave.
//!
//! - [`pkw`]: reading and writing the parameters of a drive in its cyclic data (PROFIDRIVE version 2): the
//!   [master's side](pkw::PkwMaster) and the [slave's](pkw::PkwServer);
//! - [`profidrive`]: bits of control and status words, and the places of the words;
//! - [`dp`]: the services of DP-V0: parameterisation, configuration, diagnosis in words, global control;
//! - [`fdl`]: telegrams of the data link layer;
//! - [`Slave`]: a DP-V0 slave, which takes bytes of the bus, works with an [`Application`], and returns the bytes of
//!   its answers;
//! - with the feature `master`: the master of the crate `profirust` on a line (`master`), with simulated slaves in virtual
//!   time (`virtual_bus`, `virtual_line`), or at a serial port (`serial_line`);
//! - with the feature `gsd`: start-up data from a slave's GSD file (`gsd`).
//!
//! The master is always `profirust`; this crate has no other.
//!
//! Clauses are those of EN 50170-2 (PROFIBUS) and of the PROFIDRIVE profile, version 2, as cited by public texts and
//! the manuals of drives. The standards themselves were not available: where a choice is an assumption, its
//! documentation says so.
#![no_std]

#[cfg(feature = "master")]
extern crate std;

#[cfg(feature = "master")]
pub mod bus;
pub mod dp;
pub mod fdl;
#[cfg(feature = "gsd")]
pub mod gsd;
#[cfg(feature = "master")]
pub mod master;
pub mod pkw;
pub mod profidrive;
#[cfg(feature = "master")]
pub mod serial_line;
mod slave;
#[cfg(feature = "master")]
mod trouble;
#[cfg(feature = "master")]
pub mod virtual_bus;
#[cfg(feature = "master")]
pub mod virtual_line;

pub use slave::{Application, BitRate, Identity, Slave, State};
#[cfg(feature = "master")]
pub use trouble::Trouble;

/// The README, so that its examples are compiled.
#[cfg(all(doctest, feature = "master"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
