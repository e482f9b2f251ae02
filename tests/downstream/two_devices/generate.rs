fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().device("siko/ag03-1").eds("../no_std/eds/valve.eds").generate()
}
