//! The examples of the AKD's manual, chapters 6.3 and 7.2, replayed one by one: a device with the generated dictionary takes
//! every golden frame of the manager, and answers as the manual prints. That the driver sends these frames, and that each
//! is read as what it is called, is part of the drive's verification (`tests/verify`).

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use lexican_runtime::device::{Behaviour, ChangeRule, Device};
use lexican_runtime::object::{Address, Mapped, ObjectDictionary};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency, ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtMessage;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::wire::sdo::{ClientRequest, Content, ServerResponse};
use lexican_runtime::{CobId, Frame, Instant, NodeId};

mod od {
    lexican_runtime::include_od!("kollmorgen_akd");
}

/// What a frame is, by the table's word for it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
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
struct Printed {
    /// `F001` and so on, in the order of the manual.
    id: String,
    chapter: String,
    /// Whether it is a golden vector. Others contradict the text around them, or need care: errata.csv has each.
    is_golden: bool,
    frame: Frame,
    /// None if the runtime does not understand it.
    kind: Option<Kind>,
}

impl Printed {
    fn new(row: &BTreeMap<String, String>) -> Self {
        let id = CobId::standard(u16::from_str_radix(&row["cob_id"], 16).unwrap()).unwrap();
        let bytes = row["data"].split_whitespace();
        let data: Vec<u8> = bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let kind = match row["kind"].as_str() {
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
            id: row["frame"].clone(),
            chapter: row["chapter"].clone(),
            is_golden: row["use"] == "golden",
            frame: Frame::new(id, &data).unwrap(),
            kind,
        }
    }

    /// For messages: the chapter and the frame.
    fn place(&self) -> String {
        format!("{} {}: {}", self.chapter, self.id, self.frame)
    }

    /// The node that sends it, or that it is for.
    fn node(&self) -> Option<NodeId> {
        NodeId::new((self.frame.id().raw() & 0x7F) as u8)
    }
}

/// All frames, in the order of the manual.
fn printed() -> Vec<Printed> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/manual/akd/frames.csv");
    csv::Reader::from_path(path).unwrap().deserialize().map(|row| Printed::new(&row.unwrap())).collect()
}

/// Frames that are not golden, but whose answers are: a request with something in a reserved byte, and one whose single
/// byte contradicts the printed data type, but not the data sheet.
const AS_PRINTED: [&str; 2] = ["F006", "F316"];

/// The same, with what stands in for them: a request without its reserved bytes, and the mapping of a dummy that the
/// drive's dictionary lacks (the UNSIGNED32 of CiA 301 leaves the gap).
const INSTEAD: [(&str, [u8; 8]); 2] = [
    ("F012", [0x40, 0x41, 0x60, 0x00, 0x00, 0x00, 0x00, 0x00]),
    ("F276", [0x23, 0x01, 0x16, 0x02, 0x20, 0x00, 0x07, 0x00]),
];

/// Golden frames that a dictionary alone does not bring about: a speed that the drive refuses although its range
/// allows it. The verification makes the frames.
const ELSEWHERE: [&str; 2] = ["F195", "F196"];

/// PDOs are remapped in PRE-OPERATIONAL without being switched off; bit 30 of a COB-ID is not supported; emergencies have
/// no generic bit.
const BEHAVIOUR: Behaviour = Behaviour {
    changes: ChangeRule::InPreOperational,
    pdo_bit_30: false,
    generic_error: false,
    dummies: 1 << 7,
    ..Behaviour::CIA_301
};

struct Drive {
    device: Device,
    od: od::Storage,
    sent: VecDeque<Frame>,
    /// Values that the next SYNC takes over.
    pending: Vec<(Address, Vec<u8>)>,
}

impl Drive {
    fn new(node: NodeId) -> Self {
        let mut drive = Drive {
            device: Device::new(node, BEHAVIOUR),
            od: od::storage(node),
            sent: VecDeque::new(),
            pending: Vec::new(),
        };
        drive.device.restart(Instant::ZERO, &mut drive.od);
        drive.send();
        drive
    }

    fn send(&mut self) {
        while let Some(frame) = self.device.poll_transmit(Instant::ZERO, &mut self.od) {
            self.sent.push_back(frame);
        }
    }

    fn take(&mut self, frame: &Frame) {
        self.device.handle_frame(Instant::ZERO, frame, &mut self.od);
        self.send();
    }

    fn value(&mut self, address: Address) -> Vec<u8> {
        let entry = self.od.entry(address).unwrap();
        let mut buffer = [0; 64];
        let len = self.od.read(&entry, 0, &mut buffer).unwrap();
        buffer[..len].to_vec()
    }

    fn set(&mut self, address: Address, data: &[u8]) {
        let entry = self.od.entry(address).unwrap();
        self.od.write(&entry, 0, data, true).unwrap();
    }

