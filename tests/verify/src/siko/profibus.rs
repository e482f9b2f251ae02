//! SIKO's drives on PROFIBUS-DP: the same tables, numbered alike, in chapter 9 of the AG02's manual and in chapter 7 of the
//! AG03/1's.

#[path = "../../../../drives/siko-profibus/tests/all/rig.rs"]
mod rig;

use lexican_eds::model::{AccessType, ConditionalRange, Meaning, Parameter, ParameterNumber};
use lexican_profibus::BitRate;
use lexican_profibus::dp::{Diagnosis, diagnosis};
use lexican_profibus::pkw::{Access, Format, Pkw, Refusal, Reply, Task, Value};
use lexican_profibus::virtual_bus;
use lexican_runtime::Duration;
use siko::fault::{Fault, FaultKind};
use siko_ag02::od::profibus as ag02;
use siko_ag03_1::od::profibus as ag03_1;
use siko_profibus::table::{self, Content};
use siko_profibus::{Model, bus};

use self::rig::Rig;
use crate::checker::{Against, Answers, Checker};
use crate::drive::{Case, Check};
use crate::exempt::Exempt;
use crate::manual::{Keys, Row};
use crate::notation::{fits, hex};
use crate::rig::once;

/// A drive on PROFIBUS.
pub(crate) trait Dp: 'static {
    const MODEL: &'static Model;
    /// The manual's words for the widths of parameters: a word, a word acknowledged by a double word, a double word,
    /// and ten words.
    const FORMATS: [&'static str; 4];
    /// The manual's word for a number without a parameter.
    const RESERVED: &'static str;
    /// The number of switches that set the address; 0 if none do.
    const SWITCHES: usize;
    /// The boxes of figures 13 and 14, if they are not lost.
    const BOXES: &'static [(&'static str, usize)];
}

/// The tables and their keys.
pub(crate) const TABLES: Keys = &[
    ("addresses.csv", &["switches"]),
    ("baud_rates.csv", &["kbit_s"]),
    ("control_word.csv", &["mode", "bit", "value"]),
    ("diagnosis.csv", &["byte", "bit"]),
    ("errata.csv", &["id"]),
    ("errors.csv", &["number"]),
    ("flow_charts.csv", &["figure", "step"]),
    ("parameters.csv", &["number"]),
    ("replies.csv", &["identifier"]),
    ("status_word.csv", &["mode", "bit", "value"]),
    ("tasks.csv", &["identifier"]),
    ("telegrams.csv", &["example", "direction"]),
];

/// What is not compared.
pub(crate) const EXEMPT: Exempt = Exempt {
    columns: &[
        (
            "chapter",
            &[
                "addresses.csv",
                "baud_rates.csv",
                "control_word.csv",
                "diagnosis.csv",
                "errors.csv",
                "flow_charts.csv",
                "parameters.csv",
                "replies.csv",
                "status_word.csv",
                "tasks.csv",
                "telegrams.csv",
            ],
            "where the row stands in the manual",
        ),
        (
            "table",
            &[
                "baud_rates.csv",
                "control_word.csv",
                "diagnosis.csv",
                "errors.csv",
                "parameters.csv",
                "replies.csv",
                "status_word.csv",
                "tasks.csv",
            ],
            "where the row stands in the manual",
        ),
        ("length_m", &["baud_rates.csv"], "how long a cable may be"),
        ("designation", &["control_word.csv", "status_word.csv"], "words"),
        ("meaning", &["control_word.csv", "status_word.csv"], "words; status and motion show what the bit does"),
        ("actual", &["control_word.csv"], "ours: where the drive is afterwards, which is compared as well"),
        ("orders", &["control_word.csv", "status_word.csv", "flow_charts.csv"], "ours: how the row is tried"),
        ("name", &["diagnosis.csv", "parameters.csv"], "words; whether there is such a bit or number is compared"),
        ("provoked_by", &["errors.csv"], "ours: how the row is tried"),
        ("box", &["flow_charts.csv"], "words"),
        ("asked_for", &["tasks.csv"], "ours: how the row is tried"),
    ],
    rows: &[],
    clauses: &[],
};

