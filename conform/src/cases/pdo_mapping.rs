//! 3.21 to 3.33: the mapping of PDOs.

use std::collections::BTreeSet;

use lexican_eds::model::{AccessType, Direction, Entry, Pdo};
use lexican_eds::types::DataType;
use lexican_runtime::wire::nmt::NmtState;

use super::pdo::{configure, transmission};
use super::sync::produce_nothing;
use crate::answers;
use crate::case::{Case, case};
use crate::sdo::Answer;
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure, failed, not_applicable};

const ROOM: &str = "A mapping of more than fits into eight bytes, or into its entries, is refused.";
const UNMAPPABLE: &str = "An object that may not be mapped, or not in this direction, is refused by the mapping.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.5.2.38/1", "3.21", "the mappings are those of the data sheet, and what they map exists", |t| {
        for pdo in t.sheet.device.pdos.clone() {
            is_mapped_as_described(t, &pdo)?;
        }
        Ok(())
    })
    .requires("A mapping names objects of the device that may be mapped, each with its length in bits."),
    case("301/7.5.2.38/2", "3.22", "a mapping by the procedure is sent", |t| {
        let pdo = dynamic(t, Direction::Transmit)?;
        let entry = of_some_value(t, &pdo)?;
        map(t, &pdo, &[parameter(t, &entry)])?.map_err(|code| failed(format!("the mapping is refused: {code}")))?;
        produce_nothing(t)?;
        let tpdo = configure(t, &pdo, transmission(1))?;
        t.enter(NmtState::Operational)?;
        let value = t.read_bytes(entry.index, entry.sub)?;
        t.sync(None)?;
        t.hears_once(tpdo.id, &value, 20)
    })
    .requires("A mapping changes while the PDO is off and sub-index 0 is 0; the PDO then has what was mapped."),
    case("301/7.5.2.38/3", "3.23", "a mapping is not changed while it counts", |t| {
        let pdo = dynamic(t, Direction::Transmit)?;
        let entry = of_some_value(t, &pdo)?;
        switch_off(t, &pdo)?;
        if t.read(mapping_index(&pdo), 0)? == 0 {
            return Err(not_applicable("the PDO maps nothing by default"));
        }
        let other = parameter(t, &entry);
        t.refuses(mapping_index(&pdo), 1, other, &answers::MAPPED)
    })
    .requires("A mapping is not changed while sub-index 0 says that it counts."),
    case("301/7.5.2.38/4", "3.24", "a mapping is not changed while the PDO exists", |t| {
        let pdo = dynamic(t, Direction::Transmit)?;
        if t.read(mapping_index(&pdo), 0)? == 0 {
            return Err(not_applicable("the PDO maps nothing by default"));
        }
        let cob_id = t.read(parameter_index(&pdo), 1)? as u32;
        if cob_id >> 31 != 0 {
            t.write(parameter_index(&pdo), 1, cob_id & !(1 << 31))?;
        }
        t.refuses(mapping_index(&pdo), 0, 0, &answers::MAPPED)
    })
    .requires("A mapping is not changed while the PDO exists (bit 31 of its identifier is 0)."),
    case("301/7.5.2.38/5", "3.25", "more objects than there are entries are not mapped", |t| {
        let pdo = dynamic(t, Direction::Transmit)?;
        switch_off(t, &pdo)?;
        let index = mapping_index(&pdo);
        let entries = t.entries(|entry| entry.index == index).len() as u32;
        t.write(index, 0, 0)?;
        for too_many in [entries, 65] {
            t.refuses(index, 0, too_many, &answers::NO_ROOM)?;
        }
        Ok(())
    })
    .requires(ROOM),
    case("301/7.5.2.38/6", "3.26", "objects of more than eight bytes together are not mapped", |t| {
        let pdo = dynamic(t, Direction::Transmit)?;
        let entries = mappable(t, "of eight bytes together", |t, entry| sends(entry) && t.bits(entry) >= Some(8))?;
        let room = t.entries(|entry| entry.index == mapping_index(&pdo)).len() - 1;
        let mut longest: Vec<u32> = entries.iter().map(|entry| parameter(t, entry)).collect();
        longest.sort_by_key(|parameter| std::cmp::Reverse(parameter & 0xFF));
        longest.truncate(room);
        let bits: u32 = longest.iter().map(|parameter| parameter & 0xFF).sum();
        if bits <= 64 {
            return Err(not_applicable("nothing of more than eight bytes can be put together"));
        }
        let answer = map(t, &pdo, &longest)?;
        t.is_refused(answer, &answers::NO_ROOM, "the mapping")
    })
    .requires(ROOM),
    case("301/7.5.2.36/1", "3.27", "an output is received", |t| {
        maps(t, Direction::Receive, "is an output", receives_only)
    })
    .requires("An object that may be mapped into RPDOs is taken by the mapping of one."),
    case("301/7.5.2.36/2", "3.28", "an input is not received", |t| {
        does_not_map(t, Direction::Receive, "is an input", sends_only)
    })
    .requires(UNMAPPABLE),
    case("301/7.5.2.36/3", "3.29", "what no PDO maps is not received", |t| {
        does_not_map(t, Direction::Receive, "no PDO maps", |entry| !entry.pdo_mapping)
    })
    .requires(UNMAPPABLE),
    case("301/7.5.2.38/7", "3.30", "an input is transmitted", |t| {
        maps(t, Direction::Transmit, "is an input", sends_only)
    })
    .requires("An object that may be mapped into TPDOs is taken by the mapping of one."),
    case("301/7.5.2.38/8", "3.31", "an output is not transmitted", |t| {
        does_not_map(t, Direction::Transmit, "is an output", receives_only)
    })
    .requires(UNMAPPABLE),
    case("301/7.5.2.38/9", "3.32", "what no PDO maps is not transmitted", |t| {
        does_not_map(t, Direction::Transmit, "no PDO maps", |entry| !entry.pdo_mapping)
    })
    .requires(UNMAPPABLE),
    case("301/7.5.2.36/4", "3.33", "a placeholder is received", |t| {
        let pdo = dynamic(t, Direction::Receive)?;
        let dummies = t.sheet.device.dummies.clone();
        let dummy = |data_type: &DataType| Some(u32::from(data_type.code()) << 16 | u32::from(data_type.bits()?));
        let dummies: Vec<u32> = dummies.iter().filter_map(dummy).filter(|dummy| dummy & 0xFF >= 8).collect();
        if dummies.is_empty() {
            return Err(not_applicable("no placeholder"));
        }
        for dummy in dummies {
            is_mapped(t, &pdo, dummy)?;
        }
        Ok(())
    })
    .requires("A data type mapped as a placeholder (0001h to 0007h) stands for bits of an RPDO that are not used."),
    case("301/7.5.2.36/5", "", "what does not exist is not received", |t| maps_nothing(t, Direction::Receive))
        .requires("An object that does not exist is not mapped into an RPDO."),
    case("301/7.5.2.38/10", "", "what does not exist is not transmitted", |t| maps_nothing(t, Direction::Transmit))
        .requires("An object that does not exist is not mapped into a TPDO."),
];

