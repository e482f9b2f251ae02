//! `lexican drive`: on a simulation in the same process, and on a bus of pseudo-terminals, where the command ends in
//! every possible way.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

use crate::common::{Run, folder, lexican};
use crate::simulation::Simulation;
use serde_json::Value;

const AG03_1: &str = "sim:siko/ag03-1?node=5";
const AKD: &str = "sim:kollmorgen/akd?node=5";

/// Gives orders to a drive after power-on, and compares the exit code and the end of the output.
#[track_caller]
fn check(bus: &str, args: &[&str], code: i32, words: &str) -> Run {
    let run = lexican(&[&["drive", "--bus", bus, "5"], args].concat());
    match code {
        0 => run.on_stdout(0, words),
        _ => run.on_stderr(code, words),
    }
    run
}

#[test]
fn a_drive_does_what_is_ordered() {
    for (bus, args, words) in [
        (AG03_1, &["move-to", "5000", "--enable"][..], "travels from 0 increments to +5000 increments"),
        (
            AG03_1,
            &["move-to", "5000", "--enable"],
            "it has reached its target; SWITCH ON DISABLED, at +5000 increments",
        ),
        (AG03_1, &["step", "-300", "--enable"], "it has reached its target; SWITCH ON DISABLED, at -300 increments"),
        (AG03_1, &["step", "--enable"], "at +1600 increments"),
        (AG03_1, &["run", "60 rev/min", "--enable", "--for", "2s"], "it has run, and has been stopped"),
        (AG03_1, &["enable"], "it is enabled; OPERATION ENABLED"),
        (AG03_1, &["disable"], "it is disabled"),
        (AG03_1, &["stop"], "it stands"),
        (AG03_1, &["quick-stop"], "it stands"),
        (AG03_1, &["reset-fault"], "it was in no fault"),
        (AG03_1, &["watch", "--for", "2s"], "watching it"),
        (AKD, &["home", "35", "--enable"], "it has found its reference point"),
        (AKD, &["move-to", "-256", "--enable"], "at -256 units"),
        (AKD, &["run", "60", "--enable", "--for", "1s", "--protect", "0"], "it has run"),
    ] {
        check(bus, args, 0, words);
    }
}

/// A drive without 606Ch and vendor-ID, whose profile velocity is 0.
fn bare() -> String {
    let file = folder("drive-bare").join("bare.eds");
    let objects = [
        "1000 7 ro 0x20192",
        "6040 6 rw 0",
        "6041 6 ro 0",
        "6060 2 rw 0",
        "6061 2 ro 0",
        "6064 4 ro 0",
        "607A 4 rw 0",
        "6081 7 rw 0",
        "6502 7 ro 1",
    ];
    let mut eds = format!("[DeviceInfo]\nProductName=Bare\n[OptionalObjects]\nSupportedObjects={}\n", objects.len());
    for (object, number) in objects.iter().zip(1..) {
        eds += &format!("{number}=0x{}\n", &object[..4]);
    }
    for object in objects {
        let words: Vec<&str> = object.split(' ').collect();
        eds += &format!("[{}]\nParameterName=Value\nDataType={}\n", words[0], words[1]);
        eds += &format!("AccessType={}\nDefaultValue={}\n", words[2], words[3]);
    }
    std::fs::write(&file, eds).unwrap();
    file.display().to_string()
}

#[test]
fn explain_says_what_to_set_and_that_helps() {
    let eds = bare();
    let bus = format!("sim:{eds}?node=5");
    let run = lexican(&["drive", "--bus", &bus, "5", "--explain"]);
    run.on_stdout(1, "set      6081:00 (profile velocity) is 0: the drive would take an order, and stand");
    run.on_stdout(1, "set it: `--velocity 1000` with the order");
    run.on_stdout(1, "instead  there is no 606Ch (actual velocity) that a driver can use");
    run.on_stdout(1, "instead  neither 1018h:01 nor `VendorNumber` has a vendor-ID");
    run.on_stdout(1, "ready    6040:00 (control word) is UNSIGNED16");
    run.on_stdout(1, "node 5: it can be moved once it is set");
    check(&bus, &["move-to", "500", "--enable"], 1, "its profile velocity (6081:00) is 0");
    check(
        &bus,
        &["move-to", "500", "--enable"],
        1,
        "give it a profile velocity that fits the machine (6081h; --velocity",
    );
    let run = check(&bus, &["move-to", "500", "--enable", "--velocity", "1000"], 0, "it has reached its target");
    run.on_stderr(0, "there is no 606Ch (actual velocity)");
    let run = lexican(&["drive", "--bus", AG03_1, "5", "--explain", "--json"]);
    run.on_stdout(0, "\"outcome\":\"ready\"");
    check(AG03_1, &["move-to", "500", "--enable", "--velocity", "9"], 2, "is not known");
    check(&bus, &[], 2, "ORDER");
}

