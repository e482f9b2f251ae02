//! Simulated devices on a bus of pseudo-terminals: several commands at once with one device, on any computer.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{folder, lexican, lexican_in};
use crate::simulation::Simulation;
use lexican_runtime::host::Link;
use lexican_runtime::host::slcan::{Settings, Slcan};
use lexican_runtime::{CobId, Frame};
use serde_json::{Value, json};

/// A data sheet with everything that the tests need: stored parameters, an EMCY, a mapped object.
const SHEET: &str = include_str!("../sensor.eds");

fn sensor(name: &str) -> std::path::PathBuf {
    let folder = folder(name);
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    folder
}

#[test]
fn a_drive_at_its_serial_interface_is_a_node_for_every_command() {
    let mut drive = Simulation::begin(&folder("sim-serial"), &["siko/ag02", "--bus", "serial"]);
    assert!(drive.buses[0].starts_with("serial:/dev/"), "{:?}", drive.buses);
    drive.check("scan", &[], "node   1  siko/ag02, CiA 402");
    drive.check("write", &["2413", "loop plus"], "2413:00 Pos Type = loop plus (1)");
    drive.check("read", &["2413", "100A", "6041"], "322E3030h \"2.00\"");
    drive.run("read", &["100C"]).on_stderr(1, "0602 0000");
    drive.run("write", &["6091:01", "20000"]).on_stderr(1, "2");
    drive.run("check", &[]).on_stdout(1, "node 1: 98 entries, 2 are not as the data sheet says");
    drive.check("nmt start --node 1", &["--wait", "2s"], "OPERATIONAL");
    drive.check("monitor --for 1s", &[], "boot-up node 1");
    let machine = folder("sim-serial").join("machine.toml");
    let text =
        "[node.rail]\nid = 1\nsheet = \"siko/ag02\"\nsettings = { 2413 = \"loop minus\" }\nheartbeat = \"100ms\"\n";
    std::fs::write(&machine, text).unwrap();
    let machine = machine.display().to_string();
    drive.check("boot", &[&machine, "--for", "1s"], "node 1: has booted\nthe network is ready\n");
    drive.check("read", &["2413"], "loop minus");
    drive.check("boot", &["--node", "1", "--guarding", "100ms", "--for", "1s"], "the network is ready\n");
    drive.check("drive", &["1", "move-to", "300", "--enable"], "it has reached its target");
    // No drive, another drive, and wrong parameters; then another baud rate and another node-ID.
    let refused = |suffix: &str, words: &str| {
        let url = format!("{}{suffix}", drive.buses[0].replace("?device=siko/ag02", ""));
        lexican(&["read", "--bus", &url, "6064"]).on_stderr(2, words);
    };
    refused("", "?device=siko/ag02");
    refused("?device=siko/ag03-1", "no serial interface of siko/ag03-1");
    refused("?device=siko/ag02&baud=fast", "baud=fast is not a number");
    refused("?device=siko/ag02&speed=1", "there is device, baud, echo, node");
    refused("?device=siko/ag02&echo=2", "echo=2 is not on or off");
    let url = format!("{}&node=7&baud=19200", drive.buses[0]);
    lexican(&["read", "--bus", &url, "--node", "7", "2413"]).on_stdout(0, "loop minus");
    // A line on stdin switches the drive off.
    drive.asks("power off", "state");
    drive.run("read", &["6064"]).on_stderr(2, "no answer");
}

#[test]
fn a_device_without_a_serial_interface_is_not_put_on_one() {
    lexican(&["simulate", "siko/ag03-1", "--bus", "serial"]).on_stderr(2, "siko/ag02");
    lexican(&["simulate", "siko/ag02", "--bus", "serial:/dev/ttyUSB0?device=siko/ag02"]).on_stderr(2, "--bus serial");
}

