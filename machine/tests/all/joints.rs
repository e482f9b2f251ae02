//! Six joints of a robot arm. The oracle are the records that `dcfgen` of lely-core (620d1858, run in November 2026)
//! writes as concise DCFs from ros2_canopen's `bus.yml` of the PRBT. The data sheet is ours, with the objects of these
//! records.

use std::fmt::Write as _;

use lexican_eds::Source;
use lexican_machine::{BusYml, Files, Machine, format};

const MACHINE: &str = include_str!("prbt.toml");

/// The records of a joint: index, sub-index, value, bytes; `n` is its node-ID.
fn records(n: u32) -> Vec<(u16, u8, u32, u32)> {
    let off = 0x8000_0000;
    let mut records = vec![(0x1017, 0, 1000, 2)];
    for (pdo, id, mapping) in [
        (0x1400, 0x200, &[0x6040_0010, 0x6060_0008, 0x60C1_0120][..]),
        (0x1401, 0x300, &[0x607A_0020]),
        (0x1800, 0x180, &[0x6041_0010, 0x6061_0008]),
        (0x1801, 0x280, &[0x6064_0020, 0x606C_0020]),
    ] {
        records.extend([(pdo, 1, off | (id + n), 4), (pdo + 0x200, 0, 0, 1)]);
        records.extend((1..).zip(mapping).map(|(sub, mapped)| (pdo + 0x200, sub, *mapped, 4)));
        records.extend([(pdo + 0x200, 0, mapping.len() as u32, 1), (pdo, 1, id + n, 4)]);
    }
    records.extend([(0x1802, 1, off | (0x380 + n), 4), (0x1803, 1, off | (0x480 + n), 4)]);
    records.extend([(0x6081, 0, 1000, 4), (0x60C2, 1, 10, 1)]);
    records
}

/// A data sheet with these objects.
pub(crate) fn sheet() -> String {
    let mut sheet = "[FileInfo]\nFileName=joint.eds\n[DeviceInfo]\nVendorName=ours\nVendorNumber=0\n".to_owned();
    let mut list = Vec::new();
    let mut var = |section: &str, name: &str, data_type: u8, access: &str, default: &str, maps: u8| {
        let _ = write!(
            sheet,
            "[{section}]\nParameterName={name}\nObjectType=7\nDataType={data_type:#06X}\nAccessType={access}\n\
             DefaultValue={default}\nPDOMapping={maps}\n"
        );
    };
    let mut records = Vec::new();
    for (index, name, data_type, access) in [
        (0x1000, "Device type", 7, "ro"),
        (0x1001, "Error register", 5, "ro"),
        (0x1017, "Producer heartbeat time", 6, "rw"),
        (0x6040, "Controlword", 6, "rww"),
        (0x6041, "Statusword", 6, "ro"),
        (0x6060, "Modes of operation", 2, "rww"),
        (0x6061, "Modes of operation display", 2, "ro"),
        (0x6064, "Position actual value", 4, "ro"),
        (0x606C, "Velocity actual value", 4, "ro"),
        (0x607A, "Target position", 4, "rww"),
        (0x6081, "Profile velocity", 7, "rw"),
    ] {
        list.push(index);
        let maps = u8::from(index > 0x6000);
        var(&format!("{index:04X}"), name, data_type, access, if index == 0x1000 { "0x20192" } else { "0" }, maps);
    }
    for (index, name, subs) in [(0x60C1, "Interpolation data record", 1), (0x60C2, "Interpolation time period", 2)] {
        records.push((index, name, subs));
        let data_type = if index == 0x60C1 { 4 } else { 5 };
        for sub in 1..=subs {
            var(&format!("{index:04X}sub{sub}"), &format!("{name} {sub}"), data_type, "rww", "0", 1);
        }
    }
    for (index, id) in
        [(0x1400, 0x200), (0x1401, 0x300), (0x1800, 0x180), (0x1801, 0x280), (0x1802, 0x380), (0x1803, 0x480)]
    {
        records.push((index, "PDO parameter", 2));
        var(&format!("{index:04X}sub1"), "COB-ID", 7, "rw", &format!("$NODEID+{id:#X}"), 0);
        var(&format!("{index:04X}sub2"), "Transmission type", 5, "rw", "1", 0);
        records.push((index + 0x200, "PDO mapping", 8));
        for sub in 1..=8 {
            var(&format!("{:04X}sub{sub}", index + 0x200), &format!("Mapped object {sub}"), 7, "rw", "0", 0);
        }
    }
    for (index, name, subs) in &records {
        list.push(*index);
        let access = if *name == "PDO mapping" { "rw" } else { "ro" };
        var(&format!("{index:04X}sub0"), "Number of entries", 5, access, &subs.to_string(), 0);
    }
    for (index, name, subs) in records {
        let _ =
            write!(sheet, "[{index:04X}]\nParameterName={name} {index:04X}\nObjectType=9\nSubNumber={}\n", subs + 1);
    }
    let _ = writeln!(sheet, "[OptionalObjects]\nSupportedObjects={}", list.len());
    for (at, index) in (1..).zip(list) {
        let _ = writeln!(sheet, "{at}={index:#06X}");
    }
    sheet
}

#[test]
fn joints_get_the_concise_dcfs_that_dcfgen_writes() {
    assert!(MACHINE.trim().lines().count() <= 40);
    let sheet = sheet();
    let machine = Machine::parse(Source::new("machine.toml", MACHINE), Files::Embedded(&[("joint.eds", &sheet)]));
    assert!(!machine.findings.has_errors(), "{}", machine.findings.render(&machine.input));
    has_the_records(&machine);
}

/// `bus.yml` of the same arm, in ros2_canopen's dialect.
const BUS_YML: &str = include_str!("prbt.yml");

#[test]
fn the_bus_yml_of_the_joints_is_the_same_machine() {
    let sheet = sheet();
    let files = Files::Embedded(&[("joint.eds", &sheet)]);
    let read = BusYml::read(Source::new("bus.yml", BUS_YML), files, &str::to_owned);
    let findings: Vec<_> = read.findings.iter().map(|finding| finding.render_short(&read.input)).collect();
    assert!(matches!(&findings[..], [only] if only.contains("only ros2_canopen reads it")), "{findings:#?}");
    let text = read.draft.text();
    let machine = Machine::parse(Source::new("machine.toml", text.as_str()), files);
    // The arm is not protected against the loss of its manager, and the check reports this.
    let is_known = |finding: &lexican_eds::Diagnostic| finding.code == "machine::protection";
    assert!(machine.findings.iter().all(is_known), "{text}{}", machine.findings.render(&machine.input));
    assert_eq!(format(&text).unwrap(), text);
    has_the_records(&machine);
}

#[track_caller]
fn has_the_records(machine: &Machine) {
    assert_eq!(machine.nodes.len(), 6);
    for node in &machine.nodes {
        let records = records(node.id.unwrap().get().into());
        let mut expected = (records.len() as u32).to_le_bytes().to_vec();
        for (index, sub, value, bytes) in records {
            expected.extend(index.to_le_bytes());
            expected.push(sub);
            expected.extend(bytes.to_le_bytes());
            expected.extend(&value.to_le_bytes()[..bytes as usize]);
        }
        assert_eq!(expected.len(), 294);
        assert_eq!(machine.concise_dcf(node), expected, "{}", node.name.value);
    }
}
