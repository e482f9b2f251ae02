//! `lexican machine`, and the names of its nodes in other commands.

use std::path::Path;

use crate::common::{Run, folder, lexican_in};

const MACHINE: &str = "\
[bus]
url = \"sim:siko/ag03-1?node=5\"
bit-rate = \"500 kbit/s\"

[node.feeder]
id = 5
sheet = \"siko/ag03-1\"
guarding = \"100 ms\"
settings = { 6060 = \"profile velocity\" }

[wire]
\"feeder.statusword\" = { to = [\"manager\"], every = \"20 ms\" }
";

fn in_machine(name: &str, text: &str, args: &[&str]) -> Run {
    let folder = folder(name);
    std::fs::write(folder.join("machine.toml"), text).unwrap();
    std::fs::create_dir(folder.join("below")).unwrap();
    lexican_in(&folder.join("below"), args)
}

#[test]
fn a_machine_is_checked_with_each_mistake_at_its_place() {
    let run = in_machine("machine-check", MACHINE, &["machine", "check"]);
    run.on_stdout(0, "1 node, 1 PDO configured, the bus is busy for 6.");
    let wrong = MACHINE.replace("feeder.statusword", "feeder.statuswrod").replace("sheet", "shet");
    let run = in_machine("machine-wrong", &wrong, &["machine", "check", "--format", "short"]);
    run.on_stdout(1, "machine.toml:7:1: error[machine::key]: unknown field `shet`");
    let run = in_machine("machine-sarif", &wrong, &["machine", "check", "--format", "sarif"]);
    run.on_stdout(1, "\"ruleId\": \"machine::key\"");
    let run = in_machine("machine-json", MACHINE, &["machine", "check", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((&json["buses"][0]["nodes"], &json["findings"]), (&1.into(), &serde_json::json!([])));
    in_machine("machine-none", "", &["machine", "check"]).on_stdout(1, "the machine has no nodes");
}

#[test]
fn a_plan_says_each_write_and_what_it_changes() {
    in_machine("machine-plan", MACHINE, &["machine", "plan"])
        .on_stdout(0, "  6060:00 Modes of Operation = profile velocity (2)  [setting]\n");
    in_machine("machine-live", MACHINE, &["machine", "plan", "--of", "feeder", "--live"])
        .on_stdout(1, "= profile velocity (2)  [setting]  (now profile position (1))");
    in_machine("machine-of", MACHINE, &["machine", "plan", "--of", "feedr"]).on_stderr(2, "there are feeder");
}

#[test]
fn a_machine_is_formatted_exported_and_explained() {
    let odd = MACHINE.replace("id = 5", "id=5  # the left one");
    in_machine("machine-fmt-check", &odd, &["machine", "fmt", "--check"]).on_stdout(1, "machine.toml");
    in_machine("machine-fmt", &odd, &["machine", "fmt"]).on_stdout(0, "machine.toml");
    let export = in_machine("machine-export", MACHINE, &["machine", "export", "--folder", "all"]);
    let files = "feeder.dcf feeder.bin machine.dbc machine.lua machine.md machine.html machine.svg nodelist.cpj";
    export.on_stdout(0, &files.split(' ').map(|file| format!("all/{file}\n")).collect::<String>());
    let some = &["machine", "export", "--folder", "some", "--format", "cpj,concise"];
    in_machine("machine-export-some", MACHINE, some).on_stdout(0, "some/feeder.bin\nsome/nodelist.cpj\n");
    in_machine("machine-schema", MACHINE, &["machine", "schema"]).on_stdout(0, "\"boots-again\"");
}

#[test]
fn every_command_takes_the_names_of_its_nodes() {
    let run = |name: &str, args: &[&str]| in_machine(&format!("machine-name-{name}"), MACHINE, args);
    run("read", &["read", "feeder", "statusword"]).on_stdout(0, "SWITCH ON DISABLED");
    run("option", &["read", "--node", "feeder", "statusword"]).on_stdout(0, "SWITCH ON DISABLED");
    run("drive", &["drive", "feeder", "move-to", "200", "--enable"]).on_stdout(0, "it has reached its target");
    run("check", &["check", "feeder"]).on_stdout(0, "node 5: 138 entries, as the data sheet says");
    run("scan", &["scan"]).on_stdout(0, "siko/ag03-1");
    run("nmt", &["nmt", "start", "feeder"]).on_stdout(0, "");
    run("conform", &["conform", "feeder", "--list"]).on_stdout(0, "1000h is read in one message");
    run("compare", &["compare", "node:feeder", "siko/ag03-1"]).on_stdout(0, ", the same");
    run("statistics", &["statistics", "--for", "2s"]).on_stdout(0, "load 0.");
    run("unknown", &["read", "feedr", "statusword"]).on_stderr(2, "feedr");
    run("demo", &["bench", "--demo", "--tui"]).on_stderr(2, "the terminal cannot be used");
    // The command line takes precedence.
    run("bus", &["read", "--bus", "sim:siko/ag02?node=5", "feeder", "1000", "--device", "none"])
        .on_stdout(0, "1000:00");
    run("boot", &["boot"]).on_stdout(0, "node 5: has booted");
}

const BUSES: &str = r#"
[bus.left]
url = "sim:siko/ag02?node=5"
bit-rate = "500 kbit/s"

[bus.right]
url = "sim:siko/ag03-1?node=5"

[kind.drive]
sheet = "siko/ag03-1"
guarding = "100 ms"

[node.feeder]
id = 5
bus = "right"
kind = "drive"
settings = { 2412 = "2.5 mm" }

[node.cutter]
id = 5
bus = "left"
sheet = "siko/ag02"
guarding = "100 ms"
"#;

#[test]
fn a_machine_has_several_buses() {
    let run = |name: &str, args: &[&str]| in_machine(&format!("machine-buses-{name}"), BUSES, args);
    let check = run("check", &["machine", "check"]);
    check.on_stdout(0, "left: 1 node, 0 PDOs configured, the bus is busy for 0.");
    check.on_stdout(0, "right: 1 node");
    // A node implies its bus; without a node, the bus is named.
    run("feeder", &["read", "feeder", "1008"]).on_stdout(0, "AG03");
    run("cutter", &["check", "cutter"]).on_stdout(0, "as the data sheet says");
    run("scan", &["scan", "--bus", "left"]).on_stdout(0, "siko/ag02");
    run("sim", &["scan", "--bus=sim#right"]).on_stdout(0, "siko/ag03-1");
    run("sim-node", &["check", "--bus", "sim", "cutter"]).on_stdout(0, "as the data sheet says");
    run("boot", &["boot", "--bus", "right"]).on_stdout(0, "node 5: has booted");
    run("which", &["boot", "--bus", "sim"]).on_stderr(2, "the machine has several buses: left, right");
    run("plan", &["machine", "plan", "--of", "feeder", "--live"]).on_stdout(1, "2412:00 Spindle Pitch = 2.50 mm");
    run("apply", &["apply", "feeder", "--dry-run"]).on_stdout(0, "2412:00 Spindle Pitch = 2.50 mm, was ");
}

#[test]
fn a_node_without_node_id_gets_it_by_lss_when_the_machine_boots() {
    let folder = folder("machine-lss");
    std::fs::write(folder.join("sensor.eds"), include_str!("../sensor.eds")).unwrap();
    let machine = |more: &str| {
        let identity = "identity = { vendor = 1, product = 2, revision = 3, serial = 4 }";
        let text = format!("[node.sensor]\nid = 7\nlss = true\nsheet = \"sensor.eds\"\n{identity}\n{more}");
        std::fs::write(folder.join("machine.toml"), text).unwrap();
        lexican_in(&folder, &["boot", "--bus", "sim"])
    };
    let boot = machine("");
    boot.on_stdout(0, "node 7: sensor has got its node-ID by LSS\nnode 7: has booted\n");
    // A node that has booted is asked for its version.
    machine("software = \"9.9\"\n").on_stderr(1, "node 7: the software version of sensor is not 9.9: ");
}

/// A machine whose devices are not as delivered.
const CONFIGURED: &str = "\
[bus]
manager = 127
heartbeat = \"200 ms\"

[node.a]
id = 5
sheet = \"siko/ag03-1\"
guarding = \"100 ms\"
retry = 4
tpdo.1 = { every = \"50 ms\" }
tpdo.3 = \"off\"
settings = { 2412 = \"2.5 mm\" }

[node.b]
id = 6
sheet = \"kollmorgen/akd\"
heartbeat = \"200 ms\"
tpdo.1 = { map = [\"statusword\", \"606C\"], cob-id = 0x1A6, transmission = \"sync 4\" }
rpdo.2 = \"off\"
settings = { 6081 = 5000 }

[node.c]
id = 8
sheet = \"MACHINES/encoder.eds\"
heartbeat = \"50 ms\"
";
const MACHINES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/machines");

/// The file made from what was found on the bus of a machine, and its comparison with that bus.
fn found(folder: &Path, machine: &str) -> (String, Run) {
    let bus = format!("sim:{}", folder.join(machine).display());
    lexican_in(folder, &["machine", "new", "--bus", &bus, "--sheets", MACHINES, "-o", "machine.toml"]).on_stdout(0, "");
    lexican_in(folder, &["machine", "check"]).on_stdout(0, "\n0 errors,");
    let written = std::fs::read_to_string(folder.join("machine.toml")).unwrap();
    (written, lexican_in(folder, &["machine", "plan", "--live"]))
}

#[test]
fn a_boot_of_a_machine_that_was_found_changes_nothing() {
    let folder = folder("machine-new");
    // The devices of the simulated bus have the values of their DCFs.
    std::fs::write(folder.join("configured.toml"), CONFIGURED.replace("MACHINES", MACHINES)).unwrap();
    let export = ["machine", "export", "configured.toml", "--folder", "dcfs", "--format", "dcf,cpj"];
    lexican_in(&folder, &export).on_stdout(0, "dcfs/a.dcf\n");
    let nodes = [("a", 5), ("b", 6), ("c", 8)];
    let bus = nodes.map(|(name, id)| format!("[node.{name}]\nid = {id}\nsheet = \"dcfs/{name}.dcf\"\n"));
    std::fs::write(folder.join("bus.toml"), bus.concat()).unwrap();
    let (written, plan) = found(&folder, "bus.toml");
    for lines in [
        "\nbit-rate = \"500 kbit/s\"\nmanager = 127\nheartbeat = \"200 ms\"\n",
        "guarding = \"100 ms\"\nretry = 4\ntpdo.1 = { every = \"50 ms\" }\ntpdo.3 = \"off\"\n",
        "\n[node.drive5.settings]\n\"Spindle Pitch\" = \"2.50 mm\"\n",
        "tpdo.1 = { map = [\"Statusword\", \"Velocity actual value\"], cob-id = 0x1A6, transmission = \"sync 4\" }\n",
        "rpdo.2 = \"off\"\n",
        "\"Profile velocity\" = \"5000 units\"\n",
        "[node.encoder8]\nid = 8\nsheet = \"",
    ] {
        assert!(written.contains(lines), "{lines}\n{written}");
    }
    plan.on_stdout(0, "1A00:02");
    // Their DCFs give the same result, and so do the list of them and their backups.
    let named = written.replace(".drive5", ".a").replace(".drive6", ".b").replace(".encoder8", ".c");
    let sheet = format!("8={MACHINES}/encoder.eds");
    let devices = ["--device", "5=siko/ag03-1", "--device", "6=kollmorgen/akd", "--device", &sheet];
    let backup = ["backup", "--bus", "sim:bus.toml", "5,6,8", "-o", "backups/{node}.dcf"];
    std::fs::create_dir_all(folder.join("backups")).unwrap();
    lexican_in(&folder, &[&backup[..], &devices[..]].concat()).on_stdout(0, "node 8: ");
    for (source, names) in [("dcfs", &named), ("dcfs/nodelist.cpj", &named), ("backups", &written)] {
        lexican_in(&folder, &["machine", "new", source, "--sheets", MACHINES, "-o", "again.toml", "--force"])
            .on_stdout(0, "");
        let again = std::fs::read_to_string(folder.join("again.toml")).unwrap();
        assert!(again.lines().all(|line| names.lines().any(|other| other == line)), "{again}\n{names}");
        assert_eq!(again.matches("[node.").count(), 5, "{again}");
        lexican_in(&folder, &["machine", "plan", "again.toml", "--bus", "sim:bus.toml"]).on_stdout(0, "(as it is)");
    }
    // Without its data sheet, a node is described by its own objects.
    lexican_in(&folder, &["machine", "new", "--bus", "sim:bus.toml"])
        .on_stdout(0, "[node.node8]\nid = 8\nidentity = { vendor = 0x4C58, product = 0x406, revision = 0x10000 }\n");
}

#[test]
fn the_period_of_sync_is_measured() {
    let folder = folder("machine-new-sync");
    let sheet = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/conformance/device.eds");
    let producer = "[simulate.clock]\nsettings = { 1005 = \"raw:0x40000080\", 1006 = \"raw:10000\" }\n";
    let bus = format!("[node.clock]\nid = 5\nsheet = {sheet:?}\n{producer}");
    std::fs::write(folder.join("bus.toml"), bus).unwrap();
    lexican_in(&folder, &["machine", "new", "--bus", "sim:bus.toml"]).on_stdout(0, "\nsync = \"10 ms\"\n");
}

#[test]
fn a_bus_yml_becomes_a_machine() {
    let folder = folder("machine-new-yml");
    let run = |text: &str| {
        std::fs::create_dir_all(folder.join("config")).unwrap();
        std::fs::write(folder.join("config/bus.yml"), text).unwrap();
        std::fs::copy(Path::new(MACHINES).join("io.eds"), folder.join("config/io.eds")).unwrap();
        lexican_in(&folder, &["machine", "new", "config/bus.yml", "-o", "machine.toml", "--force"])
    };
    let slave = "master: {node_id: 1}\nio:\n  node_id: 7\n  dcf: io.eds\n";
    run(&format!("{slave}  hartbeat_producer: 100\n")).on_stderr(0, "did you mean `heartbeat_producer`?");
    let written = std::fs::read_to_string(folder.join("machine.toml")).unwrap();
    // dcfgen has the revision and serial number in the data sheet checked.
    let node = "[node.io]\nid = 7\nsheet = \"config/io.eds\"\nidentity = { revision = 0x10000, serial = 0x1 }\n";
    assert!(written.contains(node), "{written}");
    run(&format!("{slave}  sdo: [{{index: 0x9999}}]\n"))
        .on_stderr(1, "the data sheet has no 9999:00, which dcfgen does not write");
    lexican_in(&folder, &["machine", "new"]).on_stderr(2, "from what?");
    lexican_in(&folder, &["machine", "new", "config"]).on_stderr(2, "config has no DCF of a node");
}

#[test]
fn the_line_is_found_as_it_is() {
    let folder = folder("machine-new-line");
    let line = std::fs::read_to_string(Path::new(MACHINES).join("line.toml")).unwrap();
    let sheets = ["io.eds", "encoder.eds"];
    let line = sheets.iter().fold(line, |line, sheet| line.replace(sheet, &format!("{MACHINES}/{sheet}")));
    std::fs::write(folder.join("line.toml"), line).unwrap();
    let (written, plan) = found(&folder, "line.toml");
    let nodes = written.lines().filter(|line| line.starts_with("[node.") && !line.ends_with(".settings]"));
    assert_eq!(nodes.count(), 6, "{written}");
    plan.on_stdout(0, "(as it is)");
}
