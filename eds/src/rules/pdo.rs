//! Rules about PDOs.

use std::collections::BTreeMap;

use super::context::{BASE_IDENTIFIER, Context, EXTENDED, IDENTIFIER, INVALID};
use super::context::{are, held_by, is_dummy, listed, pdo_name, place, plural};
use super::remedy::overlay;
use super::rule::{Out, note};
use crate::model::keys::Key;
use crate::model::pdo::held;
use crate::model::types::DataType;
use crate::model::{AccessType, Direction, Entry, Mapped, Pdo, Value};
use crate::parse::section::SectionKind;
use crate::patch::{Change, Patch};
use lexican_cia::cia301;

pub(super) fn missing_object(cx: &Context<'_>, out: &mut Out<'_>) {
    let mut missing: BTreeMap<(u16, u8), Vec<(&Pdo, u8)>> = BTreeMap::new();
    for (pdo, number, mapped) in cx.mapped() {
        let there = cx.device.entry(mapped.index, mapped.sub).is_some();
        if !there && !is_dummy(mapped) {
            missing.entry((mapped.index, mapped.sub)).or_default().push((pdo, number));
        }
    }
    for ((index, sub), places) in missing {
        let names: Vec<String> = places.iter().map(|(pdo, _)| pdo_name(pdo)).collect();
        let names = listed(&names, String::clone);
        let places = places.iter().map(|&(pdo, number)| cx.mapping_span(pdo, number));
        let note = note(format!("there is no {index:04X}:{sub:02X} for {names} to map"));
        out.push(note.at_each(places, "mapped here", "and here"));
    }
}

pub(super) fn not_mappable(cx: &Context<'_>, out: &mut Out<'_>) {
    for (pdo, number, mapped) in cx.mapped() {
        let Some(entry) = cx.device.entry(mapped.index, mapped.sub) else { continue };
        if !entry.pdo_mapping && !is_dummy(mapped) {
            let note = note(format!("{} is mapped, but not mappable", place(entry)));
            let note = note.at(cx.mapping_span(pdo, number), "mapped here");
            let note = note.and(cx.entry_span(entry, Key::PdoMapping), "says that it cannot");
            let can = cia301::can_be_mapped(entry.index) && entry.data_type.bits().is_some();
            // The access type should say in which direction an entry can be mapped.
            let access = match entry.access {
                AccessType::Rw => format!("\n{}", access_by(cx, entry)),
                _ => String::new(),
            };
            out.push(note.mend(can.then(|| cx.correct(entry, &format!("pdo_mapping = true{access}")))));
        }
    }
}

pub(super) fn wrong_length(cx: &Context<'_>, out: &mut Out<'_>) {
    for (pdo, number, mapped) in cx.mapped() {
        let entry = cx.device.entry(mapped.index, mapped.sub);
        let data_type = entry.map_or_else(|| DataType::from_code(mapped.index), |entry| entry.data_type);
        let Some(bits) = cx.device.bits(data_type).filter(|&bits| bits != mapped.bits) else { continue };
        // A BOOLEAN in a byte of its own is common and harmless.
        if data_type == DataType::Boolean && mapped.bits == 8 {
            continue;
        }
        let note = note(format!("{data_type} has {bits} bits, not {}", mapped.bits));
        let note = note.at(cx.mapping_span(pdo, number), "mapped here");
        out.push(entry.into_iter().fold(note, |note, entry| {
            let of_length = of_length(data_type, mapped.bits).filter(|_| only_here(cx, mapped));
            let fits = of_length.filter(|&of_length| {
                let values = [&entry.default, &entry.configured, &entry.low, &entry.high];
                values.into_iter().all(|value| cx.fits(of_length, value.as_ref()))
            });
            let remedy = fits.map(|fits| cx.correct(entry, &format!("data_type = \"{fits}\"")));
            let remedy = remedy.map(|remedy| format!("if the device maps {} bits, {remedy}", mapped.bits));
            note.and(cx.entry_span(entry, Key::DataType), "the data type").mend(remedy)
        }));
    }
}

/// Whether every mapping of the entry has this length.
fn only_here(cx: &Context<'_>, mapped: Mapped) -> bool {
    let same = |other: Mapped| (other.index, other.sub) == (mapped.index, mapped.sub);
    cx.mapped().filter(|(_, _, other)| same(*other)).all(|(_, _, other)| other.bits == mapped.bits)
}

