//! Numbers in running text.

use lexican_eds::model::Direction::{self, Receive, Transmit};
use lexican_eds::model::Value;

use super::bits::example_word;
use super::rig::{LOAD, Rig, Siko, enabled_with, faulty, moving_to, running_at};
use crate::checker::{Against, Checker};
use crate::drive::Case;

use crate::kinds::pdo::name_of;
use crate::rig::{Simulator as _, once};
use crate::sheet::Sheet;
use crate::states::state_name;

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("facts.csv") {
        let Some((found, against)) = fact::<D>(&super::known::<D>(&row.key), case.sheet) else { continue };
        checker.key(row);
        checker.cell(row, "value", against, found);
    }
}

/// The value found for a fact, and where.
fn fact<D: Siko>(key: &str, sheet: &Sheet) -> Option<(String, Against)> {
    let by_sheet = by_sheet::<D>(key, sheet).map(|found| (found, Against::Sheet));
    let by_drive = || once::<D, _>(key, || by_drive::<D>(key)).map(|found| (found, Against::Drive));
    by_sheet.or_else(by_drive)
}

fn by_sheet<D: Siko>(key: &str, sheet: &Sheet) -> Option<String> {
    let device = &sheet.device;
    let base = |index, sub| match device.entry(index, sub)?.default {
        Some(Value::NodeIdPlus(base)) => Some(base),
        _ => None,
    };
    let number = |index, sub| device.entry(index, sub)?.default.as_ref()?.as_integer();
    let pdo = |base: i64| Some(name_of(device.pdos.iter().find(|pdo| pdo.cob_id == Some(Value::NodeIdPlus(base)))?));
    let mapping = |direction: Direction| {
        let pdo = device.pdos.iter().find(|pdo| pdo.direction == direction && pdo.number == 1)?;
        Some(device.object(pdo.mapping.first()?.index)?.name.to_ascii_lowercase().replace("word", " word"))
    };
    let count = |direction: Direction| {
        let mapped = device.pdos.iter().filter(|pdo| pdo.direction == direction && !pdo.mapping.is_empty());
        mapped.count().to_string()
    };
    let found = match key {
        "1:firmware at least" => {
            let rest = device.file.description.as_deref()?.split_once("firmware ")?.1;
            rest.split_once(" or higher")?.0.to_owned()
        }
        "2.3:torque deactivation off at" => device.entry(0x2421, 0)?.high.as_ref()?.as_integer()?.to_string(),
        "5.2:faults kept" => device.object(0x1003)?.entries.last()?.sub.to_string(),
        "6:parameters not stored" => {
            let unstored = D::MODEL.parameters.iter().filter(|parameter| {
                let entry = device.entry(parameter.address.index(), parameter.address.sub());
                entry.is_some_and(|entry| !entry.persistent)
            });
            let mut numbers: Vec<_> = unstored.map(|parameter| parameter.number.to_string()).collect();
            numbers.dedup();
            numbers.join(", ")
        }
        "7.2.4:transmit PDOs" => count(Transmit),
        "7.2.4:receive PDOs" => count(Receive),
        "7.2.5.1:TPDO1 carries" | "7.2.6.1:TPDO1 carries" => mapping(Transmit)?,
        "7.2.5.1:RPDO1 carries" | "7.2.6.1:RPDO1 carries" => mapping(Receive)?,
        "7.2.6.2:400h belongs to" => pdo(0x400)?,
        "7.2.6.3:500h belongs to" => pdo(0x500)?,
        "7.2.7:SDO to the drive" => format!("{:X}", base(0x1200, 1)?),
        "7.2.7:SDO from the drive" => format!("{:X}", base(0x1200, 2)?),
        "7.2.9:emergency identifier plus node-ID" => base(0x1014, 0)?.to_string(),
        "7.11:data sheet" => device.file.name.clone()?,
        "7.10:factory node-ID" => number(0x2101, 0)?.to_string(),
        "7.12.2:device profile" => number(0x1000, 0)?.to_string(),
        "7.12.2:load to sub-indices" => {
            let subs = device.object(0x1011)?.entries.iter().filter(|entry| entry.access.writable() && entry.sub < 4);
            let subs: Vec<_> = subs.map(|entry| entry.sub).collect();
            format!("{}..{}", subs.first()?, subs.last()?)
        }
        "7.12.2:vendor" => format!("{:X}", number(0x1018, 1)?),
        _ => return None,
    };
    Some(found)
}

