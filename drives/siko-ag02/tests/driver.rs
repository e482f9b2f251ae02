//! The driver against the simulated drive, in virtual time.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use siko_ag02::Direction;
use siko_ag02::driver::{Approach, Drive, Error, Missing, Mode, Outcome, Refusal, VelocityOutcome};
use siko_ag02::fault::{self, Cause, FaultKind};
use siko_ag02::od;
use siko_ag02::sim::inputs::{BusState, Inputs, Shaft};
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_ag02::worked_examples::{Action, Example, NODE, POSITIONING, VELOCITY};

struct Bench {
    bus: VirtualBus,
    simulated: Arc<Mutex<SimulatedDrive>>,
    drive: Drive<VirtualLink>,
}

impl Bench {
    fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
        bus.attach(Arc::clone(&simulated));
        let drive = Drive::connect(bus.link(), NODE).unwrap();
        Bench { bus, simulated, drive }
    }

    fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        look(&mut self.simulated.lock().unwrap(), self.bus.now())
    }

    fn world(&self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
    }

    fn pass(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).unwrap();
    }
}

#[track_caller]
fn is_refused<T: std::fmt::Debug>(result: Result<T, Error>, missing: &[Missing]) {
    match result {
        Err(Error::Refused(Refusal(found))) => assert_eq!(found, missing),
        other => panic!("{other:?}"),
    }
}

/// A velocity is reached within the window of 6067h.
#[track_caller]
fn reaches(result: Result<VelocityOutcome, Error>, target: i32) {
    match result {
        Ok(VelocityOutcome::Reached { velocity }) => assert!((velocity - target).abs() <= 10, "{velocity}"),
        other => panic!("{other:?}"),
    }
}

/// The frames of an example up to the one that disables the drive: for that, the driver has a shorter way.
fn frames(example: &Example) -> Vec<Frame> {
    let sent = example.rows.iter().filter_map(|row| match row.action {
        Action::Send(frame) => Some((row.meaning, frame)),
        Action::Wait(_) => None,
    });
    sent.take_while(|(meaning, _)| *meaning != "RPDO1: Disable Operation").map(|(_, frame)| frame).collect()
}

#[track_caller]
fn sends(example: &Example, operate: impl FnOnce(&mut Bench)) {
    let mut bench = Bench::new();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&heard);
    bench.bus.observe(move |_, frame| list.lock().unwrap().push(*frame));
    operate(&mut bench);
    bench.pass(10);
    let heard = heard.lock().unwrap();
    let mut rest = heard.iter();
    for frame in frames(example) {
        assert!(rest.any(|other| *other == frame), "{frame} of table {} is not sent in its place", example.table);
    }
}

#[test]
fn it_sends_the_frames_of_table_25() {
    sends(&POSITIONING, |bench| {
        bench.drive.enable().unwrap();
        assert_eq!(bench.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
        bench.drive.start_moving_to(-5000).unwrap();
        bench.pass(2000);
        bench.drive.interrupt().unwrap();
        bench.drive.resume().unwrap();
        assert_eq!(bench.drive.finish().unwrap(), Outcome::Reached { position: -5000 });
    });
}

#[test]
fn it_sends_the_frames_of_table_26() {
    sends(&VELOCITY, |bench| {
        bench.drive.set_mode(Mode::Velocity).unwrap();
        bench.drive.enable().unwrap();
        reaches(bench.drive.run_at(68), 68);
        reaches(bench.drive.run_at(30), 30);
        bench.drive.stop().unwrap();
        reaches(bench.drive.run_at(-72), -72);
        bench.drive.stop().unwrap();
        is_refused(bench.drive.run_at(101), &[Missing::VelocityWithinGear { velocity: 101, most: 100 }]);
    });
}

#[test]
fn it_travels_inches_and_is_set_up() {
    let mut bench = Bench::new();
    assert_eq!(bench.drive.firmware().unwrap(), "2.00");
    bench.drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(100)).unwrap();
    bench.drive.set_approach(Approach::Negative).unwrap();
    bench.drive.calibrate(100).unwrap();
    bench.drive.enable().unwrap();
    assert_eq!(bench.drive.move_to(1000).unwrap(), Outcome::Reached { position: 1000 });
    assert_eq!(bench.drive.step().unwrap(), Outcome::Reached { position: 2600 });
    bench.drive.inch(Direction::Negative).unwrap();
    bench.pass(500);
    bench.drive.stop_inching().unwrap();
    assert!(bench.drive.position().unwrap() < 2600);
    bench.drive.quick_stop().unwrap();
    bench.drive.disable().unwrap();
    let settings = bench.drive.read_parameters().unwrap();
    bench.drive.write_parameters(&settings).unwrap();
    bench.drive.restore(None).unwrap();
    assert_eq!(bench.drive.read(od::MOTOR_PARAMETER_SET.v_pos()).unwrap(), od::Speed(50));
}