/// The data type of the same kind with this many bits.
fn of_length(data_type: DataType, bits: u8) -> Option<DataType> {
    let same = |other: &&DataType| other.class() == data_type.class() && other.bits() == Some(bits);
    DataType::ALL.iter().find(same).copied()
}

pub(super) fn too_long(cx: &Context<'_>, out: &mut Out<'_>) {
    for pdo in &cx.device.pdos {
        let bits: u32 = pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
        if bits > 64 {
            let note = note(format!("{} maps {bits} bits", pdo_name(pdo)));
            out.push(note.at(cx.mapping_span(pdo, 0), "at most 64 fit into a frame"));
        }
    }
}

pub(super) fn mapping_count(cx: &Context<'_>, out: &mut Out<'_>) {
    for pdo in cx.device.pdos.iter().filter(|pdo| !cx.is_extra(pdo)) {
        let object = cx.device.object(pdo.direction.mapping_parameter(pdo.number));
        let Some(entry) = object.and_then(|object| object.entry(0)) else { continue };
        let Some(Value::Integer(count)) = held(entry) else { continue };
        // 254 and 255 mark a multiplexed PDO, which has no mapping.
        if matches!(count, 254 | 255) || *count == pdo.mapping.len() as i128 {
            continue;
        }
        let note = note(format!("{} maps {}, not {count}", pdo_name(pdo), plural(pdo.mapping.len(), "object")));
        let note = note.at(cx.mapping_span(pdo, 0), "says otherwise");
        let corrected = || cx.correct(entry, &format!("default = {}", pdo.mapping.len()));
        out.push(note.mend(entry.configured.is_none().then(corrected)));
    }
}

pub(super) fn wrong_direction(cx: &Context<'_>, out: &mut Out<'_>) {
    for (pdo, number, mapped) in cx.mapped() {
        let Some(entry) = cx.device.entry(mapped.index, mapped.sub) else { continue };
        let is_wrong = match pdo.direction {
            Direction::Receive => matches!(entry.access, AccessType::Ro | AccessType::Const | AccessType::Rwr),
            Direction::Transmit => matches!(entry.access, AccessType::Wo | AccessType::Rww),
        };
        if !is_wrong {
            continue;
        }
        let name = entry.access.name();
        let note = note(format!("{} maps {}, which is {name}", pdo_name(pdo), place(entry)));
        let note = note.at(cx.mapping_span(pdo, number), "mapped here");
        let note = note.and(cx.entry_span(entry, Key::AccessType), "the access type");
        let can = entry.pdo_mapping && !matches!(entry.index, cia301::DEVICE_TYPE..=cia301::IDENTITY);
        out.push(note.mend(can.then(|| cx.correct(entry, &access_by(cx, entry)))));
    }
}

/// Whether a PDO of this direction maps an entry.
fn is_mapped_by(cx: &Context<'_>, entry: &Entry, direction: Direction) -> bool {
    cx.mapped()
        .any(|(pdo, _, mapped)| pdo.direction == direction && (mapped.index, mapped.sub) == (entry.index, entry.sub))
}

fn is_mapped_both_ways(cx: &Context<'_>, entry: &Entry) -> bool {
    [Direction::Receive, Direction::Transmit].into_iter().all(|direction| is_mapped_by(cx, entry, direction))
}

/// The access type, as overlays write it, that suits the PDOs that map an entry.
fn access_by(cx: &Context<'_>, entry: &Entry) -> String {
    let access = match is_mapped_by(cx, entry, Direction::Receive) {
        _ if is_mapped_both_ways(cx, entry) => "rw",
        true => "rww",
        false => "rwr",
    };
    format!("access = \"{access}\"")
}

pub(super) fn open_direction(cx: &Context<'_>, out: &mut Out<'_>) {
    // Other rules report communication parameters and entries without a size.
    let is_open = |entry: &&Entry| {
        let fits = cx.device.bits(entry.data_type).is_some_and(|bits| bits <= 64);
        let is_rw = entry.pdo_mapping && entry.access == AccessType::Rw && entry.index >= 0x2000;
        is_rw && fits && !is_mapped_both_ways(cx, entry)
    };
    let open: Vec<&Entry> = cx.device.entries().filter(is_open).collect();
    let finding = match open.as_slice() {
        [] => return,
        [only] => note(format!("{} is rw and can be mapped, in either direction", place(only))),
        several => {
            let places = listed(several, |entry| place(entry));
            note(format!("{places} are rw and can be mapped, in either direction"))
        }
    };
    let finding = finding.at_each(open.iter().map(|entry| cx.entry_span(entry, Key::AccessType)), "", "");
    out.push(finding.help("write `rww` for what receive PDOs set, and `rwr` for what transmit PDOs send"));
}

