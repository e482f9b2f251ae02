//! Reading a data sheet: ours from bytes to model and findings, against what others do with the same text.
//!
//! - lexican decodes the bytes, reads the file with positions, builds the model and applies all rules.
//! - rust-ini only splits the text into sections and keys: what ours does as its first step.
//! - canopen-host keeps numbers, and passes over texts, DOMAINs, CompactSubObj, limits and lists of objects. It
//!   gets text that is decoded already, and has no rules and no positions.
//! - python-canopen reads the file from disk, and builds a dictionary without rules.

pub(crate) mod peak;
pub(crate) mod python;
mod readers;
mod synthetic;

use std::hint::black_box;
use std::path::{Path, PathBuf};

use lexican_eds::model;

use crate::measure::{self, Contender, Figure};
use crate::report::{self, Goals};
use readers::{canopen_host, lexican, rust_ini, text};

const ROUNDS: usize = 60;

/// The size of python-canopen's largest example, which the figures that we know are quoted for.
const SIZE: usize = 131_614;

/// Where a corpus of real files lies, for the one of them that is nearest to that size.
const CORPUS: &str = "LEXICAN_CORPUS";

pub(crate) fn run(path: Option<&str>) {
    let mut goals = Goals::default();
    report::head("EDS, one file");
    if let Some(path) = path.map(PathBuf::from).or_else(of_corpus) {
        compare(&path, &mut goals);
    }
    match synthesised(SIZE) {
        Ok(path) => compare(&path, &mut goals),
        Err(error) => println!("the synthesised file cannot be written: {error}"),
    }
    println!("\nPeak memory beyond the file's own bytes, in multiples of its size");
    for size in [SIZE, 8 * SIZE, 16 * SIZE] {
        match synthesised(size) {
            Ok(path) => memory(&path, &mut goals),
            Err(error) => println!("the synthesised file cannot be written: {error}"),
        }
    }
    goals.print();
}

/// The EDS nearest to [`SIZE`]; of two, the first by name.
fn of_corpus() -> Option<PathBuf> {
    let Some(folder) = std::env::var_os(CORPUS) else {
        println!("no real file: name one, or a folder of them in {CORPUS}");
        return None;
    };
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    files.into_iter().min_by_key(|(len, _)| len.abs_diff(SIZE as u64)).map(|(_, path)| path)
}

fn collect(folder: &Path, files: &mut Vec<(u64, PathBuf)>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("eds")) {
            files.push((entry.metadata().map_or(0, |data| data.len()), path));
        }
    }
}

fn synthesised(size: usize) -> std::io::Result<PathBuf> {
    let path = std::env::temp_dir().join(format!("lexican-bench-{size}.eds"));
    std::fs::write(&path, synthetic::data_sheet(size))?;
    Ok(path)
}

fn compare(path: &Path, goals: &mut Goals) {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => return println!("{}: {error}", path.display()),
    };
    let (device, findings) = lexican(&bytes);
    let text = text(&bytes).into_owned();
    let mut contenders = vec![{
        let bytes = bytes.clone();
        Contender::new(report::OURS, move || drop(black_box(lexican(black_box(&bytes)))))
    }];
    let mut objects = vec![format!("lexican {} with {} findings", values(&device), findings.iter().count())];
    match rust_ini(&text) {
        Ok(_) => {
            let text = text.clone();
            contenders.push(Contender::new("rust-ini 0.21.3", move || drop(black_box(rust_ini(black_box(&text))))));
        }
        Err(error) => println!("{name}: rust-ini refuses it: {error}"),
    }
    match canopen_host(&text) {
        Ok(eds) => {
            objects.push(format!("canopen-host {}", eds.objects.len()));
            let text = text.clone();
            let once = move || drop(black_box(canopen_host(black_box(&text))));
            contenders.push(Contender::new("canopen-host 0.6.1", once));
        }
        Err(error) => println!("{name}: canopen-host refuses it: {error}"),
    }
    match python::contender(path) {
        Ok(python) => contenders.push(python),
        Err(reason) => println!("{name}: without python-canopen: {reason}"),
    }
    let figures = measure::race(vec![contenders], ROUNDS);
    report::rows(&shortened(&name), bytes.len(), &figures);
    println!("{:<34} {} bytes; values found: {}", "", bytes.len(), objects.join(", "));
    judge(&name, &figures, goals);
}

fn judge(name: &str, figures: &[Figure], goals: &mut Goals) {
    let tokenising = figures.iter().find(|figure| figure.name.starts_with("rust-ini"));
    if let (Some(ours), Some(tokenising)) = (report::ours(figures), tokenising) {
        let measured = ours.best_ns / tokenising.best_ns;
        goals.at_most(format!("{name}: reading, checking and model against rust-ini alone"), measured, 2.5, " times");
    }
}

fn memory(path: &Path, goals: &mut Goals) {
    let size = std::fs::metadata(path).map_or(1, |data| data.len());
    for reader in ["lexican", "rust-ini", "canopen-host"] {
        let Some(peak) = peak::measured(reader, path) else {
            println!("{size} bytes: this system does not report the peak of {reader}");
            continue;
        };
        let multiple = peak as f64 / size as f64;
        println!("{size:>9} bytes  {reader:<14} {peak:>10}  {multiple:>5.1}");
        if reader == "lexican" {
            goals.at_most(format!("peak memory for {size} bytes"), multiple, 30.0, " times its size");
        }
    }
}

fn shortened(name: &str) -> String {
    let skipped = name.chars().count().saturating_sub(33);
    if skipped == 0 { name.to_owned() } else { format!("…{}", name.chars().skip(skipped).collect::<String>()) }
}

/// How many entries with a value a device has.
fn values(device: &model::Device) -> usize {
    device.entries().count()
}
