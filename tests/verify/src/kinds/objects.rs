//! The objects: every sub-index, against data sheet, code and drive. A column that a table lacks is not compared.

use lexican_eds::model::{AccessType, Direction, Entry, Meaning, NmtState};
use lexican_eds::types::DataType;
use lexican_runtime::Instant;
use lexican_runtime::object::Address;

use crate::checker::{Against, Answers, Checker};
use crate::code::{Handle, signed};
use crate::drive::Case;
use crate::manual::{Row, cells};
use crate::notation::{self, Default, hex, yes};
use crate::rig::{Rig, Simulator, once};
use crate::sheet::{Sheet, address};

/// Lowest and highest value.
pub(crate) type Range = (i128, i128);

/// What a drive adds to this comparison.
pub(crate) trait Objects: Simulator {
    /// The object that ranges depend on.
    const VARIANT: u16;

    /// The value of that object in what is printed before a range: `24` in `24:1 1..200`.
    fn variant(printed: &str) -> Option<i128>;
    /// A drive for each variant, with the widest limits that other objects can set.
    fn variants() -> Vec<(i128, Rig<Self>)>;
    /// Whether a drive as delivered has the default that is printed in words.
    fn has_default_in_words(_rig: &mut Rig<Self>, _words: &str) -> bool {
        false
    }
    /// Whether an object cannot be written in PRE-OPERATIONAL either, because it is a command.
    fn is_command(index: u16) -> bool;
    fn power_cycle(rig: &mut Rig<Self>);
    /// The value that the drive holds in an entry, read without the bus. The entry may be the drive's own address.
    fn kept(drive: &mut Self::Drive, now: Instant, index: u16, sub: u8) -> u32;
}

/// An entry as described by the data sheet or the code.
#[derive(Debug, PartialEq)]
pub(super) struct Described {
    access: &'static str,
    is_mappable: bool,
    data_type: String,
    pub(super) default: Option<i128>,
    pub(super) limits: Option<Range>,
    /// Ranges that hold while an object has a value.
    conditions: Vec<((u16, i128), Range)>,
    /// The values that have names.
    named: Vec<i128>,
    is_persistent: bool,
    writable_in: Option<Vec<NmtState>>,
}

impl Described {
    pub(super) fn written(sheet: &Sheet, entry: &Entry) -> Self {
        let conditions = entry.ranges.iter();
        let named = match &entry.meaning {
            Meaning::Enumeration(name) => sheet.device.enumerations.get(name),
            _ => None,
        };
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
            named: named.map_or_else(Vec::new, |named| named.values.iter().map(|value| value.value).collect()),
            is_persistent: entry.persistent,
            writable_in: entry.writable_in.as_deref().map(<[_]>::to_vec),
        }
    }

    pub(super) fn generated(sheet: &Sheet, handle: &Handle, address: Address) -> Self {
        let code = &sheet.code;
        let named = code.enumerations.get(handle.value_type);
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
            named: named.map_or_else(Vec::new, |named| named.iter().map(|value| value.raw.into()).collect()),
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
            // The length of an array has no handle of its own, and so neither default nor limits.
            if handle.path.ends_with(".len_object") {
                let sheet = Described::written(case.sheet, entry);
                (described.default, described.limits) = (sheet.default, sheet.limits);
            }
            compare::<S>(checker, row, Against::Code, &described);
        }
    }
    drive::<S>(checker, case, case.manual.rows("objects.csv"));
}

/// Compares rows with what the drive answers about their objects.
pub(super) fn drive<S: Objects>(checker: &mut Checker<'_>, case: &Case<'_>, rows: &[Row]) {
    once::<S, _>(cells(rows), || answers::<S>(rows, case)).give(checker, rows);
}

/// The codes that refuse a value of another size.
const OF_SIZES: [u32; 4] = [0x0601_0000, 0x0607_0010, 0x0607_0012, 0x0607_0013];

/// The codes that refuse a value out of range.
const OF_RANGES: [u32; 3] = [0x0609_0030, 0x0609_0031, 0x0609_0032];

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

