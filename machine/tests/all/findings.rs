//! Every mistake in a file is reported, with its line and a remedy.

use crate::machine;

/// The findings, one on each line.
fn findings(text: &str) -> Vec<String> {
    let machine = machine(text);
    let line = |finding: &lexican_eds::Diagnostic| {
        let help = finding.help.as_ref().map(|help| format!(" | {help}")).unwrap_or_default();
        format!("{}{help}", finding.render_short(&machine.input).replacen("machine.toml:", "", 1))
    };
    machine.findings.iter().map(line).collect()
}

/// Checks some lines of a file for a part of their only finding.
#[track_caller]
fn check(lines: &str, wanted: &str) {
    let found = findings(lines);
    assert!(found.len() == 1 && found[0].contains(wanted), "{lines}\nwanted {wanted}\nfound {found:#?}");
}

const GUARDED: &str = "guarding = \"100 ms\"\nsheet = \"siko/ag03-1\"\n";

#[test]
fn the_wrong_key_or_value_is_named_with_what_is_meant() {
    let node = |lines: &str| format!("[node.feeder]\nid = 5\n{GUARDED}{lines}");
    check("[nod.feeder]\nid = 5", "1:2: error[machine::key]: unknown section `nod` | did you mean `node`?");
    check(
        &node("hartbeat = \"1 s\""),
        "5:1: error[machine::key]: unknown field `hartbeat` | did you mean `heartbeat`?",
    );
    check(&node("optional = 1"), "5:12: error[machine::value]: invalid type: integer `1`, expected a boolean");
    check("[node.feeder]\nid = 5\nguarding = 100", "3:12: error[machine::value]: 100 of what? write \"100 ms\"");
    check("[node.feeder]\nid = 128", "2:6: error[machine::value]: 128 is not a node-ID");
    check("[node.feeder]\nsheet = \"siko/ag03-1\"", "1:7: error[machine::node-id]: feeder has no node-ID");
    check("[node.manager]\nid = 5", "\"manager\" cannot be the name of a node");
    check(
        "[node.feeder]\nid = 5\nsheet = \"siko/ag03-3\"",
        "3:9: error[machine::sheet]: no file and no known device is called \"siko/ag03-3\" | did you mean siko/ag03-1",
    );
    check("[bus]\nbit-rate = 500\n[node.io]\nid = 1", "500 of what? write \"500 kbit/s\"");
    check("[bus]\non-loss = \"reset\"\n[node.io]\nid = 1", "| did you mean `reset-all`?");
    check(&node("[kind.a]\n[node.b]\nid = 6\nkind = \"aa\""), "there is no kind \"aa\"");
    check(&node("[node.b]\nid = 5"), "6:6: error[machine::node-id]: feeder and b have the same node-ID");
    check("", "the machine has no nodes");
}

#[test]
fn what_cannot_be_simulated_is_named() {
    let io = "[node.io]\nid = 1\nsheet = \"siko/ag03-1\"\nguarding = \"100 ms\"\n";
    for (lines, wanted) in [
        ("[simulate.o]\npower = \"off\"", "5:11: error[machine::name]: there is no node \"o\""),
        ("[simulate.io]\nsettings = { 2FFF = 1 }", "6:21: error[machine::setting]: the data sheet has no 2FFF:00"),
        ("[simulate.io]\nscript = \"a.toml\"", "6:10: error[machine::script]: cannot read a.toml"),
        ("[[fault]]\naction = \"burn\"", "6:10: error[machine::value]: unknown variant `burn`"),
        ("[[fault]]\naction = \"lose\"\nfrom = \"i\"", "7:8: error[machine::name]: there is no node \"i\""),
        ("[[fault]]\naction = \"lose\"\nevery = 0", "7:9: error[machine::value]: "),
        ("[[fault]]\naction = \"lose\"\ncob-id = 0x20000000", "7:10: error[machine::fault]: 20000000h is no COB-ID"),
        ("[[fault]]\naction = \"delay\"", "6:10: error[machine::fault]: a delay needs its time: delay = \"20 ms\""),
        ("[[fault]]\naction = \"lose\"\ndelay = \"5 ms\"", "the time of a delay belongs to action = \"delay\""),
        ("[[fault]]\naction = \"lose\"\nevery = 2\nin-a-row = 3", "there cannot be more in a row"),
    ] {
        check(&format!("{io}{lines}"), wanted);
    }
}

#[test]
fn every_mistake_is_found_in_one_go() {
    let found = findings("[bus]\nsink = 1\nsync = 10\n[node.a]\nid = 0\nhart = 1\n[node.b]\nid = 300");
    assert_eq!(found.len(), 5, "{found:#?}");
}

