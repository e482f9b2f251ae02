//! PDOs whose mapping the application chooses.

use lexican_driver::description::{Description, Outputs, Pdo, Signal};
use lexican_driver::sequence::Recovery;
use lexican_driver::{Error, Kind};
use lexican_runtime::object::{Direction, Mapping, Object, Ro, Rpdo, Rw, Tpdo};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, Duration, NodeId};

use crate::script::{Rig, Sheet, bus};
use crate::servo::{ByPdo, BySdo, Drive, SHEET, enabled};

const TARGET_POSITION: Object<i32, Rw, Rpdo> = Object::new(0x607A, 0x00);
const PROFILE_VELOCITY: Object<u32, Rw, Rpdo> = Object::new(0x6081, 0x00);
const POSITION: Object<i32, Ro, Tpdo> = Object::new(0x6064, 0x00);

const ORDER: Mapping<Rpdo, (i32, u32)> = Mapping::receive().with(TARGET_POSITION).with(PROFILE_VELOCITY);
const ACTUAL: Mapping<Tpdo, (i32,)> = Mapping::transmit().with(POSITION);

fn settings() -> [PdoSettings<'static>; 2] {
    let id = |base| PdoCobId::valid(CobId::of_node(base, NodeId::literal(3)));
    let (order, actual) = (&ORDER, &ACTUAL);
    [
        PdoSettings::of(2, id(0x300), TransmissionType::EventProfile, order),
        PdoSettings::of(1, id(0x180), TransmissionType::SynchronousCyclic(1), actual),
    ]
}

#[test]
fn pdos_are_mapped_sent_and_received() {
    let script = "
        > 000#8003                PRE-OPERATIONAL
        > 603#2301140103030080    off
        > 603#2F011402FF000000
        > 603#2F01160000000000
        > 603#2301160120007A60
        > 603#2301160220008160
        > 603#2F01160002000000
        > 603#2301140103030000    on
        > 603#2300180183010080
        > 603#2F00180201000000
        > 603#2F001A0000000000
        > 603#23001A0120006460
        > 603#2F001A0001000000
        > 603#2300180183010000
        > 000#0103
        > 303#A08C0000204E0000
        < 183#FEFFFFFF
        < 183#07000000
    ";
    let position = Rig::<BySdo>::new(SHEET).check(script, |drive| {
        drive.configure_pdos(&settings())?;
        drive.send_pdo(2, &ORDER, (36_000, 20_000))?;
        drive.position()?;
        drive.receive_pdo(1, &ACTUAL)
    });
    assert_eq!(position.unwrap(), (7,), "the last one");
    let none = Rig::<BySdo>::new(SHEET).check("", |drive| drive.receive_pdo(1, &ACTUAL));
    assert_eq!(none.unwrap_err().to_string(), "transmit PDO 1 does not come");
    let short = Rig::<BySdo>::new(SHEET).check("< 183#4002", |drive| drive.receive_pdo(1, &ACTUAL));
    assert_eq!(short.unwrap_err().to_string(), "transmit PDO 1: the PDO maps 4 bytes, the frame has 2");
}

#[test]
fn pdos_are_not_mapped_while_the_drive_is_enabled() {
    let result = enabled::<BySdo, _>("", |drive| drive.configure_pdos(&settings()));
    assert_eq!(result.unwrap_err().to_string(), "the drive would refuse: it is enabled");
}

#[test]
fn the_drivers_own_pdos_are_left_alone() {
    let mut rig = Rig::<ByPdo>::new(SHEET);
    let mapped = rig.check("", |drive: &mut Drive<ByPdo>| drive.configure_pdos(&settings()));
    let in_use = |result, direction| {
        assert!(matches!(result, Err(Error::PdoInUse { direction: of, number: 1 }) if of == direction), "{result:?}");
    };
    in_use(mapped, Direction::Transmit);
    in_use(rig.check("", |drive| drive.send_pdo(1, &ORDER, (0, 0))), Direction::Receive);
}

