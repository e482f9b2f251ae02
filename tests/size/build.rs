//! Generates the dictionary for a device, and links without a board.

fn main() -> Result<(), lexican_codegen::Error> {
    println!("cargo:rustc-link-arg-bins=--entry=run");
    println!("cargo:rustc-link-arg-bins=--undefined=run");
    lexican_codegen::Config::new()
        .eds("ds301.eds")
        .storage(true)
        // Allowed to keep the file short.
        .allow("eds::compact-pdo")
        .generate()
}
