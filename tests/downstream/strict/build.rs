//! Generates all that can be generated.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().device("siko/ag03-1").storage(true).names(true).generate()
}