/// A kind whose PDOs carry more than the driver knows.
enum Packed {}

impl Kind for Packed {
    const DESCRIPTION: &'static Description = &Description {
        outputs: Outputs {
            position: Some(Pdo { base: 0x400, signals: &[Signal::ControlWord, Signal::TargetPosition] }),
            ..ByPdo::DESCRIPTION.outputs
        },
        inputs: &[Pdo { base: 0x180, signals: &[Signal::Other(4), Signal::StatusWord, Signal::Other(1)] }],
        ..*ByPdo::DESCRIPTION
    };
}

/// Index, sub-index, bytes, value.
type Row = (u16, u8, usize, u64);

/// The servo with these objects, which replace those with the same address.
fn with(own: &[Row]) -> Sheet {
    Sheet { objects: [own, SHEET.objects].concat().leak(), ..SHEET }
}

const MAPPED: [Row; 9] = [
    (0x1600, 0, 1, 1),
    (0x1600, 1, 4, 0x6040_0010),
    (0x1602, 0, 1, 2),
    (0x1602, 1, 4, 0x6040_0010),
    (0x1602, 2, 4, 0x607A_0020),
    (0x1A00, 0, 1, 3),
    (0x1A00, 1, 4, 0x6064_0010),
    (0x1A00, 2, 4, 0x0006_0010),
    (0x1A00, 3, 4, 0x6041_0010),
];

#[test]
fn a_drive_whose_pdos_are_mapped_otherwise_is_not_commanded() {
    const BY_OTHERS: &str = ": restore the mapping of the drive, or use a description that goes by SDO";
    const RPDO1: &str = "and the driver goes by 6040:00 (16 bits)";
    const RPDO3: &str = "and the driver goes by 6040:00 (16 bits), 607A:00 (32 bits)";
    const TPDO1: &str = "and the driver goes by 32 bits, 6041:00 (16 bits), 8 bits";
    let check = |own: &[Row], found: &str, expected: &str| {
        let (bus, device) = bus(with(&[own, &MAPPED].concat()));
        let result = Drive::<Packed>::connect_unprotected(bus.link(), SHEET.node);
        assert!(device.lock().unwrap().is_through(), "something was ordered");
        let found = if found.is_empty() { String::new() } else { format!("{found}, {expected}{BY_OTHERS}") };
        assert_eq!(result.err().map_or(String::new(), |error| error.to_string()), found, "{own:X?}");
    };
    check(&[], "", "");
    check(&[(0x1600, 1, 4, 0x6060_0010)], "Receive PDO 1 is mapped to 6060:00 (16 bits)", RPDO1);
    check(&[(0x1600, 1, 4, 0x6040_0008)], "Receive PDO 1 is mapped to 6040:00 (8 bits)", RPDO1);
    check(&[(0x1600, 0, 1, 0)], "Receive PDO 1 is mapped to nothing", RPDO1);
    check(&[(0x1600, 0, 1, 255)], "Receive PDO 1 is mapped to nothing", RPDO1);
    let longer = [(0x1600, 0, 1, 2), (0x1600, 2, 4, 0x607A_0020)];
    check(&longer, "Receive PDO 1 is mapped to 6040:00 (16 bits), 607A:00 (32 bits)", RPDO1);
    check(&[(0x1602, 0, 1, 1)], "Receive PDO 3 is mapped to 6040:00 (16 bits)", RPDO3);
    let velocity = [(0x1602, 2, 4, 0x60FF_0020)];
    check(&velocity, "Receive PDO 3 is mapped to 6040:00 (16 bits), 60FF:00 (32 bits)", RPDO3);
    let turned = [(0x1602, 1, 4, 0x607A_0020), (0x1602, 2, 4, 0x6040_0010)];
    check(&turned, "Receive PDO 3 is mapped to 607A:00 (32 bits), 6040:00 (16 bits)", RPDO3);
    let earlier = [(0x1A00, 2, 4, 0x6041_0010), (0x1A00, 3, 4, 0x6061_0008)];
    check(&earlier, "Transmit PDO 1 is mapped to 6064:00 (16 bits), 6041:00 (16 bits), 6061:00 (8 bits)", TPDO1);
    check(&[(0x1A00, 0, 1, 2)], "Transmit PDO 1 is mapped to 6064:00 (16 bits), 0006:00 (16 bits)", TPDO1);
    check(&[(0x1A00, 0, 1, 254)], "Transmit PDO 1 is mapped to nothing", TPDO1);
    // PDOs that are off, and data behind the status word, do not matter.
    check(&[(0x1A00, 0, 1, 0)], "", "");
    check(&[(0x1A00, 1, 4, 0x6041_0010), (0x1800, 1, 4, 0x8000_0183)], "", "");
    check(&[(0x1A00, 0, 1, 4), (0x1A00, 4, 4, 0x6064_0020)], "", "");
}

