//! The objects of the data sheet.

lexican_runtime::include_od!("io");
