//! The terminal's face: what each room shows (`tests/tui/`, made by `LEXICAN_BLESS=1`), and what keys ask for.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use lexican_bench::command::{Nmt, Order};
use lexican_bench::tui::{Action, Language, Purpose, Screen};
use lexican_bench::view::{
    Bus, Curve, Drive, Ending, Fault, Frames, Hands, Input, Job, Log, Node, Object, Pdo, PdoField, Rate, Row,
    Simulated, Trouble, Value, View, Watched,
};
use lexican_bench::{Answer, Command, Refused};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

/// A plant of which a drive is in fault.
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
        orders: vec![Order::Enable, Order::MoveTo],
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
                row: Some(700),
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
            bounds: Some((0.0, 4711.0)),
            changes: 12,
        }],
        hands: Hands { holder: Some(1), faces: 2 },
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

/// A screen that has got all that it has asked for.
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
            },
            PdoField {
                address: "6064:00".to_owned(),
                name: "Position Actual Value".to_owned(),
                first_bit: 16,
                bits: 32,
                text: Some("4711".to_owned()),
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
    let curve =
        Curve { node: 5, address: "6064:00".to_owned(), name: "Position Actual Value".to_owned(), unit: None, points };
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

fn drawn(screen: &Screen, view: &View, width: u16, height: u16) -> String {
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
fn golden_rooms_are_shown_in_both_languages_and_two_sizes() {
    let (folder, view) = (Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tui"), view());
    let bless = std::env::var_os("LEXICAN_BLESS").is_some();
    for (name, language) in [("en", Language::English), ("de", Language::German)] {
        for (width, height) in [(80, 24), (140, 40)] {
            let mut screen = screen(language);
            let mut text = String::new();
            for room in '1'..='8' {
                screen.handle_key(key(room), &view);
                text += &drawn(&screen, &view, width, height);
            }
            screen.handle_key(key('?'), &view);
            text += &drawn(&screen, &view, width, height);
            let path = folder.join(format!("{name}-{width}.txt"));
            if bless {
                fs::write(&path, &text).unwrap();
            }
            let known = fs::read_to_string(&path).unwrap_or_default();
            assert!(
                known == text,
                "{} is out of date: LEXICAN_BLESS=1 cargo test -p lexican-bench --test tui",
                path.display()
            );
        }
    }
}

#[test]
fn space_stops_everything_in_every_room() {
    let view = view();
    for room in '1'..='8' {
        let mut screen = screen(Language::English);
        screen.handle_key(key(room), &view);
        assert_eq!(screen.handle_key(key(' '), &view), stop());
        screen.handle_key(key('?'), &view);
        assert_eq!(screen.handle_key(key(' '), &view), stop(), "under the help, too");
    }
}

fn stop() -> Option<Action> {
    Some(Action::Ask(Purpose::Stop, Command::StopAll))
}

#[test]
fn while_something_is_typed_another_key_stops_and_is_named() {
    let (view, mut screen) = (view(), screen(Language::English));
    assert_eq!(press(&mut screen, &view, "6m90 "), None);
    let text = drawn(&screen, &view, 80, 24);
    assert!(text.contains("F12 = STOP ALL") && !text.contains("SPACE = STOP ALL"), "{text}");
    assert_eq!(screen.handle_key(KeyEvent::new(KeyCode::F(12), KeyModifiers::NONE), &view), stop());
    assert_eq!(press(&mut screen, &view, "q"), Some(Action::Leave), "nothing is typed any more");
    screen.take(Purpose::Stop, Err(Refused::new("node 5 does not answer")));
    assert!(drawn(&screen, &view, 80, 24).contains("NOT STOPPED: node 5 does not answer"));
}

#[test]
fn an_order_goes_to_the_drive_it_was_asked_for() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "6m90");
    assert!(drawn(&screen, &view, 80, 24).contains("5 feeder: to which position: 90"));
    // Another drive is found meanwhile, and takes the row.
    view.drives.insert(0, Drive { node: 3, ..Drive::default() });
    view.nodes.insert(0, Node { id: 3, ..Node::default() });
    let travel = Command::Drive { node: 5, order: Order::MoveTo, value: Some("90".to_owned()) };
    assert_eq!(press(&mut screen, &view, "\n"), Some(Action::Ask(Purpose::Say, travel)));
}

#[test]
fn entries_of_another_node_are_not_shown_and_not_written() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "2]");
    let text = drawn(&screen, &view, 80, 24);
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
    // Backspace, as some terminals send it.
    press(&mut screen, &view, "m95");
    screen.handle_key(KeyEvent::new(KeyCode::Char('h'), KeyModifiers::CONTROL), &view);
    assert!(drawn(&screen, &view, 80, 24).contains("to which position: 9▏"));
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
    assert!(drawn(&screen, &view, 140, 40).contains("no such file.dcf: "));
}

