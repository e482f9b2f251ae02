//! Altering any single cell of the data sheet, of the overlay or of the tables makes the verification fail: against
//! the manual, and not only against code that was generated from something else.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use lexican_verify::{DRIVES, Drive, Inputs, Interface, PROSE, finds, verify};

/// So many cells of each kind.
const SAMPLES: usize = 100;

fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_reports_are_current() {
    for drive in DRIVES {
        let report = verify(drive, &Inputs::read(drive, &root()).unwrap());
        assert_eq!(report.findings, [""; 0]);
        let same =
            std::fs::read_to_string(root().join(drive.report)).is_ok_and(|text| text == report.to_markdown(drive));
        assert!(same, "{} is stale: cargo xtask verify", drive.report);
    }
}

#[test]
fn altered_cells_of_the_data_sheet_are_found() {
    check(
        "eds",
        |drive, inputs| if has_data_sheet(drive) { eds_cells(&inputs.eds) } else { Vec::new() },
        |inputs, cell, text| {
            inputs.code_is_stale = true;
            inputs.eds.replace_range(cell.range.clone(), text);
        },
    );
}

#[test]
fn altered_cells_of_the_overlay_are_found() {
    check(
        "overlay",
        |drive, inputs| overlay_cells(&inputs.overlay).into_iter().filter(|cell| is_compared(drive, cell)).collect(),
        |inputs, cell, text| {
            inputs.code_is_stale = true;
            inputs.overlay.replace_range(cell.range.clone(), text);
        },
    );
}

#[test]
fn altered_cells_of_the_tables_are_found() {
    let cells = |drive: &Drive, inputs: &Inputs| {
        inputs.tables.iter().flat_map(|(file, text)| table_cells(drive, file, text)).collect()
    };
    check("tables", cells, |inputs, cell, text| {
        let file = cell.name.split('/').next().unwrap();
        inputs.tables.get_mut(file).unwrap().replace_range(cell.range.clone(), text);
    });
}

/// Whether all of the data sheet is compared, and not only what is about parameters.
fn has_data_sheet(drive: &Drive) -> bool {
    drive.interface == Interface::CanOpen
}

/// The section of another interface is compared through that, but for what the EEPROM keeps, which is a column of CANopen's
/// table 6. Names of its parameters stand in PARAMETERS.md, which another test keeps current.
fn is_compared(drive: &Drive, cell: &Cell) -> bool {
    // Of what the AG02 has no object: PNU 970, and parameter 25.
    let is_of = |name: &str| cell.name.starts_with(&format!("[enumeration.{name}]"));
    match drive.interface {
        Interface::CanOpen => {
            let elsewhere = is_of("DataRecord") || drive.name == "siko/ag02" && is_of("InchingStop");
            let of_interface = cell.name.starts_with("[interface.") && !cell.name.ends_with(" persistent");
            !elsewhere && !of_interface
        }
        Interface::Other { section, .. } => {
            let key = cell.name.strip_prefix(&format!("[interface.{section}] "));
            key.is_some_and(|key| !matches!(key, "name" | "persistent"))
                || section == "profibus" && (is_of("DataRecord") || is_of("InchingStop"))
        }
    }
}

/// A cell: its name, where it stands in its text, and what it holds.
struct Cell {
    name: String,
    range: std::ops::Range<usize>,
    value: String,
}

/// Alters cells of each drive, or of the one that `LEXICAN_VERIFY_DRIVE` names.
#[track_caller]
fn check(kind: &str, cells: impl Fn(&Drive, &Inputs) -> Vec<Cell>, alter: impl Fn(&mut Inputs, &Cell, &str) + Sync) {
    let chosen = std::env::var("LEXICAN_VERIFY_DRIVE").ok();
    for drive in DRIVES.iter().filter(|drive| chosen.as_deref().is_none_or(|name| name == drive.name)) {
        let inputs = Inputs::read(drive, &root()).unwrap();
        check_drive(drive, kind, &cells(drive, &inputs), &inputs, &alter);
    }
}

