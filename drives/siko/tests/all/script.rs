//! Scripts of the simulated drive: every key, every condition, every refusal.

use lexican_runtime::{Duration, Instant};
use proptest::prelude::*;
use siko_ag03_1::fault::{self, FaultKind};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::inputs::{BusError, BusState, Inputs, Key, Shaft};
use siko_ag03_1::sim::script::{Change, Condition, Trigger, inputs};
use siko_ag03_1::sim::{BusLed, Restore, Script, SimulatedDrive, Termination};
use siko_ag03_1::state::State;
use siko_ag03_1::words::system;
use simulator::script::Takes;

use super::support::{NODE, Rig};

impl Rig {
    /// A drive that follows steps after one `[[step]]`, or a whole script.
    #[track_caller]
    fn scripted(script: &str) -> Self {
        let whole = if script.contains("[[step]]") { script.to_owned() } else { format!("[[step]]\n{script}\n") };
        let script = Script::from_toml(&MODEL, &whole).unwrap_or_else(|error| panic!("{error}\nof {script}"));
        let mut drive = SimulatedDrive::new(&MODEL, NODE);
        drive.follow(Instant::ZERO, script);
        Rig::of(drive)
    }

    /// A drive that is enabled, and travels to 5000 since 0 ms.
    fn travelling(script: &str) -> Self {
        let mut rig = Rig::scripted(script);
        rig.pass(0);
        rig.enable();
        rig.ask("405#1F0088130000");
        rig
    }
}

/// Checks how a step changes the inputs of a drive, at once.
#[track_caller]
fn changes(step: &str, change: impl FnOnce(&mut Inputs)) {
    let mut expected = Inputs::default();
    change(&mut expected);
    assert_eq!(Rig::scripted(step).see(|drive, _| *drive.inputs()), expected, "{step}");
}

#[test]
fn every_input_can_be_set() {
    changes("supply_v = 17.9", |inputs| {
        (inputs.output_stage_supply_100mv, inputs.control_supply_100mv) = (179, 179);
    });
    changes("output_stage_v = 35.1", |inputs| inputs.output_stage_supply_100mv = 351);
    changes("control_v = 20", |inputs| inputs.control_supply_100mv = 200);
    changes("battery_v = 2.15", |inputs| inputs.battery_10mv = 215);
    changes("temperature_degc = -40.5", |inputs| inputs.temperature_100mdegc = -405);
    changes("load_ma = 0x960", |inputs| inputs.load_ma = 2400);
    changes("load_ma = 1_000", |inputs| inputs.load_ma = 1000);
    changes("load_ma = 1e3", |inputs| inputs.load_ma = 1000);
    changes("attainable_rpm = 15", |inputs| inputs.attainable_rpm = Some(15));
    changes("attainable_rpm = \"any\"", |_| ());
    changes("shaft = \"blocked\"", |inputs| inputs.shaft = Shaft::Blocked);
    changes("bus = \"passive\"", |inputs| inputs.bus = BusState::Passive);
    changes("bus_kbit = 62.5", |inputs| inputs.bus_bit_rate = Some(62_500));
    changes("bus_kbit = \"any\"", |_| ());
    for (error, name) in BusError::ALL {
        changes(&format!("bus_error = \"{name}\""), |inputs| inputs.bus_error = Some(*error));
    }
    changes("[[step]]\nbus_error = \"crc\"\n[[step]]\nbus_error = \"none\"", |_| ());
    changes("limit_switch = \"1\"", |inputs| inputs.limit_switches = [true, false]);
    changes("limit_switch = \"2\"", |inputs| inputs.limit_switches = [false, true]);
    changes("[[step]]\nlimit_switch = \"2\"\n[[step]]\nlimit_switch = \"none\"", |_| ());
    changes("calibration_switch = true", |inputs| inputs.calibration_switch = true);
    changes("[[step]]\ncalibration_switch = true\n[[step]]\ncalibration_switch = false", |_| ());
    changes("enable = false", |inputs| inputs.enable = false);
    changes("key = \"clockwise\"", |inputs| inputs.key = Some(Key::Clockwise));
    changes("key = \"counter-clockwise\"", |inputs| inputs.key = Some(Key::CounterClockwise));
    changes("key = \"none\"", |_| ());
    changes("fault = \"sensor\"\nload_ma = 700", |inputs| {
        inputs.force(FaultKind::Sensor);
        inputs.load_ma = 700;
    });
    changes("[[step]]\nbattery_v = 1\nload_ma = 1\n[[step]]\nclear = \"all\"", |_| ());
    changes("[[step]]\nbattery_v = 1\nload_ma = 1\n[[step]]\nclear = \"battery\"", |inputs| inputs.load_ma = 1);
}

