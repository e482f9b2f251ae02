//! The simulated drive's objects and messages beyond what `tests/verify` compares with chapters 7.2 and 7.12, frame by frame.

use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use siko_ag03_1::sim::inputs::BusState;
use siko_ag03_1::state::State;

use super::support::Rig;

impl Rig {
    fn operational() -> Self {
        let mut rig = Rig::new();
        rig.send("000#0105");
        rig
    }
}

#[test]
fn a_running_travel_refuses_what_it_relies_on() {
    let mut rig = Rig::new();
    rig.enable();
    rig.send("405#1F0088130000");
    rig.pass(100);
    let load = *b"load";
    let refused: [(u16, u8, &[u8]); 8] = [
        (0x2410, 0x0A, &[50]),
        (0x1011, 1, &load),
        (0x1011, 4, &load),
        (0x607C, 0, &[0; 4]),
        (0x607E, 0, &[1]),
        (0x6060, 0, &[2]),
        (0x2412, 0, &[200, 0]),
        (0x6091, 1, &[2, 0]),
    ];
    for (index, sub, data) in refused {
        assert_eq!(rig.write(index, sub, data), Some(0x0800_0022), "{index:04X}:{sub:02X}");
    }
    assert_eq!(rig.write(0x2410, 4, &[10]), None, "the acceleration is for the next travel");
    rig.pass(10_000);
    assert_eq!(rig.read(0x6064, 0), Ok(5000));
    for (index, sub, data) in refused {
        assert_eq!(rig.write(index, sub, data), None, "{index:04X}:{sub:02X}");
    }
}

