//! The examples of chapters 6.3 and 7.2: the driver sends what they print. Each chapter is driven by the operations that do
//! the same, against a device with the generated dictionary and as much of a state machine as the examples show.

use std::collections::VecDeque;
use std::sync::{Arc, LazyLock, Mutex};

use kollmorgen_akd::driver::{AKD, AKD_BY_SDO, Description, HomingOutcome, Mode, Outcome};
use kollmorgen_akd::{ascii, od};
use lexican_driver::description::{Outputs, Pdo, Signal};
use lexican_driver::{Any, DriveContext, Error};
use lexican_runtime::device::{Behaviour, ChangeRule, Device};
use lexican_runtime::host::{Fate, Node, VirtualBus, VirtualLink};
use lexican_runtime::object::{
    Address, Mapped, Mapping, Object, ObjectDictionary, PdoDirection, Rpdo, Tpdo, Value, Values, Writable,
};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::profile::cia402::{Command, State, status};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency, ErrorCode, ErrorRegister};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::wire::sdo::{Abort, ClientRequest, Content, Expedited, ServerResponse};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

use crate::kinds::frames::Example as Chapter;

/// The chapters, and whether the driver does things in their order. Where it does not, that does not matter to the drive.
pub(super) const CHAPTERS: &[Chapter] = &[
    ("6.3", true, a_pdo_is_mapped),
    ("7.2.1.2", true, the_drive_is_switched_on),
    ("7.2.1.3", true, it_runs),
    ("7.2.1.4", true, it_turns_with_a_torque),
    ("7.2.1.5", false, velocities_go_by_pdo),
    ("7.2.1.6", false, torques_go_by_pdo),
    ("7.2.1.7", true, it_homes),
    ("7.2.1.8", false, it_travels),
    ("7.2.1.8", false, it_homes_by_sdo),
    ("7.2.1.9", true, it_is_asked_for_its_faults),
    ("7.2.1.10", false, pdos_wait_for_sync),
    ("7.2.2.1", false, it_is_made_ready_for_interpolation),
];

type Drive = lexican_driver::Drive<VirtualLink, Any>;

const SYNC: TransmissionType = TransmissionType::SynchronousCyclic(1);

/// The AKD with its PDOs for the application.
static BY_SDO: LazyLock<&Description> = LazyLock::new(|| &AKD_BY_SDO);

/// An AKD whose control word and status word go by RPDO1 and TPDO1 alone, as in chapters 7.2.1.8 and 7.2.2.1.
static BY_FIRST_PDOS: LazyLock<&Description> = LazyLock::new(|| {
    let akd: &Description = &AKD;
    Box::leak(Box::new(Description {
        outputs: Outputs { control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }), ..Outputs::BY_SDO },
        inputs: &[Pdo { base: 0x180, signals: &[Signal::StatusWord] }],
        ..*akd
    }))
});

/// A drive that follows the examples.
struct ExampleDrive {
    device: Device,
    od: od::Storage,
    control: u16,
    status: u16,
    /// Status words that come later.
    later: VecDeque<(Instant, u16)>,
    answer: &'static [u8],
}

impl ExampleDrive {
    fn new(node: NodeId) -> Self {
        let behaviour = Behaviour { changes: ChangeRule::InPreOperational, ..Behaviour::CIA_301 };
        let (device, od) = (Device::new(node, behaviour), od::storage(node));
        let answer = b">No faults active\n\r\n";
        let mut drive = ExampleDrive { device, od, control: 0, status: 0, later: VecDeque::new(), answer };
        drive.device.restart(Instant::ZERO, &mut drive.od);
        let set = [(0x1002, 1 << 29), (0x6060, 1), (0x6061, 1)];
        set.into_iter().for_each(|(index, value)| drive.set(index, value));
        drive.set_text(Address::new(0x1008, 0), b"M006");
        drive.report(0x0240);
        drive
    }

