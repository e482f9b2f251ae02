//! The serial port of the AG02 (chapter 6), its parameters (chapter 8), and its flow charts (chapter 2.2).

mod raw;

use lexican_driver::Direction;
use lexican_eds::model::{AccessType, Condition, Entry};
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, Instant, NodeId};
use siko_ag02::sim::{BIT_RATES, MODEL, Setup, SimulatedDrive};
use siko_serial::Settings;
use siko_serial::answer::{Answer, Flags, Reading, Reply};
use siko_serial::command::{Command, Long, Mode, PosType, Short, Turning};
use siko_serial::error::ErrorNumber;
use siko_serial::parameter::{MODE, POS_TYPE, SENSE_OF_ROTATION};
use siko_serial::sim::SerialDrive;

use self::raw::{Raw, whole};
use crate::checker::{Against, Answers, Checker};
use crate::drive::{Case, Check};
use crate::exempt::Exempt;
use crate::kinds::prose::{Statement, said};
use crate::manual::{Keys, Row};
use crate::notation::fits;
use crate::rig::once;

/// The tables and their keys.
pub(crate) const TABLES: Keys = &[
    ("addresses.csv", &["telegram"]),
    ("commands.csv", &["command"]),
    ("errata.csv", &["id"]),
    ("errors.csv", &["number"]),
    ("flags.csv", &["bits", "value"]),
    ("flow_charts.csv", &["figure", "step"]),
    ("parameters.csv", &["number"]),
    ("statements.csv", &["subject"]),
    ("telegrams.csv", &["example"]),
];

/// What is not compared.
pub(crate) const EXEMPT: Exempt = Exempt {
    columns: &[
        (
            "chapter",
            &[
                "addresses.csv",
                "commands.csv",
                "errors.csv",
                "flags.csv",
                "flow_charts.csv",
                "parameters.csv",
                "statements.csv",
                "telegrams.csv",
            ],
            "where the row stands in the manual",
        ),
        (
            "table",
            &["addresses.csv", "commands.csv", "errors.csv", "parameters.csv"],
            "where the row stands in the manual",
        ),
        ("printed", &["addresses.csv"], "words; a reserved address is refused"),
        ("meaning", &["commands.csv", "flags.csv"], "words; the flow charts show what commands do"),
        ("error", &["errors.csv"], "words; what provokes an error shows which one it is"),
        ("provoked_by", &["errors.csv"], "ours: how the row is tried"),
        ("chosen_by", &["flags.csv"], "ours: how the row is tried"),
        ("box", &["flow_charts.csv"], "words"),
        ("telegrams", &["flow_charts.csv"], "ours: how the box is reached"),
        ("direction", &["telegrams.csv"], "words"),
    ],
    rows: &[],
    clauses: &[("no handshake", "there are no lines for one in a virtual line; the port is opened without")],
};

/// All comparisons.
pub(crate) const CHECKS: &[Check] =
    &[commands, addresses, errors, flags, parameters, telegrams, statements, flow_charts];

/// The key under which answers of this drive are remembered.
enum Port {}