pub(super) fn unusable_dummy(cx: &Context<'_>, out: &mut Out<'_>) {
    for (pdo, number, mapped) in cx.mapped().filter(|(_, _, mapped)| is_dummy(*mapped)) {
        let data_type = DataType::from_code(mapped.index);
        if !cx.device.dummies.contains(&data_type) {
            let note = note(format!("{data_type} is mapped as a dummy, but `[DummyUsage]` forbids it"));
            let key = format!("Dummy{:04X}", mapped.index);
            let allowed = data_type.bits().map(|_| match cx.facts.section(SectionKind::DummyUsage) {
                Some(section) => Patch::from_iter([cx.set_in(section, &key, "1")]),
                None => {
                    let end = cx.facts.syntax.source.line_count() as u32;
                    let lines = ["[DummyUsage]".to_owned(), format!("{key}=1")];
                    lines.map(|line| Change::After(end, line)).into_iter().collect()
                }
            });
            out.push(note.at(cx.mapping_span(pdo, number), "").mend(allowed));
        }
    }
}

pub(super) fn half_described(cx: &Context<'_>, out: &mut Out<'_>) {
    for pdo in &cx.device.pdos {
        let communication = pdo.direction.communication_parameter(pdo.number);
        let mapping = pdo.direction.mapping_parameter(pdo.number);
        let (there, missing) = match (cx.device.object(communication), cx.device.object(mapping)) {
            (Some(object), None) => (object, mapping),
            (None, Some(object)) => (object, communication),
            _ => continue,
        };
        out.push(note(format!("{} has no {missing:04X}", pdo_name(pdo))).at(there.span, "belongs to it"));
    }
}

pub(super) fn count(cx: &Context<'_>, out: &mut Out<'_>) {
    let info = &cx.device.info;
    let counts =
        [(Direction::Receive, "NrOfRXPDO", info.receive_pdos), (Direction::Transmit, "NrOfTXPDO", info.transmit_pdos)];
    for (direction, key, said) in counts {
        let first = direction.communication_parameter(1);
        let parameters =
            cx.device.objects.iter().filter(|object| (first..first + cia301::TO_MAPPING).contains(&object.index));
        let found = parameters.count();
        let Some((said, span)) = said.zip(cx.device_info(key)) else { continue };
        if usize::from(said) != found {
            let note = note(format!("there {}, not {said}", are(found, "PDO"))).at(span, "says otherwise");
            let mended = cx.replace(span, &found.to_string());
            if usize::from(said) < found {
                out.push(note.fix(mended));
            } else if cx.device.modules.is_empty() {
                out.push(
                    note.mend(mended.map(|mended| format!("unless the parameters of a PDO are missing, {mended}"))),
                );
            }
        }
    }
}

/// The number of a COB-ID, and whether the node-ID is added to it.
fn cob_id(pdo: &Pdo) -> Option<(i128, bool)> {
    match pdo.cob_id.as_ref()? {
        Value::Integer(id) => Some((*id, false)),
        Value::NodeIdPlus(id) => Some((i128::from(*id), true)),
        _ => None,
    }
}

pub(super) fn cob_id_collision(cx: &Context<'_>, out: &mut Out<'_>) {
    let mut seen: BTreeMap<(bool, i128), &Pdo> = BTreeMap::new();
    for pdo in &cx.device.pdos {
        let Some((id, node)) = cob_id(pdo) else { continue };
        let (valid, id) = (id & INVALID == 0, id & IDENTIFIER);
        if !valid || (id == 0 && !node) {
            continue;
        }
        match seen.get(&(node, id)) {
            // Several RPDOs may receive the same frame.
            Some(first) if first.direction == Direction::Receive && pdo.direction == Direction::Receive => {}
            Some(first) => {
                let names = [pdo_name(first), pdo_name(pdo)];
                let note = note(format!("{} and {} have the same COB-ID", names[0], names[1]));
                out.push(note.at(cx.pdo_span(pdo, 1), "").and(cx.pdo_span(first, 1), "the same"));
            }
            None => {
                seen.insert((node, id), pdo);
            }
        }
    }
}

