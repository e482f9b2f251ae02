fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .eds("../../no_std/eds/valve.eds")
        .storage(true)
        .names(true)
        .runtime_path("::bus::canopen")
        .generate()
}
