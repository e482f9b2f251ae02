//! The bench over simulated devices in real time: each request, who may make it, and the effects of a lost client.

use std::thread::yield_now;

use super::{Ending, bench_of, client, drive, enable, moves, until};
use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::request::{Nmt, Other, Verb};
use lexican_bench::sheet::Sheet;
use lexican_bench::view::{TraceFilter, View};
use lexican_bench::{Answer, Bench, Client, Request};
use lexican_eds::{Input, Source, library};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link as _, Pace, VirtualBus};
use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Frame, NodeId};
use lexican_simulation::{Files, Plant};
use lexican_toolbox::data_sheet::DataSheet;

const MACHINE: &str = "
[node.feeder]
id = 5
sheet = 'siko/ag03-1'

[node.cutter]
id = 6
sheet = 'kollmorgen/akd'

[simulate]
feeder.settings = { 1017 = 'raw:100' }
cutter.settings = { 1017 = 100 }
";

fn bench() -> Ending {
    bench_and_bus(MACHINE).0
}

fn bench_and_bus(machine: &str) -> (Ending, VirtualBus) {
    let plant = Plant::parse(machine, "machine.toml", Files::Embedded(&[])).unwrap();
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(plant.segment(bus.now()).unwrap());
    (bench_of(&bus), bus)
}

#[test]
fn nodes_are_recognised_and_read() {
    let bench = bench();
    let client = client(&bench);
    let view = bench.view();
    assert_eq!(view.nodes[0].sheet.as_deref(), Some("siko/ag03-1"));
    assert_eq!(view.nodes[1].sheet.as_deref(), Some("kollmorgen/akd"));
    let read = Request::Read { node: 5, addresses: vec!["1018".to_owned(), "6060".to_owned()] };
    let Ok(Answer::Values(values)) = client.ask(read).wait() else { panic!("values") };
    assert_eq!(values.last().unwrap().text, "profile position (1)");
    assert!(values.len() > 3, "1018h has several entries");
    let Ok(Answer::Objects(objects)) = client.ask(Request::Objects { node: 5 }).wait() else { panic!("objects") };
    let mode = objects.iter().find(|object| object.address == "6060:00").unwrap();
    assert_eq!(mode.value.as_ref().unwrap().text, "profile position (1)", "what was read is remembered");
}

#[test]
fn a_node_is_asked_for_the_data_sheet_that_it_has_in_it() {
    let own = "[1021]\nParameterName=Store EDS\nObjectType=0x2\nDataType=0x000F\nAccessType=ro\n\
        [1022]\nParameterName=Store format\nObjectType=0x7\nDataType=0x0005\nAccessType=ro\nDefaultValue=0\n";
    let sheet = format!("{own}{}", include_str!("../../../cli/tests/sensor.eds"));
    let plant =
        Plant::parse("[node.a]\nid = 7\nsheet = 'a.eds'\n", "machine.toml", Files::Embedded(&[("a.eds", &sheet)]));
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(plant.unwrap().segment(bus.now()).unwrap());
    let bench = bench_of(&bus);
    let client = bench.open_client();
    client.ask(Request::Scan).wait().unwrap();
    let view = until(&bench, |view| view.nodes.iter().any(|node| node.stores_sheet));
    assert_eq!(view.nodes[0].sheet, None);
    client.ask(Request::FetchSheet { node: 7 }).wait().unwrap();
    let node = bench.view().nodes[0].clone();
    assert_eq!((node.sheet.as_deref(), node.stores_sheet), (Some("1021h of node 7"), false));
    let Ok(Answer::Objects(objects)) = client.ask(Request::Objects { node: 7 }).wait() else { panic!("objects") };
    assert!(objects.iter().any(|object| object.name == "Store EDS"), "its objects have names");
    bench.end();
    let bench = bench_and_bus(MACHINE).0;
    let refused = bench.open_client().ask(Request::FetchSheet { node: 5 }).wait().unwrap_err();
    assert_eq!(refused.why, "node 5 has no data sheet in it: there is no 1022h");
    bench.end();
}

