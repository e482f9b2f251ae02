//! Generates the dictionary, for the device's side, and links without a board.

fn main() -> Result<(), lexican_codegen::Error> {
    println!("cargo:rustc-link-arg-bins=--entry=run");
    println!("cargo:rustc-link-arg-bins=--undefined=run");
    lexican_codegen::Config::new()
        .eds("ds301.eds")
        .storage(true)
        // So that the file stays short.
        .allow("eds::compact-pdo")
        .generate()
}
