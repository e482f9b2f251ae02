//! 4: the object dictionary against the data sheet.

use std::collections::BTreeMap;

use lexican_eds::model::{AccessType, Entry, ObjectKind, Value};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId};

use super::pdo_mapping;
use crate::answers::{self, Accepted};
use crate::case::{Case, case};
use crate::hazard::Hazard;
use crate::tester::Tester;
use crate::verdict::{Outcome, Verdict, ensure, failed};

const DEFAULTS: &str = "After a reset an entry has the default value that the data sheet gives.";

pub(crate) const CASES: &[Case] = &[
    case("306-1/6.5.2/1", "4.1", "all that may be read is read, and has its size", |t| {
        for entry in t.entries(|entry| entry.access.readable()) {
            is_read(t, &entry)?;
        }
        Ok(())
    })
    .requires("Each entry that the data sheet lets be read exists, and has the size of its data type."),
    case("306-1/6.5.2/2", "4.2", "values are the defaults", |t| are_defaults(t, |_| true)).requires(DEFAULTS),
    case("306-1/6.5.2/3", "4.3", "what is read-only is not written", |t| {
        for entry in t.some_to_write("is read-only", |entry| !entry.access.writable())? {
            is_not_written(t, &entry)?;
        }
        Ok(())
    })
    .requires("An entry that the data sheet calls ro or const is not written."),
    case("306-1/6.5.2/4", "4.4", "what is write-only is not read", |t| {
        for entry in t.some("is write-only", |entry| !entry.access.readable())? {
            is_not_read(t, &entry)?;
        }
        Ok(())
    })
    .requires("An entry that the data sheet calls wo is not read."),
    case("306-1/6.5.2/5", "4.5", "sub-index FFh has object type and data type", |t| {
        let described = t.some("has sub-index FFh", |entry| entry.sub == 0xFF)?;
        for entry in described {
            let object = t.sheet.device.object(entry.index).ok_or_else(|| failed("an entry of no object"))?;
            let kind = object.kind;
            let element = object.entry(1).map_or(0, |element| element.data_type.code());
            let structure = t.read(entry.index, 0xFF)?;
            ensure(structure & 0xFF == u64::from(kind.code()), || format!("{structure:08X}h is no {}", kind.name()))?;
            // Elements of a record may differ; those of an array have one type.
            let right = kind != ObjectKind::Array || structure >> 8 == u64::from(element);
            ensure(right, || format!("{structure:08X}h, the elements are of type {element:04X}h"))?;
        }
        Ok(())
    })
    .requires("Sub-index FFh, where the device has it, names the object type and data type of the data sheet."),
    case("306-1/6.5.2/6", "4.6", "limits hold", |t| {
        for (entry, low, high) in limited(t)? {
            let (index, sub) = (entry.index, entry.sub);
            pdo_mapping::switch_off_of(t, index)?;
            let before = t.read_bytes(index, sub)?;
            for value in [low, high] {
                t.write(index, sub, value as u32)?;
                t.reads(index, sub, value as u64)?;
            }
            let last = highest(t, &entry);
            if low > 0 {
                t.refuses(index, sub, (low - 1) as u32, &answers::TOO_LOW)?;
            }
            if high < last {
                t.refuses(index, sub, (high + 1) as u32, &answers::TOO_HIGH)?;
            }
            // A limit may depend on another value, such as that of the event timer on the inhibit time.
            t.write_back(&entry, &before)?.ok();
        }
        Ok(())
    })
    .requires("A value within the limits of the data sheet is taken, and one beyond them is not."),
    case(
        "306-1/6.5.2/7",
        "4.7",
        "each entry is accessed in the ways that its access type allows, while PDOs work",
        |t| {
            t.enter(NmtState::Operational)?;
            for entry in t.entries(|_| true) {
                if entry.access.readable() {
                    is_read(t, &entry)?;
                } else {
                    is_not_read(t, &entry)?;
                }
                if !entry.access.writable() && t.may_write(&entry) {
                    is_not_written(t, &entry)?;
                }
            }
            Ok(())
        },
    )
    .requires("The access type of an entry holds in OPERATIONAL as well, while PDOs are transferred."),
    case("306-1/6.5.2/8", "4.8", "values that a scan may read are the defaults", |t| {
        are_defaults(t, |flags| flags & NO_READ_ON_SCAN == 0)
    })
    .requires(DEFAULTS),
    case("306-1/6.5.2/9", "4.9", "what was read may be written", |t| {
        let both = |entry: &Entry| entry.access.readable() && entry.access.writable();
        let mut values = BTreeMap::new();
        for entry in t.some_to_write("can be read and written", both)? {
            let (index, sub) = (entry.index, entry.sub);
            // 1003h takes only 0, and 1010h and 1011h need a signature.
            if t.flags(&entry) & NO_WRITE_ON_DOWNLOAD != 0 || matches!(index, 0x1003 | 0x1010 | 0x1011) {
                continue;
            }
            let before = t.read_bytes(index, sub)?;
            // A value that cannot be an identifier need not be accepted as one.
            let identifier =
                <[u8; 4]>::try_from(&before[..]).map(|bytes| CobId::from_parameter(u32::from_le_bytes(bytes)));
            if !is_identifier(&entry) || !identifier.is_ok_and(CobId::is_restricted) {
                values.insert((index, sub), (entry, before));
            }
        }
        for at @ (index, sub) in pdo_mapping::writing_order(t, values.keys().copied())? {
            let Some((entry, before)) = values.remove(&at) else { continue };
            let answer = t.write_back(&entry, &before)?;
            // It may be writable in another state.
            if answer == Err(AbortCode::DEVICE_STATE) {
                continue;
            }
            answer.map_err(|code| {
                failed(format!("{index:04X}:{sub:02X} does not take {}: {code}", t.shown((index, sub), &before)))
            })?;
            let after = t.read_bytes(index, sub)?;
            ensure(before == after, || {
                let [before, after] = [before, after].map(|bytes| t.shown((index, sub), &bytes));
                format!("{index:04X}:{sub:02X} was {before} and is {after}")
            })?;
        }
        Ok(())
    })
    .requires("The value that an entry has is one that it takes, unless the data sheet says otherwise."),
    case("306-1/6.5.2/10", "", "what does not exist is refused with the abort code for it", |t| {
        for (index, sub, accepted) in missing(t) {
            if let Err(refused) = t.upload(index, sub)? {
                ensure(accepted.takes(refused), || format!("{index:04X}:{sub:02X} does not exist: {refused}"))?;
            }
        }
        Ok(())
    })
    .requires(
        "Objects and sub-indices that the data sheet lacks do not exist, and the abort code says which is missing.",
    ),
    case("306-1/6.5.2/11", "", "nothing exists that the data sheet lacks", |t| {
        for (index, sub, _) in missing(t) {
            let answer = t.upload(index, sub)?;
            ensure(answer.is_err(), || format!("{index:04X}:{sub:02X} is read, and the data sheet does not have it"))?;
        }
        Ok(())
    })
    .requires("The data sheet names every object of the device.")
    .recommended(),
    case("306-1/6.5.2/12", "", "OPERATIONAL: what is const or fixed has the same value", |t| {
        let is_fixed = |entry: &Entry| {
            let of_cia_301 = matches!(entry.index, 0x1000 | 0x1008..=0x100A | 0x1018 | 0x1200..=0x1BFF);
            entry.access == AccessType::Const || of_cia_301 && entry.access == AccessType::Ro
        };
        let fixed = t.some("is const", is_fixed)?;
        let before = fixed.iter().map(|entry| t.upload(entry.index, entry.sub)).collect::<Outcome<Vec<_>>>()?;
        t.enter(NmtState::Operational)?;
        for (Entry { index, sub, .. }, before) in fixed.into_iter().zip(before) {
            let after = t.upload(index, sub)?;
            ensure(before == after, || match [before, after] {
                [Ok(before), Ok(after)] => {
                    let [before, after] = [before, after].map(|bytes| t.shown((index, sub), &bytes));
                    format!("{index:04X}:{sub:02X} was {before} and is {after}")
                }
                _ => format!("{index:04X}:{sub:02X} is read in one state only"),
            })?;
        }
        Ok(())
    })
    .requires("An entry with the access type const never changes, nor does a communication parameter that is ro."),
];

