//! The dictionary of the device under test, generated from `tests/conformance/device.eds`.

lexican_runtime::include_od!("device");
