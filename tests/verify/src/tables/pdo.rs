//! PDOs: layouts (figures 17 to 22), mappings, transmission types, and the identifiers of table 27.

use std::collections::BTreeMap;

use lexican_eds::model::{Direction, Pdo, Value};
use lexican_runtime::object::Mapped;
use siko_ag03_1::od;

use super::sheet::Sheet;
use crate::bench::{Bench, Memory, NODE, once};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};
use crate::notation::{hex, yes};

/// The PDOs that map something: their names, and what the generated structs say.
type Described = (&'static str, &'static [Mapped], u32);

fn described() -> [Described; 6] {
    [
        ("TPDO1", od::Tpdo1::MAPPING, od::Tpdo1::cob_id(NODE).raw()),
        ("TPDO3", od::Tpdo3::MAPPING, od::Tpdo3::cob_id(NODE).raw()),
        ("TPDO4", od::Tpdo4::MAPPING, od::Tpdo4::cob_id(NODE).raw()),
        ("RPDO1", od::Rpdo1::MAPPING, od::Rpdo1::cob_id(NODE).raw()),
        ("RPDO3", od::Rpdo3::MAPPING, od::Rpdo3::cob_id(NODE).raw()),
        ("RPDO4", od::Rpdo4::MAPPING, od::Rpdo4::cob_id(NODE).raw()),
    ]
}

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    for described in described() {
        let (name, ..) = described;
        let pdo = sheet.device.pdos.iter().find(|pdo| name_of(pdo) == name);
        let Some(pdo) = pdo else {
            checker.finding(format!("{name}: the data sheet maps nothing"));
            continue;
        };
        mappings(checker, sheet, pdo, described);
        layout(checker, pdo, described);
    }
    identifiers(checker, manual, sheet);
    for row in manual.rows("transmission_types.csv") {
        transmission_type(checker, sheet, row);
    }
}

fn name_of(pdo: &Pdo) -> String {
    let side = if pdo.direction == Direction::Receive { "R" } else { "T" };
    format!("{side}PDO{}", pdo.number)
}

fn mapping_index(pdo: &Pdo) -> u16 {
    let base = if pdo.direction == Direction::Receive { 0x1600 } else { 0x1A00 };
    base + pdo.number - 1
}

fn mappings(checker: &mut Checker<'_>, sheet: &Sheet, pdo: &Pdo, (name, generated, _): Described) {
    let mut bench = Bench::new();
    let index = mapping_index(pdo);
    let mut bit = 0;
    for (position, mapped) in (1_u8..).zip(&pdo.mapping) {
        let (first, last) = (bit / 8, (bit + u32::from(mapped.bits)) / 8 - 1);
        bit += u32::from(mapped.bits);
        let Some(row) = checker.row("pdo_mappings.csv", &format!("{index:04X}:{position}")) else { continue };
        checker.cell(row, "chapter", Against::Manual, sheet.chapter(index));
        checker.cell(row, "pdo", Against::Sheet, name);
        checker.cell(row, "object", Against::Sheet, format!("{:04X}", mapped.index));
        checker.cell(row, "first_byte", Against::Sheet, first);
        checker.cell(row, "last_byte", Against::Sheet, last);
        checker.cell(row, "static", Against::Sheet, yes(!pdo.dynamic));
        let code = generated.get(usize::from(position) - 1).copied();
        let same = Some(Mapped::new(mapped.index, mapped.sub, mapped.bits)) == code;
        checker.that(row, "object", Against::Code, same, format!("{code:?}"));
        let read = bench.read(index, position);
        let agrees = code.is_some_and(|code| read == Ok(code.to_parameter()));
        checker.that(row, "object", Against::Drive, agrees, format!("{read:08X?}"));
        let fixed = bench.write(index, position, 0, 4) == Err(0x0601_0002);
        checker.cell(row, "static", Against::Drive, yes(fixed));
    }
}

