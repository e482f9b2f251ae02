//! The machine in `machine.toml`, with the data sheets of its nodes.

lexican_runtime::include_od!("machine");
