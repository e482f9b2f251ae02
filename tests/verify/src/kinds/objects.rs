//! The objects: every sub-index, against data sheet, code and drive. A column that a table lacks is not compared.

use lexican_eds::model::{AccessType, Direction, Entry, NmtState};
use lexican_runtime::Instant;
use lexican_runtime::object::Address;

use crate::bench::{Bench, Simulator, once};
use crate::checker::{Against, Answers, Checker};
use crate::code::{Handle, signed};
use crate::drive::Case;
use crate::manual::{Row, cells};
use crate::notation::{self, Default, hex, yes};
use crate::sheet::{Sheet, address};

/// Lowest and highest value.
pub(crate) type Range = (i128, i128);

/// What a drive adds to this comparison.
pub(crate) trait Objects: Simulator {
    /// The object that ranges depend on.
    const VARIANT: u16;

    /// The value of that object for what is printed before a range: `24:1` in `24:1 1..200`.
    fn variant(printed: &str) -> Option<i128>;
    /// A drive of each variant, with limits of others as wide as they can be.
    fn variants() -> Vec<(i128, Bench<Self>)>;
    /// What is read in place of a default.
    fn instead_of_default(_index: u16, default: i128) -> i128 {
        default
    }
    /// Whether it cannot be written in PRE-OPERATIONAL either.
    fn is_command(index: u16) -> bool;
    fn power_cycle(bench: &mut Bench<Self>);
    /// What the drive holds in an entry, which may be its own address: read beside the bus.
    fn kept(drive: &mut Self::Drive, now: Instant, index: u16, sub: u8) -> u32;
}

/// An entry, as data sheet or code describe it.
#[derive(Debug, PartialEq)]
pub(super) struct Described {
    access: &'static str,
    is_mappable: bool,
    data_type: String,
    pub(super) default: Option<i128>,
    pub(super) limits: Option<Range>,
    /// Ranges that hold when an object has a value.
    conditions: Vec<((u16, i128), Range)>,
    is_persistent: bool,
    writable_in: Option<Vec<NmtState>>,
}

impl Described {
    pub(super) fn written(sheet: &Sheet, entry: &Entry) -> Self {
        let conditions = entry.ranges.iter();
        Described {
            access: match entry.access {
                AccessType::Ro => "ro",
                AccessType::Wo => "wo",
                AccessType::Const => "const",
                _ => "rw",
            },
            is_mappable: entry.pdo_mapping,
            data_type: entry.data_type.name().into(),
            default: sheet.number(entry.default.as_ref()),
            limits: sheet.number(entry.low.as_ref()).zip(sheet.number(entry.high.as_ref())),
            conditions: conditions
                .map(|range| ((range.when.index, range.when.value), (range.low, range.high)))
                .collect(),
            is_persistent: entry.persistent,
            writable_in: entry.writable_in.clone(),
        }
    }

    pub(super) fn generated(sheet: &Sheet, handle: &Handle, address: Address) -> Self {
        let code = &sheet.code;
        let rule = code.writable_in.iter().find(|rule| rule.address == address);
        let states = rule.map(|rule| {
            let states = [(rule.pre_operational, NmtState::PreOperational), (rule.operational, NmtState::Operational)];
            states.into_iter().filter(|(allowed, _)| *allowed).map(|(_, state)| state).collect()
        });
        let conditions = code.ranges.iter().filter(|range| range.address == address).map(|range| {
            let [low, high] = [range.limit.low, range.limit.high].map(|raw| signed(raw, handle.data_type));
            ((range.when.address.index(), i128::from(range.when.raw)), (low, high))
        });
        Described {
            access: handle.access,
            is_mappable: handle.is_mappable,
            data_type: handle.data_type.to_string(),
            default: handle.default,
            limits: handle.limits,
            conditions: conditions.collect(),
            is_persistent: code.persistent.contains(&address),
            writable_in: states,
        }
    }
}

