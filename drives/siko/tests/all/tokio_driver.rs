//! The tokio driver: the same as the blocking one, for several drives at once.

use std::future::{Future, poll_fn};
use std::pin::pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Waker};

use lexican_runtime::host::tokio::Network;
use lexican_runtime::host::{Incoming, Link, LinkError, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use siko_ag03_1::Direction;
use siko_ag03_1::driver::sequence::Recovery;
use siko_ag03_1::driver::tokio::Drive;
use siko_ag03_1::driver::{DriveContext, Error, Missing, Mode, Outcome, Protection, Supervision, VelocityOutcome};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::state::State;

use super::flooded::flooded;

const NODE: NodeId = NodeId::literal(5);

/// A network with a simulated drive at each node.
fn network(nodes: &[u8]) -> (VirtualBus, Network, Vec<Arc<Mutex<SimulatedDrive>>>) {
    let bus = VirtualBus::with_bit_rate(500);
    let simulated: Vec<_> =
        nodes.iter().map(|node| Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NodeId::literal(*node))))).collect();
    for drive in &simulated {
        bus.attach(Arc::clone(drive));
    }
    let network = Network::spawn(bus.link()).unwrap();
    (bus, network, simulated)
}

#[tokio::test]
async fn a_drive_travels_and_runs() {
    let (_, network, _) = network(&[5]);
    let mut drive = Drive::connect_unprotected(network, NodeId::literal(5)).await.unwrap();
    match drive.move_to(5000).await {
        Err(Error::Refused(refusal)) => assert_eq!(refusal.0, [Missing::Enabled(State::SwitchOnDisabled)]),
        other => panic!("{other:?}"),
    }
    drive.enable().await.unwrap();
    assert_eq!(drive.move_to(5000).await.unwrap(), Outcome::Reached { position: 5000 });
    drive.start_moving_to(-5000).await.unwrap();
    drive.interrupt().await.unwrap();
    drive.resume().await.unwrap();
    assert_eq!(drive.finish().await.unwrap(), Outcome::Reached { position: -5000 });
    drive.set_mode(Mode::Velocity).await.unwrap();
    assert!(matches!(drive.run_at(30).await.unwrap(), VelocityOutcome::Reached { .. }));
    drive.stop().await.unwrap();
    drive.disable().await.unwrap();
    assert_eq!(drive.read(od::MODES_OF_OPERATION).await.unwrap(), od::OperatingMode::PROFILE_VELOCITY);
}

#[tokio::test]
async fn two_drives_travel_at_once_on_one_network() {
    let (_, network, _) = network(&[5, 6]);
    let mut one = Drive::connect_unprotected(network.clone(), NodeId::literal(5)).await.unwrap();
    let mut other = Drive::connect_unprotected(network, NodeId::literal(6)).await.unwrap();
    let visit = async |drive: &mut Drive, target| {
        drive.enable().await?;
        drive.move_to(target).await
    };
    let (first, second) = tokio::join!(visit(&mut one, 3000), visit(&mut other, -3000));
    assert_eq!(first.unwrap(), Outcome::Reached { position: 3000 });
    assert_eq!(second.unwrap(), Outcome::Reached { position: -3000 });
}

/// If an error leaves the drive moving, the error says so.
#[tokio::test]
async fn silence_is_noticed_while_the_drive_moves() {
    let (bus, network, simulated) = network(&[5]);
    let mut drive = Drive::connect_unprotected(network, NODE).await.unwrap();
    drive.enable().await.unwrap();
    drive.inch(Direction::Positive).await.unwrap();
    simulated[0].lock().unwrap().set_inputs(bus.now(), |inputs| inputs.control_supply_100mv = 0);
    let error = drive.pass(Duration::from_secs(60)).await.unwrap_err();
    assert!(error.to_string().ends_with("; the drive at node 5 may still be moving"), "{error}");
}

#[tokio::test]
async fn a_sequence_is_polled_when_something_has_happened() {
    let (_, network, _) = network(&[5]);
    let mut drive = Drive::connect_unprotected(network, NODE).await.unwrap();
    // From now on, the drive sends nothing unless something changes.
    drive.write(od::TPDO1_PARAMETER.event_timer(), od::Interval(0)).await.unwrap();
    drive.pass(Duration::from_secs(1)).await.unwrap();
    let mut polls = 0;
    drive
        .run(async |context: DriveContext| {
            let mut pass = pin!(context.pass(Duration::from_secs(5)));
            poll_fn(|context| {
                polls += 1;
                pass.as_mut().poll(context)
            })
            .await
        })
        .await
        .unwrap();
    assert!(polls <= 3, "{polls}");
}

