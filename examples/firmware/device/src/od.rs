//! The objects of the data sheet.

lexican_runtime::include_od!("io");

/// The services for these objects: three PDOs each way with up to eight objects, one SDO server, two heartbeats.
pub(crate) type Services = lexican_runtime::device::Device<3, 3, 1, 2, 8>;