#[test]
fn every_fault_can_be_told_by_letter_and_by_name_and_stays_until_it_is_cleared() {
    let names = [
        "undervoltage",
        "shaft blocked",
        "overcurrent",
        "overtemperature",
        "sensor",
        "internal",
        "overvoltage",
        "bus passive",
        "bus off",
        "battery",
    ];
    for (fault, name) in fault::FAULTS.iter().zip(names) {
        for word in [name.to_owned(), fault.letter().to_string()] {
            let mut rig = Rig::travelling(&format!(
                "[[step]]\nat_ms = 1000\nfault = \"{word}\"\n[[step]]\nafter_ms = 1000\nclear = \"{word}\"\n"
            ));
            let [low, high] = fault.code.number.to_le_bytes();
            let heard = rig.pass(1000);
            let emergency = format!("085#{low:02X}{high:02X}{:02X}0000000000", fault.register);
            assert!(heard.contains(&emergency), "{heard:?}");
            assert_eq!(rig.see(|drive, _| drive.controller().faults().to_vec()), [*fault]);
            rig.ask("205#8000");
            assert_eq!(rig.see(|drive, _| drive.state()), State::Fault, "{word}: it is still there");
            rig.pass(1000);
            rig.ask("205#0000");
            rig.ask("205#8000");
            assert_eq!(rig.see(|drive, _| drive.state()), State::SwitchOnDisabled, "{word}");
        }
    }
}

#[test]
fn switches_can_be_set_and_are_read_at_power_on() {
    let switches = |step: &str| Rig::scripted(step).see(|drive, _| drive.switches());
    assert_eq!(switches("switches = \"0100000 0 11\"").node().get(), 2);
    assert_eq!(switches("termination = true").termination(), Termination::Active);
    assert_eq!(switches("termination = false").termination(), Termination::Deactivated);
    for (name, restore) in [
        ("all", Some(Restore::All)),
        ("standard", Some(Restore::Standard)),
        ("controller", Some(Restore::Controller)),
        ("none", None),
    ] {
        assert_eq!(switches(&format!("restore = \"{name}\"")).restore(), restore);
    }
    assert_eq!(Rig::scripted("node = 7").see(|drive, _| drive.node().get()), 5);
    // The keys of a step take effect in a fixed order, not in the written one.
    assert_eq!(Rig::scripted("power = \"cycle\"\nnode = 7").see(|drive, _| drive.node().get()), 7);
}

#[test]
fn the_supply_can_be_switched() {
    let mut rig = Rig::scripted("[[step]]\npower = \"off\"\n[[step]]\nat_ms = 100\npower = \"on\"\n");
    assert!(rig.pass(99).is_empty() && !rig.see(|drive, _| drive.is_on()));
    assert_eq!(rig.pass(1), ["705#00"]);
    assert!(rig.see(|drive, _| drive.is_on() && drive.bus_led() == BusLed::Blinks));
}

#[test]
fn a_shaft_can_be_turned_when_nothing_holds_it() {
    assert_eq!(Rig::scripted("turn = -25").see(|drive, now| drive.position(now)), -25);
    let mut rig = Rig::travelling("at_ms = 20000\nturn = -25");
    rig.pass(20_000);
    assert_eq!(rig.see(|drive, now| drive.position(now)), 5000, "the motor holds its position");
}

