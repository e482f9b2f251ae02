//! The simulated drive's supply, switches, LEDs and EEPROM: chapters 2.4, 2.5, 7.10, 7.13 and 7.14.

use std::path::PathBuf;

use lexican_runtime::host::Node;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Instant, NodeId};
use siko_ag03_1::fault::FaultKind;
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::controller::Motor;
use siko_ag03_1::sim::{BusLed, DipSwitches, Lights, NonVolatile, Restore, Setup, SimulatedDrive, StatusLed};
use siko_ag03_1::state::State;
use siko_ag03_1::words::system;

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

#[test]
fn a_drive_without_supply_is_dark_and_silent() {
    let mut rig = Rig::new();
    rig.set(0x1017, 0, &[100, 0]);
    rig.see(SimulatedDrive::switch_off);
    assert_eq!(rig.see(|drive, now| drive.lights(now)), Lights { status: false, bus: false });
    assert!(rig.pass(1000).is_empty());
    assert!(rig.ask("605#4000100000000000").is_empty());
    assert_eq!(rig.see(|drive, _| (drive.status_led(), drive.bus_led())), (StatusLed::Off, BusLed::Off));
    rig.see(SimulatedDrive::switch_on);
    assert_eq!(rig.pass(1000), ["705#00"], "the heartbeat is not stored");
    assert_eq!(rig.see(|drive, _| (drive.status_led(), drive.bus_led())), (StatusLed::On, BusLed::Blinks));
}

#[test]
fn the_supply_of_the_control_is_what_keeps_the_drive_on() {
    let mut rig = Rig::new();
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.control_supply_100mv = 99));
    assert!(!rig.see(|drive, _| drive.is_on()));
    rig.see(SimulatedDrive::switch_on);
    assert!(!rig.see(|drive, _| drive.is_on()), "switched on, but not supplied");
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.control_supply_100mv = 240));
    assert_eq!(rig.pass(0), ["705#00"]);
    let mut unsupplied = Setup::new(&MODEL, NODE);
    unsupplied.inputs.control_supply_100mv = 0;
    assert!(Rig::booted(SimulatedDrive::power_on(Instant::ZERO, unsupplied)).pass(1000).is_empty());
}

#[test]
fn a_shaft_that_loses_its_supply_runs_out_and_is_not_forgotten() {
    let mut rig = Rig::new();
    rig.enable();
    rig.travel_to(5000);
    rig.pass(1000);
    let there = rig.see(|drive, now| drive.position(now));
    rig.see(SimulatedDrive::switch_off);
    // 800 increments/s, and 3200/s2 against it: 250 ms and 100 increments.
    rig.pass(125);
    assert_eq!(rig.see(|drive, now| drive.position(now)), there + 75);
    rig.see(SimulatedDrive::switch_on);
    rig.pass(1000);
    assert_eq!(rig.see(|drive, now| (drive.position(now), drive.state())), (there + 100, State::SwitchOnDisabled));
}

/// "In position" refers to the travel before until then, and to 607Ah afterwards, which is 0 again.
#[test]
fn a_reset_forgets_the_travel_before() {
    let mut rig = Rig::new();
    rig.enable();
    rig.travel_to(100);
    rig.pass(5000);
    let in_position =
        |rig: &Rig| rig.see(|drive, now| drive.controller().system_status(now)) & system::IN_POSITION != 0;
    assert!(in_position(&rig));
    rig.ask("000#8105");
    rig.pass(1000);
    assert!(!in_position(&rig));
}

#[test]
fn a_shaft_that_brakes_when_it_loses_its_supply_runs_out() {
    let mut rig = Rig::new();
    rig.enable();
    rig.travel_to(5000);
    rig.pass(1000);
    rig.ask("205#0B01");
    let there = rig.see(|drive, now| drive.position(now));
    rig.see(SimulatedDrive::switch_off);
    rig.pass(1000);
    assert_eq!(rig.see(|drive, now| drive.position(now)), there + 100);
}

#[test]
fn a_reset_under_way_releases_the_motor() {
    for command in [0x81, 0x82] {
        let mut rig = Rig::new();
        rig.enable();
        rig.travel_to(5000);
        rig.pass(1000);
        let there = rig.see(|drive, now| drive.position(now));
        assert!(rig.ask(&format!("000#{command:02X}05")).contains(&"705#00".into()));
        assert_eq!(rig.see(|drive, now| drive.controller().motor(now)), Motor::Released);
        rig.pass(1000);
        assert_eq!(rig.see(|drive, now| drive.position(now)), there + 100);
    }
}

