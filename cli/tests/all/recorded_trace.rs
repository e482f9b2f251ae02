//! `lexican convert --to trace`: a recorded session becomes a test of a device.

use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

use crate::common::{Run, folder, lexican_in};
use lexican_conform::Trace;
use lexican_driver::Drive;
use lexican_driver::description::Description;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link, VirtualBus};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use lexican_simulation::{Files, Plant};
use serde_json::Value;

const NODE: NodeId = NodeId::literal(5);

/// Records a session with the devices of a machine, from power-on.
fn record(folder: &Path, machine: &str, session: impl FnOnce(&VirtualBus)) {
    fs::write(folder.join("machine.toml"), machine).unwrap();
    let plant = Plant::parse(machine, "machine.toml", Files::Folder(folder)).unwrap();
    let bus = VirtualBus::with_bit_rate(500);
    let log = Arc::new(Mutex::new(String::new()));
    let lines = Arc::clone(&log);
    bus.observe(move |at, frame| {
        let us = at.since(lexican_runtime::Instant::ZERO).as_micros();
        *lines.lock().unwrap() += &format!("({}.{:06}) can0 {frame}\n", us / 1_000_000, us % 1_000_000);
    });
    bus.attach(plant.segment(bus.now()).unwrap());
    bus.advance(Duration::from_secs(1));
    session(&bus);
    bus.advance(Duration::from_millis(300));
    fs::write(folder.join("bus.log"), &*log.lock().unwrap()).unwrap();
}

/// Sets a drive up, travels there and back, and reads objects meanwhile.
fn travels(bus: &VirtualBus, description: &'static Description) {
    let mut drive = Drive::connect_described_unprotected(bus.link(), NODE, description).unwrap();
    drive.enable().unwrap();
    drive.move_to(3000).unwrap();
    drive.disable().unwrap();
    drop(drive);
    let mut network = Network::new(bus.link());
    let mut read = |index, sub| network.read_bytes(NODE, Address::new(index, sub)).map(|_| ());
    for (index, sub) in [(0x1000, 0), (0x1018, 1), (0x1018, 4), (0x6041, 0), (0x6064, 0)] {
        let _ = read(index, sub);
    }
    assert!(read(0x5FFF, 1).is_err());
    // One of the drives lacks this object.
    let _ = network.write_bytes(NODE, Address::new(0x1017, 0), &[100, 0]);
    bus.advance(Duration::from_secs(1));
}

fn machine(device: &str, more: &str) -> String {
    format!("[node.a]\nid = 5\nsheet = '{device}'\n{more}\n")
}

fn ask(folder: &Path, args: &[&str]) -> Run {
    let asked = ["conform", "--bus", "sim:machine.toml", "5", "--trace", "t.csv", "--allow", "all"];
    lexican_in(folder, &[&asked, args].concat())
}