/// Checks when the condition of a step becomes true for a drive that travels from 0 to 5000 in 6.5 s.
#[track_caller]
fn comes_after(condition: &str, ms: u64) {
    let mut rig = Rig::travelling(&format!("when = \"{condition}\"\nload_ma = 1"));
    let happened = |rig: &Rig| rig.see(|drive, _| drive.steps_left() == 0);
    if ms > 0 {
        rig.pass(ms - 1);
        assert!(!happened(&rig), "{condition}: too early");
        rig.pass(1);
    }
    assert!(happened(&rig), "{condition}: not after {ms} ms");
    assert_eq!(rig.see(|drive, _| drive.inputs().load_ma), 1);
}

#[test]
fn conditions_come_true_when_they_do() {
    for at_once in [
        "on",
        "standing",
        "no fault",
        "switch on disabled",
        "pre-operational",
        "operational",
        "ready to switch on",
        "switched on",
        "operation enabled",
        "moving",
        "positioning",
        "position below 1",
    ] {
        comes_after(at_once, 0);
    }
    comes_after("target reached", 6500);
    // 100 increments in the 250 ms of the ramp, and 800 per second from there.
    comes_after("position above 100", 251);
    comes_after("position above 2499", 3250);
}

#[test]
fn conditions_that_others_bring_about_are_seen() {
    for (condition, frame) in
        [("stopped", "000#0205"), ("quick stop active", "205#0200"), ("ready to switch on", "205#0600")]
    {
        let script = format!("[[step]]\nat_ms = 1\nload_ma = 2\n[[step]]\nwhen = \"{condition}\"\nload_ma = 1");
        let mut rig = Rig::travelling(&script);
        rig.pass(100);
        assert_eq!(rig.see(|drive, _| drive.inputs().load_ma), 2);
        rig.ask(frame);
        assert_eq!(rig.see(|drive, _| drive.inputs().load_ma), 1, "{condition}");
    }
    let script = "[[step]]\nat_ms = 50\npower = \"off\"\n[[step]]\nwhen = \"off\"\nafter_ms = 7\nload_ma = 1\n\
                  [[step]]\nwhen = \"standing\"\npower = \"on\"\nfault = \"A\"\n[[step]]\nwhen = \"fault\"\nload_ma = 3\n";
    let mut rig = Rig::travelling(script);
    rig.pass(57);
    assert_eq!(rig.see(|drive, _| drive.inputs().load_ma), 1);
    rig.pass(1000);
    assert_eq!(rig.see(|drive, _| (drive.inputs().load_ma, drive.steps_left())), (3, 0));
}

#[test]
fn times_are_those_of_the_script_and_of_the_step_before() {
    let script = "[[step]]\nafter_ms = 10\nload_ma = 1\n[[step]]\nafter_ms = 10\nload_ma = 2\n[[step]]\nload_ma = 3\n\
                  [[step]]\nat_ms = 50\nload_ma = 4\n[[step]]\nwhen = \"on\"\nafter_ms = 5\nload_ma = 5\n";
    let mut rig = Rig::scripted(script);
    let mut seen = vec![(0, 600)];
    for ms in 1..100 {
        rig.pass(1);
        let load = rig.see(|drive, _| drive.inputs().load_ma);
        if seen.last().is_none_or(|(_, last)| *last != load) {
            seen.push((ms, load));
        }
    }
    assert_eq!(seen, [(0, 600), (10, 1), (20, 3), (50, 4), (55, 5)]);
}

#[test]
fn a_script_from_code_is_that_from_toml() {
    let when = Trigger::When { condition: Condition::PositionAbove(-7), and_then: Duration::from_millis(3) };
    let code = Script::default()
        .then(Trigger::At(Duration::from_millis(2)), [Change::Fault(FaultKind::Battery), Change::Power(false)])
        .then(when, [Change::Clear(FaultKind::Battery)]);
    let text = "[[step]]\nat_ms = 2\nfault = \"j\"\npower = \"off\"\n\
                [[step]]\nwhen = \"position above -7\"\nafter_ms = 3\nclear = \"battery\"\n";
    assert_eq!(Script::from_toml(&MODEL, text).unwrap(), code);
}

