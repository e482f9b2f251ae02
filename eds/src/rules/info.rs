//! Rules about the file and the device as a whole, modules and dynamic channels.

use std::collections::BTreeSet;

use super::context::{Context, plural};
use super::rule::{Out, note};
use crate::diagnostic::Diagnostic;
use crate::finding::{Finding, Kind};
use crate::parse::COMPACT_PDO_BITS;
use crate::parse::section::SectionKind;
use crate::text::Span;

/// Keys of `[DeviceInfo]` that CiA 306-1 requires and that nothing else can replace.
pub(super) const REQUIRED: [&str; 7] =
    ["VendorName", "VendorNumber", "ProductName", "ProductNumber", "Granularity", "NrOfRXPDO", "NrOfTXPDO"];

pub(super) fn missing_section(cx: &Context<'_>, out: &mut Out<'_>) {
    let required = [
        (SectionKind::FileInfo, "FileInfo"),
        (SectionKind::DeviceInfo, "DeviceInfo"),
        (SectionKind::MandatoryObjects, "MandatoryObjects"),
    ];
    for (kind, name) in required {
        if cx.facts.section(kind).is_none() {
            out.push(note(format!("the section `[{name}]` is missing")).at(Span::eds(0, 0), ""));
        }
    }
}

pub(super) fn missing_device_info(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(section) = cx.facts.section(SectionKind::DeviceInfo) else { return };
    let missing: Vec<&str> = REQUIRED.into_iter().filter(|key| section.get(key).is_none()).collect();
    if !missing.is_empty() {
        let note = note(format!("`[DeviceInfo]` does not say {}", missing.join(", ")));
        out.push(note.at(cx.facts.syntax.name_span(section), ""));
    }
}

pub(super) fn no_bit_rate(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(section) = cx.facts.section(SectionKind::DeviceInfo) else { return };
    if cx.device.info.bit_rates_kbit.is_empty() {
        let span = cx.facts.syntax.name_span(section);
        let note = note("the device supports no bit rate").at(span, "no `BaudRate_` is 1");
        out.push(note.help("set those to 1 that the manual names, such as `BaudRate_500=1`"));
    }
}

pub(super) fn bad_date(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(section) = cx.facts.section(SectionKind::FileInfo) else { return };
    let keys =
        [("CreationDate", true), ("ModificationDate", true), ("CreationTime", false), ("ModificationTime", false)];
    for (key, date) in keys {
        let Some(pair) = section.get(key).filter(|pair| !pair.value.is_empty()) else { continue };
        let (good, form, mended) = if date {
            (is_date(pair.value), "mm-dd-yyyy", as_date(pair.value))
        } else {
            (is_time(pair.value), "hh:mmAM or hh:mmPM", as_time(pair.value))
        };
        if !good {
            let span = cx.facts.syntax.value_span(pair);
            let note = note(format!("`{key}` is not in the form of CiA 306")).at(span, format!("expected {form}"));
            out.push(note.fix(mended.and_then(|mended| cx.replace(span, &mended))));
        }
    }
}

/// The three numbers of a date or time, and their positions; `between` separates them.
fn numbers(text: &str, between: char) -> Option<[(usize, u16); 3]> {
    let mut parts = text.split(between).map(|part| Some((part.len(), part.parse().ok()?)));
    let numbers = [parts.next()??, parts.next()??, parts.next().unwrap_or(Some((0, 0)))?];
    parts.next().is_none().then_some(numbers)
}

fn is_date(text: &str) -> bool {
    let Some([(2, month), (2, day), (4, 1..=9999)]) = numbers(text, '-') else { return false };
    (1..=12).contains(&month) && (1..=31).contains(&day)
}

fn is_time(text: &str) -> bool {
    let upper = text.to_ascii_uppercase();
    let Some(clock) = upper.strip_suffix("AM").or_else(|| upper.strip_suffix("PM")) else { return false };
    matches!(numbers(clock, ':'), Some([(2, 0..=12), (2, 0..=59), (0, _)]))
}

/// A date whose order of day and month is beyond doubt: `2011-03-07`, `7.3.2011`, `16-08-2007`.
fn as_date(text: &str) -> Option<String> {
    let (day, month, year) = match (numbers(text, '-'), numbers(text, '.')) {
        (Some([(4, year), (_, month), (_, day)]), _) => (day, month, year),
        (_, Some([(_, day), (_, month), (4, year)])) => (day, month, year),
        (Some([(_, day @ 13..), (_, month), (4, year)]), _) => (day, month, year),
        _ => return None,
    };
    Some(format!("{month:02}-{day:02}-{year:04}")).filter(|date| is_date(date))
}

/// A time in 24-hour form, with or without seconds; the hour may have one digit.
fn as_time(text: &str) -> Option<String> {
    let padded = Some(format!("0{}", text.trim())).filter(|padded| is_time(padded));
    if padded.is_some() {
        return padded;
    }
    let [(_, hours @ 0..=23), (_, minutes), _] = numbers(text.trim(), ':')? else { return None };
    let half = if hours < 12 { "AM" } else { "PM" };
    let hours = if hours % 12 == 0 { 12 } else { hours % 12 };
    Some(format!("{hours:02}:{minutes:02}{half}")).filter(|time| is_time(time))
}

pub(super) fn bad_granularity(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(granularity) = cx.device.info.granularity.filter(|&granularity| granularity > 64) else { return };
    let Some(span) = cx.device_info("Granularity") else { return };
    out.push(note(format!("a granularity of {granularity} bits is longer than a PDO")).at(span, ""));
}

