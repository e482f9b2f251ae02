//! Generates the dictionaries of the devices for the interoperability runs and for the conformance test.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .eds("interop/peer.eds")
        .eds("conformance/device.eds")
        .eds("conformance/lss.eds")
        .eds("conformance/servo.eds")
        .storage(true)
        .generate()
}
