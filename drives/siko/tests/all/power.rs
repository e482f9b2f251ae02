//! The simulated drive's EEPROM as a file, and how its switches affect a link.

use std::path::PathBuf;

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Instant, NodeId};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::{DipSwitches, NonVolatile, Setup, SimulatedDrive};

use super::support::{NODE, Rig};

impl Rig {
    fn booted(drive: SimulatedDrive) -> Self {
        let mut rig = Rig::of(drive);
        rig.pass(0);
        rig
    }

    fn set(&mut self, index: u16, sub: u8, data: &[u8]) {
        assert_eq!(self.write(index, sub, data), None);
    }
}

/// A file in the temporary folder, deleted after the test.
struct File(PathBuf);

impl File {
    fn new(name: &str) -> Self {
        let file = File(std::env::temp_dir().join(format!("siko-ag03-1-{}-{name}", std::process::id())));
        let _ = std::fs::remove_file(&file.0);
        file
    }

    fn drive(&self) -> SimulatedDrive {
        SimulatedDrive::with_eeprom(Instant::ZERO, Setup::new(&MODEL, NODE), &self.0).unwrap()
    }

    fn read(&self) -> NonVolatile {
        NonVolatile::from_text(&MODEL, &std::fs::read_to_string(&self.0).unwrap()).unwrap()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn the_eeprom_survives_as_a_file() {
    let file = File::new("survives");
    let mut rig = Rig::booted(file.drive());
    rig.set(0x2410, 1, &[7, 0]);
    rig.set(0x2450, 0, &[50]);
    assert_eq!(file.read().eeprom[&od::MOTOR_PARAMETER_SET.controller_parameter_p().address()], 7);
    rig.enable();
    rig.travel_to(100);
    rig.pass(100);
    assert_eq!(file.read().position, 0, "the position is written at rest");
    rig.pass(5000);
    assert_eq!(file.read().position, 100);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.internal_error = true));
    drop(rig);
    let again = Rig::booted(file.drive());
    again.see(|drive, now| {
        assert_eq!(drive.stored(od::MOTOR_PARAMETER_SET.controller_parameter_p()), 7);
        assert_eq!(drive.stored(od::INCHING_2_OFFSET).0, 100, "it is not stored");
        assert_eq!(drive.position(now), 100);
        assert_eq!(drive.stored(od::PRE_DEFINED_ERROR_FIELD.len_object()), 1);
        assert!(drive.eeprom_trouble().is_none());
    });
}

#[test]
fn a_new_file_begins_with_what_the_setup_says() {
    let file = File::new("begins");
    let setup =
        Setup { non_volatile: NonVolatile { position: -77, ..NonVolatile::default() }, ..Setup::new(&MODEL, NODE) };
    let drive = SimulatedDrive::with_eeprom(Instant::ZERO, setup.clone(), &file.0).unwrap();
    assert_eq!((drive.position(Instant::ZERO), file.read().position), (-77, -77));
    let other = Setup { non_volatile: NonVolatile::default(), ..setup };
    let drive = SimulatedDrive::with_eeprom(Instant::ZERO, other, &file.0).unwrap();
    assert_eq!(drive.position(Instant::ZERO), -77, "what is in the file counts");
}

#[test]
fn files_that_are_torn_or_foreign_are_refused_and_left_alone() {
    let file = File::new("refused");
    drop(file.drive());
    let whole = std::fs::read(&file.0).unwrap();
    for (bytes, expected) in [
        (whole[..whole.len() / 2].to_vec(), "cut off or changed"),
        (b"position 5\n".to_vec(), "not the EEPROM of a simulated AG03/1"),
        (vec![0xFF, 0xFE, 0x00], "not the EEPROM of a simulated AG03/1"),
        (Vec::new(), "empty, as after a power failure; remove it"),
    ] {
        std::fs::write(&file.0, &bytes).unwrap();
        let error =
            SimulatedDrive::with_eeprom(Instant::ZERO, Setup::new(&MODEL, NODE), &file.0).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{}: {expected}", file.0.display())), "{error}");
        assert_eq!(std::fs::read(&file.0).unwrap(), bytes);
    }
    let folder = std::env::temp_dir();
    let error = SimulatedDrive::with_eeprom(Instant::ZERO, Setup::new(&MODEL, NODE), &folder).unwrap_err().to_string();
    assert!(error.starts_with(&folder.display().to_string()), "{error}");
}

#[test]
fn a_file_that_cannot_be_written_is_told_of() {
    let folder = File::new("folder");
    let nowhere = folder.0.join("eeprom");
    let drive = SimulatedDrive::with_eeprom(Instant::ZERO, Setup::new(&MODEL, NODE), &nowhere).unwrap();
    let trouble = drive.eeprom_trouble().unwrap().to_string();
    assert!(trouble.starts_with(&nowhere.display().to_string()), "{trouble}");
}

/// A link that filters frames must know what concerns the drive, and when that changes.
#[test]
fn what_concerns_the_drive_follows_its_switches() {
    let mut rig = Rig::new();
    let known = |rig: &mut Rig| rig.see(|drive, _| (drive.generation(), drive.concerns()));
    let control = |node: u8| CobId::of_node(0x200, NodeId::new(node).unwrap());
    let (first, concerns) = known(&mut rig);
    assert!(concerns.contains(&control(5)) && !concerns.contains(&control(6)));
    rig.drive.lock().unwrap().set_switches(DipSwitches::for_node(NodeId::literal(6)));
    assert_eq!(known(&mut rig), (first, concerns));
    rig.see(SimulatedDrive::power_cycle);
    let (second, concerns) = known(&mut rig);
    assert!(concerns.contains(&control(6)) && !concerns.contains(&control(5)));
    assert_ne!(first, second);
}
