//! The frames that the manual prints: golden vectors are read and made anew by the runtime, and agree with the
//! generated dictionary.

use lexican_runtime::object::{Address, Entry, Mapped, Object, Pdo, PdoMapping, Value};
use lexican_runtime::profile::cia402::{Command, State, status};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::wire::sdo::{ClientRequest, Content, Expedited, ServerResponse};
use lexican_runtime::{AbortCode, CobId, Frame, NodeId};

use super::od;
use super::tables::rows;
use crate::manual::Row;

/// Requests with one byte of data that carry another byte; a client of ours sends zeros.
const WITH_PADDING: [&str; 3] = ["F153", "F161", "F167"];

/// What a frame is, by the table's word for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Request(ClientRequest),
    Response(ServerResponse),
    Nmt(NmtMessage),
    Sync,
    BootUp,
    Emergency(Emergency),
    /// With the number of the PDO.
    Rpdo(u16),
    Tpdo(u16),
}

/// A frame of the table.
pub struct Printed {
    /// `F001` and so on, in the order of the manual.
    pub id: String,
    pub chapter: String,
    /// Whether it is a golden vector. Others contradict the text around them, or need care: errata.csv has each.
    pub is_golden: bool,
    pub frame: Frame,
    /// None if the runtime does not understand it.
    pub kind: Option<Kind>,
}

impl Printed {
    fn new(row: &Row) -> Self {
        let id = CobId::standard(u16::from_str_radix(row.get("cob_id"), 16).unwrap()).unwrap();
        let bytes = row.get("data").split_whitespace();
        let data: Vec<u8> = bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let kind = match row.get("kind") {
            "download request" | "upload request" => ClientRequest::parse(&data).map(Kind::Request),
            "download response" | "upload response" | "abort" => ServerResponse::parse(&data).map(Kind::Response),
            "NMT" => NmtMessage::parse(&data).map(Kind::Nmt),
            "SYNC" => Some(Kind::Sync),
            "boot-up" => Some(Kind::BootUp),
            "EMCY" => Emergency::parse(&data, CodeOrder::LowByteFirst).map(Kind::Emergency),
            pdo if pdo.starts_with('R') => Some(Kind::Rpdo(pdo[4..].parse().unwrap())),
            pdo => Some(Kind::Tpdo(pdo[4..].parse().unwrap())),
        };
        Printed {
            id: row.key.clone(),
            chapter: row.get("chapter").to_owned(),
            is_golden: row.get("use") == "golden",
            frame: Frame::new(id, &data).unwrap(),
            kind,
        }
    }

    /// For messages: the chapter and the frame.
    pub fn place(&self) -> String {
        format!("{} {}: {}", self.chapter, self.id, self.frame)
    }

    /// The node that sends it, or that it is for.
    pub fn node(&self) -> Option<NodeId> {
        NodeId::new((self.frame.id().raw() & 0x7F) as u8)
    }
}

/// All frames, in the order of the manual.
pub fn printed() -> Vec<Printed> {
    rows("frames").iter().map(Printed::new).collect()
}

#[test]
fn every_golden_frame_is_understood_and_made_anew() {
    let frames = printed();
    let golden: Vec<&Printed> = frames.iter().filter(|printed| printed.is_golden).collect();
    assert_eq!((golden.len(), frames.len()), (306, 332));
    for printed in golden {
        let (frame, place) = (printed.frame, printed.place());
        let node = printed.node();
        let anew = match printed.kind.unwrap_or_else(|| panic!("{place} is not understood")) {
            Kind::Request(request) => Frame::from_array(frame.id(), request.to_bytes()),
            Kind::Response(response) => Frame::from_array(frame.id(), response.to_bytes()),
            Kind::Nmt(message) => message.frame(),
            Kind::Sync => Frame::from_array(CobId::SYNC, []),
            Kind::BootUp => ErrorControl::heartbeat(NmtState::Initialising).frame(node.unwrap()),
            Kind::Emergency(emergency) => {
                let bytes = emergency.emit(CodeOrder::LowByteFirst);
                Frame::from_array(Emergency::cob_id(node.unwrap()), bytes)
            }
            // Their content depends on the mapping: a device takes and sends them, in replay.rs.
            Kind::Rpdo(number) => {
                assert_eq!(frame.id(), CobId::of_node(0x100 + 0x100 * number, node.unwrap()), "{place}");
                continue;
            }
            Kind::Tpdo(number) => {
                assert_eq!(frame.id(), CobId::of_node(0x80 + 0x100 * number, node.unwrap()), "{place}");
                continue;
            }
        };
        if WITH_PADDING.contains(&printed.id.as_str()) {
            assert_eq!((&anew.data()[..5], &anew.data()[5..]), (&frame.data()[..5], &[0, 0, 0][..]), "{place}");
        } else {
            assert_eq!(anew, frame, "{place}");
        }
    }
}

