//! What ends tasks in progress: a stop, a lost client, a silent node.

use std::sync::{Arc, Mutex};

use super::{Ending, bench_of, client, drive, enable, moves, until};
use lexican_bench::request::{Nmt, Other, Verb};
use lexican_bench::{Answer, Bench, Client, Request};
use lexican_runtime::host::{Fate, VirtualBus};
use lexican_runtime::{CobId, Duration};
use lexican_simulation::{Fault, Files, Plant, Power, Segment, SimulatedDevice};

const MACHINE: &str = "
[node.feeder]
id = 5
sheet = 'siko/ag03-1'

[node.cutter]
id = 6
sheet = 'kollmorgen/akd'
";

/// A machine whose node 6, after an event, does not answer SDO requests or answers them late.
struct Rig {
    bench: Ending,
    segment: Arc<Mutex<Segment<SimulatedDevice>>>,
}

fn rig(fate: Fate) -> Rig {
    let plant = Plant::parse(MACHINE, "machine.toml", Files::Embedded(&[])).unwrap();
    let bus = VirtualBus::with_bit_rate(500);
    let id = Some(CobId::standard(0x586).unwrap());
    let fault = Fault { sender: None, id, every: 1, in_a_row: 1, fate };
    let plant = Plant { faults: vec![fault], ..plant };
    let mut segment = plant.segment(bus.now()).unwrap();
    segment.set_fault(0, false);
    let segment = Arc::new(Mutex::new(segment));
    bus.attach(Arc::clone(&segment));
    Rig { bench: bench_of(&bus), segment }
}

impl Rig {
    fn disturb(&self, on: bool) {
        self.segment.lock().unwrap().set_fault(0, on);
    }

    fn client(&self) -> Client {
        client(&self.bench)
    }
}

fn travel(bench: &Bench, client: &Client) -> lexican_bench::engine::Reply {
    enable(client);
    let travel = client.ask(drive(5, Verb::MoveTo, Some("100000")));
    until(bench, moves);
    travel
}

#[test]
fn a_stop_ends_a_backup_and_what_waits_behind_it() {
    let rig = rig(Fate::Delay(Duration::from_millis(20)));
    let client = rig.client();
    rig.disturb(true);
    let backup = client.ask(Request::Backup { node: 6 });
    let read = client.ask(Request::Read { node: 6, addresses: vec!["1000".to_owned()] });
    until(&rig.bench, |view| view.jobs.iter().any(|job| job.done.is_some()));
    assert_eq!(client.ask(Request::StopAll).wait(), Ok(Answer::Done));
    assert!(backup.wait().unwrap_err().why.contains("stop"));
    assert!(read.wait().unwrap_err().why.contains("stop"));
    let view = rig.bench.view();
    assert!(view.jobs.iter().all(|job| job.is_success == Some(false)), "{:?}", view.jobs);
    let values = client.ask(Request::Read { node: 6, addresses: vec!["1000:00".to_owned()] }).wait();
    assert!(matches!(values, Ok(Answer::Values(_))), "its SDO server is free again: {values:?}");
}

#[test]
fn a_drive_that_cannot_be_told_to_stop_may_be_moving() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    rig.disturb(true);
    client.ask(Request::StopAll).wait().unwrap_err();
    let view = rig.bench.view();
    let ending = view.drives[1].ending.as_ref().unwrap();
    assert!(ending.may_be_moving && !ending.is_success && ending.remedy.is_some(), "{ending:?}");
    assert!(!view.drives[0].ending.as_ref().unwrap().may_be_moving);
    rig.disturb(false);
    assert_eq!(client.ask(Request::StopAll).wait(), Ok(Answer::Done));
    assert!(!rig.bench.view().drives[1].ending.as_ref().unwrap().may_be_moving);
}

#[test]
fn a_stop_is_sent_until_it_is_confirmed_however_often_it_was_pressed() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    rig.disturb(true);
    let requests = || rig.bench.view().bus.ids.iter().find(|rate| rate.id == "606").map_or(0, |rate| rate.frames);
    let before = requests();
    client.ask(Request::StopAll).wait().unwrap_err();
    let of_one = requests() - before;
    let presses: Vec<_> = (0..16).map(|_| client.ask(Request::StopAll)).collect();
    for press in presses {
        let refused = press.wait().unwrap_err();
        assert!(refused.why.contains("drive 6 has not confirmed that it stands"), "{refused:?}");
    }
    assert!(requests() - before < 4 * of_one, "the presses share an attempt");
    let view = rig.bench.view();
    let unconfirmed = view.drives[1].unconfirmed.clone().expect("it goes on");
    assert!(unconfirmed.since < view.time && unconfirmed.why.is_some(), "{unconfirmed:?}");
    assert_eq!(view.drives[0].unconfirmed, None);
    let refused = client.ask(drive(6, Verb::MoveTo, Some("5"))).wait().unwrap_err();
    assert!(refused.why.contains("is to stand"), "{refused:?}");
    rig.disturb(false);
    let view = until(&rig.bench, |view| view.drives[1].unconfirmed.is_none());
    assert!(!view.drives[1].ending.as_ref().unwrap().may_be_moving);
    assert_eq!(rig.bench.end(), [""; 0]);
}