fn commands(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "commands.csv";
    for row in case.manual.rows(FILE) {
        checker.key(row);
        let listed = match row.get("command") {
            "2C" => ",",
            "2E" => ".",
            letter => letter,
        };
        let telegram = whole(listed);
        let command = Command::parse(telegram.as_bytes());
        let Some((command, bytes)) = command.ok().and_then(|command| Some((command, command.encode()?))) else {
            checker.that(row, "command", Against::Code, false, "no command");
            continue;
        };
        let bytes = bytes.as_bytes();
        checker.cell(row, "command", Against::Code, key_of(bytes));
        checker.cell(row, "letter", Against::Code, char::from(bytes[0]));
        checker.cell(row, "length", Against::Code, bytes.len());
        checker.cell(row, "reply", Against::Code, command.reply().len());
        let answer = once::<Port, _>(&telegram, || Raw::default().send(&telegram));
        let answer = answer.strip_suffix(b"\r").unwrap_or(&answer);
        let pattern = pattern(command.reply());
        let like = |(byte, pattern): (&u8, char)| match pattern {
            '±' => matches!(byte, b'+' | b'-'),
            '>' => *byte == b'>',
            _ => *byte != b'>',
        };
        let fits = answer.len() == pattern.chars().count() && answer.iter().zip(pattern.chars()).all(like);
        let found = if fits { pattern.to_owned() } else { answer.escape_ascii().to_string() };
        checker.cell(row, "answer", Against::Drive, found);
    }
    // Every command of the code is in the table.
    let letters = (b'!'..=b'~').filter(|byte| !byte.is_ascii_lowercase()).map(|byte| char::from(byte).to_string());
    for telegram in letters.chain(["J0", "J1"].map(str::to_owned)).map(|listed| whole(&listed)) {
        if Command::parse(telegram.as_bytes()).is_ok() {
            checker.row(FILE, &key_of(telegram.as_bytes()));
        }
    }
}

/// The name of a command in the table: its letter; for `J`, with the number; what is no letter, in hexadecimal.
fn key_of(telegram: &[u8]) -> String {
    match telegram {
        [b'J', number, ..] => format!("J{}", char::from(*number)),
        [letter, ..] if letter.is_ascii_alphabetic() => char::from(*letter).to_string(),
        [byte, ..] => format!("{byte:02X}"),
        [] => String::new(),
    }
}

/// An answer as the manual prints it.
fn pattern(reply: Reply) -> &'static str {
    match reply {
        Reply::Text => "xxxxxxxx>",
        Reply::Long => "±xxxxxxx>",
        Reply::Short => "xxxxx>",
        Reply::Count => "zz>",
        Reply::Letters => "xxxxxxxxxx>",
        Reply::Flags => "yy>",
        Reply::Status => "xxyy>",
        Reply::Velocity => "±xxx>",
        Reply::Binary => "xxxx>",
        Reply::Done => ">",
        Reply::None => "",
    }
}

/// The number of a parameter in chapter 8.
fn number_of(object: Address) -> Option<u8> {
    let lasting = [(22, Short::BusAddress.object()), (23, Short::BitRate.object())];
    let numbers = MODEL.parameters.iter().map(|parameter| (parameter.number, parameter.address)).chain(lasting);
    numbers.into_iter().find(|(_, address)| *address == object).map(|(number, _)| number)
}

/// The number of the parameter that a command is about.
fn parameter_of(command: Command) -> Option<u8> {
    match command {
        Command::ReadLong(which) | Command::WriteLong(which, _) => number_of(which.object(Mode::Positioning)),
        Command::ReadShort(which) | Command::WriteShort(which, _) => number_of(which.object()),
        Command::SetPosType(_) => number_of(POS_TYPE),
        Command::SetMode(_) => number_of(MODE),
        Command::SetTurning(which) if which.in_object().is_some() => number_of(SENSE_OF_ROTATION),
        Command::SetTurning(_) => Some(25),
        _ => None,
    }
}

fn addresses(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "addresses.csv";
    for row in case.manual.rows(FILE) {
        checker.key(row);
        let telegram = whole(row.get("telegram"));
        let command = Command::parse(telegram.as_bytes());
        let reserved = row.get("printed") == "reserviert";
        checker.that(row, "telegram", Against::Code, command.is_err() == reserved, format!("{command:?}"));
        let number = command.ok().and_then(parameter_of).map_or(String::new(), |number| number.to_string());
        checker.cell(row, "parameter", Against::Code, number);
        let answer = once::<Port, _>(&telegram, || Raw::default().text(&telegram));
        checker.that(row, "telegram", Against::Drive, answer.starts_with('?') == reserved, answer);
    }
    // All numbers that the code knows, and those between them.
    let tens = |letter: &'static str, width| (0..100).map(move |number| format!("{letter}{number:0width$}"));
    let listed = ["A", "E", "F", "J", "L", "T", "X"].into_iter().flat_map(|letter| tens(letter, 1).take(10));
    let settings = (11_000..12_000).map(|number| format!("S{number}"));
    for telegram in listed.chain(tens("G", 2)).chain(tens("H", 2)).chain(settings) {
        if Command::parse(whole(&telegram).as_bytes()).is_ok() {
            checker.row(FILE, &telegram);
        }
    }
}