/// Addresses after each object and each highest sub-index that the data sheet does not have, and the codes for reading
/// there.
fn missing(t: &Tester<'_>) -> Vec<(u16, u8, &'static Accepted)> {
    let device = &t.sheet.device;
    let mut missing = Vec::new();
    for object in &device.objects {
        // FFh describes the structure of an object, and may be missing in the data sheet.
        let highest = object.entries.iter().map(|entry| entry.sub).filter(|&sub| sub != 0xFF).max();
        if let Some(sub) = highest.filter(|&sub| sub < 0xFE) {
            missing.push((object.index, sub + 1, &answers::NO_SUB_INDEX));
        }
        if let Some(next) = object.index.checked_add(1).filter(|&next| device.object(next).is_none()) {
            missing.push((next, 0, &answers::NO_OBJECT));
        }
    }
    missing
}

/// Bits of `ObjFlags`.
const NO_WRITE_ON_DOWNLOAD: u32 = 1;
const NO_READ_ON_SCAN: u32 = 2;

fn is_read(t: &mut Tester<'_>, entry: &Entry) -> Outcome {
    let (index, sub) = (entry.index, entry.sub);
    // An error field that has had no error may be empty.
    let may_be_empty = index == 0x1003 && sub > 0;
    match t.upload(index, sub)? {
        Ok(bytes) => {
            let size = t.size(entry);
            let right = size.is_none_or(|size| size == bytes.len());
            ensure(right, || format!("{index:04X}:{sub:02X} has {} bytes, not {size:?}", bytes.len()))
        }
        Err(code) if may_be_empty && answers::NO_ERROR.takes(code) => Ok(()),
        Err(code) => Err(failed(format!("reading {index:04X}:{sub:02X}: {code}"))),
    }
}