#[tokio::test]
async fn life_guarding_is_armed_and_kept_going() {
    let (bus, network, simulated) = network(&[5]);
    let within = Supervision::within(Duration::from_secs(1));
    let mut drive = Drive::connect_protected(network, NODE, within).await.unwrap();
    assert!(matches!(drive.protection(), Protection::LifeGuarding { life_time_factor: 4, .. }));
    drive.enable().await.unwrap();
    drive.inch(Direction::Positive).await.unwrap();
    drive.pass(Duration::from_secs(10)).await.unwrap();
    assert_eq!(drive.state().await.unwrap(), State::OperationEnabled);
    drop(drive);
    for _ in 0..10 {
        tokio::task::yield_now().await;
    }
    // The network has ended with its last handle, so no guarding requests come.
    bus.advance(Duration::from_secs(2));
    assert_eq!(simulated[0].lock().unwrap().state(), State::SwitchOnDisabled);
}

#[tokio::test]
async fn a_drive_that_has_lost_its_power_is_brought_back_and_does_not_move() {
    let (bus, network, simulated) = network(&[5]);
    let mut drive = Drive::connect_protected(network, NODE, Supervision::within(Duration::from_secs(1))).await.unwrap();
    drive.set_mode(Mode::Velocity).await.unwrap();
    drive.enable().await.unwrap();
    drive.run_at(30).await.unwrap();
    simulated[0].lock().unwrap().switch_off(bus.now());
    let error = drive.pass(Duration::from_secs(1)).await.unwrap_err();
    assert!(matches!(error.into_cause(), Error::Sdo(_)));
    let absent = drive.recover(&Recovery::within(Duration::from_millis(100))).await.unwrap_err();
    assert!(matches!(absent.into_cause(), Error::Sdo(_)));
    simulated[0].lock().unwrap().switch_on(bus.now());
    let recovered = drive.recover(&Recovery::within(Duration::from_secs(5))).await.unwrap();
    assert_eq!(
        (recovered.now.state.map(|it| it.value), recovered.now.mode.map(|it| it.value)),
        (Some(State::SwitchOnDisabled), Some(2))
    );
    assert!(matches!(drive.protection(), Protection::LifeGuarding { .. }));
    drive.enable().await.unwrap();
    drive.pass(Duration::from_secs(1)).await.unwrap();
    assert_eq!(simulated[0].lock().unwrap().velocity(bus.now()), 0);
}

#[tokio::test]
async fn connecting_to_a_silent_node_ends_under_a_flood() {
    let (link, _) = flooded(&VirtualBus::with_bit_rate(500));
    let connected = Drive::connect_unprotected(Network::spawn(link).unwrap(), NODE).await;
    assert!(matches!(connected, Err(Error::Sdo(_))));
}

#[tokio::test]
async fn a_moving_drive_that_is_dropped_under_a_flood_is_sent_its_stop_first() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&MODEL, NODE));
    let (link, sent) = flooded(&bus);
    let mut drive = Drive::connect_unprotected(Network::spawn(link).unwrap(), NODE).await.unwrap();
    drive.enable().await.unwrap();
    drive.start_moving_to(50_000).await.unwrap();
    sent.lock().unwrap().clear();
    drop(drive);
    for _ in 0..10 {
        tokio::task::yield_now().await;
    }
    assert_eq!(sent.lock().unwrap().first().map(String::as_str), Some("205#0F01"));
}

/// A link that records the sent frames.
struct Recorder {
    link: VirtualLink,
    sent: Arc<Mutex<Vec<String>>>,
}

impl Link for Recorder {
    fn now(&self) -> Instant {
        self.link.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.sent.lock().unwrap().push(frame.to_string());
        self.link.send(frame)
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.link.receive(until)
    }
}