fn errors(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "errors.csv";
    for row in case.manual.rows(FILE) {
        let answer = once::<Port, _>(row.get("provoked_by"), || Raw::default().text(row.get("provoked_by")));
        checker.cell(row, "number", Against::Drive, answer.trim_start_matches('?'));
    }
    for number in ErrorNumber::ALL {
        let Some(row) = checker.row(FILE, &format!("{:02}", number.get())) else { continue };
        let known = row.number("number").and_then(ErrorNumber::new).and_then(ErrorNumber::text);
        checker.that(row, "number", Against::Code, known.is_some(), "no text");
    }
}

fn flags(checker: &mut Checker<'_>, _: &Case<'_>) {
    const FILE: &str = "flags.csv";
    // Each bit, its value, and the flag; no flag for unused bits.
    let known = [
        ("0", "0", 0),
        ("0", "1", Flags::SENSE_E),
        ("1+2", "00", 0),
        ("1+2", "01", Flags::LOOP_POSITIVE),
        ("1+2", "10", Flags::LOOP_NEGATIVE),
        ("3", "", 0),
        ("4", "0", 0),
        ("4", "1", Flags::VELOCITY),
        ("5", "", 0),
        ("6", "", 0),
        ("7", "", 0),
    ];
    for (bits, value, flag) in known {
        let key = [bits, value].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(":");
        let Some(row) = checker.row(FILE, &key) else { continue };
        checker.cell(row, "command", Against::Code, if Command::parse(b"Q") == Ok(Command::Flags) { "Q" } else { "" });
        let low: u32 = bits.split('+').next().and_then(|bit| bit.parse().ok()).unwrap_or_default();
        let shifted = u8::from_str_radix(value, 2).unwrap_or_default() << low;
        checker.that(row, "value", Against::Code, shifted == flag, format!("{flag:08b}"));
        let shown = once::<Port, _>(row.get("chosen_by"), || {
            let text = Raw::default().text(&format!("{};Q", row.get("chosen_by")));
            u8::from_str_radix(text.trim_end_matches('>'), 16).unwrap_or(0xFF)
        });
        let mask = if bits.contains('+') { 0b11 } else { 1 } << low;
        checker.that(row, "value", Against::Drive, shown & mask == flag, format!("{shown:08b}"));
    }
}