#[test]
fn every_golden_transfer_agrees_with_the_generated_dictionary() {
    let frames = printed();
    for printed in frames.iter().filter(|printed| printed.is_golden) {
        let place = printed.place();
        match printed.kind.unwrap() {
            Kind::Request(ClientRequest::InitiateDownload { address, content: Content::Expedited(data) }) => {
                let entry = entry(address, &place);
                assert!(entry.access.is_writable(), "{place}");
                assert!(is_long_enough(&entry, data), "{place}");
                if matches!(address.index(), 0x1600..=0x17FF | 0x1A00..=0x1BFF) && address.sub() > 0 {
                    mappable(address, data, &place);
                }
            }
            Kind::Request(ClientRequest::InitiateUpload { address })
            | Kind::Response(ServerResponse::InitiateDownload { address }) => {
                entry(address, &place);
            }
            Kind::Response(ServerResponse::InitiateUpload { address, content: Content::Expedited(data) }) => {
                let entry = entry(address, &place);
                assert!(entry.access.is_readable() && is_long_enough(&entry, data), "{place}");
            }
            Kind::Response(ServerResponse::Abort(abort)) => {
                entry(abort.address, &place);
                assert_eq!(abort.code, AbortCode::VALUE_TOO_HIGH, "{place}");
            }
            Kind::Request(_) | Kind::Response(_) => panic!("{place}: no expedited transfer"),
            Kind::Emergency(emergency) => {
                use lexican_runtime::object::Enumeration;
                let code = u64::from(emergency.code.0);
                assert!(od::EmergencyCode::NAMES.iter().any(|named| named.raw == code), "{place}");
            }
            _ => {}
        }
    }
}

fn entry(address: Address, place: &str) -> Entry {
    od::TABLE.entry(address).unwrap_or_else(|code| panic!("{place}: {address}: {code}"))
}

/// An object takes as many bytes as its data type has; a string at least as many as it holds.
fn is_long_enough(entry: &Entry, data: Expedited) -> bool {
    match entry.data_type.size() {
        Some(size) => data.len() == Some(size),
        None => data.len().is_some_and(|len| len <= usize::from(entry.capacity)),
    }
}

/// What a mapping names can be mapped in its direction, with all of its bits.
fn mappable(address: Address, data: Expedited, place: &str) {
    let mapped = Mapped::from_parameter(u32::from_le_bytes(data.data().try_into().unwrap()));
    let entry = entry(mapped.address, place);
    let wanted = if address.index() < 0x1800 { PdoMapping::Rpdo } else { PdoMapping::Tpdo };
    assert!(entry.mapping == wanted || entry.mapping == PdoMapping::Both, "{place}");
    assert_eq!(entry.data_type.bits(), Some(mapped.bits), "{place}");
}

