//! Generates the dictionaries of the device that the interoperability runs play, and of those that the conformance test tests.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .eds("interop/peer.eds")
        .eds("conformance/device.eds")
        .eds("conformance/lss.eds")
        .eds("conformance/servo.eds")
        .storage(true)
        .generate()
}
