fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .eds("eds/valve.eds")
        .storage(true)
        // A device configuration file, whose values go before the defaults.
        .eds("eds/configured.dcf")
        .generate()
}