/// What a program of a user's writes, and the frame of the manual that it becomes.
#[test]
fn generated_types_make_the_frames_of_the_examples() {
    let node = |id| NodeId::literal(id);
    let controlword = |command: Command| od::Controlword(command.apply(0));
    let enabled = od::Controlword(Command::EnableOperation.apply(0));
    let off = |base, id| PdoCobId::valid(CobId::of_node(base, node(id))).switched_off();
    let mapped = |object: Address, bits| Mapped { address: object, bits }.to_parameter();
    let synchronous = |number| TransmissionType::SynchronousCyclic(number).code();
    let made = [
        ("F001", write(node(1), od::TPDO1_PARAMETER.cob_id(), off(0x180, 1).without_remote().0)),
        ("F003", write(node(1), od::TPDO1_MAPPING.mapped_object_1(), mapped(od::STATUSWORD.address(), 16))),
        (
            "F004",
            write(node(1), od::TPDO1_MAPPING.mapped_object_2(), mapped(od::MANUFACTURER_STATUS_REGISTER.address(), 32)),
        ),
        ("F005", write(node(1), od::TPDO1_MAPPING.number_of_entries(), 2)),
        ("F008", write(node(3), od::CONTROLWORD, controlword(Command::Shutdown))),
        ("F010", write(node(3), od::CONTROLWORD, controlword(Command::SwitchOn))),
        ("F014", write(node(3), od::MODES_OF_OPERATION, od::OperatingMode::PROFILE_VELOCITY)),
        ("F022", write(node(3), od::CONTROLWORD, enabled)),
        ("F024", write(node(3), od::TARGET_VELOCITY, od::Velocity(0x4100))),
        ("F026", write(node(3), od::CONTROLWORD, enabled.with_halt(true))),
        ("F028", write(node(3), od::MODES_OF_OPERATION, od::OperatingMode::PROFILE_TORQUE)),
        ("F038", write(node(3), od::TARGET_TORQUE, od::Torque(400))),
        ("F046", write(node(3), od::RPDO1_MAPPING.mapped_object_1(), mapped(od::TARGET_VELOCITY.address(), 32))),
        ("F058", write(node(3), od::TPDO1_PARAMETER.transmission_type(), synchronous(1))),
        ("F060", write(node(3), od::TPDO2_PARAMETER.cob_id(), off(0x280, 3).0)),
        ("F070", write(node(3), od::RPDO4_PARAMETER.cob_id(), off(0x500, 3).0)),
        ("F072", NmtMessage { command: NmtCommand::Start, node: Some(node(3)) }.frame()),
        ("F125", read(node(3), od::STATUSWORD)),
        ("F127", write(node(3), od::HOMING_SPEEDS.speed_during_search_for_switch(), od::Speed(10_000))),
        ("F129", write(node(3), od::HOMING_SPEEDS.speed_during_search_for_zero(), od::Speed(5000))),
        ("F131", write(node(3), od::HOMING_ACCELERATION, od::Acceleration(10_000))),
        ("F133", write(node(3), od::HOME_OFFSET, od::Position(25_000))),
        ("F135", write(node(3), od::MODES_OF_OPERATION, od::OperatingMode::HOMING)),
        ("F147", write(node(3), od::CONTROLWORD, enabled.with_new_setpoint_or_start(true))),
        ("F193", write(node(3), od::HOMING_METHOD, od::HomingMethod::REFERENCE_SWITCH_WITH_ZEROING_NEGATIVE)),
        ("F210", od::Rpdo1 { controlword: enabled }.frame(CobId::of_node(0x200, node(3)))),
        ("F211", write(node(3), od::MODES_OF_OPERATION, od::OperatingMode::PROFILE_POSITION)),
        ("F213", write(node(3), od::PROFILE_ACCELERATION, od::Acceleration(50))),
        ("F215", write(node(3), od::PROFILE_DECELERATION, od::Acceleration(50))),
        ("F227", write_bytes(node(1), od::ASCII_CHANNEL.command().address(), b"DRV.")),
        ("F231", write_bytes(node(1), od::ASCII_CHANNEL.command().address(), b"TS\r\n")),
        ("F233", read(node(1), od::ASCII_CHANNEL.response())),
        ("F267", write(node(3), od::TPDO2_PARAMETER.transmission_type(), synchronous(3))),
        (
            "F274",
            write(
                node(1),
                od::RPDO2_MAPPING.mapped_object_1(),
                mapped(od::INTERPOLATION_DATA_RECORD.at(1).unwrap().address(), 32),
            ),
        ),
        ("F310", write(node(1), od::MODES_OF_OPERATION, od::OperatingMode::INTERPOLATED_POSITION)),
        ("F314", write(node(1), od::INTERPOLATION_TIME_PERIOD.time_units(), 1)),
        ("F316", write(node(1), od::INTERPOLATION_TIME_PERIOD.time_index(), -3)),
        ("F319", od::Rpdo1 { controlword: controlword(Command::Shutdown) }.frame(CobId::of_node(0x200, node(1)))),
        (
            "F325",
            od::Rpdo1 { controlword: enabled.with_new_setpoint_or_start(true) }.frame(CobId::of_node(0x200, node(1))),
        ),
    ];
    let frames = printed();
    for (id, frame) in made {
        let printed = frames.iter().find(|printed| printed.id == id).unwrap();
        assert_eq!(frame, printed.frame, "{}", printed.place());
    }
}