/// Two parameters, one of each set, after restoring by switches.
#[track_caller]
fn restores(which: Restore, standard: u32, controller: u32) {
    let mut rig = Rig::new();
    rig.set(0x6067, 0, &[11, 0]);
    rig.set(0x2410, 4, &[51]);
    rig.set(0x2100, 0, &[9]);
    rig.enable();
    rig.travel_to(100);
    rig.pass(5000);
    rig.see(SimulatedDrive::switch_off);
    rig.see(|drive, _| drive.set_switches(drive.switches().with_restore(Some(which))));
    rig.see(SimulatedDrive::switch_on);
    assert!(rig.pass(1000).is_empty(), "its switches set no address");
    assert_eq!(rig.see(|drive, _| (drive.status_led(), drive.bus_led())), (StatusLed::Alternates, BusLed::Alternates));
    let lights: Vec<_> = (0..4)
        .map(|_| {
            rig.pass(200);
            rig.see(|drive, now| drive.lights(now))
        })
        .collect();
    assert!(lights.iter().all(|lights| lights.status != lights.bus), "{lights:?}");
    assert!(lights.windows(2).all(|pair| pair[0].status != pair[1].status), "{lights:?}");
    rig.see(SimulatedDrive::switch_off);
    rig.see(|drive, _| drive.set_switches(drive.switches().with_restore(None).with_node(NODE)));
    rig.see(SimulatedDrive::switch_on);
    assert_eq!(rig.pass(0), ["705#00"]);
    let parameters = rig.see(|drive, _| (drive.stored(od::POSITION_WINDOW).0, drive.parameters().a_pos));
    assert_eq!(parameters, (standard as u16, controller as u8), "{which:?}");
    assert_eq!(rig.see(|drive, now| drive.position(now)), 100, "the position is no parameter");
    assert_eq!(rig.see(|drive, _| drive.bit_rate()), 250_000, "7.12.2.10: neither is the bit rate");
}

#[test]
fn factory_settings_are_restored_by_the_switches() {
    restores(Restore::All, 10, 50);
    restores(Restore::Standard, 10, 51);
    restores(Restore::Controller, 11, 50);
}

#[test]
fn a_new_bit_rate_holds_from_the_next_initialisation_on() {
    let mut rig = Rig::new();
    assert_eq!(rig.see(|drive, _| drive.bit_rate()), 500_000);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus_bit_rate = Some(500_000)));
    rig.set(0x2100, 0, &[7]);
    assert_eq!(rig.see(|drive, _| drive.bit_rate()), 500_000);
    assert!(rig.ask("000#8205").is_empty(), "it boots, but at 125 kbit/s it is not heard here");
    assert_eq!(rig.see(|drive, _| drive.bit_rate()), 125_000);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus_bit_rate = Some(125_000)));
    assert_eq!(rig.pass(0), ["705#00"]);
}

#[test]
fn the_bus_led_tells_the_nmt_state_and_the_status_led_the_first_fault() {
    let mut rig = Rig::new();
    // What is lit in each 100 ms, from power-on.
    let lights = |rig: &mut Rig, look: fn(siko_ag03_1::sim::Lights) -> bool| -> String {
        let mut seen = String::new();
        for _ in 0..12 {
            let lit = rig.see(|drive, now| look(drive.lights(now)));
            seen.push(if lit { '#' } else { '.' });
            rig.pass(100);
        }
        seen
    };
    assert_eq!(lights(&mut rig, |lights| lights.bus), "##..##..##..");
    for (command, state, expected) in [
        (1, NmtState::Operational, "############"),
        (2, NmtState::Stopped, "..##........"),
        (0x80, NmtState::PreOperational, "##..##..##.."),
    ] {
        rig.ask(&format!("000#{command:02X}05"));
        assert_eq!(rig.see(|drive, _| drive.nmt_state()), state);
        assert_eq!(lights(&mut rig, |lights| lights.bus), expected);
    }
    assert_eq!(lights(&mut rig, |lights| lights.status), "############");
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.output_stage_supply_100mv = 0));
    assert_eq!(lights(&mut rig, |lights| lights.status), "............");
    // Fault B and then fault D: the first one counts.
    rig.see(|drive, now| {
        drive.set_inputs(now, |inputs| inputs.force(FaultKind::ShaftBlocked));
        drive.set_inputs(now, |inputs| inputs.temperature_100mdegc = 950);
    });
    assert_eq!(rig.see(|drive, _| drive.status_led()), StatusLed::Blinks(2));
    let seen = [lights(&mut rig, |lights| lights.status), lights(&mut rig, |lights| lights.status)].concat();
    assert!(seen.contains("..........##..##") || seen.contains("##..##.........."), "{seen}");
}

/// A file in the folder for temporary ones, which goes when the test is over.
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

/// What a link that leaves out other frames has to know, and when.
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
