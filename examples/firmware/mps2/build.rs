//! Passes the board's memory map to the linker, and generates the machine of the master.

use std::env;
use std::path::PathBuf;

fn main() -> Result<(), lexican_machine::BuildError> {
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo runs this"));
    println!("cargo:rustc-link-search={}", here.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rerun-if-changed=memory.x");
    lexican_machine::generate("machine.toml", lexican_machine::Config::new())
}