#[test]
fn explain_names_what_an_overlay_corrects_and_an_overlay_corrects_it() {
    let eds = bare();
    let bus = format!("sim:{eds}?node=5");
    let text = std::fs::read_to_string(&eds).unwrap().replace(
        "[6040]\nParameterName=Value\nDataType=6\nAccessType=rw",
        "[6040]\nParameterName=Value\nDataType=6\nAccessType=ro",
    );
    let wrong = folder("drive-wrong").join("wrong.eds");
    std::fs::write(&wrong, text).unwrap();
    let wrong = wrong.display().to_string();
    let run = lexican(&["drive", "--bus", &bus, "5", "--explain", "--device", &wrong]);
    run.on_stdout(2, "missing  6040 (control word) is ro, and cannot be written");
    run.on_stdout(2, "node 5: it cannot be moved");
    let overlay = folder("drive-overlay").join("mend.toml");
    std::fs::write(&overlay, "[overlay]\nformat = 1\n[object.\"6040\"]\naccess = \"rw\"\n").unwrap();
    let overlay = overlay.display().to_string();
    let mended = ["--device", &wrong, "--overlay", &overlay, "--velocity", "1000", "--enable"];
    check(&bus, &[&["move-to", "500"][..], &mended].concat(), 0, "it has reached its target");
}

#[test]
fn a_sheet_of_another_vendor_is_not_asked_for_again() {
    let bus = format!("sim:{}?node=5", bare());
    check(&bus, &["enable", "--device", "kollmorgen/akd"], 2, "name the data sheet of this device");
}

#[test]
fn progress_is_printed_in_the_units_of_the_drive_and_as_json() {
    let run = check(AG03_1, &["move-to", "5000", "--enable", "--every", "1s"], 0, "velocity +30 rev/min");
    assert!((8..=11).contains(&run.stdout.lines().count()), "a line per second: {run}");
    let run = check(AG03_1, &["move-to", "5000", "--enable", "--json"], 0, "");
    let events: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [order, look, .., end] = &events[..] else { panic!("{run}") };
    assert_eq!((&order["event"], &order["order"], &order["value"]), (&"order".into(), &"move-to".into(), &5000.into()));
    assert_eq!((&look["event"], &look["state"]), (&"progress".into(), &"OPERATION ENABLED".into()));
    assert_eq!((&end["event"], &end["outcome"], &end["velocity"]), (&"end".into(), &"reached".into(), &0.into()));
    assert!((end["position"].as_i64().unwrap() - 5000).abs() <= 5, "{end}");
}

#[test]
fn what_is_refused_has_a_reason_and_a_remedy() {
    for (bus, args, words) in [
        (AG03_1, &["move-to", "5000"][..], "not in OPERATION ENABLED"),
        (AG03_1, &["move-to", "5000"], "`lexican drive 5 enable`"),
        (AG03_1, &["run", "60"], "not in OPERATION ENABLED"),
        (AG03_1, &["run", "20000", "--enable"], "is more than its gear allows"),
        (AG03_1, &["move-to", "2147483647", "--enable"], "above the limits of the data sheet"),
        (AG03_1, &["home", "--enable"], "has no homing mode"),
        (AG03_1, &["move-to", "5000", "--enable", "--within", "0.5s"], "not finished in time; it has been stopped"),
        (AKD, &["home", "--enable"], "its methods are 1, 2, 8"),
        (AKD, &["step", "--enable"], "has no inching operation"),
    ] {
        check(bus, args, 1, words);
    }
    let refused = check(AG03_1, &["move-to", "5000", "--json"], 1, "");
    assert!(refused.stdout.contains("\"outcome\":\"refused\""), "{refused}");
}

