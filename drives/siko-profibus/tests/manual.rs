//! Every row of the manuals' tables (`tests/manual/ag03-1-profibus`, `tests/manual/ag02-profibus`) against the codec, the
//! tables of parameters and the simulated drives. A cell that `errata.csv` names has to disagree, all others agree.

mod support;

use std::collections::BTreeMap;
use std::path::Path;

use lexican_eds::model::{Device, Meaning, Parameter, ParameterNumber};
use lexican_profibus::BitRate;
use lexican_profibus::dp::{Diagnosis, diagnosis};
use lexican_profibus::pkw::{Access, Format, Pkw, Refusal, Reply, Task, Value};
use lexican_runtime::Duration;
use siko_profibus::table::{self, Row};
use siko_profibus::{AG02, AG03_1, Model, bus};
use support::{Bench, differs};

/// A drive and its tables.
struct Manual {
    model: &'static Model,
    folder: &'static str,
}

const MANUALS: [Manual; 2] =
    [Manual { model: &AG03_1, folder: "ag03-1-profibus" }, Manual { model: &AG02, folder: "ag02-profibus" }];

type Line = BTreeMap<String, String>;

impl Manual {
    fn table(&self, name: &str) -> Vec<Line> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/manual").join(self.folder).join(name);
        let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        reader.deserialize().map(|row| row.unwrap_or_else(|error| panic!("{name}: {error}"))).collect()
    }

    /// The drive's data sheet and overlay.
    fn sheet(&self) -> Device {
        let name = if self.model.name == "AG02" { "siko/ag02" } else { "siko/ag03-1" };
        let mut device = lexican_eds::load(&lexican_eds::library::find(name).expect("the library has it").input()).0;
        device.interfaces.retain(|interface, _| interface == "profibus");
        device
    }

    /// Cells that disagree: `parameters.csv/1001/values`.
    fn wrong_cells(&self) -> Vec<String> {
        let cells = self.table("errata.csv").into_iter().flat_map(|row| {
            row["cells"].split(';').filter(|cell| !cell.is_empty()).map(str::to_owned).collect::<Vec<_>>()
        });
        cells.collect()
    }
}

/// Collects what disagrees, to be compared with the errata of one table.
struct Cells<'a> {
    manual: &'a Manual,
    table: &'static str,
    found: Vec<String>,
}

impl<'a> Cells<'a> {
    fn new(manual: &'a Manual, table: &'static str) -> Self {
        Cells { manual, table, found: Vec::new() }
    }

    fn check(&mut self, key: &str, column: &str, agrees: bool) {
        if !agrees {
            self.found.push(format!("{}/{key}/{column}", self.table));
        }
    }

    #[track_caller]
    fn finish(mut self) {
        let mut expected = self.manual.wrong_cells();
        expected.retain(|cell| cell.starts_with(self.table));
        expected.sort();
        self.found.sort();
        assert_eq!(self.found, expected, "{}", self.manual.folder);
    }
}

#[test]
fn every_erratum_has_two_readings_and_a_choice() {
    for manual in MANUALS {
        let rows = manual.table("errata.csv");
        assert!(rows.len() >= 12);
        for row in rows {
            assert!(!row["reading_a"].is_empty() && row["reading_a"] != row["reading_b"], "{row:?}");
            assert!(!row["chosen"].is_empty() && !row["why"].is_empty() && !row["place"].is_empty(), "{row:?}");
        }
        // Each cell is one of a table that is compared cell by cell.
        let tables = ["parameters.csv", "tasks.csv", "errors.csv", "addresses.csv"];
        for cell in manual.wrong_cells() {
            assert!(tables.iter().any(|table| cell.starts_with(table)), "{cell}");
        }
    }
}