    fn get(&mut self, index: u16) -> u64 {
        let entry = self.od.entry(Address::new(index, 0)).unwrap();
        let mut raw = [0; 8];
        self.od.read(&entry, 0, &mut raw).unwrap();
        u64::from_le_bytes(raw)
    }

    fn set(&mut self, index: u16, value: u64) {
        let address = Address::new(index, 0);
        let entry = self.od.entry(address).unwrap();
        self.od.write(&entry, 0, &value.to_le_bytes()[..entry.data_type.size().unwrap()], true).unwrap();
        self.device.changed(address);
    }

    fn set_text(&mut self, address: Address, text: &[u8]) {
        let entry = self.od.entry(address).unwrap();
        self.od.write(&entry, 0, text, true).unwrap();
    }

    fn report(&mut self, status: u16) {
        self.status = status;
        self.set(0x6041, status.into());
    }

    /// What follows from the objects as they are now.
    fn follow(&mut self, now: Instant) {
        let (mode, word) = (self.get(0x6060), self.get(0x6040) as u16);
        if mode != self.get(0x6061) && self.status & 0x6F == 0x27 {
            self.report(0x0237);
        }
        self.set(0x6061, mode);
        let runs = mode == 3 && word & 0x010F == 0x000F;
        let velocity = if runs { self.get(0x60FF) } else { 0 };
        self.set(0x606C, velocity);
        self.set(0x1002, 1 << 29 | if runs { 1 << 9 } else { 0 });
        let rises = word & !self.control & 0x10 != 0;
        if word == std::mem::replace(&mut self.control, word) {
            return;
        }
        match word & 0x0F {
            0x06 => self.report(0x0221),
            0x07 => self.report(0x0233),
            0x0F if rises && mode == 6 => {
                let after = |milliseconds| now + Duration::from_millis(milliseconds);
                self.later.extend([(after(50), 0x0637), (after(60), 0x1637)]);
            }
            0x0F if rises => self.report(0x1237),
            0x0F if self.status == 0x1237 => {
                self.report(0x0237);
                self.later.push_back((now + Duration::from_millis(300), 0x0637));
            }
            0x0F if self.status != 0x1637 => self.report(0x0237),
            _ => {}
        }
    }
}

impl Node for ExampleDrive {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if let Some([0x40, 0x26, 0x20, 0x02, ..]) = frame.data().first_chunk::<8>() {
            let (next, rest) = self.answer.split_at(self.answer.len().min(4));
            self.answer = rest;
            self.set_text(Address::new(0x2026, 2), next);
        }
        self.device.handle_frame(now, frame, &mut self.od);
        self.follow(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.device.handle_timeout(now, &mut self.od);
        if self.later.front().is_some_and(|(at, _)| *at <= now)
            && let Some((_, status)) = self.later.pop_front()
        {
            if self.get(0x6061) == 1 {
                let target = self.get(0x607A);
                self.set(0x6064, target);
            }
            self.report(status);
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.device.poll_transmit(now, &mut self.od)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let later = self.later.front().map(|(at, _)| *at);
        [later, self.device.poll_timeout()].into_iter().flatten().min()
    }
}

/// All that goes over the bus while a program drives the node.
fn record(
    node: u8,
    description: &'static Description,
    program: impl FnOnce(&mut Drive) -> Result<(), Error>,
) -> Vec<Frame> {
    let node = NodeId::literal(node);
    let bus = VirtualBus::with_bit_rate(500);
    let frames = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&frames);
    bus.set_fate(move |_, frame| {
        seen.lock().unwrap().push(*frame);
        Fate::Deliver
    });
    bus.attach(ExampleDrive::new(node));
    let mut drive = Drive::connect_described_unprotected(bus.link(), node, description).unwrap();
    program(&mut drive).unwrap();
    bus.advance(Duration::from_millis(10));
    drop(drive);
    let frames = frames.lock().unwrap();
    frames.clone()
}