pub(super) fn compare<S: Objects>(checker: &mut Checker<'_>, row: &Row, against: Against, described: &Described) {
    let access = notation::access(row.get("access"));
    // rww and rwr say more than rw.
    let same_access = access == described.access || described.access == "rw" && matches!(access, "rww" | "rwr");
    checker.that(row, "access", against, same_access, described.access);
    let mapping = match row.get("pdo_mapping") {
        "possible" => "yes",
        "not possible" => "no",
        other => other,
    };
    let mappable = yes(described.is_mappable);
    checker.that(row, "pdo_mapping", against, mapping == mappable, mappable);
    let printed = row.get("data_type");
    // Entries of an object of one type do not repeat the type.
    let same_type = notation::data_type(printed) == described.data_type || printed.is_empty() && row.has("object_code");
    checker.that(row, "data_type", against, same_type, &described.data_type);
    if row.has("default") {
        default::<S>(checker, row, against, described);
    }
    if row.has("eeprom") {
        let (found, printed) = (yes(described.is_persistent), row.get("eeprom"));
        checker.that(row, "eeprom", against, printed == found || printed.is_empty(), found);
    }
    if row.has("restriction") {
        restriction(checker, row, against, described.writable_in.as_deref());
    }
    if row.has("range") {
        let Described { limits, conditions, .. } = described;
        let agrees = described.has_range::<S>(row.get("range"), against);
        checker.that(row, "range", against, agrees, format!("{limits:?} {conditions:?}"));
    }
}

fn default<S: Objects>(checker: &mut Checker<'_>, row: &Row, against: Against, described: &Described) {
    let found = described.default.map_or("no".into(), |found| found.to_string());
    let printed = row.get("default");
    let agrees = match notation::default(printed) {
        Some(Default::Value(value)) => described.default == Some(value),
        Some(Default::NodeIdPlus(base)) => described.default == Some(base + i128::from(S::NODE.get())),
        // A default in words is compared with the drive.
        None if printed.contains(' ') => {
            return checker.that(row, "default", against, described.default.is_none(), found);
        }
        // The default is not printed here if another table has it.
        None => printed.is_empty() && row.has("object_code"),
        Some(Default::None) => described.default.is_none(),
    };
    checker.that(row, "default", against, agrees, found);
}

impl Described {
    /// Whether a printed range is that of the entry: `1..500`, several that depend on something, single values, the
    /// name of a data type for all of its values, or nothing.
    fn has_range<S: Objects>(&self, printed: &str, against: Against) -> bool {
        let by_variant = by_variant::<S>(printed);
        if !by_variant.is_empty() {
            let widest = by_variant.iter().map(|(_, range)| *range);
            let widest = widest.reduce(|(low, high), (other, more)| (low.min(other), high.max(more)));
            let expected = by_variant.into_iter().map(|(value, range)| ((S::VARIANT, value), range));
            return self.conditions == expected.collect::<Vec<_>>() && self.limits == widest;
        }
        let of_type = |name: &str| DataType::ALL.iter().find(|of| of.name() == name).and_then(|of| of.range());
        let whole = of_type(&self.data_type);
        let values = printed.split("; ").map(notation::number).collect::<Option<Vec<i128>>>();
        self.conditions.is_empty()
            && match (notation::range(printed), values.as_deref()) {
                _ if printed.is_empty() => self.limits.is_none(),
                _ if printed == self.data_type => self.limits.is_none(),
                // Limits that are those of the data type are not in the code.
                (Some(range), _) => {
                    self.limits == Some(range)
                        || against == Against::Code && self.limits.is_none() && whole == Some(range)
                }
                // A single value, which the entry always holds.
                (None, Some([value])) => self.default == Some(*value) && self.named.iter().all(|named| named == value),
                (None, Some([first, .., last])) => {
                    self.named == values.as_deref().unwrap_or_default()
                        && self.limits.is_none_or(|limits| limits == (*first, *last))
                }
                _ => false,
            }
    }
}

