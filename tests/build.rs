//! Generates the dictionary of the device that the interoperability runs play.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().eds("interop/peer.eds").storage(true).generate()
}