/// A PDO with its predefined COB-ID.
fn pdo<D: PdoDirection, V: Values, N>(
    node: u8,
    number: u16,
    transmission: TransmissionType,
    mapping: &Mapping<D, V, N>,
) -> PdoSettings<'_> {
    PdoSettings::of(number, PdoCobId::valid(cob_id::<D>(node, number)), transmission, mapping)
}

fn cob_id<D: PdoDirection>(node: u8, number: u16) -> CobId {
    let first = if D::DIRECTION == Rpdo::DIRECTION { 0x100 } else { 0x80 };
    CobId::of_node(first + 0x100 * number, NodeId::literal(node))
}

/// A PDO that is switched off.
fn off<D: PdoDirection>(node: u8, number: u16) -> PdoSettings<'static> {
    PdoSettings {
        direction: D::DIRECTION,
        number,
        cob_id: PdoCobId::valid(cob_id::<D>(node, number)).switched_off(),
        transmission: TransmissionType::EventProfile,
        inhibit_100us: None,
        event_timer_ms: None,
        mapping: None,
    }
}

/// 6.3.
fn a_pdo_is_mapped() -> Vec<Frame> {
    const STATUS: Mapping<Tpdo, (od::Statusword, od::ManufacturerStatus), od::Device> =
        Mapping::transmit().with(od::STATUSWORD).with(od::MANUFACTURER_STATUS_REGISTER);
    record(1, &BY_SDO, |drive| {
        let cob_id = PdoCobId::valid(cob_id::<Tpdo>(1, 1)).without_remote();
        drive.configure_pdos(&[PdoSettings::of(1, cob_id, TransmissionType::EventProfile, &STATUS)])
    })
}

/// 7.2.1.2.
fn the_drive_is_switched_on() -> Vec<Frame> {
    record(3, &BY_SDO, Drive::enable)
}

/// 7.2.1.3.
fn it_runs() -> Vec<Frame> {
    record(3, &BY_SDO, |drive| {
        drive.set_mode(Mode::Velocity)?;
        drive.enable()?;
        drive.run_at(0x4100)?;
        drive.stop()
    })
}

/// 7.2.1.4.
fn it_turns_with_a_torque() -> Vec<Frame> {
    record(3, &BY_SDO, |drive| {
        drive.set_mode(Mode::Torque)?;
        drive.enable()?;
        drive.apply_torque(400)?;
        drive.stop()
    })
}

/// 7.2.1.5.
fn velocities_go_by_pdo() -> Vec<Frame> {
    const TARGET: Mapping<Rpdo, (od::Velocity,), od::Device> = Mapping::receive().with(od::TARGET_VELOCITY);
    const ACTUAL: Mapping<Tpdo, (od::Position, i32), od::Device> =
        Mapping::transmit().with(od::POSITION_ACTUAL_VALUE).with(od::VELOCITY_ACTUAL_VALUE);
    record(3, &BY_SDO, |drive| {
        drive.configure_pdos(&[
            pdo(3, 1, TransmissionType::EventProfile, &TARGET),
            pdo(3, 1, SYNC, &ACTUAL),
            off::<Tpdo>(3, 2),
            off::<Tpdo>(3, 3),
            off::<Tpdo>(3, 4),
            off::<Rpdo>(3, 2),
            off::<Rpdo>(3, 3),
            off::<Rpdo>(3, 4),
        ])?;
        drive.set_mode(Mode::Velocity)?;
        drive.enable()?;
        drive.send_pdo(1, &TARGET, (od::Velocity(0x4000),))?;
        drive.stop()
    })
}

/// 7.2.1.6.
fn torques_go_by_pdo() -> Vec<Frame> {
    const TARGET: Mapping<Rpdo, (od::Torque,), od::Device> = Mapping::receive().with(od::TARGET_TORQUE);
    const ACTUAL: Mapping<Tpdo, (od::Torque,), od::Device> = Mapping::transmit().with(od::TORQUE_ACTUAL_VALUE);
    record(3, &BY_SDO, |drive| {
        drive.configure_pdos(&[
            pdo(3, 1, TransmissionType::EventProfile, &TARGET),
            pdo(3, 1, SYNC, &ACTUAL),
            off::<Tpdo>(3, 2),
            off::<Tpdo>(3, 3),
            off::<Tpdo>(3, 4),
            off::<Rpdo>(3, 2),
            off::<Rpdo>(3, 3),
            off::<Rpdo>(3, 4),
        ])?;
        drive.set_mode(Mode::Torque)?;
        drive.enable()?;
        drive.send_pdo(1, &TARGET, (od::Torque(530),))?;
        drive.stop()
    })
}

