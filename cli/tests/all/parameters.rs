//! `lexican backup`, `restore`, `compare` and `apply` with devices that keep running between commands.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common::{Run, folder, lexican_in};
use crate::simulation::Simulation;

const SHEET: &str = include_str!("../sensor.eds");

/// A folder with the data sheet of the sensor.
fn with_sheet(name: &str) -> PathBuf {
    let folder = folder(name);
    std::fs::write(folder.join("sensor.eds"), SHEET).unwrap();
    folder
}

/// Runs a command in a folder on the first bus of a simulation.
fn run(device: &Simulation, folder: &Path, command: &str, args: &[&str]) -> Run {
    lexican_in(folder, &[&[command, "--bus", &device.buses[0]], args].concat())
}

/// Backs a device up, changes it, restores it, and compares it with the backup.
#[track_caller]
fn round_trip(name: &str, sheet: &str, sheet_args: &[&str], changes: &[(&str, &str)]) {
    let folder = with_sheet(name);
    let device = Simulation::begin(&folder, &[sheet, "--node", "5"]);
    let run = |command: &str, args: &[&str]| run(&device, &folder, command, &[sheet_args, args].concat());
    let backup = run("backup", &["5", "-o", "kept.dcf"]);
    assert_eq!(backup.code, Some(0), "{backup}");
    assert_eq!(run("compare", &["node:5", "kept.dcf"]).code, Some(0));
    for (object, value) in changes {
        let written = run("write", &["--node", "5", object, value]);
        assert_eq!(written.code, Some(0), "{written}");
    }
    let differing = run("compare", &["node:5", "kept.dcf", "--json"]);
    assert_eq!((differing.code, differing.stdout.lines().count()), (Some(1), changes.len() + 1), "{differing}");
    let dry = run("restore", &["5", "kept.dcf", "--dry-run"]);
    dry.on_stdout(0, &format!("{} would be written", plural(changes.len())));
    let restored = run("restore", &["5", "kept.dcf"]);
    restored.on_stdout(0, &format!("{} written, ", plural(changes.len())));
    let same = run("compare", &["kept.dcf", "node:5"]);
    assert_eq!(same.code, Some(0), "{same}");
    run("restore", &["5", "kept.dcf"]).on_stdout(0, "node 5: 0 parameters written, ");
}

fn plural(count: usize) -> String {
    format!("{count} parameter{}", if count == 1 { "" } else { "s" })
}

#[test]
fn what_is_backed_up_is_restored_to_the_ag03() {
    round_trip(
        "round-trip-ag03",
        "siko/ag03-1",
        &[],
        &[("6060", "profile velocity"), ("2412", "2.5 mm"), ("2410/5", "7"), ("1017", "250 ms")],
    );
}

#[test]
fn what_is_backed_up_is_restored_to_the_ag02() {
    round_trip("round-trip-ag02", "siko/ag02", &[], &[("2413", "loop plus"), ("2412", "2.5 mm")]);
}

#[test]
fn what_is_backed_up_is_restored_to_the_akd() {
    round_trip("round-trip-akd", "kollmorgen/akd", &[], &[("1017", "500"), ("6081", "1000")]);
}

#[test]
fn what_is_backed_up_is_restored_to_any_device() {
    let changes = [("2001", "7"), ("2002", "left"), ("1800:02", "1"), ("1014", "0x80000085")];
    round_trip("round-trip-sensor", "sensor.eds", &["--device", "sensor.eds"], &changes);
}

#[test]
fn a_pdo_is_restored_by_switching_it_off() {
    let folder = with_sheet("restore-pdo");
    let mut device = Simulation::begin(&folder, &["sensor.eds", "--node", "5"]);
    let sheet = ["--device", "sensor.eds"];
    let run =
        |device: &Simulation, command: &str, args: &[&str]| run(device, &folder, command, &[&sheet, args].concat());
    assert_eq!(run(&device, "backup", &["5", "-o", "kept.dcf"]).code, Some(0));
    // $NODEID is kept, so that the backup fits another node-ID.
    let dcf = std::fs::read_to_string(folder.join("kept.dcf")).unwrap();
    assert!(dcf.contains("ParameterValue=$NODEID+0x180") && dcf.contains("NodeID=5"), "{dcf}");
    for (object, value) in [("1800:01", "0x80000185"), ("1A00:00", "0"), ("1800:01", "0x185")] {
        assert_eq!(run(&device, "write", &["--node", "5", object, value]).code, Some(0));
        device.until("written");
    }
    run(&device, "restore", &["5", "kept.dcf"]).on_stdout(0, "1A00:00 TPDO1 Mapping, Number of Entries = 1, was 0\n");
    let written: Vec<_> = (0..5)
        .map(|_| {
            let written = device.until("written");
            format!("{} {}", written["address"].as_str().unwrap(), written["value"])
        })
        .collect();
    assert_eq!(written, ["1800:01 2147484037", "1A00:00 0", "1A00:01 536870928", "1A00:00 1", "1800:01 389"]);
}