#[test]
fn the_examples_can_be_read_and_come_to_their_end() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let scripts: Vec<_> = files.filter(|path| path.extension().is_some_and(|name| name == "toml")).collect();
    assert!(scripts.len() >= 3, "{scripts:?}");
    for path in scripts {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut rig = Rig::travelling(&text);
        for _ in 0..240 {
            // After a reported fault, the manager resets it, and travels there and back again.
            rig.pass(500);
            for word in [0x00, 0x80, 0x06, 0x07, 0x0F] {
                if rig.see(|drive, _| drive.state() != State::OperationEnabled) {
                    rig.ask(&format!("205#{word:02X}00"));
                }
            }
            let target: i32 = if rig.see(|drive, now| drive.position(now)) < 2500 { 5000 } else { 0 };
            rig.travel_to(target);
        }
        assert_eq!(rig.see(|drive, _| drive.steps_left()), 0, "{}", path.display());
        assert!(rig.see(|drive, _| drive.controller().system_status(rig.bus.now()) & system::NO_SUPPLY) == 0);
    }
}

/// Checks the line and the text of an error.
#[track_caller]
fn refused(script: &str, line: usize, expected: &str) {
    let error = Script::from_toml(&MODEL, script).expect_err(script);
    assert_eq!((error.line, error.to_string().as_str()), (line, format!("line {line}: {expected}").as_str()));
}

#[test]
fn what_is_no_script_is_refused_with_its_line_and_a_remedy() {
    refused("", 1, "a script without steps; begin with [[step]]");
    refused("\nload_ma = 5\n", 2, "`load_ma` stands outside of a step; write [[step]] above");
    refused("step = 5\n", 1, "`step` stands outside of a step; write [[step]] above");
    refused("step = [\n5]\n", 2, "not a step; write it as [[step]]");
    refused("[[step]]\nat_ms = 5\n", 1, "a step that changes nothing; say what happens, such as `battery_v = 2.5`");
    let error = Script::from_toml(&MODEL, "[[step]]\nload_ma = \n").unwrap_err();
    assert_eq!(error.line, 2);
    assert!(error.problem.starts_with("not TOML: "), "{error}");
    assert_eq!(error.remedy, "write every step as [[step]] with lines of `key = value` below it");
}

#[test]
fn keys_that_are_none_are_refused() {
    refused("[[step]]\nload_ma = 5\nsuply_v = 24\n", 3, "no key `suply_v`; write `supply_v`");
    let error = Script::from_toml(&MODEL, "[[step]]\nload_ma = 5\n\nhumidity = 24\n").unwrap_err();
    assert_eq!((error.line, error.problem.as_str()), (4, "no key `humidity`"));
    assert!(error.remedy.starts_with("there is \"clear\", ") && error.remedy.ends_with(" or \"after_ms\""), "{error}");
}

#[test]
fn times_that_contradict_each_other_are_refused() {
    refused(
        "[[step]]\nat_ms = 5\nwhen = \"on\"\nload_ma = 5\n",
        1,
        "a step with both `at_ms` and `when`; keep one of them",
    );
    refused(
        "[[step]]\nat_ms = 5\nafter_ms = 5\nload_ma = 5\n",
        1,
        "a step with both `at_ms` and `after_ms`; keep one of them",
    );
    refused(
        "[[step]]\nat_ms = 50\nload_ma = 5\n\n[[step]]\nat_ms = 5\nload_ma = 5\n",
        5,
        "5 ms is before the 50 ms of a step above; write the steps in the order in which they happen",
    );
}

