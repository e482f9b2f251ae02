//! The driver sends what the manual's examples print: each chapter is driven by the operations that do the same, against a
//! device with the generated dictionary and as much of a state machine as the examples show.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use kollmorgen_akd::driver::{AKD, Description, FreeDrive, HomingOutcome, Kind, Mode, Outcome};
use kollmorgen_akd::{ascii, od};
use lexican_driver::description::{Outputs, Pdo, Signal};
use lexican_driver::{Drive, DriveContext, Error};
use lexican_runtime::device::{Behaviour, ChangeRule, Device};
use lexican_runtime::host::{Fate, Node, VirtualBus, VirtualLink};
use lexican_runtime::object::{Address, Mapping, ObjectDictionary, PdoDirection, Rpdo, Tpdo, Values};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::frames::{Printed, printed};

const SYNC: TransmissionType = TransmissionType::SynchronousCyclic(1);

/// An AKD whose control word and status word go by RPDO1 and TPDO1 alone, as in chapters 7.2.1.8 and 7.2.2.1.
enum ByFirstPdos {}

impl Kind for ByFirstPdos {
    const DESCRIPTION: &'static Description = &Description {
        outputs: Outputs { control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }), ..Outputs::BY_SDO },
        inputs: &[Pdo { base: 0x180, signals: &[Signal::StatusWord] }],
        ..AKD
    };
}

/// A drive that follows the examples.
struct Example {
    device: Device,
    od: od::Storage,
    control: u16,
    status: u16,
    /// Status words that come later.
    later: VecDeque<(Instant, u16)>,
    answer: &'static [u8],
}

