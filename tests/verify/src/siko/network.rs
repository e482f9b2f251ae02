//! The network of a SIKO drive: keys and LEDs by NMT state, refusals, SDO examples, switches.

use siko::sim::inputs::Key;
use siko::sim::{DipSwitches, Setup, Termination};

use super::leds::shown;
use super::rig::{NODE, Rig, Siko};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::frames;
use crate::manual::Row;
use crate::notation::{bytes, yes};
use crate::sheet::Sheet;

/// Whether a command does the same as power-on: values that the EEPROM does not keep are as they were at first.
pub(crate) fn starts_cold<D: Siko>(command: u8) -> bool {
    let mut rig = Rig::<D>::new();
    let set = rig.set(&[(0x1017, 0, 5000, 2), (0x2410, 4, 51, 1)]);
    rig.nmt(command);
    rig.hear(0);
    set && (rig.read(0x1017, 0), rig.read(0x2410, 4)) == (Ok(0), Ok(51))
}

/// Compares the columns about LED, keys, state machine and motor in an NMT state.
pub(crate) fn in_nmt_state<D: Siko>(checker: &mut Checker<'_>, row: &Row, mut rig: Rig<D>) {
    use Against::Drive as D;
    // In OPERATIONAL, the NMT state affects neither: the drive stays as it is commanded.
    let [before, after] = [rig.status(), {
        rig.controls(&[0x0106]);
        rig.status()
    }];
    let (machine, motor) = if before == after {
        (
            if rig.is_disabled() { "SWITCH ON DISABLED" } else { "" },
            if rig.is_released() { "released" } else { "in control" },
        )
    } else {
        ("", "")
    };
    checker.cell(row, "state_machine", D, machine);
    checker.cell(row, "motor", D, motor);
    if row.has("bus_led") {
        checker.cell(row, "bus_led", D, shown(&mut rig, |lights| lights.bus));
    }
    if row.has("keys") {
        rig.world(|inputs| inputs.key = Some(Key::Clockwise));
        rig.hear(500);
        checker.cell(row, "keys", D, yes(rig.position() != 0));
    }
}

/// The code with which the drive refuses what `meaning` describes.
pub(crate) fn refused<D: Siko>(meaning: &str) -> Option<u32> {
    let mut rig = Rig::<D>::new();
    match meaning {
        "sub-index does not exist" => rig.read(0x2410, 0x07).err(),
        "write of a read-only object" => rig.write(0x1000, 0, 0, 4).err(),
        "read of a write-only object" => rig.read(0x1011, 1).err(),
        "value range exceeded" => rig.write(0x2410, 4, 101, 1).err(),
        "maximum less than minimum" => {
            let both = [rig.write(0x607D, 2, -1_000_001, 4), rig.write(0x607D, 1, 1_000_001, 4)];
            both[0].err().filter(|_| both[0] == both[1])
        }
        "object does not exist" => rig.read(0x2411, 0).err(),
        "unsupported access" => rig.write_exactly(0x2410, 4, 50, if D::MODEL.writes_four_bytes { 1 } else { 4 }).err(),
        "not possible in the present device state" => rig.write(0x6040, 0, 6, 2).err(),
        _ => None,
    }
}

/// Compares `sdo_examples.csv`, which reads a calibration value of 2500 and writes a limit.
pub(crate) fn sdo_examples<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let rows = case.manual.rows("sdo_examples.csv");
    let mut rig = Rig::<D>::new();
    checker.require(rig.set(&[(0x607C, 0, 2500, 4)]), || "607C:00 cannot be written".into());
    frames::exchange(checker, rows, &mut rig);
    let read: Vec<_> = [(0x607C, 0), (0x607D, 2)].map(|(index, sub)| rig.read(index, sub).unwrap_or(0)).into();
    for (row, at) in rows.iter().zip(1..) {
        checker.cell(row, "row", Against::Manual, at);
        let data = bytes(row.get("data")).unwrap_or_default();
        checker.cell(row, "meaning", Against::Sheet, meaning(case.sheet, &data));
        let value = data.get(4..8).and_then(|value| value.try_into().ok()).map_or(0, u32::from_le_bytes);
        let agrees =
            value == 0 && row.get("value").is_empty() || row.number("value") == Some(value) && read.contains(&value);
        checker.that(row, "value", Against::Drive, agrees, format!("{value}, and the drive has {read:?}"));
    }
}

/// The meaning of an SDO in the examples, by the name of its object.
fn meaning(sheet: &Sheet, data: &[u8]) -> String {
    let &[command, low, high, sub, ..] = data else { return String::new() };
    let object = sheet.device.object(u16::from_le_bytes([low, high]));
    let named = object.map_or("", |object| match object.entries.iter().find(|entry| entry.sub == sub) {
        Some(entry) if object.kind.has_subs() => entry.name.as_str(),
        _ => object.name.as_str(),
    });
    let name = named.to_ascii_lowercase();
    match command {
        0x23 => format!("write {name}"),
        0x40 => format!("read {name}"),
        0x42 => name,
        0x60 => "done".into(),
        _ => String::new(),
    }
}

/// Compares `node_address.csv`: switches 1 to 7.
pub(crate) fn node_address<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for (row, address) in case.manual.rows("node_address.csv").iter().zip([1, 1, 2, 3, 124, 125, 126, 127]) {
        let on = |bit: u16| match row.get(&format!("sw{}", bit + 1)) {
            "ON" => Some(1 << bit),
            "OFF" => Some(0),
            _ => None,
        };
        let Some(switches) = (0..7).map(on).sum::<Option<u16>>() else { continue };
        let switches = DipSwitches::new(switches);
        let node = switches.node();
        checker.key(row);
        let mut rig = Rig::<D>::set_up(Setup { switches, ..Setup::new(D::MODEL, NODE) });
        let boot_up = rig.hear_from(0x700 + u16::from(node.get()), 0) == [[0]];
        checker.cell(row, "address", Against::Drive, if boot_up { node.get() } else { 0 });
        checker.cell(row, "address", Against::Manual, address);
    }
}

/// Compares `bus_termination.csv`. The resistor is hardware, so the rows are compared with a table in the drive's
/// crate.
pub(crate) fn bus_termination(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("bus_termination.csv") {
        let switches = match row.key.as_str() {
            "OFF:OFF" => "00",
            "ON:ON" => "11",
            _ => continue,
        };
        checker.key(row);
        let found = format!("1010000 0 {switches}").parse::<DipSwitches>().map(DipSwitches::termination);
        let termination = match found {
            Ok(Termination::Deactivated) => "deactivated",
            Ok(Termination::Active) => "active",
            _ => "",
        };
        checker.cell(row, "termination", Against::Code, termination);
    }
    let half = |bits| DipSwitches::new(bits).termination() == Termination::Incomplete;
    checker.require(half(1 << 8) && half(1 << 9), || "bus_termination.csv: one switch alone terminates".into());
}

/// Prepares a drive for `pdo_layouts.csv`: sets a position whose bytes differ.
pub(crate) fn prepare_layouts<D: Siko>(rig: &mut Rig<D>) -> bool {
    rig.set(&[(0x607C, 0, 0x0A_BCDE, 4)])
}

/// Values whose bytes differ: a control word without a command, a position, a velocity.
pub(crate) fn sample(index: u16) -> u32 {
    match index {
        0x6040 => 0x0500,
        0x607A => 0x0022_3344,
        _ => 100,
    }
}