#[test]
fn what_cannot_be_ordered_is_not_sent() {
    for (args, words) in [
        (&["move-to"][..], "where to?"),
        (&["run"], "how fast?"),
        (&["stop", "5000"], "takes no value"),
        (&["move-to", "5 mm"], "\"5 mm\" is not in increments"),
        (&["home", "much"], "is no homing method"),
        (&["move-to", "5000", "--device", "none.eds"], "none.eds"),
        (&["fly"], "[possible values: enable, disable, reset-fault, move-to"),
    ] {
        check(AG03_1, args, 2, words);
    }
    lexican(&["drive", "--bus", AG03_1, "6", "stop"]).on_stderr(2, "no answer");
}

#[test]
fn any_data_sheet_of_a_drive_is_moved_in_units_of_an_overlay() {
    let folder = folder("drive-described");
    let overlay = "[object.\"607A\"]\nquantity = \"Position\"\n[object.\"6064\"]\nquantity = \"Position\"\n\
                   [quantity.Position]\ndescription = \"A position.\"\n\
                   units = [{ symbol = \"mm\", method = \"millimetres\", scale = \"1/100\" }]\n";
    std::fs::write(folder.join("units.toml"), overlay).unwrap();
    let sheet = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/downstream/servo/eds/servo.eds");
    let bus = format!("sim:{sheet}?node=5");
    let overlay = folder.join("units.toml").display().to_string();
    check(&bus, &["move-to", "5 mm", "--enable", "--overlay", &overlay], 0, "it has reached its target");
    check(&bus, &["move-to", "5 mm", "--enable", "--overlay", &overlay], 0, "at +5.00 mm");
    check(&bus, &["move-to", "5", "--enable", "--overlay", &overlay], 2, "raw:5");
    let sensor = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/sensor.eds");
    check(&format!("sim:{sensor}?node=5"), &["stop"], 2, "there is no 6040h (control word)");
}

/// A command that moves a drive on a bus of pseudo-terminals, while another command observes it.
struct Moving {
    drive: Simulation,
    command: Child,
    /// The last line of its output.
    last: JoinHandle<Value>,
}

/// A command that has ended.
struct Ended {
    drive: Simulation,
    code: Option<i32>,
    stderr: String,
    last: Value,
}

