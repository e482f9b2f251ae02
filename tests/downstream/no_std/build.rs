fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().eds("eds/valve.eds").storage(true).generate()
}