fn is_not_read(t: &mut Tester<'_>, entry: &Entry) -> Outcome {
    t.refuses_read(entry.index, entry.sub, &answers::WRITE_ONLY)
}

fn is_not_written(t: &mut Tester<'_>, entry: &Entry) -> Outcome {
    let data = &[0; 8][..t.size(entry).unwrap_or(4)];
    t.refuses_bytes(entry.index, entry.sub, data, &answers::READ_ONLY)
}

/// Reports all entries that differ, so that a known deviation does not hide others.
fn are_defaults(t: &mut Tester<'_>, wanted: fn(u32) -> bool) -> Outcome {
    let mut differ = Vec::new();
    for entry in t.entries(|entry| entry.access.readable()) {
        let (index, sub) = (entry.index, entry.sub);
        // 1003h is empty, 1010h and 1011h read as capabilities, and a node-ID is the one that was set.
        let of_node = Hazard::of_write(&t.sheet.device, index) == Some(Hazard::NodeId);
        // A process value has its present value.
        let is_measured = entry.pdo_mapping && !entry.access.writable();
        let has_other = matches!((index, sub), (0x1003, _) | (0x1010 | 0x1011, 1..));
        if of_node || is_measured || has_other || !wanted(t.flags(&entry)) {
            continue;
        }
        match t.is_default(&entry) {
            Err(Verdict::Failed(why)) => differ.push(why),
            other => other?,
        }
    }
    ensure(differ.is_empty(), || differ.join("; "))
}

/// Whether an entry holds the COB-ID of a service.
fn is_identifier(entry: &Entry) -> bool {
    match entry.index {
        0x1005 | 0x1012 | 0x1014 => true,
        0x1200..=0x12FF => matches!(entry.sub, 1 | 2),
        0x1400..=0x15FF | 0x1800..=0x19FF => entry.sub == 1,
        _ => false,
    }
}

pub(crate) fn highest(t: &Tester<'_>, entry: &Entry) -> i128 {
    let of_bits = (1 << t.bits(entry).unwrap_or(0)) - 1;
    entry.data_type.range().map_or(of_bits, |(_, highest)| highest)
}

/// The writable entries of at most four bytes that have limits, with these limits.
pub(crate) fn limited(t: &Tester<'_>) -> Outcome<Vec<(Entry, i128, i128)>> {
    let number = |value: &Option<Value>| value.as_ref().and_then(Value::as_integer);
    let limits = |entry: &Entry| {
        let (low, high) = (number(&entry.low)?, number(&entry.high)?);
        let can_be_tried =
            entry.access.writable() && entry.access.readable() && t.bits(entry).is_some_and(|bits| bits <= 32);
        // With another node-ID the device would not be found again; 1003h:00 counts errors; 1010h takes a signature;
        // and mappings, 1016h and COB-IDs have fields, so that not every number within limits has a meaning.
        let is_node_id = Hazard::of_write(&t.sheet.device, entry.index) == Some(Hazard::NodeId);
        let counts =
            matches!((entry.index, entry.sub), (0x1003, 0) | (0x1010 | 0x1011 | 0x1600..=0x17FF | 0x1A00..=0x1BFF, _));
        let is_put_together = entry.index == 0x1016 || is_identifier(entry);
        let can_be_tried = can_be_tried && !counts && !is_node_id && !is_put_together;
        (can_be_tried && low >= 0 && low < high).then_some((low, high))
    };
    let limited = t.some_to_write("that can be written has limits", |entry| limits(entry).is_some())?;
    Ok(limited.into_iter().filter_map(|entry| limits(&entry).map(|(low, high)| (entry, low, high))).collect())
}