fn write<T: Value, A: lexican_runtime::object::Writable, M>(node: NodeId, object: Object<T, A, M>, value: T) -> Frame {
    object.check(value).unwrap();
    write_bytes(node, object.address(), &value.to_bytes()[..T::SIZE])
}

fn write_bytes(node: NodeId, address: Address, data: &[u8]) -> Frame {
    let content = Content::Expedited(Expedited::new(data).unwrap());
    request(node, ClientRequest::InitiateDownload { address, content })
}

fn read<T: lexican_runtime::object::Type, A: lexican_runtime::object::Readable, M>(
    node: NodeId,
    object: Object<T, A, M>,
) -> Frame {
    request(node, ClientRequest::InitiateUpload { address: object.address() })
}

fn request(node: NodeId, request: ClientRequest) -> Frame {
    Frame::from_array(CobId::of_node(0x600, node), request.to_bytes())
}

/// The statuswords that SDO and TPDO1 carry, in the words of the examples.
#[test]
fn generated_types_read_the_statuswords_of_the_examples() {
    const POWERED: u16 = status::VOLTAGE_ENABLED;
    const REACHED: u16 = POWERED | status::TARGET_REACHED;
    const ACKNOWLEDGED: u16 = POWERED | status::SET_POINT_ACKNOWLEDGE;
    let expected = [
        ("F007", State::SwitchOnDisabled, 0),
        ("F013", State::SwitchedOn, POWERED),
        ("F126", State::SwitchOnDisabled, 0),
        ("F138", State::SwitchOnDisabled, 0),
        ("F146", State::OperationEnabled, POWERED),
        ("F150", State::OperationEnabled, POWERED),
        ("F152", State::OperationEnabled, REACHED | ACKNOWLEDGED),
        ("F190", State::SwitchOnDisabled, 0),
        ("F199", State::ReadyToSwitchOn, 0),
        ("F202", State::SwitchedOn, POWERED),
        ("F205", State::OperationEnabled, POWERED),
        ("F208", State::OperationEnabled, REACHED),
        ("F209", State::OperationEnabled, REACHED | ACKNOWLEDGED),
        ("F221", State::OperationEnabled, ACKNOWLEDGED),
        ("F223", State::OperationEnabled, POWERED),
        ("F224", State::OperationEnabled, REACHED),
        ("F320", State::ReadyToSwitchOn, POWERED),
        ("F322", State::SwitchedOn, POWERED),
        ("F324", State::OperationEnabled, POWERED),
        ("F326", State::OperationEnabled, ACKNOWLEDGED),
    ];
    let frames = printed();
    for (id, state, others) in expected {
        let printed = frames.iter().find(|printed| printed.id == id).unwrap();
        let place = printed.place();
        let word = match printed.kind {
            Some(Kind::Response(ServerResponse::InitiateUpload { address, content: Content::Expedited(data) })) => {
                assert_eq!(address, od::STATUSWORD.address(), "{place}");
                od::Statusword::from_bytes(data.data()).unwrap()
            }
            _ => od::Tpdo1::from_data(printed.frame.data()).unwrap().statusword,
        };
        assert_eq!(State::from_status_word(word.0), Some(state), "{place}");
        assert!(word.remote(), "{place}: always 1");
        assert_eq!(word.voltage_enabled(), others & status::VOLTAGE_ENABLED != 0, "{place}");
        assert_eq!(word.target_reached(), others & status::TARGET_REACHED != 0, "{place}");
        let acknowledged = others & status::SET_POINT_ACKNOWLEDGE != 0;
        assert_eq!(word.setpoint_acknowledged_or_homing_attained(), acknowledged, "{place}");
        assert!(!word.fault() && !word.following_error_or_homing_error(), "{place}");
    }
}
