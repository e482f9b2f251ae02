//! The terminal: the screen of each tab (`tests/tui/`, written by `LEXICAN_BLESS=1`), and the requests that keys send.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use lexican_bench::request::{Nmt, Verb};
use lexican_bench::tui::{Action, Language, Purpose, Screen};
use lexican_bench::view::{
    Bus, Control, Curve, Drive, Ending, Fault, Frames, Input, Job, Lack, Log, Node, Object, Pdo, PdoField, Rate, Row,
    Seen, Simulated, Trouble, Unconfirmed, Value, View, Watched,
};
use lexican_bench::{Answer, Refused, Request};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};

/// A plant with a drive in fault.
fn view() -> View {
    let fault = |at, code: &str, text: &str, row| Fault { at, code: code.to_owned(), text: text.to_owned(), row };
    let feeder = Node {
        id: 5,
        name: "feeder".to_owned(),
        sheet: Some("siko/ag03-1".to_owned()),
        identity: [Some(0x195), Some(0), Some(0x10000), Some(42)],
        state: Some("OPERATIONAL".to_owned()),
        heartbeat_ms: Some(100.02),
        faults: vec![fault(12.5, "7121", "motor blocked", 812)],
        history: vec![fault(12.5, "7121", "motor blocked", 812), fault(3.25, "3220", "DC link under-voltage", 77)],
        sdo_ms: Some(1.2),
        changes: vec!["state: PRE-OPERATIONAL at first, now OPERATIONAL".to_owned()],
        lacks: vec![Lack { is_needed: true, text: "there is no 6060h (mode of operation)".into() }],
        ..Node::default()
    };
    let io = Node {
        id: 7,
        name: "io".to_owned(),
        state: Some("PRE-OPERATIONAL".to_owned()),
        silent_seconds: Some(2.3),
        ..Node::default()
    };
    let drive = Drive {
        node: 5,
        name: "feeder".to_owned(),
        state: Some("FAULT".to_owned()),
        allowed: vec!["SWITCH ON DISABLED".to_owned()],
        mode: Some("profile position (1)".to_owned()),
        position: Some(4711.0),
        velocity: Some(0.0),
        velocity_unit: Some("rpm".to_owned()),
        target: Some(9000.0),
        obstacles: Some(vec!["it is in fault: 7121h: motor blocked".to_owned()]),
        ending: Some(Ending {
            is_success: false,
            may_be_moving: false,
            text: "a fault has stopped it: motor blocked".to_owned(),
            remedy: Some("remove its cause, then reset the fault".to_owned()),
        }),
        orders: vec![Verb::Enable, Verb::MoveTo],
        ..Drive::default()
    };
    View {
        time: 14.0,
        bus: Bus {
            name: "demo".to_owned(),
            is_writable: true,
            bit_rate: Some(500_000),
            state: "error active".to_owned(),
            frames: 4211,
            frames_per_second: 310,
            load_percent: Some(7.2),
            load_percent_peak: Some(21.0),
            missing_frames: 0,
            ids: vec![
                Rate {
                    id: "185".to_owned(),
                    name: "TPDO1".to_owned(),
                    node: Some(5),
                    frames: 700,
                    per_second: 50.0,
                    jitter_ms: Some(0.12),
                    share_percent: 31.0,
                },
                Rate {
                    id: "705".to_owned(),
                    name: "heartbeat".to_owned(),
                    node: Some(5),
                    frames: 140,
                    per_second: 10.0,
                    jitter_ms: None,
                    share_percent: 4.0,
                },
            ],
            troubles: vec![Trouble {
                since: 11.7,
                node: Some(7),
                text: "node 7 is silent for 2.3 s".to_owned(),
                row: None,
                is_over: false,
            }],
        },
        nodes: vec![feeder, io],
        drives: vec![drive],
        devices: vec![Simulated {
            node: 5,
            name: "feeder".to_owned(),
            is_on: true,
            inputs: vec![Input {
                name: "shaft".to_owned(),
                help: "something holds the shaft".to_owned(),
                choices: vec!["free".to_owned(), "blocked".to_owned()],
                value: Some("blocked".to_owned()),
            }],
        }],
        jobs: vec![Job {
            number: 1,
            name: "backup of node 5".to_owned(),
            done: Some(0.4),
            text: "6081:00 Profile velocity".to_owned(),
            is_success: None,
        }],
        watched: vec![Watched {
            node: 5,
            address: "6064:00".to_owned(),
            name: "Position Actual Value".to_owned(),
            every_ms: 250,
            value: Some(value("6064:00", "4711")),
            seen: None,
            bounds: Some((0.0, 4711.0)),
            changes: 12,
        }],
        control: Control { holder: Some(1), clients: 2 },
        ..View::default()
    }
}

