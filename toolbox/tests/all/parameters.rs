//! Which entries of a device are parameters, with data sheets as makers of drives write them.

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use lexican_eds::model::Device;
use lexican_eds::{Input, Source, library};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, NodeId};
use lexican_simulation::VirtualDevice;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::backup::{Backup, backup};
use lexican_toolbox::parameters::compare::{Side, compare};
use lexican_toolbox::parameters::restore::{Options, Outcome, configured, not_restored, restore};
use lexican_toolbox::parameters::{Ended, LeftOut, Parameters, Progress};
use lexican_toolbox::values::address;
use lexican_toolbox::values::wire::written;

use crate::rows::eds;

const NODE: NodeId = NodeId::literal(5);
const U8: u16 = 5;
const U16: u16 = 6;
const U32: u16 = 7;
const I8: u16 = 2;
const I16: u16 = 3;
const I32: u16 = 4;

/// The style of a maker's data sheets.
struct Style {
    /// The access of mappable entries.
    mappable: &'static str,
    /// Whether numbers are hexadecimal.
    hexadecimal: bool,
    profile: u16,
}

const STYLES: [Style; 4] = [
    Style { mappable: "rww", hexadecimal: true, profile: 402 },
    Style { mappable: "RWW", hexadecimal: false, profile: 402 },
    Style { mappable: "rwr", hexadecimal: true, profile: 402 },
    // Its 1000h has no profile, but it has all objects of a drive.
    Style { mappable: "rw", hexadecimal: false, profile: 0 },
];

/// Parameters that are mappable: index, data type, default, another value.
const MAPPABLE: [(u16, u16, u32, u32); 16] = [
    (0x2100, U16, 3, 4),
    (0x2102, U16, 3, 4),
    (0x6065, U32, 1000, 2000),
    (0x6067, U32, 10, 20),
    (0x6072, U16, 1000, 900),
    (0x6073, U16, 1000, 800),
    (0x607C, I32, 0, 50),
    (0x607E, U8, 0, 0xC0),
    (0x607F, U32, 5000, 4000),
    (0x6081, U32, 500, 400),
    (0x6083, U32, 600, 700),
    (0x6084, U32, 600, 710),
    (0x6085, U32, 900, 990),
    (0x6098, I8, 35, 37),
    (0x609A, U32, 100, 110),
    (0x60E0, U16, 1000, 950),
];
/// Entries that are no parameters, and why.
const OTHERS: [(u16, u16, &str, LeftOut); 11] = [
    (0x1010, U32, "rw", LeftOut::Command),
    (0x1011, U32, "rw", LeftOut::Command),
    (0x2101, U16, "mappable", LeftOut::Mapped),
    (0x2103, U16, "wo", LeftOut::WriteOnly),
    (0x6040, U16, "mappable", LeftOut::Command),
    (0x6041, U16, "ro", LeftOut::ReadOnly),
    (0x6042, I16, "mappable", LeftOut::SetPoint),
    (0x6071, I16, "mappable", LeftOut::SetPoint),
    (0x607A, I32, "mappable", LeftOut::SetPoint),
    (0x60B1, I32, "mappable", LeftOut::SetPoint),
    (0x60FF, I32, "mappable", LeftOut::SetPoint),
];

impl Style {
    fn number(&self, number: u32) -> String {
        if self.hexadecimal { format!("0x{number:X}") } else { number.to_string() }
    }

    /// A data sheet; if `configured`, a DCF that gives every entry another value.
    fn sheet(&self, configured: bool) -> Device {
        let value =
            |value: u32| if configured { format!(" ParameterValue={}", self.number(value)) } else { String::new() };
        let row = |address: &str, data_type: u16, access: &str, default: Option<u32>, new: u32| {
            let access = if access == "mappable" { self.mappable } else { access };
            let mapping = u8::from(access == self.mappable && access != "rw");
            let default = default.map(|default| self.number(default)).unwrap_or_default();
            format!("{address} {data_type} {access} {default} PDOMapping={mapping}{}", value(new))
        };
        let mut rows = vec![
            row("607D:01", I32, "mappable", Some(0), 11),
            row("607D:02", I32, "mappable", Some(0), 22),
            row("60FE:01", U32, "mappable", Some(0), 1),
            row("60FE:02", U32, "mappable", Some(0), 3),
            format!("1018:01 {U32} ro {}", self.number(0x123)),
            row("1000", U32, "ro", Some(0x20000 | u32::from(self.profile)), 7),
            row("1001", U8, "ro", Some(0), 7),
            row("6060", I8, "rw", Some(1), 3),
        ];
        // The second PDO is switched off.
        for (number, cob_id, mapped) in [(0, 0x205, 0x2101_0010), (1, 0x8000_0305, 0x2102_0010)] {
            rows.push(row(&format!("{:04X}:01", 0x1400 + number), U32, "rw", Some(cob_id), cob_id));
            rows.push(row(&format!("{:04X}:00", 0x1600 + number), U8, "rw", Some(1), 1));
            rows.push(row(&format!("{:04X}:01", 0x1600 + number), U32, "rw", Some(mapped), mapped));
        }
        for (index, data_type, default, new) in MAPPABLE {
            rows.push(row(&format!("{index:04X}"), data_type, "mappable", Some(default), new));
        }
        for (index, data_type, access, reason) in OTHERS {
            // The value in a DCF is used for an entry that cannot be read back.
            let default = (reason != LeftOut::WriteOnly).then_some(0);
            rows.push(row(&format!("{index:04X}"), data_type, access, default, 1));
        }
        let info = "VendorName=Style\nVendorNumber=0x123\nProductName=Style\nNrOfRXPDO=2\nNrOfTXPDO=0\n";
        let name = if configured { "style.dcf" } else { "style.eds" };
        let (device, findings) = lexican_eds::load(&Input::new(Source::new(name, eds(info, rows.into_iter()))));
        assert!(!findings.has_errors(), "{findings:?}");
        device
    }
}

