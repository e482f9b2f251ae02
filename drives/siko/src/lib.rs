//! What SIKO's positioning drives share: the drivers' tables, and a drive that exists only in software.
//!
//! - [`state`], [`words`], [`fault`], [`worked_examples`]: tables of the manuals as data, which drivers and simulators
//!   share;
//! - [`description`]: what a driver has to know of all of them;
//! - [`order`]: what an interface without control words orders;
//! - [`gateway`]: the drive behind such an interface as a CANopen node;
//! - [`model`]: what differs between the drives, as data, for gateway and simulated drive;
//! - [`sim`]: the simulated drive. Nothing else here uses it.
//!
//! Chapters, tables and figures are those of the English CANopen manual of the AG03/1, firmware 4.01 or higher. Where
//! it contradicts itself or is silent, the choice is said where it is made.

pub mod description;
pub mod fault;
mod frames;
pub mod gateway;
pub mod model;
pub mod order;
pub mod sim;
pub mod state;
pub mod words;
pub mod worked_examples;