#[test]
fn values_that_cannot_be_are_refused() {
    let value = |key: &str, value: &str, remedy: &str| {
        refused(&format!("[[step]]\n{key} = {value}\n"), 2, &format!("`{key}` cannot be {value}; write {remedy}"));
    };
    for key in ["supply_v", "output_stage_v", "control_v"] {
        value(key, "240", "a number from 0 to 100 (V)");
    }
    value("battery_v", "\"low\"", "a number from 0 to 10 (V)");
    value("temperature_degc", "201", "a number from -100 to 200 (degC)");
    value("load_ma", "-1", "a number from 0 to 32767 (mA)");
    value("attainable_rpm", "0", "a number from 1 to 255 (rev/min, or \"any\")");
    value("turn", "true", "a number from -1000000000 to 1000000000 (increments)");
    value("node", "128", "a number from 1 to 127 (node-ID)");
    value("at_ms", "-1", "a number from 0 to 1000000000000 (ms)");
    value("after_ms", "nan", "a number from 0 to 1000000000000 (ms)");
    value("shaft", "\"stuck\"", "\"free\" or \"blocked\"");
    value("bus", "\"on\"", "\"active\", \"passive\" or \"off\"");
    value("key", "1", "\"clockwise\", \"counter-clockwise\" or \"none\"");
    value("restore", "1", "\"all\", \"standard\", \"controller\" or \"none\"");
    value("power", "true", "\"on\", \"off\" or \"cycle\"");
    value("termination", "\"on\"", "true or false");
    value("switches", "\"101\"", "ten digits, SW1 first, 1 for ON: \"1010000 0 00\" is node 5");
    value("bus_kbit", "800", "one of 15.625, 20, 25, 40, 50, 62.5, 100, 125, 200, 250, 500, 1000 (kbit/s), or \"any\"");
    let faults = "\"undervoltage\", \"shaft blocked\", \"overcurrent\", \"overtemperature\", \"sensor\", \"internal\", \
                  \"overvoltage\", \"bus passive\", \"bus off\" or \"battery\"";
    value("fault", "\"K\"", &format!("a letter from \"A\" to \"J\", or {faults}"));
    value("clear", "\"K\"", &format!("a letter from \"A\" to \"J\", or {faults}, or \"all\""));
    let error = Script::from_toml(&MODEL, "[[step]]\nwhen = \"position above x\"\n").unwrap_err();
    assert!(error.remedy.starts_with("write \"moving\", ") && error.remedy.ends_with(" or \"position below 0\""));
}

/// Keys and values of scripts, including invalid ones.
fn lines() -> impl Strategy<Value = String> {
    let keys = prop::sample::select(vec![
        "[[step]]",
        "at_ms = ",
        "after_ms = ",
        "when = ",
        "supply_v = ",
        "battery_v = ",
        "load_ma = ",
        "attainable_rpm = ",
        "shaft = ",
        "turn = ",
        "bus = ",
        "bus_kbit = ",
        "key = ",
        "fault = ",
        "clear = ",
        "node = ",
        "switches = ",
        "restore = ",
        "termination = ",
        "power = ",
        "step = ",
        "",
    ]);
    let values = prop_oneof![
        Just(String::new()),
        any::<i64>().prop_map(|number| number.to_string()),
        any::<f64>().prop_map(|number| format!("{number:?}")),
        "[a-z ]{0,12}|position above -?[0-9]{0,12}".prop_map(|word| format!("{word:?}")),
        ".{0,8}",
    ];
    (keys, values).prop_map(|(key, value)| format!("{key}{value}\n"))
}