#[test]
fn parameters_are_those_that_the_data_sheet_allows() {
    let node = |settings: &str| format!("[node.feeder]\nid = 5\n{GUARDED}[node.feeder.settings]\n{settings}");
    check(
        &node("\"modes of operration\" = 1"),
        "6:1: error[machine::setting]: the data sheet names no object \"modes of operration\" | did you mean ",
    );
    check(&node("6060 = 300"), "6:8: error[machine::setting]: ");
    check(&node("6040 = 15"), "it is a command and no parameter");
    check(&node("2412 = \"raw:1\"\n\"2412:00\" = \"raw:2\""), "2412:00 is set twice");
    check(
        "[node.a]\nid = 5\nsettings = { 6060 = 1 }",
        "3:14: error[machine::sheet]: a has no data sheet, which this is about | sheet = ",
    );
}

#[test]
fn wires_that_do_not_fit_are_named() {
    let two = |wires: &str| {
        format!(
            "[node.a]\nid = 5\n{GUARDED}[node.b]\nid = 6\nguarding = \"100 ms\"\nsheet = \"kollmorgen/akd\"\n[wire]\n{wires}"
        )
    };
    check(&two("\"a.6041\" = \"c.6040\""), "there is no node \"c\"");
    check(&two("\"a\" = \"manager\""), "\"a\" is no end of a wire | an end of a wire is \"manager\", or NODE.OBJECT");
    check(&two("\"manager\" = \"manager\""), "the manager sends nothing to itself");
    check(&two("\"a.6041\" = \"b.607A\""), "a sends 16 bits (6041:00), b takes 32 (607A:00)");
    check(&two("\"a.1008\" = \"manager\""), "cannot be mapped into a PDO");
    check(&two("\"a.statuswrod\" = \"manager\""), "names no object \"statuswrod\" | did you mean ");
    check(
        &two("\"a.6041\" = { to = [\"manager\"], transmission = \"sync\" }"),
        "this goes with SYNC, which nobody sends | give its period",
    );
    check(&two("\"a.6041\" = { to = [\"manager\"], transmission = \"sink\" }"), "\"sink\" is no transmission type");
}

#[test]
fn what_cannot_work_together_is_found() {
    let sheet = "guarding = \"100 ms\"\nsheet = \"siko/ag03-1\"\n";
    let same = format!(
        "[node.a]\nid = 5\n{sheet}tpdo.1 = {{ cob-id = 0x1A0 }}\n[node.b]\nid = 6\n{sheet}tpdo.1 = {{ cob-id = 0x1A0 }}"
    );
    check(&same, "b.TPDO1 is sent with 1A0h, as a.TPDO1");
    check(
        "[node.a]\nid = 5\nsheet = \"siko/ag03-1\"",
        "warning[machine::protection]: a is a drive that does not notice when its manager is gone",
    );
    let busy = "[bus]\nbit-rate = \"10 kbit/s\"\n[node.a]\nid = 5\nheartbeat = \"2 ms\"";
    check(busy, "the bus is busy for");
    check("[bus]\nheartbeat = \"1 s\"\n[node.a]\nid = 5", "a manager without node-ID has no heartbeat");
    check("[bus]\nmanager = 5\n[node.a]\nid = 5", "a has the node-ID of the manager");
    check("[node.a]\nid = 5\nheartbeat = \"1 s\"\nguarding = \"1 s\"", "a node has either heartbeat or guarding");
}

#[test]
fn limits_of_the_machine_are_those_of_the_node() {
    let node = |lines: &str| format!("[node.feeder]\nid = 5\n{GUARDED}{lines}");
    let travel = "settings = { 2412 = \"1.00 mm\" }\nlimits = { 607A = [\"0 mm\", \"480 mm\"] }";
    let machine = machine(&node(travel));
    assert!(machine.findings.is_empty(), "{:?}", findings(&node(travel)));
    assert_eq!(machine.nodes[0].sheet.as_ref().unwrap().errors().count(), 0);
    let target = machine.nodes[0].device().unwrap().entry(0x607A, 0).unwrap();
    let [low, high] = [&target.low, &target.high].map(|it| it.as_ref().and_then(lexican_eds::model::Value::as_integer));
    assert_eq!((low, high), (Some(0), Some(48_000)));
    check(
        &node("limits = { 2412 = [\"0 mm\", \"2 mm\"] }\nsettings = { 2412 = \"2.5 mm\" }"),
        "machine::setting]: 2.50 mm",
    );
    check(&node("limits = { 607 = [0, 1] }"), "5:12: error[machine::limit]: ");
    check(&node("limits = { 6060 = [2, 1] }"), "5:19: error[machine::limit]: the lowest value comes first");
    check(&node("limits = { 2412 = [0, \"1 km\"] }"), "5:19: error[machine::limit]: ");
}

