//! Drives of real data sheets, which are not part of this project: `LEXICAN_CORPUS` names a folder with them. Each is
//! described by its data sheet, simulated, and moved.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{env, fs};

use lexican_driver::{Any, Description, Drive, Error, Mode, Outcome, VelocityOutcome};
use lexican_eds::{Input, Source, drive, load, model};
use lexican_runtime::host::VirtualBus;
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::{Duration, Instant, NodeId};

use super::VirtualDevice;

#[test]
fn every_drive_of_the_corpus_is_moved_by_its_data_sheet() {
    let Some(folder) = env::var_os("LEXICAN_CORPUS") else {
        eprintln!("SKIPPED: LEXICAN_CORPUS names no folder of data sheets");
        return;
    };
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    let (mut drives, mut moved) = (0, 0);
    let mut failed: BTreeMap<String, usize> = BTreeMap::new();
    for path in &files {
        let bytes = fs::read(path).expect("the corpus is readable");
        let input = Input::new(Source::from_bytes(path.to_string_lossy(), &bytes));
        let (device, _) = load(&input);
        if ![0x6040, 0x6041, 0x6060].iter().all(|index| device.object(*index).is_some()) {
            continue;
        }
        drives += 1;
        let result = match Description::of_data_sheet(&input) {
            Err(_) => Err(lacking(&device)),
            Ok(description) => {
                assert_eq!(description.findings(), [""; 0], "{}", path.display());
                moves(&device, description)
            }
        };
        match result {
            Ok(()) => moved += 1,
            Err(why) => {
                println!("{}: {why}", path.display());
                *failed.entry(why).or_default() += 1;
            }
        }
    }
    println!("{moved} of {drives} drives, of {} files, move; the others:", files.len());
    failed.iter().for_each(|(why, count)| println!("{count:4} {why}"));
    assert!(moved > 0);
}

/// What keeps a data sheet from being that of a drive.
fn lacking(device: &model::Device) -> String {
    let (_, findings) = drive::read(device);
    let errors = findings.iter().filter(|finding| finding.severity == lexican_eds::Severity::Error);
    errors.map(|finding| finding.message.clone()).collect::<Vec<_>>().join("; ")
}

fn moves(device: &model::Device, description: &'static Description) -> Result<(), String> {
    // Tools work a node-ID into COB-IDs, most often 1: here it is another one.
    let (bus, node) = (VirtualBus::with_bit_rate(500), NodeId::literal(5));
    bus.attach(VirtualDevice::power_on(Instant::ZERO, node, device));
    bus.advance(Duration::from_millis(1));
    let travel = || -> Result<String, Error> {
        let mut drive = Drive::<_, Any>::connect_described_unprotected(bus.link(), node, description)?;
        // At a profile velocity of 0, which some data sheets have by default, no drive moves.
        for (index, value) in [(0x6081, 1000), (0x6083, 10_000), (0x6084, 10_000)] {
            let object = Object::<u32, Rw>::new(index, 0x00);
            if drive.read(object).is_ok_and(|now| now == 0) {
                drive.write(object, value)?;
            }
        }
        let positions = description.code_of(Mode::Positioning).is_some();
        drive.set_mode(if positions { Mode::Positioning } else { Mode::Velocity })?;
        drive.enable()?;
        let outcome = match positions {
            true => match drive.move_to(100)? {
                Outcome::Reached { position: 90..=110 } => String::new(),
                other => format!("{other:?}"),
            },
            false => match drive.run_at(100)? {
                VelocityOutcome::Reached { .. } => String::new(),
                other => format!("{other:?}"),
            },
        };
        drive.disable()?;
        Ok(outcome)
    };
    match travel() {
        Ok(outcome) if outcome.is_empty() => Ok(()),
        Ok(outcome) => Err(outcome),
        Err(error) => Err(error.to_string()),
    }
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the corpus is readable") {
        let path = entry.expect("the corpus is readable").path();
        let is = |kind: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(kind));
        match path.is_dir() {
            true => collect(&path, files),
            false if is("eds") || is("dcf") => files.push(path),
            false => {}
        }
    }
}
