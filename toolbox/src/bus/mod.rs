//! A bus as a whole: filters, changes, SDO transfers, statistics.

pub mod changes;
pub mod cob_ids;
pub mod filter;
pub mod sdo_channel;
pub mod statistics;
pub mod transfers;