/// A data sheet with many parameters, and a DCF that sets each of them.
fn many(folder: &Path) {
    let count = 400;
    let list: String = (0..count).map(|at| format!("{}=0x{:04X}\n", at + 5, 0x3000 + at)).collect();
    let objects = |configured: &str| -> String {
        let object = |at| {
            format!(
                "[{:04X}]\nParameterName=Parameter {at}\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nPDOMapping=0\n\
                 DefaultValue=0\n{configured}\n",
                0x3000 + at
            )
        };
        (0..count).map(object).collect()
    };
    let lists = SHEET.replace("SupportedObjects=4\n", &format!("SupportedObjects={}\n", 4 + count));
    let lists = lists.replace("4=0x2003\n", &format!("4=0x2003\n{list}"));
    std::fs::write(folder.join("many.eds"), lists.clone() + &objects("")).unwrap();
    std::fs::write(folder.join("many.dcf"), lists + &objects("ParameterValue=7\n")).unwrap();
}

#[test]
fn a_restore_that_ends_half_way_goes_on_where_it_was() {
    for ends in ["interrupted", "no answer"] {
        let folder = with_sheet(&format!("restore-{}", ends.replace(' ', "-")));
        many(&folder);
        let mut device = Simulation::begin(&folder, &["many.eds", "--node", "5"]);
        let args = ["--bus", &device.buses[0], "--device", "many.eds", "--timeout", "200ms", "5", "many.dcf"];
        let args = args.map(str::to_owned);
        let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
        let command = command.arg("restore").args(&args).current_dir(&folder);
        let mut restore = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(restore.stdout.take().unwrap());
        let mut stdout = String::new();
        lines.read_line(&mut stdout).unwrap();
        assert_eq!(stdout, "3000:00 Parameter 0 = 7, was 0\n");
        if ends == "interrupted" {
            let pid = restore.id().to_string();
            assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
        } else {
            // Keep reading its events, so that it does not wait for its reader.
            device.asks("power off", "state");
        }
        lines.read_to_string(&mut stdout).unwrap();
        let output = restore.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stdout}{stderr}");
        assert!(stderr.contains(ends) && stderr.contains("the same command goes on from here"), "{stderr}");
        let done = stdout.lines().count() - 1;
        assert!(done < 400, "{done}");
        if ends == "no answer" {
            device.asks("power on", "state");
        }
        let args: Vec<_> = args.iter().map(String::as_str).collect();
        let again = lexican_in(&folder, &[&["restore"], &args[..]].concat());
        assert_eq!(again.code, Some(0), "{again}");
        // A device that lost its power has its defaults again.
        let left = if ends == "interrupted" { 400 - done } else { 400 };
        again.on_stdout(0, &format!("node 5: {left} parameters written, {} had their value", 400 - left));
    }
}

#[test]
fn what_the_device_refuses_is_listed() {
    let folder = with_sheet("restore-refused");
    let sheet = SHEET.replace("LowLimit=1\nHighLimit=100\n", "");
    std::fs::write(folder.join("wide.eds"), &sheet).unwrap();
    let dcf = sheet.replace("DefaultValue=5\n", "DefaultValue=5\nParameterValue=200\n");
    let dcf = dcf.replace("DefaultValue=sensor\n", "DefaultValue=sensor\nParameterValue=left\n");
    std::fs::write(folder.join("wide.dcf"), dcf).unwrap();
    let restore = ["restore", "--bus", "sim:sensor.eds?node=7", "--device", "wide.eds", "7", "wide.dcf", "--store"];
    let run = lexican_in(&folder, &restore);
    run.on_stdout(1, "node 7: 1 parameter written, 0 had their value, 1 refused\n");
    assert!(run.stdout.contains("2002:00 Label = \"left\", was \"sensor\"\n"), "{run}");
    assert!(run.stderr.contains("node 7: 2001:00 Averaged Samples: the device aborts: 0609 0031"), "{run}");
    lexican_in(&folder, &[&restore[..], &["--json"]].concat()).on_stdout(1, "\"event\":\"refused\"");
    // An entry that the device lacks is missing in its backup.
    let more = SHEET.replace("SupportedObjects=4\n", "SupportedObjects=5\n5=0x2004\n")
        + "[2004]\nParameterName=More\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\nPDOMapping=0\n";
    std::fs::write(folder.join("more.eds"), more).unwrap();
    let backup = ["backup", "--bus", "sim:sensor.eds?node=7", "--device", "more.eds", "-o", "{node}.dcf"];
    let run = lexican_in(&folder, &backup);
    run.on_stdout(1, " in 7.dcf, 1 are missing\n");
    assert!(run.stderr.contains("node 7: 2004:00 More: the device aborts: 0602 0000"), "{run}");
}