/// All comparisons.
pub(crate) struct Checks<D>(std::marker::PhantomData<D>);

impl<D: Dp> Checks<D> {
    pub(crate) const ALL: &'static [Check] = &[
        replies,
        baud_rates,
        parameters::<D>,
        tasks::<D>,
        errors::<D>,
        telegrams::<D>,
        addresses::<D>,
        diagnosis_bits::<D>,
        control_words::<D>,
        status_words::<D>,
        flow_charts::<D>,
    ];
}

fn parameters<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "parameters.csv";
    let model = D::MODEL;
    case.sheet.findings.iter().for_each(|finding| checker.finding(finding.clone()));
    for row in case.manual.rows(FILE) {
        checker.key(row);
        let Some(number) = row.number::<u16>("number") else { continue };
        checker.cell(row, "hex", Against::Code, format!("{number:X}"));
        let mut described = case.sheet.parameters("profibus").iter();
        let described = described.find(|own| own.number == ParameterNumber::Number(number));
        let (Some(found), Some(own)) = (table::find(model.table, number), described) else {
            checker.that(row, "name", Against::Code, row.get("name") == D::RESERVED, "no such number");
            for column in ["access", "format", "values", "reference"] {
                checker.cell(row, column, Against::Code, "");
            }
            let refused = once::<D, _>(number, || Rig::new(model).read(number) == Err(Refusal::NO_SUCH_PARAMETER));
            checker.that(row, "number", Against::Drive, refused, "not refused");
            continue;
        };
        of_row::<D>(checker, case, row, found, own);
        let (refused, as_wide) = once::<D, _>(number, || {
            let mut rig = Rig::new(model);
            let answer = match found.wire.format {
                Format::Words(_) => rig.ask(Task::ReadElement { number, index: 0 }),
                _ => rig.ask(Task::Read { number }),
            };
            let as_wide = match answer {
                Reply::Value(Value::DoubleWord(_)) => found.wire.format == Format::DoubleWord,
                Reply::Value(Value::Word(_)) => found.wire.format == Format::Word,
                Reply::Element(_) => matches!(found.wire.format, Format::Words(_)),
                _ => true,
            };
            (matches!(answer, Reply::Refused(_)), as_wide)
        });
        checker.that(row, "access", Against::Drive, refused == (row.get("access") == "write"), "the other access");
        checker.that(row, "format", Against::Drive, as_wide, "another width");
    }
    for row in model.table {
        checker.row(FILE, &row.wire.number.to_string());
    }
}

/// Compares a row of the manual with the row of the code and with the overlay's parameter.
fn of_row<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, found: &table::Row, own: &Parameter) {
    let ours = found.parameter.object.map(|object| (object.index(), object.sub()));
    checker.that(row, "number", Against::Sheet, own.object() == ours, format!("{:04X?}", own.object()));
    let access = match found.wire.access {
        Access::Read => "read",
        Access::Write => "write",
        Access::ReadWrite => "read / write",
    };
    checker.cell(row, "access", Against::Code, access);
    let access = match own.entry.access {
        AccessType::Ro | AccessType::Const => "read",
        AccessType::Wo => "write",
        AccessType::Rw | AccessType::Rwr | AccessType::Rww => "read / write",
    };
    checker.cell(row, "access", Against::Sheet, access);
    let [word, acknowledged, double, ten] = D::FORMATS;
    let one = if found.wire.acknowledged_double { acknowledged } else { word };
    let format = match found.wire.format {
        Format::Word => one,
        Format::DoubleWord => double,
        Format::Words(_) | Format::DoubleWords(_) => ten,
    };
    checker.cell(row, "format", Against::Code, format);
    let format = match (own.elements, own.data_type.bits()) {
        (1, Some(17..)) => double,
        (1, _) => one,
        _ => ten,
    };
    checker.cell(row, "format", Against::Sheet, format);
    let printed = row.get("values");
    let values = by_code::<D>(found, printed);
    checker.that(row, "values", Against::Code, values, format!("{:?}", found.wire.range));
    checker.cell(row, "values", Against::Sheet, by_sheet::<D>(case, found, own, printed));
    let (_, reference) =
        own.entry.description.as_deref().and_then(|it| it.split_once("(parameter ")).unwrap_or_default();
    let reference = reference.split(')').next().unwrap_or_default();
    // The address has a parameter number, which this table does not print.
    let silent = row.get("reference").is_empty() && found.content == Content::Address;
    checker.that(row, "reference", Against::Sheet, silent || row.get("reference") == reference, reference);
}

