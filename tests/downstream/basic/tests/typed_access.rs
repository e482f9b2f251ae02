//! Typed reads and writes through the blocking shell, against a device that serves the same dictionary.

use basic::od;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Station, VirtualBus, VirtualLink};
use lexican_runtime::object::{Access, ObjectDictionary, OutOfRange, Pdo};
use lexican_runtime::NodeId;

const DRIVE: NodeId = NodeId::literal(5);

/// A bus with one drive, prepared by `set`.
fn network(set: impl FnOnce(&mut od::Storage)) -> Network<VirtualLink> {
    let (bus, mut od) = (VirtualBus::new(), od::storage(DRIVE));
    set(&mut od);
    bus.attach(Station::new(bus.now(), DRIVE, od));
    Network::new(bus.link())
}

#[test]
fn values_have_the_types_of_the_data_sheet() {
    let mut network = network(|_| {});
    network.write(DRIVE, od::MOTOR_PARAMETER_SET.controller_parameter_p(), 120).unwrap();
    let p: u16 = network.read(DRIVE, od::MOTOR_PARAMETER_SET.controller_parameter_p()).unwrap();
    assert_eq!(p, 120);

    network.write(DRIVE, od::MODES_OF_OPERATION, od::OperatingMode::PROFILE_VELOCITY).unwrap();
    let mode = network.read(DRIVE, od::MODES_OF_OPERATION).unwrap();
    assert_eq!((mode.0, mode.to_string()), (2, "profile velocity".to_owned()));
}

#[test]
fn units_are_methods() {
    let volts = od::SupplyVoltage::from_volts(24.3).unwrap();
    let mut network = network(|od| od.set(od::POWER_SUPPLY_VOLTAGE.control(), volts));
    let read = network.read(DRIVE, od::POWER_SUPPLY_VOLTAGE.control()).unwrap();
    assert_eq!((read.0, read.volts(), read.to_string()), (243, 24.3, "24.3 V".to_owned()));
}

#[test]
fn what_the_data_sheet_forbids_is_not_sent() {
    let object = od::MOTOR_PARAMETER_SET.controller_parameter_p();
    let error = network(|_| {}).write(DRIVE, object, 501).unwrap_err();
    let expected = OutOfRange { address: object.address(), above: true };
    assert!(matches!(error, AccessError::OutOfRange(error) if error == expected), "{error}");
}

#[test]
fn pdos_are_structs() {
    let mut pdo = od::Tpdo1::default();
    pdo.statusword = pdo.statusword.with_ready_to_switch_on(true);
    let data = pdo.pack();
    assert_eq!(data, [0x01, 0x00]);
    assert_eq!(od::Tpdo1::unpack(&data), Ok(pdo));
    assert!(od::Tpdo1::unpack(&data[..1]).is_err());
    assert_eq!(od::Tpdo1::cob_id(NodeId::literal(5)).raw(), 0x185);
    assert_eq!(od::Tpdo1::LENGTH, od::Tpdo1::MAPPING.iter().map(|mapped| usize::from(mapped.bits)).sum::<usize>() / 8);
}

#[test]
fn every_entry_of_the_table_can_be_read_and_has_a_name() {
    let mut drive = od::storage(NodeId::literal(5));
    assert_eq!(od::TABLE.entries().count(), 138);
    assert_eq!(od::NAMES.len(), 138);
    for (row, name) in od::TABLE.entries().zip(od::NAMES) {
        assert_eq!((row.address, row.data_type), (name.address, name.data_type));
        let entry = drive.entry(row.address).unwrap();
        assert_eq!(drive.read(&entry, 0, &mut [0; 8]).map(|len| len > 0), Ok(true), "{}", row.address);
        assert!(matches!(row.access, Access::Ro | Access::Rw | Access::Wo | Access::Const));
    }
}
