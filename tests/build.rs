//! Generates the dictionaries of the device that the interoperability runs play, and of the one that the
//! conformance test tests.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new().eds("interop/peer.eds").eds("conformance/device.eds").storage(true).generate()
}
