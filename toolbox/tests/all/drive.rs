//! Orders to simulated drives in virtual time: how each ends, and what is seen meanwhile.

use kollmorgen_akd::driver::AKD;
use lexican_driver::{Any, Cause, Description, Drive, Error};
use lexican_runtime::host::{Link as _, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, Instant, NodeId};
use lexican_simulation::{Files, Plant};
use lexican_toolbox::drive::{Ending, Look, Order, Times, carry_out, has_ended};
use siko_ag03_1::driver::AG03_1;

const NODE: NodeId = NodeId::literal(5);
const WITHIN: Times = Times { within: Duration::from_secs(60), lasting: None };

/// An enabled drive alone on its bus, with additional lines in its machine.
fn enabled(device: &str, more: &str, description: &'static Description) -> Drive<VirtualLink, Any> {
    enabled_on(device, more, description).1
}

fn enabled_on(device: &str, more: &str, description: &'static Description) -> (VirtualBus, Drive<VirtualLink, Any>) {
    let text = format!("[node.axis]\nid = 5\nsheet = {device:?}\n{more}");
    let plant = Plant::parse(&text, "machine.toml", Files::Embedded(&[])).unwrap();
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(plant.segment(bus.now()).unwrap());
    let mut drive = Drive::connect_described_unprotected(bus.link(), NODE, description).unwrap();
    drive.enable().unwrap();
    (bus, drive)
}

fn ag03(more: &str) -> Drive<VirtualLink, Any> {
    enabled("siko/ag03-1", more, &AG03_1)
}

fn akd(more: &str) -> Drive<VirtualLink, Any> {
    enabled("kollmorgen/akd", more, &AKD)
}

/// The end of an order, and what was observed meanwhile.
fn carried(drive: &mut Drive<VirtualLink, Any>, order: Order, times: Times) -> (Result<Ending, Error>, Vec<Look>) {
    let mut looks = Vec::new();
    let ending =
        drive.run(async |drive| carry_out(&drive, order, times, &mut |look| looks.push(look), &mut |_| None).await);
    (ending, looks)
}

#[test]
fn a_travel_is_seen_from_its_beginning_to_its_target() {
    let mut drive = ag03("");
    let (ending, looks) = carried(&mut drive, Order::MoveTo(500), WITHIN);
    assert_eq!(ending.unwrap(), Ending::Reached);
    let positions: Vec<_> = looks.iter().filter_map(|look| look.position).collect();
    assert!(positions.len() > 5 && positions.is_sorted(), "{positions:?}");
    assert!(looks.iter().any(|look| look.velocity.is_some_and(|velocity| velocity > 0)));
    let last = looks.last().unwrap();
    assert_eq!((last.state, last.velocity), (Some(State::OperationEnabled), Some(0)));
    // From its present position, and back.
    assert_eq!(carried(&mut drive, Order::Step(Some(-500)), WITHIN).0.unwrap(), Ending::Reached);
    assert!(drive.position().unwrap().abs() < 10);
}

#[test]
fn what_is_wanted_besides_is_read_while_the_drive_travels() {
    let (bus, mut drive) = enabled_on("siko/ag03-1", "", &AG03_1);
    let register = Address::new(0x1001, 0);
    let mut listener = bus.link();
    let mut next = Instant::ZERO;
    let mut wanted = |now: Instant| {
        let is_due = now >= next;
        next = if is_due { now + Duration::from_millis(20) } else { next };
        is_due.then_some(register)
    };
    let order = Order::MoveTo(2000);
    let began = bus.now();
    let ending = drive.run(async |drive| carry_out(&drive, order, WITHIN, &mut |_| {}, &mut wanted).await);
    assert_eq!(ending.unwrap(), Ending::Reached);
    let frames = std::iter::from_fn(|| listener.receive_frame(bus.now()).unwrap());
    let answers = frames.filter(|frame| frame.to_string().starts_with("585#4F011000")).count();
    let turns = bus.now().since(began).as_micros() / 20_000;
    assert!(answers as u64 > turns / 4, "{answers} answers in {turns} turns");
    assert_eq!(drive.position().unwrap(), 2000);
}

#[test]
fn a_shaft_that_is_held_stalls_the_drive_or_trips_it() {
    let mut drive = akd("[simulate.axis]\ninputs = ['blocked = true']");
    let (ending, _) = carried(&mut drive, Order::MoveTo(50_000), WITHIN);
    assert_eq!(ending.unwrap(), Ending::Stalled);
    assert!(!drive.run(async |drive| Ok(drive.may_move())).unwrap(), "it has been stopped");
    let mut drive = ag03("[[simulate.axis.step]]\nwhen = 'moving'\nafter_ms = 500\nshaft = 'blocked'\n");
    let (ending, _) = carried(&mut drive, Order::MoveTo(50_000), WITHIN);
    let Ending::Fault(Cause::Fault(code)) = ending.unwrap() else { panic!("the AG03/1 notices it by itself") };
    assert_eq!(code.number, 0x7121);
}

#[test]
fn a_limit_switch_ends_a_travel_short_of_its_target() {
    let mut drive = akd("[simulate.axis]\ninputs = ['positive_limit = 20000']");
    let (ending, _) = carried(&mut drive, Order::MoveTo(90_000), WITHIN);
    assert_eq!(ending.unwrap(), Ending::Limit);
    assert!(drive.position().unwrap() < 90_000);
}

#[test]
fn a_home_switch_that_is_nowhere_leaves_the_drive_without_reference() {
    let mut drive = akd("[simulate.axis]\ninputs = ['negative_limit = -5000', 'positive_limit = 5000']");
    let (ending, _) = carried(&mut drive, Order::Home(Some(24)), WITHIN);
    assert_eq!(ending.unwrap(), Ending::NotHomed);
    assert_eq!(carried(&mut akd(""), Order::Home(Some(35)), WITHIN).0.unwrap(), Ending::Reached);
}

#[test]
fn running_ends_with_its_time_and_the_drive_stands() {
    let mut drive = akd("");
    let lasting = Times { lasting: Some(Duration::from_secs(2)), ..WITHIN };
    let (ending, looks) = carried(&mut drive, Order::Run(20_000), lasting);
    assert_eq!(ending.unwrap(), Ending::Reached);
    assert!(looks.iter().any(|look| look.velocity.is_some_and(|velocity| velocity > 0)));
    assert_eq!(looks.last().unwrap().velocity, Some(0));
}

#[test]
fn a_travel_whose_time_is_over_is_stopped() {
    let mut drive = ag03("");
    let times = Times { within: Duration::from_millis(500), lasting: None };
    assert_eq!(carried(&mut drive, Order::MoveTo(500_000), times).0.unwrap(), Ending::TimedOut);
    let stands = drive.position().unwrap();
    assert_eq!(
        carried(&mut drive, Order::Watch, Times { lasting: Some(Duration::from_secs(1)), ..WITHIN }).0.unwrap(),
        Ending::Reached
    );
    assert_eq!(drive.position().unwrap(), stands);
}

#[test]
fn what_the_drive_would_refuse_is_not_sent() {
    let mut drive = ag03("");
    drive.disable().unwrap();
    let (ending, looks) = carried(&mut drive, Order::MoveTo(500), WITHIN);
    let error = ending.unwrap_err();
    assert!(matches!(error, Error::Refused(_)) && has_ended(&error), "{error}");
    assert!(looks.iter().all(|look| look.velocity.is_none_or(|velocity| velocity == 0)));
    assert_eq!(carried(&mut drive, Order::Stop, WITHIN).0.unwrap(), Ending::Reached);
}
