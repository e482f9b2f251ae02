//! Typed reads and writes over SDO frames, against the same dictionary on the device's side.

use basic::od;
use lexican_runtime::object::{Access, Object, ObjectDictionary, Pdo, Readable, Value, Writable};
use lexican_runtime::service::sdo_client::{Event, Scalar, SdoClient, SdoError};
use lexican_runtime::service::sdo_server::SdoServer;
use lexican_runtime::{AbortCode, Duration, Instant, NodeId};

/// A client and a server on one wire.
struct Bus {
    client: SdoClient,
    server: SdoServer,
    drive: od::Storage,
}

impl Bus {
    fn new() -> Self {
        let node = NodeId::literal(5);
        Bus { client: SdoClient::of_node(node), server: SdoServer::of_node(node), drive: od::storage(node) }
    }

    fn read<T: Value, A: Readable, M>(&mut self, object: Object<T, A, M>) -> Result<T, SdoError> {
        let mut value = Scalar::room_for::<T>();
        self.client.read(Instant::ZERO, object.address()).expect("the client is idle");
        self.run(&mut value)?;
        Ok(value.get().expect("the drive answers with the type of the data sheet"))
    }

    fn write<T: Value, A: Writable, M>(&mut self, object: Object<T, A, M>, value: T) -> Result<(), SdoError> {
        let mut value = Scalar::of(value);
        self.client.write(Instant::ZERO, object.address(), value.len()).expect("the client is idle");
        self.run(&mut value)
    }

    fn run(&mut self, value: &mut Scalar) -> Result<(), SdoError> {
        let now = Instant::ZERO + Duration::from_millis(1);
        loop {
            let request = self.client.poll_transmit(now, value).expect("the client asks");
            self.server.handle_frame(now, &request, &mut self.drive);
            let response = self.server.poll_transmit(now, &mut self.drive).expect("the server answers");
            match self.client.handle_frame(now, &response, value) {
                Some(Event::Done { .. }) => return Ok(()),
                Some(Event::Failed(error)) => return Err(error),
                None => {}
            }
        }
    }
}

#[test]
fn values_have_the_types_of_the_data_sheet() {
    let mut bus = Bus::new();
    bus.write(od::MOTOR_PARAMETER_SET.controller_parameter_p(), 120).unwrap();
    assert_eq!(bus.read(od::MOTOR_PARAMETER_SET.controller_parameter_p()), Ok(120_u16));

    bus.write(od::MODES_OF_OPERATION, od::OperatingMode::PROFILE_VELOCITY).unwrap();
    let mode = bus.read(od::MODES_OF_OPERATION).unwrap();
    assert_eq!((mode.0, mode.to_string()), (2, "profile velocity".to_owned()));
}

#[test]
fn units_are_methods() {
    let mut bus = Bus::new();
    let volts = od::SupplyVoltage::from_volts(24.3).unwrap();
    bus.drive.set(od::POWER_SUPPLY_VOLTAGE.control(), volts);
    let read = bus.read(od::POWER_SUPPLY_VOLTAGE.control()).unwrap();
    assert_eq!((read.0, read.volts(), read.to_string()), (243, 24.3, "24.3 V".to_owned()));
}

#[test]
fn the_device_keeps_to_its_limits() {
    let mut bus = Bus::new();
    let object = od::MOTOR_PARAMETER_SET.controller_parameter_p();
    assert!(object.check(501).is_err());
    let error = bus.write(object, 501).unwrap_err();
    assert_eq!(error, SdoError::Aborted { address: object.address(), code: AbortCode::VALUE_TOO_HIGH });
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
    assert_eq!(od::TABLE.entries.len(), 138);
    assert_eq!(od::NAMES.len(), 138);
    for (row, name) in od::TABLE.entries.iter().zip(od::NAMES) {
        assert_eq!((row.address, row.data_type), (name.address, name.data_type));
        let entry = drive.entry(row.address).unwrap();
        assert_eq!(drive.read(&entry, 0, &mut [0; 8]).map(|len| len > 0), Ok(true), "{}", row.address);
        assert!(matches!(row.access, Access::Ro | Access::Rw | Access::Wo | Access::Const));
    }
}
