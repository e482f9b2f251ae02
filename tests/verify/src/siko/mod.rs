//! What the manuals of SIKO's drives share beyond what any manual has: tables and their behaviour.

pub(crate) mod bench;
pub(crate) mod bits;
pub(crate) mod examples;
pub(crate) mod facts;
pub(crate) mod faults;
pub(crate) mod formats;
pub(crate) mod leds;
pub(crate) mod network;
pub(crate) mod objects;
pub(crate) mod parameters;
pub(crate) mod statements;
pub(crate) mod states;
pub(crate) mod tables;
pub(crate) mod values;