fn value(address: &str, text: &str) -> Value {
    let raw = "67 12 00 00".to_owned();
    Value {
        address: address.to_owned(),
        text: text.to_owned(),
        number: text.parse().ok(),
        raw,
        at: 13.9,
        is_error: false,
    }
}

fn objects() -> Vec<Object> {
    let object = |address: &str, name: &str, default: &str, value: Option<Value>| Object {
        address: address.to_owned(),
        object: name.to_owned(),
        name: name.to_owned(),
        group: "Drive".to_owned(),
        data_type: "UNSIGNED32".to_owned(),
        bits: Some(32),
        access: "rw".to_owned(),
        mappable: None,
        default: Some(default.to_owned()),
        low: Some("0".to_owned()),
        high: Some("200 rpm".to_owned()),
        choices: Vec::new(),
        unit: None,
        help: Some("How fast it travels at most.".to_owned()),
        value,
    };
    vec![
        object("6064:00", "Position Actual Value", "0", Some(value("6064:00", "4711"))),
        object("6081:00", "Profile Velocity", "100 rpm", None),
    ]
}

/// A screen that has received all answers to its requests.
fn screen(language: Language) -> Screen {
    let mut screen = Screen::new(1, language);
    screen.take(Purpose::Objects(5), Ok(Answer::Objects(objects())));
    let pdo = Pdo {
        name: "TPDO1".to_owned(),
        id: "185".to_owned(),
        is_on: true,
        transmission: "at events of the profile (255)".to_owned(),
        event_timer_ms: Some(20),
        inhibit_ms: None,
        fields: vec![
            PdoField {
                address: "6041:00".to_owned(),
                name: "Statusword".to_owned(),
                first_bit: 0,
                bits: 16,
                text: Some("FAULT".to_owned()),
                at: None,
            },
            PdoField {
                address: "6064:00".to_owned(),
                name: "Position Actual Value".to_owned(),
                first_bit: 16,
                bits: 32,
                text: Some("4711".to_owned()),
                at: None,
            },
        ],
        per_second: 50.0,
        conflict: None,
        mappable: Vec::new(),
    };
    screen.take(Purpose::Pdos(5), Ok(Answer::Pdos(vec![pdo])));
    let row = |number, id: &str, text: &str, alarming| Row {
        number,
        time: 12.0 + number as f64 / 1e3,
        id: id.to_owned(),
        data: "21 71 01 00 00 00 00 00".to_owned(),
        node: Some(5),
        service: if alarming { "EMCY" } else { "TPDO1" }.to_owned(),
        text: text.to_owned(),
        alarming,
    };
    let rows =
        vec![row(811, "185", "Statusword = OPERATION ENABLED", false), row(812, "085", "7121h: motor blocked", true)];
    screen.take(Purpose::Trace, Ok(Answer::Frames(Frames { matching: 4211, from: 4209, rows })));
    let points = (0..100).map(|at| (f64::from(at) * 0.14, f64::from(at * at))).collect();
    let (address, name) = ("6064:00".to_owned(), "Position Actual Value".to_owned());
    let curve = Curve { node: 5, address, name, unit: None, seen: None, points };
    screen.take(Purpose::Plots, Ok(Answer::Curves(vec![curve])));
    screen
}

fn key(character: char) -> KeyEvent {
    KeyEvent::new(KeyCode::Char(character), KeyModifiers::NONE)
}

fn press(screen: &mut Screen, view: &View, keys: &str) -> Option<Action> {
    let mut last = None;
    for character in keys.chars() {
        let code = if character == '\n' { KeyCode::Enter } else { KeyCode::Char(character) };
        last = screen.handle_key(KeyEvent::new(code, KeyModifiers::NONE), view);
    }
    last
}