#[test]
fn a_drive_is_protected_or_said_not_to_be() {
    let drive = "[node.a]\nid = 5\nsheet = \"kollmorgen/akd\"\n";
    let bus = "[bus]\nmanager = 127\nheartbeat = \"200 ms\"\n";
    assert_eq!(findings(&format!("{drive}protection = \"none\"")), Vec::<String>::new());
    check(&format!("{drive}protection = \"1 s\""), "machine::protection]: a cannot watch its manager");
    check(&format!("{bus}{drive}protection = \"200 ms\""), "machine::protection]: the protection of a is no longer");
    let writes = |protection: &str| {
        let machine = machine(&format!("{bus}{drive}{protection}"));
        assert!(machine.findings.is_empty());
        machine
            .writes(&machine.nodes[0])
            .into_iter()
            .map(|write| (write.address.index(), write.data))
            .collect::<Vec<_>>()
    };
    let watching = |ms: u16| vec![(0x1016, [&ms.to_le_bytes()[..], &[127, 0]].concat())];
    assert_eq!(writes(""), watching(600));
    assert_eq!(writes("protection = \"500 ms\""), watching(500));
    assert_eq!(writes("protection = \"none\""), []);
}

#[test]
fn a_node_by_lss_has_a_whole_identity() {
    let node = |identity: &str| format!("[node.io]\nid = 7\nlss = true\nidentity = {{ {identity} }}");
    let whole = machine(&node("vendor = 1, product = 2, revision = 3, serial = 4"));
    assert!(whole.findings.is_empty());
    assert_eq!(whole.nodes[0].lss.unwrap().serial, 4);
    check(
        &node("vendor = 1, product = 2, serial = 4"),
        "3:7: error[machine::lss]: LSS needs the node-ID, and all four",
    );
    check(&node("vendor = 1, product = 2, revision = \">= 3\", serial = 4"), "machine::lss");
    check("[node.io]\nid = 7\nidentity = { revision = \"3\" }", "\"3\" is no revision such as \">= 0x10002\"");
}

#[test]
fn a_machine_of_several_buses_says_where_its_nodes_are() {
    let node =
        |name: &str, bus: &str| format!("[node.{name}]\nid = 5\nsheet = \"siko/ag03-1\"\nguarding = \"100 ms\"\n{bus}");
    let buses = "[bus.left]\n[bus.right]\n";
    let two = format!("{buses}{}{}", node("a", "bus = \"left\"\n"), node("b", "bus = \"right\"\n"));
    assert_eq!(findings(&two), Vec::<String>::new());
    let machine = machine(&two);
    let on = |bus| machine.on(Some(bus)).unwrap().nodes[0].name.value.clone();
    assert_eq!([on("left"), on("right")], ["a", "b"]);
    assert_eq!(machine.on(None).unwrap_err().to_string(), "the machine has several buses: left, right");
    let right = machine.into_bus(Some("right")).unwrap();
    assert!(right.nodes[0].name.value == "b" && right.into_bus(None).is_ok());
    check(
        &format!("{two}[wire]\n\"a.6041\" = \"b.6040\""),
        "14:1: error[machine::wire]: this goes from one bus to another",
    );
    let one = format!("{buses}{}", node("b", "bus = \"right\"\n"));
    check(
        &format!("{one}{}", node("a", "")),
        "8:7: error[machine::bus]: on which bus is a? | bus = \"left\", or \"right\"",
    );
    check(
        &format!("{one}{}", node("a", "bus = \"lef\"")),
        "12:7: error[machine::bus]: there is no bus \"lef\" | did you mean `left`?",
    );
    check("[node.io]\nid = 7\nbus = \"left\"", "3:7: error[machine::bus]: there is no bus \"left\"");
}

#[test]
fn what_the_bench_shows_is_there() {
    let node = format!("[node.feeder]\nid = 5\n{GUARDED}");
    let shown =
        machine(&format!("{node}[bench]\nwatch = [\"feeder.statusword\"]\nplot = [\"feeder.6064\", \"feeder.tpdo1\"]"));
    assert!(shown.findings.is_empty());
    let shown: Vec<_> = shown.bench.iter().map(|it| format!("{} {} {}", it.node, it.signal, it.as_curve)).collect();
    assert_eq!(shown, ["5 6041:00 false", "5 6064:00 true", "5 tpdo1 true"]);
    check(
        &format!("{node}[bench]\nwatch = [\"feder.6041\"]"),
        "6:10: error[machine::name]: there is no node \"feder\"",
    );
    check(&format!("{node}[bench]\nsequences = [\"none.seq\"]"), "6:14: error[machine::bench]: cannot read none.seq");
    let filter = "filters.all = { nodes = \"feeder, fedeer\" }";
    let meant = "6:15: error[machine::name]: there is no node \"fedeer\" | did you mean `feeder`?";
    check(&format!("{node}[bench]\n{filter}"), meant);
    check(&format!("{node}[bench]\nwatch = [\"feeder.tpdo1\"]"), "6:10: error[machine::bench]: a PDO has curves");
    check(&format!("{node}[bench]\nplot = [\"feeder.statuswrod\"]"), "names no object \"statuswrod\" | did you mean");
}
