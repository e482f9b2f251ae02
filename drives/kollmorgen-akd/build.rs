//! Generates the dictionary from the data sheet that comes with lexican.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().device("kollmorgen/akd").storage(true).generate()
}