/// Where the bus writes nothing, the drive itself may (STOPPED, and while it starts).
#[test]
fn what_the_bus_may_not_write_then_the_drive_may() {
    let mut rig = Rig::operational();
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
fn restoring_takes_the_signature_only_and_leaves_the_bit_rate() {
    let mut rig = Rig::new();
    assert_eq!(rig.write(0x2100, 0, &[9]), None);
    assert_eq!(rig.write(0x2410, 1, &[7, 0]), None);
    assert_eq!(rig.write(0x2418, 0, &[7, 0]), None);
    assert_eq!(rig.write(0x1011, 1, b"save"), Some(0x0609_0030));
    assert_eq!(rig.write(0x1011, 3, b"load"), None);
    assert_eq!((rig.read(0x2410, 1), rig.read(0x2418, 0)), (Ok(100), Ok(7)));
    assert_eq!(rig.write(0x1011, 1, b"load"), None);
    assert_eq!((rig.read(0x2418, 0), rig.read(0x2100, 0)), (Ok(800), Ok(9)));
}

#[test]
fn calibration_needs_a_value_within_the_limits() {
    let mut rig = Rig::new();
    assert_eq!(rig.write(0x607D, 2, &1000_i32.to_le_bytes()), None);
    assert_eq!(rig.write(0x607C, 0, &1001_i32.to_le_bytes()), Some(0x0609_0030));
    assert_eq!(rig.write(0x607C, 0, &1000_i32.to_le_bytes()), None);
    assert_eq!(rig.read(0x6064, 0), Ok(1000));
    assert_eq!(rig.write(0x607D, 1, &1000_i32.to_le_bytes()), None);
    assert_eq!(rig.write(0x607C, 0, &5000_i32.to_le_bytes()), None, "equal limits are none");
}

#[test]
fn measured_values_are_those_of_the_world() {
    let mut rig = Rig::new();
    rig.see(|drive, now| {
        drive.set_inputs(now, |inputs| {
            inputs.output_stage_supply_100mv = 235;
            inputs.control_supply_100mv = 241;
            inputs.temperature_100mdegc = -55;
            inputs.battery_10mv = 355;
        });
    });
    assert_eq!((rig.read(0x241B, 1), rig.read(0x241B, 2)), (Ok(235), Ok(241)));
    assert_eq!(rig.read(0x241C, 0), Ok(u32::from(-55_i16 as u16)));
    assert_eq!(rig.read(0x2423, 0), Ok(355));
    assert_eq!((rig.read(0x2420, 0), rig.read(0x2422, 0), rig.read(0x241E, 0)), (Ok(0x10), Ok(0), Ok(0)));
    assert_eq!(rig.read(0x1002, 0), Ok(0x0088), "in position, motor released");
    assert_eq!(rig.read(0x6041, 0), Ok(0x0070), "SWITCH ON DISABLED, voltage enabled");
}

#[test]
fn only_a_transmission_type_is_reserved_that_is_252() {
    let mut rig = Rig::new();
    assert_eq!(rig.write(0x1800, 2, &[252]), Some(0x0609_0030));
    assert_eq!(rig.write(0x1800, 5, &[252, 0]), None);
    assert_eq!(rig.write(0x2410, 2, &[252, 0]), None);
}

#[test]
fn bits_30_and_31_of_a_cob_id_forbid_remote_frames_and_the_pdo() {
    for (high, heard) in [(0x00, 1), (0x40, 0), (0x80, 0)] {
        let mut rig = Rig::new();
        assert_eq!(rig.write(0x1802, 1, &[0x85, 0x03, 0x00, high]), None);
        rig.send("000#0105");
        rig.pass(0);
        assert_eq!(rig.ask("385#R6").len(), heard, "{high:02X}");
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

/// "The controller plausibilizes the target" (table 21, bit 12): the one before is none for a new order.
#[test]
fn a_target_out_of_range_starts_nothing() {
    let mut rig = Rig::operational();
    for word in ["205#0601", "205#0701", "205#0F01"] {
        rig.send(word);
    }
    rig.write(0x607A, 0, &5000_i32.to_le_bytes());
    rig.send("405#1F0080969800");
    rig.pass(1000);
    assert_eq!(rig.see(|drive, now| (drive.position(now), drive.status_word(now) & 0x5000)), (0, 0));
    rig.send("405#1F0088130000");
    rig.pass(100);
    assert_eq!(rig.see(|drive, now| drive.status_word(now) & 0x5000), 0x5000, "a good one after it");
    rig.ask("405#070180969800");
    assert_eq!(rig.see(|drive, _| drive.state()), State::SwitchedOn, "it still commands");
    rig.pass(1000);
    rig.send("205#0F01");
    rig.write(0x6060, 0, &[2]);
    rig.write(0x60FF, 0, &60_i32.to_le_bytes());
    rig.send("505#0F00C9000000");
    rig.pass(1000);
    assert_eq!(rig.see(|drive, now| drive.velocity(now)), 0);
}

#[test]
fn node_guarding_disables_the_drive_when_nobody_asks_any_more() {
    let mut rig = Rig::new();
    assert_eq!(rig.write(0x100C, 0, &[100, 0]), None);
    assert_eq!(rig.write(0x100D, 0, &[3]), None);
    rig.enable();
    assert_eq!(rig.ask("705#R1"), ["705#05"]);
    assert_eq!(rig.ask("705#R1"), ["705#85"]);
    rig.send("405#1F0088130000");
    rig.pass(299);
    assert_eq!(rig.see(|drive, _| drive.state()), State::OperationEnabled);
    rig.pass(1);
    // Without 1029h, CiA 301 has the node in PRE-OPERATIONAL then, and that disables the drive.
    let states = rig.see(|drive, _| (drive.nmt_state(), drive.state()));
    assert_eq!(states, (NmtState::PreOperational, State::SwitchOnDisabled));
}

#[test]
fn an_error_passive_controller_tells_so_and_nothing_else() {
    let mut rig = Rig::operational();
    rig.pass(0);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Passive));
    assert_eq!(rig.pass(1000), ["085#2081110000000000"]);
    assert!(rig.ask("605#4000100000000000").is_empty());
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Active));
    assert_eq!(rig.ask("605#4000100000000000"), ["085#0000000000000000", "585#4200100092010000"]);
}

#[test]
fn a_silent_bus_stays_silent() {
    let mut rig = Rig::operational();
    rig.pass(0);
    rig.see(|drive, now| {
        drive.set_inputs(now, |inputs| inputs.bus = BusState::Off);
    });
    assert_eq!(rig.pass(1000), [""; 0]);
    rig.see(|drive, now| {
        drive.set_inputs(now, |inputs| inputs.bus = BusState::Active);
    });
    let heard = rig.pass(0);
    assert!(heard.contains(&"085#4081110000000000".into()), "{heard:?}");
}
