//! PROFIBUS without I/O: slave, master, stations, GSD. `pseudo_terminal` is apart, since it takes real time.

mod any_bytes;
mod gsd;
mod master;
mod random;
mod slave;
mod station;
mod support;
mod trouble;