/// 7.2.1.7.
fn it_homes() -> Vec<Frame> {
    record(3, &BY_SDO, |drive| {
        drive.state()?;
        drive.write(od::HOMING_SPEEDS.speed_during_search_for_switch(), od::Speed(10_000))?;
        drive.write(od::HOMING_SPEEDS.speed_during_search_for_zero(), od::Speed(5_000))?;
        drive.write(od::HOMING_ACCELERATION, od::Acceleration(10_000))?;
        drive.write(od::HOME_OFFSET, od::Position(25_000))?;
        drive.set_mode(Mode::Homing)?;
        drive.enable()?;
        let outcome = drive.home(od::HomingMethod::REFERENCE_SWITCH_WITH_ZEROING_NEGATIVE.0)?;
        assert!(matches!(outcome, HomingOutcome::Attained { .. }), "{outcome:?}");
        Ok(())
    })
}

/// 7.2.1.8.
fn it_travels() -> Vec<Frame> {
    const ORDER: Mapping<Rpdo, (od::Position, od::Speed), od::Device> =
        Mapping::receive().with(od::TARGET_POSITION).with(od::PROFILE_VELOCITY);
    const ACTUAL: Mapping<Tpdo, (od::Position, i32), od::Device> =
        Mapping::transmit().with(od::POSITION_ACTUAL_VALUE).with(od::VELOCITY_ACTUAL_VALUE);
    record(3, &BY_FIRST_PDOS, |drive| {
        drive.configure_pdos(&[
            pdo(3, 2, TransmissionType::EventProfile, &ORDER),
            pdo(3, 2, SYNC, &ACTUAL),
            off::<Tpdo>(3, 3),
            off::<Tpdo>(3, 4),
            off::<Rpdo>(3, 3),
            off::<Rpdo>(3, 4),
        ])?;
        drive.enable()?;
        drive.home(od::HomingMethod::REFERENCE_SWITCH_WITH_ZEROING_NEGATIVE.0)?;
        drive.write(od::PROFILE_ACCELERATION, od::Acceleration(50))?;
        drive.write(od::PROFILE_DECELERATION, od::Acceleration(50))?;
        assert_eq!(drive.move_to(36_000)?, Outcome::Reached { position: 36_000 });
        Ok(())
    })
}

/// 7.2.1.9.
fn it_is_asked_for_its_faults() -> Vec<Frame> {
    record(1, &BY_SDO, |drive| {
        let faults = drive.run(async |context: DriveContext| ascii::ask(&context, "DRV.FAULTS").await)?;
        assert_eq!(faults, "No faults active");
        Ok(())
    })
}

/// 7.2.1.10.
fn pdos_wait_for_sync() -> Vec<Frame> {
    const ORDER: Mapping<Rpdo, (od::Position, od::Speed), od::Device> =
        Mapping::receive().with(od::TARGET_POSITION).with(od::PROFILE_VELOCITY);
    const POSITION: Mapping<Tpdo, (od::Position,), od::Device> = Mapping::transmit().with(od::POSITION_ACTUAL_VALUE);
    const STATUS: Mapping<Tpdo, (od::Statusword, od::ManufacturerStatus), od::Device> =
        Mapping::transmit().with(od::STATUSWORD).with(od::MANUFACTURER_STATUS_REGISTER);
    record(3, &BY_SDO, |drive| {
        drive.configure_pdos(&[
            pdo(3, 2, TransmissionType::EventProfile, &ORDER),
            pdo(3, 1, TransmissionType::SynchronousCyclic(2), &POSITION),
            pdo(3, 2, TransmissionType::SynchronousCyclic(3), &STATUS),
        ])
    })
}