pub(crate) fn check<S: Objects>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for entry in case.sheet.device.entries() {
        let key = format!("{:04X}:{:02X}", entry.index, entry.sub);
        let Some(row) = checker.row("objects.csv", &key) else { continue };
        written::<S>(checker, case, row, entry);
        if let Some(handle) = case.sheet.handle(entry) {
            let mut described = Described::generated(case.sheet, handle, address(entry));
            // The length of an array is no handle of its own: it has neither default nor limits.
            if handle.path.ends_with(".len_object") {
                let sheet = Described::written(case.sheet, entry);
                (described.default, described.limits) = (sheet.default, sheet.limits);
            }
            compare::<S>(checker, row, Against::Code, &described);
        }
    }
    let (rows, code) = (case.manual.rows("objects.csv"), &case.sheet.code);
    let size = |index, sub| code.size(index, sub);
    once::<S, _>(cells(rows), || answers::<S>(rows, size, case)).give(checker, rows);
}

fn written<S: Objects>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, entry: &Entry) {
    compare::<S>(checker, row, Against::Sheet, &Described::written(case.sheet, entry));
    let mapped = |direction| {
        let pdos = case.sheet.device.pdos.iter().filter(move |pdo| pdo.direction == direction);
        pdos.flat_map(|pdo| &pdo.mapping).any(|mapped| (mapped.index, mapped.sub) == (entry.index, entry.sub))
    };
    let (received, transmitted) = (mapped(Direction::Receive), mapped(Direction::Transmit));
    let is_rww = entry.access == AccessType::Rww;
    checker.that(row, "access", Against::Sheet, is_rww == received, entry.access.name());
    checker.cell(row, "pdo_mapping", Against::Manual, yes(received || transmitted));
}

fn compare<S: Objects>(checker: &mut Checker<'_>, row: &Row, against: Against, described: &Described) {
    let access = match row.get("access") {
        "read-only" | "read" => "ro",
        "write-only" => "wo",
        "read-write" => "rw",
        other => other,
    };
    checker.that(row, "access", against, access == described.access, described.access);
    checker.cell(row, "pdo_mapping", against, yes(described.is_mappable));
    let same_type = row.get("data_type").eq_ignore_ascii_case(&described.data_type);
    checker.that(row, "data_type", against, same_type, &described.data_type);
    let default = match notation::default(row.get("default")) {
        Some(Default::None) => described.default.is_none(),
        Some(Default::Value(value)) => described.default == Some(value),
        Some(Default::NodeIdPlus(base)) => described.default == Some(base + i128::from(S::NODE.get())),
        None => false,
    };
    let found = described.default.map_or("no".into(), |found| found.to_string());
    checker.that(row, "default", against, default, found);
    if row.has("eeprom") {
        checker.cell(row, "eeprom", against, yes(described.is_persistent));
    }
    if row.has("restriction") {
        restriction(checker, row, against, described.writable_in.as_deref());
    }
    let Described { limits, conditions, .. } = described;
    let printed = row.get("range");
    let agrees = if printed.contains(';') {
        let ranges = by_variant::<S>(printed);
        let widest = ranges.iter().map(|(_, range)| *range);
        let widest = widest.reduce(|(low, high), (other, more)| (low.min(other), high.max(more)));
        *conditions == ranges.into_iter().map(|(value, range)| ((S::VARIANT, value), range)).collect::<Vec<_>>()
            && *limits == widest
    } else {
        // Limits that are those of the data type are no limits to the code.
        let whole = against == Against::Code && limits.is_none() && printed == "0..65535";
        let range = notation::range(printed);
        conditions.is_empty() && (printed.is_empty() || range.is_some()) && (*limits == range || whole)
    };
    checker.that(row, "range", against, agrees, format!("{limits:?} {conditions:?}"));
}

