//! Plants: the simulated devices of a machine on one bus.
#![cfg(unix)]

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use crate::common::{Run, folder, lexican_in};
use crate::simulation::Simulation;
use lexican_runtime::Duration;
use lexican_runtime::host::VirtualBus;
use lexican_simulation::{Files, Plant, SimulatedDevice, command};
use serde_json::{Value, json};

/// A machine with a drive and two sensors whose data sheet is not in the library.
const MACHINE: &str = "\
[node.feeder]
id = 5
sheet = 'siko/ag03-1'

[node.level]
id = 0x10
sheet = 'sensor.eds'
overlay = ['sensor.toml']

[node.spare]
id = 17
sheet = 'sensor.eds'

[simulate]
feeder.settings = { 6060 = 'profile velocity', 1017 = 'raw:100' }
level.settings = { 1017 = 100, '1018:04' = 43 }
spare.power = 'off'
";

/// What the sensor's data sheet lacks.
const OVERLAY: &str = "\
[overlay]\nformat = 1\n[object.\"2000\"]\nquantity = \"Span\"\n\
[quantity.Span]\nunits = [{ symbol = \"mm\", method = \"mm\", scale = \"1/10\" }]\n";

/// A folder with a machine.
fn machine(name: &str, text: &str) -> PathBuf {
    let folder = folder(name);
    std::fs::write(folder.join("machine.toml"), text).unwrap();
    std::fs::write(folder.join("sensor.eds"), include_str!("../sensor.eds")).unwrap();
    std::fs::write(folder.join("sensor.toml"), OVERLAY).unwrap();
    folder
}

/// The number of heartbeats of a node within two seconds.
fn heartbeats(name: &str, fault: &str, node: u8) -> usize {
    let folder = machine(name, &format!("{MACHINE}\n{fault}"));
    let run = lexican_in(&folder, &["monitor", "--bus", "sim:machine.toml", "--for", "2s", "--json"]);
    assert_eq!(run.code, Some(0), "{run}");
    let frames = run.stdout.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    frames.filter(|frame| frame["service"] == "heartbeat" && frame["node"] == node).count()
}

#[test]
fn a_plant_is_a_bus_of_every_command() {
    let folder = machine("plant-bus", MACHINE);
    let run =
        |command: &str, args: &[&str]| lexican_in(&folder, &[&[command, "--bus", "sim:machine.toml"], args].concat());
    let found = run("scan", &[]);
    found.on_stdout(0, "node   5  siko/ag03-1");
    assert!(found.stdout.contains("node  16") && !found.stdout.contains("node  17"), "{found}");
    // The data sheets of the plant, with their overlays, are used.
    run("read", &["--node", "5", "6060"]).on_stdout(0, "Modes of Operation = profile velocity (2)");
    run("read", &["--node", "5,16", "1017"]).on_stdout(0, "100");
    run("read", &["--node", "16", "1018:04"]).on_stdout(0, "43");
    run("read", &["--node", "0x10", "2000"]).on_stdout(0, "mm");
    run("read", &["6060"]).on_stderr(2, "which node?");
    run("statistics", &["--for", "2s"]).on_stdout(0, "  16  PRE-OPERATIONAL");
    run("conform", &["5", "--only", "301/7.2.4.3.6/1", "--boot-time", "1s"]).on_stdout(0, "1 case: 1 passed");
    run("boot", &["--node", "5=siko/ag03-1", "--node", "16=sensor.eds"]).on_stdout(0, "the network is ready");
    lexican_in(&folder, &["scan", "--bus", "sim:machine.toml?node=5"]).on_stderr(2, "which node-IDs its devices have");
}

