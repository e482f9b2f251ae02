//! The simulated slave with the master of `profirust`, in virtual time.

use super::support::{Echo, IDENTITY};
use lexican_profibus::dp::Lengths;
use lexican_profibus::master::Segment;
use lexican_profibus::pkw::{Pkw, Reply, Task, Value};
use lexican_profibus::virtual_bus::{MASTER, SlaveId, VirtualBus};
use lexican_profibus::{Application, BitRate, Identity, Slave, State};
use lexican_runtime::{Duration, Instant};
use profirust::dp::{DiagnosticFlags, PeripheralEvent, PeripheralOptions};

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
    assert_eq!(bus.exchanges(id), 2);
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

/// Both answer at once, and nothing of that can be read; each is heard when the other one is gone.
#[test]
fn two_slaves_of_one_address_garble_their_answers() {
    let mut bus = VirtualBus::new();
    let first = attach(&mut bus, 7, IDENTITY);
    let second = bus.attach_unknown(Slave::new(7, IDENTITY, bus.bit_rate(), Echo::default()));
    let other = attach(&mut bus, 8, IDENTITY);
    bus.run(Duration::from_secs(1));
    assert_eq!((bus.exchanges(first), bus.events(first)), (0, vec![]));
    assert!(bus.exchange(other), "the rest of the bus works");
    bus.set_connected(second, false);
    assert!(bus.exchange(first));
    bus.set_connected(second, true);
    bus.run(Duration::from_secs(1));
    assert!(bus.exchange(other));
}

/// Whether an answer that was lost is asked for again, and given without acting twice.
#[test]
fn a_lost_answer_is_repeated() {
    let (mut bus, id) = running();
    let acted = bus.slave(id).application().outputs.len() as u64;
    let (before, begin) = (bus.exchanges(id), bus.now());
    assert!(bus.exchange(id));
    let (span, begin) = (bus.now().since(begin), bus.now());
    bus.lose_answers(id, 0..1);
    assert!(bus.exchange(id));
    assert!(bus.now().since(begin) > span, "none has been lost");
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

/// Three characters of eleven bits at 500 kbit/s.
const TURN: Duration = Duration::from_micros(66);
const TURNS: Duration = Duration::from_micros(660);

#[test]
fn time_passes_as_far_as_it_is_to() {
    let mut bus = VirtualBus::<Echo>::new();
    assert!(!bus.is_real_time());
    bus.run(TURNS);
    assert_eq!(bus.now(), Instant::ZERO + TURNS);
    let mut calls = 0;
    let mut never = |_: &mut VirtualBus<Echo>| {
        calls += 1;
        assert!(calls < 100, "it does not end");
        false
    };
    assert!(!bus.run_until(TURNS, &mut never));
    assert_eq!(bus.now(), Instant::ZERO + TURNS + TURNS);
    let until = bus.now() + TURNS;
    assert_eq!((bus.poll(until), bus.now()), (None, until));
}

#[test]
fn a_slave_that_the_segment_adds_is_known() {
    let mut bus = VirtualBus::new();
    let [first, second] =
        [7, 8].map(|address| bus.attach_unknown(Slave::new(address, IDENTITY, BitRate(500_000), Echo::default())));
    assert!(bus.peripheral(first).is_none());
    let handle = Segment::add(&mut bus, 7, options(), Lengths { inputs: 4, outputs: 4 });
    let until = bus.now() + Duration::from_secs(1);
    assert_eq!(bus.poll(until), Some((handle, PeripheralEvent::Online)));
    assert!(bus.exchange(first) && bus.peripheral(second).is_none());
    assert_eq!(bus.exchanges(second), 0);
}

/// Answers each task by the number of exchanges.
#[derive(Debug, Default)]
struct Counter {
    task: Pkw,
    exchanges: u32,
}

impl Application for Counter {
    fn take_outputs(&mut self, _: Instant, outputs: &[u8]) {
        (self.task, self.exchanges) = (Pkw::parse(outputs).unwrap(), self.exchanges + 1);
    }

    fn write_inputs(&mut self, _: Instant, inputs: &mut [u8]) {
        let reply = Reply::Value(Value::Word(self.exchanges as u16)).pkw(self.task);
        inputs.copy_from_slice(&if self.task == Pkw::default() { [0; 8] } else { reply.bytes() });
    }

    fn enter(&mut self, _: Instant, _: State) {}
}

#[test]
fn a_task_is_answered_once_or_given_up() {
    let mut bus = VirtualBus::new();
    let identity = Identity { inputs: 8, outputs: 8, ..IDENTITY };
    let slave = Slave::new(7, identity, bus.bit_rate(), Counter::default());
    let id = bus.attach(slave, options(), (8, 8));
    assert!(bus.exchange(id));
    let mut before = 0;
    for number in [918, 918, 7] {
        let Some(Reply::Value(Value::Word(count))) = bus.ask(id, Task::Read { number }) else { panic!("none") };
        assert!(u32::from(count) > before && u64::from(count) <= bus.exchanges(id) + 1, "{count}");
        before = bus.slave(id).application().exchanges;
    }
    bus.set_connected(id, false);
    let begin = bus.now();
    assert_eq!(bus.ask(id, Task::Read { number: 918 }), None);
    let span = bus.now().since(begin);
    assert!((Duration::from_secs(5)..=Duration::from_secs(5) + TURN).contains(&span), "{span:?}");
}