fn by_drive<D: Siko>(key: &str) -> Option<String> {
    let mut rig = Rig::<D>::as_delivered();
    let boot_up = rig.hear(0).first().copied();
    D::prepare(&mut rig);
    let found = match key {
        "2.1:example word" => format!("{:X}", example_word::<D>()),
        "7.10:factory bit rate" => {
            let name = D::bit_rate(u8::try_from(rig.read(0x2100, 0).ok()?).ok()?)?;
            name.split(' ').nth(1)?.to_owned()
        }
        "2.1:standstill below" => standstill::<D>()?.to_string(),
        "2.1:overcurrent becomes a fault after" => overcurrent::<D>()?.to_string(),
        "3:calibration by" => if calibrates(&mut rig, 0x1011, 4, LOAD) { "1011:04" } else { "" }.into(),
        "6:acceleration at 100 %" => {
            let mut rig = enabled_with::<D>(&[(0x2410, 4, 100, 1), (0x2410, 5, 200, 1)]);
            rig.travel(100_000);
            // Of revolutions per minute, a quarter of a second makes so many in a second.
            (rig.velocities(&[250]).first()? / 15).to_string()
        }
        "6:calibration by" => if calibrates(&mut rig, 0x607C, 0, 500) { "607C" } else { "" }.into(),
        "2.2.1.1:loop beyond by" => {
            let mut rig = enabled_with::<D>(&[(0x2413, 0, 1, 1)]);
            rig.travel(-1000);
            (-1000 - rig.way(20_000).into_iter().min()?).to_string()
        }
        "4:gear ratio 5:1" => ratio::<D>(5, 1),
        "4:gear ratio 3.78:1" => ratio::<D>(378, 100),
        "6:increments per revolution" => per_revolution(&mut rig, 0).to_string(),
        "6:spindle pitch of 2 mm" => per_revolution(&mut rig, 200).to_string(),
        "7.2.2.2:INITIALISATION by" => {
            let resets = ["81", "82"].into_iter().filter(|code| {
                let mut rig = Rig::<D>::operational();
                rig.nmt(u8::from_str_radix(code, 16).unwrap_or(0));
                rig.hear_from(0x705, 0) == [[0]]
            });
            resets.collect::<Vec<_>>().join(", ")
        }
        "7.2.2.2:boot-up identifier plus node-ID" => (boot_up?.id().raw() - 5).to_string(),
        "7.2.2.2:boot-up data" => boot_up?.data().first()?.to_string(),
        "7.2.2.4:entering OPERATIONAL sends TPDOs of type" => sent_at_start::<D>(),
        "7.2.2.3:FAULT becomes" => fault_becomes::<D>(0x80),
        "7.2.2.5:FAULT becomes" => fault_becomes::<D>(0x02),
        "7.2.9:emergency length" => {
            rig.world(|inputs| inputs.sensor_fails = true);
            rig.hear_from(0x085, 0).first()?.len().to_string()
        }
        "7.2.10:heartbeat identifier plus node-ID" => {
            rig.write(0x1017, 0, 100, 2).ok()?;
            (rig.hear(100).first()?.id().raw() - 5).to_string()
        }
        "7.2.11:node guarding identifier plus node-ID" => {
            rig.request(0x705);
            (rig.hear(0).first()?.id().raw() - 5).to_string()
        }
        "7.2.11:first toggle bit" => (rig.requested(0x705, 0).first()?.first()? >> 7).to_string(),
        "7.2.11:expired life time leads to" => expired::<D>(),
        "7.12.2:inhibit time only with" => inhibited::<D>().join(", "),
        _ => return None,
    };
    Some(found)
}

