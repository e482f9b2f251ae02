//! Values that a manual names.

use lexican_eds::model::{Entry, Meaning};

use super::objects::address_in;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::cells;
use crate::notation::number;
use crate::rig::{Rig, Simulator};

/// Compares `values.csv`: a value is in the entry's enumeration, its meaning is that in `terms.csv`, and the drive
/// accepts it. A read-only entry shows the values written to its counterpart of the same type.
pub(crate) fn check<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let rows = case.manual.rows("values.csv");
    let taken = crate::rig::once::<S, _>(cells(rows), || {
        rows.iter()
            .map(|row| Some(is_taken::<S>(case, address_in(row)?, number(row.get("value"))?)))
            .collect::<Vec<_>>()
    });
    for (row, taken) in rows.iter().zip(taken) {
        let Some((entry, value)) = address_in(row).zip(number(row.get("value"))) else { continue };
        let Some(Meaning::Enumeration(name)) = case.sheet.device.entry(entry.0, entry.1).map(|entry| &entry.meaning)
        else {
            continue;
        };
        checker.key(row);
        let written = case.sheet.device.enumerations.get(name);
        let written = written.is_some_and(|written| written.values.iter().any(|named| named.value == value));
        checker.that(row, "value", Against::Sheet, written, format!("{name} has no such value"));
        let generated = case.sheet.code.enumerations.get(name.as_str());
        let generated = generated.is_some_and(|names| names.iter().any(|named| i128::from(named.raw) == value));
        checker.that(row, "value", Against::Code, generated, format!("{name} has no such value"));
        checker.that(row, "value", Against::Entry, taken == Some(true), "the drive refuses it");
        let term = case.manual.rows("terms.csv").iter().find(|term| {
            term.get("type") == name && number(term.get("value")) == Some(value) && !term.get("printed").is_empty()
        });
        checker.cell(row, "meaning", Against::Manual, term.map_or("", |term| term.get("printed")));
    }
}

fn is_taken<S: Simulator>(case: &Case<'_>, (index, sub): (u16, u8), value: i128) -> bool {
    let device = &case.sheet.device;
    let Some(shown) = device.entry(index, sub) else { return false };
    let same = |entry: &&Entry| entry.meaning == shown.meaning && entry.access.writable();
    let Some(taken) = Some(shown).filter(same).or_else(|| device.entries().find(same)) else { return false };
    let mut rig = Rig::<S>::new();
    let size = taken.data_type.bits().map_or(4, |bits| bits / 8);
    let read = |rig: &mut Rig<S>| rig.read(index, sub).map(i128::from) == Ok(value);
    let was_there = read(&mut rig);
    // A command is accepted, but not kept.
    let done = rig.write(taken.index, taken.sub, value as i64, size).is_ok();
    was_there || done && (read(&mut rig) || (taken.index, taken.sub) == (index, sub))
}
