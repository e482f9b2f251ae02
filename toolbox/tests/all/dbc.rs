//! The CAN database of a data sheet with every kind of mapping: `dbc/device.dbc` is the expected file
//! (`LEXICAN_BLESS=1` writes it), and Python's cantools reads the same values from frames.

use std::path::{Path, PathBuf};
use std::{env, fs};

use lexican_eds::{Input, Source, load};
use lexican_runtime::NodeId;
use lexican_toolbox::pdo::dbc::{Database, Node};

use crate::cantools;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dbc")
}

fn database() -> Database {
    let source = |name: &str| Source::new(name, fs::read_to_string(folder().join(name)).unwrap());
    let input = Input::new(source("device.eds")).overlay(source("device.toml"));
    let (device, findings) = load(&input);
    assert!(findings.is_empty(), "{}", findings.render(&input));
    Database::new(&[5, 6].map(|id| Node::new(NodeId::literal(id), &device)))
}

#[test]
fn the_database_is_what_it_was() {
    let (path, database) = (folder().join("device.dbc"), database());
    let bytes = database.to_bytes();
    assert!(bytes.windows(3).any(|unit| unit == b"\"\xB0C"), "code page 1252");
    // In UTF-8, like all files here.
    let text = Source::from_bytes("device.dbc", &bytes);
    if env::var_os("LEXICAN_BLESS").is_some() {
        fs::write(&path, text.text()).unwrap();
    }
    assert_eq!(text.text(), fs::read_to_string(&path).unwrap());
    // Both nodes have the same extended COB-ID.
    assert_eq!(database.left_out, ["Node6_TPDO3"]);
}

/// Prints values in frames, as cantools returns them by name and unit.
const SCRIPT: &str = r#"
import sys, cantools
db = cantools.database.load_file(sys.argv[1])
for message in db.messages:
    message.decode(bytes(message.length), allow_truncated=True)
for frame, extended, data in [
    (0x185, False, "E7 03 FF 0C FE FF FF FF"), (0x285, False, "00 00 C0 3F 01"), (0x12345, True, "03"),
    (0x205, False, "06 00 07 F6"), (0x705, False, "05"), (0, False, "81 05"), (0x85, False, "10 23 11 00 00 00 00 00"),
]:
    message = db.get_message_by_frame_id(frame, force_extended_id=extended)
    values = message.decode(bytes.fromhex(data))
    units = {signal.name: signal.unit or "" for signal in message.signals}
    print(message.name, *(f"{name}={value}{units[name]}" for name, value in values.items()))
"#;

const DECODED: &str = "\
Node5_TPDO1 Temperature=99.9°C Statusword=3327 Position=-2
Node5_TPDO2 Pressure_absolute=1.5bar Valve=open
Node5_TPDO3 Level_of_the_tank_on_the_left_in=3
Node5_RPDO1 Controlword=6 Set_point=-10
Node5_Heartbeat State=operational Toggle=0
NMT Command=reset node Node=5
Node5_EMCY Error_code=8976 Error_register=17 Manufacturer_specific=0
";

#[test]
fn cantools_reads_the_same_from_it() {
    if let Some(decoded) = cantools::run(SCRIPT, &database().to_bytes()) {
        assert_eq!(decoded, DECODED);
    }
}