fn go_on(_: Progress<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A booted device of a data sheet.
fn network(device: &Device) -> Network<VirtualLink> {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(VirtualDevice::power_on(bus.now(), NODE, device));
    let mut link = bus.link();
    let until = link.now() + Duration::from_secs(1);
    while link.receive(until).unwrap().is_some() {}
    Network::new(link)
}

fn keep(network: &mut Network<VirtualLink>, sheet: &Device) -> Backup {
    backup(&mut RemoteNode::new(network, NODE), sheet, false, &mut go_on).unwrap()
}

fn kept(backup: &Backup) -> BTreeSet<u16> {
    backup.device.entries().filter(|entry| entry.configured.is_some()).map(|entry| entry.index).collect()
}

#[test]
fn what_may_be_mapped_is_kept_and_what_is_no_parameter_is_left_out_with_its_reason() {
    for style in STYLES {
        let sheet = style.sheet(false);
        let mut network = network(&sheet);
        let first = keep(&mut network, &sheet);
        let has = kept(&first);
        for (index, ..) in MAPPABLE {
            assert!(has.contains(&index), "{index:04X}h as {}", style.mappable);
        }
        assert!(has.contains(&0x607D) && has.contains(&0x6060));
        for (index, _, _, reason) in OTHERS {
            let found = first.no_parameters.get(&Address::new(index, 0)).copied();
            assert_eq!((found, has.contains(&index)), (Some(reason), false), "{index:04X}h as {}", style.mappable);
        }
        // The outputs are set-points, but their mask is a parameter.
        let of_outputs = |sub| first.no_parameters.get(&Address::new(0x60FE, sub)).copied();
        assert_eq!((of_outputs(1), of_outputs(2)), (Some(LeftOut::SetPoint), None));
        // The device decides what is mapped, not its data sheet.
        let mut node = RemoteNode::new(&mut network, NODE);
        node.write(Address::new(0x1401, 1), &0x305_u32.to_le_bytes()).unwrap().unwrap();
        node.write(Address::new(0x1400, 1), &0x8000_0205_u32.to_le_bytes()).unwrap().unwrap();
        let second = kept(&keep(&mut network, &sheet));
        assert!(second.contains(&0x2101) && !second.contains(&0x2102), "{second:04X?}");
    }
}

#[test]
fn a_new_device_gets_the_limits_of_the_old_one() {
    for style in STYLES {
        let sheet = style.sheet(false);
        let mut old = network(&sheet);
        let mut node = RemoteNode::new(&mut old, NODE);
        for (sub, limit) in [(1, -5000_i32), (2, 7000)] {
            node.write(Address::new(0x607D, sub), &limit.to_le_bytes()).unwrap().unwrap();
        }
        let dcf = keep(&mut old, &sheet).dcf();
        let dcf = lexican_eds::load(&Input::new(Source::new("old.dcf", dcf))).0;
        let mut new = network(&sheet);
        let mut node = RemoteNode::new(&mut new, NODE);
        let differ = |node: &mut RemoteNode<'_, VirtualLink>| {
            let new = Side::of_node(node, sheet.clone(), &mut go_on).unwrap();
            compare(&Side::of_sheet(dcf.clone(), NODE), &new)
                .differences
                .iter()
                .map(|it| it.address)
                .collect::<Vec<_>>()
        };
        assert_eq!(differ(&mut node), [Address::new(0x607D, 1), Address::new(0x607D, 2)]);
        let mut outcome = Outcome::default();
        restore(&mut node, &sheet, &configured(&dcf, NODE), Options::default(), &mut go_on, &mut outcome).unwrap();
        assert_eq!((outcome.refused.len(), differ(&mut node)), (0, vec![]), "{outcome:?}");
        assert_eq!(node.read(Address::new(0x607D, 1)).unwrap().unwrap(), (-5000_i32).to_le_bytes());
    }
}

