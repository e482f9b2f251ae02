//! Generates the dictionary from the data sheet that comes with lexican.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .device("siko/ag03-1")
        .module("siko_ag03_1")
        .storage(true)
        // Where the drive deviates from CiA 301 and 402, the data sheet says what the drive does: each case is
        // in its PROVENANCE.md.
        .allow("cia301::data-type")
        .allow("eds::highest-sub")
        .allow("eds::sub-0-type")
        .generate()
}