fn layout(checker: &mut Checker<'_>, pdo: &Pdo, (name, generated, cob_id): Described) {
    let bytes = pdo.mapping.iter().flat_map(|mapped| {
        let last = mapped.bits / 8 - 1;
        (0..=last).map(move |at| (mapped, at, last))
    });
    let served = served(name);
    for (byte, (mapped, at, last)) in (0_usize..).zip(bytes) {
        let Some(row) = checker.row("pdo_layouts.csv", &format!("{name}:{}", byte + 1)) else { continue };
        let base = match pdo.cob_id {
            Some(Value::NodeIdPlus(base)) => format!("{base:X}"),
            _ => String::new(),
        };
        checker.cell(row, "cob_id_base", Against::Sheet, base);
        checker.cell(row, "cob_id_base", Against::Code, format!("{:X}", cob_id - u32::from(NODE.get())));
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

/// What the bytes of a PDO of the drive are: object, and which byte of it.
fn served(name: &str) -> Vec<(u16, u8)> {
    let mut bench = Bench::new();
    // Values whose bytes differ: a position, and a word that commands nothing.
    let mut sent = vec![0x00, 0x05];
    let (id, objects): (u16, &[u16]) = match name {
        "TPDO1" => (0x185, &[0x6041]),
        "TPDO3" => (0x385, &[0x6041, 0x6064]),
        "TPDO4" => (0x485, &[0x6041, 0x606C]),
        "RPDO1" => (0x205, &[0x6040]),
        "RPDO3" => (0x405, &[0x6040, 0x607A]),
        _ => (0x505, &[0x6040, 0x60FF]),
    };
    if objects.contains(&0x60FF) {
        sent.extend([0x64, 0, 0, 0]);
    } else if objects.len() == 2 {
        sent.extend([0x44, 0x33, 0x22, 0x00]);
    }
    let calibrated = bench.write(0x607C, 0, 0x0A_BCDE, 4);
    bench.nmt(0x01);
    let data = if name.starts_with('T') {
        bench.request(id);
        bench.hear_from(id, 200).pop().unwrap_or_default()
    } else {
        bench.send(id, &sent);
        bench.hear(0);
        sent
    };
    let mut rest = data.as_slice();
    let mut places = Vec::new();
    for object in objects {
        let size = if rest.len() == data.len() { 2 } else { 4 };
        let raw = bench.read(*object, 0).unwrap_or(0).to_le_bytes();
        let Some((part, behind)) = rest.split_at_checked(size).filter(|_| calibrated.is_ok()) else { break };
        let same = raw.get(..size) == Some(part);
        places.extend((0_u8..).take(size).filter(|_| same).map(|at| (*object, at)));
        rest = behind;
    }
    places
}

fn identifiers(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    let pdo = |name: &str| sheet.device.pdos.iter().find(|pdo| name_of(pdo) == name)?.cob_id.clone();
    let entry = |index, sub| sheet.device.entry(index, sub)?.default.clone();
    for row in manual.rows("identifiers.csv") {
        let base = hex(row.get("hex"));
        let decimal = base.map_or(String::new(), |base| base.to_string());
        checker.cell(row, "decimal", Against::Manual, decimal);
        let name = row.get("name");
        let default = match name {
            "NMT" => Some(Value::Integer(0)),
            "SYNC" => entry(0x1005, 0),
            "EMCY" => entry(0x1014, 0),
            "SDO tx" => entry(0x1200, 2),
            "SDO rx" => entry(0x1200, 1),
            "Heartbeat" | "Node guard" => Some(Value::NodeIdPlus(0x700)),
            pdo_name => pdo(pdo_name),
        };
        let (found, plus) = match default {
            Some(Value::Integer(id)) => (format!("{id:X}"), "no"),
            Some(Value::NodeIdPlus(base)) => (format!("{base:X}"), "yes"),
            _ => continue,
        };
        checker.key(row);
        let heard = used(name, base.unwrap_or(0) as u16);
        checker.that(row, "hex", Against::Drive, heard, "the drive does not use it");
        if !matches!(name, "NMT" | "Heartbeat" | "Node guard") {
            checker.cell(row, "hex", Against::Sheet, found);
        }
        checker.cell(row, "plus_node_id", Against::Sheet, plus);
    }
}

/// Whether the drive, as node 5, uses the identifier for what the name says.
fn used(name: &str, base: u16) -> bool {
    let own = base + u16::from(NODE.get());
    let mut bench = Bench::new();
    let boot_up = bench.hear_from(own, 0);
    match name {
        "NMT" => {
            bench.send(base, &[0x02, 5]);
            bench.hear(0);
            bench.see(|drive, _| drive.nmt_state().code()) == 4
        }
        "SYNC" => {
            let set = bench.write(0x1800, 2, 1, 1).is_ok();
            bench.nmt(0x01);
            bench.send(base, &[]);
            set && !bench.hear_from(0x185, 0).is_empty()
        }
        "EMCY" => {
            bench.world(|inputs| inputs.internal_error = true);
            !bench.hear_from(own, 0).is_empty()
        }
        "Heartbeat" => boot_up == [[0]],
        "Node guard" => {
            bench.request(own);
            bench.hear_from(own, 0) == [[0x7F]]
        }
        "SDO rx" | "SDO tx" => {
            let request = if name == "SDO rx" { own } else { 0x605 };
            bench.send(request, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
            !bench.hear_from(if name == "SDO tx" { own } else { 0x585 }, 0).is_empty()
        }
        name if name.starts_with('T') => {
            bench.nmt(0x01);
            bench.request(own);
            !bench.hear_from(own, 200).is_empty()
        }
        _ => {
            bench.nmt(0x01);
            let data = [0x06, 0x01, 0, 0, 0, 0];
            bench.send(own, if name == "RPDO1" { &data[..2] } else { &data });
            bench.hear(0);
            bench.status() & 0x6F == 0x21
        }
    }
}

/// One line of a transmission type: both ends of its range, on each PDO that it is about.
fn transmission_type(checker: &mut Checker<'_>, sheet: &Sheet, row: &Row) {
    let Some((from, to)) = row.number::<u8>("from").zip(row.number::<u8>("to")) else { return };
    let indices: &[u16] = match row.get("index") {
        "14xx" => &[0x1400, 0x1402, 0x1403],
        "18xx" => &[0x1800, 0x1802, 0x1803],
        one => match hex(one) {
            Some(0x1400) => &[0x1400],
            Some(0x1402) => &[0x1402],
            Some(0x1403) => &[0x1403],
            Some(0x1800) => &[0x1800],
            Some(0x1802) => &[0x1802],
            Some(0x1803) => &[0x1803],
            _ => return,
        },
    };
    let receives = indices.iter().all(|index| *index < 0x1800);
    let chapter = match row.get("index") {
        "14xx" => "7.2.6.4".into(),
        "18xx" => "7.2.5.4".into(),
        _ => sheet.chapter(indices.first().copied().unwrap_or(0)),
    };
    checker.cell(row, "chapter", Against::Manual, chapter);
    // Between its neighbours: a range ends where the next begins.
    let ranges = match row.get("index") {
        "14xx" => &[(0, 240), (254, 255)],
        _ => RANGES,
    };
    let known = ranges.contains(&(from, to));
    checker.that(row, "to", Against::Manual, known, "no range of CiA 301, table 71");
    let code = lexican_runtime::wire::pdo::TransmissionType::from_code(from);
    let kind = row.get("kind");
    let synchronous = code.is_synchronous() == kind.starts_with("synchronous") || kind == "reserved";
    checker.that(row, "kind", Against::Code, synchronous, format!("{code:?}"));
    let found: Vec<&str> = indices.iter().flat_map(|index| [from, to].map(|code| behaviour(*index, code))).collect();
    let same = |behaviours: &[&str]| found.iter().all(|found| behaviours.contains(found));
    let agrees = match row.get("meaning") {
        "processed after a SYNC" => same(&["after SYNC"]),
        "as 0" => receives && from == 1 && same(&["after SYNC"]),
        "processed at once" => same(&["at once"]),
        "as 255" => receives && from == 254 && same(&["at once"]),
        "" => same(&["refused"]),
        "sent after each SYNC" => from == 0 && same(&["SYNC"]),
        "sent after that many SYNCs" => from == 1 && same(&["SYNC", "240 SYNCs"]),
        "sent on RTR; COB-ID bit 30 must be 0" | "sent on RTR" => same(&["RTR"]),
        "sent on every change and by event timer" => same(&["change and timer"]),
        "sent by event timer" | "sent by event timer in ms" => same(&["timer"]),
        _ => false,
    };
    checker.that(row, "meaning", Against::Drive, agrees, found.join(", "));
    let kinds: &[&str] = match (receives, row.get("index").ends_with("xx"), from) {
        (_, _, 241..=252) | (true, _, 253) => &["reserved"],
        (true, _, 0..=240) | (false, true, 0..=240) => &["synchronous"],
        (true, ..) => &["asynchronous"],
        (false, _, 0) => &["synchronous acyclic"],
        (false, _, 1..=240) => &["synchronous cyclic"],
        (false, true, 253) => &["asynchronous"],
        (false, _, 253) => &["asynchronous on request"],
        (false, true, 254) => &["event-triggered"],
        (false, true, _) => &["time-triggered"],
        (false, _, 254) => &["asynchronous event-triggered"],
        (false, ..) => &["asynchronous time-triggered"],
    };
    checker.that(row, "kind", Against::Drive, kinds.contains(&kind), kinds.join(" or "));
    checker.key(row);
}

const RANGES: &[(u8, u8)] = &[(0, 0), (1, 240), (241, 251), (252, 252), (253, 253), (254, 254), (255, 255)];

/// What the drive does with a PDO of this transmission type.
fn behaviour(index: u16, code: u8) -> &'static str {
    static MEMORY: Memory<(u16, u8), &str> = Memory::new(BTreeMap::new());
    once(&MEMORY, (index, code), || if index < 0x1800 { received(index, code) } else { sent(index, code) })
}

fn received(index: u16, code: u8) -> &'static str {
    let mut bench = Bench::new();
    if bench.write(index, 2, code.into(), 1).is_err() {
        return "refused";
    }
    bench.nmt(0x01);
    let id = [0x205, 0x305, 0x405, 0x505].get(usize::from(index & 3)).copied().unwrap_or(0);
    let data = [0x06, 0x01, 0, 0, 0, 0];
    bench.send(id, if index == 0x1400 { &data[..2] } else { &data });
    bench.hear(10);
    let state = |bench: &Bench| bench.status() & 0x6F == 0x21;
    if state(&bench) {
        return "at once";
    }
    bench.send(0x080, &[]);
    bench.hear(0);
    if state(&bench) { "after SYNC" } else { "never" }
}

fn sent(index: u16, code: u8) -> &'static str {
    let id = [0x185, 0x285, 0x385, 0x485].get(usize::from(index & 3)).copied().unwrap_or(0);
    let mut bench = Bench::new();
    if bench.write(index, 2, code.into(), 1).is_err() {
        return "refused";
    }
    let timer = bench.write(index, 5, 100, 2);
    let inhibit = bench.write(index, 3, 0, 2);
    bench.nmt(0x01);
    bench.hear_from(id, 10);
    bench.send(0x205, &[0x06, 0x01]);
    let by_change = bench.hear_from(id, 20).len();
    let by_timer = bench.hear_from(id, 1000).len();
    bench.request(id);
    let by_request = bench.hear_from(id, 0).len();
    let mut syncs = 0;
    for number in 1..=240 {
        bench.send(0x080, &[]);
        if !bench.hear_from(id, 0).is_empty() {
            syncs = number;
            break;
        }
    }
    match (by_change, by_timer, by_request, syncs) {
        _ if timer.is_err() || inhibit.is_err() => "refused",
        (0, 0, _, 1) => "SYNC",
        (0, 0, _, 240) => "240 SYNCs",
        (0, 0, 1, 0) => "RTR",
        (1.., 9..=11, ..) => "change and timer",
        (0, 9..=11, ..) => "timer",
        _ => "otherwise",
    }
}