#[test]
fn what_is_missing_is_named() {
    let mut bench = Bench::new();
    bench.drive.enable().unwrap();
    bench.world(|inputs| inputs.limit_switches = [true, true]);
    is_refused(bench.drive.move_to(0), &[Missing::OffLimitSwitch(1), Missing::OffLimitSwitch(2)]);
    bench.world(|inputs| (inputs.limit_switches, inputs.enable) = ([false, false], false));
    is_refused(bench.drive.move_to(0), &[Missing::EnableInput]);
}

#[test]
fn a_limit_switch_ends_a_travel() {
    let mut bench = Bench::new();
    bench.drive.enable().unwrap();
    bench.drive.start_moving_to(20_000).unwrap();
    bench.pass(2000);
    bench.world(|inputs| inputs.limit_switches[0] = true);
    let outcome = bench.drive.finish().unwrap();
    assert!(!matches!(outcome, Outcome::Reached { .. } | Outcome::TimedOut { .. }), "{outcome:?}");
}

#[test]
fn faults_are_named_with_and_without_emergencies() {
    for emergencies in [false, true] {
        for (kind, fault) in [
            (FaultKind::Undervoltage, fault::UNDERVOLTAGE),
            (FaultKind::ShaftBlocked, fault::SHAFT_BLOCKED),
            (FaultKind::Overcurrent, fault::OVERCURRENT),
            (FaultKind::Overtemperature, fault::OVERTEMPERATURE),
            (FaultKind::Sensor, fault::SENSOR),
        ] {
            let mut bench = Bench::new();
            bench.drive.set_emergencies(emergencies).unwrap();
            bench.drive.enable().unwrap();
            bench.drive.start_moving_to(5000).unwrap();
            bench.pass(500);
            bench.world(|inputs| inputs.force(kind));
            assert_eq!(bench.drive.finish().unwrap(), Outcome::Fault(Cause::from(fault)));
            bench.world(|inputs| inputs.clear(kind));
            assert_eq!(bench.drive.reset_fault().unwrap(), Some(Cause::from(fault)));
            // The shaft runs out.
            bench.pass(3000);
            bench.drive.enable().unwrap();
            assert_eq!(bench.drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
        }
    }
}

#[test]
fn a_blocked_shaft_is_fault_b() {
    let mut bench = Bench::new();
    bench.drive.enable().unwrap();
    bench.drive.start_moving_to(5000).unwrap();
    bench.pass(500);
    bench.world(|inputs| inputs.shaft = Shaft::Blocked);
    assert_eq!(bench.drive.finish().unwrap(), Outcome::Fault(Cause::from(fault::SHAFT_BLOCKED)));
}

#[test]
fn after_bus_off_the_code_is_that_of_fault_f() {
    let mut bench = Bench::new();
    bench.world(|inputs| inputs.bus = BusState::Off);
    bench.world(|inputs| inputs.bus = BusState::Active);
    let cause = bench.drive.cause().unwrap();
    assert_eq!(cause.to_string(), "CAN controller error passive, or bus off (fault F)");
}

#[test]
fn the_two_drives_of_one_vendor_are_told_apart() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&siko_ag03_1::sim::MODEL, NODE));
    let other = NodeId::literal(6);
    bus.attach(SimulatedDrive::new(&MODEL, other));
    let error = Drive::connect(bus.link(), NODE).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a SIKO AG02: vendor 195h, profile 402, name Some(\"AG03\")");
    let error = siko_ag03_1::driver::Drive::connect(bus.link(), other).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a SIKO AG03/1: vendor 195h, profile 402, name None");
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn two_drives_travel_at_once_on_one_network() {
    use lexican_runtime::host::tokio::Network;
    use siko_ag02::driver::tokio::Drive;

    let bus = VirtualBus::with_bit_rate(500);
    let nodes = [NodeId::literal(5), NodeId::literal(6)];
    for node in nodes {
        bus.attach(SimulatedDrive::new(&MODEL, node));
    }
    let network = Network::spawn(bus.link()).unwrap();
    let visit = async |node: NodeId, target: i32| {
        let mut drive = Drive::connect(network.clone(), node).await?;
        drive.enable().await?;
        let outcome = drive.move_to(target).await?;
        drive.set_mode(Mode::Velocity).await?;
        let velocity = drive.run_at(30).await?;
        drive.stop().await?;
        drive.disable().await?;
        Ok::<_, Error>((outcome, velocity))
    };
    for (ended, position) in
        <[_; 2]>::from(tokio::join!(visit(nodes[0], 5000), visit(nodes[1], -5000))).into_iter().zip([5000, -5000])
    {
        let (outcome, velocity) = ended.unwrap();
        assert_eq!(outcome, Outcome::Reached { position });
        reaches(Ok(velocity), 30);
    }
}