#[test]
fn what_the_data_sheet_refuses_is_not_sent() {
    let bench = bench();
    let client = client(&bench);
    let write =
        |text: &str| Request::Write { node: 5, address: "2410:05".to_owned(), text: text.to_owned(), force: false };
    let refused = client.ask(write("250")).wait().unwrap_err();
    assert!(refused.why.contains("too high"), "{refused:?}");
    let Ok(Answer::Values(values)) = client.ask(write("60")).wait() else { panic!("it is written") };
    assert!(values[0].text.starts_with("60"), "{values:?}");
    let changes = &bench.view().nodes[0].changes;
    assert!(changes.iter().any(|change| change.contains("2410:05")), "{changes:?}");
}

#[test]
fn only_who_has_the_hands_changes_something_and_everybody_stops() {
    let bench = bench();
    let one = client(&bench);
    let other = bench.open_client();
    let start = || Request::Nmt { node: None, command: Nmt::Start };
    assert!(other.ask(start()).wait().unwrap_err().why.contains("has control"));
    assert!(other.ask(Request::TakeControl { force: false }).wait().is_err());
    enable(&one);
    let travel = one.ask(drive(5, Verb::MoveTo, Some("100000")));
    until(&bench, moves);
    other.ask(Request::StopAll).wait().unwrap();
    assert!(travel.wait().is_ok_and(|answer| answer == Answer::Done));
    let view = until(&bench, |view| !moves(view));
    assert!(view.drives[0].ending.is_some() && view.drives[0].order.is_none());
    assert!(view.drives[0].position.unwrap() < 100_000.0);
}

#[test]
fn a_number_with_two_readings_moves_and_writes_nothing() {
    let bench = bench();
    let client = client(&bench);
    enable(&client);
    for order in [Verb::MoveTo, Verb::Step, Verb::Run] {
        let refused = client.ask(drive(5, order, Some("5.000"))).wait().unwrap_err();
        assert_eq!(refused.why, "5.000 may be 5 or 5000");
        assert_eq!(refused.remedy.as_deref(), Some("write 5 or 5000"));
    }
    assert!(!moves(&bench.view()));
    let write =
        |text: &str| Request::Write { node: 5, address: "2410:05".to_owned(), text: text.to_owned(), force: true };
    assert!(client.ask(write("1.000")).wait().unwrap_err().why.ends_with("1.000 may be 1 or 1000"));
    assert!(client.ask(write("60,5")).wait().unwrap_err().remedy.unwrap().contains("60.5"));
    assert_eq!(client.ask(Request::Number { text: "12.5".to_owned() }).wait(), Ok(Answer::Number(12.5)));
    client.ask(Request::Number { text: "12.500".to_owned() }).wait().unwrap_err();
    // The value that the card shows can be typed in.
    let shown = bench.view().drives[0].position.unwrap().to_string();
    client.ask(drive(5, Verb::MoveTo, Some(&shown))).wait().unwrap();
}

#[test]
fn a_lost_client_stops_what_it_has_started() {
    let bench = bench();
    let client = client(&bench);
    enable(&client);
    let _travel = client.ask(drive(5, Verb::MoveTo, Some("100000")));
    until(&bench, moves);
    drop(client);
    let view = until(&bench, |view| view.drives[0].order.is_none() && !moves(view));
    assert_eq!(view.control.holder, None);
    let ending = view.drives[0].ending.as_ref().unwrap();
    assert_eq!(ending.text, "interrupted: it has been stopped");
}