#[track_caller]
fn check_drive(
    drive: &Drive,
    kind: &str,
    cells: &[Cell],
    original: &Inputs,
    alter: &(impl Fn(&mut Inputs, &Cell, &str) + Sync),
) {
    let expected = verify(drive, original).to_markdown(drive);
    let mut random = Random(0x5EED_AC03);
    let all = samples(cells.len()) == cells.len();
    let mutations: Vec<(&Cell, String)> = (0..samples(cells.len()))
        .map(|at| {
            let cell = &cells[if all { at } else { random.below(cells.len()) }];
            (cell, altered(&cell.value, random.next()))
        })
        .collect();
    let (next, survivors) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some((cell, text)) = mutations.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mut inputs = original.clone();
            alter(&mut inputs, cell, text);
            // What disagrees already may disagree in another way.
            if !finds(drive, &inputs) && verify(drive, &inputs).to_markdown(drive) == expected {
                survivors.lock().unwrap().push(format!("{}: {:?} instead of {:?}", cell.name, text, cell.value));
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let survivors = survivors.into_inner().unwrap();
    println!(
        "{} {kind}: {} cells, {} altered, {} not found",
        drive.name,
        cells.len(),
        mutations.len(),
        survivors.len()
    );
    assert!(survivors.is_empty(), "not found:\n{}", survivors.join("\n"));
}

/// All cells when `LEXICAN_VERIFY_ALL` is set, which takes minutes.
fn samples(cells: usize) -> usize {
    if std::env::var_os("LEXICAN_VERIFY_ALL").is_some() { cells } else { SAMPLES.min(cells) }
}

/// Another value: one digit or letter is the next one, and what has none gets one.
fn altered(value: &str, random: u64) -> String {
    let places: Vec<usize> = (0..value.len()).filter(|at| value.as_bytes()[*at].is_ascii_alphanumeric()).collect();
    if places.is_empty() {
        return format!("{value}x");
    }
    // Not the x of 0x, which would make a number of another kind, but also one that is wrong.
    let at = places[random as usize % places.len()];
    let next = match value.as_bytes()[at] {
        digit @ b'0'..=b'8' | digit @ b'a'..=b'y' | digit @ b'A'..=b'Y' => digit + 1,
        b'9' => b'8',
        letter => letter - 1,
    };
    format!("{}{}{}", &value[..at], char::from(next), &value[at + 1..])
}

fn is_prose_key(key: &str) -> bool {
    PROSE.iter().any(|(prose, _)| *prose == key)
        || key.strip_prefix("Line").is_some_and(|number| number.parse::<u8>().is_ok())
}

fn eds_cells(text: &str) -> Vec<Cell> {
    let (mut cells, mut section, mut at) = (Vec::new(), "", 0);
    for line in text.split_inclusive('\n') {
        let bare = line.trim_end();
        if bare.starts_with('[') {
            section = bare;
        } else if let Some((key, value)) = bare.split_once('=').filter(|(key, _)| !is_prose_key(key)) {
            let start = at + key.len() + 1;
            cells.push(cell(format!("{section} {key}"), start, value));
        }
        at += line.len();
    }
    cells
}

/// Everything behind ` = ` that is a number, a flag or a text.
fn overlay_cells(text: &str) -> Vec<Cell> {
    let (mut cells, mut section, mut at) = (Vec::new(), "", 0);
    for line in text.split_inclusive('\n') {
        if line.starts_with('[') {
            section = line.trim_end();
        }
        let is_comment = line.starts_with('#');
        for (equals, _) in line.match_indices(" = ").filter(|_| !is_comment) {
            let key = line[..equals].rsplit([' ', '{']).next().unwrap();
            let start = equals + 3;
            let rest = &line[start..];
            if is_prose_key(key) || is_in_text(line, equals) || rest.starts_with(['[', '{']) {
                continue;
            }
            let (start, value) = match rest.strip_prefix('"') {
                Some(quoted) => (start + 1, quoted.split('"').next().unwrap()),
                None => (start, rest.split([',', ' ', '\n']).next().unwrap()),
            };
            cells.push(cell(format!("{section} {key}"), at + start, value));
        }
        at += line.len();
    }
    cells
}

fn is_in_text(line: &str, at: usize) -> bool {
    line[..at].matches('"').count() % 2 == 1
}

fn table_cells(drive: &Drive, file: &str, text: &str) -> Vec<Cell> {
    let (mut cells, mut at) = (Vec::new(), 0);
    let mut columns: Vec<&str> = Vec::new();
    for line in text.split_inclusive('\n') {
        let fields = fields(line.trim_end());
        if columns.is_empty() {
            columns = fields.iter().map(|range| &line[range.clone()]).collect();
        } else if !drive
            .exempt
            .rows
            .iter()
            .any(|(of, key, _)| *of == file && line.replace(':', ",").contains(&key.replace(':', ",")))
        {
            for (column, range) in columns.iter().zip(fields) {
                if !drive.exempt.column(file, column) {
                    let key: String = line.chars().take(24).collect();
                    cells.push(cell(format!("{file}/{key}…/{column}"), at + range.start, &line[range]));
                }
            }
        }
        at += line.len();
    }
    cells
}

/// Where the fields of a line stand, without their quotes.
fn fields(line: &str) -> Vec<std::ops::Range<usize>> {
    let (mut ranges, mut start, mut quoted) = (Vec::new(), 0, false);
    for (at, byte) in line.bytes().enumerate().chain([(line.len(), b',')]) {
        match byte {
            b'"' => quoted = !quoted,
            b',' if !quoted => {
                let inside = usize::from(line[start..at].starts_with('"') && at > start + 1);
                ranges.push(start + inside..at - inside);
                start = at + 1;
            }
            _ => {}
        }
    }
    ranges
}

fn cell(name: String, start: usize, value: &str) -> Cell {
    Cell { name, range: start..start + value.len(), value: value.to_owned() }
}

/// xorshift64*: the same numbers in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 8
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }
}