#[test]
fn several_commands_work_with_one_drive() {
    let mut drive = Simulation::begin(&folder("sim-drive"), &["siko/ag03-1", "--node", "5"]);
    assert_eq!(drive.buses.len(), 2);
    drive.check("scan", &[], "node   5  siko/ag03-1");
    drive.check("write", &["--node", "5", "6060", "profile velocity"], "profile velocity (2)");
    let written = drive.until("written");
    assert_eq!((&written["address"], &written["value"], &written["node"]), (&json!("6060:00"), &json!(2), &json!(5)));
    // The next command finds the same drive, and recognises it by its identity.
    let run = drive.run("read", &["--node", "5", "6060"]);
    assert!(run.stdout.contains("Modes of Operation = profile velocity (2)"), "{run}");
    assert!(run.stderr.contains("node 5 is a siko/ag03-1 by its identity"), "{run}");
    drive.check("read", &["--node", "5", "--device", "none", "6060"], "6060:00 = 02");
    drive.check("nmt", &["start", "--node", "5"], "OPERATIONAL");
    assert_eq!(drive.until("nmt")["command"], "start");
    assert_eq!(drive.until("state")["state"], "OPERATIONAL");
    let refused = drive.run("write", &["--node", "5", "--force", "1018:01", "1"]);
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert_eq!(drive.until("refused")["abort_code"], "06010002");
    let (summary, code) = drive.interrupt();
    assert_eq!((code, &summary["writes"], &summary["refusals"]), (Some(0), &json!(1), &json!(1)));
}

#[test]
fn a_drive_on_a_terminal_takes_the_conformance_test() {
    let drive = Simulation::begin(&folder("sim-conform"), &["kollmorgen/akd", "--node", "5", "--bus", "pty"]);
    let only = ["--only", "402/8.1/4,402/607Ah/2", "--allow", "motion", "--boot-time", "1s"];
    let test = ["conform", "--bus", &drive.buses[0], "5", "--device", "kollmorgen/akd"];
    lexican(&[&test[..], &only].concat()).on_stdout(0, "2 cases: 2 passed");
}

