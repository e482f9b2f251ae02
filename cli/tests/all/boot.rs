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
fn a_network_in_a_file_is_booted() {
    let folder = folder("boot");
    let node = "[[node]]\nid = 5\ndevice = 'siko/ag03-1'\nsettings = ['6060 = profile velocity']\n";
    let boot = |text: &str| {
        std::fs::write(folder.join("machine.toml"), text).unwrap();
        lexican_in(&folder, &["boot", "--bus", DRIVE, "machine.toml"])
    };
    let run = boot(&format!("start-all = true\non-loss = 'stop-all'\n{node}heartbeat = 100\n"));
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "node 5: has booted\nthe network is ready\n"));
    // The AG02 takes writes of four bytes only (manual, chapter 10.2.7).
    let four_bytes = "[[node]]\nid = 5\ndevice = 'siko/ag02'\nsettings = ['6060 = profile velocity']\n";
    std::fs::write(folder.join("machine.toml"), four_bytes).unwrap();
    let run = lexican_in(&folder, &["boot", "--bus", "sim:siko/ag02?node=5", "machine.toml"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "node 5: has booted\nthe network is ready\n"));
    // It is asked for its state once, which begins its life guarding, and never again: it says why it falls back.
    let guarded = "[[node]]\nid = 5\ndevice = 'kollmorgen/akd'\nsettings = ['1017 = 0', '100C = 50', '100D = 2']\n";
    std::fs::write(folder.join("machine.toml"), guarded).unwrap();
    let run = lexican_in(&folder, &["boot", "--bus", "sim:kollmorgen/akd?node=5", "machine.toml", "--for", "1s"]);
    assert!(run.stdout.contains("node 5: EMCY 8130h: "), "{run}");
    // The device refuses its settings, or is another one.
    let run = boot(&node.replace("6060 = profile velocity", "6060 = 9"));
    run.on_stdout(1, "node 5: entry 1 of the configuration failed: 6060:00");
    let other = include_str!("../sensor.eds").replace("DefaultValue=0\n\n[1001]", "DefaultValue=0x191\n\n[1001]");
    std::fs::write(folder.join("sensor.eds"), other).unwrap();
    let run = boot("[[node]]\nid = 5\ndevice = 'sensor.eds'\n");
    assert!(
        run.stderr.contains("node 5 is not sensor.eds, but siko/ag03-1 (device type 00000192h, vendor 195h"),
        "{run}"
    );
    run.on_stdout(1, "the device type (1000h) is 00000192h, and not 00000191h");
    for (text, words) in [
        ("", "it lists no nodes"),
        ("[[node", "machine.toml:1: "),
        ("[[node]]\nid = 5\nhartbeat = 100\n", "machine.toml:3: unknown field `hartbeat`"),
        ("[[node]]\nid = 5\ndcf = 'missing.bin'\n", "missing.bin: no such file"),
    ] {
        boot(text).on_stderr(2, words);
    }
}
