//! Each row of the manual's tables (`tests/manual/ag02-serial`) against the codec, the simulated drive, and the table of
//! parameters beside the data sheet; and that table against the generated dictionary.
//!
//! A cell that `errata.csv` names disagrees, and every other one agrees.

#[path = "../bench/mod.rs"]
mod bench;
mod parameters;
mod tables;

use std::cell::RefCell;
use std::collections::BTreeSet;

use lexican_driver::Direction;
use lexican_runtime::Duration;
use siko_serial::Settings;
use siko_serial::answer::{Answer, Reading, Reply};
use siko_serial::command::Command;
use siko_serial::error::ErrorNumber;
use tables::{Raw, Row, manual};

/// Which cells of a file disagree.
struct Cells {
    file: &'static str,
    errata: RefCell<BTreeSet<String>>,
}

impl Cells {
    fn of(file: &'static str) -> Self {
        let errata = manual("errata").into_iter().flat_map(|row| {
            let cells: Vec<String> = row["cells"].split(';').map(str::to_owned).collect();
            cells.into_iter().filter(|cell| cell.starts_with(&format!("{file}.csv/"))).collect::<Vec<_>>()
        });
        Cells { file, errata: RefCell::new(errata.collect()) }
    }

    #[track_caller]
    fn check(&self, key: &str, column: &str, agrees: bool) {
        let cell = format!("{}.csv/{key}/{column}", self.file);
        let named = self.errata.borrow_mut().remove(&cell);
        assert_ne!(named, agrees, "{cell}: {}", if agrees { "agrees, but is an erratum" } else { "disagrees" });
    }
}

impl Drop for Cells {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert!(self.errata.borrow().is_empty(), "errata about no cell: {:?}", self.errata.borrow());
        }
    }
}

/// A telegram that begins with what a table lists, with values where they are missing.
fn whole(listed: &str) -> String {
    let rest = match (listed.as_bytes().first(), listed.len()) {
        (Some(b'A' | b'E' | b'L' | b'T' | b'X'), 1) => "0",
        (Some(b'F'), 1) => "0+0000000",
        (Some(b'F'), 2) => "+0000000",
        (Some(b'G'), 1) => "00",
        (Some(b'H'), 1) => "0000250",
        (Some(b'H'), 3) => "00001",
        (Some(b'S'), 1) => "11103",
        _ => "",
    };
    format!("{listed}{rest}")
}

#[test]
fn commands() {
    let cells = Cells::of("commands");
    let rows = manual("commands");
    let letters: BTreeSet<&str> = rows.iter().map(|row| &*row["letter"]).collect();
    assert_eq!((rows.len(), letters.len()), (25, 24), "J has two answers");
    for row in rows {
        let key = &row["command"];
        let telegram = whole(if key.len() == 2 && key.starts_with('2') { &row["letter"] } else { key });
        let command = Command::parse(telegram.as_bytes()).unwrap();
        let bytes = command.encode().unwrap();
        cells.check(key, "letter", bytes.as_bytes().starts_with(row["letter"].as_bytes()));
        cells.check(key, "length", bytes.as_bytes().len().to_string() == row["length"]);
        cells.check(key, "reply", command.reply().len().to_string() == row["reply"]);
        let answer = Raw::default().send(&telegram);
        let answer = answer.strip_suffix(b"\r").unwrap_or(&answer);
        let like = |(byte, pattern): (&u8, char)| match pattern {
            '±' => matches!(byte, b'+' | b'-'),
            '>' => *byte == b'>',
            _ => *byte != b'>',
        };
        let fits = answer.len() == row["answer"].chars().count() && answer.iter().zip(row["answer"].chars()).all(like);
        cells.check(key, "answer", fits);
    }
}

#[test]
fn addresses() {
    let (cells, parameters) = (Cells::of("addresses"), tables::parameters());
    for row in manual("addresses") {
        let telegram = &row["telegram"];
        let command = Command::parse(whole(telegram).as_bytes());
        if row["printed"] == "reserviert" {
            assert_eq!(command, Err(ErrorNumber::PARAMETER_NUMBER), "{telegram}");
            continue;
        }
        assert_ne!(Raw::default().send(&whole(telegram)).first(), Some(&b'?'), "{telegram}");
        let stop_mode = matches!(&**telegram, "T3" | "T4");
        let is = |listed: &Row| {
            let by_letter = listed["write"].len() == 1 && telegram.starts_with(&listed["write"]);
            let by_letter = by_letter && (listed["parameter"] == "25") == stop_mode;
            listed["read"] == *telegram || listed["write"] == *telegram || by_letter
        };
        let number = parameters.iter().find(|listed| is(listed)).map_or("", |listed| &listed["parameter"]);
        cells.check(telegram, "parameter", number == row["parameter"]);
    }
}

#[test]
fn errors() {
    let cells = Cells::of("errors");
    let rows = manual("errors");
    assert_eq!(rows.len(), ErrorNumber::ALL.len());
    for row in rows {
        let number = ErrorNumber::new(row["number"].parse().unwrap()).unwrap();
        cells.check(&row["number"], "error", number.text().is_some());
        let answer = Raw::default().send(&row["provoked_by"]);
        cells.check(&row["number"], "number", answer == format!("?{}\r", row["number"]).as_bytes());
    }
}