#[test]
fn a_conformance_test_whose_bus_is_gone_says_so_and_ends() {
    let folder = folder("sim-conform-lost");
    let drive = Simulation::begin(&folder, &["siko/ag03-1", "--node", "5", "--bus", "pty"]);
    let mut drive = drive.on_terminals_of_its_own(&folder);
    let test = Command::new(env!("CARGO_BIN_EXE_lexican"))
        .args(["conform", "--bus", &drive.buses[0], "5", "--device", "siko/ag03-1", "--reconnect", "1s"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The first case has begun with a reset.
    drive.until("nmt");
    drive.vanish();
    let output = test.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("error: the bus was lost: "), "{stderr}");
}

#[test]
fn one_terminal_hears_what_happens_on_the_other() {
    let drive = Simulation::begin(&folder("sim-monitor"), &["siko/ag03-1", "--node", "5", "--bus", "pty:2"]);
    let watching = drive.buses[1].clone();
    let mut monitor = Command::new(env!("CARGO_BIN_EXE_lexican"))
        .args(["monitor", "--bus", &watching, "--device", "5=siko/ag03-1", "--json", "--for", "60s"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines();
    let mut hears = |what: &str| {
        let line = lines.find(|line| line.as_ref().unwrap().contains(what));
        serde_json::from_str::<Value>(&line.expect("it listens for a minute").unwrap()).unwrap()
    };
    // The monitor is ready after the first heartbeat.
    drive.check("write", &["--node", "5", "1017", "raw:100"], "");
    hears("heartbeat");
    drive.check("write", &["--node", "5", "6060", "profile velocity"], "");
    let heard = hears("Modes of Operation");
    let _ = monitor.kill();
    let _ = monitor.wait();
    assert_eq!((&heard["service"], &heard["sdo"]["value"]), (&json!("SDO request"), &json!(2)));
}

#[test]
fn a_monitor_reports_that_its_bus_is_gone_and_identifies_nodes_that_it_hears() {
    let folder = folder("sim-removed");
    let mut drive = Simulation::begin(&folder, &["siko/ag03-1", "--node", "5"]).on_terminals_of_its_own(&folder);
    drive.check("write", &["--node", "5", "1017", "raw:100"], "");
    let mut monitor = Command::new(env!("CARGO_BIN_EXE_lexican"))
        .args(["monitor", "--bus", &drive.buses[1], "--identify", "--json", "--for", "60s"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines();
    let mut until = |event: &str| {
        let mut asked = Vec::new();
        let found = lines.by_ref().map(|line| serde_json::from_str::<Value>(&line.unwrap()).unwrap()).find(|json| {
            asked.extend((json["service"] == "SDO request").then(|| json["node"].clone()));
            json["event"] == event
        });
        (found.expect("it listens for a minute"), asked)
    };
    let (identified, asked) = until("identified");
    assert_eq!((&identified["device"], asked), (&json!("siko/ag03-1"), vec![json!(5), json!(5)]));
    drive.vanish();
    drop(drive);
    assert_eq!(until("bus").0["state"], "removed");
    let _ = monitor.kill();
    let _ = monitor.wait();
}

#[test]
fn a_simulated_device_reports_another_node_with_its_node_id() {
    let mut sensor = Simulation::begin(&sensor("sim-duplicate"), &["sensor.eds", "--node", "7"]);
    let path = sensor.buses[0].strip_prefix("slcan:").unwrap();
    let mut link = Slcan::open(path, Settings::default()).unwrap();
    link.send(&Frame::from_array(CobId::standard(0x707).unwrap(), [0x05])).unwrap();
    let event = sensor.until("two-nodes");
    assert!(event["text"].as_str().unwrap().contains("another node 7"), "{event}");
}

#[test]
fn an_inconsistent_configuration_is_reported() {
    let folder = sensor("sim-misconfigured");
    let mapped = "DefaultValue=0x20000010";
    assert!(SHEET.contains(mapped));
    std::fs::write(folder.join("wrong.eds"), SHEET.replace(mapped, "DefaultValue=0x20010110")).unwrap();
    let mut wrong = Simulation::begin(&folder, &["wrong.eds", "--node", "7"]);
    let event = wrong.until("misconfigured");
    assert_eq!((&event["address"], &event["abort_code"]), (&json!("1A00:01"), &json!("06090011")));
    assert!(event["text"].as_str().unwrap().starts_with("the configuration is inconsistent: 1A00:01"), "{event}");
    // A misconfiguration is reported at each boot; a consistent device reports none.
    wrong.asks("power cycle", "misconfigured");
    let summary = |sheet: &str| lexican_in(&folder, &["simulate", sheet, "--node", "7", "--for", "0.2s"]).stdout;
    assert!(summary("wrong.eds").contains("inconsistent") && !summary("sensor.eds").contains("inconsistent"));
}

#[test]
fn lines_control_a_device_made_of_its_data_sheet() {
    let mut sensor = Simulation::begin(&sensor("sim-control"), &["sensor.eds", "--node", "7"]);
    assert_eq!(sensor.asks("get \"Measured Value\"", "answer")["text"], "2000:00 Measured Value = 0");
    assert_eq!(sensor.asks("set 2000 1234", "answer")["text"], "2000:00 Measured Value = 1234");
    sensor.check("read", &["--node", "7", "2000"], "2000:00 = D2 04");
    let emcy = sensor.asks("emcy 3120 04 01 02", "emcy");
    assert_eq!(
        (&emcy["code"], &emcy["register"], &emcy["msef"]),
        (&json!("3120"), &json!("05"), &json!("01 02 00 00 00"))
    );
    assert_eq!(sensor.asks("emcy clear", "emcy")["code"], "0000");
    assert_eq!(sensor.asks("power off", "state")["state"], Value::Null);
    let silent = sensor.run("read", &["--node", "7", "--device", "none", "2000"]);
    silent.on_stderr(2, "lexican scan");
    sensor.asks("power on", "boot-up");
    sensor.check("read", &["--node", "7", "2000"], "2000:00 = 00 00");
    for (line, words) in [
        ("jump", "is no command"),
        ("get 7000", "does not exist"),
        ("set 2000 99999", "99999 is no INTEGER16"),
        ("set 2000 9999", "too high"),
        ("battery_v = 2.5", "has no inputs"),
    ] {
        let error = sensor.asks(line, "error");
        assert!(error["text"].as_str().unwrap().contains(words), "{line}: {error}");
    }
    assert!(sensor.asks("help", "answer")["text"].as_str().unwrap().contains("power on|off|cycle"));
    assert!(sensor.asks("status", "answer")["text"].as_str().unwrap().starts_with("node 7: PRE-OPERATIONAL"));
    assert!(sensor.asks("quit", "summary")["seconds"].is_number());
}

#[test]
fn process_data_are_sent_when_an_object_is_set() {
    let mut sensor = Simulation::begin(&sensor("sim-pdo"), &["sensor.eds", "--node", "7"]);
    sensor.check("nmt", &["start", "--node", "7"], "");
    sensor.until("state");
    sensor.asks("set 2000 -5", "answer");
    let pdo = loop {
        let pdo = sensor.until("pdo");
        if pdo["fields"][0]["value"] == -5 {
            break pdo;
        }
    };
    assert_eq!((&pdo["direction"], &pdo["fields"][0]["name"]), (&json!("transmit"), &json!("Measured Value")));
}

#[test]
fn what_is_stored_survives_in_a_file() {
    let folder = sensor("sim-eeprom");
    let args = ["sensor.eds", "--node", "7", "--eeprom", "kept.txt"];
    let mut first = Simulation::begin(&folder, &args);
    first.check("write", &["--node", "7", "--type", "UNSIGNED16", "2001", "77"], "");
    first.check("write", &["--node", "7", "--type", "UNSIGNED32", "1010:01", "0x65766173"], "");
    first.check("write", &["--node", "7", "--type", "UNSIGNED16", "2001", "78"], "");
    first.asks("power cycle", "boot-up");
    first.check("read", &["--node", "7", "2001"], "2001:00 = 4D 00");
    drop(first);
    let second = Simulation::begin(&folder, &args);
    second.check("read", &["--node", "7", "2001"], "2001:00 = 4D 00");
    second.check("write", &["--node", "7", "--type", "UNSIGNED32", "1011:01", "0x64616F6C"], "");
    second.check("nmt", &["reset-node", "--node", "7"], "");
    second.check("read", &["--node", "7", "2001"], "2001:00 = 05 00");
    drop(second);
    std::fs::write(folder.join("kept.txt"), "something else\n").unwrap();
    lexican_in(&folder, &[&["simulate"], &args[..]].concat())
        .on_stderr(2, "kept.txt: not the EEPROM of a simulated device: the first line is not");
}

#[test]
fn a_drive_keeps_its_parameters_and_follows_a_script() {
    let folder = folder("sim-script");
    std::fs::write(folder.join("day.toml"), "[[step]]\nafter_ms = 10\nbattery_v = 2.1\n").unwrap();
    let args = ["siko/ag03-1", "--node", "5", "--eeprom", "eeprom.txt"];
    let mut drive = Simulation::begin(&folder, &[&args[..], &["--script", "day.toml"]].concat());
    assert!(drive.until("emcy")["register"].is_string());
    drive.asks("clear = \"all\"", "answer");
    let error = drive.asks("battery_v = \"full\"", "error");
    assert!(error["text"].as_str().unwrap().contains("battery_v"), "{error}");
    assert!(drive.asks("emcy 3120", "error")["text"].as_str().unwrap().contains("fault"));
    drive.check("write", &["--node", "5", "2410:01", "raw:77"], "");
    drive.interrupt();
    let again = Simulation::begin(&folder, &args);
    again.check("read", &["--node", "5", "--device", "none", "2410:01"], "2410:01 = 4D");
    drop(again);
    std::fs::write(folder.join("bad.toml"), "[[step]]\nbatery_v = 2.1\n").unwrap();
    lexican_in(&folder, &["simulate", "siko/ag03-1", "--node", "5", "--script", "bad.toml"])
        .on_stderr(2, "--> bad.toml:2:1");
}

/// One drive of the library with a simulator of its own, and one that its data sheet makes a drive.
#[test]
fn a_servo_keeps_its_parameters_and_follows_a_script() {
    let folder = folder("sim-servo");
    let sheet = Path::new(env!("CARGO_MANIFEST_DIR")).join("../eds/devices/kollmorgen/akd/AKD.EDS");
    std::fs::copy(sheet, folder.join("servo.eds")).unwrap();
    let script = "[[step]]\nafter_ms = 10\nfault = 0x4310\n\n[[step]]\nwhen = \"fault\"\nfault = \"none\"\n";
    std::fs::write(folder.join("day.toml"), script).unwrap();
    std::fs::write(folder.join("bad.toml"), "[[step]]\nblocked = \"yes\"\n").unwrap();
    for device in ["servo.eds", "kollmorgen/akd"] {
        let eeprom = format!("{}.txt", device.replace('/', "-"));
        let args = [device, "--node", "5", "--eeprom", &eeprom];
        let mut drive = Simulation::begin(&folder, &[&args[..], &["--script", "day.toml"]].concat());
        assert_eq!(drive.until("emcy")["code"], "4310");
        drive.check("write", &["--node", "5", "--device", "none", "--type", "UNSIGNED16", "6040", "0x80"], "");
        assert_eq!(drive.until("emcy")["code"], "0000", "the cause is gone");
        drive.asks("warning = 0x4210", "emcy");
        drive.asks("warning = none", "emcy");
        let error = drive.asks("blocked = maybe", "error");
        assert!(error["text"].as_str().unwrap().contains("write true or false"), "{error}");
        drive.asks("turn = 25", "answer");
        drive.check("read", &["--node", "5", "--device", "none", "6064"], "6064:00 = 19 00 00 00");
        drive.check("write", &["--node", "5", "--device", "none", "--type", "UNSIGNED32", "6065", "77"], "");
        drive.check("write", &["--node", "5", "--device", "none", "--type", "UNSIGNED32", "1010:01", "0x65766173"], "");
        drive.interrupt();
        let again = Simulation::begin(&folder, &args);
        again.check("read", &["--node", "5", "--device", "none", "6065"], "6065:00 = 4D 00 00 00");
        drop(again);
        std::fs::write(folder.join(&eeprom), "lexican parameters 2\n6065:00 4D\n").unwrap();
        let torn = lexican_in(&folder, &[&["simulate"], &args[..]].concat());
        torn.on_stderr(2, &format!("{eeprom}: cut off or changed"));
        lexican_in(&folder, &["simulate", device, "--node", "5", "--script", "bad.toml"])
            .on_stderr(2, "`blocked` cannot be \"yes\"");
    }
}

#[test]
fn a_device_without_node_id_gets_one_by_lss() {
    let folder = sensor("sim-lss");
    let mut sensor = Simulation::begin(&folder, &["sensor.eds", "--node", "none", "--eeprom", "kept.txt"]);
    // With a long time-out, because the device may be late on a busy machine.
    let found = sensor.run("lss find", &["--one", "--json", "--timeout", "30s"]);
    let found: Value = serde_json::from_str(&found.stdout).unwrap_or_else(|_| panic!("{}", found.stderr));
    assert_eq!(found, json!({ "vendor": 0, "product": 3, "revision": 1, "serial": 42, "device": null }));
    assert_eq!(sensor.until("lss")["command"], "switch-global");
    // The search leaves nothing behind.
    assert_eq!(sensor.run("lss find", &["--one", "--json", "--timeout", "30s"]).code, Some(0));
    let patience = ["--timeout", "3s"];
    let select = ["--timeout", "3s", "--vendor", "0", "--product", "3h", "--revision", "0x1", "--serial", "42"];
    sensor.check("lss inquire", &select, "vendor 0h, product 3h, revision 1h, serial 2Ah, no node-ID\n");
    let given = sensor.run("lss node-id", &[&select[..], &["9", "--store", "--json"]].concat());
    let given: Value = serde_json::from_str(&given.stdout).unwrap_or_else(|_| panic!("{}", given.stderr));
    assert_eq!([&given["node"], &given["node_id"]], [&Value::Null, &json!(9)]);
    assert_eq!([&given["booted"], &given["stored"]], [&json!(true), &json!(true)]);
    sensor.until("boot-up");
    assert!(std::fs::read_to_string(folder.join("kept.txt")).unwrap().contains("node 9\n"));
    sensor.check("lss inquire", &patience, "serial 2Ah, node-ID 9\n");
    let none = sensor.run("lss find", &[]);
    assert_eq!((none.code, none.stdout.contains("no device without node-ID answers")), (Some(1), true));

    // The device now has a node-ID; another one takes effect with the next reset.
    let again = sensor.run("lss node-id", &[&patience[..], &["10"]].concat());
    assert!(again.stderr.contains("it is node 9 until its communication is reset"), "{}", again.stderr);
    assert!(again.stderr.contains("not stored"), "{}", again.stderr);
    sensor.check("nmt", &["reset-communication", "--node", "9"], "reset communication");
    sensor.until("boot-up");
    sensor.check("read", &["--node", "10", "--device", "none", "1000"], "1000:00 = 00 00 00 00");
    let rate = sensor.run("lss bit-rate", &[&patience[..], &["250"]].concat());
    assert!(rate.stdout.ends_with("serial 2Ah: 250 kbit/s\n"), "{}", rate.stdout);
    assert!(rate.stderr.contains("neither activated nor stored"), "{}", rate.stderr);
    let refused = sensor.run("lss bit-rate", &[&patience[..], &["auto"]].concat());
    refused.on_stderr(1, "serial 2Ah: refused: bit rate not supported");
    let refused = sensor.run("lss bit-rate", &["auto", "--all", "--json", "--store", "--switch-delay", "20ms"]);
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    let refused: Value = serde_json::from_str(&refused.stdout).unwrap();
    assert_eq!([&refused["error"], &refused["refusal"]], [&json!(1), &json!("refused: bit rate not supported")]);
    sensor.check(
        "lss bit-rate",
        &["--all", "500", "--switch-delay", "20ms", "--json"],
        "\"activated\":true,\"kbit_per_s\":500",
    );
    sensor.check("lss store", &["--all"], "all devices: stored\n");
    sensor.check("nmt", &["start", "--node", "10", "--wait", "10s"], "node 10: OPERATIONAL\n");
}

#[test]
fn what_lss_cannot_do_says_why() {
    let sensor = Simulation::begin(&sensor("sim-no-lss"), &["sensor.eds", "--node", "7"]);
    let check = |command: &str, args: &[&str], words: &str| {
        sensor.run(command, args).on_stderr(2, words);
    };
    check("lss inquire", &["--unconfigured", "--step", "100ms"], "`lexican scan` shows those that have one");
    check("lss node-id", &["--unconfigured", "--step", "100ms", "5"], "no device without node-ID answers");
    check("lss store", &["--vendor", "1", "--product", "1", "--revision", "1", "--serial", "1"], "no device with this");
    check("lss store", &["--vendor", "1"], "--product");
    check("lss store", &["--vendor", "1", "--unconfigured"], "cannot be used with");
    check("lss store", &["--serial", "2G"], "405, 0x195 or 195h");
    check("lss node-id", &["128"], "node-IDs are 1 to 127");
    check("lss bit-rate", &["100"], "1000, 800, 500, 250, 125, 50, 20, 10 and auto");
    let drive = Simulation::begin(&folder("sim-no-lss-drive"), &["siko/ag03-1", "--node", "5"]);
    let run = drive.run("lss inquire", &[]);
    run.on_stderr(2, "no device answers to LSS");
    drive
        .run("nmt", &["start", "--node", "6", "--wait", "300ms"])
        .on_stderr(1, "nothing was heard of node 6 within 300 ms");
}

#[test]
fn the_next_steps_are_printed() {
    let folder = sensor("sim-new-user");
    let check = |node: &str, words: &[&str]| {
        let run = lexican_in(&folder, &["simulate", "sensor.eds", "--node", node, "--for", "0.1s"]);
        // Stdout has the bus, too, for programs that read events there.
        run.on_stdout(0, "  serving on slcan:/dev/pts/");
        words.iter().for_each(|words| assert!(run.stderr.contains(words), "{words}: {}", run.stderr));
    };
    check("7", &["lexican monitor --bus slcan:", "--device 7=sensor.eds", "lexican scan --bus slcan:"]);
    check("none", &["lexican monitor --bus slcan:", "lexican lss find --bus slcan:", "--unconfigured 5"]);
    let sensor = Simulation::begin(&folder, &["sensor.eds", "--node", "none"]);
    let silent = sensor.run("monitor", &["--for", "0.1s"]);
    assert_eq!((silent.code, silent.stdout.as_str()), (Some(0), ""));
    assert!(silent.stderr.contains("no frame was heard"), "{}", silent.stderr);
    let silent = sensor.run("nmt", &["start", "--all", "--wait", "100ms"]);
    silent.on_stderr(1, "no node was heard within 100 ms");
    let silent = sensor.run("scan", &["--timeout", "100ms"]);
    silent.on_stdout(1, "lexican lss find");
}

#[test]
fn what_cannot_be_simulated_says_why() {
    let check = |args: &[&str], words: &str| {
        lexican(&[&["simulate"], args].concat()).on_stderr(2, words);
    };
    check(&["siko/ag03-1", "--bus", "pty:0"], "\"0\" is not a number of pseudo-terminals");
    check(&["siko/ag03-1", "--bus", "pty:x"], "\"x\" is not a number of pseudo-terminals");
    check(&["siko/ag03-1", "--bus", "log:x"], "a log takes no frames");
    check(&["siko/ag03-1", "--bus", "sim:siko/ag03-1"], "no other command could reach the device");
    check(&["siko/ag03-1", "--node", "none"], "this drive has no LSS");
    check(&["siko/ag03-1", "--script", "missing.toml"], "missing.toml");
    check(&["siko/ag03-1", "--node", "0"], "0 is not a node-ID");
    let folder = sensor("sim-refusals");
    std::fs::write(folder.join("x.toml"), "[[step]]\nblocked = true\n").unwrap();
    let run = lexican_in(&folder, &["simulate", "sensor.eds", "--script", "x.toml"]);
    assert!(run.stderr.contains("this device does not follow a script"), "{run}");
}

#[test]
fn the_hints_of_a_second_simulation_can_be_followed() {
    let folder = sensor("sim-second");
    let first = Simulation::begin(&folder, &["sensor.eds", "--node", "5", "--bus", "pty:3"]);
    let introduced = |args: &[&str]| lexican_in(&folder, &[&["simulate", "--for", "0.1s"], args].concat()).stderr;
    let second = introduced(&["sensor.eds", "--node", "6", "--bus", &first.buses[0]]);
    // It occupies the first terminal, so its hints name another one.
    assert!(second.contains("    lexican scan --bus BUS\n"), "{second}");
    assert!(second.contains("BUS below is another terminal of the simulation"), "{second}");
    assert!(!second.contains(&format!("--bus {}", first.buses[0])), "{second}");
    // A simulation that makes its own terminals names those.
    let own = introduced(&["sensor.eds", "--node", "6"]);
    assert!(own.contains("    lexican scan --bus slcan:/dev/pts/") && !own.contains("BUS"), "{own}");
}

#[test]
fn a_line_without_end_is_no_command() {
    let mut sensor = Simulation::begin(&sensor("sim-line"), &["sensor.eds", "--node", "5"]);
    let long = "x".repeat(1 << 20);
    let refused = sensor.asks(&long, "error");
    assert!(refused["text"].as_str().unwrap().len() < 5000);
    assert!(sensor.asks("status", "answer")["text"].as_str().unwrap().contains("node 5"));
}

#[test]
fn a_new_node_id_is_activated_when_that_is_wanted() {
    let sensor = Simulation::begin(&sensor("sim-activate"), &["sensor.eds", "--node", "5"]);
    let hinted = sensor.run("lss node-id", &["9"]);
    hinted.on_stderr(0, "it is node 5 until");
    assert!(hinted.stderr.contains("--activate does so"), "{}", hinted.stderr);
    sensor.check("lss node-id", &["9", "--activate"], "node-ID 9, and has booted with it\n");
    sensor.check("scan", &["--timeout", "100ms"], "node   9");
}

/// The objects of a boot loader of CiA 302-3 in its data sheet, besides the mandatory ones.
const BOOT_LOADER: &str = "\
[FileInfo]\nFileName=loader.eds\nEDSVersion=4.0\n\
[DeviceInfo]\nVendorName=Nobody\nProductName=Loader\nBaudRate_500=1\n\
[MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n\
[OptionalObjects]\nSupportedObjects=4\n1=0x1F50\n2=0x1F51\n3=0x1F56\n4=0x1F57\n\
[1000]\nParameterName=Device Type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0\n\
[1001]\nParameterName=Error Register\nObjectType=7\nDataType=5\nAccessType=ro\nDefaultValue=0\n\
[1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n\
[1018sub0]\nParameterName=Highest Sub-Index\nObjectType=7\nDataType=5\nAccessType=const\nDefaultValue=1\n\
[1018sub1]\nParameterName=Vendor ID\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0\n";

/// The boot loader's data sheet in a folder.
fn boot_loader(name: &str) -> std::path::PathBuf {
    let mut sheet = BOOT_LOADER.to_owned();
    let arrays = [("1F50", "Program Data", "15", "wo"), ("1F51", "Program Control", "5", "rw")];
    let more = [("1F56", "Software Identification", "7", "ro"), ("1F57", "Flash Status", "7", "ro")];
    for (index, name, data_type, access) in arrays.into_iter().chain(more) {
        sheet += &format!(
            "[{index}]\nParameterName={name}\nObjectType=8\nSubNumber=2\n[{index}sub0]\nParameterName=Highest Sub-Index\n\
             ObjectType=7\nDataType=5\nAccessType=const\nDefaultValue=1\n[{index}sub1]\nParameterName={name} 1\n\
             ObjectType=7\nDataType={data_type}\nAccessType={access}\n"
        );
    }
    let folder = folder(name);
    std::fs::write(folder.join("loader.eds"), sheet).unwrap();
    folder
}

#[test]
fn a_program_is_flashed_into_a_boot_loader() {
    let folder = boot_loader("flash");
    std::fs::write(folder.join("small.bin"), b"123456789").unwrap();
    std::fs::write(folder.join("large.bin"), vec![0x5A; 400_000]).unwrap();
    std::fs::write(folder.join("empty.bin"), b"").unwrap();
    std::fs::write(folder.join("crc.toml"), "identification = 'crc32'\npatience_ms = 2000\n").unwrap();
    std::fs::write(folder.join("wrong.toml"), "patience_ms = 2000\nclear = true\n").unwrap();
    let mut simulation = Simulation::begin(&folder, &["loader.eds", "--node", "5"]);
    let bus = simulation.buses[0].clone();
    let flash = |more: &[&str]| lexican_in(&folder, &[&["flash", "--bus", &bus, "5"], more].concat());
    flash(&["--status"]).on_stdout(0, "the device holds no valid program now");
    // The check value of CRC-32.
    flash(&["--loader", "crc.toml", "small.bin"]).on_stdout(0, "9 bytes");
    flash(&["--status", "--json"]).on_stdout(0, "\"held\":\"running\"");
    flash(&["--json", "small.bin"]).on_stdout(0, "\"before\":\"CBF43926\"");
    flash(&["--program", "2", "small.bin"]).on_stderr(2, "stopping the program: node 5: 1F51:02");
    let other = lexican(&["flash", "--bus", "sim:siko/ag03-1?node=5", "5", folder.join("small.bin").to_str().unwrap()]);
    other.on_stderr(2, "the device has no program control (1F51h), and was not changed");
    assert!(!other.stderr.contains("power"), "{}", other.stderr);
    flash(&["empty.bin"]).on_stderr(2, "empty.bin is empty");
    flash(&["--loader", "wrong.toml", "small.bin"]).on_stderr(2, "wrong.toml:2: a number from 0 to 255, or false");

    // The transfer is interrupted once it has begun; events of earlier writes are skipped.
    simulation.asks("get 1000", "answer");
    let mut process = Command::new(env!("CARGO_BIN_EXE_lexican"))
        .args(["flash", "--bus", &bus, "5", "--json", "large.bin"])
        .current_dir(&folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while simulation.until("written")["address"] != "1F51:01" {}
    assert!(Command::new("kill").args(["-INT", &process.id().to_string()]).status().unwrap().success());
    let code = process.wait().unwrap().code();
    let output = process.wait_with_output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(code == Some(1) && text.contains("interrupted"), "{code:?} {text}");
    simulation.asks("power off", "state");
    flash(&["--loader", "crc.toml", "small.bin"]).on_stderr(2, "no answer of the device in time");
}
