//! A typed machine.
#![no_std]

pub mod machine {
    lexican_runtime::include_od!("machine");
}