/// The lowest integer velocity at which the drive reports that it moves.
fn standstill<D: Siko>() -> Option<i32> {
    (1..5).find(|velocity| running_at::<D>(*velocity, 5000).system() >> 4 & 1 == 1)
}

fn overcurrent<D: Siko>() -> Option<u64> {
    let mut rig = moving_to::<D>(900_000, 1000);
    rig.world(|inputs| inputs.load_ma = 2500);
    (1..12).find(|_| {
        rig.hear(1000);
        rig.is_fault()
    })
}

fn calibrates<D: Siko>(rig: &mut Rig<D>, index: u16, sub: u8, value: i64) -> bool {
    rig.set(&[(0x607C, 0, 500, 4), (index, sub, value, 4)]) && rig.read(0x6064, 0) == Ok(500)
}

/// The ratio if the shaft turns by it; else the position of the shaft after a travel of 1600.
fn ratio<D: Siko>(numerator: i64, denominator: i64) -> String {
    let mut rig = Rig::<D>::new();
    let set = rig.set(&[(0x6091, 1, numerator, 2), (0x6091, 2, denominator, 2)]);
    rig.nmt(0x01);
    rig.enable();
    rig.travel(1600);
    rig.hear(60_000);
    let shaft = rig.shaft();
    let expected = 1600.0 * numerator as f64 / denominator as f64;
    if set && (shaft - expected).abs() < 1.0 { format!("{numerator}/{denominator}") } else { format!("{shaft}") }
}

/// The change of the position by one revolution of the shaft.
fn per_revolution<D: Siko>(rig: &mut Rig<D>, spindle_pitch: i64) -> i32 {
    let set = rig.write(0x2412, 0, spindle_pitch, 2);
    rig.nmt(0x01);
    rig.enable();
    rig.travel(5000);
    rig.hear(100_000);
    let (position, shaft) = (rig.position(), rig.shaft());
    // 1600 steps are one revolution of the model's shaft.
    let revolutions = shaft / 1600.0;
    if set.is_ok() { (f64::from(position) / revolutions).round() as i32 } else { 0 }
}

fn sent_at_start<D: Siko>() -> String {
    let types = [0, 1, 253, 254, 255].into_iter().filter(|code| {
        let mut rig = Rig::<D>::new();
        let set = rig.write(0x1800, 2, *code, 1);
        rig.nmt(0x01);
        set.is_ok() && !rig.hear_from(0x185, 0).is_empty()
    });
    types.map(|code: i64| code.to_string()).collect::<Vec<_>>().join(", ")
}

/// The state of a drive in FAULT after an NMT command.
fn fault_becomes<D: Siko>(command: u8) -> String {
    let mut rig = faulty::<D>();
    rig.nmt(command);
    rig.hear(0);
    state_name(rig.state()).to_ascii_uppercase()
}

fn expired<D: Siko>() -> String {
    let mut rig = Rig::<D>::new();
    let set = rig.set(&[(0x100C, 0, 100, 2), (0x100D, 0, 3, 1)]);
    rig.nmt(0x01);
    rig.enable();
    rig.request(0x705);
    rig.hear(1000);
    let name = state_name(rig.state()).to_ascii_uppercase();
    if set { name } else { String::new() }
}

/// The transmission types for which the inhibit time separates two changes in a row.
fn inhibited<D: Siko>() -> Vec<String> {
    let kept = |code: &i64, inhibit: i64| {
        let mut rig = Rig::<D>::new();
        let set = rig.set(&[(0x1800, 2, *code, 1), (0x1800, 5, 100, 2), (0x1800, 3, inhibit, 2)]);
        rig.nmt(0x01);
        rig.hear(450);
        for word in [0x06, 0x07] {
            rig.send(0x205, &[word, 0x01]);
        }
        if set { rig.hear_from(0x185, 1000).len() } else { 0 }
    };
    // 300 ms: longer than the event timer.
    let types = [254_i64, 255].into_iter().filter(|code| kept(code, 3000) < kept(code, 0));
    types.map(|code| code.to_string()).collect()
}