fn sends(entry: &Entry) -> bool {
    entry.pdo_mapping && !matches!(entry.access, AccessType::Rww | AccessType::Wo)
}

fn sends_only(entry: &Entry) -> bool {
    entry.pdo_mapping && matches!(entry.access, AccessType::Ro | AccessType::Rwr | AccessType::Const)
}

fn receives_only(entry: &Entry) -> bool {
    entry.pdo_mapping && matches!(entry.access, AccessType::Rww | AccessType::Wo)
}

/// The value of a mapping parameter for an entry.
pub(crate) fn parameter(t: &Tester<'_>, entry: &Entry) -> u32 {
    u32::from(entry.index) << 16 | u32::from(entry.sub) << 8 | t.bits(entry).map_or(0, u32::from)
}

fn parameter_index(pdo: &Pdo) -> u16 {
    if pdo.direction == Direction::Receive { 0x13FF + pdo.number } else { 0x17FF + pdo.number }
}

fn mapping_index(pdo: &Pdo) -> u16 {
    parameter_index(pdo) + MAPPING
}

/// The first PDO with a writable mapping that can be disabled.
fn dynamic(t: &Tester<'_>, direction: Direction) -> Outcome<Pdo> {
    let mut pdos = t.sheet.device.pdos.iter().filter(|pdo| pdo.direction == direction);
    let dynamic = pdos.find(|pdo| has_dynamic_mapping(t, pdo));
    dynamic.cloned().ok_or_else(|| not_applicable("no PDO whose mapping can be written"))
}

