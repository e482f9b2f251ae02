//! A machine from its file to the replacement of a drive: every command names nodes by their names.
#![cfg(unix)]

use std::fs;
use std::path::Path;

use crate::common::{folder, lexican_in};
use crate::simulation::Simulation;

const MACHINE: &str = "\
[machine]
name = \"labeller 12\"

[bus]
bit-rate = \"500 kbit/s\"
manager = 127
heartbeat = \"200 ms\"

# They watch nobody: they are guarded instead.
[kind.siko]
guarding = \"100 ms\"
settings = { 1017 = \"0 ms\", 2412 = \"2.5 mm\" }

[node.feeder]
id = 5
kind = \"siko\"
sheet = \"siko/ag03-1\"

[node.width]
id = 9
kind = \"siko\"
sheet = \"siko/ag02\"

[node.cutter]
id = 6
sheet = \"kollmorgen/akd\"
heartbeat = \"100 ms\"

[node.io]
id = 7
sheet = \"io.eds\"
heartbeat = \"100 ms\"

[node.encoder]
id = 8
sheet = \"encoder.eds\"
heartbeat = \"100 ms\"
";

#[test]
fn a_machine_is_checked_booted_saved_and_repaired_by_names() {
    let folder = folder("machine-life");
    let machines = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines");
    for sheet in ["io.eds", "encoder.eds"] {
        fs::copy(machines.join(sheet), folder.join(sheet)).unwrap();
    }
    fs::write(folder.join("machine.toml"), MACHINE).unwrap();
    lexican_in(&folder, &["machine", "check"]).on_stdout(0, "5 nodes, 0 PDOs configured");
    lexican_in(&folder, &["machine", "plan", "--of", "feeder"])
        .on_stdout(0, "2412:00 Spindle Pitch = 2.50 mm  [setting]");

    let mut machine = Simulation::begin(&folder, &["machine.toml", "--bus", "pty:2"]);
    let buses = machine.buses.clone();
    let run = |command: &str, args: &[&str]| {
        lexican_in(&folder, &[&command.split(' ').collect::<Vec<_>>()[..], &["--bus", &buses[0]], args].concat())
    };
    run("scan", &[]).on_stdout(0, "siko/ag02");
    run("boot", &[]).on_stdout(0, "the network is ready");
    // The second time, everything is already as planned.
    let live = run("machine plan", &["--live"]);
    assert!(live.code == Some(0) && !live.stdout.contains("(now"), "{live}");
    run("write", &["feeder", "2410/5", "7"]).on_stdout(0, "= 7");
    run("backup", &["-o", "labeller.tar"]).on_stdout(0, "5 nodes in labeller.tar");
    run("compare", &["labeller.tar", "machine"]).on_stdout(0, ", the same");

    // The drive fails, and the machine without it differs from the backup.
    machine.asks("feeder: power off", "state");
    run("compare", &["labeller.tar", "machine", "--timeout", "100ms"]).on_stdout(1, "feeder: not in machine");
    let gone = run("replace", &["feeder", "-o", "none.txt", "--timeout", "100ms"]);
    gone.on_stderr(1, "feeder HAS NOT BEEN REPLACED: there is no device");
    // Another kind of drive replaces it by mistake.
    let wrong = Simulation::begin(&folder, &["siko/ag02", "--node", "5", "--bus", &buses[1]]);
    run("replace", &["feeder", "-o", "wrong.txt"]).on_stderr(1, "it is another device");
    drop(wrong);
    let _new = Simulation::begin(&folder, &["siko/ag03-1", "--node", "5", "--bus", &buses[1]]);
    run("compare", &["labeller.tar", "machine"]).on_stdout(1, "feeder: 2412:00 Spindle Pitch");
    let replaced = run("replace", &["feeder", "-o", "feeder.txt"]);
    replaced.on_stdout(0, "feeder: booted as in the machine; when the manager fell silent, it noticed after ");
    replaced.on_stdout(0, "feeder has been replaced; see feeder.txt");
    run("compare", &["labeller.tar", "machine"]).on_stdout(0, ", the same");
    let report = fs::read_to_string(folder.join("feeder.txt")).unwrap();
    assert!(report.starts_with("Replacement of feeder (node 5) of labeller 12, 20"), "{report}");
    assert!(
        report.contains("all as in the backup\n") && report.ends_with("\n\nfeeder has been replaced\n"),
        "{report}"
    );

    fs::write(folder.join("first.seq"), "boot\ndrive feeder move-to 0.2 mm --enable\ncheck encoder\n").unwrap();
    let first = run("run", &["first.seq"]);
    first.on_stdout(0, "node 5: it has reached its target");
    first.on_stdout(0, "3 lines in ");
}
