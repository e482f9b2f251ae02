//! The object dictionary, generated from the data sheet.

lexican_runtime::include_od!("io");

/// The services: three PDOs in each direction with up to eight objects, one SDO server, two heartbeat consumers.
pub(crate) type Services = lexican_runtime::device::Device<3, 3, 1, 2, 8>;
