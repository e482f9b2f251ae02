//! What SIKO's positioning drives share: tables of their manuals, and a simulated drive.
//!
//! - [`state`], [`words`], [`fault`], [`worked_examples`]: tables of the manuals as data, for drivers and simulators;
//! - [`description`]: what a driver has to know of all drives;
//! - [`order`]: the orders of an interface without control words;
//! - [`gateway`]: a drive behind such an interface as a CANopen node;
//! - [`model`]: the differences between the drives, as data, for gateway and simulated drive;
//! - [`sim`]: the simulated drive. No other module uses it.
//!
//! Chapters, tables and figures are those of the English CANopen manual of the AG03/1, firmware 4.01 or higher. Where
//! it contradicts itself or is silent, a comment states the choice.

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
