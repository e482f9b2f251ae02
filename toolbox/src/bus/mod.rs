//! What happens on a bus: which frames are worth a look, what belongs together, and how much there is of it.

pub mod changes;
pub mod cob_ids;
pub mod filter;
pub mod sdo_channel;
pub mod statistics;
pub mod transfers;