/// 7.2.2.1.
fn it_is_made_ready_for_interpolation() -> Vec<Frame> {
    const POINTS: Mapping<Rpdo, (od::Increments, u32), od::Device> =
        Mapping::receive().with(od::INTERPOLATION_DATA_RECORD.at(1).unwrap()).with_gap::<u32>();
    const ACTUAL: Mapping<Tpdo, (od::Increments, od::ManufacturerStatus), od::Device> =
        Mapping::transmit().with(od::POSITION_ACTUAL_INTERNAL_VALUE).with(od::MANUFACTURER_STATUS_REGISTER);
    let axis = |node| {
        record(node, &BY_FIRST_PDOS, |drive| {
            drive.configure_pdos(&[
                pdo(node, 2, SYNC, &POINTS),
                pdo(node, 2, SYNC, &ACTUAL),
                off::<Tpdo>(node, 3),
                off::<Tpdo>(node, 4),
            ])?;
            drive.set_mode(Mode::InterpolatedPosition)?;
            drive.write(od::INTERPOLATION_TIME_PERIOD.time_units(), 1)?;
            drive.write(od::INTERPOLATION_TIME_PERIOD.time_index(), -3)?;
            drive.enable()?;
            drive.send_pdo(2, &POINTS, (od::Increments(500), 1000))
        })
    };
    [axis(1), axis(2)].concat()
}

/// 7.2.1.8 once more, by SDO: TPDO1 with what it carries anyway, and the way to homing.
fn it_homes_by_sdo() -> Vec<Frame> {
    const STATUS: Mapping<Tpdo, (od::Statusword,), od::Device> = Mapping::transmit().with(od::STATUSWORD);
    record(3, &BY_SDO, |drive| {
        drive.configure_pdos(&[pdo(3, 1, TransmissionType::EventProfile, &STATUS)])?;
        drive.write(od::HOMING_SPEEDS.speed_during_search_for_switch(), od::Speed(72_000))?;
        drive.enable()?;
        drive.home(od::HomingMethod::REFERENCE_SWITCH_WITH_ZEROING_NEGATIVE.0)?;
        Ok(())
    })
}

fn write<T: Value, A: Writable, M, D>(node: u8, object: Object<T, A, M, D>, value: T) -> Frame {
    let content = Content::Expedited(Expedited::new(&value.to_bytes()[..T::SIZE]).unwrap());
    request(node, ClientRequest::InitiateDownload { address: object.address(), content })
}

fn request(node: u8, request: ClientRequest) -> Frame {
    Frame::from_array(CobId::of_node(0x600, NodeId::literal(node)), request.to_bytes())
}

fn response(node: u8, response: ServerResponse) -> Frame {
    Frame::from_array(CobId::of_node(0x580, NodeId::literal(node)), response.to_bytes())
}

fn written(node: u8, address: Address) -> Frame {
    response(node, ServerResponse::InitiateDownload { address })
}

fn answer(text: &[u8]) -> Frame {
    let content = Content::Expedited(Expedited::new(text).unwrap());
    response(1, ServerResponse::InitiateUpload { address: od::ASCII_CHANNEL.response().address(), content })
}

fn emergency(code: u16, register: u8, vendor: u8) -> Frame {
    let (code, register) = (ErrorCode(code), ErrorRegister(register));
    let emergency = Emergency { code, register, vendor: [vendor, 0, 0, 0, 0] };
    Frame::from_array(Emergency::cob_id(NodeId::literal(1)), emergency.emit(CodeOrder::LowByteFirst))
}

fn data(base: u16, node: u8, values: &[&[u8]]) -> Frame {
    Frame::new(CobId::of_node(base, NodeId::literal(node)), &values.concat()).unwrap()
}

