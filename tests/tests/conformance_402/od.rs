//! The dictionary of the servo under test, generated from `tests/conformance/servo.eds`.

lexican_runtime::include_od!("servo");
