fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().eds("eds/servo.eds").driver(true).storage(true).generate()
}
