//! Scripts: what happens to a servo on a bus, and when.
#![cfg(feature = "script")]

use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::nmt::NmtCommand;
use simulator::script::Takes;
use simulator::servo::script::{Change, Script, Setting, inputs};
use simulator::servo::{Inputs, ServoModel};

use crate::node::Bus;

/// A bus whose servo follows a script.
fn following(script: &str) -> Bus {
    let mut bus = Bus::new();
    let script = Script::from_toml(&ServoModel::CIA_402, script).unwrap_or_else(|error| panic!("{error}"));
    bus.follow(script);
    bus
}

#[test]
fn a_shaft_is_blocked_while_it_moves_and_let_go() {
    let mut bus = following(
        "[[step]]\nwhen = \"position above 500\"\nblocked = true\n\n[[step]]\nwhen = \"fault\"\nafter_ms = 100\nblocked = false\n",
    );
    bus.enable(1);
    bus.write(0x607A, 0, 2000);
    bus.write(0x6040, 0, 0x1F);
    bus.pass(2000);
    assert_eq!((bus.state(), bus.steps_left()), (State::Fault, 0));
    assert!((500.0..502.0).contains(&bus.shaft()), "{}", bus.shaft());
}

/// Each condition becomes true by the given action, and not before.
#[test]
fn a_step_waits_for_its_condition() {
    let enable = |bus: &mut Bus| bus.enable(1);
    let travel = |bus: &mut Bus| {
        bus.enable(1);
        bus.write(0x607A, 0, -1000);
        bus.write(0x6040, 0, 0x1F);
    };
    let arrive = |bus: &mut Bus| {
        travel(bus);
        bus.pass(3000);
    };
    let halfway = |bus: &mut Bus| {
        travel(bus);
        bus.pass(500);
    };
    let nothing = |_: &mut Bus| {};
    type Done<'a> = &'a dyn Fn(&mut Bus);
    let rows: &[(&str, Done<'_>, Done<'_>)] = &[
        ("moving", &enable, &halfway),
        ("standing", &halfway, &|bus| bus.pass(3000)),
        ("positioning", &enable, &halfway),
        ("target reached", &halfway, &|bus| bus.pass(3000)),
        ("operation enabled", &nothing, &enable),
        ("switch on disabled", &enable, &|bus| bus.write(0x6040, 0, 0)),
        ("ready to switch on", &nothing, &|bus| bus.write(0x6040, 0, 6)),
        ("switched on", &nothing, &|bus| {
            bus.write(0x6040, 0, 6);
            bus.write(0x6040, 0, 7);
        }),
        ("quick stop active", &enable, &|bus| {
            bus.enable(1);
            bus.write(0x605A, 0, 6);
            bus.write(0x6040, 0, 2);
        }),
        ("operational", &nothing, &|bus| bus.command(NmtCommand::Start)),
        ("stopped", &nothing, &|bus| bus.command(NmtCommand::Stop)),
        ("position below -400", &enable, &halfway),
        ("position above -400", &arrive, &|bus| {
            bus.write(0x6040, 0, 0x0F);
            bus.write(0x607A, 0, 0);
            bus.write(0x6040, 0, 0x1F);
            bus.pass(3000);
        }),
        ("off", &enable, &|bus| bus.power(false)),
        ("on", &|bus| bus.power(false), &|bus| bus.power(true)),
        ("pre-operational", &|bus| bus.power(false), &|bus| bus.power(true)),
    ];
    for (condition, before, then) in rows {
        let mut bus = Bus::new();
        before(&mut bus);
        let text = format!("[[step]]\nwhen = \"{condition}\"\nafter_ms = 5\ndigital = 1\n");
        bus.follow(Script::from_toml(&ServoModel::CIA_402, &text).unwrap());
        bus.pass(20);
        assert_eq!(bus.steps_left(), 1, "{condition}: not yet");
        then(&mut bus);
        bus.pass(20);
        assert_eq!(bus.steps_left(), 0, "{condition}: now");
    }
}

