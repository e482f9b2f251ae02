//! The words of CiA 301 and 402: objects and identifiers by name, data types, modes of operation.
//!
//! Users reach them through `lexican_runtime` (`cia301`, `object::DataType`, `profile::cia402`) and `lexican_eds`
//! (`cia301`, `types`).
#![no_std]

pub mod cia301;
pub mod cia402;
mod data_type;

pub use data_type::{Class, DataType};