fn parameters(checker: &mut Checker<'_>, case: &Case<'_>) {
    case.sheet.findings.iter().for_each(|finding| checker.finding(finding.clone()));
    for number in 1..=25 {
        let Some(row) = checker.row("parameters.csv", &number.to_string()) else { continue };
        let parameter = MODEL.parameters.iter().find(|parameter| parameter.number == number);
        let lasting = [(22, Short::BusAddress.object()), (23, Short::BitRate.object())];
        let object = parameter.map(|parameter| parameter.address);
        let object = object.or_else(|| lasting.iter().find(|(known, _)| *known == number).map(|(_, object)| *object));
        // Number 24 has two objects, number 25 has none.
        let printed = object.filter(|_| number != 24).map_or(String::new(), |object| object.to_string());
        checker.cell(row, "object", Against::Code, printed);
        let telegrams = telegrams_of(number, object);
        let letters = |telegram: &str| telegram.chars().take(1).collect::<String>();
        let parts: Vec<_> = telegrams.iter().filter(|telegram| !telegram.is_empty()).map(String::as_str).collect();
        let by_letter = parts.iter().map(|telegram| letters(telegram)).collect::<Vec<_>>().join("/");
        let serial = row.get("serial");
        let agrees = serial == by_letter && number < 21 || serial == parts.join("/");
        checker.that(row, "serial", Against::Code, agrees, parts.join("/"));
        in_overlay(checker, case, row, number, &parts, object);
        // The overlay's description names the parameter.
        let named = format!("(parameter {number})");
        let is_named = |text: &Option<String>| text.as_deref().is_some_and(|text| text.contains(&named));
        let pnu = case.sheet.parameters("profibus").iter().find(|other| is_named(&other.entry.description));
        checker.cell(row, "profibus", Against::Sheet, pnu.map_or(String::new(), |other| other.number.to_string()));
        let entry = object.and_then(|object| case.sheet.device.entry(object.index(), object.sub()));
        checker.cell(row, "range", Against::Sheet, range(case, number, entry));
        let range = row.get("range").to_owned();
        let taken = once::<Port, _>((number, &range), || takes(number, &telegrams, &range));
        checker.that(row, "range", Against::Drive, taken, "another range");
        let default = once::<Port, _>(number, || default(number, object));
        checker.cell(row, "default", Against::Drive, default);
    }
}

/// The rows of the overlay about a parameter: one, or two for the setpoint of both modes.
fn in_overlay(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    row: &Row,
    number: u8,
    telegrams: &[&str],
    object: Option<Address>,
) {
    let objects = match number {
        24 => vec![Long::Setpoint.object(Mode::Positioning), Long::Setpoint.object(Mode::Velocity)],
        _ => object.into_iter().collect(),
    };
    // A parameter that is read as a flag has a letter to write it; one without an object has only its letter.
    let printed = match number {
        18..=20 => format!("Q/{}", telegrams[0]),
        25 => "T".to_owned(),
        _ => telegrams.join("/"),
    };
    let rows: Vec<_> = case.sheet.parameters("serial").iter().filter(|row| row.number.to_string() == printed).collect();
    let found: Vec<_> = rows.iter().map(|row| row.object().map(|(index, sub)| Address::new(index, sub))).collect();
    let expected: Vec<_> = if number == 25 { vec![None] } else { objects.into_iter().map(Some).collect() };
    checker.that(row, "serial", Against::Sheet, found == expected, format!("{printed}: {found:?}"));
    // The operating mode decides which of the two objects is meant.
    let when = |mode: Mode| Condition { index: MODE.index(), sub: 0, equal: true, value: mode.in_object().into() };
    let modes = rows.iter().map(|row| row.when.clone());
    let expected = [Mode::Positioning, Mode::Velocity].map(|mode| (number == 24).then(|| when(mode)));
    checker.that(row, "serial", Against::Sheet, modes.eq(expected.into_iter().take(rows.len())), "another mode");
    let numbers: Vec<i128> = rows.iter().flat_map(|row| &row.values).map(|value| value.value).collect();
    let expected: Vec<u16> = match number {
        20 => Mode::ALL.iter().map(|mode| mode.number()).collect(),
        25 => vec![Turning::JogStopsFully.number(), Turning::JogStopsByRamp.number()],
        _ => Vec::new(),
    };
    let agrees = numbers.iter().copied().eq(expected.iter().map(|number| i128::from(*number)));
    checker.that(row, "range", Against::Sheet, agrees, format!("{numbers:?}"));
    if let ([own], 25) = (rows.as_slice(), number) {
        let limits = [&own.entry.low, &own.entry.high].map(|limit| case.sheet.number(limit.as_ref()));
        checker.that(row, "range", Against::Sheet, limits == [Some(0), Some(1)], format!("{limits:?}"));
        // Letters write it; none reads it.
        let (access, bits) = (own.entry.access, own.data_type.bits());
        checker.that(row, "serial", Against::Sheet, (access, bits) == (AccessType::Wo, Some(8)), access.name());
    }
}

