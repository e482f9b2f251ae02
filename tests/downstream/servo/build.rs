//! The driver of a data sheet, and the driver of a variant with other objects: see `tests/drive.rs`.

use std::path::Path;

/// The variant: no velocity is measured, a profile can be set, and 1018h has no vendor-ID.
const OTHERWISE: [(&str, &str); 4] = [
    (
        "27=0x606C\n28=0x6071\n29=0x6077\n30=0x607A\n31=0x607C\n32=0x607D\n",
        "27=0x6071\n28=0x6077\n29=0x607A\n30=0x607C\n31=0x607D\n32=0x6081\n",
    ),
    (
        "[606C]\nParameterName=Velocity actual value\nDataType=4\nAccessType=ro",
        "[6081]\nParameterName=Profile velocity\nDataType=7\nAccessType=rw\nDefaultValue=1000",
    ),
    ("DefaultValue=0x2A\n", "DefaultValue=0\n"),
    ("ProductName=Servo", "ProductName=Otherwise"),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sheet = std::fs::read_to_string("eds/servo.eds")?;
    for (from, to) in OTHERWISE {
        assert!(sheet.contains(from), "the data sheet has no {from}");
        sheet = sheet.replace(from, to);
    }
    let path = Path::new(&std::env::var("OUT_DIR")?).join("otherwise.eds");
    std::fs::write(&path, sheet)?;
    println!("cargo::rerun-if-changed=build.rs");
    lexican_codegen::Config::new().eds("eds/servo.eds").driver(true).storage(true).generate()?;
    Ok(lexican_codegen::Config::new().eds(&path).driver(true).generate()?)
}