/// Whether the code has the printed range or numbers; if they depend on the gear, the widest range.
fn by_code<D: Dp>(found: &table::Row, printed: &str) -> bool {
    let parts = || printed.split("; ").filter(|part| !part.is_empty());
    let ranges = parts().filter_map(|part| crate::notation::range(part.split(' ').next_back()?));
    let ours = found.wire.range.map(|(low, high)| (i128::from(low), i128::from(high)));
    if let Some(widest) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) {
        return ours == Some(widest);
    }
    if found.wire.number == ag02::FAULT_BUFFER.number() {
        // Faults of the CAN controller do not occur here.
        let here = |fault: &&Fault| !matches!(fault.kind, FaultKind::BusOff | FaultKind::BusPassive);
        let letters = D::MODEL.drive.faults.iter().filter(here).map(Fault::letter);
        let codes = found.parameter.codes.iter().filter(|(number, _)| *number != 0).map(|(number, _)| *number);
        return letters.map(|letter| i64::from(u32::from(letter))).eq(codes);
    }
    let numbers: Vec<i128> = parts().filter_map(|part| part.split_once(' ')?.0.parse().ok()).collect();
    let codes = found.parameter.codes;
    printed.is_empty()
        || parts().count() != numbers.len()
        || ours.is_none_or(|ours| numbers.iter().min().zip(numbers.iter().max()) == Some((&ours.0, &ours.1)))
            && (codes.is_empty() || codes.iter().map(|(number, _)| i128::from(*number)).eq(numbers))
}

/// The manuals' words for values that the overlays name otherwise.
const WORDS: [(&str, &str); 11] = [
    ("velocity mode", "profile velocity"),
    ("positioning mode", "profile position"),
    ("gear reduction 24:1", "gear 24:1"),
    ("gear reduction 48:1", "gear 48:1"),
    ("loop +", "loop plus"),
    ("loop -", "loop minus"),
    ("maximum delay", "maximum deceleration"),
    ("programmed delay", "programmed deceleration"),
    ("position control", "hold position"),
    ("windings shorted", "short-circuit windings"),
    ("motor released", "release motor"),
];