fn drawn(screen: &mut Screen, view: &View, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| screen.draw(frame, view)).unwrap();
    let buffer = terminal.backend().buffer();
    let mut text = String::new();
    for y in 0..height {
        let line: String = (0..width).map(|x| buffer[(x, y)].symbol()).collect();
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

#[test]
fn golden_tabs_are_shown_in_both_languages_and_two_sizes() {
    let (folder, view) = (Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tui"), view());
    let bless = std::env::var_os("LEXICAN_BLESS").is_some();
    for (name, language) in [("en", Language::English), ("de", Language::German)] {
        for (width, height) in [(80, 24), (140, 40)] {
            let mut screen = screen(language);
            let mut text = String::new();
            for tab in '1'..='8' {
                screen.handle_key(key(tab), &view);
                text += &drawn(&mut screen, &view, width, height);
            }
            screen.handle_key(key('?'), &view);
            text += &drawn(&mut screen, &view, width, height);
            let path = folder.join(format!("{name}-{width}.txt"));
            if bless {
                fs::write(&path, &text).unwrap();
            }
            let known = fs::read_to_string(&path).unwrap_or_default();
            assert!(
                known == text,
                "{} is out of date: LEXICAN_BLESS=1 cargo test -p lexican-bench --test all tui",
                path.display()
            );
        }
    }
}

#[test]
fn space_stops_everything_in_every_tab() {
    let view = view();
    for tab in '1'..='8' {
        let mut screen = screen(Language::English);
        screen.handle_key(key(tab), &view);
        assert_eq!(screen.handle_key(key(' '), &view), stop());
        screen.handle_key(key('?'), &view);
        assert_eq!(screen.handle_key(key(' '), &view), stop(), "under the help, too");
    }
}

fn stop() -> Option<Action> {
    Some(Action::Ask(Purpose::Stop, Request::StopAll))
}

#[test]
fn while_something_is_typed_another_key_stops_and_is_named() {
    let (view, mut screen) = (view(), screen(Language::English));
    assert_eq!(press(&mut screen, &view, "6m90 "), None);
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains("F12 = STOP ALL") && !text.contains("SPACE = STOP ALL"), "{text}");
    assert_eq!(screen.handle_key(KeyEvent::new(KeyCode::F(12), KeyModifiers::NONE), &view), stop());
    assert_eq!(press(&mut screen, &view, "q"), Some(Action::Leave), "nothing is typed any more");
    screen.take(Purpose::Stop, Err(Refused::new("node 5 does not answer")));
    assert!(drawn(&mut screen, &view, 80, 24).contains("NOT STOPPED: node 5 does not answer"));
}

#[test]
fn an_order_goes_to_the_drive_it_was_asked_for() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "6m90");
    assert!(drawn(&mut screen, &view, 80, 24).contains("5 feeder: to which position: 90"));
    // Meanwhile another drive is found, and takes the row.
    view.drives.insert(0, Drive { node: 3, ..Drive::default() });
    view.nodes.insert(0, Node { id: 3, ..Node::default() });
    let travel = Request::Drive { node: 5, order: Verb::MoveTo, value: Some("90".to_owned()) };
    assert_eq!(press(&mut screen, &view, "\n"), Some(Action::Ask(Purpose::Say, travel)));
}

#[test]
fn what_is_selected_stays_selected_when_others_are_found() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    drawn(&mut screen, &view, 80, 24);
    view.nodes.insert(0, Node { id: 3, ..Node::default() });
    view.drives.insert(0, Drive { node: 3, ..Drive::default() });
    let down = KeyEvent::new(KeyCode::Down, KeyModifiers::NONE);
    let nmt = |node| Some(Action::Ask(Purpose::Say, Request::Nmt { node: Some(node), command: Nmt::Start }));
    let enable = |node| {
        let command = Request::Drive { node, order: Verb::Enable, value: None };
        Some(Action::Ask(Purpose::Say, command))
    };
    assert_eq!(press(&mut screen, &view, "o"), nmt(5));
    screen.handle_key(down, &view);
    assert_eq!(press(&mut screen, &view, "o"), nmt(7));
    assert_eq!(press(&mut screen, &view, "6e"), enable(5));
    screen.handle_key(KeyEvent::new(KeyCode::Up, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "e"), enable(3));
}

#[test]
fn entries_of_another_node_are_not_shown_and_not_written() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "2]");
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains("no data sheet") && !text.contains("200 rpm"), "{text}");
    assert_eq!(press(&mut screen, &view, "\n1\n"), None);
}

#[test]
fn keys_with_control_or_alt_give_no_order() {
    let (view, mut screen) = (view(), screen(Language::English));
    screen.handle_key(key('6'), &view);
    for modifier in [KeyModifiers::CONTROL, KeyModifiers::ALT] {
        assert_eq!(screen.handle_key(KeyEvent::new(KeyCode::Char('e'), modifier), &view), None);
    }
    // Backspace, as sent by some terminals.
    press(&mut screen, &view, "m95");
    screen.handle_key(KeyEvent::new(KeyCode::Char('h'), KeyModifiers::CONTROL), &view);
    assert!(drawn(&mut screen, &view, 80, 24).contains("to which position: 9▏"));
}

#[test]
fn a_file_that_is_there_is_kept_and_one_that_is_not_is_not_restored() {
    let (view, mut screen) = (view(), screen(Language::English));
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kept.log");
    fs::write(&path, "recorded").unwrap();
    let file = Answer::File { name: "bus.log".to_owned(), bytes: Vec::new() };
    screen.take(Purpose::File(path.display().to_string()), Ok(file));
    assert_eq!(fs::read_to_string(path).unwrap(), "recorded");
    assert_eq!(press(&mut screen, &view, "2uno such file.dcf\n"), None);
    assert!(drawn(&mut screen, &view, 140, 40).contains("no such file.dcf: "));
}

