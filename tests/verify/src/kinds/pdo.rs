//! PDOs: mappings, and layouts byte by byte.

use lexican_eds::model::{Direction, Pdo, Value};
use lexican_runtime::object::Mapped;

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::notation::yes;
use crate::rig::{Rig, Simulator};

/// The PDOs of the generated code, with what the data sheet says of them.
fn described<'a>(checker: &mut Checker<'_>, case: &Case<'a>) -> Vec<(&'a str, &'a [Mapped], u32, &'a Pdo)> {
    let mut all = Vec::new();
    for (name, (generated, cob_id)) in &case.sheet.code.pdos {
        match case.sheet.device.pdos.iter().find(|pdo| name_of(pdo) == *name) {
            Some(pdo) => all.push((*name, *generated, *cob_id, pdo)),
            None => checker.finding(format!("{name}: the data sheet maps nothing")),
        }
    }
    all
}

pub(crate) fn name_of(pdo: &Pdo) -> String {
    let side = if pdo.direction == Direction::Receive { "R" } else { "T" };
    format!("{side}PDO{}", pdo.number)
}

/// The index of the mapping of a PDO.
pub(crate) fn mapping_index(pdo: &Pdo) -> u16 {
    let base = if pdo.direction == Direction::Receive { 0x1600 } else { 0x1A00 };
    base + pdo.number - 1
}

/// Compares `pdo_mappings.csv`, whose cells are bytes or bits.
pub(crate) fn mappings<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for (name, generated, _, pdo) in described(checker, case) {
        let mut rig = Rig::<S>::new();
        let index = mapping_index(pdo);
        let mut bit = 0;
        for (position, mapped) in (1_u8..).zip(&pdo.mapping) {
            let (first, last) = (bit / 8, (bit + u32::from(mapped.bits)) / 8 - 1);
            bit += u32::from(mapped.bits);
            let Some(row) = checker.row("pdo_mappings.csv", &format!("{index:04X}:{position}")) else { continue };
            checker.cell(row, "pdo", Against::Sheet, name);
            let sub = if row.get("object").contains(':') { format!(":{:02X}", mapped.sub) } else { String::new() };
            checker.cell(row, "object", Against::Sheet, format!("{:04X}{sub}", mapped.index));
            let place = [("first_byte", first), ("last_byte", last), ("bits", mapped.bits.into())];
            for (column, found) in place.into_iter().filter(|(column, _)| row.has(column)) {
                checker.cell(row, column, Against::Sheet, found);
            }
            let code = generated.get(usize::from(position) - 1).copied();
            let same = Some(Mapped::new(mapped.index, mapped.sub, mapped.bits)) == code;
            checker.that(row, "object", Against::Code, same, format!("{code:?}"));
            let read = rig.read(index, position);
            let agrees = code.is_some_and(|code| read == Ok(code.to_parameter()));
            checker.that(row, "object", Against::Entry, agrees, format!("{read:08X?}"));
            if row.has("static") {
                checker.cell(row, "static", Against::Sheet, yes(!pdo.dynamic));
                let fixed = rig.write(index, position, 0, 4) == Err(0x0601_0002);
                checker.cell(row, "static", Against::Drive, yes(fixed));
            }
        }
    }
}

/// Compares `pdo_layouts.csv`. `sample` is a value for an object; its bytes all differ, and it moves nothing.
pub(crate) fn layouts<S: Simulator>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    prepare: fn(&mut Rig<S>) -> bool,
    sample: fn(u16) -> u32,
) {
    for (name, generated, cob_id, pdo) in described(checker, case) {
        let mut rig = Rig::<S>::new();
        checker.require(prepare(&mut rig), || format!("{name}: the drive cannot be prepared"));
        let served = served(&mut rig, pdo.direction, cob_id, generated, sample);
        let bytes = pdo.mapping.iter().flat_map(|mapped| {
            let last = mapped.bits / 8 - 1;
            (0..=last).map(move |at| (mapped, at, last))
        });
        for (byte, (mapped, at, last)) in (0_usize..).zip(bytes) {
            let Some(row) = checker.row("pdo_layouts.csv", &format!("{name}:{}", byte + 1)) else { continue };
            let base = match pdo.cob_id {
                Some(Value::NodeIdPlus(base)) => format!("{base:X}"),
                _ => String::new(),
            };
            checker.cell(row, "cob_id_base", Against::Sheet, base);
            checker.cell(row, "cob_id_base", Against::Code, format!("{:X}", cob_id - u32::from(S::NODE.get())));
            checker.cell(row, "object", Against::Sheet, format!("{:04X}", mapped.index));
            let code = generated.iter().any(|other| other.address.index() == mapped.index && other.bits == mapped.bits);
            checker.that(row, "object", Against::Code, code, "not mapped");
            let significance = match at {
                0 => "LSB",
                at if at == last => "MSB",
                _ => "NSB",
            };
            checker.cell(row, "significance", Against::Sheet, significance);
            let agrees = served.get(byte).is_some_and(|(object, place)| *object == mapped.index && *place == at);
            checker.that(row, "significance", Against::Drive, agrees, format!("{:04X?}", served.get(byte)));
        }
    }
}

/// For each byte of a PDO of the drive: the object, and which byte of it.
fn served<S: Simulator>(
    rig: &mut Rig<S>,
    direction: Direction,
    cob_id: u32,
    objects: &[Mapped],
    sample: fn(u16) -> u32,
) -> Vec<(u16, u8)> {
    rig.nmt(0x01);
    let (id, part) = (cob_id as u16, |mapped: &Mapped| (mapped.address.index(), usize::from(mapped.bits / 8)));
    let data = if direction == Direction::Transmit {
        rig.requested(id, 200).pop().unwrap_or_default()
    } else {
        let sent: Vec<u8> = objects
            .iter()
            .map(part)
            .flat_map(|(index, size)| sample(index).to_le_bytes().into_iter().take(size))
            .collect();
        rig.send(id, &sent);
        rig.hear(0);
        sent
    };
    let mut rest = data.as_slice();
    let mut places = Vec::new();
    for (object, size) in objects.iter().map(part) {
        let raw = rig.read(object, 0).unwrap_or(0).to_le_bytes();
        let Some((part, behind)) = rest.split_at_checked(size) else { break };
        let same = raw.get(..size) == Some(part);
        places.extend((0_u8..).take(size).filter(|_| same).map(|at| (object, at)));
        rest = behind;
    }
    places
}
