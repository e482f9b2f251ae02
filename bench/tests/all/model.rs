//! Tests of the model with frames only.

use lexican_bench::model::{BusInfo, Model, Which};
use lexican_bench::sheet::Sheet;
use lexican_bench::view::View;
use lexican_eds::{Input, Source, library};
use lexican_runtime::host::BusState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::bus::filter::Filter;
use lexican_toolbox::data_sheet::DataSheet;

/// A model of a bus, with times that do not begin at zero.
struct Bus {
    model: Model,
    now: Instant,
}

impl Bus {
    fn new() -> Self {
        let now = Instant::ZERO + Duration::from_secs(1000);
        let info = BusInfo { name: "can0".to_owned(), is_writable: true, bit_rate: Some(500_000) };
        Bus { model: Model::new(now, info), now }
    }

    fn after(&mut self, ms: u64, id: u16, data: &[u8]) {
        self.now += Duration::from_millis(ms);
        self.model.observe(self.now, &Frame::new(CobId::standard(id).unwrap(), data).unwrap());
    }

    fn wait(&mut self, ms: u64) -> View {
        self.now += Duration::from_millis(ms);
        self.model.pass(self.now);
        self.model.view()
    }

    /// Makes node 5 an AG03/1.
    fn introduce_drive(&mut self) {
        let sheet = Sheet::new("siko/ag03-1", DataSheet::load("siko/ag03-1", &[]).unwrap());
        self.model.introduce(NodeId::new(5).unwrap(), sheet);
    }

    fn troubles(&mut self) -> Vec<String> {
        self.wait(0).bus.troubles.into_iter().map(|trouble| trouble.text).collect()
    }
}

#[test]
fn a_node_is_heard_fails_and_boots_anew() {
    let mut bus = Bus::new();
    bus.after(500, 0x705, &[0]);
    bus.after(100, 0x705, &[5]);
    bus.after(100, 0x085, &[0x10, 0x32, 0x04, 0, 0, 0, 0, 0]);
    bus.after(100, 0x085, &[0x00, 0x81, 0x10, 0, 0, 0, 0, 0]);
    let node = bus.wait(0).nodes.remove(0);
    assert_eq!((node.id, node.state.as_deref(), node.boots), (5, Some("OPERATIONAL"), 1));
    let faults = |node: &lexican_bench::view::Node| node.faults.iter().map(|it| it.code.clone()).collect::<Vec<_>>();
    assert_eq!(faults(&node), ["3210", "8100"]);
    assert_eq!((node.faults[0].at, node.faults[0].row), (0.7, 2), "the row that a client jumps to");
    assert!(node.changes[0].contains("PRE-OPERATIONAL at first"), "{:?}", node.changes);

    bus.after(100, 0x085, &[0, 0, 0, 0, 0, 0, 0, 0]);
    let node = bus.wait(0).nodes.remove(0);
    assert!(node.faults.is_empty(), "error reset or no error");
    assert_eq!(node.history.iter().map(|fault| &*fault.code).collect::<Vec<_>>(), ["8100", "3210"], "newest first");

    bus.after(100, 0x085, &[0x10, 0x32, 0x04, 0, 0, 0, 0, 0]);
    bus.after(100, 0x705, &[0]);
    assert!(bus.wait(0).nodes[0].faults.is_empty(), "who boots is without errors until it says otherwise");
}

#[test]
fn who_disturbs_is_said_once_and_since_when() {
    let mut bus = Bus::new();
    assert!(bus.troubles().is_empty());
    for _ in 0..5 {
        bus.after(100, 0x707, &[5]);
    }
    assert!(bus.troubles().is_empty());
    let view = bus.wait(2000);
    assert_eq!(view.nodes[0].silent_seconds, Some(2.0));
    let trouble = &view.bus.troubles[0];
    assert_eq!(trouble.node, Some(7));
    assert!(trouble.text.starts_with("node 7 is silent for 2.0 s"), "{trouble:?}");
    assert_eq!(trouble.row, Some(4), "its last sign of life");
    let since = trouble.since;
    assert_eq!(bus.wait(1000).bus.troubles[0].since, since);
    bus.after(0, 0x707, &[5]);
    let trouble = bus.wait(0).bus.troubles.remove(0);
    assert!(trouble.is_over && trouble.text.contains("was silent for 3.0 s"), "{trouble:?}");
    bus.model.acknowledge();
    assert!(bus.troubles().is_empty(), "it is back");

    bus.model.set_state(bus.now, BusState::Off);
    bus.model.miss(3);
    let troubles = bus.troubles().join("\n");
    assert!(troubles.contains("the bus is") && troubles.contains("3 frames were lost"), "{troubles}");
    assert_eq!(bus.wait(0).bus.missing_frames, 3);
}