pub(super) fn dynamic_channels(cx: &Context<'_>, out: &mut Out<'_>) {
    const KEY: &str = "DynamicChannelsSupported";
    let announced = cx.device.info.dynamic_channels;
    let described = cx.facts.section(SectionKind::DynamicChannels);
    let set = |value: &str| cx.set_info(SectionKind::DeviceInfo, KEY, value);
    match (announced, described, cx.device_info(KEY)) {
        (false, Some(section), _) => {
            let note = note("there are dynamic channels, but `DynamicChannelsSupported` is 0");
            out.push(note.at(cx.facts.syntax.name_span(section), "").mend(set("1")));
        }
        (true, None, Some(span)) => {
            let note = note("dynamic channels are announced, but `[DynamicChannels]` is missing");
            out.push(note.at(span, "").mend(set("0")));
        }
        _ => {}
    }
}

pub(super) fn compact_pdo(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(span) = cx.device_info("CompactPDO") else { return };
    let implied = cx.objects().filter(|(_, facts)| facts.implied).count();
    if implied > 0 {
        let note = note(format!("`CompactPDO` stands for {}", plural(implied, "PDO parameter")));
        out.push(note.at(span, "they are added"));
    }
}

pub(super) fn bad_compact_pdo(cx: &Context<'_>, out: &mut Out<'_>) {
    let bits = cx.device.info.compact_pdo;
    let Some(span) = cx.device_info("CompactPDO").filter(|_| bits != 0) else { return };
    let set = |bits: u32| cx.replace(span, &format!("0x{bits:X}"));
    if bits & !COMPACT_PDO_BITS != 0 {
        let note = note("`CompactPDO` has bits beyond the six of a communication parameter");
        let note = note.at(span, format!("0x{:X} is ignored", bits & !COMPACT_PDO_BITS));
        out.push(note.mend(set(bits & COMPACT_PDO_BITS)));
    }
    if cx.device.pdos.is_empty() {
        let counts = ["NrOfRXPDO", "NrOfTXPDO"].into_iter().filter_map(|key| cx.device_info(key));
        let note = note("`CompactPDO` describes PDOs, but there are none").at(span, "");
        out.push(counts.fold(note, |note, span| note.and(span, "")).mend(set(0)));
    }
    if !cx.objects().any(|(_, facts)| facts.implied) {
        return;
    }
    for (bit, what) in [(0, "COB-ID"), (1, "transmission type")] {
        if bits & 1 << bit == 0 {
            let note = note(format!("PDOs that are left out have no {what}")).at(span, format!("bit {bit} is 0"));
            out.push(note.mend(set(bits | 1 << bit)));
        }
    }
    if let (Some(0), Some(granularity)) = (cx.device.info.granularity, cx.device_info("Granularity")) {
        let note = note("the mappings of the PDOs that are left out are not known").at(span, "");
        let note = note.and(granularity, "they cannot be written");
        out.push(note.help("write the mapping parameters into the file; only the vendor knows them"));
    }
}

pub(super) fn bad_node_id(cx: &Context<'_>, out: &mut Out<'_>) {
    let node_id = cx.device.commissioning.as_ref().and_then(|commissioning| commissioning.node_id);
    let Some(node_id) = node_id.filter(|id| !matches!(id, 1..=127 | 255)) else { return };
    let Some(span) = cx.value_in(SectionKind::Commissioning, "NodeID") else { return };
    out.push(note(format!("{node_id} is no node-ID")).at(span, ""));
}

pub(super) fn unsupported_bit_rate(cx: &Context<'_>, out: &mut Out<'_>) {
    let supported = &cx.device.info.bit_rates_kbit;
    let bit_rate = cx.device.commissioning.as_ref().and_then(|commissioning| commissioning.bit_rate_kbit);
    let Some(bit_rate) = bit_rate.filter(|rate| !supported.is_empty() && !supported.contains(rate)) else { return };
    let Some(span) = cx.value_in(SectionKind::Commissioning, "Baudrate") else { return };
    out.push(note(format!("the device does not support {bit_rate} kbit/s")).at(span, ""));
}

pub(super) fn module_without_section(cx: &Context<'_>, out: &mut Out<'_>) {
    if cx.facts.section(SectionKind::SupportedModules).is_none() {
        return;
    }
    let sections = cx.facts.syntax.sections.iter();
    let described: BTreeSet<u16> = sections.filter_map(|section| section.kind.module()).collect();
    for module in cx.device.modules.iter().filter(|module| !described.contains(&module.number)) {
        let note = note(format!("the module {} is not described", module.number));
        out.push(note.at(cx.section_span(SectionKind::SupportedModules), ""));
    }
}

pub(super) fn unsupported_module(cx: &Context<'_>, out: &mut Out<'_>) {
    let span = cx.section_span(SectionKind::ConnectedModules);
    for &number in &cx.device.connected_modules {
        if cx.device.modules.binary_search_by_key(&number, |module| module.number).is_err() {
            out.push(note(format!("there is no module {number}")).at(span, "plugged in here"));
        }
    }
}

pub(super) fn bad_dummy(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadDummy(code) = finding.kind else { return None };
    let note = note(format!("{code:04X}h is no data type of a fixed size")).at(finding.span, "");
    Some(note.mend(cx.remove(finding.span)))
}

pub(super) fn bad_channel(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadChannel = finding.kind else { return None };
    Some(note("the segment has no range of indices").at(finding.span, "the segment is ignored"))
}
