//! Plants: several simulated devices on one bus, by their file.
#![cfg(unix)]

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use crate::common::{Run, folder, lexican_in};
use crate::simulation::Simulation;
use lexican_runtime::Duration;
use lexican_runtime::host::VirtualBus;
use lexican_simulation::{Files, Plant, SimulatedDevice, command};
use serde_json::{Value, json};

/// A drive and two sensors of a data sheet that the library does not have.
const PLANT: &str = "\
[[node]]
id = 5
name = 'feeder'
device = 'siko/ag03-1'
settings = ['6060 = profile velocity', '1017 = raw:100']

[[node]]
id = 0x10
device = 'sensor.eds'
overlay = ['sensor.toml']
settings = ['1017 = 100']

[[node]]
id = 17
name = 'spare'
device = 'sensor.eds'
power = 'off'
";

/// What the data sheet of the sensor does not say.
const OVERLAY: &str = "\
[overlay]\nformat = 1\n[object.\"2000\"]\nquantity = \"Span\"\n\
[quantity.Span]\nunits = [{ symbol = \"mm\", method = \"mm\", scale = \"1/10\" }]\n";

/// A folder with a plant.
fn plant(name: &str, text: &str) -> PathBuf {
    let folder = folder(name);
    std::fs::write(folder.join("plant.toml"), text).unwrap();
    std::fs::write(folder.join("sensor.eds"), include_str!("../sensor.eds")).unwrap();
    std::fs::write(folder.join("sensor.toml"), OVERLAY).unwrap();
    folder
}

/// The heartbeats of a node within two seconds: how many there are.
fn heartbeats(name: &str, fault: &str, node: u8) -> usize {
    let folder = plant(name, &format!("{PLANT}\n{fault}"));
    let run = lexican_in(&folder, &["monitor", "--bus", "sim:plant.toml", "--for", "2s", "--json"]);
    assert_eq!(run.code, Some(0), "{run}");
    let frames = run.stdout.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    frames.filter(|frame| frame["service"] == "heartbeat" && frame["node"] == node).count()
}

#[test]
fn a_plant_is_a_bus_of_every_command() {
    let folder = plant("plant-bus", PLANT);
    let run =
        |command: &str, args: &[&str]| lexican_in(&folder, &[&[command, "--bus", "sim:plant.toml"], args].concat());
    let found = run("scan", &[]);
    found.on_stdout(0, "node   5  siko/ag03-1");
    assert!(found.stdout.contains("node  16") && !found.stdout.contains("node  17"), "{found}");
    // The data sheets are those of the plant, with their overlays.
    run("read", &["--node", "5", "6060"]).on_stdout(0, "Modes of Operation = profile velocity (2)");
    run("read", &["--node", "5,16", "1017"]).on_stdout(0, "100");
    run("read", &["--node", "0x10", "2000"]).on_stdout(0, "mm");
    run("read", &["6060"]).on_stderr(2, "which node?");
    run("statistics", &["--for", "2s"]).on_stdout(0, "  16  PRE-OPERATIONAL");
    run("conform", &["5", "--only", "301/7.2.4.3.6/1", "--boot-time", "1s"]).on_stdout(0, "1 case: 1 passed");
    run("boot", &["--node", "5=siko/ag03-1", "--node", "16=sensor.eds"]).on_stdout(0, "the network is ready");
    lexican_in(&folder, &["scan", "--bus", "sim:plant.toml?node=5"]).on_stderr(2, "which node-IDs its devices have");
}

