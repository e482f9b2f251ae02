//! Operations on one node: recognise, read, write, compare with its data sheet, download a program.

pub mod check;
pub mod flash;
pub mod followed;
pub mod identity;
pub mod remote;
pub mod stored;