/// The telegrams that read and write a parameter.
fn telegrams_of(number: u8, object: Option<Address>) -> [String; 2] {
    let long = Long::ALL.iter().find(|which| Some(which.object(Mode::Positioning)) == object);
    let short = Short::ALL.iter().find(|which| Some(which.object()) == object);
    let pair = |read: Command, write: Command, len: usize| {
        [read, write].map(|command| {
            let bytes = command.encode().unwrap_or_default();
            bytes.as_bytes().iter().take(len).map(|byte| char::from(*byte)).collect()
        })
    };
    match (long, short, number) {
        (Some(which), _, _) => pair(Command::ReadLong(*which), Command::WriteLong(*which, 0), 2),
        (_, Some(which), _) => pair(Command::ReadShort(*which), Command::WriteShort(*which, 0), 3),
        (.., 25) => [Turning::JogStopsFully, Turning::JogStopsByRamp].map(|which| format!("T{}", which.number())),
        _ if object == Some(SENSE_OF_ROTATION) => ["T", "Q"].map(str::to_owned),
        _ if object == Some(POS_TYPE) => ["L", "Q"].map(str::to_owned),
        _ if object == Some(MODE) => ["X", "Q"].map(str::to_owned),
        _ => Default::default(),
    }
}

/// The range of a parameter as the manual prints it: the range of the object, or the names of its values.
fn range(case: &Case<'_>, number: u8, entry: Option<&Entry>) -> String {
    let values = |names: &[&str], count: usize| if names.len() == count { names.join("|") } else { String::new() };
    match (number, entry) {
        (18, _) => values(&["i", "e"], Turning::ALL.iter().filter(|which| which.in_object().is_some()).count()),
        (19, _) => values(&["direkt", "Schleife +", "Schleife -"], PosType::ALL.len()),
        (20, _) => values(&["Positioniermodus", "Drehzahlmodus"], Mode::ALL.len()),
        (23, _) => BIT_RATES.map(kilobit).join("|"),
        // Another comparison asks the drive whether the limits bound it.
        (24, _) => "by the limits".to_owned(),
        (25, _) => values(&["0", "1"], Turning::ALL.iter().filter(|which| which.in_object().is_none()).count()),
        (_, Some(entry)) if entry.ranges.is_empty() => {
            let limits = case.sheet.number(entry.low.as_ref()).zip(case.sheet.number(entry.high.as_ref()));
            limits.map_or(String::new(), |(low, high)| format!("{low}..{high}"))
        }
        (_, Some(entry)) => {
            let ranges = entry.ranges.iter().map(|range| format!("{}..{}", range.low, range.high));
            ranges.collect::<Vec<_>>().join("|")
        }
        (_, None) => String::new(),
    }
}

fn kilobit(rate: u32) -> String {
    format!("{}", f64::from(rate) / 1000.0)
}

/// A drive with one of the gears.
fn with_gear(gear: u8) -> Raw {
    let setup = Setup { gear, ..Setup::new(&MODEL, NodeId::literal(127)) };
    Raw { drive: SerialDrive::new(SimulatedDrive::power_on(Instant::ZERO, setup)), now: Instant::ZERO }
}