/// The overlay's text for a printed range, unit, list of values or note.
fn by_sheet<D: Dp>(case: &Case<'_>, found: &table::Row, own: &Parameter, printed: &str) -> String {
    let device = &case.sheet.device;
    let named = match &own.entry.meaning {
        Meaning::Enumeration(name) if own.values.is_empty() => {
            device.enumerations.get(name).map_or(&[][..], |enumeration| &enumeration.values)
        }
        _ => &own.values,
    };
    let number = found.wire.number;
    if number == ag02::FAULT_BUFFER.number() {
        let letters = named.iter().filter_map(|value| char::from_u32(value.value as u32)).filter(|it| *it != '\0');
        let letters: Vec<char> = letters.collect();
        let in_row = letters.iter().zip('A'..).take_while(|(letter, expected)| *letter == expected).count();
        let beyond = letters[in_row..].iter().map(|letter| format!("; '{letter}'")).collect::<String>();
        return format!("'A' to '{}'{beyond}", char::from(b'A' - 1 + in_row as u8));
    }
    let limits = case.sheet.number(own.entry.low.as_ref()).zip(case.sheet.number(own.entry.high.as_ref()));
    if !named.is_empty() {
        // A parameter without an object has limits of its own.
        let numbers = || named.iter().map(|value| value.value);
        if own.object().is_none() && limits != numbers().min().zip(numbers().max()) {
            return format!("{limits:?}");
        }
        let word =
            |ours: &str| WORDS.iter().find(|(_, name)| *name == ours).map_or(ours.to_owned(), |it| it.0.to_owned());
        return named.iter().map(|it| format!("{} {}", it.value, word(&it.name))).collect::<Vec<_>>().join("; ");
    }
    if !own.entry.ranges.is_empty() {
        return by_gear(case, &own.entry.ranges);
    }
    if let Some((low, high)) = limits.filter(|_| printed.contains("..")) {
        return format!("{low}..{high}");
    }
    match case.sheet.units(&own.entry).first() {
        // An example: the number, and how to read it.
        _ if found.content == Content::Version => {
            let number = printed.split('h').next().and_then(hex).unwrap_or_default();
            format!("{number:04X}h {:X}.{:02X}", number >> 8, number & 0xFF)
        }
        _ if number == ag03_1::GENERAL_STATUS_REGISTER.number() && general_status::<D>() => {
            "bit 4 supply of the output stage; bit 7 torque deactivation".to_owned()
        }
        // A decimal digit in each four bits.
        _ if number == ag03_1::DATE_OF_PRODUCTION.number()
            && once::<D, _>((), || Rig::new(D::MODEL).read(number)) == Ok(0x1507_2009) =>
        {
            "DDMMYYYY".to_owned()
        }
        // A parameter in units of position is printed without a unit.
        Some(unit) if !printed.is_empty() => {
            let scale = if unit.den == 1 { String::new() } else { format!("1/{} ", unit.den) };
            format!("{scale}{}", unit.symbol.replace('°', "deg"))
        }
        _ => String::new(),
    }
}

/// Whether PNU 1031 shows the supply in bit 4, and in bit 7 the loss of torque when the motor takes more than PNU 1032
/// allows.
fn general_status<D: Dp>() -> bool {
    once::<D, _>((), || {
        let mut rig = Rig::new(D::MODEL);
        let supplied = rig.read(1031);
        rig.world(|inputs| inputs.output_stage_supply_100mv = 0);
        let unsupplied = rig.read(1031);
        rig.world(|inputs| inputs.output_stage_supply_100mv = 240);
        let set = rig.write(1032, 20);
        rig.plays("000B;003B;t5000;007B;w1000");
        rig.world(|inputs| inputs.load_ma = 60_000);
        rig.pass_ms(1000);
        let overloaded = rig.read(1031).map(|word| word & 0x80);
        (supplied, unsupplied, set, overloaded) == (Ok(0x10), Ok(0), Ok(20), Ok(0x80))
    })
}

/// Ranges that depend on the gear, as the manual prints them.
fn by_gear(case: &Case<'_>, ranges: &[ConditionalRange]) -> String {
    let of_gear = |range: &ConditionalRange| {
        let gears = case.sheet.device.enumerations.get("GearReduction").map_or(&[][..], |gears| &gears.values);
        let gear = gears.iter().find(|gear| gear.value == range.when.value).map_or("", |gear| gear.name.as_str());
        format!("{} {}..{}", gear.trim_start_matches("gear "), range.low, range.high)
    };
    ranges.iter().map(of_gear).collect::<Vec<_>>().join("; ")
}

