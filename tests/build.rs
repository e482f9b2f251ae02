//! Generates the dictionaries of the device that the interoperability runs play, of those that the conformance test
//! tests, and of the AKD.

fn main() -> Result<(), lexican_codegen::Error> {
    lexican_codegen::Config::new()
        .eds("interop/peer.eds")
        .eds("conformance/device.eds")
        .eds("conformance/lss.eds")
        .eds("conformance/servo.eds")
        .device("kollmorgen/akd")
        .storage(true)
        .generate()
}
