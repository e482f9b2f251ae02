//! SIKO's simulated drives, and the gateway and the driver with them, in virtual time.

mod any_orders;
mod commissioning;
mod controller;
mod described;
mod driver;
mod eeprom;
mod flooded;
mod gateway;
mod node;
mod parts;
mod power;
mod script;
mod session;
mod start_by_sync;
mod support;
mod tokio_driver;
mod trouble;
