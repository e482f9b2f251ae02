//! What the simulated AG02 does otherwise than SIKO's other drives.

#[path = "../../siko/tests/all/support.rs"]
mod support;

use siko_ag02::Direction;
use siko_ag02::fault::{self, FaultKind};
use siko_ag02::sim::inputs::{BusError, BusState};
use siko_ag02::sim::{Braking, MODEL, Order, Refused, Setup, SimulatedDrive};

use support::{NODE, Rig};

fn ag02() -> Rig {
    Rig::with(Setup::new(&MODEL, NODE))
}

#[test]
fn four_bytes_are_read_by_42h_and_written_by_23h_whatever_the_size() {
    let mut rig = ag02();
    for (request, answer) in [
        // The examples of 10.2.8.
        ("605#237C6000C4090000", "585#607C600000000000"),
        ("605#407C600000000000", "585#427C6000C4090000"),
        ("605#237D600280841E00", "585#607D600200000000"),
        ("605#2391600107000000", "585#6091600100000000"),
        ("605#4091600100000000", "585#4291600107000000"),
        ("605#2360600002000000", "585#6060600000000000"),
        ("605#4060600000000000", "585#4260600002000000"),
        // The first character from the top: "2.00".
        ("605#400A100000000000", "585#420A100030302E32"),
        // Too large for the object, and commands that are not in table 18.
        ("605#2391600100000100", "585#8091600100000106"),
        ("605#2360600001010000", "585#8060600000000106"),
        ("605#2B91600107000000", "585#8091600100000106"),
        ("605#2F60600001000000", "585#8060600000000106"),
        ("605#4091600100000000", "585#4291600107000000"),
    ] {
        assert_eq!(rig.ask(request), [answer], "{request}");
    }
}

#[test]
fn bit_31_switches_no_pdo_off() {
    for (model, sent) in [(&MODEL, true), (&siko_ag03_1::sim::MODEL, false)] {
        let mut rig = Rig::with(Setup::new(model, NODE));
        assert_eq!(rig.write(0x1800, 1, &0x8000_0185_u32.to_le_bytes()), None);
        rig.send("000#0105");
        assert_eq!(rig.pass(1000).iter().any(|frame| frame.starts_with("185#")), sent, "{}", model.name);
    }
}

#[test]
fn each_gear_has_its_greatest_velocity() {
    for (gear, most) in [(1, 100), (2, 80), (3, 35)] {
        let mut rig = Rig::with(Setup { gear, ..Setup::new(&MODEL, NODE) });
        let usual = rig.see(|drive, _| drive.parameters().v_pos);
        assert_eq!(usual, most.min(50));
        for (index, sub) in [(0x2410, 5), (0x2410, 9), (0x60FF, 0)] {
            assert_eq!(rig.write(index, sub, &u32::from(most).to_le_bytes()), None, "{index:04X}");
            assert_eq!(rig.write(index, sub, &u32::from(most + 1).to_le_bytes()), Some(0x0609_0030), "{index:04X}");
        }
        assert_eq!(rig.write(0x1011, 1, b"load"), None);
        assert_eq!(rig.see(|drive, _| drive.parameters().v_pos), usual);
    }
}

/// Parameter 25 is set through the serial port and PROFIBUS, and restored through any door.
#[test]
fn parameter_25_is_kept_without_an_object() {
    let mut rig = ag02();
    let inching_stop = |rig: &Rig| rig.see(|drive, _| drive.parameters().inching_stop);
    for (restores, kept) in [(1, 0), (2, 0), (3, 1)] {
        rig.see(|drive, now| drive.set_inching_stop(now, Braking::Programmed));
        rig.see(SimulatedDrive::power_cycle);
        assert_eq!(inching_stop(&rig), 1);
        assert_eq!(rig.see(|drive, now| drive.non_volatile(now)).inching_stop, 1);
        assert_eq!(rig.write(0x1011, restores, b"load"), None);
        assert_eq!(inching_stop(&rig), kept, "1011h:0{restores}");
    }
    rig.see(|drive, now| drive.set_inching_stop(now, Braking::Full));
    assert_eq!(inching_stop(&rig), 0);
}