fn restriction(checker: &mut Checker<'_>, row: &Row, against: Against, states: Option<&[NmtState]>) {
    let found = states.map_or(String::new(), |states| {
        let names = states.iter().map(|state| match state {
            NmtState::PreOperational => " PRE-OPERATIONAL",
            NmtState::Operational => " OPERATIONAL",
        });
        format!("write{}", names.collect::<String>())
    });
    // A write is bound to a state when either column says so.
    let [first, second] = ["restriction", "notice"].map(|column| row.get(column));
    let first_agrees = first == found || first.is_empty() && second == found;
    checker.that(row, "restriction", against, first_agrees, &found);
    checker.that(row, "notice", against, second == found || second.is_empty(), &found);
}

/// `24:1 1..200; 48:1 1..100`: the value of the object that the range depends on, and the range.
pub(crate) fn by_variant<S: Objects>(text: &str) -> Vec<(i128, Range)> {
    let part = |part: &str| {
        let (variant, range) = part.split_once(' ')?;
        Some((S::variant(variant)?, notation::range(range)?))
    };
    text.split("; ").filter_map(part).collect()
}

/// A row with the address and size of its entry.
struct Asked<'r> {
    row: &'r Row,
    index: u16,
    sub: u8,
    size: u8,
}

impl Asked<'_> {
    fn is_writable(&self) -> bool {
        self.row.get("access") == "read-write"
    }

    fn read<S: Simulator>(&self, bench: &mut Bench<S>) -> Result<u32, u32> {
        bench.read(self.index, self.sub)
    }

    fn write<S: Simulator>(&self, bench: &mut Bench<S>, value: i64) -> Result<(), u32> {
        bench.write(self.index, self.sub, value, self.size)
    }
}

/// Index and sub-index of a row.
pub(crate) fn address_of(row: &Row) -> Option<(u16, u8)> {
    Some((u16::try_from(hex(row.get("index"))?).ok()?, u8::try_from(hex(row.get("subindex"))?).ok()?))
}

/// Asks the drive for every object: rights, default, range ends, states in which it can be written, EEPROM.
fn answers<S: Objects>(rows: &[Row], size: impl Fn(u16, u8) -> u8, case: &Case<'_>) -> Answers {
    let mut answers = Answers::default();
    let asked = |row| address_of(row).map(|(index, sub)| Asked { row, index, sub, size: size(index, sub) });
    let rows: Vec<Asked<'_>> = rows.iter().filter_map(asked).collect();
    let mut bench = Bench::<S>::new();
    for asked in &rows {
        let read = asked.read(&mut bench);
        let readable = read != Err(0x0601_0001);
        let denied = asked.write(&mut bench, i64::from(read.unwrap_or(0)));
        let writable = denied != Err(0x0601_0002);
        let expected = match asked.row.get("access") {
            "read-only" | "read" => readable && read.is_ok() && !writable,
            "write-only" => !readable && writable,
            "read-write" => readable && read.is_ok() && writable,
            _ => false,
        };
        answers.that(asked.row, "access", expected, format!("read {read:08X?}, write {denied:08X?}"));
        let other = if asked.size == 4 || S::WRITES_FOUR_BYTES { 2 } else { 4 };
        let exact = bench.write_exactly(asked.index, asked.sub, 0, other);
        let refused = !writable || exact == Err(0x0601_0000);
        answers.that(asked.row, "data_type", refused, format!("a value of another size: {exact:08X?}"));
    }
    defaults::<S>(&mut answers, &rows, case);
    ranges::<S>(&mut answers, &rows);
    states::<S>(&mut answers, &rows);
    if rows.first().is_some_and(|asked| asked.row.has("eeprom")) {
        eeprom::<S>(&mut answers, &rows);
    }
    answers
}

fn defaults<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>], case: &Case<'_>) {
    let mut bench = Bench::<S>::as_delivered();
    for asked in rows {
        let expected = match notation::default(asked.row.get("default")) {
            Some(Default::Value(value)) => S::instead_of_default(asked.index, value),
            Some(Default::NodeIdPlus(base)) => base + i128::from(S::NODE.get()),
            _ => continue,
        };
        let Some(data_type) = case.sheet.code.data_type(Address::new(asked.index, asked.sub)) else { continue };
        let found = asked.read(&mut bench).map(|raw| signed(raw.into(), data_type));
        answers.that(asked.row, "default", found == Ok(expected), format!("{found:?}"));
    }
}

