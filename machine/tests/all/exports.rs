//! Exports of a machine to other tools.

use std::collections::BTreeMap;

use lexican_eds::{Input, Source, load};
use lexican_machine::{Files, Machine, Node};
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::doc::Format;
use roxmltree::{Document, ParsingOptions};

use crate::{cantools, machine, sound};

const PRESS: &str = include_str!("press.toml");

/// The values of entries after all writes.
fn values(machine: &Machine, node: &Node) -> BTreeMap<Address, Vec<u8>> {
    machine.writes(node).into_iter().map(|write| (write.address, write.data)).collect()
}

#[test]
fn a_dcf_is_all_that_a_boot_writes() {
    let press = sound(PRESS);
    for node in &press.nodes {
        let dcf = press.dcf(node).unwrap();
        let (device, findings) = load(&Input::new(Source::new("node.dcf", dcf.as_str())));
        assert!(!findings.has_errors(), "{}", findings.render(&Input::new(Source::new("node.dcf", dcf.as_str()))));
        let commissioning = device.commissioning.unwrap();
        assert_eq!(commissioning.node_id, node.id.map(NodeId::get));
        assert_eq!(commissioning.bit_rate_kbit, Some(500));
        assert_eq!(commissioning.node_name.as_deref(), Some(node.name.as_str()));
        assert_eq!(commissioning.network_name.as_deref(), Some("press 3"));
        assert_eq!(commissioning.serial_number, node.identity.serial);
        // The writes are the same for a machine that has only the DCF.
        let text = format!("[node.{}]\nid = {}\nsheet = \"node.dcf\"", node.name.value, node.id.unwrap());
        let again = Machine::parse(Source::new("machine.toml", text), Files::Embedded(&[("node.dcf", &dcf)]));
        assert!(!again.findings.has_errors(), "{}", again.findings.render(&again.input));
        assert_eq!(values(&again, &again.nodes[0]), values(&press, node));
    }
    assert_eq!(machine("[node.a]\nid = 5\nheartbeat = \"1 s\"").nodes.first().map(|node| press.dcf(node)), Some(None));
}

#[test]
fn the_list_of_nodes_names_their_dcfs() {
    let list = sound(&format!("{PRESS}[node.meter]\nid = 3\nheartbeat = \"1 s\"\n")).node_list();
    let expected = "[Topology]\r\nNetName=press 3\r\nNodes=0x04\r\nNode3Present=0x01\r\nNode3Name=meter\r\n\
                    Node5Present=0x01\r\nNode5Name=left\r\nNode5DCFName=left.dcf\r\n";
    assert!(list.starts_with(expected) && list.ends_with("Node7DCFName=feeder.dcf\r\n"), "{list}");
}

#[test]
fn a_page_and_a_picture_say_what_goes_where() {
    let press = sound(PRESS);
    let page = press.page(Format::Markdown, Some("press.svg"));
    for line in [
        "# press 3",
        "![The network](press.svg)",
        "| [feeder](#feeder) (optional) | 7 | siko/ag03-1 | serial 2Ah | guarding 100 ms, retry 3 |",
        "| left | right | TPDO1: 185h, with every SYNC (1) | 6064:00 Position actual value |",
        "| 2412:00 Spindle Pitch | 2.50 mm | setting |",
    ] {
        assert!(page.lines().any(|it| it == line), "{line}\n{page}");
    }
    let bus = format!("Bus: 500 kbit/s, SYNC every 10 ms, busy for {:.1} % in", press.load().unwrap().percent);
    assert!(page.contains(&bus), "{page}");
    let picture = press.picture();
    assert!(picture.contains(">RPDO1  185h, takes effect at the next SYNC (1)<"), "{picture}");
    // There is only one message between two nodes.
    assert_eq!(picture.matches("<circle").count(), 1);
}

#[test]
fn a_page_in_html_has_a_chapter_for_each_node() {
    let press = sound(PRESS);
    let page = press.page(Format::Html, Some("press"));
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&page, options).unwrap();
    let texts = |id: &str| {
        let section =
            document.descendants().find(|it| it.attribute("id") == Some(id)).unwrap_or_else(|| panic!("{id}"));
        section.descendants().filter_map(|it| it.text()).collect::<Vec<_>>().join(" ")
    };
    assert!(texts("wires").contains("TPDO1: 185h, with every SYNC (1)"), "{}", texts("wires"));
    for node in &press.nodes {
        let name = &node.name.value;
        // Its COB-IDs include its node-ID, and an entry written at boot is shown beside its default.
        let id = node.id.unwrap().get();
        assert!(texts(&format!("{name}-TPDO1")).contains(&format!("{:03X}h", 0x180 + u16::from(id))), "{name}");
        for write in press.writes(node).iter().filter(|write| !write.is_default) {
            let anchor = format!("{name}-{:04X}", write.address.index());
            assert!(texts(&anchor).contains("set to"), "{anchor}: {}", texts(&anchor));
        }
    }
    assert_eq!(document.descendants().filter(|it| it.has_tag_name(("http://www.w3.org/2000/svg", "svg"))).count(), 1);
}

/// Prints messages with their senders, and their signals with the receivers.
const SCRIPT: &str = r#"
import sys, cantools
db = cantools.database.load_file(sys.argv[1])
for frame, data in [(0x185, "18 FC FF FF"), (0x285, "37 06"), (0x187, "50 02")]:
    message = db.get_message_by_frame_id(frame)
    values = message.decode(bytes.fromhex(data))
    for signal in message.signals:
        print(message.name, message.senders, signal.name, values[signal.name], signal.receivers, message.cycle_time)
"#;

#[test]
fn cantools_reads_the_messages_by_the_names_of_the_nodes() {
    let database = sound(PRESS).database();
    assert!(database.left_out.is_empty(), "{:?}", database.left_out);
    if let Some(read) = cantools::run(SCRIPT, &database.to_bytes()) {
        assert_eq!(
            read,
            "left_TPDO1 ['left'] Position_actual_value -1000 ['Manager', 'right'] None\n\
             left_TPDO2 ['left'] Statusword 1591 ['Manager'] 20\n\
             feeder_TPDO1 ['feeder'] Statusword 592 ['Manager'] 20\n"
        );
    }
}