#[test]
fn orders_take_their_values_from_the_last_line() {
    let (view, mut screen) = (view(), screen(Language::English));
    let order = |order, value: Option<&str>| {
        let command = Request::Drive { node: 5, order, value: value.map(str::to_owned) };
        Some(Action::Ask(Purpose::Say, command))
    };
    assert_eq!(press(&mut screen, &view, "6e"), order(Verb::Enable, None));
    assert_eq!(press(&mut screen, &view, "m90 deg\n"), order(Verb::MoveTo, Some("90 deg")));
    // A prompt that is left sends nothing, and letters in it are no keys.
    assert_eq!(press(&mut screen, &view, "mq"), None);
    screen.handle_key(KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "q"), Some(Action::Leave));
}

#[test]
fn hands_are_taken_and_given_back() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    assert_eq!(press(&mut screen, &view, "h"), Some(Action::Ask(Purpose::Say, Request::ReleaseControl)));
    view.control.holder = None;
    let take = |force| Some(Action::Ask(Purpose::Say, Request::TakeControl { force }));
    assert_eq!(press(&mut screen, &view, "h"), take(false));
    assert_eq!(press(&mut screen, &view, "H"), take(true));
}

#[test]
fn a_node_is_commanded_and_its_objects_are_searched_and_written() {
    let (view, mut screen) = (view(), screen(Language::English));
    let start = Request::Nmt { node: Some(7), command: Nmt::Start };
    screen.handle_key(KeyEvent::new(KeyCode::Down, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "o"), Some(Action::Ask(Purpose::Say, start)));
    assert_eq!(screen.wants(&view), None);
    press(&mut screen, &view, "[2/velocity\n");
    assert_eq!(screen.wants(&view), Some((Purpose::Objects(5), Request::Objects { node: 5 })));
    let write = Request::Write { node: 5, address: "6081:00".to_owned(), text: "60 rpm".to_owned(), force: false };
    assert_eq!(press(&mut screen, &view, "\n60 rpm\n"), Some(Action::Ask(Purpose::Say, write)));
    let refused = Refused::new("6081:00 Profile Velocity: 999 rpm is too high: the data sheet allows 0 to 200 rpm");
    screen.take(Purpose::Say, Err(refused));
    assert!(drawn(&mut screen, &view, 140, 40).contains("too high: the data sheet allows 0 to 200 rpm"));
}

#[test]
fn a_mapping_is_made_checked_and_written() {
    let (view, mut screen) = (view(), screen(Language::English));
    let map = |objects: &[&str], check| {
        let objects = objects.iter().map(|&object| object.to_owned()).collect();
        let transmission = Some("every:10ms".to_owned());
        Some(Action::Ask(
            Purpose::Mapped(5),
            Request::MapPdo { node: 5, pdo: "TPDO1".to_owned(), objects, transmission, check },
        ))
    };
    assert_eq!(press(&mut screen, &view, "3a606C\ntevery:10ms\nc"), map(&["6041:00", "6064:00", "606C"], true));
    screen.take(Purpose::Mapped(5), Ok(Answer::Objections(vec!["80 bits are mapped".to_owned()])));
    assert!(drawn(&mut screen, &view, 140, 40).contains("80 bits are mapped"));
    screen.handle_key(KeyEvent::new(KeyCode::Delete, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "\n"), map(&["6041:00", "6064:00"], false));
}