#[test]
fn a_comparison_sees_each_value_that_a_restore_would_write() {
    for style in STYLES {
        let (sheet, dcf) = (style.sheet(false), style.sheet(true));
        let written: BTreeSet<_> = configured(&dcf, NODE).into_keys().collect();
        let found = compare(&Side::of_sheet(dcf.clone(), NODE), &Side::of_sheet(sheet, NODE));
        let mut seen: BTreeSet<_> = found.differences.iter().map(|it| it.address).collect();
        seen.extend(&found.unknown);
        // These have the value of the data sheet.
        let same = [(0x1400, 1), (0x1401, 1), (0x1600, 0), (0x1600, 1), (0x1601, 0), (0x1601, 1)];
        seen.extend(same.map(|(index, sub)| Address::new(index, sub)));
        assert_eq!(seen, written, "{}", style.mappable);
        assert!(MAPPABLE.iter().all(|(index, ..)| written.contains(&Address::new(*index, 0))));
        // The value in a DCF for a write-only entry can be written, but not compared.
        assert_eq!(found.unknown, [Address::new(0x2103, 0)]);
        let reasons: BTreeSet<_> = not_restored(&dcf, NODE).into_values().collect();
        assert_eq!(reasons, [LeftOut::SetPoint, LeftOut::Mapped, LeftOut::Command, LeftOut::ReadOnly].into());
    }
}

#[test]
fn every_entry_is_a_parameter_or_has_a_reason() {
    let sheet = STYLES[0].sheet(false);
    let parameters = Parameters::of_sheet(&sheet, NODE);
    let rest = parameters.rest(sheet.entries());
    assert_eq!(parameters.entries().count() + rest.len(), sheet.entries().count());
}

/// Changes one bit of each parameter that accepts the new value. Returns their number.
fn change(node: &mut RemoteNode<'_, VirtualLink>, device: &Device) -> usize {
    let parameters = Parameters::of_sheet(device, NODE);
    let changed = parameters.entries().filter(|entry| {
        let Ok(mut data) = node.read(address(entry)).unwrap() else { return false };
        data.iter_mut().take(1).for_each(|byte| *byte ^= 1);
        node.write(address(entry), &written(Some(device), data)).unwrap().is_ok()
    });
    changed.count()
}

#[test]
fn what_is_changed_is_restored_however_often_that_is_interrupted() {
    let sensor = Input::new(Source::new("sensor.eds", include_str!("../../../cli/tests/sensor.eds")));
    let library = ["siko/ag03-1", "siko/ag02", "kollmorgen/akd"].map(|name| library::find(name).unwrap().input());
    for input in library.into_iter().chain([sensor]) {
        let device = lexican_eds::load(&input).0;
        let name = device.info.product_name.clone().unwrap_or_default();
        let mut network = network(&device);
        let mut node = RemoteNode::new(&mut network, NODE);
        let kept = backup(&mut node, &device, false, &mut go_on).unwrap();
        assert_eq!(kept.left_out, [], "{name}");
        let dcf = lexican_eds::load(&Input::new(Source::new("kept.dcf", kept.dcf()))).0;
        let settings = configured(&dcf, NODE);
        assert_eq!(settings.len(), kept.kept, "{name}");
        for interrupted_at in [None, Some(1), Some(2), Some(4)] {
            let changed = change(&mut node, &device);
            assert!(changed > 3, "{name}: {changed}");
            if let Some(at) = interrupted_at {
                let mut stop = |progress: Progress<'_>| match progress {
                    Progress::Writing { at: now, .. } if now == at => ControlFlow::Break(()),
                    _ => ControlFlow::Continue(()),
                };
                let mut outcome = Outcome::default();
                let ended = restore(&mut node, &device, &settings, Options::default(), &mut stop, &mut outcome);
                assert!(matches!(ended, Err(Ended::Stopped)), "{name}");
                assert!(outcome.written.len() < at, "{name}: {outcome:?}");
            }
            let mut outcome = Outcome::default();
            restore(&mut node, &device, &settings, Options::default(), &mut go_on, &mut outcome).unwrap();
            assert!(outcome.refused.is_empty() && outcome.switched_off.is_empty(), "{name}: {outcome:?}");
            let now = Side::of_node(&mut node, device.clone(), &mut go_on).unwrap();
            assert_eq!(compare(&now, &Side::of_sheet(dcf.clone(), NODE)).differences, [], "{name}");
        }
    }
}