impl Moving {
    /// Starts the command, and waits until the drive moves.
    fn start(device: &str, name: &str, args: &[&str]) -> Self {
        let folder = folder(name);
        let drive = Simulation::begin(&folder, &[device, "--node", "5", "--bus", "pty:2"]);
        let drive = drive.on_terminals_of_its_own(&folder);
        // A shell lets its background jobs ignore SIGINT, and they pass this on to the processes that they start.
        let mut command = Command::new("env")
            .args(["--default-signal=INT", env!("CARGO_BIN_EXE_lexican"), "drive", "--bus", &drive.buses[0], "5"])
            .args(args)
            .args(["--enable", "--json", "--every", "0"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(command.stdout.take().unwrap()).lines();
        let (sender, begun) = std::sync::mpsc::channel();
        // All output is read, so that the command never waits for its reader.
        let last = std::thread::spawn(move || {
            let mut last = Value::Null;
            for line in lines.map_while(Result::ok) {
                last = serde_json::from_str(&line).unwrap();
                if last["velocity"].as_i64().is_some_and(|velocity| velocity != 0) {
                    let _ = sender.send(());
                }
            }
            last
        });
        begun.recv().expect("it moves");
        Moving { drive, command, last }
    }

    fn signal(self, signal: &str) -> Ended {
        let status = Command::new("kill").args(["-s", signal, &self.command.id().to_string()]).status();
        assert!(status.unwrap().success());
        self.end()
    }

    fn end(mut self) -> Ended {
        let mut stderr = String::new();
        self.command.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        let (code, last) = (self.command.wait().unwrap().code(), self.last.join().unwrap());
        Ended { drive: self.drive, code, stderr, last }
    }
}

/// The state of the drive after some seconds, observed by another command.
fn state_after(drive: &Simulation, time: &str) -> Value {
    let run = lexican(&["drive", "--bus", &drive.buses[1], "5", "watch", "--for", time, "--json"]);
    serde_json::from_str(run.stdout.lines().last().expect("it has been watched")).unwrap()
}

#[test]
fn a_signal_stops_the_drive() {
    for (signal, args, code) in [
        ("INT", &["move-to", "1000000"][..], 1),
        ("TERM", &["run", "60"], 0),
        ("HUP", &["run", "60", "--for", "60s"], 0),
    ] {
        let moving = Moving::start("siko/ag03-1", "drive-signal", args);
        let Ended { drive, code: exit, stderr, last } = moving.signal(signal);
        assert_eq!((exit, &last["outcome"]), (Some(code), &"cancelled".into()), "{signal}: {stderr}");
        let after = state_after(&drive, "0");
        assert_eq!((&after["velocity"], &after["state"]), (&0.into(), &"SWITCH ON DISABLED".into()), "{signal}");
        // Its life guarding is off again.
        drive.check("read", &["--node", "5", "100C"], "= 0");
    }
}

#[test]
fn a_drive_whose_command_is_killed_notices_if_it_is_protected() {
    for (device, protect, stands) in
        [("siko/ag03-1", "1s", true), ("kollmorgen/akd", "1s", true), ("siko/ag03-1", "0", false)]
    {
        let moving = Moving::start(device, "drive-kill", &["run", "60", "--protect", protect]);
        let Ended { drive, code, .. } = moving.signal("KILL");
        assert_eq!(code, None);
        let after = state_after(&drive, "3s");
        assert_eq!(after["velocity"] == 0, stands, "{device} {protect}: {after}");
        assert_eq!(after["state"] != "OPERATION ENABLED", stands, "{device} {protect}: {after}");
        // The next command stops the drive.
        drive.check("drive", &["5", "stop"], "it stands");
    }
}

#[test]
fn a_lost_bus_is_said_loudly() {
    let mut moving = Moving::start("siko/ag03-1", "drive-lost", &["run", "60"]);
    moving.drive.vanish();
    let Ended { code, stderr, last, .. } = moving.end();
    assert_eq!((code, &last["outcome"]), (Some(2), &"may-be-moving".into()), "{stderr}");
    assert!(stderr.contains("THE DRIVE AT NODE 5 MAY STILL BE MOVING"), "{stderr}");
    assert!(stderr.contains("emergency stop") && stderr.contains("life guarding"), "{stderr}");
}

#[test]
fn what_else_stops_the_drive_is_said_in_words() {
    let check = |ended: &Ended, code: i32, outcome: &str, words: &str| {
        let Ended { last, stderr, .. } = ended;
        assert_eq!((ended.code, &last["outcome"]), (Some(code), &outcome.into()), "{last} {stderr}");
        let said = format!("{last} {stderr}");
        assert!(said.contains(words), "{said}");
    };
    for (line, outcome, words) in
        [("fault = \"D\"", "fault", "output stage too hot"), ("shaft = \"blocked\"", "fault", "drive shaft blocked")]
    {
        let mut moving = Moving::start("siko/ag03-1", "drive-stopped", &["move-to", "1000000"]);
        writeln!(moving.drive.stdin, "{line}").unwrap();
        check(&moving.end(), 1, outcome, words);
    }
    // Another manager stops the drive.
    for (args, order, outcome, words) in [
        (&["move-to", "1000000"][..], "quick-stop", "interrupted", "quick stop"),
        (&["move-to", "1000000"], "stop", "stalled", "which other manager has stopped it"),
        (&["run", "60"], "stop", "foreign-order", "stop the other manager"),
    ] {
        let moving = Moving::start("siko/ag03-1", "drive-foreign", args);
        lexican(&["drive", "--bus", &moving.drive.buses[1], "5", order]).on_stdout(0, "it stands");
        check(&moving.end(), 1, outcome, words);
    }
    // Its power comes back, and the drive is no longer enabled.
    let mut moving = Moving::start("siko/ag03-1", "drive-power", &["move-to", "1000000"]);
    moving.drive.asks("power off", "state");
    moving.drive.asks("power on", "state");
    check(&moving.end(), 1, "restarted", "it has restarted");
}
