//! The file of the EEPROM: it is read as it was written, and anything else is refused.

use std::collections::BTreeMap;

use lexican_runtime::object::Address;
use lexican_runtime::{Instant, NodeId};
use proptest::prelude::*;
use siko_ag03_1::od;
use siko_ag03_1::sim::{EepromError, MODEL, NonVolatile, Setup, SimulatedDrive};

fn read(text: &str) -> Result<NonVolatile, EepromError> {
    NonVolatile::from_text(&MODEL, text)
}

const HEAD: &str = "lexican siko/ag03-1 eeprom 1";

fn kept() -> NonVolatile {
    NonVolatile {
        eeprom: BTreeMap::from([(Address::new(0x2410, 0x0A), 101)]),
        position: -5000,
        ..NonVolatile::default()
    }
}

#[test]
fn what_is_kept_reads_back_as_written() {
    let text = kept().to_text(&MODEL);
    assert!(text.starts_with("lexican siko/ag03-1 eeprom 1\nposition -5000\n2410:0A 0x65\nend 1 entries, crc32 "));
    assert_eq!(read(&text).unwrap(), kept());
    assert_eq!(read(&text.replace('\n', "\r\n")).unwrap(), kept());
    assert_eq!(read(&NonVolatile::default().to_text(&MODEL)).unwrap(), NonVolatile::default());
}

#[track_caller]
fn check(text: &str, expected: &str) {
    let found = read(text).expect_err(text).to_string();
    assert!(found.starts_with(expected), "{found}\nof {text:?}");
}

#[test]
fn what_something_else_has_written_is_refused() {
    check("", "empty, as after a power failure; remove it");
    check("position -5000\n2410:01 0x64\n", "not the EEPROM");
    check("%PDF-1.4\n", "not the EEPROM");
    check(&kept().to_text(&MODEL).replace("eeprom 1", "eeprom 2"), "the EEPROM of a simulated AG03/1, but of another");
}

#[test]
fn what_is_cut_off_anywhere_is_refused() {
    let text = kept().to_text(&MODEL);
    for end in HEAD.len()..text.len() {
        check(&text[..end], "cut off or changed");
    }
}

#[test]
fn what_is_changed_anywhere_is_refused() {
    let text = kept().to_text(&MODEL);
    for at in 0..text.len() - 1 {
        let mut bytes = text.clone().into_bytes();
        bytes[at] = if bytes[at] == b'0' { b'1' } else { b'0' };
        assert!(read(&String::from_utf8(bytes).unwrap()).is_err(), "byte {at}");
    }
}

#[test]
fn a_line_that_is_none_is_named() {
    for line in ["position x", "2410 0x1", "2410:01 1", "5555:00 0x1", ""] {
        check(&MODEL.eeprom.seal(&[line.to_owned()]), &format!("line 2: `{line}` is neither `position -5000` nor"));
    }
}

#[test]
fn parameter_25_has_a_line_where_no_object_holds_it() {
    let ag02 = &siko_ag02::sim::MODEL;
    let kept = NonVolatile { inching_stop: 1, ..NonVolatile::default() };
    let text = kept.to_text(ag02);
    assert!(text.starts_with("lexican siko/ag02 eeprom 1\nposition 0\ninching_stop 1\nend 0 entries, "), "{text}");
    assert_eq!(NonVolatile::from_text(ag02, &text).unwrap(), kept);
    // A file of a version that did not store parameter 25 yet.
    let before = ag02.eeprom.seal(&["position 0".to_owned()]);
    assert_eq!(NonVolatile::from_text(ag02, &before).unwrap(), NonVolatile::default());
    let line = |line: &str| vec![line.to_owned()];
    assert!(NonVolatile::from_text(ag02, &ag02.eeprom.seal(&line("inching_stop 2"))).is_err());
    check(&MODEL.eeprom.seal(&line("inching_stop 1")), "line 2: `inching_stop 1` is neither");
}

#[test]
fn what_the_dictionary_does_not_take_stays_at_its_default() {
    let mut setup = Setup::new(&MODEL, NodeId::literal(5));
    setup.non_volatile.eeprom.insert(od::MOTOR_PARAMETER_SET.a_pos().address(), 200);
    setup.non_volatile.eeprom.insert(Address::new(0x5555, 0), 1);
    let drive = SimulatedDrive::power_on(Instant::ZERO, setup);
    assert_eq!(drive.stored(od::MOTOR_PARAMETER_SET.a_pos()).0, 50);
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(lines in prop::collection::vec("(position |[0-9A-F]{4}:|end |0x)?.{0,12}", 0..5)) {
        let text = format!("{HEAD}\n{}", lines.join("\n"));
        prop_assert!(read(&text).is_err(), "without its checksum, it is torn");
    }
}
