//! SIKO's simulated drives, the gateway and the driver over them, in virtual time.

mod any_orders;
mod commissioning;
mod controller;
mod controller_rig;
mod described;
mod driver;
mod eeprom;
mod flooded;
mod gateway;
mod node;
mod objects;
mod orders;
mod other_doors;
mod parts;
mod power;
mod remains;
mod script;
mod session;
mod start_by_sync;
mod support;
mod tokio_driver;
mod trouble;
mod variants;