#[test]
fn parameter_25_holds_for_the_order_that_follows_it() {
    let way = |braking| {
        let mut rig = ag02();
        rig.see(|drive, now| {
            assert_eq!(drive.order(now, Order::Enable), Ok(()));
            assert_eq!(drive.order(now, Order::Inch(Direction::Positive)), Ok(()));
        });
        rig.pass(500);
        let from = rig.see(|drive, now| {
            drive.set_inching_stop(now, braking);
            assert_eq!(drive.order(now, Order::StopInching), Ok(()));
            drive.position(now)
        });
        rig.pass(2_000);
        rig.see(|drive, now| drive.position(now)) - from
    };
    let (full, programmed) = (way(Braking::Full), way(Braking::Programmed));
    assert!(full < programmed, "{full} and {programmed} increments");
}

/// Table 1: "Ein Verfahren ist nur mit Tippbetrieb in Richtung Endschalter 2 möglich".
#[test]
fn inching_onto_an_active_limit_switch_is_refused() {
    let [positive, negative] = [Direction::Positive, Direction::Negative];
    for (switch, onto, back) in [(0, positive, negative), (1, negative, positive)] {
        let mut rig = ag02();
        rig.see(|drive, now| {
            drive.set_inputs(now, |inputs| inputs.limit_switches[switch] = true);
            assert_eq!(drive.order(now, Order::Enable), Ok(()));
            assert_eq!(drive.order(now, Order::Inch(onto)), Err(Refused::Switch(onto)));
            assert_eq!(drive.order(now, Order::Inch(back)), Ok(()));
        });
        rig.pass(100);
        let moved = rig.see(|drive, now| drive.position(now));
        assert_eq!(moved < 0, switch == 0, "{moved}");
    }
}

#[test]
fn bus_off_is_fault_f() {
    let mut rig = ag02();
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Off));
    assert_eq!(rig.see(|drive, _| drive.controller().faults().to_vec()), [fault::BUS_OFF]);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Active));
    assert_eq!(rig.read(0x1003, 1), Ok(0x8120));
}

/// Table 20: neither faults nor stored, and 0000h does not follow when the bus is well again (10.2.9).
#[test]
fn errors_on_the_bus_are_reported_and_end_without_a_word() {
    let mut rig = ag02();
    assert_eq!(rig.write(0x1014, 0, &0x4000_0085_u32.to_le_bytes()), None);
    let set = |rig: &Rig, error| rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus_error = error));
    for ((error, _), low) in BusError::ALL.iter().zip(1..) {
        set(&rig, Some(*error));
        assert_eq!(rig.pass(10), [format!("085#{low:02X}80110000000000")], "once");
        assert_eq!((rig.read(0x1001, 0), rig.read(0x1003, 0)), (Ok(0x11), Ok(0)));
        assert!(rig.see(|drive, _| drive.controller().faults().is_empty()));
    }
    // An error passive controller that goes on finding errors is not well yet.
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Passive));
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Active));
    assert_eq!(rig.read(0x1001, 0), Ok(0x11));
    set(&rig, None);
    assert_eq!(rig.pass(10), [""; 0]);
    assert_eq!(rig.read(0x1001, 0), Ok(0));
}

/// 1800h:02: 254 does what 255 does; TPDO3 and TPDO4 of type 254 are sent on change.
#[test]
fn tpdo1_of_type_254_is_sent_by_the_timer_and_the_others_on_change() {
    let mut rig = ag02();
    for parameter in [0x1800, 0x1802, 0x1803] {
        assert_eq!(rig.write(parameter, 2, &[254, 0, 0, 0]), None);
    }
    rig.send("000#0105");
    assert_eq!(rig.pass(50), [""; 0], "nothing at the start");
    rig.send("205#0601");
    let heard = rig.pass(40);
    assert_eq!(heard.iter().map(|frame| &frame[..3]).collect::<Vec<_>>(), ["385", "485"]);
    let heard = rig.pass(500);
    assert!(heard.iter().all(|frame| frame.starts_with("185")) && heard.len() == 5, "{heard:?}");
}

#[test]
fn emergencies_wait_for_bit_30() {
    for (switched_on, heard) in [(false, &[][..]), (true, &["085#00F0810000000000"])] {
        let mut rig = ag02();
        if switched_on {
            assert_eq!(rig.write(0x1014, 0, &0x4000_0085_u32.to_le_bytes()), None);
        }
        rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.force(FaultKind::Sensor)));
        assert_eq!(rig.pass(10), heard);
        assert_eq!(rig.read(0x1003, 1), Ok(0xF000));
    }
}
