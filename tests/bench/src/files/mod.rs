//! Real files: how many of them a reader takes, and how much of what they describe it keeps.
//!
//! What a file describes is counted by [`described`], which knows nothing of any reader: the values by index and
//! sub-index that its sections stand for. A reader that refuses a file keeps nothing of it. What each does besides,
//! such as ours its rules and positions, is said in [`crate::eds`]; the times here are those of all files together,
//! each read once.

mod described;
mod outside;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lexican_eds::{Input, Source};

use described::{Address, Reading, described};

/// All files, read by one reader.
struct Figure {
    name: &'static str,
    readings: Vec<Reading>,
    time: Duration,
}

pub(crate) fn run(folder: &str) {
    let mut files = Vec::new();
    collect(Path::new(folder), &mut files);
    files.sort();
    if files.is_empty() {
        return println!("{folder}: no EDS or DCF file in it");
    }
    let described: Vec<_> = files.iter().map(|path| described(&text(path))).collect();
    let values: usize = described.iter().map(BTreeSet::len).sum();
    let mut figures = vec![within("lexican", &files, lexican), within("canopen-host 0.6.1", &files, canopen_host)];
    for (name, figure) in
        [("python-canopen 2.4.1", outside::python(&files)), ("node-canopen 6.2.1", outside::node(&files))]
    {
        match figure {
            Ok((readings, time)) => figures.push(Figure { name, readings, time }),
            Err(reason) => println!("without {name}: {reason}"),
        }
    }
    println!("| reader | files read of {} | values kept of {values} | all files, ms |", files.len());
    println!("| --- | --- | --- | --- |");
    for figure in &figures {
        let read = figure.readings.iter().flatten().count();
        let kept: usize =
            figure.readings.iter().zip(&described).map(|(reading, all)| kept(reading.as_ref(), all)).sum();
        println!("| {} | {read} | {kept} | {} |", figure.name, figure.time.as_millis());
    }
}

fn kept(reading: Option<&BTreeSet<Address>>, described: &BTreeSet<Address>) -> usize {
    reading.map_or(0, |reading| reading.intersection(described).count())
}

#[expect(clippy::disallowed_methods, reason = "taking the time is what a benchmark is for")]
fn within(name: &'static str, files: &[PathBuf], read: fn(&Path) -> Reading) -> Figure {
    let begin = Instant::now();
    let readings = files.iter().map(|path| read(path)).collect();
    Figure { name, readings, time: begin.elapsed() }
}

fn lexican(path: &Path) -> Reading {
    let bytes = fs::read(path).ok()?;
    let (device, findings) = lexican_eds::load(&Input::new(Source::from_bytes("bench.eds", &bytes)));
    (!findings.has_errors()).then(|| device.entries().map(|entry| (entry.index, entry.sub)).collect())
}

fn canopen_host(path: &Path) -> Reading {
    let eds = canopen_host::eds::Eds::parse(&text(path)).ok()?;
    Some(eds.objects.iter().map(|object| (object.address.index, object.address.subindex)).collect())
}

/// For those who do not decode: every byte that is no UTF-8 costs a replacement character.
fn text(path: &Path) -> String {
    fs::read(path).map_or_else(|_| String::new(), |bytes| String::from_utf8_lossy(&bytes).into_owned())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let is = |wanted| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted));
        if path.is_dir() {
            collect(&path, files);
        } else if is("eds") || is("dcf") {
            files.push(path);
        }
    }
}