#[test]
fn a_mapping_is_compared_again_when_a_drive_is_recovered() {
    let recovered = Rig::<Packed>::new(with(&MAPPED))
        .check("= 1600:01 60600010", |drive| drive.recover(&Recovery::within(Duration::from_secs(1))));
    assert!(matches!(recovered, Err(Error::OtherMapping { number: 1, .. })), "{recovered:?}");
}

/// TPDO 1 is sent when the status word changes; 2, with the position, by SYNC; 3, with a position, without an inhibit
/// time; 4, with a velocity, with an inhibit time of 0.9 ms.
const CHATTY: Sheet = Sheet {
    objects: &[
        (0x1000, 0x00, 4, 0x0002_0192),
        (0x1008, 0x00, 4, u32::from_le_bytes(*b"M006") as u64),
        (0x1018, 0x01, 4, 0x6A),
        (0x1800, 0x01, 4, 0x183),
        (0x1800, 0x02, 1, 255),
        (0x1801, 0x01, 4, 0x283),
        (0x1801, 0x02, 1, 1),
        (0x1802, 0x01, 4, 0x383),
        (0x1802, 0x02, 1, 254),
        (0x1803, 0x01, 4, 0x483),
        (0x1803, 0x02, 1, 255),
        (0x1803, 0x03, 2, 9),
        (0x1A00, 0x00, 1, 1),
        (0x1A00, 0x01, 4, 0x6041_0010),
        (0x1A01, 0x00, 1, 1),
        (0x1A01, 0x01, 4, 0x6064_0020),
        (0x1A02, 0x00, 1, 2),
        (0x1A02, 0x01, 4, 0x6041_0010),
        (0x1A02, 0x02, 4, 0x6063_0020),
        (0x1A03, 0x00, 1, 1),
        (0x1A03, 0x01, 4, 0x606C_0020),
    ],
    ..SHEET
};

#[test]
fn pdos_that_may_fill_the_bus_are_found() {
    let third = "TPDO 3 may fill the bus while the axis moves: it is sent whenever 6063:00 changes, with an inhibit time of 0 s";
    let fourth = "TPDO 4 may fill the bus while the axis moves: it is sent whenever 606C:00 changes, with an inhibit time of 900 us";
    for (script, expected) in [
        ("", vec![third, fourth]),
        ("= 1803:03 000A", vec![third]),
        ("= 1802:01 80000383", vec![fourth]),
        ("= 1802:02 00", vec![fourth]),
        ("= 1A02:00 01", vec![fourth]),
    ] {
        let found = Rig::<BySdo>::new(CHATTY).check(script, Drive::unpaced_pdos).unwrap();
        let found: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert_eq!(found, expected, "{script}");
    }
    let none = Rig::<BySdo>::new(SHEET).check("", Drive::unpaced_pdos);
    assert_eq!(none.unwrap(), [], "without the objects");
}
