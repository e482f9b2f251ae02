//! Nodes that are bound to their dictionary, their settings and their PDOs, in both shells.
#![cfg(feature = "tokio")]

use crate::common::NODE;
use crate::rig::Recorder;
use lexican_runtime::host::{AccessError, PdoOptions, Settings, VirtualBus, blocking, tokio as shell};
use lexican_runtime::object::{Mapping, Object, Rpdo, Rw, Tpdo};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{AbortCode, CobId, Duration};

/// The dictionary as generated code has it.
mod drive {
    #![allow(unreachable_pub, reason = "generated code is public")]

    lexican_runtime::device_model!(NAMES);

    pub const CONSUMER_HEARTBEAT_TIME: Array<u32, Rw> = Array::new(3, Object::new(0x1016, 1));
    pub const HEARTBEAT: Object<u16, Rw> = Object::new(0x1017, 0).with_limits(0, 1000);
    pub const TPDO_1_INHIBIT_TIME: Object<u16, Rw> = Object::new(0x1800, 3);
    pub const STATUSWORD: Object<u16, Ro, Tpdo> = Object::new(0x6041, 0);
    pub const POSITION: Object<i32, Ro, Tpdo> = Object::new(0x6064, 0);
    pub const TARGET: Object<i32, Rw, Rpdo> = Object::new(0x607A, 0);

    pub static NAMES: &[Name] = &[
        Name::new(0x1008, 0, "Device name", DataType::VisibleString, Meaning::Plain),
        Name::new(0x6064, 0, "Position actual value", DataType::Integer32, Meaning::Plain),
        Name::new(0x607A, 0, "Target position", DataType::Integer32, Meaning::Quantity(&[Unit::new("mm", 1, 100)])),
    ];
}

/// A strict device: identifiers, times and mappings change only while the PDO is switched off.
fn bus() -> VirtualBus {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(Recorder::full());
    bus
}

const STATUS: Mapping<Tpdo, (i32, u16), drive::Device> =
    Mapping::transmit().with(drive::POSITION).with(drive::STATUSWORD);
const ORDER: Mapping<Rpdo, (i32,), drive::Device> = Mapping::receive().with(drive::TARGET);
const OPTIONS: PdoOptions = PdoOptions::new(TransmissionType::EventManufacturer).event_timer_ms(10);

#[test]
fn the_blocking_shell_maps_and_decodes_by_the_mapping_in_force() {
    let mut network = blocking::Network::new(bus().link());
    let mut drive = network.node(NODE, drive::DEVICE);
    let other = CobId::standard(0x1A6).unwrap();
    let status = drive.map(1, STATUS, OPTIONS.cob_id(other).inhibit_100us(7)).unwrap();
    let order = drive.map(1, ORDER, OPTIONS).unwrap();
    assert_eq!((status.id(), order.id()), (other, CobId::standard(0x205).unwrap()));
    assert_eq!(drive.read(drive::TPDO_1_INHIBIT_TIME).unwrap(), 7);
    drive.command(NmtCommand::Start).unwrap();
    let values = network.wait_for(Duration::from_millis(50), |event| status.decode(event)).unwrap();
    assert_eq!(values, Some(Ok((-2, 0x1234))));
    network.send(&order.frame((36_000,))).unwrap();
    assert_eq!(network.node(NODE, drive::DEVICE).read(drive::TARGET).unwrap(), 36_000);
}

