//! Reads the nodes of the file, with their kinds, data sheets, parameters and PDOs.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;
use std::sync::Arc;

use lexican_eds::model::Device;
use lexican_eds::{Severity, Source};
use lexican_runtime::object::{Address, Direction};
use lexican_runtime::procedure::{ConciseDcf, Data, Step};
use lexican_runtime::wire::lss;
use lexican_runtime::{CobId, Duration, NodeId, cia301};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::parameters::LeftOut;
use lexican_toolbox::parameters::restore::not_restored;
use lexican_toolbox::parameters::settings::{Wrong, encode};
use lexican_toolbox::pdo::{Change, PdoName, PdoState, Plan};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::resolve;

use crate::at::{At, Time, Written};
use crate::file;
use crate::model::{Node, PlannedPdo, Setting};
use crate::read::{Named, Out, Sheets, similar, span};

/// The default number of heartbeats or guarding responses that may be missing.
pub(crate) const PATIENCE: u8 = 3;
/// The largest concise DCF that is read, in bytes.
const LONGEST_DCF: usize = 16 * 1024 * 1024;
/// The word for the manager in wires, which no node may have as its name.
pub(crate) const MANAGER: &str = "manager";

/// Whether a text is valid as the name of a node.
pub(crate) fn is_name(text: &str) -> bool {
    !text.is_empty() && text != MANAGER && text.parse::<i64>().is_err() && !text.contains(['.', ':', '=', ' '])
}

/// The position of the node with this name; reports an unknown name.
pub(crate) fn place(nodes: &[Node], name: &str, at: &Range<usize>, out: &mut Out) -> Option<usize> {
    let found = nodes.iter().position(|node| node.name.value == name);
    if found.is_none() {
        let help = similar(name, nodes.iter().map(|node| node.name.as_str()));
        out.wrong("machine::name", at, format!("there is no node {name:?}"), help);
    }
    found
}

/// Reads all nodes; parts with mistakes are reported and left out.
pub(crate) fn lower(nodes: Vec<Named<file::Node>>, sheets: &mut Sheets<'_>, out: &mut Out) -> Vec<Node> {
    let mut lowered: Vec<Node> = Vec::new();
    for Named { name, table: node, is_whole } in nodes {
        if !is_name(&name) {
            let what = format!("{:?} cannot be the name of a node", name.value);
            let help = "a name is a word, and no number; \"manager\" is the one that boots the machine".to_owned();
            out.wrong("machine::name", &name.span, what, Some(help));
        }
        let id = match &node.id {
            None if !is_whole => continue,
            None => {
                let help = Some("id = 1 to 127, or \"none\" for a device that gets one by LSS".to_owned());
                out.wrong("machine::node-id", &name.span, format!("{} has no node-ID", name.value), help);
                continue;
            }
            Some(id) => id,
        };
        if let Some(other) = lowered.iter().find(|other| other.id.is_some() && other.id == id.value.0) {
            let what = format!("{} and {} have the same node-ID", other.name.value, name.value);
            out.wrong("machine::node-id", &id.span, what, None);
            continue;
        }
        let id = id.value.0;
        lowered.push(one(name, id, node, sheets, out));
    }
    lowered
}

