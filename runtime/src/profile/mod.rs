//! What device profiles add to CiA 301.

pub mod cia402;