#[test]
fn devices_on_terminals_are_controlled_one_by_one() {
    let folder = machine("plant-lines", MACHINE);
    let mut plant = Simulation::begin(&folder, &["machine.toml"]);
    plant.check("scan", &[], "node   5  siko/ag03-1");
    let answer = plant.asks("16: set 2000 \"7 mm\"", "answer");
    assert_eq!((&answer["node"], &answer["device_name"]), (&json!(16), &json!("level")), "{answer}");
    plant.check("read", &["--node", "16", "--device", &folder.join("sensor.eds").display().to_string(), "2000"], "7");
    let answer = plant.asks("feeder: get 6060", "answer");
    assert!(answer["text"].as_str().unwrap().ends_with("profile velocity (2)"), "{answer}");
    assert_eq!((&answer["node"], &answer["device_name"]), (&json!(5), &json!("feeder")));
    // The spare node was off.
    assert_eq!(plant.asks("spare: power on", "boot-up")["node"], 17);
    plant.check("scan", &[], "node  17");
    plant.check("write", &["--node", "5", "6060", "1"], "");
    assert_eq!(plant.until("written")["device_name"], "feeder");
    for (line, words) in [
        ("get 6041", "of which device?"),
        ("18: get 1000", "no device is 18; there are node 5 feeder, node 16 level, node 17 spare"),
        ("5: jump", "\"jump\" is no command"),
        ("16: blocked = true", "no inputs but its objects"),
    ] {
        let error = plant.asks(line, "error");
        assert!(error["text"].as_str().unwrap().contains(words), "{line}: {error}");
    }
    let mut answered = vec![plant.asks("status", "answer")["node"].clone()];
    answered.extend((0..2).map(|_| plant.until("answer")["node"].clone()));
    assert_eq!(answered, [json!(5), json!(16), json!(17)]);
    let (summary, code) = plant.interrupt();
    assert_eq!((&summary["node"], code), (&json!(5), Some(0)));
}

#[test]
fn events_in_words_name_their_node() {
    let folder = machine("plant-words", MACHINE);
    let run = lexican_in(&folder, &["simulate", "machine.toml", "--for", "0.3s"]);
    run.on_stdout(0, "node 5 feeder: boot-up\n");
    assert!(run.stdout.contains("node 16 level: boot-up\n") && !run.stdout.contains("spare: boot-up"), "{run}");
    assert!(run.stderr.contains("node 5 feeder: "), "{run}");
    assert!(run.stderr.contains("--device 5=siko/ag03-1 --device 16="), "{run}");
}

#[test]
fn frames_are_lost_repeated_and_delayed() {
    let sound = heartbeats("plant-sound", "", 5);
    assert!(sound > 15, "{sound}");
    let half = "[[fault]]\naction = 'lose'\nfrom = 'feeder'\nevery = 2\ncob-id = 0x705\n";
    // The boot-up message may have been lost or not.
    assert!(heartbeats("plant-half", half, 5).abs_diff(sound / 2) <= 1);
    assert_eq!(heartbeats("plant-half-other", half, 16), heartbeats("plant-sound-other", "", 16));
    assert_eq!(heartbeats("plant-lost", "[[fault]]\naction = 'lose'\nfrom = 'feeder'\n", 5), 0);
    let twice = "[[fault]]\naction = 'repeat'\ncob-id = 0x705\n";
    assert_eq!(heartbeats("plant-twice", twice, 5), 2 * sound);
    let late = "[[fault]]\naction = 'delay'\ndelay = '1 s'\nfrom = 'feeder'\n";
    assert!(heartbeats("plant-late", late, 5).abs_diff(sound / 2) <= 1);
}

#[test]
fn the_steps_of_a_plant_happen_to_their_drive() {
    let steps = "[[simulate.a.step]]\nat_ms = 200\nfault = 'D'\n[[simulate.a.step]]\nafter_ms = 100\nclear = 'all'\n";
    let node = "[node.a]\nid = 5\nsheet = 'siko/ag03-1'\n";
    let folder = machine("plant-steps", &format!("{node}{steps}"));
    let watch = |bus: &str| lexican_in(&folder, &["monitor", "--bus", bus, "--for", "1s"]);
    watch("sim:machine.toml").on_stdout(0, "EMCY");
    // The same script as a file.
    std::fs::write(folder.join("faults.toml"), steps.replace("simulate.a.step", "step")).unwrap();
    std::fs::write(folder.join("machine.toml"), format!("{node}[simulate.a]\nscript = 'faults.toml'\n")).unwrap();
    watch("sim:machine.toml").on_stdout(0, "EMCY");
}