fn restriction(checker: &mut Checker<'_>, row: &Row, against: Against, states: Option<&[NmtState]>) {
    let found = states.map_or(String::new(), |states| {
        let names = states.iter().map(|state| match state {
            NmtState::PreOperational => " PRE-OPERATIONAL",
            NmtState::Operational => " OPERATIONAL",
        });
        format!("write{}", names.collect::<String>())
    });
    // Either column may restrict writes to a state.
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
        notation::access(self.row.get("access")).starts_with("rw")
    }

    fn read<S: Simulator>(&self, rig: &mut Rig<S>) -> Result<u32, u32> {
        rig.read(self.index, self.sub)
    }

    fn write<S: Simulator>(&self, rig: &mut Rig<S>, value: i64) -> Result<(), u32> {
        rig.write(self.index, self.sub, value, self.size)
    }
}

/// Index and sub-index of a row.
pub(crate) fn address_of(row: &Row) -> Option<(u16, u8)> {
    Some((u16::try_from(hex(row.get("index"))?).ok()?, u8::try_from(hex(row.get("subindex"))?).ok()?))
}

/// The index, and the first sub-index, of a cell such as `1003:01..0A`.
pub(crate) fn address_in(row: &Row) -> Option<(u16, u8)> {
    let (index, subs) = row.get("address").split_once(':')?;
    let sub = subs.split("..").next()?;
    Some((u16::try_from(hex(index)?).ok()?, u8::from_str_radix(sub, 16).ok()?))
}

/// Asks the drive about every object: access, default, ends of the range, states in which it can be written, EEPROM.
fn answers<S: Objects>(rows: &[Row], case: &Case<'_>) -> Answers {
    let mut answers = Answers::default();
    let code = &case.sheet.code;
    let asked = |row| address_of(row).map(|(index, sub)| Asked { row, index, sub, size: code.size(index, sub) });
    let rows: Vec<Asked<'_>> = rows.iter().filter_map(asked).collect();
    let mut rig = Rig::<S>::new();
    for asked in &rows {
        let read = asked.read(&mut rig);
        let readable = read != Err(0x0601_0001);
        // The list of errors may be empty.
        let answered = read.is_ok() || asked.index == 0x1003 && read == Err(0x0800_0024);
        let denied = asked.write(&mut rig, i64::from(read.unwrap_or(0)));
        let writable = denied != Err(0x0601_0002);
        let expected = match notation::access(asked.row.get("access")) {
            "ro" | "const" => readable && answered && !writable,
            "wo" => !readable && writable,
            "rw" | "rww" | "rwr" => readable && read.is_ok() && writable,
            _ => false,
        };
        answers.that(asked.row, "access", expected, format!("read {read:08X?}, write {denied:08X?}"));
        // A text has no fixed size.
        if code.data_type(Address::new(asked.index, asked.sub)).is_none_or(|data_type| data_type.size().is_none()) {
            continue;
        }
        let other = if asked.size == 4 || S::WRITES_FOUR_BYTES { 2 } else { 4 };
        let exact = rig.write_exactly(asked.index, asked.sub, 0, other);
        let refused = !writable || exact.is_err_and(|code| OF_SIZES.contains(&code));
        answers.that(asked.row, "data_type", refused, format!("a value of another size: {exact:08X?}"));
    }
    defaults::<S>(&mut answers, &rows, case);
    ranges::<S>(&mut answers, &rows, case);
    states::<S>(&mut answers, &rows);
    if rows.first().is_some_and(|asked| asked.row.has("eeprom")) {
        eeprom::<S>(&mut answers, &rows);
    }
    answers
}

fn defaults<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>], case: &Case<'_>) {
    let mut rig = Rig::<S>::as_delivered();
    for asked in rows {
        let printed = asked.row.get("default");
        let expected = match notation::default(printed) {
            Some(Default::Value(value)) => value,
            Some(Default::NodeIdPlus(base)) => base + i128::from(S::NODE.get()),
            None if printed.contains(' ') => {
                let agrees = S::has_default_in_words(&mut rig, printed);
                answers.that(asked.row, "default", agrees, "another one");
                continue;
            }
            _ => continue,
        };
        if notation::access(asked.row.get("access")) == "wo" {
            continue;
        }
        let Some(data_type) = case.sheet.code.data_type(Address::new(asked.index, asked.sub)) else { continue };
        let found = asked.read(&mut rig).map(|raw| signed(raw.into(), data_type));
        answers.that(asked.row, "default", found == Ok(expected), format!("{found:?}"));
    }
}