#[test]
fn a_backup_is_restored_and_compared() {
    let bench = bench();
    let client = client(&bench);
    let Ok(Answer::File { bytes, .. }) = client.ask(Request::Backup { node: 5 }).wait() else { panic!("a file") };
    let dcf = String::from_utf8(bytes).unwrap();
    let write = Request::Write { node: 5, address: "2410:05".to_owned(), text: "60".to_owned(), force: false };
    client.ask(write).wait().unwrap();
    let compare = || Request::Compare { node: 5, with: Other::Dcf(dcf.clone()) };
    let Ok(Answer::Differences(found)) = client.ask(compare()).wait() else { panic!("differences") };
    assert_eq!(found.iter().map(|found| &*found.address).collect::<Vec<_>>(), ["2410:05"]);
    client.ask(Request::Restore { node: 5, dcf: dcf.clone() }).wait().unwrap();
    let Ok(Answer::Differences(found)) = client.ask(compare()).wait() else { panic!("differences") };
    assert!(found.is_empty(), "{found:?}");
    assert!(bench.view().jobs.iter().all(|job| job.is_success == Some(true)));
}

#[test]
fn a_pdo_is_mapped_after_it_was_checked() {
    let bench = bench();
    let client = client(&bench);
    let map = |objects: &[&str], check| Request::MapPdo {
        node: 6,
        pdo: "tpdo1".to_owned(),
        objects: objects.iter().map(|&object| object.to_owned()).collect(),
        transmission: Some("every:20ms".to_owned()),
        check,
    };
    let too_much = ["6041", "6064", "606C"];
    let Ok(Answer::Objections(objections)) = client.ask(map(&too_much, true)).wait() else { panic!("objections") };
    assert!(!objections.is_empty(), "80 bits do not fit");
    let fits = ["6041", "6064"];
    let Ok(Answer::Objections(objections)) = client.ask(map(&fits, true)).wait() else { panic!("objections") };
    assert_eq!(objections, Vec::<String>::new());
    let Ok(Answer::Pdos(pdos)) = client.ask(map(&fits, false)).wait() else { panic!("the PDO") };
    assert_eq!(
        pdos[0].fields.iter().map(|field| (field.first_bit, field.bits)).collect::<Vec<_>>(),
        [(0, 16), (16, 32)]
    );
    client.ask(Request::Nmt { node: Some(6), command: Nmt::Start }).wait().unwrap();
    until(&bench, |view| view.bus.ids.iter().any(|rate| rate.name == "TPDO1" && rate.per_second > 30.0));
}

#[test]
fn the_trace_is_filtered_in_the_words_of_the_monitor() {
    let bench = bench();
    let client = client(&bench);
    let rows = |filter: TraceFilter| {
        let Ok(Answer::Frames(frames)) = client.ask(Request::Trace { filter, from: -20, at: None, count: 20 }).wait()
        else {
            panic!("rows")
        };
        frames.rows
    };
    let all = rows(TraceFilter::default());
    assert_eq!(all.len(), 20);
    let sdo =
        TraceFilter { nodes: "5".to_owned(), services: "sdo".to_owned(), transfers: true, ..TraceFilter::default() };
    let transfers = rows(sdo);
    assert!(!transfers.is_empty());
    assert!(transfers.iter().all(|row| row.service == "SDO transfer" && row.node == Some(5)), "{transfers:?}");
    assert!(transfers.iter().any(|row| row.text.contains("Statusword")), "{transfers:?}");
    let wrong = TraceFilter { services: "sda".to_owned(), ..TraceFilter::default() };
    assert!(client.ask(Request::Trace { filter: wrong, from: 0, at: None, count: 1 }).wait().is_err());
}

#[test]
fn values_are_watched_and_plotted() {
    let bench = bench();
    let client = client(&bench);
    let address = "6064:00".to_owned();
    client.ask(Request::Watch { node: 5, address: address.clone(), every_ms: 20 }).wait().unwrap();
    client.ask(Request::Plot { node: 5, signals: vec![address.clone()], every_ms: 20 }).wait().unwrap();
    let view = until(&bench, |view| view.watched.iter().any(|watched| watched.value.is_some()));
    assert_eq!(view.watched[0].address, address);
    loop {
        let Ok(Answer::Curves(curves)) = client.ask(Request::Curves { since: 0.0 }).wait() else { panic!("curves") };
        if curves.first().is_some_and(|curve| curve.points.len() > 3) {
            break;
        }
        yield_now();
    }
    let Ok(Answer::File { bytes, .. }) = client.ask(Request::ExportPlot { format: "csv".to_owned() }).wait() else {
        panic!("a file")
    };
    assert!(String::from_utf8(bytes).unwrap().lines().count() > 3);
    client.ask(Request::Unwatch { node: 5, address }).wait().unwrap();
    assert!(bench.view().watched.is_empty());
}