#[test]
fn a_fault_leads_to_its_row_and_the_trace_is_filtered() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "g");
    assert_eq!(screen.wants(&view).unwrap().0, Purpose::Trace);
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains(" 811 ") && text.contains("▸! 812 "), "with what was before it, and marked:\n{text}");
    press(&mut screen, &view, "ssdo,emcy\nt!");
    let Some((_, Request::Trace { filter, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert_eq!((&*filter.services, filter.transfers, filter.alarming), ("sdo,emcy", true, true));
    let end = KeyEvent::new(KeyCode::End, KeyModifiers::NONE);
    screen.handle_key(end, &view);
    let Some((_, Request::Trace { from, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert!(from < 0, "it follows again");
}

#[test]
fn a_log_is_played_and_sought() {
    let mut view = view();
    view.log = Some(Log { seconds: 100.0, position: 50.0, speed: 0.0 });
    let mut screen = screen(Language::English);
    assert_eq!(press(&mut screen, &view, "l"), Some(Action::Ask(Purpose::Say, Request::Play { speed: 1.0 })));
    let right = screen.handle_key(KeyEvent::new(KeyCode::Right, KeyModifiers::NONE), &view);
    assert_eq!(right, Some(Action::Ask(Purpose::Say, Request::Seek { seconds: 52.0 })));
}

#[test]
fn an_input_of_a_simulated_device_is_set() {
    let (view, mut screen) = (view(), screen(Language::English));
    let set = Request::Input { node: 5, text: "shaft = free".to_owned() };
    screen.handle_key(key('8'), &view);
    screen.handle_key(KeyEvent::new(KeyCode::Down, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "\nfree\n"), Some(Action::Ask(Purpose::Say, set)));
    let off = Request::Power { node: 5, on: false };
    assert_eq!(press(&mut screen, &view, "p"), Some(Action::Ask(Purpose::Say, off)));
}

/// A bus whose trace keeps the rows from `first` on; every third row is an EMCY.
struct Recorded {
    first: u64,
    end: u64,
}

impl Recorded {
    /// Answers the requests of the screen.
    fn answer(&self, screen: &mut Screen, view: &mut View) {
        view.trace = lexican_bench::view::Trace { first: self.first, end: self.end };
        let Some((Purpose::Trace, Request::Trace { filter, from, at, count })) = screen.wants(view) else {
            panic!("the trace")
        };
        let matching: Vec<u64> =
            (self.first..self.end).filter(|number| filter.services.is_empty() || number % 3 == 0).collect();
        let base = at.map_or(matching.len(), |at| matching.partition_point(|number| *number < at));
        let from = base.saturating_add_signed(from as isize);
        let rows = matching.iter().skip(from).take(count as usize).map(|&number| Row {
            number,
            time: number as f64 / 1e3,
            id: "085".to_owned(),
            data: String::new(),
            node: Some(5),
            service: "EMCY".to_owned(),
            text: String::new(),
            alarming: false,
        });
        let frames = Frames { matching: matching.len() as u64, from: from as u64, rows: rows.collect() };
        screen.take(Purpose::Trace, Ok(Answer::Frames(frames)));
    }

    /// The number of the first row on the screen.
    fn top(&self, screen: &mut Screen, view: &mut View) -> u64 {
        self.answer(screen, view);
        let text = drawn(screen, view, 80, 24);
        text.lines().nth(4).unwrap().split_whitespace().next().unwrap().parse().unwrap()
    }
}

#[test]
fn a_trace_that_is_held_stays_when_old_rows_are_forgotten() {
    for (filter, step) in [("", 1), ("semcy\n", 3)] {
        let (mut view, mut screen) = (view(), Screen::new(1, Language::English));
        press(&mut screen, &view, "4");
        press(&mut screen, &view, filter);
        let mut bus = Recorded { first: 0, end: 30_000 };
        let following = bus.top(&mut screen, &mut view);
        press(&mut screen, &view, "f");
        let held = bus.top(&mut screen, &mut view);
        assert_eq!(held, following, "what was in sight is held");
        for key in [KeyCode::PageUp, KeyCode::Up] {
            screen.handle_key(KeyEvent::new(key, KeyModifiers::NONE), &view);
        }
        let above = bus.top(&mut screen, &mut view);
        assert!(above < held - 10 * step, "{above} is above {held}");
        for forgotten in [4096, 8192, 24_576] {
            bus = Recorded { first: forgotten, end: 30_000 + forgotten };
            assert_eq!(bus.top(&mut screen, &mut view), above, "after {forgotten} rows were forgotten, {filter:?}");
        }
        bus = Recorded { first: 60_000, end: 90_000 };
        assert_eq!(bus.top(&mut screen, &mut view), 60_000, "the oldest one when it is forgotten itself");
        bus = Recorded { first: 0, end: 600 };
        let newest = bus.top(&mut screen, &mut view);
        assert!((500..600).contains(&newest), "a log has gone back: {newest}");
        press(&mut screen, &view, "f");
        bus = Recorded { first: 60_000, end: 90_000 };
        assert!(bus.top(&mut screen, &mut view) > 89_000, "it follows again");
    }
}

#[test]
fn a_trouble_leads_to_its_row_and_the_row_is_marked() {
    let (mut view, mut screen) = (view(), Screen::new(1, Language::English));
    let text = "there may be two nodes 5".to_owned();
    view.bus.troubles.push(Trouble { since: 3.0, node: Some(5), text, row: Some(9000), is_over: false });
    press(&mut screen, &view, "7\n");
    assert!(drawn(&mut screen, &view, 80, 24).contains("[7 Bus]"), "this one names no row");
    screen.handle_key(KeyEvent::new(KeyCode::Down, KeyModifiers::NONE), &view);
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.lines().any(|line| line.starts_with("▸!") && line.contains("two nodes 5  (#9000)")), "{text}");
    press(&mut screen, &view, "\n");
    assert_eq!(Recorded { first: 8000, end: 20_000 }.top(&mut screen, &mut view), 8995);
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.lines().any(|line| line.starts_with('▸') && line.contains(" 9000 ")), "{text}");
    Recorded { first: 9001, end: 20_000 }.answer(&mut screen, &mut view);
    assert!(drawn(&mut screen, &view, 80, 24).contains("! #9000 is no longer kept"));
}

#[test]
fn the_end_of_a_job_stays_until_somebody_has_seen_it() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    let job = |number, is_success| Job {
        number,
        name: format!("backup of node {number}"),
        done: Some(1.0),
        text: "it does not answer".to_owned(),
        is_success,
    };
    view.jobs = vec![job(1, Some(false)), job(2, Some(true)), job(3, None)];
    let failed = "!backup of node 1 HAS FAILED: it does not answer";
    screen.take(Purpose::Say, Ok(Answer::Done));
    press(&mut screen, &view, "23");
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains(failed) && text.contains("100 % backup of node 3"), "{text}");
    assert!(!text.contains("backup of node 2"), "a success makes way for what came after it:\n{text}");
    view.jobs[2].is_success = Some(true);
    assert!(drawn(&mut screen, &view, 80, 24).contains("backup of node 3 has ended"));
    // It is visible below a prompt, too, and leaving a prompt does not dismiss it.
    press(&mut screen, &view, "6m9");
    assert!(drawn(&mut screen, &view, 80, 24).contains(failed));
    let escape = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
    screen.handle_key(escape, &view);
    assert!(drawn(&mut screen, &view, 80, 24).contains(failed));
    // The latest message is shown first.
    screen.handle_key(escape, &view);
    assert!(drawn(&mut screen, &view, 80, 24).contains(failed));
    screen.handle_key(escape, &view);
    assert!(!drawn(&mut screen, &view, 80, 24).contains("backup of node"));
    // Dismissing the end of one job does not dismiss that of the next.
    view.jobs.push(job(4, Some(false)));
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains("backup of node 4 HAS FAILED") && !text.contains("backup of node 1"), "{text}");
}