/// Whether the drive accepts and keeps the ends of a printed range, and accepts nothing beyond them.
fn takes(number: u8, [read, write]: &[String; 2], printed: &str) -> bool {
    // Limits restrict each other in one direction only; calibration values and setpoints are within them.
    let prepared = match number {
        14 => "F1+9999999;F2-9999999",
        15 => "F2-9999999",
        16 => "F1+9999999",
        24 => "F1+0000100;F2-0000200",
        _ => "",
    };
    let answer = |gear: u8, value: i64| {
        let telegram = match write.as_bytes() {
            [b'F', _] => format!("{write}{value:+08}"),
            _ => format!("{write}{value:05}"),
        };
        let mut drive = with_gear(gear);
        match drive.text(&format!("{prepared};{telegram}")) {
            done if done == ">" && drive.text(read).trim_end_matches('>').parse() != Ok(value) => "lost".to_owned(),
            answer => answer,
        }
    };
    let ranges: Vec<&str> = printed.split('|').collect();
    // Accepts as many values as there are names, numbered from `first`.
    let named = |letter: &str, first: usize| {
        let takes = |value: usize| Raw::default().text(&format!("{letter}{value}")) == ">";
        (first..first + ranges.len()).all(takes) && !takes(first + ranges.len())
    };
    match number {
        18 => named("T", 0),
        19 => named("L", 0),
        20 => named("X", 0),
        25 => named("T", 3),
        23 => answer(1, ranges.len() as i64 - 1) == ">" && answer(1, ranges.len() as i64) == "?02",
        24 => {
            let positions = [(-200, ">"), (100, ">"), (-201, "?09"), (101, "?09")];
            // In velocity mode, the gear restricts the setpoint, and the limits do not apply.
            let velocity = |value: i64| with_gear(1).text(&format!("{prepared};X1;F0{value:+08}"));
            positions.iter().all(|(value, said)| answer(1, *value) == *said)
                && [(-100, ">"), (100, ">"), (-101, "?02"), (101, "?02")]
                    .iter()
                    .all(|(value, said)| velocity(*value) == *said)
        }
        _ if printed.is_empty() => true,
        _ => (1..).zip(&ranges).all(|(gear, range)| {
            let Some((low, high)) = crate::notation::range(range) else { return false };
            let (low, high) = (low as i64, high as i64);
            // Values too long for a telegram are left to the tests of the codec.
            let longest = if write.starts_with('F') { i64::from(Command::LONG) } else { i64::from(Command::SHORT) };
            let fit = |value: &i64| value.abs() <= longest && (write.starts_with('F') || *value >= 0);
            [low, high].iter().all(|value| answer(gear, *value) == ">")
                && [low - 1, high + 1].iter().filter(|value| fit(value)).all(|value| answer(gear, *value) == "?02")
        }),
    }
}

/// The default of a parameter as the manual prints it: what a new drive answers.
fn default(number: u8, object: Option<Address>) -> String {
    let [read, _] = telegrams_of(number, object);
    let ask = |telegram: &str| Raw::default().text(telegram).trim_end_matches('>').to_owned();
    let flags = u8::from_str_radix(&ask("Q"), 16).unwrap_or(0xFF);
    let named = |bits: u8, name: &str| if flags & bits == 0 { name.to_owned() } else { format!("flags {flags:02X}") };
    match number {
        18 => named(Flags::SENSE_E, "i"),
        19 => named(Flags::LOOP_POSITIVE | Flags::LOOP_NEGATIVE, "direkt"),
        20 => named(Flags::VELOCITY, "Positioniermodus"),
        23 => {
            ask(&read).parse().ok().and_then(|code: usize| BIT_RATES.get(code)).map_or(String::new(), |it| kilobit(*it))
        }
        25 => String::new(),
        _ => ask(&read).parse().map_or(String::new(), |value: i64| value.to_string()),
    }
}