fn one(name: At<String>, id: Option<NodeId>, node: file::Node, sheets: &mut Sheets<'_>, out: &mut Out) -> Node {
    let overlays = &node.overlay;
    let loaded = node.sheet.as_ref().and_then(|sheet| sheets.load(sheet, overlays, out));
    let (sheet_name, sheet) = loaded.map_or((None, None), |(name, sheet)| (Some(name), Some(sheet)));
    let sheet = sheet.map(|sheet| narrowed(sheet, &name, &node, out));
    let device = sheet.as_ref().map(|sheet| &sheet.device);
    if node.sheet.is_none()
        && let Some(first) = overlays.first().map(|it| &it.span).or(node.settings.keys().next().map(|it| &it.span))
    {
        let help = Some("sheet = \"FILE.eds\", or a device that `lexican devices` lists".to_owned());
        out.wrong("machine::sheet", first, format!("{} has no data sheet, which this is about", name.value), help);
    }
    if let (Some(guarding), Some(_)) = (&node.guarding, &node.heartbeat) {
        out.wrong("machine::error-control", &guarding.span, "a node has either heartbeat or guarding", None);
    }
    for time in [&node.heartbeat, &node.guarding].into_iter().flatten() {
        in_ms(time.value.0, &time.span, out);
    }
    let dcf = node.dcf.as_ref().and_then(|path| {
        let bytes = sheets.files.bytes(&path.value, LONGEST_DCF).map_err(|error| error.to_string());
        let read = bytes.and_then(|bytes| concise(&bytes));
        read.map_err(|error| out.wrong("machine::dcf", &path.span, error, None)).ok()
    });
    // Without a node-ID, use some: it only replaces `$NODEID` in the data sheet's values.
    let known = id.unwrap_or(NodeId::literal(1));
    let settings = device.map_or_else(Vec::new, |device| settings(device, Some(known), &node.settings, out));
    for (address, reason) in device.map(|device| not_restored(device, known)).unwrap_or_default() {
        if reason != LeftOut::ReadOnly {
            let what = format!("{address} of the DCF of {} is left out: {}", name.value, reason.words(1));
            let at = node.sheet.as_ref().map_or(&name.span, |sheet| &sheet.span);
            out.push(Severity::Note, "machine::dcf", at, what, None);
        }
    }
    let mut pdos = Vec::new();
    for (direction, given) in [(Direction::Receive, &node.rpdo), (Direction::Transmit, &node.tpdo)] {
        for (number, pdo) in given {
            if let Some(device) = device {
                pdos.extend(planned(device, known, direction, number, pdo, out));
            }
        }
    }
    let lss = match (&node.lss, node.identity.exact()) {
        (Some(At { value: true, .. }), [Some(vendor), Some(product), Some(revision), Some(serial)]) if id.is_some() => {
            Some(lss::Identity { vendor, product, revision, serial })
        }
        (Some(At { value: true, span }), _) => {
            let what = "LSS needs the node-ID, and all four numbers of the identity";
            let help =
                "identity = { vendor = …, product = …, revision = …, serial = … }, as `lexican lss inquire` says";
            out.wrong("machine::lss", span, what, Some(help.to_owned()));
            None
        }
        _ => None,
    };
    let time = |time: &Option<At<Time>>| time.as_ref().map(|time| time.value.0);
    Node {
        id,
        designator: node.designator,
        sheet_name,
        sheet,
        overlays: overlays.iter().map(|overlay| sheets.files.path(&overlay.value)).collect(),
        identity: node.identity,
        lss,
        software: node.software,
        optional: node.optional,
        heartbeat: time(&node.heartbeat),
        guarding: time(&node.guarding),
        retry: node.retry.unwrap_or(PATIENCE),
        protection: node.protection.map(|it| it.value.0.unwrap_or(Duration::ZERO)),
        start: node.start.unwrap_or(true),
        keep_alive: node.keep_alive,
        boots_again: node.boots_again.unwrap_or(true),
        dcf,
        settings,
        pdos,
        name,
        simulated: crate::model::Simulated::default(),
    }
}

/// The data sheet with the identity and the limits that the machine adds for the node.
fn narrowed(sheet: Arc<DataSheet>, name: &str, node: &file::Node, out: &mut Out) -> Arc<DataSheet> {
    let mut overlay = String::new();
    // Writing to a string cannot fail.
    let mut put = |address: Address, keys: std::fmt::Arguments<'_>| {
        let _ = writeln!(overlay, "[object.\"{address}\"]\nreason = \"the machine\"\n{keys}");
    };
    for (sub, part) in (1..).zip(node.identity.exact()) {
        let address = Address::new(cia301::IDENTITY, sub);
        if let Some(part) = part.filter(|_| sheet.device.entry(address.index(), sub).is_some()) {
            put(address, format_args!("default = {part}"));
        }
    }
    // The units of limits depend on the settings; mistakes in these are reported later.
    let mut values = DeviceValues::new(&sheet.device);
    encode(&pairs(&node.settings), &mut values, None);
    for (object, range) in &node.limits {
        match limit(&values, object, &range.value) {
            Ok((address, [low, high])) => put(address, format_args!("low = {low}\nhigh = {high}")),
            Err(wrong) => {
                let at = if wrong.is_of_object { &object.span } else { &range.span };
                out.wrong("machine::limit", at, wrong.text, wrong.advice);
            }
        }
    }
    if overlay.is_empty() {
        return sheet;
    }
    let overlay = format!("[overlay]\nformat = 1\n{overlay}");
    let overlay = Source::new(format!("what the machine says of {name}"), overlay);
    Arc::new(DataSheet { library: sheet.library, ..DataSheet::parse(sheet.input.clone().overlay(overlay)) })
}

/// An object and the range of its value in counts; or what is wrong with that.
fn limit(values: &DeviceValues<'_>, object: &str, range: &[Written; 2]) -> Result<(Address, [i128; 2]), Wrong> {
    let address = resolve(Some(values.device), object).map_err(|error| Wrong {
        at: 0,
        is_of_object: true,
        text: error.to_string(),
        advice: Some(error.advice()),
    })?;
    let wrong = |text: String| Wrong { at: 0, is_of_object: false, text, advice: None };
    let entry = values.entry(address).ok_or_else(|| wrong(format!("the data sheet has no {address}")))?;
    let mut numbers = [0; 2];
    for (number, Written(text)) in numbers.iter_mut().zip(range) {
        let value = values.parse(entry, text).map_err(wrong)?;
        *number = value.as_integer().ok_or_else(|| wrong(format!("{text} is no whole number")))?;
        // Limits must themselves be values that the data sheet allows.
        values.check_write(entry, &value, NodeId::literal(1)).map_err(|refusal| wrong(refusal.to_string()))?;
    }
    match numbers {
        [low, high] if low > high => Err(wrong("the lowest value comes first".to_owned())),
        numbers => Ok((address, numbers)),
    }
}