    /// What a PDO holds, by its mapping.
    fn unpack(&mut self, mapping: u16, data: &[u8]) -> Vec<(Address, Vec<u8>)> {
        let count = self.value(Address::new(mapping, 0))[0];
        let mut rest = data;
        let mut values = Vec::new();
        for position in 1..=count {
            let word = self.value(Address::new(mapping, position));
            let mapped = Mapped::from_parameter(u32::from_le_bytes(word.try_into().unwrap()));
            let (value, after) = rest.split_at(usize::from(mapped.bits / 8));
            rest = after;
            if self.od.entry(mapped.address).is_ok() {
                values.push((mapped.address, value.to_vec()));
            }
        }
        assert!(rest.is_empty(), "{mapping:04X} maps less than {data:02X?}");
        values
    }

    /// The identifier of an RPDO.
    fn rpdo(&mut self, number: u16) -> CobId {
        let word = self.value(Address::new(0x13FF + number, 1));
        CobId::from_parameter(u32::from_le_bytes(word.try_into().unwrap()))
    }

    /// The application has this error, or one less: another one has come and gone.
    fn report(&mut self, emergency: Emergency) {
        let Emergency { code, register, vendor } = emergency;
        if code == ErrorCode::NO_ERROR {
            self.device.emergency(ErrorCode::CURRENT, ErrorRegister::CURRENT, [0; 5], &mut self.od);
            self.send();
            self.device.clear(ErrorRegister::CURRENT, &mut self.od);
        } else {
            self.device.emergency(code, register, vendor, &mut self.od);
        }
    }

    /// The application has the values that this TPDO carries.
    fn have(&mut self, number: u16, data: &[u8]) {
        for (address, value) in self.unpack(0x19FF + number, data) {
            self.set(address, &value);
            self.device.changed(address);
        }
    }
}

/// The drives of a chapter, by node-ID.
struct Replay<'p> {
    frames: Vec<&'p Printed>,
    drives: BTreeMap<u8, Drive>,
}

impl<'p> Replay<'p> {
    fn new(all: &'p [Printed], chapter: &str) -> Self {
        let frames: Vec<&Printed> = all.iter().filter(|printed| printed.chapter == chapter).collect();
        let has_node = |printed: &&&Printed| !matches!(printed.kind, Some(Kind::Nmt(_) | Kind::Sync));
        let nodes = frames.iter().filter(has_node).filter_map(|printed| printed.node());
        let drives = nodes.map(|node| (node.get(), Drive::new(node))).collect();
        Replay { frames, drives }
    }

    fn drive(&mut self, printed: &Printed) -> &mut Drive {
        let node = printed.node().expect("a frame of a node");
        self.drives.get_mut(&node.get()).expect("every node of the chapter has a drive")
    }

    /// The golden frames that directly follow, as long as they are of this kind.
    fn following<T>(&self, at: usize, wanted: impl Fn(Kind) -> Option<T>) -> Vec<(&'p Printed, T)> {
        let after = self.frames[at + 1..].iter().copied().take_while(|printed| printed.is_golden);
        after.map_while(|printed| printed.kind.and_then(&wanted).map(|found| (printed, found))).collect()
    }

    /// A request: the drive has the value that it is to answer with, does not refuse, and keeps what is written.
    fn request(&mut self, at: usize, frame: Frame) {
        let printed = self.frames[at];
        let place = printed.place();
        let request = ClientRequest::parse(frame.data());
        let answer = self.following(at, |kind| if let Kind::Response(answer) = kind { Some(answer) } else { None });
        let drive = self.drive(printed);
        if let Some((_, ServerResponse::InitiateUpload { address, content: Content::Expedited(data) })) = answer.first()
        {
            drive.set(*address, data.data());
        }
        drive.sent.clear();
        drive.take(&frame);
        let answer = drive.sent.front().and_then(|frame| ServerResponse::parse(frame.data()));
        assert!(!matches!(answer, None | Some(ServerResponse::Abort(_))), "{place}: {answer:?}");
        if let Some(ClientRequest::InitiateDownload { address, content: Content::Expedited(data) }) = request {
            assert_eq!(drive.value(address), data.data(), "{place}");
        }
    }

    /// NMT and SYNC: the drives have the values of the TPDOs that they send at once, and take RPDOs over.
    fn broadcast(&mut self, at: usize) {
        let printed = self.frames[at];
        for (sent, number) in self.following(at, tpdo) {
            self.drive(sent).have(number, sent.frame.data());
        }
        for drive in self.drives.values_mut() {
            drive.sent.clear();
            drive.take(&printed.frame);
            for (address, value) in std::mem::take(&mut drive.pending) {
                assert_eq!(drive.value(address), value, "{}", printed.place());
            }
        }
    }

