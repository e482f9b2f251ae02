//! The homing methods of CiA 402.

use lexican_eds::model::Named;

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;
use crate::notation::{number, range};
use crate::rig::{Simulator, once};

/// The methods that CiA 402 describes.
const DEFINED: [std::ops::RangeInclusive<i128>; 3] = [1..=14, 17..=30, 33..=35];

/// Compares `homing_methods.csv`: all numbers of 6098h, in ranges or one by one. The names of the enumeration
/// `HomingMethod` begin with the switch; its descriptions begin with the direction in which positions count, and end
/// with the drive's own parameters. `attains` says whether the drive homes by a method.
pub(crate) fn check<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>, attains: fn(i8) -> bool) {
    let methods = case.sheet.device.enumerations.get("HomingMethod").map_or(&[][..], |methods| &methods.values);
    let mut next = -128;
    for row in case.manual.rows("homing_methods.csv") {
        let printed = row.get("method");
        let Some((low, high)) = range(printed).or_else(|| number(printed).map(|method| (method, method))) else {
            continue;
        };
        checker.key(row);
        checker.that(row, "method", Against::Manual, low == next && high >= low, format!("{next} is the next one"));
        next = high + 1;
        let of_row: Vec<_> = methods.iter().filter(|named| (low..=high).contains(&named.value)).collect();
        let defined = DEFINED.iter().any(|defined| defined.contains(&low) && defined.contains(&high));
        let supported = match of_row.as_slice() {
            [_] if low == high => "yes",
            [] if defined => "not supported",
            [] if DEFINED.iter().all(|defined| !defined.contains(&low) && !defined.contains(&high)) => "reserved",
            _ => "",
        };
        checker.cell(row, "supported", Against::Sheet, supported);
        for method in [low, high].into_iter().filter_map(|method| i8::try_from(method).ok()) {
            let found = once::<S, _>(method, || attains(method));
            let agrees = found == (row.get("supported") == "yes");
            checker.that(row, "supported", Against::Drive, agrees, if found { "it homes" } else { "it does not home" });
        }
        named(checker, row, of_row.first().copied());
    }
    checker.require(next == 128, || format!("homing_methods.csv: ends before {next}"));
}

/// Compares the name of a method that the drive has. Other methods have none.
fn named(checker: &mut Checker<'_>, row: &Row, named: Option<&Named<i128>>) {
    let name = named.map_or("", |named| &named.name);
    let description = named.and_then(|named| named.description.as_deref()).unwrap_or_default();
    let switch = row.get("switch").replace("a single", "one");
    let same_switch = match name.strip_prefix(&switch) {
        Some(rest) => ["", " with zeroing"].iter().any(|with| {
            let direction = rest.strip_prefix(with);
            direction.is_some_and(|direction| ["", " positive", " negative"].contains(&direction))
        }),
        None => false,
    };
    checker.that(row, "switch", Against::Sheet, same_switch, name);
    let zeroing = match name {
        _ if name.contains("with zeroing") => "with",
        _ if name.contains("switch") => "without",
        _ => "",
    };
    checker.cell(row, "zeroing", Against::Sheet, zeroing);
    let direction = description.split_once(" count direction").map_or("", |(direction, _)| direction);
    checker.cell(row, "count_direction", Against::Sheet, direction.to_lowercase());
    for (column, word) in [("home_mode", "HOME.MODE "), ("home_dir", "HOME.DIR ")] {
        let value = description.split_once(word).map_or("", |(_, rest)| rest);
        let value = value.split(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
        checker.cell(row, column, Against::Sheet, value);
    }
}