#[test]
fn a_session_with_each_drive_is_asked_again() {
    let drives: [(&str, &'static Description); 3] = [
        ("siko/ag03-1", &siko_ag03_1::driver::AG03_1),
        ("siko/ag02", &siko_ag02::driver::AG02),
        ("kollmorgen/akd", &kollmorgen_akd::driver::AKD),
    ];
    for (device, description) in drives {
        let folder = folder(&format!("recorded-{}", device.replace('/', "-")));
        record(&folder, &machine(device, ""), |bus| travels(bus, description));
        let convert = ["convert", "bus.log", "t.csv", "--to", "trace", "--device", device];
        lexican_in(&folder, &convert).on_stdout(0, "t.csv: ");
        let text = fs::read_to_string(folder.join("t.csv")).unwrap();
        Trace::parse("t.csv", &text).unwrap();
        // Measured values are open, and others are compared.
        assert!(text.contains(" 64 60 00 xx xx xx xx,"), "{text}");
        assert!(!text.contains(" 00 10 00 xx"), "{text}");
        ask(&folder, &[]).on_stdout(0, "1 passed");
        // Without the data sheet, and from every other format.
        for format in ["blf", "trc", "asc", "pcapng"] {
            let log = format!("bus.{format}");
            lexican_in(&folder, &["convert", "bus.log", &log]).on_stdout(0, "frames");
            let run = lexican_in(&folder, &["convert", &log, "t.csv", "--node", "5", "--force"]);
            run.on_stderr(0, "without --device");
        }
        ask(&folder, &[]).on_stdout(0, "1 passed");
        // The trace moves the drive, which has to be allowed.
        let asked = ["conform", "--bus", "sim:machine.toml", "5", "--trace", "t.csv"];
        lexican_in(&folder, &asked).on_stdout(1, "not run: it gives a drive orders, which needs `--allow motion`");
    }
}

const SENSOR: &str = include_str!("../sensor.eds");

/// Reads a sensor, sets it up and starts it; the sensor sends its state.
fn sensor(bus: &VirtualBus) {
    let mut network = Network::new(bus.link());
    for (index, sub) in [(0x1000, 0), (0x1018, 2), (0x1018, 3), (0x2000, 0)] {
        let _ = network.read_bytes(NODE, Address::new(index, sub));
    }
    network.write_bytes(NODE, Address::new(0x1800, 2), &[1]).unwrap();
    network.write_bytes(NODE, Address::new(0x1017, 0), &[100, 0]).unwrap();
    network.command(NmtCommand::Start, None).unwrap();
    let mut link = bus.link();
    for _ in 0..20 {
        link.send(&Frame::from_array(CobId::SYNC, [])).unwrap();
        bus.advance(Duration::from_millis(20));
    }
    network.command(NmtCommand::Stop, Some(NODE)).unwrap();
    bus.advance(Duration::from_millis(500));
}

fn recorded_sensor(name: &str) -> std::path::PathBuf {
    let folder = folder(name);
    fs::write(folder.join("sensor.eds"), SENSOR).unwrap();
    record(&folder, &machine("sensor.eds", ""), sensor);
    lexican_in(&folder, &["convert", "bus.log", "t.csv", "--device", "sensor.eds"]).on_stdout(0, "with node 5");
    folder
}

/// Compares how a device deviates from the recorded one.
#[track_caller]
fn deviates(folder: &Path, sheet: &str, faults: &str, expected: &[&str]) {
    fs::write(folder.join("sensor.eds"), sheet).unwrap();
    fs::write(folder.join("machine.toml"), machine("sensor.eds", faults)).unwrap();
    let run = ask(folder, &[]);
    expected.iter().for_each(|text| run.on_stdout(1, text));
}

/// The line of the log from which an expectation comes, as in a failure.
fn source(folder: &Path, row: &str) -> String {
    let text = fs::read_to_string(folder.join("t.csv")).unwrap();
    let line = text.lines().position(|line| line.starts_with(row)).unwrap_or_else(|| panic!("{row}: {text}"));
    let source = text.lines().nth(line).unwrap().rsplit('"').nth(1).unwrap();
    let number: usize = source.strip_prefix("log line ").unwrap().split(',').next().unwrap().parse().unwrap();
    let log = fs::read_to_string(folder.join("bus.log")).unwrap();
    let id = row.split(',').next().unwrap();
    assert!(log.lines().nth(number - 1).unwrap().contains(&format!("can0 {id}#")), "{source}: {log}");
    format!("line {} ({source}): ", line + 1)
}

#[test]
fn another_device_fails_at_the_step_and_the_line_of_the_log_is_named() {
    let folder = recorded_sensor("recorded-sensor");
    ask(&folder, &[]).on_stdout(0, "1 passed");
    // Another value.
    let place = source(&folder, "585,expect,43 18 10 02");
    let other = SENSOR.replace(
        "ParameterName=Product Code\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\nPDOMapping=0\nDefaultValue=3",
        "ParameterName=Product Code\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\nPDOMapping=0\nDefaultValue=4",
    );
    deviates(&folder, &other, "", &[&place, "585#4318100204000000 came"]);
    // An abort.
    let place = source(&folder, "585,expect,60 17 10 00");
    let without = SENSOR.replace(
        "ParameterName=Producer Heartbeat Time\nObjectType=0x7\nDataType=0x0006\nAccessType=rw",
        "ParameterName=Producer Heartbeat Time\nObjectType=0x7\nDataType=0x0006\nAccessType=ro",
    );
    deviates(&folder, &without, "", &[&place, "585#80171000"]);
    // Answers, heartbeats and PDOs that do not come.
    for (id, row) in [("0x585", "585,expect,4"), ("0x705", "705,expect,05"), ("0x185", "185,expect")] {
        let place = source(&folder, row);
        let lost = format!("[[fault]]\naction = 'lose'\nfrom = 'a'\ncob-id = {id}\n");
        let lost = if id == "0x705" { lost + "every = 1\n" } else { lost };
        deviates(&folder, SENSOR, &lost, &[&place, "nothing with this identifier came"]);
    }
    // Another serial number is not a deviation.
    fs::write(folder.join("sensor.eds"), SENSOR.replace("DefaultValue=42", "DefaultValue=43")).unwrap();
    fs::write(folder.join("machine.toml"), machine("sensor.eds", "")).unwrap();
    ask(&folder, &[]).on_stdout(0, "1 passed");
}

#[test]
fn polls_are_one_question_and_broadcasts_are_to_the_node() {
    let folder = folder("recorded-polls");
    let read = "605#4041600000000000";
    let log = [
        "(1.000) can0 705#00".to_owned(),
        "(2.000) can0 000#0100".to_owned(),
        format!("(2.100) can0 {read}"),
        "(2.101) can0 585#4B41600037020000".to_owned(),
        "(2.150) can0 605#4064600000000000".to_owned(),
        "(2.151) can0 585#4364600010270000".to_owned(),
        "(2.190) can0 085#3081110102030405".to_owned(),
        format!("(2.200) can0 {read}"),
        "(2.201) can0 585#4B41600037020000".to_owned(),
        format!("(3.200) can0 {read}"),
        "(3.201) can0 585#4B41600037060000".to_owned(),
        "(3.300) can0 705#R1".to_owned(),
        "(3.301) can0 705#85".to_owned(),
        "(3.400) can0 7E5#5D00000000000000".to_owned(),
        "(3.401) can0 7E4#5D2A000000000000".to_owned(),
        "(3.500) can0 205#0F00".to_owned(),
        "(3.600) can0 606#4041600000000000".to_owned(),
        "(4.000) can0 000#8105".to_owned(),
        "(4.500) can0 705#00".to_owned(),
    ];
    fs::write(folder.join("bus.log"), log.join("\n") + "\n").unwrap();
    lexican_in(&folder, &["convert", "bus.log", "t.csv"])
        .on_stderr(2, "nodes 5, 6 are asked in the log, and a trace is of one");
    let run = lexican_in(&folder, &["convert", "bus.log", "t.csv", "--to", "trace", "--node", "5", "--json"]);
    let fields: Value = serde_json::from_str(run.stdout.trim()).unwrap_or_else(|error| panic!("{error}: {run}"));
    assert_eq!((&fields["steps"], &fields["left_out"]), (&13.into(), &1.into()), "{run}");
    let text = fs::read_to_string(folder.join("t.csv")).unwrap();
    let rows: Vec<String> =
        text.lines().skip(1).map(|line| line.split(',').take(4).collect::<Vec<_>>().join(",")).collect();
    let expected = [
        "000,send,01 05,",
        "605,send,40 64 60 00 00 00 00 00,after 150ms",
        "585,expect,43 64 60 00 xx xx xx xx,",
        "085,expect,30 81 11 xx xx xx xx xx,any time; until 5s",
        "605,send,40 41 60 00 00 00 00 00,",
        "585,expect,4B 41 60 00 37 06 00 00,until 3s",
        "705,send,R1,after 99ms",
        "705,expect,x5,until 5s",
        "7E5,send,5D 00 00 00 00 00 00 00,after 99ms",
        "7E4,expect,5D xx xx xx xx xx xx xx,until 5s",
        "205,send,0F 00,after 99ms",
        "000,send,81 05,after 500ms",
        "705,expect,00,until 5s",
    ];
    assert_eq!(rows, expected);
    Trace::parse("t.csv", &text).unwrap();
}

#[test]
fn what_makes_no_trace_is_said() {
    let folder = folder("recorded-wrong");
    fs::write(folder.join("bus.log"), "(1.0) can0 705#05\n").unwrap();
    fs::write(folder.join("asked.log"), "(1.0) can0 605#4041600000000000\n").unwrap();
    for (args, code, text) in [
        (&["bus.log", "t.csv"][..], 2, "no node is asked by SDO or commanded by NMT"),
        (&["bus.log", "t.csv", "--node", "5"], 2, "nothing in the log is sent to node 5"),
        (&["asked.log", "t.log", "--node", "5"], 2, "--node and --device are for traces"),
        (&["asked.log", "t.csv", "--begin", "1"], 2, "a trace has no times of day"),
        (&["asked.log", "t.csv"], 0, "the log does not begin with the boot-up of the node"),
    ] {
        lexican_in(&folder, &[&["convert"], args].concat()).on_stderr(code, text);
    }
}