#[test]
fn boot_loops_abort_storms_and_a_full_bus_are_troubles() {
    let mut bus = Bus::new();
    for _ in 0..4 {
        bus.after(100, 0x705, &[0]);
    }
    let troubles = bus.wait(0).bus.troubles;
    let boots = troubles.iter().find(|it| it.text.contains("node 5 has booted 3 times without a command")).unwrap();
    assert_eq!(boots.row, Some(3), "the last boot-up");
    for _ in 0..30 {
        bus.after(1, 0x606, &[0x40, 0x00, 0x20, 0, 0, 0, 0, 0]);
        bus.after(1, 0x586, &[0x80, 0x00, 0x20, 0, 0, 0, 0x02, 0x06]);
    }
    let troubles = bus.wait(0).bus.troubles;
    let refused = troubles.iter().find(|it| it.text.contains("node 6 has 30 refused SDO transfers")).unwrap();
    assert_eq!(refused.row, Some(63), "the last abort");
    // Four frames of 8 bytes in a millisecond at 500 kbit/s.
    for _ in 0..2500 {
        for _ in 0..4 {
            bus.after(0, 0x187, &[0; 8]);
        }
        bus.after(1, 0x80, &[]);
    }
    let view = bus.wait(0);
    let trouble = view.bus.troubles.iter().find(|trouble| trouble.text.starts_with("the load is")).unwrap();
    assert_eq!(trouble.node, Some(7));
    assert!(trouble.text.contains("187h") && trouble.text.contains("4000 frames"), "{trouble:?}");
    let rate = view.bus.ids.iter().find(|rate| rate.id == "187").unwrap();
    assert_eq!((rate.per_second, rate.frames), (4000.0, 10_000));
    assert!(view.bus.load_percent.unwrap() > 70.0 && view.bus.load_percent_peak.unwrap() <= 120.0);
}