/// Compares the replies to a task that is carried out, by its function; for a task that reads, with both widths.
fn tasks<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let (word, double) = (Value::Word(0), Value::DoubleWord(0));
    let description = Reply::Description(0);
    for identifier in 0..10 {
        let Some(row) = checker.row("tasks.csv", &identifier.to_string()) else { continue };
        let number = row.number("asked_for").unwrap_or_default();
        let task = Task::parse(Pkw { identifier, number, index: 0, value: 1 }).ok().flatten();
        let (function, replies): (_, &[Reply]) = match task {
            None => ("no task", &[]),
            Some(Task::Read { .. }) => ("read", &[Reply::Value(word), Reply::Value(double)]),
            Some(Task::Write { value: Value::Word(_), .. }) => ("write word", &[Reply::Value(word)]),
            Some(Task::Write { value: Value::DoubleWord(_), .. }) => ("write double word", &[Reply::Value(double)]),
            Some(Task::ReadDescription { .. }) => ("read description", &[description]),
            Some(Task::WriteDescription { .. }) => ("write description", &[description]),
            Some(Task::ReadElement { .. }) => ("read element", &[Reply::Element(word), Reply::Element(double)]),
            Some(Task::WriteElement { value: Value::Word(_), .. }) => ("write element, word", &[Reply::Element(word)]),
            Some(Task::WriteElement { value: Value::DoubleWord(_), .. }) => {
                ("write element, double word", &[Reply::Element(double)])
            }
            Some(Task::CountElements { .. }) => ("count elements", &[Reply::Count(0)]),
        };
        checker.cell(row, "function", Against::Code, function);
        let identifiers = |replies: &[Reply]| {
            let identifier = |reply: &Reply| reply.pkw(task.map(Task::pkw).unwrap_or_default()).identifier.to_string();
            replies.iter().map(identifier).collect::<Vec<_>>().join(" or ")
        };
        let refused = identifiers(&[Reply::Refused(Refusal::OTHER), Reply::NoAuthority]);
        let positive = if task.is_none() { "0".to_owned() } else { identifiers(replies) };
        checker.cell(row, "positive", Against::Code, &positive);
        checker.cell(row, "negative", Against::Code, &refused);
        let Some(task) = task else { continue };
        let answer = once::<D, _>(format!("{task:?}"), || Rig::new(D::MODEL).ask(task).pkw(task.pkw()).identifier);
        let allowed = positive.split(" or ").chain(refused.split(" or ")).any(|known| known == answer.to_string());
        checker.that(row, "identifier", Against::Drive, allowed, answer);
    }
    require_count(checker, case, "tasks.csv", 10);
}

fn replies(checker: &mut Checker<'_>, _: &Case<'_>) {
    for identifier in 0..9 {
        let Some(row) = checker.row("replies.csv", &identifier.to_string()) else { continue };
        let function = match Reply::parse(Pkw { identifier, ..Pkw::default() }) {
            Ok(None) => "no reply",
            Ok(Some(Reply::Value(Value::Word(_)))) => "word",
            Ok(Some(Reply::Value(Value::DoubleWord(_)))) => "double word",
            Ok(Some(Reply::Description(_))) => "description",
            Ok(Some(Reply::Element(Value::Word(_)))) => "element, word",
            Ok(Some(Reply::Element(Value::DoubleWord(_)))) => "element, double word",
            Ok(Some(Reply::Count(_))) => "number of elements",
            Ok(Some(Reply::Refused(_))) => "refused",
            Ok(Some(Reply::NoAuthority)) => "no authority",
            Err(_) => "none",
        };
        checker.cell(row, "function", Against::Code, function);
    }
}

/// For each error, a word of its meaning that no other error has.
const ERRORS: [&str; 20] = [
    "parameter",
    "changed",
    "range",
    "index",
    "array",
    "width",
    "reset",
    "description cannot",
    "IR",
    "no description",
    "group",
    "control",
    "password",
    "text",
    "name",
    "texts",
    "PPO write is missing",
    "state",
    "another",
    "date",
];

/// The same words in the manuals.
const PRINTED: [&str; 20] = [
    "no such parameter",
    "value cannot be changed",
    "limit exceeded",
    "wrong sub-index",
    "no array",
    "wrong data type",
    "no setting, only resetting",
    "description cannot be changed",
    "PPO write asked for in IR not available",
    "no description",
    "wrong access group",
    "no authority",
    "wrong password",
    "text not readable in cyclic traffic",
    "name not readable in cyclic traffic",
    "no array of texts",
    "PPO write missing",
    "not in this operating state",
    "other error",
    "date not readable in cyclic traffic",
];