#[test]
fn devices_on_terminals_are_controlled_one_by_one() {
    let folder = plant("plant-lines", PLANT);
    let mut plant = Simulation::begin(&folder, &["plant.toml"]);
    plant.check("scan", &[], "node   5  siko/ag03-1");
    let answer = plant.asks("16: set 2000 \"7 mm\"", "answer");
    assert_eq!((&answer["node"], answer.get("device_name")), (&json!(16), None), "{answer}");
    plant.check("read", &["--node", "16", "--device", &folder.join("sensor.eds").display().to_string(), "2000"], "7");
    let answer = plant.asks("feeder: get 6060", "answer");
    assert!(answer["text"].as_str().unwrap().ends_with("profile velocity (2)"), "{answer}");
    assert_eq!((&answer["node"], &answer["device_name"]), (&json!(5), &json!("feeder")));
    // It was off.
    assert_eq!(plant.asks("spare: power on", "boot-up")["node"], 17);
    plant.check("scan", &[], "node  17");
    plant.check("write", &["--node", "5", "6060", "1"], "");
    assert_eq!(plant.until("written")["device_name"], "feeder");
    for (line, words) in [
        ("get 6041", "of which device?"),
        ("18: get 1000", "no device is 18; there are node 5 feeder, node 16, node 17 spare"),
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
    let folder = plant("plant-words", PLANT);
    let run = lexican_in(&folder, &["simulate", "plant.toml", "--for", "0.3s"]);
    run.on_stdout(0, "node 5 feeder: boot-up\n");
    assert!(run.stdout.contains("node 16: boot-up\n") && !run.stdout.contains("spare: boot-up"), "{run}");
    assert!(run.stderr.contains("node 5 feeder: "), "{run}");
    assert!(run.stderr.contains("--device 5=siko/ag03-1 --device 16="), "{run}");
}

#[test]
fn frames_are_lost_repeated_and_delayed() {
    let sound = heartbeats("plant-sound", "", 5);
    assert!(sound > 15, "{sound}");
    let half = "[[fault]]\naction = 'lose'\nfrom = 'feeder'\nevery = 2\ncob-id = 0x705\n";
    // The boot-up message was lost or not.
    assert!(heartbeats("plant-half", half, 5).abs_diff(sound / 2) <= 1);
    assert_eq!(heartbeats("plant-half-other", half, 16), heartbeats("plant-sound-other", "", 16));
    assert_eq!(heartbeats("plant-lost", "[[fault]]\naction = 'lose'\nfrom = 5\n", 5), 0);
    let twice = "[[fault]]\naction = 'repeat'\ncob-id = 0x705\n";
    assert_eq!(heartbeats("plant-twice", twice, 5), 2 * sound);
    let late = "[[fault]]\naction = 'delay'\ndelay = 1000\nfrom = 'feeder'\n";
    assert!(heartbeats("plant-late", late, 5).abs_diff(sound / 2) <= 1);
}

#[test]
fn the_steps_of_a_plant_happen_to_their_drive() {
    let steps = "[[node.step]]\nat_ms = 200\nfault = 'D'\n[[node.step]]\nafter_ms = 100\nclear = 'all'\n";
    let node = "[[node]]\nid = 5\ndevice = 'siko/ag03-1'\n";
    let folder = plant("plant-steps", &format!("{node}{steps}"));
    let watch = |bus: &str| lexican_in(&folder, &["monitor", "--bus", bus, "--for", "1s"]);
    watch("sim:plant.toml").on_stdout(0, "EMCY");
    // The same script in a file of its own.
    std::fs::write(folder.join("faults.toml"), steps.replace("node.step", "step")).unwrap();
    std::fs::write(folder.join("plant.toml"), format!("{node}script = 'faults.toml'\n")).unwrap();
    watch("sim:plant.toml").on_stdout(0, "EMCY");
}

#[test]
fn errors_name_the_file_the_line_and_the_device() {
    let folder = plant("plant-errors", "");
    let simulate = |text: &str| -> Run {
        std::fs::write(folder.join("plant.toml"), text).unwrap();
        lexican_in(&folder, &["simulate", "plant.toml", "--for", "0.1s"])
    };
    let node = "[[node]]\nid = 5\ndevice = 'siko/ag03-1'\n";
    let sensor = "[[node]]\nid = 6\nname = 'io'\ndevice = 'sensor.eds'\n";
    for (more, words) in [
        ("nmae = 'x'", "plant.toml:4: unknown field `nmae`"),
        ("settings = [\n'1017 = 5',\n'2FFF = 1']", "plant.toml:6: node 5: "),
        ("settings = ['6060']", "plant.toml:4: node 5: \"6060\" is no OBJECT = VALUE"),
        ("settings = ['6060 = 300']", "plant.toml:4: node 5: "),
        ("inputs = ['blocked = maybe']", "plant.toml:4: node 5: "),
        ("script = 'missing.toml'", "plant.toml:4: node 5: cannot read"),
        ("[[node.step]]\nat_ms = 5\nshaft = 'blocked'\n\n[[node.step]]\nat_ms = 6\nshift = 'free'", "plant.toml:8: "),
        ("script = 'x.toml'\n[[node.step]]\nblocked = true", "has either a script or steps"),
        ("name = '7'", "plant.toml:4: 7: this cannot be the name of a device"),
        (node, "plant.toml:5: there are two devices with node-ID 5"),
        ("[[node]]\nid = 200\ndevice = 'siko/ag02'", "plant.toml:5: 200 is not a node-ID"),
        ("[[node]]\nid = 'some'\ndevice = 'siko/ag02'", "plant.toml:5: \"some\" is no node-ID"),
        ("[[node]]\nid = 8\ndevice = 'siko/ag2'", "plant.toml:6: node 8: no file and no known device"),
        (&format!("{sensor}settings = ['2FFF = 1']"), "plant.toml:8: io: the data sheet has no 2FFF:00"),
        (&format!("{sensor}[[node.step]]\nblocked = true"), "plant.toml:8: this device does not follow a script"),
        ("[[fault]]\naction = 'lose'\nfrom = 'io'", "plant.toml:6: \"io\" is none of the devices"),
        ("[[fault]]\naction = 'lose'\nfrom = 7", "plant.toml:6: node 7 is none of the devices"),
        ("[[fault]]\naction = 'delay'", "plant.toml:5: a delay needs its time"),
        ("[[fault]]\naction = 'lose'\ndelay = 5", "plant.toml:5: the time of a delay"),
        ("[[fault]]\naction = 'lose'\nevery = 0", "plant.toml:6: "),
        ("[[fault]]\naction = 'lose'\nevery = 2\nin-a-row = 3", "plant.toml:5: there cannot be more in a row"),
        ("[[fault]]\naction = 'lose'\ncob-id = 0x20000000", "plant.toml:6: 20000000h is no COB-ID"),
        ("[[fault]]\naction = 'burn'", "plant.toml:5: unknown variant `burn`"),
    ] {
        simulate(&format!("{node}{more}\n")).on_stderr(2, words);
    }
    simulate("").on_stderr(2, "plant.toml: it has no devices");
    simulate("bit-rate = 0\n").on_stderr(2, "plant.toml:1: ");
    lexican_in(&folder, &["simulate", "plant.toml", "--node", "7"]).on_stderr(2, "--node is of one device");
    lexican_in(&folder, &["simulate", "missing.toml"]).on_stderr(2, "cannot read missing.toml");
}

#[test]
fn the_example_runs() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let run = |args: &[&str]| lexican_in(&folder, args);
    let found = run(&["scan", "--bus", "sim:plants/line.toml"]);
    for node in ["node   5  siko/ag03-1", "node   6  kollmorgen/akd", "node   7", "node   8"] {
        found.on_stdout(0, node);
    }
    // The I/O is lost, and comes back.
    let sheets = ["--node", "5=siko/ag03-1", "--node", "6=kollmorgen/akd", "--optional", "7"];
    let boot =
        [&["boot", "--bus", "sim:plants/line.toml", "--heartbeat", "100ms", "--for", "5s"], &sheets[..]].concat();
    let booted = run(&boot);
    booted.on_stdout(0, "the network is ready");
    booted.on_stdout(0, "node 7: is lost");
}

/// A program that brings the example has no files beside it.
#[test]
fn the_example_runs_from_texts_inside_a_program() {
    const FILES: Files<'_> = Files::Embedded(&[
        ("io.eds", include_str!("../../plants/io.eds")),
        ("encoder.eds", include_str!("../../plants/encoder.eds")),
    ]);
    let plant = Plant::parse(include_str!("../../plants/line.toml"), "line.toml", FILES).unwrap();
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