/// Parses a concise DCF.
fn concise(bytes: &[u8]) -> Result<Vec<(Address, Vec<u8>)>, String> {
    let dcf = ConciseDcf::new(bytes);
    dcf.check().map_err(|error| error.to_string())?;
    Ok(dcf
        .filter_map(|step| match step {
            Step::Write { address, data: Data::Bytes(bytes) } => Some((address, bytes.to_vec())),
            _ => None,
        })
        .collect())
}

/// Parameters in wire form; those that the data sheet does not allow are reported. `node` is `None` for initial values
/// of a simulated node.
pub(crate) fn settings(
    device: &Device,
    node: Option<NodeId>,
    given: &BTreeMap<At<String>, At<Written>>,
    out: &mut Out,
) -> Vec<Setting> {
    let (settings, wrong) = encode(&pairs(given), &mut DeviceValues::new(device), node);
    let places: Vec<_> = given.iter().map(|(object, value)| (&object.span, &value.span)).collect();
    for wrong in wrong {
        let (object, value) = places[wrong.at];
        out.wrong("machine::setting", if wrong.is_of_object { object } else { value }, wrong.text, wrong.advice);
    }
    settings.into_iter().map(|(address, data)| Setting { address, data }).collect()
}

/// The objects and values as texts.
fn pairs(given: &BTreeMap<At<String>, At<Written>>) -> Vec<(&str, &str)> {
    given.iter().map(|(object, value)| (object.as_str(), value.0.as_str())).collect()
}

/// Plans a PDO as in the file; `None` if that is impossible, which is reported.
fn planned(
    device: &Device,
    node: NodeId,
    direction: Direction,
    number: &At<String>,
    pdo: &file::Pdo,
    out: &mut Out,
) -> Option<PlannedPdo> {
    let name =
        number.parse().ok().filter(|number| (1..=512).contains(number)).map(|number| PdoName { direction, number });
    let Some(name) = name else {
        let what = format!("{:?} is no number of a PDO: they are 1 to 512", number.value);
        out.wrong("machine::pdo", &number.span, what, None);
        return None;
    };
    let before = state(device, node, name, &number.span, out)?;
    let table = &pdo.table;
    let mut mapping = None;
    if let Some(objects) = &table.map {
        let mut mapped = Vec::new();
        for object in objects {
            match name.map(Some(device), &[&object.value]) {
                Ok(one) => mapped.extend(one),
                Err(objections) => object_to(&objections, &object.span, out),
            }
        }
        mapping = Some(mapped);
    }
    let cob_id = table.cob_id.as_ref().and_then(|id| {
        let known = u16::try_from(id.value).ok().and_then(CobId::standard);
        if known.is_none() {
            out.wrong("machine::pdo", &id.span, format!("{:X}h is no COB-ID of 11 bits", id.value), None);
        }
        known
    });
    let change = Change {
        on: Some(!pdo.is_off),
        cob_id,
        transmission: table.transmission.as_ref().map(|it| it.value.0),
        inhibit_100us: table.inhibit.as_ref().and_then(|it| in_100us(it.value.0, &it.span, out)),
        event_timer_ms: table.every.as_ref().and_then(|it| in_ms(it.value.0, &it.span, out)),
        mapping,
    };
    let maps = change.mapping.is_some();
    match Plan::new(Some(device), node, before, &change) {
        Ok(plan) => Some(PlannedPdo { before: plan.before, after: plan.after, maps, place: span(&number.span) }),
        Err(objections) => {
            object_to(&objections, &number.span, out);
            None
        }
    }
}

/// The configuration of a PDO in the data sheet; reports a PDO that it lacks.
pub(crate) fn state(
    device: &Device,
    node: NodeId,
    name: PdoName,
    at: &Range<usize>,
    out: &mut Out,
) -> Option<PdoState> {
    let state = PdoState::of_sheet(device, node, name);
    if state.is_none() {
        let names = PdoName::of_sheet(device);
        let last = names.iter().rfind(|it| it.direction == name.direction);
        let help = last.map(|last| format!("the last one is {last}"));
        out.wrong("machine::pdo", at, format!("the data sheet has no {name}"), help);
    }
    state
}

/// Reports why a PDO cannot be configured as wanted.
pub(crate) fn object_to(objections: &[lexican_toolbox::pdo::Objection], at: &Range<usize>, out: &mut Out) {
    for objection in objections {
        out.wrong("machine::pdo", at, objection.to_string(), objection.advice());
    }
}

/// A time in ms, if it fits 16 bits.
pub(crate) fn in_ms(time: Duration, at: &Range<usize>, out: &mut Out) -> Option<u16> {
    fits(Time(time).ms(), "65,535 ms", at, out)
}

/// A time in multiples of 100 µs, if it fits 16 bits.
pub(crate) fn in_100us(time: Duration, at: &Range<usize>, out: &mut Out) -> Option<u16> {
    fits(time.as_micros() / 100, "6,553 ms", at, out)
}

fn fits(number: u64, most: &str, at: &Range<usize>, out: &mut Out) -> Option<u16> {
    let number = u16::try_from(number).ok();
    if number.is_none() {
        out.wrong("machine::time", at, format!("it cannot be more than {most}"), None);
    }
    number
}
