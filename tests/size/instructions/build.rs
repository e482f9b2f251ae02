//! Generates the dictionary, and passes the board's memory map to the linker.

fn main() -> Result<(), lexican_codegen::Error> {
    println!("cargo:rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rerun-if-changed=memory.x");
    lexican_codegen::Config::new()
        .eds("../ds301.eds")
        .storage(true)
        .allow("eds::compact-pdo")
        .generate()
}