#[test]
fn watches_and_curves_end_with_the_last_client_that_wants_them_and_are_bounded() {
    let bench = bench();
    let (one, other) = (client(&bench), bench.open_client());
    let watch = |address: &str| Request::Watch { node: 5, address: address.to_owned(), every_ms: 100 };
    let plot = |signals: &[&str]| {
        let signals = signals.iter().map(|signal| (*signal).to_owned()).collect();
        Request::Plot { node: 5, signals, every_ms: 100 }
    };
    one.ask(watch("6064:00")).wait().unwrap();
    one.ask(watch("606C:00")).wait().unwrap();
    other.ask(watch("6064:00")).wait().unwrap();
    one.ask(plot(&["6064:00", "606C:00"])).wait().unwrap();
    other.ask(plot(&["606C:00"])).wait().unwrap();
    let curves = |client: &Client| {
        let Ok(Answer::Curves(curves)) = client.ask(Request::Curves { since: -1.0 }).wait() else { panic!("curves") };
        curves.into_iter().map(|curve| curve.address).collect::<Vec<_>>()
    };
    while curves(&other).len() < 2 {
        yield_now();
    }
    one.close();
    assert_eq!(bench.view().watched.iter().map(|it| &*it.address).collect::<Vec<_>>(), ["6064:00"]);
    assert_eq!(curves(&other), ["606C:00"]);
    assert!(one.ask(watch("606C:00")).wait().is_err(), "it would be read for ever");

    let many: Vec<_> = (0x2000..0x2040).map(|index| format!("{index:04X}:00")).collect();
    let refused = other.ask(plot(&many.iter().map(String::as_str).collect::<Vec<_>>())).wait().unwrap_err();
    assert!(refused.why.contains("at most 32") && refused.remedy.is_some(), "{refused:?}");
    let watched: Vec<_> = many.iter().map(|address| other.ask(watch(address)).wait().is_ok()).collect();
    assert_eq!(watched.iter().filter(|is_watched| **is_watched).count(), 63, "one more was watched before");
    drop(other);
    assert!(bench.view().watched.is_empty());
}

#[test]
fn values_that_were_seen_before_a_restore_are_read_anew_after_it() {
    let bench = bench();
    let client = client(&bench);
    let Ok(Answer::File { bytes, .. }) = client.ask(Request::Backup { node: 5 }).wait() else { panic!("a file") };
    let seen = || {
        let asked = Request::Seen { node: 5, addresses: vec!["1000:00".to_owned(), "2410:01".to_owned()] };
        let Ok(Answer::Values(seen)) = client.ask(asked).wait() else { panic!("values") };
        seen.into_iter().map(|value| value.at).collect::<Vec<_>>()
    };
    client.ask(Request::Read { node: 5, addresses: vec!["1000:00".to_owned()] }).wait().unwrap();
    let before = bench.view().time;
    client.ask(Request::Restore { node: 5, dcf: String::from_utf8(bytes).unwrap() }).wait().unwrap();
    let after = seen();
    assert!(after.len() == 2 && after.iter().all(|at| *at > before), "{after:?}, {before}");
}