#[test]
fn parameters_are_those_of_table_15() {
    for manual in MANUALS {
        let mut cells = Cells::new(&manual, "parameters.csv");
        let mut bench = Bench::new(manual.model);
        let mut rows = 0;
        let sheet = manual.sheet();
        for line in manual.table("parameters.csv") {
            let key = line["number"].as_str();
            let number: u16 = key.parse().unwrap();
            assert_eq!(u16::from_str_radix(&line["hex"], 16), Ok(number));
            if ["reserved", "reserviert"].contains(&line["name"].as_str()) {
                assert_eq!(bench.read(number), Err(Refusal::NO_SUCH_PARAMETER), "{number}");
                continue;
            }
            rows += 1;
            let row = table::find(manual.model.table, number).unwrap_or_else(|| panic!("{number}"));
            let access = match line["access"].as_str() {
                "read" => Access::Read,
                "write" => Access::Write,
                _ => Access::ReadWrite,
            };
            let (format, acknowledged_double) = match line["format"].as_str() {
                "word" | "Wort" => (Format::Word, false),
                "word*" | "Wort*" => (Format::Word, true),
                "double word" | "Doppelwort" => (Format::DoubleWord, false),
                "Array [10] word" | "Array [10] Wort" => (Format::Words(10), false),
                other => panic!("{other}"),
            };
            cells.check(key, "access", row.wire.access == access);
            cells.check(
                key,
                "format",
                (row.wire.format, row.wire.acknowledged_double) == (format, acknowledged_double),
            );
            let is_here = |parameter: &&Parameter| parameter.number == ParameterNumber::Number(number);
            let described = sheet.parameters().find(is_here).unwrap_or_else(|| panic!("{number}"));
            cells.check(key, "values", values_agree(&sheet, described, row, &line["values"]));
            // The number in the chapter that describes parameters stands in the description.
            let refers = |reference: &str| {
                let text = described.entry.description.as_deref().unwrap_or_default();
                text.contains(&format!("parameter {reference})"))
            };
            let is_referred = !line["reference"].is_empty();
            cells.check(key, "reference", !is_referred || refers(&line["reference"]));
            // The drive has it, too.
            let answer = match format {
                Format::Words(_) => bench.ask(Task::ReadElement { number, index: 0 }),
                _ => bench.ask(Task::Read { number }),
            };
            assert_eq!(matches!(answer, Reply::Refused(_)), access == Access::Write, "{number}: {answer:?}");
        }
        assert_eq!(rows, manual.model.table.len());
        cells.finish();
    }
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

/// `1..500`, `24:1 1..200; 48:1 1..100` of which the widest counts, `1 all; 2 standard`, or words.
fn values_agree(sheet: &Device, described: &Parameter, row: &Row, printed: &str) -> bool {
    let parts: Vec<&str> = printed.split("; ").filter(|part| !part.is_empty()).collect();
    let ranges = parts.iter().filter_map(|part| {
        let (low, high) = part.split(' ').next_back()?.split_once("..")?;
        Some((low.parse::<i32>().ok()?, high.parse::<i32>().ok()?))
    });
    if let Some(widest) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) {
        return row.wire.range == Some(widest);
    }
    let numbered = parts.iter().filter_map(|part| {
        let (number, name) = part.split_once(' ')?;
        let ours = WORDS.iter().find(|(manual, _)| *manual == name).map_or(name, |(_, ours)| *ours);
        Some((number.parse::<i128>().ok()?, ours))
    });
    let numbered: Vec<_> = numbered.collect();
    let named = match &described.entry.meaning {
        Meaning::Enumeration(name) if described.values.is_empty() => &sheet.enumerations[name].values,
        _ => &described.values,
    };
    if numbered.len() == parts.len() && !parts.is_empty() {
        let ours: Vec<_> = named.iter().map(|value| (value.value, value.name.as_str())).collect();
        let range = row.wire.range.is_none_or(|range| {
            let numbers = || numbered.iter().map(|(number, _)| *number);
            (numbers().min(), numbers().max()) == (Some(range.0.into()), Some(range.1.into()))
        });
        return ours == numbered && range;
    }
    match printed {
        "'A' to 'E'" => {
            let letters = named.iter().filter(|value| value.value != 0).map(|value| value.value as u8 as char);
            letters.eq('A'..='E')
        }
        "" | "0101h 1.01" | "bit 4 supply of the output stage; bit 7 torque deactivation" | "DDMMYYYY" => true,
        unit => match &described.entry.meaning {
            Meaning::Quantity(name) => {
                let quantity = &sheet.quantities[name].units[0];
                let scale = if quantity.den == 1 { String::new() } else { format!("1/{} ", quantity.den) };
                unit == format!("{scale}{}", quantity.symbol.replace('°', "deg"))
            }
            _ => false,
        },
    }
}

