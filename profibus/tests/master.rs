//! The simulated slave with the master of `profirust`, in virtual time.

mod support;

use lexican_profibus::virtual_bus::{MASTER, SlaveId, VirtualBus};
use lexican_profibus::{Identity, Slave, State};
use lexican_runtime::Duration;
use profirust::dp::{DiagnosticFlags, PeripheralEvent, PeripheralOptions};
use support::{Echo, IDENTITY};

fn options() -> PeripheralOptions<'static> {
    PeripheralOptions {
        ident_number: IDENTITY.ident,
        max_tsdr: 100,
        user_parameters: Some(&[]),
        config: Some(IDENTITY.configuration),
        ..PeripheralOptions::default()
    }
}

fn attach(bus: &mut VirtualBus<Echo>, address: u8, identity: Identity) -> SlaveId {
    let slave = Slave::new(address, identity, bus.bit_rate(), Echo::default());
    bus.attach(slave, options(), (4, 4))
}

fn running() -> (VirtualBus<Echo>, SlaveId) {
    let mut bus = VirtualBus::new();
    let id = attach(&mut bus, 7, IDENTITY);
    assert!(bus.exchange(id));
    (bus, id)
}

#[test]
fn a_slave_comes_up_and_exchanges_data() {
    let (mut bus, id) = running();
    assert_eq!(bus.events(id), [PeripheralEvent::Online, PeripheralEvent::Configured]);
    bus.peripheral(id).unwrap().pi_q_mut().copy_from_slice(&[1, 2, 3, 4]);
    assert!(bus.exchange(id));
    assert_eq!(bus.slave(id).application().last(), [1, 2, 3, 4]);
    assert_eq!(bus.peripheral(id).unwrap().pi_i(), [0xFE, 0xFD, 0xFC, 0xFB]);
}

#[test]
fn several_slaves_share_the_line() {
    let mut bus = VirtualBus::new();
    let ids: Vec<SlaveId> = (10..16).map(|address| attach(&mut bus, address, IDENTITY)).collect();
    for (number, id) in (1..).zip(&ids) {
        assert!(bus.exchange(*id));
        bus.peripheral(*id).unwrap().pi_q_mut().fill(number);
    }
    bus.run(Duration::from_millis(50));
    for (number, id) in (1..).zip(&ids) {
        assert_eq!(bus.slave(*id).application().last(), [number; 4]);
        assert_eq!(bus.peripheral(*id).unwrap().pi_i(), [!number; 4]);
    }
    // One that the master does not know is in nobody's way.
    let stranger = Slave::new(20, IDENTITY, bus.bit_rate(), Echo::default());
    let stranger = bus.attach_unknown(stranger);
    bus.run(Duration::from_millis(50));
    assert_eq!(bus.slave(stranger).state(), State::WaitParameters);
    assert!(ids.iter().all(|id| bus.slave(*id).state() == State::DataExchange));
}

/// Whether an answer that was lost is asked for again, and given without acting twice.
#[test]
fn a_lost_answer_is_repeated() {
    let (mut bus, id) = running();
    let acted = bus.slave(id).application().outputs.len() as u64;
    let before = bus.exchanges(id);
    bus.lose_answers(id, 0..1);
    assert!(bus.exchange(id) && bus.exchange(id));
    let exchanged = bus.exchanges(id) - before;
    assert_eq!(bus.slave(id).application().outputs.len() as u64 - acted, exchanged);
    assert_eq!((bus.events(id).len(), bus.slave(id).state()), (2, State::DataExchange));
}

#[test]
fn a_slave_that_is_cut_off_comes_back() {
    let (mut bus, id) = running();
    bus.peripheral(id).unwrap().pi_q_mut().fill(1);
    assert!(bus.exchange(id));
    bus.events(id);
    bus.set_connected(id, false);
    bus.run(Duration::from_millis(150));
    assert_eq!(bus.events(id), [PeripheralEvent::Offline]);
    // Its watchdog has taken the outputs back.
    assert_eq!((bus.slave(id).state(), bus.slave(id).application().last()), (State::WaitParameters, &[0; 4][..]));
    bus.set_connected(id, true);
    assert!(bus.exchange(id));
    assert_eq!(bus.events(id), [PeripheralEvent::Online, PeripheralEvent::Configured]);
    assert_eq!(bus.slave(id).application().last(), [1; 4]);
}

#[test]
fn without_a_master_the_outputs_become_zero() {
    let (mut bus, id) = running();
    bus.peripheral(id).unwrap().pi_q_mut().fill(1);
    assert!(bus.exchange(id));
    bus.set_master_online(false);
    bus.run(Duration::from_millis(99));
    assert_eq!(bus.slave(id).application().last(), [1; 4]);
    bus.run(Duration::from_millis(2));
    assert_eq!((bus.slave(id).state(), bus.slave(id).application().last()), (State::WaitParameters, &[0; 4][..]));
    bus.set_master_online(true);
    assert!(bus.run_until(Duration::from_secs(1), |bus| bus.slave(id).state() == State::DataExchange));
}

#[test]
fn another_ident_number_is_never_taken() {
    let mut bus = VirtualBus::new();
    let id = attach(&mut bus, 7, Identity { ident: 0x4321, ..IDENTITY });
    bus.run(Duration::from_millis(200));
    let peripheral = bus.peripheral(id).unwrap();
    assert!(!peripheral.is_running());
    let diagnosis = peripheral.last_diagnostics().unwrap();
    let expected = DiagnosticFlags::PARAMETER_FAULT | DiagnosticFlags::PARAMETER_REQUIRED;
    assert!(diagnosis.flags.contains(expected), "{diagnosis:?}");
    assert_eq!((diagnosis.ident_number, diagnosis.master_address), (0x4321, None));
    assert!(!bus.events(id).contains(&PeripheralEvent::Configured) && bus.exchanges(id) == 0);
}

#[test]
fn another_configuration_is_never_taken() {
    let mut bus = VirtualBus::new();
    let id = attach(&mut bus, 7, Identity { configuration: &[0x70, 0x70, 0x70, 0x70], ..IDENTITY });
    bus.run(Duration::from_millis(200));
    let events = bus.events(id);
    assert!(events.contains(&PeripheralEvent::ConfigError) && !events.contains(&PeripheralEvent::Configured));
    assert_eq!(bus.exchanges(id), 0);
}

#[test]
fn a_diagnosis_that_waits_is_fetched() {
    let (mut bus, id) = running();
    bus.events(id);
    bus.slave_mut(id).announce_diagnosis();
    assert!(bus.exchange(id) && bus.exchange(id));
    assert_eq!(bus.events(id), [PeripheralEvent::Diagnostics]);
    let diagnosis = bus.peripheral(id).unwrap().last_diagnostics().unwrap();
    assert_eq!(diagnosis.flags, DiagnosticFlags::WATCHDOG_ON);
    assert_eq!(diagnosis.master_address, Some(MASTER));
}
