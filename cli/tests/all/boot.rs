//! `lexican boot`: a network on a simulated bus.

use crate::common::{Run, folder, lexican, lexican_in};

const DRIVE: &str = "sim:siko/ag03-1?node=5";

fn boot(args: &[&str]) -> Run {
    lexican(&[&["boot", "--bus", DRIVE], args].concat())
}

#[test]
fn a_network_of_flags_is_booted() {
    for args in [
        &["--node", "5"][..],
        &["--node", "5=siko/ag03-1", "--heartbeat", "100ms"],
        &["--node", "5", "--guarding", "100ms", "--for", "2s"],
        &["--node", "5", "--optional", "6"],
    ] {
        let run = boot(args);
        assert_eq!(run.code, Some(0), "{run}");
        assert!(run.stdout.starts_with("node 5: has booted\nthe network is ready\n"), "{run}");
    }
}

#[test]
fn a_network_that_is_not_ready_is_explained() {
    let run = boot(&["--node", "5", "--node", "7", "--json"]);
    assert_eq!(run.code, Some(1));
    assert!(run.stderr.contains("the network is not ready: node 7 has not booted: the node does not report its"));
    let events: Vec<serde_json::Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&events[0]["event"], &events[0]["node"]), (&"booted".into(), &5.into()));
    assert_eq!((&events[1]["event"], &events[1]["mandatory"]), (&"failed".into(), &true.into()));
    boot(&["--node", "7", "--boot-time", "100ms"]).on_stderr(1, "node 7 has not booted in time");
}

#[test]
fn a_machine_is_booted() {
    let folder = folder("boot");
    let boot_on = |bus: &str, text: &str| {
        std::fs::write(folder.join("machine.toml"), text).unwrap();
        lexican_in(&folder, &["boot", "--bus", bus, "--for", "1s"])
    };
    let boot = |text: &str| boot_on(DRIVE, text);
    let node = "[node.feeder]\nid = 5\nsheet = 'siko/ag03-1'\nsettings = { 6060 = 'profile velocity' }\n";
    let run = boot(&format!("[bus]\nstart-all = true\non-loss = 'stop-all'\n{node}heartbeat = '100ms'\n"));
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "node 5: has booted\nthe network is ready\n"));
    // The AG02 accepts only writes of four bytes (manual, chapter 10.2.7).
    let run = boot_on("sim:siko/ag02?node=5", &node.replace("ag03-1", "ag02"));
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "node 5: has booted\nthe network is ready\n"));
    // The node is asked for its state once, which begins its life guarding, and never again: it reports why it falls
    // back.
    let guarded = "[node.cutter]\nid = 5\nsheet = 'kollmorgen/akd'\nsettings = { 1017 = 0, 100C = 50, 100D = 2 }\n";
    let run = boot_on("sim:kollmorgen/akd?node=5", guarded);
    assert!(run.stdout.contains("node 5: EMCY 8130h: "), "{run}");
    // A node with `guarding` is monitored with the same time, and stays.
    let run =
        boot_on("sim:kollmorgen/akd?node=5", "[node.cutter]\nid = 5\nsheet = 'kollmorgen/akd'\nguarding = '50ms'\n");
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "node 5: has booted\nthe network is ready\n"));
    // The data sheet of another device.
    let other = include_str!("../sensor.eds").replace("DefaultValue=0\n\n[1001]", "DefaultValue=0x191\n\n[1001]");
    std::fs::write(folder.join("sensor.eds"), other).unwrap();
    let run = boot("[node.sensor]\nid = 5\nsheet = 'sensor.eds'\n");
    assert!(run.stderr.contains("but siko/ag03-1 (device type 00000192h, vendor 195h"), "{run}");
    run.on_stdout(1, "the device type (1000h) is 00000192h, and not 00000191h");
    for (text, words) in [
        ("", "the machine has no nodes"),
        ("[node", "machine.toml:1:"),
        ("[node.a]\nid = 5\nhartbeat = 100\n", "did you mean `heartbeat`?"),
        ("[node.a]\nid = 5\ndcf = 'missing.bin'\n", "missing.bin: no such file"),
        (&node.replace("profile velocity", "9"), "6060"),
    ] {
        boot(text).on_stderr(2, words);
    }
}