fn errors<D: Dp>(checker: &mut Checker<'_>, _: &Case<'_>) {
    for (number, (word, printed)) in (0_u16..).zip(ERRORS.into_iter().zip(PRINTED)) {
        let Some(row) = checker.row("errors.csv", &number.to_string()) else { continue };
        let text = Refusal::TEXTS.iter().find(|(refusal, _)| refusal.0 == number).map_or("", |(_, text)| text);
        let agrees = text.contains(word) && row.get("meaning") == printed;
        checker.that(row, "meaning", Against::Code, agrees, text);
        let orders = row.get("provoked_by");
        if orders.is_empty() {
            continue;
        }
        let answer = once::<D, _>(orders, || {
            let mut rig = Rig::new(D::MODEL);
            let travelling = orders.strip_prefix("travelling ");
            if travelling.is_some() {
                rig.plays("000B;003B;t5000;007B;w500");
            }
            let numbers = travelling.unwrap_or(orders).split(':').filter_map(|number| number.parse::<u32>().ok());
            let [identifier, number, index, value] = numbers.collect::<Vec<_>>().try_into().unwrap_or_default();
            let pkw = Pkw { identifier: identifier as u8, number: number as u16, index: index as u16, value };
            let task = Task::parse(pkw).ok().flatten();
            task.map(|task| format!("{:?}", rig.ask(task))).unwrap_or_default()
        });
        let refused = format!("{:?}", Reply::Refused(Refusal(number)));
        checker.that(row, "number", Against::Drive, answer == refused, answer);
    }
}

/// Status word and actual value of a new drive after some orders.
fn after<D: Dp>(orders: &str) -> (u16, i32) {
    once::<D, _>(orders, || {
        let mut rig = Rig::new(D::MODEL);
        rig.plays(orders);
        (rig.word(), rig.actual())
    })
}

/// The mode and the bits of a row in a word's table: the mode is that of its orders.
fn place(checker: &mut Checker<'_>, row: &Row) -> (u32, u32) {
    checker.key(row);
    let mode = if row.get("orders").starts_with("velocity") { "velocity" } else { "positioning" };
    checker.cell(row, "mode", Against::Drive, mode);
    let bits = row.get("bit");
    let (from, to) = bits.split_once('-').unwrap_or((bits, bits));
    (from.parse().unwrap_or(99), to.parse().unwrap_or(99))
}

/// Adds findings for bits of a mode without a row, and for those with several rows that are not one for each value.
fn require_bits(checker: &mut Checker<'_>, file: &str, seen: &[(&Row, u32)]) {
    checker.require(seen.iter().all(|(_, bit)| *bit < 16), || format!("{file}: a word has bits 0 to 15"));
    for mode in ["positioning", "velocity"] {
        for bit in 0..16 {
            let rows = seen.iter().filter(|(row, number)| row.get("mode") == mode && *number == bit);
            let values: Vec<&str> = rows.map(|(row, _)| row.get("value")).collect();
            let agrees = matches!(values.as_slice(), [_] | ["1", "0"] | ["0/1", "1/0"]);
            checker.require(agrees, || format!("{file}: bit {bit} in mode {mode} has rows for {values:?}"));
        }
    }
}

fn require_count(checker: &mut Checker<'_>, case: &Case<'_>, file: &'static str, count: usize) {
    let found = case.manual.rows(file).len();
    checker.require(found == count, || format!("{file}: {found} rows instead of {count}"));
}

