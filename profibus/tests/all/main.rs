//! PROFIBUS without I/O: slave, master, stations, GSD. Apart from `pseudo_terminal`, which takes real time.

mod any_bytes;
mod gsd;
mod master;
mod random;
mod slave;
mod station;
mod support;
mod trouble;