pub(crate) fn has_dynamic_mapping(t: &Tester<'_>, pdo: &Pdo) -> bool {
    let settable = |index, sub| t.entry(index, sub).is_ok_and(|entry| entry.access.writable());
    settable(parameter_index(pdo), 1) && [0, 1].into_iter().all(|sub| settable(mapping_index(pdo), sub))
}

fn mappable(t: &Tester<'_>, what: &str, wanted: fn(&Tester<'_>, &Entry) -> bool) -> Outcome<Vec<Entry>> {
    t.some(what, |entry| t.bits(entry).is_some() && wanted(t, entry))
}

/// An entry that the TPDO could send and does not, if possible with a value other than 0.
fn of_some_value(t: &mut Tester<'_>, pdo: &Pdo) -> Outcome<Entry> {
    let mapped: Vec<(u16, u8)> = pdo.mapping.iter().map(|mapped| (mapped.index, mapped.sub)).collect();
    let entries = mappable(t, "to be transmitted", |t, entry| sends(entry) && t.bits(entry) >= Some(8))?;
    let mut best = None;
    for entry in entries.into_iter().filter(|entry| !mapped.contains(&(entry.index, entry.sub))) {
        let value = t.read(entry.index, entry.sub)?;
        if value != 0 {
            return Ok(entry);
        }
        best = best.or(Some(entry));
    }
    best.ok_or_else(|| not_applicable("nothing but the default mapping can be transmitted"))
}

pub(crate) fn switch_off(t: &mut Tester<'_>, pdo: &Pdo) -> Outcome {
    let index = parameter_index(pdo);
    let cob_id = t.read(index, 1)? as u32;
    t.write(index, 1, cob_id | 1 << 31)
}

/// Disables the PDO of a parameter before that is written, if possible.
pub(crate) fn switch_off_of(t: &mut Tester<'_>, index: u16) -> Outcome {
    let Some(parameter) = pdo_parameter(index) else { return Ok(()) };
    if t.entry(parameter, 1).is_ok_and(|entry| entry.access.readable() && entry.access.writable()) {
        let cob_id = t.read(parameter, 1)? as u32;
        // Other cases judge whether the device allows it.
        t.try_write(parameter, 1, cob_id | 1 << 31)?.ok();
    }
    Ok(())
}

/// The distance from the communication parameter of a PDO to its mapping.
const MAPPING: u16 = 0x200;

/// The communication parameter of the PDO that an object belongs to.
fn pdo_parameter(index: u16) -> Option<u16> {
    matches!(index, 0x1400..=0x1BFF).then_some(index & !MAPPING)
}

/// The order for writing entries. A PDO is changed while it is disabled, and its mapping while the number of entries is
/// 0, so COB-IDs and numbers of entries come last. Disables the PDOs as far as the device allows it.
pub(crate) fn writing_order(
    t: &mut Tester<'_>,
    entries: impl Iterator<Item = (u16, u8)> + Clone,
) -> Outcome<Vec<(u16, u8)>> {
    let pdos: BTreeSet<u16> = entries.clone().filter_map(|(index, _)| pdo_parameter(index)).collect();
    for &index in &pdos {
        switch_off_of(t, index)?;
        if t.entry(index + MAPPING, 0).is_ok_and(|entry| entry.access.writable()) {
            t.try_write(index + MAPPING, 0, 0)?.ok();
        }
    }
    let last: Vec<_> = pdos.iter().flat_map(|&index| [(index + MAPPING, 0), (index, 1)]).collect();
    let first = entries.filter(|at| !last.contains(at));
    Ok(first.chain(last.iter().copied()).collect())
}