#[test]
fn flags() {
    for row in manual("flags") {
        let mut drive = Raw::default();
        drive.send(&row["chosen_by"]);
        let flags = u8::from_str_radix(drive.text("Q").trim_end_matches('>'), 16).unwrap();
        let low: u32 = row["bits"][..1].parse().unwrap();
        let bits = flags >> low & if row["bits"].contains('+') { 0b11 } else { 1 };
        assert_eq!(bits, u8::from_str_radix(&row["value"], 2).unwrap_or(0), "{row:?}");
    }
}

/// Sends a box's telegrams and waits for its status.
fn take_box(drive: &mut Raw, row: &Row) {
    let inching = matches!(&*row["telegrams"], "," | ".");
    if !inching {
        let answer = drive.send(&row["telegrams"]);
        assert_ne!(answer.first(), Some(&b'?'), "{row:?}");
    }
    for _ in 0..6000 {
        if inching {
            drive.send(&row["telegrams"]);
        }
        drive.pass(Duration::from_millis(10));
        if bench::is(drive.status(), &row["status"]) {
            return;
        }
    }
    panic!("{:016b} is not as in {row:?}", drive.status());
}

#[test]
fn flow_charts() {
    for figure in ["4", "6"] {
        let mut drive = Raw::default();
        let boxes = manual("flow_charts").into_iter().filter(|row| row["figure"] == figure);
        assert!(boxes.map(|row| take_box(&mut drive, &row)).count() >= 10);
    }
}

#[test]
fn telegrams() {
    let cells = Cells::of("telegrams");
    for row in manual("telegrams") {
        let (bytes, means) = (&*row["bytes"], &*row["means"]);
        let parses = |byte: u8| Command::parse(&[byte]).ok();
        let agrees = match &*row["example"] {
            "error reply" => {
                Reply::Done.read(format!("{bytes}\r").as_bytes())
                    == Reading::Whole(Answer::Refused(ErrorNumber::VALUE_RANGE))
            }
            "fault buffer" => {
                Reply::Letters.read(format!("{bytes}\r").as_bytes()) == Reading::Whole(Answer::Letters(*b"ABB-------"))
            }
            "system status word" => match Reply::Status.read(format!("{bytes}>\r").as_bytes()) {
                Reading::Whole(Answer::Status(word)) => bench::is(word, means),
                _ => false,
            },
            "inching operation 2 positive" => parses(0x2C) == Some(Command::Inch(Direction::Positive)) && bytes == "2C",
            "inching operation 2 negative" => parses(0x2E) == Some(Command::Inch(Direction::Negative)) && bytes == "2E",
            "acknowledge a fault" => Raw::default().text(&format!("fault;{bytes}")) == ">",
            // Numbers that are read back are those that were meant.
            _ => bytes.split(';').all(|telegram| {
                let mut drive = Raw::default();
                let read = drive.text(&format!("{telegram};G{}", &telegram[1..3]));
                read[..5] == telegram[3..] && means.split(' ').any(|word| word.parse() == read[..5].parse::<u32>())
            }),
        };
        cells.check(&row["example"], "bytes", agrees);
    }
}

#[test]
fn statements() {
    for row in manual("statements") {
        let mut drive = Raw::default();
        let settings = Settings::default();
        let holds = match &*row["subject"] {
            // A byte has ten bits.
            "line" => settings.baud == 9600 && settings.on_line(960) == Duration::from_secs(1),
            // No telegram has room for an address.
            "bus" => Command::Status.encode().unwrap().as_bytes() == b"R",
            "letters" => drive.text("f0+0000012;e0") == "+0000012>" && drive.text("s11103") == ">",
            "CR" => {
                let ends = |drive: &mut Raw, telegram: &str| drive.send(telegram).ends_with(b"\r");
                ends(&mut drive, "R")
                    && ends(&mut drive, "G06")
                    && !["K", "W", ",", "."].iter().any(|telegram| ends(&mut drive, telegram))
            }
            "authority" => {
                drive.send("bus operational");
                let refused = ["M", "Y", "P", "X1", "F0+0000001", "S11103"].iter().all(|it| drive.text(it) == "?03");
                refused && drive.text("N") == ">" && drive.text("O") == ">" && drive.text("E0") == "+0000000>"
            }
            "inching operation 2" => {
                drive.send(",");
                drive.pass(Duration::from_millis(99));
                drive.send(",");
                drive.pass(Duration::from_millis(99));
                let moves = drive.status() & 0x0800 != 0;
                drive.pass(Duration::from_millis(300));
                moves && drive.status() & 0x0810 == 0
            }
            "in position" => {
                drive.send("F0+0000100;M");
                drive.pass(Duration::from_secs(60));
                let before = drive.status();
                drive.send("P");
                before & 0x0080 == 0 && drive.status() & 0x0080 != 0
            }
            "limits" => drive.text("F1+0000010;F2-0000010;X1;limit switch 1;F0+0000050;M") == ">",
            "buffer" => {
                drive.send(&"fault;S11103;".repeat(11));
                drive.text("J0") == "10>" && drive.text("J1") == "EEEEEEEEEE>"
            }
            "setpoint" => drive.text("F0+0000100;K;E0") == "+0000000>",
            "restore" => {
                drive.send("H1400005;H1200003;S11100");
                drive.text("G14") == "00005>" && drive.text("G12") == "00003>"
            }
            other => panic!("{other}: no check"),
        };
        assert!(holds, "{row:?}");
    }
}