fn ranges<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>], case: &Case<'_>) {
    for (variant, mut rig) in S::variants() {
        for asked in rows.iter().filter(|asked| asked.is_writable()) {
            let printed = asked.row.get("range");
            let range = if printed.contains(';') {
                by_variant::<S>(printed).into_iter().find(|(value, _)| *value == variant).map(|(_, range)| range)
            } else {
                notation::range(printed)
            };
            // 1003h:00 counts errors and accepts only 0; 1600h:00 counts mapped objects.
            let counts = asked.sub == 0 && matches!(asked.index, 0x1003 | 0x1600..=0x17FF | 0x1A00..=0x1BFF);
            let (Some((low, high)), false) = (range, counts) else { continue };
            let entry = case.sheet.device.entry(asked.index, asked.sub);
            let Some(entry) = entry.filter(|entry| entry.access.writable()) else { continue };
            let Some(limits) = entry.data_type.range() else { continue };
            // The limits in 607Dh are an ordered pair: a value beyond the other limit is refused first.
            let is_pair = asked.index == 0x607D;
            let mut write = |value: i128| asked.write(&mut rig, value as i64);
            let refused = |written: Result<(), u32>| {
                written.is_err_and(|code| OF_RANGES.contains(&code) || is_pair && code == 0x0609_0036)
            };
            let mut found = vec![];
            if low > limits.0 {
                found.push(refused(write(low - 1)));
            }
            if high < limits.1 {
                found.push(refused(write(high + 1)));
            }
            found.extend([write(high).is_ok(), write(low).is_ok()]);
            // Restore a limit that leaves the other one free.
            if is_pair {
                found.push(write(if asked.sub == 1 { low } else { high }).is_ok());
            }
            answers.that(asked.row, "range", !found.contains(&false), format!("{found:?}"));
        }
    }
}

/// Checks that a write that the state forbids is refused with 0800 0022h.
fn states<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>]) {
    let mut rig = Rig::<S>::new();
    for command in [0x80, 0x01] {
        rig.nmt(command);
        for asked in rows.iter().filter(|asked| asked.is_writable() && asked.row.has("restriction")) {
            let Ok(value) = asked.read(&mut rig) else { continue };
            let refused = asked.write(&mut rig, value.into()) == Err(0x0800_0022);
            let printed = [asked.row.get("restriction"), asked.row.get("notice")].join("");
            let only_before = printed.contains("PRE-OPERATIONAL") && !printed.ends_with(" OPERATIONAL");
            let expected = only_before && command == 0x01 || S::is_command(asked.index) && command == 0x80;
            let column = if asked.row.get("restriction").is_empty() { "notice" } else { "restriction" };
            answers.that(asked.row, column, refused == expected, if refused { "refused" } else { "taken" });
        }
    }
}

/// Writes a value that differs from the present one and that the drive accepts. Returns both.
pub(crate) fn changed<S: Simulator>(rig: &mut Rig<S>, index: u16, sub: u8, size: u8) -> Option<(u32, u32)> {
    let before = rig.read(index, sub).ok()?;
    let others = [before.wrapping_add(1), before.wrapping_sub(1)];
    let taken = others.into_iter().find(|value| rig.write(index, sub, (*value).into(), size).is_ok());
    taken.map(|value| (before, value))
}

/// Checks whether entries with a range that can be written keep their values over a power cycle.
fn eeprom<S: Objects>(answers: &mut Answers, rows: &[Asked<'_>]) {
    let mut rig = Rig::<S>::new();
    let mut written = Vec::new();
    let printed = |asked: &&Asked<'_>| asked.is_writable() && !asked.row.get("eeprom").is_empty();
    for asked in rows.iter().filter(|asked| printed(asked) && asked.index >= 0x2000) {
        let value = changed(&mut rig, asked.index, asked.sub, asked.size);
        written.extend(value.map(|(_, value)| (asked, value)));
    }
    S::power_cycle(&mut rig);
    for (asked, value) in written {
        let found = yes(rig.see(|drive, now| S::kept(drive, now, asked.index, asked.sub)) == value);
        answers.that(asked.row, "eeprom", asked.row.get("eeprom") == found, found);
    }
}