#[test]
fn the_end_names_the_drive_that_has_not_confirmed_and_does_not_wait_for_ever() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    rig.disturb(true);
    let presses: Vec<_> = (0..16).map(|_| client.ask(Request::StopAll)).collect();
    let began = rig.bench.view().time;
    let unconfirmed = rig.bench.end();
    let took = rig.bench.view().time - began;
    assert!(unconfirmed.len() == 1 && unconfirmed[0].contains("drive 6"), "{unconfirmed:?}");
    assert!(took < 10.0, "{took} s");
    assert!(presses.into_iter().all(|press| press.wait().is_err()));
    assert_eq!(rig.bench.end(), unconfirmed, "a second end waits for nothing");
}

#[test]
fn a_stopped_node_is_said_to_take_no_stop_and_gets_it_when_it_is_started() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    client.ask(Request::Nmt { node: Some(6), command: Nmt::Stop }).wait().unwrap();
    let refused = client.ask(Request::StopAll).wait().unwrap_err();
    assert!(refused.remedy.as_ref().unwrap().contains("STOPPED (NMT)"), "{refused:?}");
    client.ask(Request::Nmt { node: Some(6), command: Nmt::PreOperational }).wait().unwrap();
    until(&rig.bench, |view| view.drives[1].unconfirmed.is_none());
    assert_eq!(rig.bench.end(), [""; 0]);
}

#[test]
fn a_drive_that_loses_its_power_is_not_shown_as_enabled_and_at_its_target() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    client.ask(drive(5, Verb::Enable, None)).wait().unwrap();
    until(&rig.bench, |view| view.drives[0].seen.is_some_and(|seen| !seen.is_old));
    let (node, now) = (lexican_runtime::NodeId::new(5), lexican_runtime::Instant::ZERO);
    let power = |power| {
        let mut segment = rig.segment.lock().unwrap();
        segment.nodes_mut().find(|device| device.node() == node).unwrap().set_power(now, power);
    };
    power(Power::Off);
    let view = until(&rig.bench, |view| view.drives[0].seen.is_some_and(|seen| seen.is_old));
    assert!(view.drives[1].seen.is_some_and(|seen| !seen.is_old), "the other one is there");
}

#[test]
fn a_second_stop_does_not_undo_the_first() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    let travel = travel(&rig.bench, &client);
    let stops: Vec<_> = (0..4).map(|_| client.ask(Request::StopAll)).collect();
    for stop in stops {
        assert_eq!(stop.wait(), Ok(Answer::Done));
    }
    assert_eq!(travel.wait(), Ok(Answer::Done));
    until(&rig.bench, |view| view.drives[0].order.is_none() && !moves(view));
}

#[test]
fn an_order_that_waits_is_dropped_with_its_client() {
    let rig = rig(Fate::Lose);
    let lost = rig.client();
    enable(&lost);
    let at = rig.bench.view().drives[0].position;
    let backup = lost.ask(Request::Backup { node: 5 });
    let travel = lost.ask(drive(5, Verb::MoveTo, Some("100000")));
    drop(lost);
    assert!(backup.wait().is_err() && travel.wait().is_err());
    let other = rig.bench.open_client();
    let read = Request::Read { node: 5, addresses: vec!["6064:00".to_owned()] };
    let Ok(Answer::Values(values)) = other.ask(read).wait() else { panic!("a value") };
    assert_eq!(values[0].number, at, "it has not moved");
    assert!(rig.bench.view().drives[0].order.is_none());
}

#[test]
fn whoever_takes_the_hands_ends_what_was_ordered() {
    let rig = rig(Fate::Lose);
    let one = rig.client();
    let travel = travel(&rig.bench, &one);
    let queued = one.ask(drive(5, Verb::MoveTo, Some("0")));
    let other = rig.bench.open_client();
    other.ask(Request::TakeControl { force: true }).wait().unwrap();
    assert_eq!(travel.wait(), Ok(Answer::Done));
    assert!(queued.wait().is_err());
    let view = until(&rig.bench, |view| view.drives[0].order.is_none() && !moves(view));
    assert_eq!(view.control.holder, Some(other.number()));
    assert_eq!(view.drives[0].ending.as_ref().unwrap().text, "interrupted: it has been stopped");
    one.ask(drive(5, Verb::MoveTo, Some("0"))).wait().unwrap_err();
}

