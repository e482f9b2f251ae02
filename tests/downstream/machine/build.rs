fn main() -> Result<(), lexican_machine::BuildError> {
    lexican_machine::generate("machine.toml", lexican_machine::Config::new())
}