#[test]
fn another_device_is_not_restored() {
    let folder = with_sheet("restore-other");
    let backup = ["backup", "--bus", "sim:siko/ag03-1?node=5", "-o", "ag03.dcf"];
    lexican_in(&folder, &backup).on_stdout(0, "parameters in ag03.dcf\n");
    let restore = ["restore", "--bus", "sim:siko/ag02?node=5", "5", "ag03.dcf"];
    let run = lexican_in(&folder, &restore);
    run.on_stderr(1, "node 5: it is another device: its product is none, by the data sheet");
    assert!(run.stdout.is_empty() && run.stderr.contains("--force"), "{run}");
    let forced = lexican_in(&folder, &[&restore[..], &["--force", "--dry-run"]].concat());
    assert!(forced.code == Some(0) && forced.stdout.contains("would be written"), "{forced}");
    let none = ["restore", "--bus", "sim:sensor.eds?node=5", "5", "sensor.eds"];
    lexican_in(&folder, &none).on_stderr(2, "sensor.eds configures nothing");
}

#[test]
fn the_node_stands_first_or_is_named_by_the_url() {
    let folder = with_sheet("node-first");
    let bus = ["--bus", "sim:sensor.eds?node=7", "--device", "sensor.eds", "--timeout", "50ms"];
    let run = |command: &str, args: &[&str]| lexican_in(&folder, &[&[command], &bus[..], args].concat());
    run("backup", &["-o", "kept.dcf"]).on_stdout(0, " in kept.dcf\n");
    run("backup", &["7", "-o", "kept.dcf", "--force"]).on_stdout(0, " in kept.dcf\n");
    run("restore", &["7", "kept.dcf", "--dry-run"]).on_stdout(0, "node 7: 0 parameters would be written");
    run("restore", &["kept.dcf"]).on_stderr(2, "<NODE>");
    run("restore", &["9", "kept.dcf"]).on_stderr(2, "node 9");
    run("backup", &["9", "-o", "none.dcf"]).on_stderr(2, "node 9");
}

#[test]
fn a_domain_is_kept_in_a_file_that_the_dcf_names() {
    let folder = folder("backup-domain");
    let table = "[2004]\nParameterName=Cam Table\nObjectType=2\nDataType=0x000F\nAccessType=rw\nPDOMapping=0\n";
    let sheet = SHEET.replace("[ManufacturerObjects]\nSupportedObjects=4", "[ManufacturerObjects]\nSupportedObjects=5");
    std::fs::write(folder.join("cam.eds"), format!("{}\n{table}", sheet.replace("4=0x2003", "4=0x2003\n5=0x2004")))
        .unwrap();
    let device = Simulation::begin(&folder, &["cam.eds", "--node", "5"]);
    let run = |command: &str, args: &[&str]| run(&device, &folder, command, &[&["--device", "cam.eds"], args].concat());
    let content: Vec<u8> = (0..5000_u16).map(|at| (at % 251) as u8).collect();
    std::fs::write(folder.join("cam.bin"), &content).unwrap();
    run("write", &["--node", "5", "2004", "@cam.bin"]).on_stdout(0, "2004:00");
    run("backup", &["5", "-o", "kept.dcf"]).on_stdout(0, "; 1 DOMAIN not saved without --domains");
    run("backup", &["5", "-o", "kept.dcf", "--force", "--domains"]).on_stdout(0, " in kept.dcf\n");
    assert_eq!(std::fs::read(folder.join("kept.2004-00.bin")).unwrap(), content);
    std::fs::write(folder.join("other.bin"), &content[..4000]).unwrap();
    run("write", &["--node", "5", "2004", "@other.bin"]).on_stdout(0, "2004:00");
    let run_json = run("restore", &["5", "kept.dcf", "--json"]);
    let events: Vec<serde_json::Value> =
        run_json.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&events[0]["event"], &events[0]["address"]), (&"written".into(), &"2004:00".into()), "{run_json}");
    run("read", &["--node", "5", "2004", "-o", "again.bin"]).on_stdout(0, "");
    assert_eq!(std::fs::read(folder.join("again.bin")).unwrap(), content);
    std::fs::remove_file(folder.join("kept.2004-00.bin")).unwrap();
    run("restore", &["5", "kept.dcf"]).on_stderr(2, "kept.2004-00.bin");
}