#[test]
fn what_is_watched_is_read_while_its_drive_moves() {
    let bench = bench();
    let client = client(&bench);
    let address = "1001:00".to_owned();
    client.ask(Request::Watch { node: 6, address: address.clone(), every_ms: 20 }).wait().unwrap();
    client.ask(drive(6, Verb::Enable, None)).wait().unwrap();
    let running = client.ask(drive(6, Verb::Run, Some("100")));
    let runs = |view: &View| view.drives[1].velocity.is_some_and(|velocity| velocity != 0.0);
    let began = until(&bench, runs).time;
    let at = |view: &View| view.watched[0].value.as_ref().map_or(0.0, |value| value.at);
    let view = until(&bench, |view| at(view) > began + 0.5);
    assert!(runs(&view) && view.drives[1].order.is_some());
    client.ask(Request::StopAll).wait().unwrap();
    running.wait().unwrap();
}

#[test]
fn what_was_seen_costs_no_frame() {
    let bench = bench();
    let client = client(&bench);
    let addresses = || vec!["2410:01".to_owned(), "6064:00".to_owned()];
    let Ok(Answer::Values(seen)) = client.ask(Request::Seen { node: 5, addresses: addresses() }).wait() else {
        panic!("values")
    };
    assert_eq!(seen.iter().map(|value| &*value.address).collect::<Vec<_>>(), ["6064:00"], "the other was not read");
    client.ask(Request::Read { node: 5, addresses: addresses() }).wait().unwrap();
    let seen = client.ask(Request::Seen { node: 5, addresses: addresses() }).wait();
    assert!(matches!(seen, Ok(Answer::Values(seen)) if seen.len() == 2));
}

#[test]
fn a_scan_ends_with_its_client() {
    let bench = bench();
    let client = client(&bench);
    let scan = client.ask(Request::Scan);
    client.close();
    scan.wait().unwrap_err();
    let job = until(&bench, |view| view.jobs.iter().any(|job| job.is_success.is_some())).jobs.remove(0);
    assert_eq!((&*job.name, job.is_success), ("scan", Some(false)), "{}", job.text);
}

#[test]
fn a_node_id_that_a_node_has_is_not_given_by_lss() {
    let bench = bench();
    let client = client(&bench);
    for (node, why) in [(5, "a node has the node-ID 5"), (9, "no device without node-ID answers")] {
        assert_eq!(client.ask(Request::Assign { node }).wait().unwrap_err().why, why);
    }
}

#[test]
fn whether_a_drive_would_move_is_known_while_somebody_has_the_control() {
    let bench = bench();
    let client = client(&bench);
    let view = until(&bench, |view| view.drives[0].obstacles.is_some());
    assert_eq!(view.drives[0].obstacles.as_deref(), Some(&["it is not enabled".to_owned()][..]));
    client.ask(Request::ReleaseControl).wait().unwrap();
    until(&bench, |view| view.drives.iter().all(|drive| drive.obstacles.is_none()));
}

/// The AKD's 1014h is stored as "off".
#[test]
fn what_a_drive_is_set_to_that_bears_on_moving_it_is_shown_while_somebody_is_in_control() {
    let (bench, _) = bench_and_bus(&MACHINE.replace("1017 = 100 }", "1017 = 100, 1014 = 0x80000086 }"));
    let client = client(&bench);
    let lacks = |view: &View| view.nodes[1].lacks.clone();
    let view = until(&bench, |view| !lacks(view).is_empty());
    let [off] = &lacks(&view)[..] else { panic!("{:?}", lacks(&view)) };
    assert!(!off.is_needed && off.text.starts_with("1014:00 switches emergency messages off: "), "{off:?}");
    client.ask(Request::ReleaseControl).wait().unwrap();
    until(&bench, |view| lacks(view).is_empty());
}