pub(super) fn restricted_cob_id(cx: &Context<'_>, out: &mut Out<'_>) {
    for pdo in &cx.device.pdos {
        let Some((id, node)) = cob_id(pdo) else { continue };
        if id & (INVALID | EXTENDED) != 0 || (id & BASE_IDENTIFIER == 0 && !node) {
            continue;
        }
        let mut node_ids = if node { 1..=127 } else { 0..=0 };
        if node_ids.all(|node_id| cia301::is_restricted((id & BASE_IDENTIFIER) as u32 + node_id)) {
            let note = note(format!("the COB-ID of {} is restricted", pdo_name(pdo))).at(cx.pdo_span(pdo, 1), "");
            // The predefined connection set (CiA 301, 7.3.3) adds the node-ID to these identifiers, so they would be
            // those of node-ID 0.
            let predefined = (1..=4).any(|number| {
                let ids =
                    [Direction::Receive, Direction::Transmit].map(|direction| direction.predefined_cob_id(number));
                ids.contains(&u16::try_from(id & BASE_IDENTIFIER).ok())
            });
            let corrected = (predefined && !node).then(|| with_node_id(cx, pdo, id)).flatten();
            out.push(note.mend(corrected.map(|remedy| format!("the node-ID may be missing; {remedy}"))));
        }
    }
}

fn with_node_id(cx: &Context<'_>, pdo: &Pdo, id: i128) -> Option<String> {
    let entry = cx.device.entry(pdo.direction.communication_parameter(pdo.number), 1)?;
    let free = |other: &Pdo| cob_id(other).map(|(id, node)| (id & IDENTIFIER, node)) != Some((id & IDENTIFIER, true));
    let can = held_by(entry) == Key::DefaultValue && !cx.is_extra(pdo) && cx.device.pdos.iter().all(free);
    can.then(|| overlay(&place(entry), &format!("default = \"$NODEID+0x{id:X}\"")))
}

pub(super) fn cob_id_bits(cx: &Context<'_>, out: &mut Out<'_>) {
    for pdo in &cx.device.pdos {
        let Some((id, _)) = cob_id(pdo) else { continue };
        if id & EXTENDED == 0 && id & (IDENTIFIER - BASE_IDENTIFIER) != 0 {
            let note = note(format!("the COB-ID of {} has more than 11 bits", pdo_name(pdo)));
            out.push(note.at(cx.pdo_span(pdo, 1), "bit 29 is not set"));
        }
    }
}

pub(super) fn transmission_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for pdo in &cx.device.pdos {
        let Some(transmission_type) = pdo.transmission_type else { continue };
        let reserved = match pdo.direction {
            Direction::Receive => matches!(transmission_type, 241..=253),
            Direction::Transmit => matches!(transmission_type, 241..=251),
        };
        if reserved {
            let note = note(format!("{} has the transmission type {transmission_type}", pdo_name(pdo)));
            out.push(note.at(cx.pdo_span(pdo, 2), "reserved"));
        }
    }
}

pub(super) fn granularity(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(granularity) = cx.device.info.granularity.filter(|&granularity| granularity > 1) else { return };
    let Some(span) = cx.device_info("Granularity") else { return };
    let odd: Vec<_> = cx.mapped().filter(|(_, _, mapped)| mapped.bits % granularity != 0).collect();
    let Some(&(pdo, number, first)) = odd.first() else { return };
    let (are, first_of_them) = if odd.len() == 1 { ("is", "") } else { ("are", ", the first of them") };
    let what = plural(odd.len(), "mapped length");
    let note = note(format!("{what} {are} no multiple of the granularity of {granularity} bits"));
    let common = cx.mapped().fold(0, |common, (_, _, mapped)| greatest_common_divisor(common, mapped.bits));
    let note = note.at(span, format!("{common} would agree with all mapped lengths"));
    let bits = plural(first.bits.into(), "bit");
    let note = note.and(cx.mapping_span(pdo, number), format!("{bits}{first_of_them}"));
    // Another divisor comes from a wrong mapping, not from a granularity.
    let is_usual = common == 1 || (common <= 64 && common % 8 == 0);
    out.push(note.mend(is_usual.then(|| cx.replace(span, &common.to_string())).flatten()));
}

fn greatest_common_divisor(a: u8, b: u8) -> u8 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