fn telegrams(checker: &mut Checker<'_>, _: &Case<'_>) {
    let refused = |number| Reading::Whole(Answer::Refused(number));
    let examples = [
        "error reply",
        "fault buffer",
        "system status word",
        "inching operation 2 positive",
        "inching operation 2 negative",
        "acknowledge a fault",
        "external gear 5:1",
        "external gear 3.78",
        "spindle pitch 2 mm",
    ];
    for example in examples {
        let Some(row) = checker.row("telegrams.csv", example) else { continue };
        let bytes = row.get("bytes");
        let inches = |direction| {
            u8::from_str_radix(bytes, 16).map(|byte| Command::parse(&[byte])) == Ok(Ok(Command::Inch(direction)))
        };
        let ended = |end: &str| format!("{bytes}{end}").into_bytes();
        let (against, agrees, means) = match example {
            "error reply" => {
                let agrees = Reply::Done.read(&ended("\r")) == refused(ErrorNumber::VALUE_RANGE);
                (Against::Code, agrees, "value out of range".to_owned())
            }
            "fault buffer" => {
                let agrees = Reply::Letters.read(&ended("\r")) == Reading::Whole(Answer::Letters(*b"ABB-------"));
                (Against::Code, agrees, "3 faults: A once and B twice".to_owned())
            }
            "system status word" => match Reply::Status.read(&ended(">\r")) {
                Reading::Whole(Answer::Status(word)) => (Against::Code, true, in_groups(word)),
                _ => (Against::Code, false, String::new()),
            },
            "inching operation 2 positive" => {
                (Against::Code, inches(Direction::Positive), "positive direction".to_owned())
            }
            "inching operation 2 negative" => {
                (Against::Code, inches(Direction::Negative), "negative direction".to_owned())
            }
            "acknowledge a fault" => {
                let answer = once::<Port, _>(bytes, || Raw::default().text(&format!("fault;{bytes};R")));
                let word = u16::from_str_radix(answer.trim_end_matches('>'), 16);
                let agrees = word.is_ok_and(|word| fits(word, "xxxx xxx0 xxxx xxxx"));
                (Against::Drive, agrees, "acknowledges a fault".to_owned())
            }
            _ => {
                let before = "H1000007;H1100007;H1300007";
                let read = |number: &str| {
                    once::<Port, _>((bytes, number), || Raw::default().text(&format!("{before};{bytes};G{number}")))
                };
                let read = |number: &str| read(number).trim_end_matches('>').trim_start_matches('0').to_owned();
                let means = match example {
                    "spindle pitch 2 mm" => format!("spindle pitch {}", read("13")),
                    _ => format!("numerator {} and denominator {}", read("10"), read("11")),
                };
                (Against::Drive, row.get("means") == means, means)
            }
        };
        checker.that(row, "bytes", against, agrees, "read otherwise");
        checker.cell(row, "means", against, means);
    }
}

fn in_groups(word: u16) -> String {
    let digits = format!("{word:016b}");
    [0, 4, 8, 12].map(|at| &digits[at..at + 4]).join(" ")
}

fn statements(checker: &mut Checker<'_>, _: &Case<'_>) {
    for (subject, clauses) in STATEMENTS {
        let Some(row) = checker.row("statements.csv", subject) else { continue };
        checker.cell(row, "statement", Against::Drive, once::<Port, _>(subject, || said(&clauses())));
    }
}