#[test]
fn orders_take_their_values_from_the_last_line() {
    let (view, mut screen) = (view(), screen(Language::English));
    let order = |order, value: Option<&str>| {
        let command = Command::Drive { node: 5, order, value: value.map(str::to_owned) };
        Some(Action::Ask(Purpose::Say, command))
    };
    assert_eq!(press(&mut screen, &view, "6e"), order(Order::Enable, None));
    assert_eq!(press(&mut screen, &view, "m90 deg\n"), order(Order::MoveTo, Some("90 deg")));
    // A question that is left asks for nothing, and letters in it are no keys.
    assert_eq!(press(&mut screen, &view, "mq"), None);
    screen.handle_key(KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "q"), Some(Action::Leave));
}

#[test]
fn hands_are_taken_and_given_back() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    assert_eq!(press(&mut screen, &view, "h"), Some(Action::Ask(Purpose::Say, Command::ReleaseHands)));
    view.hands.holder = None;
    let take = |force| Some(Action::Ask(Purpose::Say, Command::TakeHands { force }));
    assert_eq!(press(&mut screen, &view, "h"), take(false));
    assert_eq!(press(&mut screen, &view, "H"), take(true));
}

#[test]
fn a_node_is_commanded_and_its_objects_are_searched_and_written() {
    let (view, mut screen) = (view(), screen(Language::English));
    let start = Command::Nmt { node: Some(7), command: Nmt::Start };
    screen.handle_key(KeyEvent::new(KeyCode::Down, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "o"), Some(Action::Ask(Purpose::Say, start)));
    assert_eq!(screen.wants(&view), None);
    press(&mut screen, &view, "[2/velocity\n");
    assert_eq!(screen.wants(&view), Some((Purpose::Objects(5), Command::Objects { node: 5 })));
    let write = Command::Write { node: 5, address: "6081:00".to_owned(), text: "60 rpm".to_owned(), force: false };
    assert_eq!(press(&mut screen, &view, "\n60 rpm\n"), Some(Action::Ask(Purpose::Say, write)));
    let refused = Refused::new("6081:00 Profile Velocity: 999 rpm is too high: the data sheet allows 0 to 200 rpm");
    screen.take(Purpose::Say, Err(refused));
    assert!(drawn(&screen, &view, 140, 40).contains("too high: the data sheet allows 0 to 200 rpm"));
}

#[test]
fn a_mapping_is_made_checked_and_written() {
    let (view, mut screen) = (view(), screen(Language::English));
    let map = |objects: &[&str], check| {
        let objects = objects.iter().map(|&object| object.to_owned()).collect();
        let transmission = Some("every:10ms".to_owned());
        Some(Action::Ask(
            Purpose::Mapped(5),
            Command::MapPdo { node: 5, pdo: "TPDO1".to_owned(), objects, transmission, check },
        ))
    };
    assert_eq!(press(&mut screen, &view, "3a606C\ntevery:10ms\nc"), map(&["6041:00", "6064:00", "606C"], true));
    screen.take(Purpose::Mapped(5), Ok(Answer::Objections(vec!["80 bits are mapped".to_owned()])));
    assert!(drawn(&screen, &view, 140, 40).contains("80 bits are mapped"));
    screen.handle_key(KeyEvent::new(KeyCode::Delete, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "\n"), map(&["6041:00", "6064:00"], false));
}

