//! Generates the dictionary of the drive, for the device's side.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .device("siko/ag03-1")
        .module("drive")
        .storage(true)
        // Where the drive deviates from CiA 301, the data sheet describes the drive.
        .allow("cia301::data-type")
        .allow("eds::highest-sub")
        .allow("eds::sub-0-type")
        .generate()
}
