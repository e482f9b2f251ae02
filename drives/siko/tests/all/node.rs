//! The simulated drive as a node of a bus: what it receives, what it sends by itself, and how it reacts to outside
//! events.

use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId, Duration, Instant};
use siko_ag03_1::sim::controller::Network;
use siko_ag03_1::sim::inputs::Inputs;
use siko_ag03_1::sim::script::{Change, Condition, Trigger};
use siko_ag03_1::sim::{MODEL, Model, Order, Refused, Script, Setup, SimulatedDrive};
use siko_ag03_1::state::State;

use super::support::{NODE, Rig};

fn world(rig: &Rig, change: impl FnOnce(&mut Inputs)) {
    rig.see(|drive, now| drive.set_inputs(now, change));
}

/// TPDO3 is sent on change; between two periods of the event timer, after the inhibit time.
fn on_change() -> Rig {
    let mut rig = Rig::new();
    assert_eq!(rig.write(0x1802, 2, &[254]), None);
    rig.ask("000#0105");
    rig.pass(1050);
    rig
}

#[test]
fn a_shaft_that_is_turned_by_hand_is_reported_at_once() {
    let mut rig = on_change();
    assert!(rig.see(|drive, now| drive.turn_shaft(now, 0x0102)));
    assert_eq!(rig.pass(0), ["385#700202010000"]);
}

#[test]
fn a_position_that_is_set_beside_the_bus_is_reported_at_once() {
    let mut rig = on_change();
    rig.see(|drive, now| {
        drive.with_dictionary(now, |od| {
            let entry = od.entry(Address::new(0x607C, 0)).unwrap();
            od.write(&entry, 0, &0x0102_i32.to_le_bytes(), true).unwrap();
        });
    });
    assert_eq!(rig.pass(0), ["385#700202010000"]);
}

#[test]
fn what_is_written_beside_the_bus_takes_effect() {
    let mut rig = on_change();
    let write = |rig: &Rig, index, data: &[u8]| rig.see(|drive, now| drive.write(now, Address::new(index, 0), data));
    assert_eq!(write(&rig, 0x607C, &0x0102_i32.to_le_bytes()), Ok(()));
    assert_eq!(rig.pass(0), ["385#700202010000"]);
    assert_eq!(write(&rig, 0x1017, &100_u16.to_le_bytes()), Ok(()));
    assert_eq!(rig.pass(250).iter().filter(|frame| *frame == "705#05").count(), 3);
    assert_eq!(write(&rig, 0x2FFF, &[0]), Err(AbortCode::NO_SUCH_OBJECT));
}

#[test]
fn only_what_an_sdo_brings_is_no_command() {
    static BY_PDO: Model = Model { control_by_sdo: false, ..MODEL };
    let mut rig = Rig::with(Setup::new(&BY_PDO, NODE));
    rig.ask("000#0105");
    assert!(rig.read(0x6041, 0).is_ok());
    rig.see(|drive, now| {
        drive.with_dictionary(now, |od| {
            let entry = od.entry(Address::new(0x6040, 0)).unwrap();
            od.write(&entry, 0, &0x0106_u16.to_le_bytes(), true).unwrap();
        });
    });
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
}

/// An order, or a change of control authority, sends the status word without another event.
#[test]
fn what_another_interface_does_is_sent_on_change() {
    let mut rig = on_change();
    for (act, state) in [
        ((|drive, now| assert_eq!(drive.order(now, Order::Enable), Ok(()))) as Act, State::OperationEnabled),
        (|drive, now| drive.set_network(now, Network::PreOperational), State::SwitchOnDisabled),
    ] {
        let sent = rig.see(|drive, now| {
            act(drive, now);
            drive.poll_transmit(now)
        });
        assert_eq!((sent.map(|frame| frame.id()), rig.state()), (CobId::standard(0x385), state));
        rig.pass(1050);
    }
    world(&rig, |inputs| inputs.control_supply_100mv = 0);
    rig.see(|drive, now| assert_eq!(drive.order(now, Order::Enable), Err(Refused::NotEnabled)));
}

type Act = fn(&mut SimulatedDrive, Instant);

#[test]
fn the_serial_number_is_that_of_the_setup() {
    let mut rig = Rig::with(Setup { serial_number: 0x0102_0304, ..Setup::new(&MODEL, NODE) });
    assert_eq!(rig.read(0x1018, 4), Ok(0x0102_0304));
}

#[test]
fn a_script_begins_at_once_and_goes_on_by_frames_and_by_time() {
    let mut rig = Rig::new();
    let ms = Duration::from_millis;
    let hears = Condition::Nmt(NmtState::Operational);
    let script = Script::default()
        .then(Trigger::At(ms(0)), [Change::Battery(300)])
        .then(Trigger::When { condition: hears, and_then: ms(0) }, [Change::Battery(310)])
        .then(Trigger::After(ms(500)), [Change::Battery(320)]);
    let seen = |rig: &Rig| rig.see(|drive, _| (drive.inputs().battery_10mv, drive.steps_left()));
    rig.see(|drive, now| drive.follow(now, script));
    assert_eq!(seen(&rig), (300, 2));
    rig.pass(100);
    assert_eq!(seen(&rig), (300, 2), "it waits for OPERATIONAL");
    rig.ask("000#0105");
    assert_eq!(seen(&rig), (310, 1));
    rig.pass(499);
    assert_eq!(seen(&rig), (310, 1));
    rig.pass(1);
    assert_eq!(seen(&rig), (320, 0));
}

#[test]
fn a_drive_whose_bus_takes_its_power_starts_anew_when_it_has_it_again() {
    let mut rig = Rig::new();
    let state = |rig: &Rig| rig.see(|drive, _| drive.nmt_state());
    rig.ask("000#0105");
    assert_eq!(state(&rig), NmtState::Operational);
    rig.see(|drive, now| Node::set_power(drive, now, false));
    rig.pass(100);
    rig.see(|drive, now| Node::set_power(drive, now, true));
    rig.pass(2000);
    assert_eq!(state(&rig), NmtState::PreOperational);
    rig.ask("000#0105");
    assert_eq!(state(&rig), NmtState::Operational);
}

/// While the bus cannot write (in STOPPED, and at start-up), the drive itself can.
#[test]
fn what_the_bus_may_not_write_then_the_drive_may() {
    let mut rig = Rig::new();
    for (command, taken) in [("000#0105", false), ("000#0205", true), ("000#8005", true)] {
        rig.ask(command);
        let written = rig.see(|drive, now| {
            drive.with_dictionary(now, |od| {
                let entry = od.entry(Address::new(0x1400, 2)).unwrap();
                od.write(&entry, 0, &[255], true)
            })
        });
        assert_eq!(written.is_ok(), taken, "{command}");
    }
}

#[test]
fn a_change_is_not_forgotten_when_the_bus_asks_for_frames_first() {
    let mut rig = Rig::new();
    assert_eq!(rig.write(0x1800, 5, &[0, 0]), None);
    assert_eq!(rig.write(0x1802, 2, &[254]), None);
    assert_eq!(rig.write(0x1802, 3, &[0, 0]), None);
    rig.enable();
    rig.send("405#1F0088130000");
    rig.pass(50);
    rig.see(|drive, _| {
        let due = drive.poll_timeout().unwrap();
        assert_eq!(drive.poll_transmit(due), None);
        assert_eq!(drive.poll_timeout(), Some(due));
    });
}