#[test]
fn tasks_are_those_of_table_8() {
    for manual in MANUALS {
        let mut cells = Cells::new(&manual, "tasks.csv");
        let mut bench = Bench::new(manual.model);
        for line in manual.table("tasks.csv") {
            let identifier: u8 = line["identifier"].parse().unwrap();
            let number = line["asked_for"].parse().unwrap_or(0);
            let pkw = Pkw { identifier, number, index: 0, value: 1 };
            let task = Task::parse(pkw).unwrap();
            let function = match task {
                None => "no task",
                Some(Task::Read { .. }) => "read",
                Some(Task::Write { value: Value::Word(_), .. }) => "write word",
                Some(Task::Write { value: Value::DoubleWord(_), .. }) => "write double word",
                Some(Task::ReadDescription { .. }) => "read description",
                Some(Task::WriteDescription { .. }) => "write description",
                Some(Task::ReadElement { .. }) => "read element",
                Some(Task::WriteElement { value: Value::Word(_), .. }) => "write element, word",
                Some(Task::WriteElement { value: Value::DoubleWord(_), .. }) => "write element, double word",
                Some(Task::CountElements { .. }) => "count elements",
            };
            cells.check(&line["identifier"], "function", line["function"] == function);
            let Some(task) = task else { continue };
            let answer = bench.ask(task).pkw(task.pkw()).identifier.to_string();
            let allowed = line["positive"].split(" or ").chain(line["negative"].split(" or "));
            assert!(allowed.clone().any(|allowed| allowed == answer), "{identifier} is answered by {answer}");
        }
        cells.finish();
    }
}

#[test]
fn replies_are_those_of_table_9() {
    for manual in MANUALS {
        let lines = manual.table("replies.csv");
        assert_eq!(lines.len(), 9);
        for line in lines {
            let identifier = line["identifier"].parse().unwrap();
            let function = match Reply::parse(Pkw { identifier, ..Pkw::default() }).unwrap() {
                None => "no reply",
                Some(Reply::Value(Value::Word(_))) => "word",
                Some(Reply::Value(Value::DoubleWord(_))) => "double word",
                Some(Reply::Description(_)) => "description",
                Some(Reply::Element(Value::Word(_))) => "element, word",
                Some(Reply::Element(Value::DoubleWord(_))) => "element, double word",
                Some(Reply::Count(_)) => "number of elements",
                Some(Reply::Refused(_)) => "refused",
                Some(Reply::NoAuthority) => "no authority",
            };
            assert_eq!(line["function"], function);
        }
    }
}