    /// Every drive that listens to the identifier takes the RPDO.
    fn rpdo(&mut self, printed: &Printed, number: u16) {
        for drive in self.drives.values_mut() {
            if drive.rpdo(number) != printed.frame.id() {
                continue;
            }
            let values = drive.unpack(0x15FF + number, printed.frame.data());
            drive.take(&printed.frame);
            let transmission = drive.value(Address::new(0x13FF + number, 2))[0];
            if TransmissionType::from_code(transmission).is_synchronous() {
                drive.pending = values;
            } else {
                values
                    .iter()
                    .for_each(|(address, value)| assert_eq!(drive.value(*address), *value, "{}", printed.place()));
            }
        }
    }

    /// The drive sends the frame, perhaps after others that the manual does not print.
    fn expect(&mut self, printed: &Printed) {
        let drive = self.drive(printed);
        let was_sent = |drive: &Drive| drive.sent.iter().position(|frame| *frame == printed.frame);
        if let (None, Some(number)) = (was_sent(drive), printed.kind.and_then(tpdo)) {
            drive.have(number, printed.frame.data());
            drive.send();
        }
        if let Some(Kind::Emergency(emergency)) = printed.kind {
            drive.report(emergency);
            drive.send();
        }
        let at = was_sent(drive).unwrap_or_else(|| panic!("{} was not sent, but {:?}", printed.place(), drive.sent));
        drive.sent.drain(..=at);
    }
}

fn tpdo(kind: Kind) -> Option<u16> {
    if let Kind::Tpdo(number) = kind { Some(number) } else { None }
}

/// How many golden frames the drives of a chapter have taken and sent.
fn replay(chapter: &str) -> (usize, usize) {
    let all = printed();
    let mut replay = Replay::new(&all, chapter);
    let (mut taken, mut sent) = (0, 0);
    for (at, printed) in replay.frames.clone().into_iter().enumerate() {
        let id = printed.id.as_str();
        if let Some((_, data)) = INSTEAD.iter().find(|(instead, _)| *instead == id) {
            replay.request(at, Frame::from_array(printed.frame.id(), *data));
            continue;
        }
        if ELSEWHERE.contains(&id) || !(printed.is_golden || AS_PRINTED.contains(&id)) {
            continue;
        }
        match printed.kind.expect("golden frames are understood") {
            Kind::Request(_) => replay.request(at, printed.frame),
            Kind::Nmt(_) | Kind::Sync => replay.broadcast(at),
            Kind::Rpdo(number) => replay.rpdo(printed, number),
            Kind::Response(_) | Kind::Tpdo(_) | Kind::BootUp | Kind::Emergency(_) => {
                replay.expect(printed);
                sent += 1;
                continue;
            }
        }
        taken += usize::from(printed.is_golden);
    }
    (taken, sent)
}

#[test]
fn chapter_6_3_free_mapping() {
    assert_eq!(replay("6.3"), (5, 0));
}

#[test]
fn chapter_7_2_1_2_state_machine() {
    assert_eq!(replay("7.2.1.2"), (2, 4));
}

#[test]
fn chapter_7_2_1_3_jog_mode_via_sdo() {
    assert_eq!(replay("7.2.1.3"), (7, 7));
}

#[test]
fn chapter_7_2_1_4_torque_mode_via_sdo() {
    assert_eq!(replay("7.2.1.4"), (7, 7));
}

#[test]
fn chapter_7_2_1_5_jog_mode_via_pdo() {
    assert_eq!(replay("7.2.1.5"), (21, 20));
}

#[test]
fn chapter_7_2_1_6_torque_mode_via_pdo() {
    assert_eq!(replay("7.2.1.6"), (21, 19));
}

#[test]
fn chapter_7_2_1_7_homing_via_sdo() {
    assert_eq!(replay("7.2.1.7"), (14, 15));
}

#[test]
fn chapter_7_2_1_8_profile_position_mode() {
    assert_eq!(replay("7.2.1.8"), (31, 34));
}

#[test]
fn chapter_7_2_1_9_ascii_communication() {
    assert_eq!(replay("7.2.1.9"), (8, 6));
}

#[test]
fn chapter_7_2_1_10_sync_telegrams() {
    assert_eq!(replay("7.2.1.10"), (13, 12));
}

#[test]
fn chapter_7_2_2_1_interpolated_position_mode() {
    assert_eq!(replay("7.2.2.1"), (25, 26));
}

/// The chapters together leave out nothing but what is named above.
#[test]
fn every_golden_frame_is_replayed_or_named() {
    let all = printed();
    let chapters: BTreeSet<&str> = all.iter().map(|printed| printed.chapter.as_str()).collect();
    let counts = chapters.iter().map(|chapter| replay(chapter));
    let golden = all.iter().filter(|printed| printed.is_golden).count();
    assert_eq!(counts.map(|(taken, sent)| taken + sent).sum::<usize>() + ELSEWHERE.len(), golden);
    assert_eq!(chapters.len(), 11);
}