#[test]
fn what_pdos_carry_is_known_by_the_mapping_in_the_node() {
    // The data sheet maps only the status word.
    let (bench, bus) = bench_and_bus(MACHINE);
    let mut network = Network::new(bus.link());
    let mut write = |index, sub, data: &[u8]| {
        network.write_bytes(NodeId::literal(6), Address::new(index, sub), data).unwrap();
    };
    write(0x1A00, 0, &[0]);
    write(0x1A00, 1, &[0x20, 0, 0xFD, 0x60]);
    write(0x1A00, 0, &[1]);
    write(0x1800, 5, &[20, 0]);
    // Another manager starts it. For a client with control, the driver would observe the drive, and read its mapping.
    bus.link().send(&Frame::new(CobId::NMT, &[1, 6]).unwrap()).unwrap();
    let client = bench.open_client();
    let seen = || {
        let asked = Request::Seen { node: 6, addresses: vec!["60FD:00".to_owned()] };
        let Ok(Answer::Values(seen)) = client.ask(asked).wait() else { panic!("values") };
        seen.first().map(|value| value.at)
    };
    // Nobody reads it, but it is seen again and again.
    let first = loop {
        match seen() {
            Some(at) => break at,
            None => yield_now(),
        }
    };
    while seen() == Some(first) {
        yield_now();
    }
    let filter = TraceFilter { object: "60FD".to_owned(), ..TraceFilter::default() };
    let Ok(Answer::Frames(frames)) = client.ask(Request::Trace { filter, from: 0, at: None, count: 10 }).wait() else {
        panic!("rows")
    };
    let is_mapping = |text: &str| text.starts_with("1A00:01 TPDO1 mapping");
    assert!(frames.rows.iter().all(|row| row.service == "TPDO1" || is_mapping(&row.text)), "{frames:?}");
}

/// A link that panics at its first frame.
struct Failing;

impl lexican_runtime::host::Link for Failing {
    fn now(&self) -> lexican_runtime::Instant {
        lexican_runtime::Instant::ZERO
    }
    fn send(&mut self, _: &Frame) -> Result<(), lexican_runtime::host::LinkError> {
        Ok(())
    }
    fn receive(
        &mut self,
        _: lexican_runtime::Instant,
    ) -> Result<Option<lexican_runtime::host::Incoming>, lexican_runtime::host::LinkError> {
        panic!("as an adapter's driver might")
    }
}

#[test]
fn a_bus_whose_thread_panics_is_lost_with_the_drives_on_it() {
    let info = BusInfo { name: "failing".to_owned(), is_writable: true, bit_rate: None };
    let node = NodeId::literal(5);
    let sheet = lexican_toolbox::data_sheet::DataSheet::load("siko/ag03-1", &[]).unwrap();
    let sheet = lexican_bench::sheet::Sheet::new("siko/ag03-1", sheet);
    let setup = Setup { nodes: vec![(node, None, Some(sheet))], ..Setup::new(info) };
    let bench = Bench::live(Box::new(Failing), setup).unwrap();
    let view = until(&bench, |view| !view.bus.is_writable);
    assert!(view.bus.state.contains("has failed"), "{}", view.bus.state);
    let client = bench.open_client();
    client.ask(Request::StopAll).wait().unwrap_err();
    assert!(bench.view().drives[0].ending.as_ref().unwrap().may_be_moving);
}

#[test]
fn an_order_to_a_drive_whose_data_sheet_lacks_something_says_what() {
    let eds = library::find("siko/ag03-1").unwrap().input().eds.text().replace("6040", "2FFE");
    let sheet = Sheet::new("drive.eds", DataSheet::parse(Input::new(Source::new("drive.eds", eds))));
    let bus = VirtualBus::new();
    let link = bus.link();
    bus.set_pace(Pace::RealTime);
    let mut setup = Setup::new(BusInfo { is_writable: true, ..BusInfo::default() });
    setup.nodes.push((NodeId::literal(5), None, Some(sheet)));
    let bench = Ending(Bench::live(Box::new(link), setup).unwrap());
    let client = bench.open_client();
    client.ask(Request::TakeControl { force: false }).wait().unwrap();
    let refused = client.ask(drive(5, Verb::Enable, None)).wait().unwrap_err();
    assert!(refused.why.contains("drive 5 cannot be moved by its data sheet: "), "{refused:?}");
    assert!(refused.why.contains("6040h (control word)") && refused.remedy.is_some(), "{refused:?}");
}