#[test]
fn a_fault_leads_to_its_row_and_the_trace_is_filtered() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "g");
    let Some((Purpose::Trace, Command::Trace { at, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert_eq!(at, Some(807), "with what was before it");
    assert!(drawn(&screen, &view, 140, 40).contains("▶812 "), "the row is marked");
    press(&mut screen, &view, "ssdo,emcy\nt!");
    let Some((_, Command::Trace { filter, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert_eq!((&*filter.services, filter.transfers, filter.alarming), ("sdo,emcy", true, true));
    let end = KeyEvent::new(KeyCode::End, KeyModifiers::NONE);
    screen.handle_key(end, &view);
    let Some((_, Command::Trace { at, from, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert!(at.is_none() && from < 0, "it follows again");
}

#[test]
fn a_trouble_leads_to_its_row() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "7a");
    let Some((Purpose::Trace, Command::Trace { at, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert_eq!(at, Some(view.bus.troubles[0].row.unwrap() - 5));
}

#[test]
fn rows_that_are_held_stay_when_older_ones_are_forgotten() {
    let (view, mut screen) = (view(), screen(Language::English));
    let row = |number| Row {
        number,
        time: 0.0,
        id: "080".to_owned(),
        data: String::new(),
        node: None,
        service: "SYNC".to_owned(),
        text: String::new(),
        alarming: false,
    };
    let page = |from: u64| Frames { matching: 1_000_000, from, rows: (from..from + 200).map(row).collect() };
    press(&mut screen, &view, "4");
    screen.take(Purpose::Trace, Ok(Answer::Frames(page(9_800))));
    press(&mut screen, &view, "f");
    let Some((_, Command::Trace { at, from, .. })) = screen.wants(&view) else { panic!("the trace") };
    assert_eq!((at, from), (Some(9_980), -100), "where it was, with rows to scroll to");
    // What is loaded begins elsewhere, since rows were forgotten.
    screen.take(Purpose::Trace, Ok(Answer::Frames(Frames { from: 5_784, ..page(9_880) })));
    let first = |screen: &Screen| drawn(screen, &view, 140, 40).lines().nth(4).unwrap().trim_start().to_owned();
    assert!(first(&screen).starts_with("9980 "), "{}", first(&screen));
    screen.handle_key(KeyEvent::new(KeyCode::PageUp, KeyModifiers::NONE), &view);
    assert!(first(&screen).starts_with("9960 "), "{}", first(&screen));
}

#[test]
fn a_failed_stop_stays_on_the_screen_until_somebody_has_seen_it() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, " ");
    screen.take(Purpose::Stop, Err(Refused::new("drive 5 does not answer")));
    screen.take(Purpose::Say, Ok(Answer::Done));
    screen.take(Purpose::Say, Err(Refused::new("6081:00 is too high")));
    let escape = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
    for said in [true, false] {
        let text = drawn(&screen, &view, 80, 24);
        assert!(text.contains("!! NOT STOPPED: drive 5 does not answer"), "{text}");
        assert_eq!(text.contains("! 6081:00 is too high"), said, "{text}");
        screen.handle_key(escape, &view);
    }
    assert!(!drawn(&screen, &view, 80, 24).contains("NOT STOPPED"));
    // A drive that may be moving is shown in every room, and cannot be dismissed.
    let text = "DRIVE 5 MAY STILL BE MOVING: it could not be told to stop".to_owned();
    view.drives[0].ending = Some(Ending { is_success: false, may_be_moving: true, text, remedy: None });
    for room in '1'..='8' {
        screen.handle_key(key(room), &view);
        screen.handle_key(escape, &view);
        assert!(drawn(&screen, &view, 80, 24).contains("!! DRIVE 5 MAY STILL BE MOVING"), "{room}");
    }
}

#[test]
fn the_end_of_a_job_stays_until_somebody_has_seen_it_or_the_next_one() {
    let (mut view, mut screen) = (view(), screen(Language::English));
    let job = |number, name: &str, text: &str, is_success| Job {
        number,
        name: name.to_owned(),
        done: Some(1.0),
        text: text.to_owned(),
        is_success,
    };
    view.jobs = vec![job(3, "restore of node 5", "6081:00 is refused", Some(false))];
    let escape = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
    assert!(drawn(&screen, &view, 80, 24).contains("✗ restore of node 5: 6081:00 is refused"));
    view.jobs.push(job(4, "backup of node 5", "6082:00", None));
    assert!(drawn(&screen, &view, 80, 24).contains("100 % backup of node 5: 6082:00"));
    view.jobs[1].is_success = Some(true);
    assert!(drawn(&screen, &view, 80, 24).contains("✓ backup of node 5"));
    screen.handle_key(escape, &view);
    assert!(!drawn(&screen, &view, 80, 24).contains("of node 5"));
}

#[test]
fn what_is_pasted_is_text_and_gives_no_order() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "6");
    screen.paste("e\nm900\n");
    assert!(!drawn(&screen, &view, 80, 24).contains('▏'), "no question is open");
    press(&mut screen, &view, "m");
    screen.paste("9\n0 deg\u{1b}");
    let travel = Command::Drive { node: 5, order: Order::MoveTo, value: Some("90 deg".to_owned()) };
    assert_eq!(press(&mut screen, &view, "\n"), Some(Action::Ask(Purpose::Say, travel)));
}

#[test]
fn the_values_of_pdos_follow_the_frames() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "3");
    let addresses = vec!["6041:00".to_owned(), "6064:00".to_owned()];
    assert_eq!(screen.wants(&view), Some((Purpose::Seen(5), Command::Seen { node: 5, addresses })));
    let seen = Value { text: "4712 inc".to_owned(), ..value("6064:00", "4712") };
    screen.take(Purpose::Seen(5), Ok(Answer::Values(vec![seen])));
    assert!(drawn(&screen, &view, 140, 40).contains("4712 inc"));
}

#[test]
fn a_cursor_reads_curves_off_and_a_trigger_holds_them() {
    let (view, mut screen) = (view(), screen(Language::English));
    press(&mut screen, &view, "5..m....");
    let text = drawn(&screen, &view, 140, 40);
    // The span is 20 s, of which 14 s have passed: a step is 0.2 s.
    assert!(text.contains(" 8.200 s (Δ 0.800 s)   5 Position Actual Value = 3364  (Δ 660)"), "{text}");
    press(&mut screen, &view, "ft up\n");
    assert!(drawn(&screen, &view, 140, 40).contains("! \" up\" is none of: rising 100"));
    press(&mut screen, &view, "trising 100\n");
    let waits = |screen: &Screen| drawn(screen, &view, 140, 40).contains("waits until the first curve is rising 100");
    assert!(waits(&screen));
    let curve = |points: &[(f64, f64)]| {
        let (address, name) = ("6064:00".to_owned(), "Position Actual Value".to_owned());
        Ok(Answer::Curves(vec![Curve { node: 5, address, name, unit: None, points: points.to_vec() }]))
    };
    // What was before it was armed, and what falls, does not count.
    screen.take(Purpose::Plots, curve(&[(10.0, 0.0), (11.0, 200.0), (15.0, 0.0)]));
    assert!(waits(&screen));
    screen.take(Purpose::Plots, curve(&[(15.0, 0.0), (16.0, 120.0), (17.0, 300.0)]));
    let text = drawn(&screen, &view, 140, 40);
    assert!(text.contains(" 16.000 s   5 Position Actual Value = 120"), "{text}");
    assert_eq!(screen.wants(&view), Some((Purpose::Plots, Command::Curves { since: 11.0 })));
}

#[test]
fn a_log_is_played_and_sought() {
    let mut view = view();
    view.log = Some(Log { seconds: 100.0, position: 50.0, speed: 0.0 });
    let mut screen = screen(Language::English);
    assert_eq!(press(&mut screen, &view, "l"), Some(Action::Ask(Purpose::Say, Command::Play { speed: 1.0 })));
    let right = screen.handle_key(KeyEvent::new(KeyCode::Right, KeyModifiers::NONE), &view);
    assert_eq!(right, Some(Action::Ask(Purpose::Say, Command::Seek { seconds: 52.0 })));
}

#[test]
fn an_input_of_a_simulated_device_is_set() {
    let (view, mut screen) = (view(), screen(Language::English));
    let set = Command::Input { node: 5, text: "shaft = free".to_owned() };
    screen.handle_key(key('8'), &view);
    screen.handle_key(KeyEvent::new(KeyCode::Down, KeyModifiers::NONE), &view);
    assert_eq!(press(&mut screen, &view, "\nfree\n"), Some(Action::Ask(Purpose::Say, set)));
    let off = Command::Power { node: 5, on: false };
    assert_eq!(press(&mut screen, &view, "p"), Some(Action::Ask(Purpose::Say, off)));
}