#[tokio::test]
async fn the_tokio_shell_maps_and_decodes_by_the_mapping_in_force() {
    let network = shell::Network::spawn(bus().link()).unwrap();
    let drive = network.node(NODE, drive::DEVICE);
    let status = drive.map(1, STATUS, OPTIONS).await.unwrap();
    let mut events = network.events();
    drive.command(NmtCommand::Start).await.unwrap();
    let values = loop {
        if let shell::Event::Manager(event) = events.recv().await.unwrap()
            && let Some(values) = status.decode(&event)
        {
            break values;
        }
    };
    assert_eq!(values, Ok((-2, 0x1234)));
    let order = drive.map(1, ORDER, OPTIONS).await.unwrap();
    network.send(order.frame((36_000,))).await.unwrap();
    assert_eq!(drive.read(drive::TARGET).await.unwrap(), 36_000);
    drive.by_name("target position").unwrap().write("1.5 mm").await.unwrap();
    assert_eq!(drive.by_name("TargetPosition").unwrap().read().await.unwrap().to_string(), "+1.50 mm");
    let settings = Settings::of(drive::DEVICE).set(drive::TPDO_1_INHIBIT_TIME, 70);
    drive.configure(&settings).await.unwrap();
    assert_eq!(drive.read(drive::TPDO_1_INHIBIT_TIME).await.unwrap(), 70);
    assert_eq!(drive.read_all(drive::CONSUMER_HEARTBEAT_TIME).await.unwrap(), [0, 0, 0]);
}

#[test]
fn settings_are_applied_in_the_order_that_the_device_takes() {
    let mut network = blocking::Network::new(bus().link());
    let mut drive = network.node(NODE, drive::DEVICE);
    let refused = drive.write(drive::TPDO_1_INHIBIT_TIME, 50).unwrap_err();
    assert!(matches!(refused, AccessError::Sdo { error: SdoError::Aborted { .. }, .. }), "{refused}");
    let settings = Settings::of(drive::DEVICE).set(drive::TPDO_1_INHIBIT_TIME, 50).set(drive::HEARTBEAT, 100);
    drive.configure(&settings).unwrap();
    assert_eq!(drive.read(drive::TPDO_1_INHIBIT_TIME).unwrap(), 50);
    assert_eq!(drive.read(drive::HEARTBEAT).unwrap(), 100);
    let error = drive.configure(&settings.set(drive::HEARTBEAT, 1001)).unwrap_err();
    assert!(matches!(error, AccessError::OutOfRange(_)), "{error}");
}

#[test]
fn a_pdo_that_the_device_does_not_take_is_an_error() {
    let mut network = blocking::Network::new(bus().link());
    let error = network.map(NODE, 513, ORDER, OPTIONS).unwrap_err();
    assert_eq!(error.to_string(), "there is no PDO 513: PDOs have the numbers 1 to 512");
    let error = network.map(NODE, 9, ORDER, OPTIONS).unwrap_err();
    let code = AbortCode::NO_SUCH_OBJECT;
    assert!(matches!(error, AccessError::Sdo { error: SdoError::Aborted { code: got, .. }, .. } if got == code));
}

#[test]
fn tools_find_objects_by_name() {
    let mut network = blocking::Network::new(bus().link());
    let mut drive = network.node(NODE, drive::DEVICE);
    assert_eq!(drive.by_name("device-name").unwrap().read().unwrap().to_string(), "test-device");
    assert_eq!(drive.by_name("Position actual value").unwrap().read().unwrap().to_string(), "-2");
    let mut target = drive.by_name("target position").unwrap();
    target.write("-20 mm").unwrap();
    assert_eq!((target.read().unwrap().raw(), target.name().address), (Some(0xFFFF_F830), drive::TARGET.address()));
    let error = target.write("20 rev").unwrap_err();
    assert_eq!(error.to_string(), "607A:00 \"Target position\": \"20 rev\" is not in mm");
    let error = drive.by_name("position").map(drop).unwrap_err();
    let words = "the dictionary has no object \"position\"; there is Position actual value, Target position";
    assert_eq!(error.to_string(), words);
    // Names read from a data sheet at run time.
    let mut drive = network.node(NODE, drive::NAMES);
    assert_eq!(drive.by_name("target position").unwrap().read().unwrap().to_string(), "-20.00 mm");
    // Handles written by hand fit every device.
    let heartbeat = Object::<u16, Rw>::new(0x1017, 0);
    assert_eq!(drive.read(heartbeat).unwrap(), 0);
}