/// What each number says, by a word that only it has; and the drive gives those that it can.
#[test]
fn errors_are_those_of_table_10() {
    let words = [
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
    for manual in MANUALS {
        let mut cells = Cells::new(&manual, "errors.csv");
        for (line, word) in manual.table("errors.csv").iter().zip(words) {
            let number: u16 = line["number"].parse().unwrap();
            let text = Refusal(number).to_string();
            assert!(text.contains(word), "{number}: {text}");
            cells.check(&line["number"], "meaning", number != 16 || line["meaning"] == "PPO write missing");
            let (orders, task) = match line["provoked_by"].strip_prefix("travelling ") {
                Some(task) => ("000B;003B;t5000;007B", task),
                None => ("", line["provoked_by"].as_str()),
            };
            let fields: Vec<u32> = task.split(':').filter_map(|field| field.parse().ok()).collect();
            let &[identifier, parameter, index, value] = fields.as_slice() else {
                assert!(task.is_empty(), "{task}");
                continue;
            };
            let mut bench = Bench::new(manual.model);
            walk(&mut bench, orders);
            let pkw = Pkw { identifier: identifier as u8, number: parameter as u16, index: index as u16, value };
            let answer = bench.ask(Task::parse(pkw).unwrap().unwrap());
            assert_eq!(answer, Reply::Refused(Refusal(number)), "{}", line["provoked_by"]);
        }
        cells.finish();
    }
}

/// Control words in hexadecimal; `t5000` is the target, `w1000` waits for so many milliseconds, others are named below.
fn walk(bench: &mut Bench, orders: &str) {
    for order in orders.split(';').filter(|order| !order.is_empty()) {
        match order {
            "velocity" => assert_eq!(bench.write(930, 1), Ok(1)),
            "nosupply" => bench.world(|inputs| inputs.output_stage_supply_100mv = 0),
            "fault" => bench.world(|inputs| inputs.sensor_fails = true),
            "heal" => bench.world(|inputs| inputs.sensor_fails = false),
            "battery" => bench.world(|inputs| inputs.battery_10mv = 250),
            "lag" => bench.world(|inputs| inputs.attainable_rpm = Some(5)),
            "limit" => {
                assert_eq!(bench.write(1017, 1000), Ok(1000));
                assert!(bench.bus.exchange(bench.drive));
            }
            other => match (other.strip_prefix('t'), other.strip_prefix('w')) {
                (Some(target), _) => bench.target(target.parse().unwrap()),
                (_, Some(ms)) => bench.pass_ms(ms.parse().unwrap()),
                _ => bench.control(u16::from_str_radix(other, 16).unwrap()),
            },
        }
    }
}

#[test]
fn control_bits_do_what_tables_11_and_13_say() {
    for manual in MANUALS {
        for line in manual.table("control_word.csv") {
            let mut bench = Bench::new(manual.model);
            walk(&mut bench, &line["orders"]);
            let differs = differs(bench.word(), &line["status"]);
            assert_eq!(differs, None, "{:016b}: {line:?}", bench.word());
            let actual = bench.actual();
            let wanted = |sign: char| line["actual"].strip_prefix(sign).map(|number| number.parse::<i32>().unwrap());
            assert!(wanted('=').is_none_or(|wanted| actual == wanted), "{actual}: {line:?}");
            assert!(wanted('<').is_none_or(|wanted| actual < wanted), "{actual}: {line:?}");
            assert!(wanted('>').is_none_or(|wanted| actual > wanted), "{actual}: {line:?}");
        }
    }
}

#[test]
fn status_bits_say_what_tables_12_and_14_say() {
    for manual in MANUALS {
        let mut seen = BTreeMap::new();
        for line in manual.table("status_word.csv") {
            let mut bench = Bench::new(manual.model);
            walk(&mut bench, &line["orders"]);
            assert_eq!(differs(bench.word(), &line["status"]), None, "{:016b}: {line:?}", bench.word());
            *seen.entry((line["mode"].clone(), line["bit"].clone())).or_insert(0) += 1;
        }
        assert_eq!(seen.len(), 32, "16 bits in two modes");
    }
}

#[test]
fn the_flow_charts_are_walked_from_box_to_box() {
    let manual = &MANUALS[1];
    let lines = manual.table("flow_charts.csv");
    for model in [&AG02, &AG03_1] {
        for figure in ["13", "14"] {
            let mut bench = Bench::new(model);
            for line in lines.iter().filter(|line| line["figure"] == figure) {
                walk(&mut bench, &line["orders"]);
                let mut pattern: Vec<char> = line["status"].chars().collect();
                if pattern.is_empty() {
                    continue;
                }
                if figure == "14" && pattern[1] == '0' && model.velocity_bit_14 {
                    pattern[1] = '1';
                }
                bench.comes_to(&pattern.into_iter().collect::<String>());
            }
        }
    }
}

#[test]
fn the_printed_telegrams_go_over_the_bus() {
    for manual in MANUALS {
        let lines = manual.table("telegrams.csv");
        assert_eq!(lines.len(), 4);
        let mut bench = Bench::new(manual.model);
        assert_eq!(bench.write(1018, 10_000), Ok(10_000));
        for pair in lines.chunks(2) {
            let [asked, answered] = pair else { panic!("a task and its reply") };
            let words = asked["words"].replace(' ', "");
            let bytes: Vec<u8> = (0..8).map(|at| u8::from_str_radix(&words[2 * at..2 * at + 2], 16).unwrap()).collect();
            let pkw = Pkw::parse(&bytes).unwrap();
            let task = Task::parse(pkw).unwrap().unwrap();
            assert_eq!(task.pkw().to_string(), asked["words"]);
            assert_eq!(bench.ask(task).pkw(task.pkw()).to_string(), answered["words"]);
        }
        assert_eq!(bench.read(1016), Ok(250_000));
    }
}

#[test]
fn the_diagnosis_is_that_of_table_16() {
    for manual in MANUALS {
        let mut bench = Bench::new(manual.model);
        let bits = |bench: &Bench| bench.bus.slave(bench.drive).diagnosis();
        let running = bits(&bench);
        bench.bus.set_master_online(false);
        bench.pass_ms(500);
        let alone = bits(&bench);
        assert_eq!((running.master, alone.master), (Some(2), None));
        for line in manual.table("diagnosis.csv") {
            let byte: u32 = line["byte"].parse().unwrap();
            let Ok(bit) = line["bit"].parse::<u32>() else {
                let bytes = |diagnosis: Diagnosis| diagnosis.bytes()[byte as usize - 1];
                let ident = manual.model.identity.ident.to_be_bytes();
                let expected = match byte {
                    4 => [2, 0xFF],
                    _ => [ident[byte as usize - 5]; 2],
                };
                assert_eq!([bytes(running), bytes(alone)], expected, "{line:?}");
                continue;
            };
            let mask = 1 << (8 * (byte - 1) + bit);
            let named = diagnosis::TEXTS.iter().any(|(bit, _)| *bit == mask);
            assert_eq!(named, line["name"] != "reserved", "{line:?}");
            for diagnosis in [running, alone] {
                let is = if diagnosis.bits & mask == 0 { "0" } else { "1" };
                let wanted = match line["always"].as_str() {
                    "" => is,
                    // A bit of the master's: not of the slave.
                    "master" => "0",
                    always => always,
                };
                assert_eq!(is, wanted, "{line:?}");
            }
        }
        assert!(alone.to_string().contains("parameters and configuration are needed"));
    }
}

#[test]
fn the_baud_rates_are_those_of_the_standard() {
    for manual in MANUALS {
        let lines = manual.table("baud_rates.csv");
        assert_eq!(lines.len(), 9);
        for line in lines {
            let rate = (line["kbit_s"].parse::<f64>().unwrap() * 1000.0).round() as u32;
            assert!(BitRate::ALL.contains(&BitRate(rate)), "{line:?}");
            let length: u32 = line["length_m"].parse().unwrap();
            assert!((100..=1200).contains(&length));
        }
    }
}

#[test]
fn switches_set_the_address() {
    let manual = &MANUALS[0];
    let mut cells = Cells::new(manual, "addresses.csv");
    for line in manual.table("addresses.csv") {
        let switches = line["switches"].bytes().enumerate();
        let set = switches.fold(0, |address, (switch, on)| address | u8::from(on == b'1') << switch);
        let address = Model::address(set);
        cells.check(&line["switches"], "address", set.to_string() == line["address"]);
        assert_eq!(address.to_string(), line["address"].trim_end_matches('!'));
        if set > 2 && set < 126 {
            let (mut bus, drive) = bus::with(&AG03_1, set);
            assert!(bus.run_until(Duration::from_secs(1), |bus| bus.exchanges(drive) > 0), "{set}");
            assert_eq!(bus.ask(drive, Task::Read { number: 918 }), Some(Reply::Value(Value::Word(set.into()))));
        }
    }
    cells.finish();
}
