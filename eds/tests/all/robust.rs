//! No text makes the reader panic, loop, or take unlimited memory.

use crate::exercise;
use lexican_eds::{Input, MAX_PER_CODE, Memory, Source, load, load_again};
use proptest::prelude::*;
use proptest::sample::Index;

/// Pieces of data sheets, so that random texts get beyond the first key.
const PIECES: &[&str] = &[
    "[FileInfo]\n",
    "[DeviceInfo]\n",
    "[2000]\n",
    "[2000sub0]\n",
    "[2000subFF]\n",
    "[1A00]\n",
    "[1A00sub1]\n",
    "[1018]\n",
    "[2000Name]\n",
    "[2000Value]\n",
    "[2000ObjectLinks]\n",
    "[OptionalObjects]\n",
    "[Comments]\n",
    "[DummyUsage]\n",
    "[M1Fixed2000]\n",
    "[M1SubExt2000]\n",
    "[SupportedModules]\n",
    "[DynamicChannels]\n",
    "[DeviceComissioning]\n",
    "ParameterName=x\n",
    "ObjectType=9\n",
    "ObjectType=7\n",
    "DataType=7\n",
    "DataType=0x1B\n",
    "DataType=8\n",
    "AccessType=rw\n",
    "DefaultValue=-99999999999999999999999999999999999999\n",
    "DefaultValue=$NODEID+0xFFFFFFFFFFFFFFFF\n",
    "DefaultValue=0x20000040\n",
    "LowLimit=1e308\n",
    "HighLimit=0x8000000000000000\n",
    "CompactSubObj=255\n",
    "SubNumber=70000\n",
    "PDOMapping=1\n",
    "SupportedObjects=4294967295\n",
    "NrOfEntries=-1\n",
    "NrOfEntries=65535\n",
    "1=0x2000\n",
    "4294967295=1\n",
    "Range1=0xA000-0xA0FF\n",
    "Type1=5\n",
    "Dummy0005=1\n",
    "Line1=\n",
    "NodeID=300\n",
    "x\\\n",
    "=\n",
    "[\n",
    "]\n",
    ";\n",
    "\r",
    "\0",
    "\u{feff}",
    "é",
    "key:value\n",
    "DataType 7\n",
];

proptest! {
    // A failed case becomes a named test, instead of an entry in a file.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_text_makes_the_reader_panic(pieces in proptest::collection::vec(proptest::sample::select(PIECES), 0..60)) {
        exercise(pieces.concat().as_bytes(), "");
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        exercise(&bytes, "");
    }

    /// Bytes are cut anywhere, so that encodings change as well; sections are copied, too.
    #[test]
    fn reading_again_gives_what_reading_gives(
        edits in proptest::collection::vec((any::<[Index; 3]>(), 0..60_usize, proptest::sample::select(PIECES)), 1..12),
    ) {
        let (mut memory, mut bytes) = (Memory::default(), SHEET.as_bytes().to_vec());
        for ([from, to, copied], length, piece) in edits {
            let overlay = Source::new("x.toml", OVERLAY_PIECES[copied.index(OVERLAY_PIECES.len())]);
            let input = Input::new(Source::from_bytes("x.eds", &bytes)).overlay(overlay);
            prop_assert_eq!(load_again(&input, &mut memory), load(&input));
            let part = |at: Index| at.index(bytes.len())..bytes.len().min(at.index(bytes.len()) + length);
            let new = [piece.as_bytes(), &bytes[part(copied)]][to.index(2)].to_vec();
            bytes.splice(part(from), new);
            bytes.push(b'\n');
        }
    }

    #[test]
    fn no_overlay_makes_the_reader_panic(
        keys in proptest::collection::vec(proptest::sample::select(OVERLAY_PIECES), 0..30),
    ) {
        exercise(b"[2000]\nParameterName=x\nDataType=6\nAccessType=rw\n[2001]\nObjectType=8\nCompactSubObj=3\nDataType=6\n", &keys.concat());
    }
}

/// A data sheet with findings of lines, keys and objects.
const SHEET: &str = "Key=1\r\n[FileInfo]\r\nFileName=x.eds\r\nDescription=Gerät\n[OptionalObjects]\nSupportedObjects=2\n1=0x1000\n2=0x1018\n\
     [1000]\rParameterName=Device type\rObjectType=7\rDataType 7\rAccessType:ro\r; a comment\r\r[ 2000 \nParameterName=\u{b0}C\n\
     ObjectType=8\nSubNumber=3\n[2000sub0] x\nstray\nDataType=0x0005\nAccessType=ro\nDefaultValue=2\n\n[2000sub1]\n\
     DataType=0x0006\nAccessType=rw\nDefaultValue=$NODEID+0x180\nLowLimit=5\nHighLimit=1\n";