#[test]
fn no_later_answer_takes_the_place_of_a_stop_that_has_failed() {
    let view = view();
    for purpose in [Purpose::Stop, Purpose::StopDrive] {
        let mut screen = screen(Language::English);
        screen.take(purpose, Err(Refused::new("node 5 does not answer")));
        screen.take(Purpose::Say, Ok(Answer::Done));
        screen.take(Purpose::StopDrive, Ok(Answer::Done));
        screen.take(Purpose::Say, Err(Refused::new("take control first")));
        press(&mut screen, &view, "2/x");
        let text = drawn(&mut screen, &view, 80, 24);
        assert!(text.contains("!! NOT STOPPED: node 5 does not answer"), "{text}");
        // Nor does a stop in progress.
        screen.handle_key(KeyEvent::new(KeyCode::F(12), KeyModifiers::NONE), &view);
        assert!(drawn(&mut screen, &view, 80, 24).contains("NOT STOPPED"));
        screen.take(Purpose::Stop, Ok(Answer::Done));
        let text = drawn(&mut screen, &view, 80, 24);
        assert!(text.contains("every drive has stopped") && !text.contains("NOT STOPPED"), "{text}");
        screen.take(Purpose::Stop, Err(Refused::new("node 5 does not answer")));
        screen.take(Purpose::Say, Ok(Answer::Done));
        for is_shown in [true, false] {
            screen.handle_key(KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE), &view);
            assert_eq!(drawn(&mut screen, &view, 80, 24).contains("NOT STOPPED"), is_shown);
        }
    }
    let stop = |order| Some(Action::Ask(Purpose::StopDrive, Request::Drive { node: 5, order, value: None }));
    let mut screen = screen(Language::English);
    assert_eq!(press(&mut screen, &view, "6k"), stop(Verb::Stop));
    assert_eq!(press(&mut screen, &view, "K"), stop(Verb::QuickStop));
}

#[test]
fn a_drive_that_is_gone_is_shown_with_its_age_and_a_stop_that_is_not_confirmed_in_every_tab() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    view.drives[0].seen = Some(Seen { at: 13.0, is_old: false });
    screen.handle_key(key('6'), &view);
    assert!(!drawn(&mut screen, &view, 80, 24).contains("last seen"));
    view.drives[0].seen = Some(Seen { at: 10.8, is_old: true });
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains("last seen before 3.2 s") && text.contains("(-3.2 s)"), "{text}");
    view.drives[0].unconfirmed = Some(Unconfirmed { since: 9.8, why: Some("no answer".to_owned()) });
    for tab in '1'..='8' {
        screen.handle_key(key(tab), &view);
        screen.handle_key(KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE), &view);
        assert!(drawn(&mut screen, &view, 80, 24).contains("!! 5 feeder: STOP NOT CONFIRMED for 4.2 s"), "{tab}");
    }
}