/// An enabled drive, and the record of the frames sent to it.
async fn recorded() -> (Drive, Arc<Mutex<Vec<String>>>) {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&MODEL, NodeId::literal(5)));
    let sent = Arc::default();
    let network = Network::spawn(Recorder { link: bus.link(), sent: Arc::clone(&sent) }).unwrap();
    let mut drive = Drive::connect_unprotected(network, NodeId::literal(5)).await.unwrap();
    drive.enable().await.unwrap();
    (drive, sent)
}

#[test]
fn a_drive_dropped_at_the_end_of_main_is_told_to_stop() {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let sent = runtime.block_on(async {
        let (mut drive, sent) = recorded().await;
        drive.start_moving_to(20_000).await.unwrap();
        sent.lock().unwrap().clear();
        sent
    });
    drop(runtime);
    assert_eq!(*sent.lock().unwrap(), ["205#0F01"]);
}

#[derive(Clone, Copy, Debug)]
enum Order {
    Inch,
    Step,
    Travel,
    Run,
}

impl Order {
    /// The beginning of the frame that moves the drive.
    fn starts(self) -> &'static str {
        match self {
            Order::Inch => "205#0F40",
            Order::Step => "205#0F20",
            Order::Travel => "405#1F00",
            Order::Run => "505#0F00",
        }
    }

    /// The frame that stops the drive.
    fn stops(self) -> &'static str {
        match self {
            Order::Step => "205#0201",
            _ => "205#0F01",
        }
    }

    async fn give(self, drive: &mut Drive) -> Result<(), Error> {
        match self {
            Order::Inch => drive.inch(Direction::Positive).await,
            Order::Step => drive.step().await.map(drop),
            Order::Travel => drive.start_moving_to(20_000).await,
            Order::Run => drive.run_at(60).await.map(drop),
        }
    }
}

/// Gives an order, and drops it and the drive after this many polls. Returns whether the order was over by then.
async fn cancelled(order: Order, polls: u32) -> bool {
    let (mut drive, sent) = recorded().await;
    if let Order::Run = order {
        drive.set_mode(Mode::Velocity).await.unwrap();
    }
    sent.lock().unwrap().clear();
    let mut given = Box::pin(order.give(&mut drive));
    for _ in 0..polls {
        if given.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_ready() {
            return true;
        }
        tokio::task::yield_now().await;
    }
    drop(given);
    let before = sent.lock().unwrap().len();
    drop(drive);
    for _ in 0..10 {
        tokio::task::yield_now().await;
    }
    let sent = sent.lock().unwrap();
    let starts = |frame: &String| frame.starts_with(order.starts());
    assert!(!sent[before..].iter().any(starts), "{order:?} after {polls} polls: {sent:?}");
    let started = sent[..before].iter().any(starts);
    assert!(
        !started || sent[before..].iter().any(|frame| frame == order.stops()),
        "{order:?} after {polls} polls: {sent:?}"
    );
    false
}

#[tokio::test]
async fn an_order_that_is_cancelled_at_any_await_does_not_start_the_drive_later() {
    for order in [Order::Inch, Order::Step, Order::Travel, Order::Run] {
        let mut polls = 1;
        while !cancelled(order, polls).await {
            polls += 1;
            // Velocity mode runs on long after its order.
            if polls > 100 {
                break;
            }
        }
        assert!(polls > 10, "there is something to cancel");
    }
}

#[tokio::test]
async fn status_words_that_came_too_fast_are_not_taken_for_new_ones() {
    let (bus, network, _) = network(&[5]);
    let mut drive = Drive::connect_unprotected(network, NodeId::literal(5)).await.unwrap();
    drive.enable().await.unwrap();
    drive.set_mode(Mode::Velocity).await.unwrap();
    assert!(matches!(drive.run_at(20).await.unwrap(), VelocityOutcome::Reached { .. }));
    let reached = drive.read(od::STATUSWORD).await.unwrap();
    let frame = Frame::from_array(CobId::of_node(0x180, NodeId::literal(5)), reached.0.to_le_bytes());
    for _ in 0..3000 {
        bus.link().send(&frame).unwrap();
    }
    bus.advance(Duration::from_secs(2));
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
    let outcome = drive.run_at(90).await.unwrap();
    assert!(matches!(outcome, VelocityOutcome::Reached { velocity: 80.. }), "{outcome:?}");
}
