//! The examples of chapters 6.3 and 7.2. The driver sends what the manager of the examples sends, by operations with
//! the same effect. The simulated drive is sent the printed frames, and answers as the drive of the examples does.

use std::sync::{Arc, LazyLock, Mutex};

use kollmorgen_akd::driver::{AKD, AKD_BY_SDO, Description, HomingOutcome, Mode, Outcome};
use kollmorgen_akd::sim::{Causes, Inputs, MODEL, Machine, ServoModel, SimulatedServo};
use kollmorgen_akd::{ascii, od};
use lexican_conform::{self as conform, Asked, Heard};
use lexican_driver::description::{Outputs, Pdo, Signal};
use lexican_driver::{Any, DriveContext, Error};
use lexican_runtime::device::Behaviour;
use lexican_runtime::host::{Fate, Link, Node, VirtualBus, VirtualLink};
use lexican_runtime::object::{Mapped, Mapping, Object, PdoDirection, Rpdo, Tpdo, Value, Values, Writable};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::profile::cia402::Command;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::wire::sdo::{ClientRequest, Content, Expedited};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::kinds::frames::Example as Chapter;

/// The chapters, and whether the driver keeps their order. Where it does not, the order does not matter to the drive.
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

/// An AKD that has control word and status word only in RPDO1 and TPDO1, as in chapters 7.2.1.8 and 7.2.2.1.
static BY_FIRST_PDOS: LazyLock<&Description> = LazyLock::new(|| {
    let akd: &Description = &AKD;
    Box::leak(Box::new(Description {
        outputs: Outputs { control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }), ..Outputs::BY_SDO },
        inputs: &[Pdo { base: 0x180, signals: &[Signal::StatusWord] }],
        ..*akd
    }))
});

/// The positions of the switches in the examples.
const MACHINE: Machine = Machine {
    negative_limit: Some(-100_000.0),
    positive_limit: Some(1_000_000.0),
    home_switch: Some((-20_000.0, -10_000.0)),
    index: Some((500.0, 1000.0)),
};

/// The simulated drive, with dummies (E88) and with the text of 7.2.1.9 in its ASCII channel, which is not simulated:
/// so the driver goes on, and its frames can be compared.
struct ExampleDrive {
    servo: SimulatedServo,
    answer: &'static [u8],
}

/// Made on demand, because a mutated `MODEL` is made on demand, too.
static WITH_DUMMIES: LazyLock<ServoModel> = LazyLock::new(|| {
    let model: &ServoModel = &MODEL;
    ServoModel { behaviour: Behaviour { dummies: 0xFE, ..model.behaviour }, ..*model }
});

impl ExampleDrive {
    fn new(node: NodeId) -> Self {
        let mut servo = SimulatedServo::new(Instant::ZERO, &WITH_DUMMIES, node);
        servo.set_inputs(Instant::ZERO, |inputs| inputs.machine = MACHINE);
        ExampleDrive { servo, answer: b">No faults active\n\r\n" }
    }
}

impl Node for ExampleDrive {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if let Some([0x40, 0x26, 0x20, 0x02, ..]) = frame.data().first_chunk::<8>() {
            let (next, rest) = self.answer.split_at(self.answer.len().min(4));
            self.answer = rest;
            self.servo.with_servo(now, |_, od| {
                let entry = od.entry(od::ASCII_CHANNEL.response().address()).unwrap();
                od.write(&entry, 0, next, true).unwrap();
            });
        }
        self.servo.handle_frame(now, frame);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.servo.handle_timeout(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.servo.poll_transmit(now)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.servo.poll_timeout()
    }
}

/// The simulated drives with node-IDs 1 to 3 at the start of a chapter, with the setup that the chapter presumes.
pub(super) struct Drives {
    bus: VirtualBus,
    link: VirtualLink,
    drives: Vec<Arc<Mutex<SimulatedServo>>>,
    /// The drive that has faults.
    faulty: usize,
}

impl Drives {
    pub(super) fn of_chapter(chapter: &str) -> Self {
        let bus = VirtualBus::new();
        let link = bus.link();
        let drive = |node| {
            let mut drive = SimulatedServo::new(bus.now(), &MODEL, NodeId::literal(node));
            drive.set_inputs(bus.now(), |inputs| inputs.machine = MACHINE);
            // The chapter says that the basic setup was made by the setup software, so its frames do not choose the
            // method.
            if chapter == "7.2.1.7" {
                drive.write(bus.now(), od::HOMING_METHOD.address(), &[12]).unwrap();
            }
            Arc::new(Mutex::new(drive))
        };
        let drives: Vec<_> = [1, 2, 3].map(drive).into();
        drives.iter().for_each(|drive| _ = bus.attach(Arc::clone(drive)));
        Drives { bus, link, drives, faulty: if chapter == "7.2.2.1" { 0 } else { 2 } }
    }
}

