fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .eds("eds/valve.eds")
        .storage(true)
        .names(true)
        .runtime_path("::bus::canopen")
        .generate()
}