#[test]
fn a_stop_that_has_failed_is_no_alarm_any_more_once_it_is_confirmed() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    screen.take(Purpose::Stop, Err(Refused::new("the bench only listens to this bus")));
    for unconfirmed in [None, Some(Unconfirmed { since: 9.8, why: None })] {
        view.drives[0].unconfirmed = unconfirmed;
        assert!(drawn(&mut screen, &view, 80, 24).contains("NOT STOPPED"));
    }
    view.drives[0].unconfirmed = None;
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains("every drive has stopped") && !text.contains("NOT STOPPED"), "{text}");
}

#[test]
fn a_drive_that_may_be_moving_is_shown_in_every_tab() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    let text = "DRIVE 5 MAY STILL BE MOVING: it could not be told to stop".to_owned();
    view.drives[0].ending = Some(Ending { is_success: false, may_be_moving: true, text, remedy: None });
    for tab in '1'..='8' {
        screen.handle_key(key(tab), &view);
        screen.handle_key(KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE), &view);
        assert!(drawn(&mut screen, &view, 80, 24).contains("!! DRIVE 5 MAY STILL BE MOVING"), "{tab}");
    }
}

#[test]
fn what_is_wrong_or_selected_is_marked_without_colours() {
    // `drawn` returns only characters, no colours, and no reversed or bold text.
    let (mut view, mut screen) = (view(), screen(Language::English));
    view.bus.state = "bus off".to_owned();
    view.bus.load_percent = Some(91.0);
    view.drives[0].ending.as_mut().unwrap().may_be_moving = true;
    let tab = |screen: &mut Screen, tab, marks: &[&str]| {
        screen.handle_key(key(tab), &view);
        let text = drawn(screen, &view, 140, 40);
        for mark in marks {
            assert!(text.contains(mark), "{mark:?} is not in\n{text}");
        }
    };
    tab(&mut screen, '1', &["[1 Nodes]", "!bus off", "▸5 ", "!7121", "! 7121h", "!PRE-OPERATIONAL (-2.3 s)"]);
    tab(&mut screen, '2', &["▸6064:00", "≠ 4711"]);
    tab(&mut screen, '3', &["▸TPDO1"]);
    tab(&mut screen, '4', &["! 812"]);
    tab(&mut screen, '5', &["▸a 5 Position Actual Value"]);
    tab(&mut screen, '6', &["▸  5", "!FAULT", "▶FAULT◀", "!! a fault has stopped it", "! it is in fault"]);
    tab(&mut screen, '7', &["!load 91.0 %", "▸! "]);
    tab(&mut screen, '8', &["▸5 feeder"]);
    screen.take(Purpose::Say, Err(Refused::new("take control first")));
    tab(&mut screen, '1', &["! take control first"]);
}

#[test]
fn values_and_rates_of_pdos_are_renewed_without_reading_the_mapping_again() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "3");
    let addresses = vec!["6041:00".to_owned(), "6064:00".to_owned()];
    assert_eq!(screen.wants(&view), Some((Purpose::Seen(5), Request::Seen { node: 5, addresses })));
    screen.take(Purpose::Seen(5), Ok(Answer::Values(vec![value("6064:00", "4812")])));
    view.bus.ids[0].per_second = 20.0;
    let text = drawn(&mut screen, &view, 80, 24);
    assert!(text.contains("Position Actual Value 4812") && text.contains(" 20.0/s"), "{text}");
    assert!(text.contains("Statusword FAULT"), "what is not known anew stays:\n{text}");
}

#[test]
fn what_is_pasted_is_text_where_something_is_typed_and_nothing_elsewhere() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "6");
    let before = drawn(&mut screen, &view, 80, 24);
    // Typed, these keys would enable, run and stop.
    screen.paste("ev500\n ");
    assert_eq!(drawn(&mut screen, &view, 80, 24), before);
    press(&mut screen, &view, "m");
    screen.paste("9\r\n0 deg\u{1b}");
    assert!(drawn(&mut screen, &view, 80, 24).contains("5 feeder: to which position: 90 deg▏"));
    let travel = Request::Drive { node: 5, order: Verb::MoveTo, value: Some("90 deg".to_owned()) };
    assert_eq!(press(&mut screen, &view, "\n"), Some(Action::Ask(Purpose::Say, travel)));
}

