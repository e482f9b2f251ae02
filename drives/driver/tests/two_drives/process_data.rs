//! PDOs whose mapping the application chooses.

use lexican_driver::Error;
use lexican_runtime::object::{Direction, Mapping, Object, Ro, Rpdo, Rw, Tpdo};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, NodeId};

use crate::script::Rig;
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