impl Example {
    fn new(node: NodeId) -> Self {
        let behaviour = Behaviour { changes: ChangeRule::InPreOperational, ..Behaviour::CIA_301 };
        let (device, od) = (Device::new(node, behaviour), od::storage(node));
        let answer = b">No faults active\n\r\n";
        let mut drive = Example { device, od, control: 0, status: 0, later: VecDeque::new(), answer };
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

impl Node for Example {
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
fn record<K: Kind>(node: u8, program: impl FnOnce(&mut Drive<VirtualLink, K>) -> Result<(), Error>) -> Vec<Frame> {
    let node = NodeId::literal(node);
    let bus = VirtualBus::with_bit_rate(500);
    let frames = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&frames);
    bus.set_fate(move |_, frame| {
        seen.lock().unwrap().push(*frame);
        Fate::Deliver
    });
    bus.attach(Example::new(node));
    let mut drive = Drive::connect(bus.link(), node).unwrap();
    program(&mut drive).unwrap();
    bus.advance(Duration::from_millis(10));
    drop(drive);
    let frames = frames.lock().unwrap();
    frames.clone()
}

/// A PDO with its predefined COB-ID.
fn pdo<D: PdoDirection, V: Values>(
    node: u8,
    number: u16,
    transmission: TransmissionType,
    mapping: &Mapping<D, V>,
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

/// Each golden frame of the chapter goes over the bus, in this order, except for these. Where the driver does things in
/// another order than the example, which does not matter to the drive, the frames are searched from the beginning.
#[track_caller]
fn check(chapter: &str, in_order: bool, frames: &[Frame], except: &[&str]) {
    let printed = printed();
    let mut left: Vec<Frame> = frames.to_vec();
    let golden = printed.iter().filter(|printed| printed.is_golden && printed.chapter == chapter);
    let mut missing = Vec::new();
    let mut place = |printed: &Printed| match left.iter().position(|frame| *frame == printed.frame) {
        Some(at) if in_order => drop(left.drain(..=at)),
        Some(at) => drop(left.remove(at)),
        None => missing.push(printed.id.clone()),
    };
    golden.for_each(&mut place);
    assert_eq!(missing, except, "{chapter}: {frames:?}");
}

#[test]
fn chapter_6_3_a_pdo_is_mapped() {
    const STATUS: Mapping<Tpdo, (od::Statusword, od::ManufacturerStatus)> =
        Mapping::transmit().with(od::STATUSWORD).with(od::MANUFACTURER_STATUS_REGISTER);
    let frames = record(1, |drive: &mut FreeDrive<_>| {
        let cob_id = PdoCobId::valid(cob_id::<Tpdo>(1, 1)).without_remote();
        drive.configure_pdos(&[PdoSettings::of(1, cob_id, TransmissionType::EventProfile, &STATUS)])
    });
    check("6.3", true, &frames, &[]);
}

#[test]
fn chapter_7_2_1_2_the_drive_is_switched_on() {
    let frames = record(3, FreeDrive::enable);
    check("7.2.1.2", true, &frames, &[]);
}

#[test]
fn chapter_7_2_1_3_it_runs() {
    let frames = record(3, |drive: &mut FreeDrive<_>| {
        drive.set_mode(Mode::Velocity)?;
        drive.enable()?;
        drive.run_at(0x4100)?;
        drive.stop()
    });
    check("7.2.1.3", true, &frames, &[]);
}

#[test]
fn chapter_7_2_1_4_it_turns_with_a_torque() {
    let frames = record(3, |drive: &mut FreeDrive<_>| {
        drive.set_mode(Mode::Torque)?;
        drive.enable()?;
        drive.apply_torque(400)?;
        drive.stop()
    });
    check("7.2.1.4", true, &frames, &[]);
}

#[test]
fn chapter_7_2_1_5_velocities_go_by_pdo() {
    const TARGET: Mapping<Rpdo, (od::Velocity,)> = Mapping::receive().with(od::TARGET_VELOCITY);
    const ACTUAL: Mapping<Tpdo, (od::Position, i32)> =
        Mapping::transmit().with(od::POSITION_ACTUAL_VALUE).with(od::VELOCITY_ACTUAL_VALUE);
    let frames = record(3, |drive: &mut FreeDrive<_>| {
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
    });
    // SYNC, and what the motor of the example does.
    check("7.2.1.5", false, &frames, &["F080", "F081"]);
}

#[test]
fn chapter_7_2_1_6_torques_go_by_pdo() {
    const TARGET: Mapping<Rpdo, (od::Torque,)> = Mapping::receive().with(od::TARGET_TORQUE);
    const ACTUAL: Mapping<Tpdo, (od::Torque,)> = Mapping::transmit().with(od::TORQUE_ACTUAL_VALUE);
    let frames = record(3, |drive: &mut FreeDrive<_>| {
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
    });
    check("7.2.1.6", false, &frames, &["F120", "F121"]);
}

#[test]
fn chapter_7_2_1_7_it_homes() {
    let frames = record(3, |drive: &mut FreeDrive<_>| {
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
    });
    check("7.2.1.7", true, &frames, &[]);
}

#[test]
fn chapter_7_2_1_8_it_travels() {
    const ORDER: Mapping<Rpdo, (od::Position, od::Speed)> =
        Mapping::receive().with(od::TARGET_POSITION).with(od::PROFILE_VELOCITY);
    const ACTUAL: Mapping<Tpdo, (od::Position, i32)> =
        Mapping::transmit().with(od::POSITION_ACTUAL_VALUE).with(od::VELOCITY_ACTUAL_VALUE);
    let frames = record(3, |drive: &mut Drive<_, ByFirstPdos>| {
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
    });
    // The mapping of TPDO1, which is the one that it has; padding; a speed that the drive refuses; the control word by SDO,
    // which goes by PDO here; SYNC.
    let mapping = ["F153", "F161", "F162", "F163", "F164", "F165", "F166", "F167"];
    let by_sdo = ["F195", "F196", "F197", "F198", "F200", "F201", "F203", "F204", "F206", "F207"];
    check("7.2.1.8", false, &frames, &[&mapping[..], &by_sdo[..], &["F218", "F225"]].concat());
}

#[test]
fn chapter_7_2_1_9_it_is_asked_for_its_faults() {
    let frames = record(1, |drive: &mut FreeDrive<_>| {
        let faults = drive.run(async |context: DriveContext| ascii::ask(&context, "DRV.FAULTS").await)?;
        assert_eq!(faults, "No faults active");
        Ok(())
    });
    check("7.2.1.9", true, &frames, &[]);
}

#[test]
fn chapter_7_2_1_10_pdos_wait_for_sync() {
    const ORDER: Mapping<Rpdo, (od::Position, od::Speed)> =
        Mapping::receive().with(od::TARGET_POSITION).with(od::PROFILE_VELOCITY);
    const POSITION: Mapping<Tpdo, (od::Position,)> = Mapping::transmit().with(od::POSITION_ACTUAL_VALUE);
    const STATUS: Mapping<Tpdo, (od::Statusword, od::ManufacturerStatus)> =
        Mapping::transmit().with(od::STATUSWORD).with(od::MANUFACTURER_STATUS_REGISTER);
    let frames = record(3, |drive: &mut FreeDrive<_>| {
        drive.configure_pdos(&[
            pdo(3, 2, TransmissionType::EventProfile, &ORDER),
            pdo(3, 1, TransmissionType::SynchronousCyclic(2), &POSITION),
            pdo(3, 2, TransmissionType::SynchronousCyclic(3), &STATUS),
        ])
    });
    // SYNC.
    check("7.2.1.10", false, &frames, &["F269"]);
}

#[test]
fn chapter_7_2_2_1_it_is_made_ready_for_interpolation() {
    const POINTS: Mapping<Rpdo, (od::Increments, u32)> =
        Mapping::receive().with(od::INTERPOLATION_DATA_RECORD.at(1).unwrap()).with_gap::<u32>();
    const ACTUAL: Mapping<Tpdo, (od::Increments, od::ManufacturerStatus)> =
        Mapping::transmit().with(od::POSITION_ACTUAL_INTERNAL_VALUE).with(od::MANUFACTURER_STATUS_REGISTER);
    let axis = |node| {
        record(node, |drive: &mut Drive<_, ByFirstPdos>| {
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
    // READY TO SWITCH ON without voltage, interpolation itself, SYNC, and the emergencies.
    let except = ["F320", "F325", "F326", "F328", "F331", "F332"];
    check("7.2.2.1", false, &[axis(1), axis(2)].concat(), &except);
}