/// Tables 11 and 13.
fn control_words<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "control_word.csv";
    let mut seen = Vec::new();
    for row in case.manual.rows(FILE) {
        let (from, to) = place(checker, row);
        seen.extend((from..=to).map(|bit| (row, bit)));
        let words: Vec<u32> = row.get("orders").split(';').filter(|order| order.len() == 4).filter_map(hex).collect();
        let set: Vec<bool> = words.iter().map(|word| word >> from.min(15) & 1 == 1).collect();
        let agrees = match row.get("value") {
            "" => from != to,
            "0/1" => set.ends_with(&[false, true]),
            "1/0" => set.ends_with(&[true, false]),
            "1" => set.contains(&true),
            value => value == "0" && set.contains(&false),
        };
        checker.that(row, "value", Against::Code, agrees, format!("{words:04X?}"));
        let (word, actual) = after::<D>(row.get("orders"));
        checker.that(row, "status", Against::Drive, fits(word, row.get("status")), format!("{word:016b}"));
        let wanted = |sign: char| row.get("actual").strip_prefix(sign).map(str::parse::<i32>);
        let agrees = match (wanted('='), wanted('<'), wanted('>')) {
            (Some(Ok(wanted)), ..) => actual == wanted,
            (_, Some(Ok(wanted)), _) => actual < wanted,
            (.., Some(Ok(wanted))) => actual > wanted,
            _ => row.get("actual").is_empty(),
        };
        checker.that(row, "actual", Against::Drive, agrees, actual);
    }
    require_bits(checker, FILE, &seen);
    require_count(checker, case, FILE, 40);
}

/// Tables 12 and 14.
fn status_words<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "status_word.csv";
    let mut seen = Vec::new();
    for row in case.manual.rows(FILE) {
        let (bit, _) = place(checker, row);
        seen.push((row, bit));
        let (word, _) = after::<D>(row.get("orders"));
        checker.that(row, "status", Against::Drive, fits(word, row.get("status")), format!("{word:016b}"));
        let value = match (word >> bit.min(15) & 1 == 1, row.get("value").contains('/')) {
            (true, false) => "1",
            (false, false) => "0",
            (true, true) => "0/1",
            (false, true) => "1/0",
        };
        checker.cell(row, "value", Against::Drive, value);
    }
    require_bits(checker, FILE, &seen);
    require_count(checker, case, FILE, 55);
}

/// Compares figures 13 and 14, each followed as one path through all of its boxes.
fn flow_charts<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "flow_charts.csv";
    let all = case.manual.rows(FILE);
    for (figure, boxes) in D::BOXES {
        for step in 1..=*boxes {
            checker.row(FILE, &format!("{figure}:{step}"));
        }
        let rows: Vec<&Row> = all.iter().filter(|row| row.get("figure") == *figure).collect();
        let key: Vec<_> = rows.iter().map(|row| (&row.key, row.get("orders"), row.get("status"))).collect();
        once::<D, _>((figure, key), || {
            let (mut rig, mut answers) = (Rig::new(D::MODEL), Answers::default());
            for row in rows {
                rig.plays(row.get("orders"));
                let pattern = row.get("status");
                // The box of an intermediate stop has no status.
                // Once the path is lost, no later box is reached.
                let comes = pattern.is_empty()
                    || !answers.has_disagreement()
                        && (0..10_000).any(|_| {
                            let is_there = fits(rig.word(), pattern);
                            if !is_there {
                                rig.turn();
                            }
                            is_there
                        });
                answers.that(row, "status", comes, format!("{:016b}", rig.word()));
            }
            answers
        })
        .give(checker, all);
    }
}

/// The printed telegrams.
fn telegrams<D: Dp>(checker: &mut Checker<'_>, _: &Case<'_>) {
    const FILE: &str = "telegrams.csv";
    let examples = [
        ("read the calibration value", Task::Read { number: 1018 }),
        ("write limit 1", Task::Write { number: 1016, value: Value::DoubleWord(250_000) }),
    ];
    for (example, task) in examples {
        let [asked, answered] =
            ["master to slave", "slave to master"].map(|way| checker.row(FILE, &format!("{example}:{way}")));
        let (Some(asked), Some(answered)) = (asked, answered) else { continue };
        let answer = once::<D, _>(example, || {
            let mut rig = Rig::new(D::MODEL);
            _ = rig.write(1018, 10_000);
            rig.ask(task).pkw(task.pkw()).to_string()
        });
        checker.cell(asked, "words", Against::Code, task.pkw());
        checker.cell(answered, "words", Against::Drive, &answer);
        let value = |words: &str| {
            let digits: String = words.split(' ').skip(2).collect();
            hex(&digits).filter(|value| *value != 0).map_or(String::new(), |value| value.to_string())
        };
        checker.cell(asked, "means", Against::Code, value(&task.pkw().to_string()));
        checker.cell(answered, "means", Against::Drive, value(&answer));
    }
}