#[test]
fn what_a_drive_does_while_it_is_off_is_seen() {
    let mut bus = following(
        "[[step]]\nwhen = \"moving\"\nafter_ms = 300\npower = \"off\"\n[[step]]\nwhen = \"standing\"\nturn = 77\n\
         [[step]]\nafter_ms = 10\npower = \"cycle\"\n",
    );
    bus.enable(3);
    bus.write(0x60FF, 0, 1000);
    bus.pass(350);
    assert_eq!(bus.steps_left(), 2, "it runs out");
    let before = bus.shaft();
    bus.pass(1000);
    assert_eq!((bus.state(), bus.steps_left()), (State::SwitchOnDisabled, 0));
    assert!(bus.shaft() > before + 77.0, "{} after {before}", bus.shaft());
    assert_eq!(bus.read(0x6064, 0), 0, "no absolute encoder");
}

#[test]
fn values_that_cannot_be_are_refused_with_their_line() {
    let refused = |line: &str, expected: &str| {
        let error = Script::from_toml(&ServoModel::CIA_402, &format!("[[step]]\n{line}\n")).expect_err(line);
        assert_eq!(error.to_string(), format!("line 2: {expected}"), "{line}");
    };
    refused("blocked = \"yes\"", "`blocked` cannot be \"yes\"; write true or false");
    refused(
        "fault = 0x12345",
        "`fault` cannot be 0x12345; write a code such as 0x4310, up to eight of them, or \"none\"",
    );
    refused("digital = -1", "`digital` cannot be -1; write a number of 32 bits");
    refused("home_low = nan", "`home_low` cannot be nan; write a position, or \"none\"");
    refused("turn = true", "`turn` cannot be true; write a number from -1000000000 to 1000000000 (position units)");
    refused("power = 1", "`power` cannot be 1; write \"on\", \"off\" or \"cycle\"");
    refused("blockd = true", "no key `blockd`; write `blocked`");
    let nothing = Script::from_toml(&ServoModel::CIA_402, "[[step]]\nafter_ms = 1\n").unwrap_err();
    assert_eq!(nothing.to_string(), "line 1: a step that changes nothing; say what happens, such as `blocked = true`");
    assert!(Setting::new("brake", "true").unwrap_err().contains("there are supply, "));
}

#[test]
fn values_are_those_of_the_inputs() {
    let lines = "supply = false\nfault = 0x4310\nwarning = \"none\"\ndigital = 0x1_0000\nnegative_limit = -20.5\n\
                 home_low = -inf\nhome_high = 10\nindex = \"none\"\nprobe_2 = true";
    let script = Script::from_toml(&ServoModel::CIA_402, &format!("[[step]]\n{lines}\n")).unwrap();
    let mut bus = Bus::new();
    bus.follow(script);
    let inputs = bus.with(|servo| *servo.servo().inputs());
    assert_eq!((inputs.supply, inputs.faults, inputs.digital), (false, 0x4310.into(), 0x1_0000));
    assert!(inputs.warnings.is_empty());
    assert_eq!(
        (inputs.machine.negative_limit, inputs.machine.home_switch),
        (Some(-20.5), Some((f64::NEG_INFINITY, 10.0)))
    );
    assert_eq!((inputs.machine.index, inputs.probes), (None, [false, true]));
}

/// A table of buttons cannot request what the servo refuses, and shows the effect.
#[test]
fn each_input_takes_what_it_says() {
    let step = |line: &str| format!("[[step]]\n{line}\n");
    let after = |line: &str| {
        let script = Script::from_toml(&ServoModel::CIA_402, &step(line)).unwrap_or_else(|error| panic!("{error}"));
        let mut world = Inputs::default();
        if let Change::Input(setting) = &script.steps()[0].changes[0] {
            setting.apply(&mut world);
        }
        world
    };
    for input in inputs(&Inputs::default()) {
        let (values, wrong) = match &input.takes {
            Takes::Flag => (vec!["true".to_owned(), "false".to_owned()], "some"),
            Takes::Words(words) => (words.iter().map(ToString::to_string).collect(), "some"),
            Takes::Number(range, word) => {
                let values = [range.low, range.high].map(|number| number.to_string()).into_iter();
                (values.chain(word.map(str::to_owned)).collect(), "true")
            }
            Takes::Text(_) => panic!("{input:?}"),
        };
        for value in values {
            let world = after(&input.line(&value));
            if input.value.is_some() {
                let now = inputs(&world).into_iter().find(|now| now.name == input.name).unwrap();
                assert_eq!(after(&now.line(now.value.as_ref().unwrap())), world, "{} = {value}", input.name);
            }
        }
        assert!(Script::from_toml(&ServoModel::CIA_402, &step(&input.line(wrong))).is_err(), "{}", input.line(wrong));
    }
}
