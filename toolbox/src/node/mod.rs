//! What is done with one node: it is recognised, read and written, compared with its data sheet, and given a program.

pub mod check;
pub mod flash;
pub mod followed;
pub mod identity;
pub mod remote;
pub mod stored;