proptest! {
    #[test]
    fn no_text_makes_a_script_panic(lines in prop::collection::vec(lines(), 0..12)) {
        let text = lines.concat();
        if let Err(error) = Script::from_toml(&MODEL, &text) {
            prop_assert!((1..=text.lines().count().max(1) + 1).contains(&error.line), "{error}");
            prop_assert!(!error.remedy.is_empty());
        }
    }

    #[test]
    fn whatever_happens_to_a_drive_it_goes_on(steps in prop::collection::vec((0_u64..2000, 0_usize..16, any::<u8>()), 0..20)) {
        let mut script = Script::default();
        for (after_ms, change, number) in steps {
            let fault = fault::FAULTS[usize::from(number) % 10];
            let change = match change {
                0 => Change::OutputStageSupply(u16::from(number) * 2),
                1 => Change::ControlSupply(u16::from(number)),
                2 => Change::Battery(i16::from(number) * 2),
                3 => Change::Temperature(i16::from(number) * 8 - 500),
                4 => Change::Load(u16::from(number) * 16),
                5 => Change::Attainable(Some(number)),
                6 => Change::Shaft(if number < 128 { Shaft::Free } else { Shaft::Blocked }),
                7 => Change::Turn(i32::from(number) - 128),
                8 => Change::Bus([BusState::Active, BusState::Passive, BusState::Off][usize::from(number) % 3]),
                9 => Change::Key([None, Some(Key::Clockwise), Some(Key::CounterClockwise)][usize::from(number) % 3]),
                10 => Change::Fault(fault.kind),
                11 => Change::Clear(fault.kind),
                12 => Change::ClearAll,
                13 => Change::Restore(Some(Restore::ALL[usize::from(number) % 3])),
                14 => Change::Power(number < 128),
                _ => Change::PowerCycle,
            };
            script = script.then(Trigger::After(Duration::from_millis(after_ms)), [change]);
        }
        let steps = script.steps().len();
        let mut rig = Rig::travelling("load_ma = 600");
        rig.drive.lock().unwrap().follow(rig.bus.now(), script);
        rig.pass(2000 * steps as u64);
        prop_assert_eq!(rig.see(|drive, _| drive.steps_left()), 0);
        // Each error can be corrected.
        let now = rig.bus.now();
        let mut drive = rig.drive.lock().unwrap();
        drive.apply(now, Change::ClearAll);
        drive.apply(now, Change::Restore(None));
        drive.apply(now, Change::Node(NODE));
        drive.apply(now, Change::Power(true));
        drive.apply(now, Change::PowerCycle);
        drop(drive);
        prop_assert!(rig.pass(10).contains(&"705#00".into()));
    }
}

/// A table of buttons cannot request what the drive refuses, and shows the effect.
#[test]
fn each_input_takes_what_it_says() {
    for model in [&MODEL, &siko_ag02::sim::MODEL] {
        let mut drive = SimulatedDrive::new(model, NODE);
        let step = |line: &str| Script::from_toml(model, &format!("[[step]]\n{line}\n"));
        for input in inputs(&drive) {
            let (values, wrong) = match &input.takes {
                Takes::Flag => (vec!["true".to_owned(), "false".to_owned()], "1".to_owned()),
                Takes::Words(words) => (words.iter().map(ToString::to_string).collect(), "some".to_owned()),
                Takes::Number(range, word) => {
                    let values = [range.low, range.high].map(|number| number.to_string()).into_iter();
                    (values.chain(word.map(str::to_owned)).collect(), (range.high + 1.0).to_string())
                }
                Takes::Text(_) => (vec!["1010000 0 00".to_owned()], "5".to_owned()),
            };
            for value in values {
                let line = input.line(&value);
                let script = step(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
                script.steps()[0].changes.iter().for_each(|change| drive.apply(Instant::ZERO, *change));
                let now = inputs(&drive).into_iter().find(|now| now.name == input.name).unwrap().value;
                assert!(input.value.is_none() || now == Some(value), "{line}: {now:?}");
                if let Some(value) = &input.value {
                    // Restores the input for the next one.
                    let script = step(&input.line(value)).unwrap_or_else(|error| panic!("{value}: {error}"));
                    script.steps()[0].changes.iter().for_each(|change| drive.apply(Instant::ZERO, *change));
                }
            }
            assert!(step(&input.line(&wrong)).is_err(), "{}", input.line(&wrong));
        }
    }
}

#[test]
fn a_drive_has_the_inputs_of_its_model() {
    let names = |model| inputs(&SimulatedDrive::new(model, NODE)).iter().map(|input| input.name).collect::<Vec<_>>();
    let (with_keys, with_switches) = (names(&MODEL), names(&siko_ag02::sim::MODEL));
    for (name, expected) in [
        ("shaft", (true, true)),
        ("key", (true, false)),
        ("switches", (true, false)),
        ("limit_switch", (false, true)),
        ("enable", (false, true)),
        ("bus_error", (false, true)),
    ] {
        assert_eq!((with_keys.contains(&name), with_switches.contains(&name)), expected, "{name}");
    }
}
