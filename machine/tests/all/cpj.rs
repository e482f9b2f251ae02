//! Converts a machine to a list of nodes with their DCFs (CiA 306-3) and back.

use lexican_eds::Source;
use lexican_machine::{Cpj, Files, Machine};

use crate::{machine, sound};

/// The machine of a CPJ, and the findings, one on each line. The data sheet of each node is its DCF.
fn read(text: &str, files: &[(&str, &str)]) -> (String, Vec<String>) {
    let read =
        Cpj::read(Source::new("a.cpj", text), Files::Embedded(files), &|path, dcf| (path.to_owned(), dcf.clone()));
    let line = |finding: &lexican_eds::Diagnostic| {
        let help = finding.help.as_ref().map(|help| format!(" | {help}")).unwrap_or_default();
        format!("{}{help}", finding.render_short(&read.input).replacen("a.cpj:", "", 1))
    };
    (read.draft.text(), read.findings.iter().map(line).collect())
}

/// The machine from the exported files of a machine.
fn again(machine: &Machine) -> (Machine, String) {
    let list = machine.node_list();
    let dcf = |machine: &Machine, node| machine.dcf(node).unwrap_or_default();
    let dcfs: Vec<(String, String)> = machine
        .buses()
        .flat_map(|machine| machine.nodes.iter().map(|node| (format!("{}.dcf", node.name.value), dcf(machine, node))))
        .collect();
    let files: Vec<_> = dcfs.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let (text, found) = read(&list, &files);
    assert!(found.is_empty(), "{list}{found:#?}");
    let again = Machine::parse(Source::new("machine.toml", text.as_str()), Files::Embedded(&files));
    assert!(!again.findings.has_errors(), "{text}{}", again.findings.render(&again.input));
    (again, list)
}

/// All statements about the nodes of a bus, ordered by node-ID.
fn nodes(machine: &Machine) -> Vec<String> {
    let mut nodes: Vec<_> = machine.nodes.iter().collect();
    nodes.sort_by_key(|node| node.id);
    let writes = |node| {
        let writes = machine.writes(node).into_iter();
        writes.map(|write| (write.address, write.data)).collect::<std::collections::BTreeMap<_, _>>()
    };
    nodes
        .iter()
        .map(|node| format!("{:?} {:?} {:?} {:?}", node.id, node.name.value, node.designator, writes(node)))
        .collect()
}

#[test]
fn a_machine_comes_back_from_its_list_of_nodes() {
    let press = include_str!("press.toml").replace("[node.left]\n", "[node.left]\ndesignator = \"-A3\"\n");
    let press = sound(&press.replacen("[bus]\n", "[bus]\ndesignator = \"=N1\"\n", 1));
    let (again, list) = again(&press);
    assert!(list.contains("\r\nNetRefd==N1\r\n") && list.contains("\r\nNode5Refd=-A3\r\n"), "{list}");
    assert_eq!(again.name.as_deref(), Some("press 3"));
    assert_eq!((again.bus.bit_rate, &again.bus.designator), (press.bus.bit_rate, &press.bus.designator));
    assert_eq!(nodes(&again), nodes(&press));
}

#[test]
fn each_network_is_a_bus() {
    let text = "[bus.left]\nbit-rate = \"250 kbit/s\"\n[bus.right]\ndesignator = \"-W2\"\n\
        [node.a]\nid = 5\nbus = \"left\"\nsheet = \"siko/ag03-1\"\nsettings = { 2412 = \"2.5 mm\" }\n\
        [node.b]\nid = 5\nbus = \"right\"\nsheet = \"siko/ag03-1\"\n[node.meter]\nid = 9\nbus = \"right\"\n";
    let two = machine(text);
    let (again, list) = again(&two);
    let network = "[Topology2]\r\nNetName=right\r\nNetRefd=-W2\r\nNodes=0x02\r\nNode5Present=0x01\r\nNode5Name=b\r\n";
    assert!(list.starts_with("[Topology]\r\nNetName=left\r\nNodes=0x01\r\n") && list.contains(network), "{list}");
    let buses = |machine: &Machine| -> Vec<_> {
        let bus = |it: &Machine| format!("{:?} {:?}", it.bus.name.as_ref().map(|name| &name.value), it.bus.designator);
        machine.buses().map(|machine| (bus(machine), nodes(machine))).collect()
    };
    assert_eq!(buses(&again), buses(&two));
    assert_eq!(again.bus.bit_rate, Some(250_000));
}