#[test]
fn an_sdo_transfer_is_one_row_and_its_value_is_remembered() {
    let mut bus = Bus::new();
    // 1008h in segments.
    bus.after(1, 0x605, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    bus.after(1, 0x585, &[0x41, 0x08, 0x10, 0, 9, 0, 0, 0]);
    bus.after(1, 0x605, &[0x60, 0, 0, 0, 0, 0, 0, 0]);
    bus.after(1, 0x585, &[0x00, b'S', b'E', b'R', b'V', b'O', b' ', b'1']);
    bus.after(1, 0x705, &[5]);
    bus.after(1, 0x605, &[0x70, 0, 0, 0, 0, 0, 0, 0]);
    bus.after(1, 0x585, &[0x1B, b'2', b'3', 0, 0, 0, 0, 0]);
    assert_eq!(bus.wait(0).nodes[0].name, "SERVO 123");
    let folded = Which { key: "transfers".to_owned(), transfers: true, ..Which::default() };
    let page = bus.model.rows(&folded, None, 0, 10);
    assert_eq!(
        page.rows.iter().map(|row| (row.number, &*row.service)).collect::<Vec<_>>(),
        [(4, "heartbeat"), (6, "SDO transfer")]
    );
    assert_eq!(bus.model.rows(&Which::default(), None, 0, 10).matching, 7);

    // A transfer without an answer becomes a row once that is certain, in place of its last frame.
    bus.after(1, 0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    bus.after(1, 0x705, &[5]);
    assert_eq!(bus.model.rows(&folded, None, 0, 10).matching, 3);
    bus.wait(20_000);
    let page = bus.model.rows(&folded, None, -2, 10);
    assert_eq!(page.rows.iter().map(|row| (row.number, row.alarming)).collect::<Vec<_>>(), [(7, true), (8, false)]);
}

#[test]
fn rows_are_found_from_both_ends() {
    let mut bus = Bus::new();
    for number in 0..10_000u16 {
        bus.after(1, if number % 10 == 0 { 0x80 } else { 0x185 }, &number.to_le_bytes());
    }
    let all = bus.model.rows(&Which::default(), None, -3, 10);
    assert_eq!((all.matching, all.from, all.rows.len()), (10_000, 9997, 3));
    assert_eq!(all.rows[2].data, "0F 27");
    let syncs = Filter { services: vec!["sync".parse().unwrap()], ..Filter::default() };
    let syncs = Which { key: "sync".to_owned(), filter: syncs, ..Which::default() };
    let numbers = |frames: &lexican_bench::view::Frames| frames.rows.iter().map(|row| row.number).collect::<Vec<_>>();
    // A step filters only a part of the rows, so that the bus does not wait for long.
    let page = bus.model.rows(&syncs, None, 998, 10);
    assert!(page.matching < 500, "{}", page.matching);
    while !bus.model.search(&syncs) {}
    let page = bus.model.rows(&syncs, None, 998, 10);
    assert_eq!((page.matching, page.from, numbers(&page)), (1000, 998, vec![9980, 9990]));
    bus.after(1, 0x80, &[]);
    assert_eq!(numbers(&bus.model.rows(&syncs, None, -1, 10)), [10_000], "what is new is found, too");
    assert_eq!(numbers(&bus.model.rows(&syncs, Some(9975), 0, 2)), [9980, 9990]);
    assert_eq!(numbers(&bus.model.rows(&syncs, Some(9975), -1, 2)), [9970, 9980]);
    assert_eq!(numbers(&bus.model.rows(&Which::default(), Some(9975), -1, 2)), [9974, 9975]);
    assert_eq!(bus.model.rows(&syncs, None, i64::MIN, 1).from, 0);
    assert!(bus.model.rows(&syncs, None, i64::MAX, 1).rows.is_empty());
}

#[test]
fn values_that_are_watched_have_bounds_and_changes() {
    let mut bus = Bus::new();
    let position = lexican_runtime::object::Address::new(0x6064, 0);
    let node = lexican_runtime::NodeId::new(5).unwrap();
    let sheet = lexican_toolbox::data_sheet::DataSheet::load("siko/ag03-1", &[]).unwrap();
    bus.model.introduce(node, lexican_bench::sheet::Sheet::new("siko/ag03-1", sheet));
    assert_eq!(bus.model.watch(node, position, 100), None);
    for value in [5i32, -7, -7, 3] {
        let raw = value.to_le_bytes();
        bus.after(1, 0x605, &[0x40, 0x64, 0x60, 0, 0, 0, 0, 0]);
        bus.after(1, 0x585, &[0x43, 0x64, 0x60, 0, raw[0], raw[1], raw[2], raw[3]]);
    }
    assert_eq!(bus.model.watch(node, position, 50), Some(100), "it goes on");
    let watched = bus.wait(0).watched.remove(0);
    assert_eq!((watched.bounds, watched.changes, watched.every_ms), (Some((-7.0, 5.0)), 2, 50));
    assert_eq!(watched.value.unwrap().number, Some(3.0));
    assert_eq!(bus.model.unwatch(node, position), Some(50));
    assert!(bus.wait(0).watched.is_empty());
}

#[test]
fn pdos_are_read_once_for_each_configuration() {
    let (mut bus, node) = (Bus::new(), NodeId::literal(5));
    bus.after(100, 0x705, &[0]);
    assert!(!bus.model.lacks_pdos(bus.now, node), "without a data sheet nothing is said of them");
    let sheet = || Sheet::new("siko/ag03-1", DataSheet::load("siko/ag03-1", &[]).unwrap());
    bus.model.introduce(node, sheet());
    assert!(bus.model.lacks_pdos(bus.now, node));
    assert!(!bus.model.lacks_pdos(bus.now, node));
    bus.after(100, 0x705, &[5]);
    assert!(!bus.model.lacks_pdos(bus.now, node));
    bus.after(1000, 0x705, &[0]);
    assert!(bus.model.lacks_pdos(bus.now, node), "who boots may have lost its configuration");
    bus.model.introduce(node, sheet());
    assert!(bus.model.lacks_pdos(bus.now, node), "another data sheet has other PDOs");
}

#[test]
fn a_storm_of_boot_ups_makes_no_storm_of_reads() {
    let (mut bus, node) = (Bus::new(), NodeId::literal(5));
    bus.introduce_drive();
    let mut asked = [0, 0];
    for _ in 0..600 {
        bus.after(100, 0x705, &[0]);
        asked[0] += u32::from(bus.model.is_stranger(bus.now, node));
        asked[1] += u32::from(bus.model.lacks_pdos(bus.now, node));
    }
    assert_eq!(asked, [6, 6], "at 0, 1, 3, 7, 15 and 31 s");
}

#[test]
fn the_last_number_of_a_curve_grows_old() {
    let mut bus = Bus::new();
    bus.introduce_drive();
    let position = lexican_toolbox::trace::sampler::Signal::Object(lexican_runtime::object::Address::new(0x6064, 0));
    bus.model.plot(NodeId::literal(5), [position], 50);
    answer(&mut bus, 0, 0x6064, [0x67, 0x12, 0, 0]);
    let mut seen = |ms| {
        let now = bus.wait(ms).time;
        let seen = bus.model.curves(-1.0)[0].seen.unwrap();
        (seen.is_old, now - seen.at)
    };
    assert!(!seen(1000).0);
    let (is_old, age) = seen(1000);
    assert!(is_old && (1.99..2.01).contains(&age), "{age}");
    assert_eq!(bus.model.unplot(NodeId::literal(5), position), Some(50));
    assert!(bus.model.curves(-1.0).is_empty());
}

/// An answer of a drive to an upload.
fn answer(bus: &mut Bus, ms: u64, index: u16, data: [u8; 4]) {
    let [low, high] = index.to_le_bytes();
    bus.after(ms, 0x605, &[0x40, low, high, 0, 0, 0, 0, 0]);
    bus.after(1, 0x585, &[&[0x43, low, high, 0][..], &data].concat());
}

#[test]
fn a_drive_without_power_is_not_shown_as_it_was() {
    let mut bus = Bus::new();
    bus.introduce_drive();
    let beat = |bus: &mut Bus| {
        bus.after(100, 0x705, &[5]);
        answer(bus, 0, 0x6041, [0x37, 0x02, 0, 0]);
        answer(bus, 0, 0x6064, [0x67, 0x12, 0, 0]);
        bus.wait(0)
    };
    for _ in 0..20 {
        let view = beat(&mut bus);
        let (drive, node) = (&view.drives[0], &view.nodes[0]);
        assert_eq!(drive.state.as_deref(), Some("OPERATION ENABLED"));
        assert!(!drive.seen.unwrap().is_old && !node.seen.unwrap().is_old, "{:?}", drive.seen);
    }
    let view = bus.wait(6000);
    let seen = view.drives[0].seen.unwrap();
    assert!(seen.is_old && (5.9..6.1).contains(&(view.time - seen.at)), "{seen:?}");
    assert!(view.nodes[0].seen.unwrap().is_old, "its state of network management, too");
    // One quantity that is no longer received is enough.
    bus.after(0, 0x705, &[5]);
    answer(&mut bus, 0, 0x6041, [0x37, 0x02, 0, 0]);
    assert!(bus.wait(0).drives[0].seen.unwrap().is_old, "where it is now is unknown");
    let drive = beat(&mut bus).drives.remove(0);
    assert!(!drive.seen.unwrap().is_old);
}

#[test]
fn behind_a_latency_values_grow_old_so_much_later() {
    let mut bus = Bus::new();
    bus.introduce_drive();
    bus.model.set_latency(lexican_runtime::Duration::from_secs(5));
    let (node, position) = (NodeId::literal(5), lexican_runtime::object::Address::new(0x6064, 0));
    bus.model.watch(node, position, 250);
    bus.model.plot(node, [lexican_toolbox::trace::sampler::Signal::Object(position)], 250);
    answer(&mut bus, 0, 0x6041, [0x37, 0x02, 0, 0]);
    answer(&mut bus, 0, 0x6064, [0x67, 0x12, 0, 0]);
    for (ms, is_old) in [(11_000, false), (1000, true)] {
        let view = bus.wait(ms);
        let curve = bus.model.curves(-1.0)[0].seen;
        for seen in [view.drives[0].seen, view.watched[0].seen, curve] {
            assert_eq!(seen.unwrap().is_old, is_old, "{seen:?}");
        }
    }
}

#[test]
fn what_is_watched_grows_old_by_how_often_it_is_read() {
    let mut bus = Bus::new();
    bus.introduce_drive();
    let node = NodeId::new(5).unwrap();
    bus.model.watch(node, lexican_runtime::object::Address::new(0x6064, 0), 5000);
    answer(&mut bus, 0, 0x6064, [0x67, 0x12, 0, 0]);
    assert!(!bus.wait(9000).watched[0].seen.unwrap().is_old, "one reading has failed");
    assert!(bus.wait(2100).watched[0].seen.unwrap().is_old);
    bus.model.watch(node, lexican_runtime::object::Address::new(0x6064, 0), 100);
    answer(&mut bus, 0, 0x6064, [0x67, 0x12, 0, 0]);
    assert!(bus.wait(1300).watched[0].seen.unwrap().is_old);
}

#[test]
fn what_the_bench_sends_itself_is_no_trouble_of_the_bus() {
    let mut bus = Bus::new();
    let own = |bus: &mut Bus, ms, id, data: &[u8]| {
        bus.now += Duration::from_millis(ms);
        bus.model.observe_own(bus.now, &Frame::new(CobId::standard(id).unwrap(), data).unwrap());
    };
    for _ in 0..30 {
        own(&mut bus, 100, 0x77F, &[5]);
        own(&mut bus, 0, 0x605, &[0x40, 0xFF, 0x2F, 0, 0, 0, 0, 0]);
        bus.after(1, 0x585, &[0x80, 0xFF, 0x2F, 0, 0, 0, 0x02, 0x06]);
    }
    let view = bus.wait(60_000);
    assert_eq!(view.bus.troubles, []);
    assert_eq!(view.nodes.iter().map(|node| (node.id, node.aborts)).collect::<Vec<_>>(), [(5, 0)]);
    // The requests of another manager do not count.
    for _ in 0..30 {
        bus.after(1, 0x605, &[0x40, 0xFF, 0x2F, 0, 0, 0, 0, 0]);
        bus.after(1, 0x585, &[0x80, 0xFF, 0x2F, 0, 0, 0, 0x02, 0x06]);
    }
    assert!(bus.troubles()[0].contains("30 refused SDO transfers"));
}

#[test]
fn a_silence_and_a_power_cut_that_are_over_stay_until_they_are_acknowledged() {
    let mut bus = Bus::new();
    let beats = |bus: &mut Bus, count| (0..count).for_each(|_| bus.after(20, 0x705, &[5]));
    bus.after(0, 0x705, &[0]);
    // The first heartbeat comes right after the boot-up message.
    bus.after(1, 0x705, &[0x7F]);
    beats(&mut bus, 10);
    assert_eq!(bus.troubles(), [""; 0]);
    // No view is taken during the silence.
    bus.after(200, 0x705, &[5]);
    beats(&mut bus, 10);
    assert_eq!(bus.troubles(), ["node 5 was silent for 0.2 s, and is heard again"]);
    bus.after(2000, 0x705, &[0]);
    beats(&mut bus, 10);
    let view = bus.wait(0);
    let are_over = view.bus.troubles.iter().all(|it| it.is_over && it.row.is_some());
    assert!(are_over, "{:?}", view.bus.troubles);
    assert!(bus.troubles()[1].contains("its power was cut"), "{:?}", bus.troubles());
    bus.model.acknowledge();
    assert_eq!(bus.troubles(), [""; 0]);
    // An ordered reset is no event.
    bus.after(10, 0x000, &[0x81, 5]);
    bus.after(1000, 0x705, &[0]);
    assert_eq!(bus.troubles(), [""; 0]);
}

/// The AG03/1 by a data sheet that lacks an object.
fn sheet_without(index: &str) -> Sheet {
    let eds = library::find("siko/ag03-1").unwrap().input().eds.text().replace(index, "2FFE");
    Sheet::new("drive.eds", DataSheet::parse(Input::new(Source::new("drive.eds", eds))))
}

#[test]
fn what_a_data_sheet_lacks_for_moving_its_drive_is_shown_with_its_node() {
    let mut bus = Bus::new();
    let mut lacks = |sheet| {
        bus.model.introduce(NodeId::new(5).unwrap(), sheet);
        bus.wait(0).nodes.remove(0).lacks
    };
    let control_word = lacks(sheet_without("6040"));
    assert!(control_word[0].is_needed && control_word[0].text.contains("6040h (control word)"), "{control_word:?}");
    let velocity = lacks(sheet_without("606C"));
    let text = "there is no 606Ch (actual velocity) that a driver can use: the driver sees by 6064h";
    assert!(velocity.iter().any(|lack| !lack.is_needed && lack.text.starts_with(text)), "{velocity:?}");
    assert!(velocity.iter().all(|lack| !lack.is_needed), "{velocity:?}");
    // The driver knows more about this drive than its data sheet says.
    assert_eq!(lacks(Sheet::new("", DataSheet::load("siko/ag03-1", &[]).unwrap())), []);
    let io = "[DeviceInfo]\n[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n[1000]\nParameterName=Device type\n\
        DataType=7\nAccessType=ro\nDefaultValue=0x30191\n";
    assert_eq!(lacks(Sheet::new("io.eds", DataSheet::parse(Input::new(Source::new("io.eds", io))))), [], "no drive");
}