fn ranges<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>]) {
    for (variant, mut bench) in S::variants() {
        for asked in rows.iter().filter(|asked| asked.is_writable()) {
            let printed = asked.row.get("range");
            let range = if printed.contains(';') {
                by_variant::<S>(printed).into_iter().find(|(value, _)| *value == variant).map(|(_, range)| range)
            } else {
                notation::range(printed)
            };
            // 1003h:00 counts errors and can only be set to 0.
            let (Some((low, high)), true) = (range, asked.index != 0x1003) else { continue };
            let limits = match asked.size {
                1 => (0, 255),
                2 => (0, 65_535),
                _ => (i128::from(i32::MIN), i128::from(i32::MAX)),
            };
            // 607Dh is a pair in order: what is beyond the other limit is beyond it first.
            let is_pair = asked.index == 0x607D;
            let mut write = |value: i128| asked.write(&mut bench, value as i64);
            let refused = |written| written == Err(0x0609_0030) || is_pair && written == Err(0x0609_0036);
            let mut found = vec![];
            if low > limits.0 {
                found.push(refused(write(low - 1)));
            }
            if high < limits.1 {
                found.push(refused(write(high + 1)));
            }
            found.extend([write(high).is_ok(), write(low).is_ok()]);
            // Each goes back to where it leaves the other free.
            if is_pair {
                found.push(write(if asked.sub == 1 { low } else { high }).is_ok());
            }
            answers.that(asked.row, "range", !found.contains(&false), format!("{found:?}"));
        }
    }
}

/// A write that the state forbids is refused with 0800 0022h.
fn states<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>]) {
    let mut bench = Bench::<S>::new();
    for command in [0x80, 0x01] {
        bench.nmt(command);
        for asked in rows.iter().filter(|asked| asked.is_writable() && asked.row.has("restriction")) {
            let Ok(value) = asked.read(&mut bench) else { continue };
            let refused = asked.write(&mut bench, value.into()) == Err(0x0800_0022);
            let printed = [asked.row.get("restriction"), asked.row.get("notice")].join("");
            let only_before = printed.contains("PRE-OPERATIONAL") && !printed.ends_with(" OPERATIONAL");
            let expected = only_before && command == 0x01 || S::is_command(asked.index) && command == 0x80;
            let column = if asked.row.get("restriction").is_empty() { "notice" } else { "restriction" };
            answers.that(asked.row, column, refused == expected, if refused { "refused" } else { "taken" });
        }
    }
}

/// Another value than the present one that the drive takes: it is written.
pub(crate) fn changed<S: Simulator>(bench: &mut Bench<S>, index: u16, sub: u8, size: u8) -> Option<(u32, u32)> {
    let before = bench.read(index, sub).ok()?;
    let others = [before.wrapping_add(1), before.wrapping_sub(1)];
    let taken = others.into_iter().find(|value| bench.write(index, sub, (*value).into(), size).is_ok());
    taken.map(|value| (before, value))
}

/// What has a range and can be written keeps its value over a power cycle, or it does not.
fn eeprom<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>]) {
    let mut bench = Bench::<S>::new();
    let mut written = Vec::new();
    for asked in rows.iter().filter(|asked| asked.is_writable() && asked.index >= 0x2000) {
        let value = changed(&mut bench, asked.index, asked.sub, asked.size);
        written.extend(value.map(|(_, value)| (asked, value)));
    }
    S::power_cycle(&mut bench);
    for (asked, value) in written {
        let found = yes(bench.see(|drive, now| S::kept(drive, now, asked.index, asked.sub)) == value);
        answers.that(asked.row, "eeprom", asked.row.get("eeprom") == found, found);
    }
}