/// Table 16.
fn diagnosis_bits<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "diagnosis.csv";
    let [running, alone] = once::<D, _>((), || {
        let (mut bus, drive) = bus::with(D::MODEL, 7);
        bus.exchange(drive);
        let running = bus.slave(drive).diagnosis();
        bus.set_master_online(false);
        bus.run(Duration::from_millis(500));
        [running, bus.slave(drive).diagnosis()]
    });
    for byte in 1..=3_u32 {
        for bit in 0..8 {
            let Some(row) = checker.row(FILE, &format!("{byte}:{bit}")) else { continue };
            let mask = 1 << (8 * (byte - 1) + bit);
            let named = diagnosis::TEXTS.iter().any(|(bit, _)| *bit == mask);
            checker.that(row, "name", Against::Code, named == (row.get("name") != "reserved"), "the other");
            let always = match [running, alone].map(|diagnosis| diagnosis.bits & mask != 0) {
                // Bits that only the master sets are not the slave's; bits that can change are not always set or clear.
                [false, false] if row.get("always") == "master" && MASTER.contains(&(byte, bit)) => "master",
                _ if CHANGING.contains(&(byte, bit)) => "",
                [true, true] => "1",
                [false, false] => "0",
                _ => "not always",
            };
            checker.cell(row, "always", Against::Drive, always);
        }
    }
    for byte in 4..=6_usize {
        let Some(row) = checker.row(FILE, &byte.to_string()) else { continue };
        let ident = D::MODEL.identity.ident.to_be_bytes();
        let expected = if byte == 4 { [virtual_bus::MASTER, 0xFF] } else { [ident[byte - 5]; 2] };
        let found = [running, alone].map(|diagnosis: Diagnosis| diagnosis.bytes()[byte - 1]);
        checker.that(row, "byte", Against::Drive, found == expected, format!("{found:02X?}"));
        checker.cell(row, "always", Against::Drive, "");
    }
    require_count(checker, case, FILE, 27);
}

/// Bits of the diagnosis that only a master sets, byte and bit.
const MASTER: [(u32, u32); 3] = [(1, 0), (1, 7), (2, 7)];
/// Bits that a slave sets and clears.
const CHANGING: [(u32, u32); 8] = [(1, 1), (1, 2), (1, 4), (1, 6), (2, 0), (2, 3), (2, 4), (2, 5)];

/// Table 7.
fn baud_rates(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "baud_rates.csv";
    for row in case.manual.rows(FILE) {
        checker.key(row);
        let rate = row.number::<f64>("kbit_s").map(|kbit| BitRate((kbit * 1000.0).round() as u32));
        checker.that(
            row,
            "kbit_s",
            Against::Code,
            rate.is_some_and(|rate| BitRate::ALL.contains(&rate)),
            "no such rate",
        );
    }
    require_count(checker, case, FILE, 9);
}

/// 7.8: the switches, the first one first.
fn addresses<D: Dp>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("addresses.csv") {
        checker.key(row);
        let switches = row.get("switches");
        let set =
            switches.bytes().enumerate().fold(0, |address, (switch, on)| address | u8::from(on == b'1') << switch);
        let address = Model::address(set);
        checker.that(row, "switches", Against::Code, switches.len() == D::SWITCHES, "another number of switches");
        checker.cell(
            row,
            "address",
            Against::Code,
            if address == set { set.to_string() } else { format!("{address}!") },
        );
        // Addresses below 3 are for masters.
        if (3..126).contains(&set) {
            let answer = once::<D, _>(set, || {
                let (mut bus, drive) = bus::with(D::MODEL, set);
                bus.run_until(Duration::from_secs(1), |bus| bus.exchanges(drive) > 0);
                bus.ask(drive, Task::Read { number: 918 })
            });
            let expected = Some(Reply::Value(Value::Word(set.into())));
            checker.that(row, "address", Against::Drive, answer == expected, format!("{answer:?}"));
        }
    }
}