/// Maps some entries by the procedure of CiA 301, 7.5.2.36, except that the PDO stays disabled.
pub(crate) fn map(t: &mut Tester<'_>, pdo: &Pdo, entries: &[u32]) -> Outcome<Answer> {
    switch_off(t, pdo)?;
    let index = mapping_index(pdo);
    t.write(index, 0, 0)?;
    for (sub, entry) in (1..).zip(entries) {
        if let Err(code) = t.try_write(index, sub, *entry)? {
            return Ok(Err(code));
        }
    }
    t.try_write(index, 0, entries.len() as u32)
}

fn is_mapped(t: &mut Tester<'_>, pdo: &Pdo, entry: u32) -> Outcome {
    map(t, pdo, &[entry])?.map_err(|code| failed(format!("{entry:08X}h is not mapped: {code}")))?;
    t.reads(mapping_index(pdo), 0, 1)?;
    t.reads(mapping_index(pdo), 1, u64::from(entry))?;
    // Enables the PDO with this mapping.
    let cob_id = t.read(parameter_index(pdo), 1)? as u32 & !(1 << 31);
    t.write(parameter_index(pdo), 1, cob_id)
}

fn maps(t: &mut Tester<'_>, direction: Direction, what: &str, wanted: fn(&Entry) -> bool) -> Outcome {
    let pdo = dynamic(t, direction)?;
    let entries = t.some(what, |entry| wanted(entry) && t.bits(entry).is_some_and(|bits| bits >= 8))?;
    for entry in entries {
        let entry = parameter(t, &entry);
        is_mapped(t, &pdo, entry)?;
    }
    Ok(())
}

fn does_not_map(t: &mut Tester<'_>, direction: Direction, what: &str, wanted: fn(&Entry) -> bool) -> Outcome {
    let pdo = dynamic(t, direction)?;
    let entries = t.some(what, |entry| wanted(entry) && t.bits(entry).is_some_and(|bits| bits >= 8))?;
    for entry in entries {
        let entry = parameter(t, &entry);
        let answer = map(t, &pdo, &[entry])?;
        t.is_refused(answer, &answers::NOT_MAPPABLE, "the mapping")?;
    }
    Ok(())
}

/// Checks that mapping an object that the data sheet lacks is refused.
fn maps_nothing(t: &mut Tester<'_>, direction: Direction) -> Outcome {
    let pdo = dynamic(t, direction)?;
    let lacks = |index: &u16| t.sheet.device.object(*index).is_none();
    let index =
        (0x2000..=0x5FFF).find(lacks).ok_or_else(|| not_applicable("every object of the manufacturer exists"))?;
    let answer = map(t, &pdo, &[u32::from(index) << 16 | 8])?;
    t.is_refused(answer, &answers::NOT_MAPPABLE, &format!("mapping {index:04X}h, which does not exist,"))
}

fn is_mapped_as_described(t: &mut Tester<'_>, pdo: &Pdo) -> Outcome {
    let index = mapping_index(pdo);
    t.reads(index, 0, pdo.mapping.len() as u64)?;
    for (sub, mapped) in (1..).zip(&pdo.mapping) {
        let (object, entry) = (u64::from(mapped.index), u64::from(mapped.sub));
        t.reads(index, sub, object << 16 | entry << 8 | u64::from(mapped.bits))?;
        let described = t
            .entry(mapped.index, mapped.sub)
            .map_err(|lacks| failed(format!("{}, and it is mapped", lacks.reason())))?;
        let may_be = if pdo.direction == Direction::Transmit { sends(&described) } else { described.pdo_mapping };
        let right = may_be && t.bits(&described) == Some(mapped.bits);
        ensure(right, || format!("{:04X}:{:02X} cannot be mapped like this", mapped.index, mapped.sub))?;
        if described.access.readable() {
            let bytes = t.read_bytes(mapped.index, mapped.sub)?;
            let fits = bytes.len() == usize::from(mapped.bits.div_ceil(8));
            ensure(fits, || format!("{:04X}:{:02X} has {} bytes", mapped.index, mapped.sub, bytes.len()))?;
        }
    }
    Ok(())
}