#[test]
fn cursors_show_numbers_and_their_difference() {
    let (view, mut screen) = (view(), screen(Language::English));
    // From 0 to 14 s; a value is the square of the time in hundredths of a second, divided by 1.4.
    press(&mut screen, &view, "5i");
    let text = drawn(&mut screen, &view, 140, 40);
    assert!(text.contains("1*: 7.000 s"), "in the middle of what there is so far:\n{text}");
    press(&mut screen, &view, "0+f");
    press(&mut screen, &view, "ij.<");
    let text = drawn(&mut screen, &view, 140, 40);
    assert!(text.contains("1: 9.000 s  2*: 8.100 s  2-1: -0.900 s"), "{text}");
    assert!(text.contains("1: 4096") && text.contains("2: 3249") && text.contains("2-1: -847"), "{text}");
    press(&mut screen, &view, "0");
    assert!(!drawn(&mut screen, &view, 140, 40).contains("2-1:"));
}

#[test]
fn a_trigger_holds_the_curves_around_the_crossing() {
    let curve = |points: &[(f64, f64)]| {
        let (address, name) = ("6064:00".to_owned(), "Position".to_owned());
        vec![Curve { node: 5, address, name, unit: None, seen: None, points: points.to_vec() }]
    };
    // The curve falls at 3.5, rises at 15.5, and falls at 20.5.
    let wave = [(0.0, 0.0), (3.0, 10.0), (4.0, 0.0), (15.0, 0.0), (16.0, 10.0), (20.0, 10.0), (21.0, 0.0)];
    for (words, shown) in [("> 5", "11.5 s"), ("< 5", "16.5 s")] {
        let (mut view, mut screen) = (view(), screen(Language::English));
        view.time = 14.0;
        press(&mut screen, &view, "5t");
        press(&mut screen, &view, &format!("{words}\n"));
        assert!(drawn(&mut screen, &view, 140, 40).contains(&format!("waits for: a {words}")));
        let mut points = wave.to_vec();
        screen.take(Purpose::Plots, Ok(Answer::Curves(curve(&points))));
        assert!(drawn(&mut screen, &view, 140, 40).contains("waits for"), "what comes after it is not here yet");
        points.push((40.0, 0.0));
        view.time = 40.0;
        screen.take(Purpose::Plots, Ok(Answer::Curves(curve(&points))));
        let text = drawn(&mut screen, &view, 140, 40);
        assert!(text.contains("stands  1*: ") && text.contains(shown) && !text.contains("waits for"), "{text}");
        assert!(screen.wants(&view).is_some(), "the points of what it holds");
        screen.take(Purpose::Plots, Ok(Answer::Curves(curve(&points))));
        assert_eq!(screen.wants(&view), None, "it is held");
        press(&mut screen, &view, "a606C\n");
        assert!(screen.wants(&view).is_some(), "a curve more is seen");
    }
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "5t");
    press(&mut screen, &view, "soon\n");
    assert!(drawn(&mut screen, &view, 140, 40).contains("! \"soon\" is no number"));
}

#[test]
fn the_mouse_selects_and_scrolls_and_gives_no_order() {
    let (view, mut screen) = (view(), screen(Language::English));
    let mouse = |screen: &mut Screen, kind, column, row| {
        screen.handle_mouse(MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE }, &view);
        drawn(screen, &view, 80, 24)
    };
    let click = MouseEventKind::Down(MouseButton::Left);
    drawn(&mut screen, &view, 80, 24);
    assert!(mouse(&mut screen, click, 3, 4).contains("▸7    io"));
    assert!(mouse(&mut screen, click, 3, 20).contains("▸7    io"), "no row is there");
    assert!(mouse(&mut screen, MouseEventKind::ScrollUp, 3, 9).contains("▸5    feeder"));
    let text = mouse(&mut screen, click, 12, 0);
    assert!(text.contains("[2 Objects]"), "{text}");
    assert!(mouse(&mut screen, click, 12, 4).contains("▸6081:00"));
    assert!(mouse(&mut screen, click, 62, 0).contains("[7 Bus]"));
    assert!(mouse(&mut screen, click, 5, 6).lines().any(|line| line.starts_with("▸185")));
    assert!(mouse(&mut screen, click, 5, 4).lines().any(|line| line.starts_with("▸!")));
    mouse(&mut screen, click, 12, 0);
    // A prompt is about the row that was selected when it was opened.
    press(&mut screen, &view, "\n60");
    assert!(mouse(&mut screen, click, 12, 3).contains("▸6081:00"));
    assert!(mouse(&mut screen, click, 3, 0).contains("[2 Objects]"));
    let write = Request::Write { node: 5, address: "6081:00".to_owned(), text: "60".to_owned(), force: false };
    assert_eq!(press(&mut screen, &view, "\n"), Some(Action::Ask(Purpose::Say, write)));
    press(&mut screen, &view, "4");
    drawn(&mut screen, &view, 80, 24);
    let text = mouse(&mut screen, click, 12, 4);
    assert!(text.contains("stands") && text.contains("▸  811"), "{text}");
}