#[test]
fn any_two_sides_are_compared() {
    let folder = with_sheet("compare");
    let other = SHEET.replace("DefaultValue=5\n", "DefaultValue=6\n");
    std::fs::write(folder.join("other.eds"), other).unwrap();
    let compare = |args: &[&str]| lexican_in(&folder, &[&["compare"], args].concat());
    let run = compare(&["sensor.eds", "other.eds"]);
    run.on_stdout(1, "2001:00 Averaged Samples");
    assert!(run.stdout.ends_with("1 differ\n"), "{run}");
    let run = compare(&["sensor.eds", "other.eds", "--json"]);
    let line: serde_json::Value = serde_json::from_str(run.stdout.lines().next().unwrap()).unwrap();
    assert_eq!((&line["a"]["value"], &line["b"]["value"]), (&5.into(), &6.into()), "{run}");
    compare(&["siko/ag03-1", "siko/ag03-1"]).on_stdout(0, ", the same\n");
    compare(&["siko/ag03-1", "siko/ag02"]).on_stdout(1, "(no such entry)");
    let node = ["--bus", "sim:sensor.eds?node=7", "--device", "sensor.eds"];
    compare(&[&node[..], &["node:7", "other.eds"]].concat()).on_stdout(1, "1 differ\n");
    compare(&[&node[..], &["sensor.eds", "node:0x7"]].concat()).on_stdout(0, ", the same\n");
    compare(&["node:7", "other.eds"]).on_stderr(2, "LEXICAN_BUS");
    compare(&["node:200", "other.eds"]).on_stderr(2, "200 is not a node-ID");
    compare(&["missing.eds", "other.eds"]).on_stderr(2, "missing.eds");
}

#[test]
fn settings_of_a_machine_are_checked_and_applied() {
    let folder = with_sheet("apply");
    let device = Simulation::begin(&folder, &["siko/ag03-1", "--node", "5"]);
    let apply = |settings: &str, more: &[&str]| {
        let machine = format!(
            "[node.feeder]\nid = 5\nsheet = \"siko/ag03-1\"\nguarding = \"100 ms\"\n{settings}[node.cutter]\nid = 6\n"
        );
        std::fs::write(folder.join("machine.toml"), machine).unwrap();
        run(&device, &folder, "apply", more)
    };
    let good =
        "[node.feeder.settings]\n\"Modes of Operation\" = \"profile velocity\"\n2412 = \"2.5 mm\"\n\"2410/5\" = 7\n";
    let wrong = apply(&format!("{good}6064 = \"raw:1\"\n\"nonsense\" = 2\n"), &[]);
    wrong.on_stderr(2, "machine::setting");
    assert!(wrong.stdout.is_empty() && wrong.stderr.contains("the data sheet says ro"), "{wrong}");
    assert!(wrong.stderr.contains("\"nonsense\"") && wrong.stderr.contains("machine.toml:9:8"), "{wrong}");
    // A command is not a parameter.
    apply(&format!("{good}6040 = \"shutdown\"\n"), &[]).on_stderr(2, "it is a command and no parameter");
    apply(good, &["--dry-run"])
        .on_stdout(0, "6060:00 Modes of Operation = profile velocity (2), was profile position (1)");
    apply(good, &["feeder"]).on_stdout(0, "node 5: 3 parameters written, 0 had their value\n");
    apply(good, &["--json"]).on_stdout(0, "\"equal\":3");
    run(&device, &folder, "read", &["--node", "5", "6060", "2412"]).on_stdout(0, "2412:00 Spindle Pitch = 2.50 mm");
    apply(good, &["5", "--start"]).on_stdout(0, "3 had their value\n");
    run(&device, &folder, "nmt", &["start", "--node", "5", "--wait", "2s"]).on_stdout(0, "OPERATIONAL");
    apply(good, &["cutter"]).on_stderr(2, "machine.toml has no settings for that node");
    apply("", &[]).on_stderr(2, "machine.toml has no settings for any node");
    // The machine's limits apply to every command.
    let limits = "[node.feeder.limits]\n2412 = [\"1 mm\", \"3 mm\"]\n";
    apply(&format!("{good}{limits}"), &[]).on_stdout(0, "3 had their value\n");
    run(&device, &folder, "write", &["feeder", "2412", "4 mm"]).on_stderr(1, "4.00 mm is too high");
    run(&device, &folder, "write", &["feeder", "2412", "2 mm"]).on_stdout(0, "2.00 mm");
}