#[test]
fn errors_are_shown_with_their_lines() {
    let folder = machine("plant-errors", "");
    let simulate = |text: &str| -> Run {
        std::fs::write(folder.join("machine.toml"), text).unwrap();
        lexican_in(&folder, &["simulate", "machine.toml", "--for", "0.1s"])
    };
    let node = "[node.a]\nid = 5\nsheet = 'siko/ag03-1'\n";
    let step = |node, key| format!("[[simulate.{node}.step]]\nat_ms = 5\n{key} = 'blocked'\n");
    let sensor = "[node.b]\nid = 6\nsheet = 'sensor.eds'\n";
    std::fs::write(folder.join("jam.toml"), step("a", "shift").replace("simulate.a.", "") + "\n").unwrap();
    for (more, place, words) in [
        // All mistakes that any machine can have, at once.
        ("hart = 1\n[simulate.a]\npower = 'no'", "machine.toml:4:1", "unknown field `hart`"),
        ("hart = 1\n[simulate.a]\npower = 'no'", "machine.toml:6:9", "unknown variant `no`"),
        // Mistakes that only a simulation finds.
        ("[simulate.a]\ninputs = [\n'blocked = maybe']", "machine.toml:6:1", "blocked"),
        (&(step("a", "shaft") + &step("a", "shift")), "machine.toml:7:1", "shift"),
        (&(sensor.to_owned() + &step("b", "shaft")), "machine.toml:7:1", "this device does not follow a script"),
        ("[simulate.a]\nscript = 'jam.toml'", "jam.toml:3:1", "shift"),
        ("[simulate.a.settings]\n6060 = 'raw:9'", "machine.toml:1:7", "the device refuses 6060:00 Modes of Operation"),
        ("[node.b]\nid = 6", "machine.toml:4:7", "b has no data sheet"),
        ("[node.b]\nid = 'none'\nsheet = 'siko/ag02'", "machine.toml:4:7", "this drive has no LSS"),
    ] {
        let run = simulate(&format!("{node}{more}\n"));
        run.on_stderr(2, place);
        run.on_stderr(2, words);
    }
    simulate("").on_stderr(2, "the machine has no nodes");
    simulate("").on_stderr(2, "error: machine.toml cannot be used: see above");
    lexican_in(&folder, &["simulate", "machine.toml", "--node", "7"]).on_stderr(2, "--node is of one device");
    lexican_in(&folder, &["simulate", "missing.toml"]).on_stderr(2, "cannot read missing.toml");
}

#[test]
fn the_example_runs() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let run = |args: &[&str]| lexican_in(&folder, args);
    let found = run(&["scan", "--bus", "sim:machines/line.toml"]);
    for node in ["node   5  siko/ag03-1", "node   6  kollmorgen/akd", "node   7", "node   8"] {
        found.on_stdout(0, node);
    }
    // The I/O node is lost, and comes back.
    let sheets = ["--node", "5=siko/ag03-1", "--node", "6=kollmorgen/akd", "--optional", "7"];
    let boot =
        [&["boot", "--bus", "sim:machines/line.toml", "--heartbeat", "100ms", "--for", "5s"], &sheets[..]].concat();
    let booted = run(&boot);
    booted.on_stdout(0, "the network is ready");
    booted.on_stdout(0, "node 7: is lost");
}

/// A program that contains the example has no files beside it.
#[test]
fn the_example_runs_from_texts_inside_a_program() {
    const FILES: Files<'_> = Files::Embedded(&[
        ("io.eds", include_str!("../../machines/io.eds")),
        ("encoder.eds", include_str!("../../machines/encoder.eds")),
    ]);
    let plant = Plant::parse(include_str!("../../machines/line.toml"), "line.toml", FILES).unwrap();
    assert!(plant.devices.iter().all(|device| device.sheet.errors().count() == 0));
    let bus = VirtualBus::with_bit_rate(plant.bit_rate_kbit);
    let segment = plant.segment(bus.now()).unwrap();
    let faults: Vec<_> = segment.faults().map(|(fault, _)| (fault.sender, fault.to_string())).collect();
    assert_eq!(faults, [(Some(2), "4 of 20 frames with COB-ID 707h are lost".to_owned())]);
    let segment = Arc::new(Mutex::new(segment));
    bus.attach(Arc::clone(&segment));
    bus.advance(Duration::from_secs(1));
    let mut segment = segment.lock().unwrap();
    let inputs = |device: &SimulatedDevice| device.inputs().iter().map(|input| input.name).collect::<Vec<_>>();
    let about: Vec<_> = segment.nodes().map(|it| (it.name().unwrap(), it.abilities(), inputs(it).len() > 10)).collect();
    assert_eq!(
        about,
        [
            ("feeder", "a drive that moves", true),
            ("cutter", "a drive that moves", true),
            ("io", "every object of its data sheet, and LSS", false),
            ("encoder", "every object of its data sheet, and LSS", false),
            ("left", "a drive that moves", true),
            ("right", "a drive that moves", true),
        ]
    );
    let encoder = segment.nodes_mut().find(|device| device.is_called("8")).unwrap();
    let position = command::parse("get \"Position value\"").unwrap().unwrap();
    assert_eq!(encoder.carry_out(bus.now(), &position).unwrap(), "6004:00 Position value = 123456 (0001E240h)");
}