/// A request with something in a byte that is not used.
fn padded(frame: Frame) -> Frame {
    let mut data = [0; 8];
    data.copy_from_slice(frame.data());
    data[7] = 1;
    Frame::from_array(frame.id(), data)
}

/// What the driver does not send or the device does not answer, and what the example should have: made of typed values.
pub(super) fn made() -> Vec<(&'static str, Frame)> {
    let sync = Frame::from_array(CobId::SYNC, []);
    let read_status = request(3, ClientRequest::InitiateUpload { address: od::STATUSWORD.address() });
    let (feed, shaft) = (od::FEED_CONSTANT.feed(), od::FEED_CONSTANT.shaft_revolutions());
    let enabled = od::Controlword(Command::EnableOperation.apply(0));
    let tpdo_2_count = od::TPDO2_MAPPING.number_of_entries();
    let too_high = Abort {
        address: od::HOMING_SPEEDS.speed_during_search_for_switch().address(),
        code: AbortCode::VALUE_TOO_HIGH,
    };
    let gap = Mapped::new(0x0007, 0, 32).to_parameter();
    let point = Mapped { address: od::INTERPOLATION_DATA_RECORD.at(1).unwrap().address(), bits: 32 }.to_parameter();
    let (first, second) = (od::RPDO2_MAPPING.mapped_object_1(), od::RPDO2_MAPPING.mapped_object_2());
    let rpdo_2 = od::RPDO2_PARAMETER.cob_id();
    let shown = |state: State, others: u16| {
        let word = od::Statusword(state.status_bits() | status::VOLTAGE_ENABLED | status::REMOTE | others);
        data(0x180, 1, &[&word.to_bytes()[..2]])
    };
    vec![
        ("F006", read_status),
        ("F012", read_status),
        ("F079", data(0x200, 3, &[&od::Velocity(0x4000).to_bytes()[..4]])),
        ("F080", sync),
        ("F081", data(0x180, 3, &[&od::Position(83_454).to_bytes()[..4], &1_747_878_i32.to_bytes()[..4]])),
        ("F120", sync),
        ("F121", data(0x180, 3, &[&od::Torque(537).to_bytes()[..2]])),
        ("F153", padded(write(3, od::RPDO2_MAPPING.number_of_entries(), 0))),
        ("F161", padded(write(3, od::TPDO1_MAPPING.number_of_entries(), 0))),
        ("F167", padded(write(3, tpdo_2_count, 0))),
        ("F185", write(3, feed, 1 << 20)),
        ("F186", written(3, feed.address())),
        ("F187", write(3, shaft, 36_000)),
        ("F188", written(3, shaft.address())),
        ("F196", response(3, ServerResponse::Abort(too_high))),
        ("F217", data(0x300, 3, &[&od::Position(36_000).to_bytes()[..4], &od::Speed(20_000).to_bytes()[..4]])),
        ("F218", sync),
        ("F225", sync),
        ("F240", answer(b"ctiv")),
        ("F242", answer(b"e\n\r\n")),
        ("F265", write(3, tpdo_2_count, 2)),
        ("F266", written(3, tpdo_2_count.address())),
        ("F269", sync),
        ("F270", emergency(0x4310, 0x08, 0)),
        ("F271", emergency(0, 0x88, 0)),
        ("F276", write(1, second, gap)),
        ("F282", write(2, first, gap)),
        ("F283", written(2, first.address())),
        ("F284", write(2, second, point)),
        ("F285", written(2, second.address())),
        ("F288", write(2, rpdo_2, 0x301)),
        ("F289", written(2, rpdo_2.address())),
        ("F320", shown(State::ReadyToSwitchOn, 0)),
        ("F325", data(0x200, 1, &[&enabled.with_new_setpoint_or_start(true).to_bytes()[..2]])),
        ("F326", shown(State::OperationEnabled, status::SET_POINT_ACKNOWLEDGE)),
        ("F328", sync),
        ("F331", emergency(0x4310, 0x08, 1)),
        ("F332", emergency(0, 0x08, 0)),
    ]
}
