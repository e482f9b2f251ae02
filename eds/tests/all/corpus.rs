//! Tests on real files of many vendors, which are not part of this project: see `corpus_files`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fs, thread};

use crate::corpus_files::corpus;
use lexican_eds::fix::fix;
use lexican_eds::model::Device;
use lexican_eds::{Diagnostic, Diagnostics, Input, Source, load, write, xdd};

#[test]
fn every_data_sheet_is_read_and_every_section_is_counted() {
    let Some(files) = corpus() else { return };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let data_sheets: usize = thread::scope(|scope| {
        let one_in = |start: usize| {
            let files = files.iter().skip(start).step_by(threads);
            scope.spawn(move || files.filter(|path| is_read(path)).count())
        };
        let running: Vec<_> = (0..threads).map(one_in).collect();
        running.into_iter().map(|thread| thread.join().expect("the reasons are above")).sum()
    });
    println!("{data_sheets} of {} files are data sheets, and all were read", files.len());
    assert!(data_sheets > 0);
}

/// Whether a file is a data sheet; if so, checks everything that must hold for it.
fn is_read(path: &Path) -> bool {
    let bytes = fs::read(path).expect("the corpus is readable");
    let input = Input::new(Source::from_bytes(path.to_string_lossy(), &bytes));
    let (device, diagnostics) = load(&input);
    assert!(!diagnostics.has_errors(), "{}:\n{}", path.display(), diagnostics.render(&input));
    if xdd::is_xml(&input.eds) {
        survives_writing(path, device, xdd::xdc);
        return true;
    }
    compare(path, &count(input.eds.text()), &device, &diagnostics);
    survives_writing(path, device.clone(), xdd::xdc);
    survives_writing(path, device, write::dcf);
    survives_formatting(path, &input);
    survives_fixing(path, &input, &diagnostics);
    true
}

/// The content of a file, counted independently of the reader: the sections `[xxxx]` and `[xxxxsubN]`.
#[derive(Default)]
struct Count {
    objects: BTreeSet<u16>,
    subs: BTreeSet<(u16, u8)>,
    compact: BTreeMap<u16, u16>,
}

fn count(text: &str) -> Count {
    let mut count = Count::default();
    let mut object = None;
    for line in text.split(['\r', '\n']).map(str::trim) {
        if let Some(name) = line.strip_prefix('[') {
            let name: String = name.split(']').next().unwrap_or_default().split_whitespace().collect();
            let name = name.to_ascii_lowercase();
            object = None;
            match name.split_once("sub") {
                Some((index, sub)) => {
                    if let (Some(index), Some(sub)) = (hex(index, 4), hex(sub, 2)) {
                        count.objects.insert(index);
                        count.subs.insert((index, sub as u8));
                    }
                }
                None => {
                    if let Some(index) = hex(&name, 4) {
                        count.objects.insert(index);
                        object = Some(index);
                    }
                }
            }
        } else if let (Some(index), Some((key, value))) = (object, line.split_once('=')) {
            let value = value.trim();
            if key.trim().eq_ignore_ascii_case("CompactSubObj") && !value.is_empty() {
                let number = value.strip_prefix("0x").map_or_else(|| value.parse(), |hex| u16::from_str_radix(hex, 16));
                count.compact.entry(index).or_insert(number.unwrap_or(0));
            }
        }
    }
    count
}

fn hex(text: &str, digits: usize) -> Option<u16> {
    if text.is_empty() || text.len() > digits { None } else { u16::from_str_radix(text, 16).ok() }
}

fn compare(path: &Path, count: &Count, device: &Device, diagnostics: &Diagnostics) {
    let read: BTreeSet<u16> = device.objects.iter().map(|object| object.index).collect();
    assert_eq!(read, count.objects, "objects of {}", path.display());
    for object in &device.objects {
        let compact = count.compact.get(&object.index).copied().unwrap_or(0);
        let subs = count.subs.range((object.index, 0)..=(object.index, 0xFF)).map(|&(_, sub)| sub);
        let mut expected: BTreeSet<u8> = subs.collect();
        match compact {
            0 => {}
            255 => {
                // One more than possible, which is reported.
                assert!(diagnostics.iter().any(|finding| finding.code == "eds::compact-count"), "{}", path.display());
                expected.extend(0..=0xFE);
            }
            _ => expected.extend(0..=compact as u8),
        }
        if !object.kind.has_subs() {
            expected.insert(0);
        }
        let read: BTreeSet<u8> = object.entries.iter().map(|entry| entry.sub).collect();
        assert_eq!(read, expected, "sub-indices of {:04X} in {}", object.index, path.display());
    }
}

fn survives_writing(path: &Path, mut device: Device, write: fn(&Device) -> String) {
    let (mut read, _) = load(&Input::new(Source::new("written", write(&device))));
    device.clear_spans();
    read.clear_spans();
    assert!(read == device, "{} is another device after writing", path.display());
}

fn survives_formatting(path: &Path, input: &Input) {
    let once = lexican_eds::fmt::normalise(&input.eds);
    let again = lexican_eds::fmt::normalise(&Source::new("again", once.as_str()));
    assert!(once == again, "{} is formatted differently the second time", path.display());
    let read = |source: Source| {
        let (mut device, _) = load(&Input::new(source));
        device.clear_spans();
        device
    };
    assert!(read(Source::new("once", once)) == read(input.eds.clone()), "{} is another device", path.display());
}

/// Nothing is left to fix, nothing else is found, and a file without such a finding stays unchanged.
fn survives_fixing(path: &Path, input: &Input, before: &Diagnostics) {
    let fixed = fix(input);
    let of_code = |found: &[Diagnostic], code: &str| found.iter().filter(|finding| finding.code == code).count();
    for finding in fixed.left.iter() {
        let (count, code) = (of_code(&fixed.left, finding.code), finding.code);
        assert!(count <= of_code(before, code), "{code} in {}", path.display());
        assert!(finding.fix.is_none(), "{code} is left in {}", path.display());
    }
    assert_eq!(fixed.fixed.is_empty(), fixed.input.eds.text() == input.eds.text(), "{}", path.display());
    assert_eq!(fix(&fixed.input).input, fixed.input, "{} is fixed differently the second time", path.display());
    for (code, count) in fixed.fixed {
        println!("{code}: {count} fixed in {}", path.display());
    }
}