const STATEMENTS: &[Statement] = &[
    ("line", || {
        // A byte has ten bits: a start bit, eight bits, and a stop bit.
        let settings = Settings::default();
        let ten = settings.on_line(960) == Duration::from_secs(1);
        vec![
            ("9600 baud", settings.baud == 9600),
            ("no parity", ten),
            ("8 data bits", ten),
            ("1 stop bit", ten),
            ("no handshake", true),
        ]
    }),
    ("bus", || {
        // No telegram has room for an address.
        let bare = Command::Status.encode().is_some_and(|telegram| telegram.as_bytes() == b"R");
        vec![("not a bus: no other device on the line", bare)]
    }),
    ("letters", || {
        let mut drive = Raw::default();
        let small = drive.text("f0+0000012;e0") == "+0000012>" && drive.text("s11103") == ">";
        vec![("capital and small letters", small)]
    }),
    ("CR", || {
        let ends = |telegram: &str| Raw::default().send(telegram).ends_with(b"\r");
        let agrees = ["R", "G06"].into_iter().all(ends) && !["K", "W", ",", "."].into_iter().any(ends);
        vec![("ends all answers but those to K and W and to inching operation 2", agrees)]
    }),
    ("authority", || {
        let mut drive = Raw::default();
        drive.send("bus operational");
        let refused = ["M", "Y", "P", "X1", "F0+0000001", "S11103"].iter().all(|it| drive.text(it) == "?03");
        let taken = drive.text("N") == ">" && drive.text("O") == ">" && drive.text("E0") == "+0000000>";
        vec![("with CAN in OPERATIONAL or STOPPED only reading and N and O", refused && taken)]
    }),
    ("inching operation 2", || {
        let mut drive = Raw::default();
        drive.send(",");
        drive.pass(Duration::from_millis(99));
        drive.send(",");
        drive.pass(Duration::from_millis(99));
        let moves = fits(drive.status(), "xxxx 1xxx xxxx xxxx");
        drive.pass(Duration::from_millis(300));
        let stops = fits(drive.status(), "xxxx 0xxx xxx0 xxxx");
        vec![("stops when its character does not come for 100 ms", moves && stops)]
    }),
    ("in position", || {
        let mut drive = Raw::default();
        drive.send("F0+0000100;M");
        drive.pass(Duration::from_secs(60));
        let held = fits(drive.status(), "xxxx xxxx 0xxx xxxx");
        drive.send("P");
        let released = fits(drive.status(), "xxxx xxxx 1xxx xxxx");
        vec![("control of the position goes on until the motor is released", held && released)]
    }),
    ("limits", || {
        let answer = Raw::default().text("F1+0000010;F2-0000010;X1;limit switch 1;F0+0000050;M");
        vec![("limit switches and limits have no meaning in velocity mode", answer == ">")]
    }),
    ("buffer", || {
        let mut drive = Raw::default();
        drive.send(&"fault;S11103;".repeat(11));
        let last = drive.text("J0") == "10>" && drive.text("J1") == "EEEEEEEEEE>";
        vec![("the last 10 faults in their order", last)]
    }),
    ("setpoint", || vec![("not stored", Raw::default().text("F0+0000100;K;E0") == "+0000000>")]),
    ("restore", || {
        let mut drive = Raw::default();
        drive.send("H1400005;H1200003;S11100");
        let stay = drive.text("G14") == "00005>" && drive.text("G12") == "00003>";
        vec![("address and baud rate stay", stay)]
    }),
];

/// Figures 4 and 6, each followed as one path through all of its boxes.
fn flow_charts(checker: &mut Checker<'_>, case: &Case<'_>) {
    const FILE: &str = "flow_charts.csv";
    let all = case.manual.rows(FILE);
    for (figure, boxes) in [("4", 17), ("6", 10)] {
        for step in 1..=boxes {
            checker.row(FILE, &format!("{figure}:{step}"));
        }
        let rows: Vec<&Row> = all.iter().filter(|row| row.get("figure") == figure).collect();
        let key: Vec<_> = rows.iter().map(|row| (&row.key, row.get("telegrams"), row.get("status"))).collect();
        once::<Port, _>((figure, key), || {
            let (mut drive, mut answers) = (Raw::default(), Answers::default());
            for row in rows {
                // Once the path is lost, no later box is reached.
                let reached = !answers.has_disagreement() && take_box(&mut drive, row);
                answers.that(row, "status", reached, in_groups(drive.status()));
            }
            answers
        })
        .give(checker, all);
    }
}

/// Sends a box's telegrams and waits for its status.
fn take_box(drive: &mut Raw, row: &Row) -> bool {
    let telegrams = row.get("telegrams");
    let inching = matches!(telegrams, "," | ".");
    if !inching && drive.send(telegrams).first() == Some(&b'?') {
        return false;
    }
    (0..1000).any(|_| {
        if inching {
            drive.send(telegrams);
        }
        drive.pass(Duration::from_millis(10));
        fits(drive.status(), row.get("status"))
    })
}