impl Asked for Drives {
    fn now(&self) -> Instant {
        self.bus.now()
    }

    fn send(&mut self, frame: &Frame) -> conform::Outcome {
        // A virtual bus without faults takes every frame.
        let _ = self.link.send(frame);
        Ok(())
    }

    fn hear(&mut self, until: Instant) -> conform::Outcome<Option<Heard>> {
        let frame = self.link.receive_frame(until).ok().flatten();
        Ok(frame.map(|frame| (self.bus.now(), frame)))
    }

    fn world(&mut self, word: &str, holds: bool, data: &[u8]) -> bool {
        let now = self.bus.now();
        let set = |number: usize, change: &dyn Fn(&mut Inputs)| {
            self.drives[number].lock().unwrap().set_inputs(now, |inputs| change(inputs));
        };
        match word {
            "supply off" => (0..3).for_each(|number| set(number, &|inputs| inputs.supply = !holds)),
            "fault" if holds => {
                let code = data.first_chunk().map(|code| u16::from_le_bytes(*code));
                set(self.faulty, &|inputs| inputs.faults = code.into());
            }
            "no fault" if holds => {
                // Wait until all motion has ended.
                self.bus.advance(Duration::from_secs(60));
                let now = self.bus.now();
                set(self.faulty, &|inputs| inputs.faults = Causes::NONE);
                let mut drive = self.drives[self.faulty].lock().unwrap();
                for word in [0_u16, 0x80] {
                    drive.write(now, od::CONTROLWORD.address(), &word.to_le_bytes()).unwrap();
                }
            }
            "fault" | "no fault" => {}
            _ => return false,
        }
        true
    }
}

/// All frames on the bus while a program drives the node.
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

/// The settings of a PDO with its predefined COB-ID.
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

/// The settings of a PDO that is switched off.
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

/// Chapter 6.3.
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

/// Chapter 7.2.1.8 by SDO: the default mapping of TPDO1, and the way to homing.
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

fn data(base: u16, node: u8, values: &[&[u8]]) -> Frame {
    Frame::new(CobId::of_node(base, NodeId::literal(node)), &values.concat()).unwrap()
}

/// A request with a value in an unused byte.
fn padded(frame: Frame) -> Frame {
    let mut data = [0; 8];
    data.copy_from_slice(frame.data());
    data[7] = 1;
    Frame::from_array(frame.id(), data)
}

/// Frames that the driver does not send, or that the example should have, made of typed values.
pub(super) fn made() -> Vec<(&'static str, Frame)> {
    let sync = Frame::from_array(CobId::SYNC, []);
    let read_status = request(3, ClientRequest::InitiateUpload { address: od::STATUSWORD.address() });
    let (feed, shaft) = (od::FEED_CONSTANT.feed(), od::FEED_CONSTANT.shaft_revolutions());
    let enabled = od::Controlword(Command::EnableOperation.apply(0));
    let tpdo_2_count = od::TPDO2_MAPPING.number_of_entries();
    let gap = Mapped::new(0x0007, 0, 32).to_parameter();
    let point = Mapped { address: od::INTERPOLATION_DATA_RECORD.at(1).unwrap().address(), bits: 32 }.to_parameter();
    let (first, second) = (od::RPDO2_MAPPING.mapped_object_1(), od::RPDO2_MAPPING.mapped_object_2());
    let rpdo_2 = od::RPDO2_PARAMETER.cob_id();
    vec![
        ("F006", read_status),
        ("F012", read_status),
        ("F079", data(0x200, 3, &[&od::Velocity(0x4000).to_bytes()[..4]])),
        ("F080", sync),
        ("F120", sync),
        ("F153", padded(write(3, od::RPDO2_MAPPING.number_of_entries(), 0))),
        ("F161", padded(write(3, od::TPDO1_MAPPING.number_of_entries(), 0))),
        ("F167", padded(write(3, tpdo_2_count, 0))),
        ("F185", write(3, feed, 1 << 20)),
        ("F187", write(3, shaft, 36_000)),
        ("F217", data(0x300, 3, &[&od::Position(36_000).to_bytes()[..4], &od::Speed(20_000).to_bytes()[..4]])),
        ("F218", sync),
        ("F225", sync),
        ("F265", write(3, tpdo_2_count, 2)),
        ("F269", sync),
        ("F276", write(1, second, gap)),
        ("F282", write(2, first, gap)),
        ("F284", write(2, second, point)),
        ("F288", write(2, rpdo_2, 0x301)),
        ("F325", data(0x200, 1, &[&enabled.with_new_setpoint_or_start(true).to_bytes()[..2]])),
        ("F328", sync),
    ]
}