const OVERLAY_PIECES: &[&str] = &[
    "[overlay]\n",
    "format = 1\n",
    "format = 9223372036854775807\n",
    "names = [1]\n",
    "[object.\"2000\"]\n",
    "[object.\"2001\"]\n",
    "[object.\"2001:03\"]\n",
    "[object.\"x\"]\n",
    "reason = \"r\"\n",
    "default = 70000\n",
    "default = nan\n",
    "low = -1\n",
    "high = \"0xFFFF\"\n",
    "data_type = \"INTEGER8\"\n",
    "data_type = 99999\n",
    "access = \"ro\"\n",
    "pdo_mapping = true\n",
    "enumeration = \"E\"\n",
    "bit_field = \"B\"\n",
    "quantity = \"Q\"\n",
    "ranges = [{ when = \"2001:00 == 99999999999999999999\", low = 2, high = 1 }]\n",
    "[enumeration.E]\n",
    "values = [{ value = 1, name = \"a\" }, { value = 1, name = \"a\" }]\n",
    "[bit_field.B]\n",
    "fields = [{ bits = \"9..3\", name = \"a\" }, { bits = 200, name = \"b\" }]\n",
    "[quantity.Q]\n",
    "units = [{ symbol = \"x\", method = \"X\", scale = \"1/0\" }]\n",
    "[[pdo]]\n",
    "direction = \"transmit\"\n",
    "number = 0\n",
    "number = 512\n",
    "mapping = [\"2000:00\", \"9999:00\", \"0005:00\"]\n",
    "cob_id = \"$NODEID+0x180\"\n",
    "[object]\n",
    "= 1\n",
    "\"\n",
    "[[\n",
    "writable_in = [\"operational\", \"x\"]\n",
];

fn exercise(bytes: &[u8], overlay: &str) {
    let input = Input::new(Source::from_bytes("x.eds", bytes));
    exercise::exercise(&if overlay.is_empty() { input } else { input.overlay(Source::new("x.toml", overlay)) });
}

#[test]
fn findings_beyond_the_thousandth_are_counted() {
    let text: String = (0..MAX_PER_CODE + 234).map(|i| format!("stray text {i}\n")).collect();
    let (_, diagnostics) = load(&Input::new(Source::new("x.eds", text)));
    assert_eq!(diagnostics.iter().filter(|finding| finding.code == "eds::stray-text").count(), MAX_PER_CODE);
    let more = diagnostics.iter().find(|finding| finding.code == "eds::more-findings").expect("the rest is counted");
    assert!(more.message.contains("234 more"), "{}", more.message);
}

#[test]
fn a_file_beyond_the_bounds_is_not_read() {
    let text = "\n".repeat(lexican_eds::text::MAX_LINES);
    let (device, diagnostics) = load(&Input::new(Source::from_bytes("x.eds", text.as_bytes())));
    assert!(device.objects.is_empty());
    assert_eq!(diagnostics.iter().map(|finding| finding.code).collect::<Vec<_>>(), ["eds::file-size"]);
}

#[test]
fn compact_objects_cannot_exhaust_memory() {
    let object = |index: u16| format!("[{index:04X}]\nObjectType=8\nCompactSubObj=254\nDataType=5\nAccessType=rw\n");
    let text: String = (0x2000..0x4000).map(object).collect();
    let (device, diagnostics) = load(&Input::new(Source::new("x.eds", text)));
    assert_eq!(device.objects.len(), 0x2000);
    assert!(device.entries().count() < 110_000);
    assert!(diagnostics.iter().any(|finding| finding.code == "eds::too-many-entries"));
}

#[test]
fn a_short_file_with_compact_pdos_stays_small() {
    let text = "[DeviceInfo]\nCompactPDO=0x3F\nNrOfRXPDO=512\nNrOfTXPDO=512\n";
    for (granularity, is_bounded) in [("1", true), ("8", false)] {
        let input = Input::new(Source::new("x.eds", format!("{text}Granularity={granularity}\n")));
        let (device, diagnostics) = load(&input);
        assert!(device.entries().count() <= 20_000, "{granularity}");
        assert_eq!(
            diagnostics.iter().any(|finding| finding.code == "eds::too-many-entries"),
            is_bounded,
            "{granularity}"
        );
    }
}