#[test]
fn a_silent_node_does_not_hold_up_others() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    rig.disturb(true);
    let silent = client.ask(Request::Read { node: 6, addresses: vec!["1000:00".to_owned()] });
    for _ in 0..20 {
        client.ask(Request::Read { node: 5, addresses: vec!["1000:00".to_owned()] }).wait().unwrap();
    }
    let refused = silent.wait().unwrap_err();
    assert!(refused.remedy.is_some(), "{refused:?}");
}

#[test]
fn nodes_are_compared_with_each_other_both_ways_at_once() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    let compare = |node, other| client.ask(Request::Compare { node, with: Other::Node(other) });
    let (there, back) = (compare(5, 6), compare(6, 5));
    let (Ok(Answer::Differences(there)), Ok(Answer::Differences(back))) = (there.wait(), back.wait()) else {
        panic!("differences")
    };
    assert_eq!(there.len(), back.len());
    assert!(!there.is_empty());
}

#[test]
fn a_faster_watch_that_ends_leaves_the_slower_one() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    let watch = |every_ms| Request::Watch { node: 5, address: "6064:00".to_owned(), every_ms };
    for every_ms in [10, 500, 20] {
        client.ask(watch(every_ms)).wait().unwrap();
    }
    let view = until(&rig.bench, |view| view.watched.iter().any(|watched| watched.value.is_some()));
    assert_eq!(view.watched.iter().map(|watched| watched.every_ms).collect::<Vec<_>>(), [20]);
    client.ask(Request::Unwatch { node: 5, address: "6064:00".to_owned() }).wait().unwrap();
    assert!(rig.bench.view().watched.is_empty());
}

#[test]
fn an_interrupted_travel_is_resumed_to_its_target_or_dropped_for_a_new_one() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    enable(&client);
    let interrupted = |target: &str| {
        let travel = client.ask(drive(5, Verb::MoveTo, Some(target)));
        until(&rig.bench, moves);
        assert_eq!(client.ask(Request::StopAll).wait(), Ok(Answer::Done));
        travel.wait().unwrap();
        assert!(rig.bench.view().drives[0].orders.contains(&Verb::Resume));
        let refused = client.ask(drive(5, Verb::MoveTo, Some("0"))).wait().unwrap_err();
        assert!(refused.why.contains("its travel is interrupted"), "{refused:?}");
        assert!(refused.remedy.unwrap().contains("drop the rest of it"));
    };
    interrupted("3000");
    let resumed = client.ask(drive(5, Verb::Resume, None));
    let target = until(&rig.bench, |view| view.drives[0].order.is_some() && view.drives[0].target.is_some());
    assert_eq!(target.drives[0].target, Some(3000.0), "as the drive has it");
    resumed.wait().unwrap();
    let view = until(&rig.bench, |view| view.drives[0].order.is_none() && !moves(view));
    assert_eq!(
        (view.drives[0].position, &*view.drives[0].ending.as_ref().unwrap().text),
        (Some(3000.0), "it has reached its target")
    );

    interrupted("100000");
    client.ask(drive(5, Verb::Drop, None)).wait().unwrap();
    assert_eq!(until(&rig.bench, |view| view.drives[0].order.is_none()).drives[0].target, None);
    client.ask(drive(5, Verb::Enable, None)).wait().unwrap();
    client.ask(drive(5, Verb::MoveTo, Some("3000"))).wait().unwrap();
}

#[test]
fn a_refused_order_leaves_the_target_of_the_drive() {
    let rig = rig(Fate::Lose);
    let client = rig.client();
    client.ask(Request::Nmt { node: None, command: Nmt::Start }).wait().unwrap();
    client.ask(drive(5, Verb::MoveTo, Some("5000"))).wait().unwrap_err();
    assert_eq!(rig.bench.view().drives[0].target, None, "it is not enabled");
    client.ask(drive(5, Verb::Enable, None)).wait().unwrap();
    client.ask(drive(5, Verb::MoveTo, Some("10"))).wait().unwrap();
    client.ask(drive(5, Verb::MoveTo, Some("2000000000"))).wait().unwrap_err();
    assert_eq!(rig.bench.view().drives[0].target, Some(10.0));
}
