//! Transmission types: what the drive does with a PDO of each type.

use lexican_runtime::wire::pdo::TransmissionType;

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;
use crate::notation::hex;
use crate::rig::{Rig, Simulator, once};

/// Compares `transmission_types.csv`. A row is about one object or, with an index such as `14xx`, about all of
/// `indices`.
pub(crate) fn check<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>, indices: &[u16]) {
    for row in case.manual.rows("transmission_types.csv") {
        let of = |index: &&u16| match row.get("index").strip_suffix("xx").and_then(hex) {
            Some(high) => u32::from(**index >> 8) == high,
            None => Some(u32::from(**index)) == hex(row.get("index")),
        };
        let indices: Vec<u16> = indices.iter().filter(of).copied().collect();
        if !indices.is_empty() {
            line::<S>(checker, row, &indices);
        }
    }
}

/// Compares one row: both ends of its range, on each PDO that it is about.
fn line<S: Simulator>(checker: &mut Checker<'_>, row: &Row, indices: &[u16]) {
    let Some((from, to)) = row.number::<u8>("from").zip(row.number::<u8>("to")) else { return };
    let receives = indices.iter().all(|index| *index < 0x1800);
    let ranges = match row.get("index") {
        "14xx" => &[(0, 240), (254, 255)],
        _ => RANGES,
    };
    // Between its neighbours: a range ends where the next begins.
    checker.that(row, "to", Against::Manual, ranges.contains(&(from, to)), "no range of CiA 301, table 71");
    let code = TransmissionType::from_code(from);
    let kind = row.get("kind");
    let synchronous = code.is_synchronous() == kind.starts_with("synchronous") || kind == "reserved";
    checker.that(row, "kind", Against::Code, synchronous, format!("{code:?}"));
    let behaviour = |index, code| {
        let ask = if index < 0x1800 { received::<S> } else { sent::<S> };
        once::<S, _>((index, code), || ask(index, code))
    };
    let found: Vec<&str> = indices.iter().flat_map(|index| [from, to].map(|code| behaviour(*index, code))).collect();
    let same = |behaviours: &[&str]| found.iter().all(|found| behaviours.contains(found));
    let agrees = match row.get("meaning") {
        "processed after a SYNC" => same(&["after SYNC"]),
        "as 0" => receives && from == 1 && same(&["after SYNC"]),
        "processed at once" => same(&["at once"]),
        "as 255" => from == 254 && same(if receives { &["at once"] } else { &["timer"] }),
        "" => same(&["refused"]),
        "sent after each SYNC" => from == 0 && same(&["SYNC"]),
        "sent after that many SYNCs" => from == 1 && same(&["SYNC", "240 SYNCs"]),
        "sent on RTR; COB-ID bit 30 must be 0" | "sent on RTR" => same(&["RTR"]),
        "sent on every change and by event timer" => same(&["change and timer"]),
        "sent on every change of the position" => indices == [0x1802] && same(&["change"]),
        "sent on every change of the velocity" => indices == [0x1803] && same(&["change"]),
        "sent on every change of position or velocity; TPDO3 and TPDO4 only" => {
            found == ["timer", "timer", "change", "change", "change", "change"]
        }
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
        (false, _, 254) if row.get("meaning") == "as 255" => &["asynchronous time-triggered"],
        (false, _, 254) => &["asynchronous event-triggered"],
        (false, ..) => &["asynchronous time-triggered"],
    };
    checker.that(row, "kind", Against::Drive, kinds.contains(&kind), kinds.join(" or "));
    checker.key(row);
}

const RANGES: &[(u8, u8)] = &[(0, 0), (1, 240), (241, 251), (252, 252), (253, 253), (254, 254), (255, 255)];

/// The default identifier of the PDO whose parameter has this index.
pub(crate) fn cob_id<S: Simulator>(index: u16) -> u16 {
    let first = if index < 0x1800 { 0x200 } else { 0x180 };
    Rig::<S>::own(first + 0x100 * (index & 3))
}

fn received<S: Simulator>(index: u16, code: u8) -> &'static str {
    let mut rig = Rig::<S>::new();
    if rig.write(index, 2, code.into(), 1).is_err() {
        return "refused";
    }
    rig.nmt(0x01);
    let data = [0x06, 0x01, 0, 0, 0, 0];
    rig.send(cob_id::<S>(index), if index == 0x1400 { &data[..2] } else { &data });
    rig.hear(10);
    let is_ready = |rig: &Rig<S>| rig.status() & 0x6F == 0x21;
    if is_ready(&rig) {
        return "at once";
    }
    rig.send(0x080, &[]);
    rig.hear(0);
    if is_ready(&rig) { "after SYNC" } else { "never" }
}

fn sent<S: Simulator>(index: u16, code: u8) -> &'static str {
    let id = cob_id::<S>(index);
    let mut rig = Rig::<S>::new();
    if rig.write(index, 2, code.into(), 1).is_err() || rig.write(index, 5, 100, 2).is_err() {
        return "refused";
    }
    // If there is no inhibit time, there is none to clear.
    let _ = rig.write(index, 3, 0, 2);
    rig.nmt(0x01);
    rig.hear_from(id, 10);
    rig.send(Rig::<S>::own(0x200), &[0x06, 0x01]);
    let by_change = rig.hear_from(id, 20).len();
    let by_timer = rig.hear_from(id, 1000).len();
    let by_request = rig.requested(id, 0).len();
    let syncs = (1..=240).find(|_| {
        rig.send(0x080, &[]);
        !rig.hear_from(id, 0).is_empty()
    });
    match (by_change, by_timer, by_request, syncs) {
        (0, 0, _, Some(1)) => "SYNC",
        (0, 0, _, Some(240)) => "240 SYNCs",
        (0, 0, 1, None) => "RTR",
        (1.., 9..=11, ..) => "change and timer",
        (1.., 0, _, None) => "change",
        (0, 9..=11, ..) => "timer",
        _ => "otherwise",
    }
}
