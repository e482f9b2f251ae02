//! The SIKO AG03/1 positioning drive: a typed driver, and a drive that exists only in software.

pub mod fault;
pub mod sim;
pub mod state;
pub mod words;
pub mod worked_examples;
