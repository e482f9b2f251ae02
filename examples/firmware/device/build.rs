//! Generates the dictionary from the data sheet.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().eds("eds/io.eds").module("io").storage(true).generate()
}