#[test]
fn what_a_machine_cannot_say_is_found() {
    let dcf = machine("[node.a]\nid = 5\nsheet = \"siko/ag03-1\"\n");
    let dcf = dcf.dcf(&dcf.nodes[0]).unwrap().replace("NodeName=a\r\n", "NodeName=a\r\nNodeRefd=-A1\r\n");
    let one = |text: &str, wanted: &str, machine: &str| {
        let (written, found) = read(text, &[("dcf/a.dcf", &dcf)]);
        match wanted {
            "" => assert!(found.is_empty(), "{text}\n{found:#?}"),
            _ => assert!(found.len() == 1 && found[0].contains(wanted), "{text}\nwanted {wanted}\nfound {found:#?}"),
        }
        assert!(written.contains(machine), "{text}\nwanted {machine}\nfound {written}");
    };
    let node = "[topology]\nNodes=0x01\nNode5Present=0x01\nNode5DCFName=a.dcf\nEDSBaseName=dcf";
    one(node, "", "[node.a]\nid = 5\nsheet = \"dcf/a.dcf\"\ndesignator = \"-A1\"\n");
    one(
        &node.replace("=a.dcf", "=dcf\\a.dcf").replace("=dcf\n", "=\n").replace("EDSBaseName=dcf", ""),
        "",
        "[node.a]\n",
    );
    one(
        &format!("{node}\nNode5Name=x\n"),
        "3:1: warning[cpj::differs]: the DCF of node 5 says NodeName=a",
        "[node.x]\n",
    );
    one(
        &format!("{node}\nNode5Refd=-A2"),
        "says NodeRefd=-A1; the list of the nodes counts: -A2",
        "designator = \"-A2\"\n",
    );
    one(&node.replace("Node5", "Node6").replace("Nodes=0x01\n", ""), "the DCF of node 6 says NodeID=5", "id = 6\n");
    one(&node.replace("a.dcf", "b.dcf"), "4:1: error[cpj::sheet]: ", "[node.node5]\nid = 5\n");
    one(&node.replace("=0x01\nNode5P", "=3\nNode5P"), "Nodes=3, but there are 1 present | Nodes=0x01", "id = 5\n");
    one("[Topology]\nNode5Present=0", "node 5 is left out: it is not present", "");
    one("[Topology]\nNode5Name=a", "it does not say that it is present | Node5Present=0x01", "");
    one("[Topology]\nNode128Present=1", "unknown key `Node128Present`", "");
    one("[Topology]\nNetNam=a", "unknown key `NetNam`, which is left out | did you mean `NetName`?", "");
    one(
        "[Topology]\nNetName=a\nnetname=b",
        "3:1: warning[cpj::key]: `netname` comes again",
        "[machine]\nname = \"a\"\n",
    );
    one("[Topology]\nNetName=a\n[TOPOLOGY1]", "[TOPOLOGY1] comes again", "[machine]\n");
    one("[Topology]\nNetName=a\n[Drawing]\na=b", "[Drawing] is left out", "[machine]\n");
    one("", "error[cpj::section]: this is no CPJ", "");
    one(
        "[Topology]\nNode5Present=1\nNode5Name=a.b",
        "\"a.b\" cannot be the name of this node, which is called \"a-b\"",
        "[node.a-b]",
    );
}
