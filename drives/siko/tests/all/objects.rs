//! The simulated drive's objects and messages, frame by frame: chapters 7.2 and 7.12.

use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::wire::emcy::CodeOrder;
use lexican_runtime::wire::nmt::NmtState;
use siko_ag03_1::od;
use siko_ag03_1::sim::inputs::BusState;
use siko_ag03_1::sim::{MODEL, Setup, StatusLed};
use siko_ag03_1::state::State;

use super::support::{Bench, NODE};

impl Bench {
    fn operational() -> Self {
        let mut bench = Bench::new();
        bench.send("000#0105");
        bench
    }
}

#[test]
fn the_sdo_examples_of_chapter_7_2_8_are_answered_byte_for_byte() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("605#237C6000C4090000"), ["585#607C600000000000"]);
    assert_eq!(bench.ask("605#407C600000000000"), ["585#427C6000C4090000"]);
    // Table 18 has the commands for values of one and of two bytes.
    assert_eq!(bench.ask("605#4000210000000000"), ["585#4F0021000A000000"]);
    assert_eq!(bench.ask("605#4067600000000000"), ["585#4B6760000A000000"]);
    assert_eq!(bench.ask("605#237D600280841E00"), ["585#607D600200000000"]);
}

#[test]
fn every_entry_of_the_data_sheet_is_served() {
    let mut bench = Bench::new();
    for entry in od::TABLE.entries() {
        let read = bench.read(entry.address.index(), entry.address.sub());
        let expected = if entry.access.is_readable() { read.is_ok() } else { read == Err(0x0601_0001) };
        assert!(expected, "{}: {read:08X?}", entry.address);
    }
    assert_eq!(od::TABLE.entries().count(), 138);
}

#[test]
fn every_abort_code_of_table_19_has_its_cause() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x2410, 0x07), Err(0x0609_0011), "sub-index does not exist");
    assert_eq!(bench.write(0x1000, 0, &[0; 4]), Some(0x0601_0002), "read-only");
    assert_eq!(bench.read(0x1011, 1), Err(0x0601_0001), "write-only");
    assert_eq!(bench.write(0x2410, 4, &[0]), Some(0x0609_0030), "below the range");
    assert_eq!(bench.write(0x2410, 4, &[101]), Some(0x0609_0030), "above the range");
    assert_eq!(bench.write(0x607D, 2, &(-1_000_001_i32).to_le_bytes()), Some(0x0609_0036), "maximum below minimum");
    assert_eq!(bench.read(0x2411, 0), Err(0x0602_0000), "object does not exist");
    assert_eq!(bench.write(0x2410, 4, &[50, 0, 0, 0]), Some(0x0601_0000), "four bytes for one");
    assert_eq!(bench.write(0x6040, 0, &[6, 1]), Some(0x0800_0022), "not in this state");
}

#[test]
fn writes_are_refused_where_the_manual_says_so() {
    let mut bench = Bench::new();
    // In PRE-OPERATIONAL, all of these are taken.
    let communication: [(u16, u8, &[u8]); 6] = [
        (0x1005, 0, &[0x80, 0, 0, 0]),
        (0x1014, 0, &[0x85, 0, 0, 0]),
        (0x1400, 2, &[0xFF]),
        (0x1802, 2, &[0xFE]),
        (0x1802, 5, &[50, 0]),
        (0x2100, 0, &[9]),
    ];
    for (index, sub, data) in communication {
        assert_eq!(bench.write(index, sub, data), None, "{index:04X}");
    }
    bench.send("000#0105");
    bench.pass(0);
    for (index, sub, data) in communication {
        assert_eq!(bench.write(index, sub, data), Some(0x0800_0022), "{index:04X}");
    }
}

#[test]
fn a_running_travel_refuses_what_it_relies_on() {
    let mut bench = Bench::new();
    bench.enable();
    bench.send("405#1F0088130000");
    bench.pass(100);
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
        assert_eq!(bench.write(index, sub, data), Some(0x0800_0022), "{index:04X}:{sub:02X}");
    }
    assert_eq!(bench.write(0x2410, 4, &[10]), None, "the acceleration is for the next travel");
    bench.pass(10_000);
    assert_eq!(bench.read(0x6064, 0), Ok(5000));
    for (index, sub, data) in refused {
        assert_eq!(bench.write(index, sub, data), None, "{index:04X}:{sub:02X}");
    }
}

/// Where the bus writes nothing, the drive itself may (STOPPED, and while it starts).
#[test]
fn what_the_bus_may_not_write_then_the_drive_may() {
    let mut bench = Bench::operational();
    for (command, taken) in [("000#0105", false), ("000#0205", true), ("000#8005", true)] {
        bench.ask(command);
        let written = bench.see(|drive, now| {
            drive.with_dictionary(now, |od| {
                let entry = od.entry(Address::new(0x1400, 2)).unwrap();
                od.write(&entry, 0, &[255], true)
            })
        });
        assert_eq!(written.is_ok(), taken, "{command}");
    }
}

#[test]
fn ranges_follow_the_gear() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x2102, 0), Ok(2));
    assert_eq!(bench.write(0x2410, 5, &[200]), None);
    assert_eq!(bench.write(0x2410, 5, &[201]), Some(0x0609_0030));
    assert_eq!(bench.write(0x60FF, 0, &(-200_i32).to_le_bytes()), None);
    assert_eq!(bench.write(0x60FF, 0, &(-201_i32).to_le_bytes()), Some(0x0609_0030));
}

#[test]
fn restoring_takes_the_signature_only_and_leaves_the_bit_rate() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x2100, 0, &[9]), None);
    assert_eq!(bench.write(0x2410, 1, &[7, 0]), None);
    assert_eq!(bench.write(0x2418, 0, &[7, 0]), None);
    assert_eq!(bench.write(0x1011, 1, b"save"), Some(0x0609_0030));
    assert_eq!(bench.write(0x1011, 3, b"load"), None);
    assert_eq!((bench.read(0x2410, 1), bench.read(0x2418, 0)), (Ok(100), Ok(7)));
    assert_eq!(bench.write(0x1011, 1, b"load"), None);
    assert_eq!((bench.read(0x2418, 0), bench.read(0x2100, 0)), (Ok(800), Ok(9)));
}

#[test]
fn calibration_needs_a_value_within_the_limits() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x607D, 2, &1000_i32.to_le_bytes()), None);
    assert_eq!(bench.write(0x607C, 0, &1001_i32.to_le_bytes()), Some(0x0609_0030));
    assert_eq!(bench.write(0x607C, 0, &1000_i32.to_le_bytes()), None);
    assert_eq!(bench.read(0x6064, 0), Ok(1000));
    assert_eq!(bench.write(0x607D, 1, &1000_i32.to_le_bytes()), None);
    assert_eq!(bench.write(0x607C, 0, &5000_i32.to_le_bytes()), None, "equal limits are none");
}

#[test]
fn measured_values_are_those_of_the_world() {
    let mut bench = Bench::new();
    bench.see(|drive, now| {
        drive.set_inputs(now, |inputs| {
            inputs.output_stage_supply_100mv = 235;
            inputs.control_supply_100mv = 241;
            inputs.temperature_100mdegc = -55;
            inputs.battery_10mv = 355;
        });
    });
    assert_eq!((bench.read(0x241B, 1), bench.read(0x241B, 2)), (Ok(235), Ok(241)));
    assert_eq!(bench.read(0x241C, 0), Ok(u32::from(-55_i16 as u16)));
    assert_eq!(bench.read(0x2423, 0), Ok(355));
    assert_eq!((bench.read(0x2420, 0), bench.read(0x2422, 0), bench.read(0x241E, 0)), (Ok(0x10), Ok(0), Ok(0)));
    assert_eq!(bench.read(0x1002, 0), Ok(0x0088), "in position, motor released");
    assert_eq!(bench.read(0x6041, 0), Ok(0x0070), "SWITCH ON DISABLED, voltage enabled");
}

#[test]
fn a_fault_is_told_stored_and_reset() {
    let mut bench = Bench::new();
    bench.enable();
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.temperature_100mdegc = 901));
    assert_eq!(bench.pass(0), ["085#1043090000000000"]);
    assert_eq!((bench.read(0x1001, 0), bench.read(0x1003, 0), bench.read(0x1003, 1)), (Ok(0x09), Ok(1), Ok(0x4310)));
    assert_eq!(bench.see(|drive, _| drive.status_led()), StatusLed::Blinks(4));
    assert!(bench.ask("205#8000").is_empty(), "the cause is still there");
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.temperature_100mdegc = 900));
    bench.send("205#0000");
    assert_eq!(bench.ask("205#8000"), ["085#0000000000000000"]);
    assert_eq!((bench.read(0x1001, 0), bench.read(0x1003, 0)), (Ok(0), Ok(1)));
    assert_eq!(bench.write(0x1003, 0, &[1]), Some(0x0609_0030));
    assert_eq!(bench.write(0x1003, 0, &[0]), None);
    assert_eq!((bench.read(0x1003, 0), bench.read(0x1003, 1)), (Ok(0), Ok(0)));
}

#[test]
fn the_fault_buffer_keeps_the_last_ten() {
    let mut bench = Bench::new();
    bench.send("000#0105");
    for number in 0..12 {
        bench.see(|drive, now| {
            drive.set_inputs(now, |inputs| {
                inputs.sensor_fails = number % 2 == 0;
                inputs.internal_error = number % 2 == 1;
            });
            drive.set_inputs(now, |inputs| (inputs.sensor_fails, inputs.internal_error) = (false, false));
        });
        bench.send("205#0000");
        bench.send("205#8000");
        bench.pass(0);
    }
    assert_eq!(bench.read(0x1003, 0), Ok(10));
    assert_eq!(
        (bench.read(0x1003, 1), bench.read(0x1003, 2), bench.read(0x1003, 10)),
        (Ok(0xFF01), Ok(0x7300), Ok(0x7300))
    );
}

#[test]
fn emergencies_can_be_sent_as_table_20_prints_them() {
    let mut setup = Setup::new(&MODEL, NODE);
    setup.behaviour.emcy_code_order = CodeOrder::HighByteFirst;
    let mut bench = Bench::with(setup);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.battery_10mv = 0));
    assert_eq!(bench.pass(0), ["085#FF09050000000000"]);
}

#[test]
fn what_is_stored_survives_a_power_cycle_and_the_rest_does_not() {
    let mut bench = Bench::new();
    bench.enable();
    bench.send("405#1F0088130000");
    bench.pass(10_000);
    for (index, sub, data) in [(0x2410, 1, &[7_u8, 0][..]), (0x2450, 0, &[50]), (0x2415, 0, &[1, 0, 0, 0])] {
        assert_eq!(bench.write(index, sub, data), None);
    }
    bench.see(|drive, now| {
        drive.set_inputs(now, |inputs| inputs.internal_error = true);
        drive.set_inputs(now, |inputs| inputs.internal_error = false);
        drive.power_cycle(now);
    });
    assert!(bench.pass(0).contains(&"705#00".into()));
    assert_eq!((bench.read(0x2410, 1), bench.read(0x2450, 0), bench.read(0x2415, 0)), (Ok(7), Ok(100), Ok(1)));
    assert_eq!((bench.read(0x607A, 0), bench.read(0x6064, 0)), (Ok(0), Ok(5000)));
    assert_eq!((bench.read(0x1003, 0), bench.read(0x1003, 1), bench.read(0x1001, 0)), (Ok(1), Ok(0xFF01), Ok(0)));
    let kept = bench.see(|drive, now| drive.non_volatile(now));
    assert_eq!(kept.eeprom.get(&Address::new(0x2410, 1)), Some(&7));
}

#[test]
fn both_resets_lead_through_the_boot_up() {
    for text in ["000#8105", "000#8205", "000#8100"] {
        let mut bench = Bench::new();
        bench.enable();
        assert_eq!(bench.ask(text), ["705#00"]);
        assert_eq!(
            bench.see(|drive, _| (drive.nmt_state(), drive.state())),
            (NmtState::PreOperational, State::SwitchOnDisabled)
        );
    }
}

#[test]
fn pdos_are_sent_as_their_types_say() {
    let mut bench = Bench::operational();
    assert_eq!(bench.pass(99), [""; 0], "type 255: by its timer only");
    assert_eq!(bench.pass(1), ["185#7002"]);
    assert_eq!(bench.pass(100), ["185#7002"]);
    assert_eq!(bench.ask("385#R6"), ["385#700200000000"]);
    assert_eq!(bench.ask("485#R6"), ["485#700200000000"]);
    bench.send("000#8005");
    assert_eq!(bench.write(0x1800, 5, &[0, 0]), None);
    assert_eq!(bench.write(0x1802, 2, &[0]), None);
    assert_eq!(bench.write(0x1803, 2, &[2]), None);
    bench.send("000#0105");
    assert_eq!(bench.ask("080#"), ["385#700200000000"]);
    assert_eq!(bench.ask("080#"), ["385#700200000000", "485#700200000000"]);
}

/// How many TPDO1 are sent in a second of each kind, with an event timer of 100 ms and an inhibit time of 50 ms:
/// when nothing happens, at 10 SYNCs, when the status word changes 20 times, and at one remote frame.
#[track_caller]
fn check_type(transmission: u8, expected: [usize; 4]) {
    let mut bench = Bench::new();
    for (sub, data) in [(2, &[transmission][..]), (3, &[0xF4, 1]), (5, &[100, 0])] {
        assert_eq!(bench.write(0x1800, sub, data), None);
    }
    bench.send("000#0105");
    bench.pass(0);
    let mut count = |text: &str, times: u64| {
        let from_tpdo = |frames: Vec<String>| frames.iter().filter(|frame| frame.starts_with("185#")).count();
        let mut heard = 0;
        // Not in step with the event timer.
        bench.pass(70);
        for number in 0..times.max(1) {
            // Shutdown, and Disable Voltage.
            let text = text.replace("XX", if number % 2 == 0 { "06" } else { "00" });
            heard += from_tpdo(if text.is_empty() { Vec::new() } else { bench.ask(&text) });
            heard += from_tpdo(bench.pass(1000 / times.max(1)));
        }
        heard
    };
    let found = [count("", 0), count("080#", 10), count("205#XX01", 20), count("185#R2", 1)];
    assert_eq!(found, expected, "type {transmission}");
}

#[test]
fn every_transmission_type_is_sent_when_the_manual_says_so() {
    check_type(0, [0, 10, 0, 1]);
    check_type(1, [0, 10, 0, 1]);
    check_type(5, [0, 2, 0, 1]);
    check_type(240, [0, 0, 0, 1]);
    check_type(253, [0, 0, 0, 1]);
    // Both by event timer; 254 at every change as well, though not sooner than the inhibit time allows.
    check_type(254, [10, 10, 20, 11]);
    check_type(255, [10, 10, 10, 11]);
    let mut bench = Bench::new();
    for reserved in [241, 251, 252] {
        for parameter in [0x1800, 0x1802, 0x1803] {
            assert_eq!(bench.write(parameter, 2, &[reserved]), Some(0x0609_0030), "{reserved} is reserved");
        }
    }
    // 252 is reserved as a transmission type only.
    assert_eq!(bench.write(0x1800, 5, &[252, 0]), None);
    assert_eq!(bench.write(0x2410, 2, &[252, 0]), None);
}

#[test]
fn bits_30_and_31_of_a_cob_id_forbid_remote_frames_and_the_pdo() {
    for (high, heard) in [(0x00, 1), (0x40, 0), (0x80, 0)] {
        let mut bench = Bench::new();
        assert_eq!(bench.write(0x1802, 1, &[0x85, 0x03, 0x00, high]), None);
        bench.send("000#0105");
        bench.pass(0);
        assert_eq!(bench.ask("385#R6").len(), heard, "{high:02X}");
    }
}

#[test]
fn pdos_are_neither_sent_nor_taken_outside_operational() {
    for command in ["000#8005", "000#0205"] {
        let mut bench = Bench::operational();
        bench.pass(0);
        bench.send(command);
        bench.send("205#0601");
        bench.send("385#R6");
        assert_eq!(bench.pass(1000), [""; 0], "{command}");
        assert_eq!(bench.see(|drive, _| drive.state()), State::SwitchOnDisabled, "{command}");
    }
}

#[test]
fn the_identifiers_of_sync_and_emergency_can_be_changed() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x1005, 0, &[0xF0, 0x02, 0, 0]), None);
    assert_eq!(bench.write(0x1014, 0, &[0x90, 0, 0, 0]), None);
    assert_eq!(bench.write(0x1802, 2, &[1]), None);
    bench.send("000#0105");
    bench.pass(0);
    assert_eq!(bench.ask("080#"), [""; 0]);
    assert_eq!(bench.ask("2F0#"), ["385#700200000000"]);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.internal_error = true));
    assert_eq!(bench.pass(0), ["090#01FF810000000000"]);
}

#[test]
fn a_tpdo_of_type_254_follows_every_change_within_its_inhibit_time() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x1800, 5, &[0, 0]), None);
    assert_eq!(bench.write(0x1802, 2, &[254]), None);
    assert_eq!(bench.write(0x1802, 5, &[0, 0]), None);
    bench.send("000#0105");
    assert_eq!(bench.pass(0), ["385#700200000000"], "at once on entering OPERATIONAL");
    bench.pass(20);
    for (command, status) in [("205#0601", "385#310200000000"), ("205#0701", "385#330200000000")] {
        bench.send(command);
        assert_eq!(bench.pass(20), [status]);
    }
    bench.send("205#0F01");
    bench.pass(20);
    bench.send("405#1F0064000000");
    let travel = bench.pass(2000);
    // 100 increments in 353 ms, one frame in 10 ms at most.
    assert!((30..=40).contains(&travel.len()), "{travel:?}");
    assert_eq!(travel.last().map(String::as_str), Some("385#371764000000"));
}

#[test]
fn a_change_is_not_forgotten_when_the_bus_asks_for_frames_first() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x1800, 5, &[0, 0]), None);
    assert_eq!(bench.write(0x1802, 2, &[254]), None);
    assert_eq!(bench.write(0x1802, 3, &[0, 0]), None);
    bench.enable();
    bench.send("405#1F0088130000");
    bench.pass(50);
    bench.see(|drive, _| {
        let due = drive.poll_timeout().unwrap();
        assert_eq!(drive.poll_transmit(due), None);
        assert_eq!(drive.poll_timeout(), Some(due));
    });
}

#[test]
fn synchronous_rpdos_wait_for_sync() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x1402, 2, &[0]), None);
    bench.enable();
    bench.send("405#1F0088130000");
    bench.pass(500);
    assert_eq!(bench.see(|drive, now| drive.position(now)), 0);
    bench.send("080#");
    bench.pass(500);
    assert!(bench.see(|drive, now| drive.position(now)) > 0);
}

/// "The controller plausibilizes the target" (table 21, bit 12): the one before is none for a new order.
#[test]
fn a_target_out_of_range_starts_nothing() {
    let mut bench = Bench::operational();
    for word in ["205#0601", "205#0701", "205#0F01"] {
        bench.send(word);
    }
    bench.write(0x607A, 0, &5000_i32.to_le_bytes());
    bench.send("405#1F0080969800");
    bench.pass(1000);
    assert_eq!(bench.see(|drive, now| (drive.position(now), drive.status_word(now) & 0x5000)), (0, 0));
    bench.send("405#1F0088130000");
    bench.pass(100);
    assert_eq!(bench.see(|drive, now| drive.status_word(now) & 0x5000), 0x5000, "a good one after it");
    bench.ask("405#070180969800");
    assert_eq!(bench.see(|drive, _| drive.state()), State::SwitchedOn, "it still commands");
    bench.pass(1000);
    bench.send("205#0F01");
    bench.write(0x6060, 0, &[2]);
    bench.write(0x60FF, 0, &60_i32.to_le_bytes());
    bench.send("505#0F00C9000000");
    bench.pass(1000);
    assert_eq!(bench.see(|drive, now| drive.velocity(now)), 0);
}

#[test]
fn the_heartbeat_tells_the_state() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x1017, 0, &[100, 0]), None);
    bench.pass(50);
    assert_eq!(bench.pass(100), ["705#7F"]);
    bench.send("000#0205");
    assert_eq!(bench.pass(100), ["705#04"]);
}

#[test]
fn node_guarding_disables_the_drive_when_nobody_asks_any_more() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x100C, 0, &[100, 0]), None);
    assert_eq!(bench.write(0x100D, 0, &[3]), None);
    bench.enable();
    assert_eq!(bench.ask("705#R1"), ["705#05"]);
    assert_eq!(bench.ask("705#R1"), ["705#85"]);
    bench.send("405#1F0088130000");
    bench.pass(299);
    assert_eq!(bench.see(|drive, _| drive.state()), State::OperationEnabled);
    bench.pass(1);
    // Without 1029h, CiA 301 has the node in PRE-OPERATIONAL then, and that disables the drive.
    let states = bench.see(|drive, _| (drive.nmt_state(), drive.state()));
    assert_eq!(states, (NmtState::PreOperational, State::SwitchOnDisabled));
}

#[test]
fn the_node_id_can_be_read() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x2101, 0), Ok(5));
}

#[test]
fn an_error_passive_controller_tells_so_and_nothing_else() {
    let mut bench = Bench::operational();
    bench.pass(0);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Passive));
    assert_eq!(bench.pass(1000), ["085#2081110000000000"]);
    assert!(bench.ask("605#4000100000000000").is_empty());
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Active));
    assert_eq!(bench.ask("605#4000100000000000"), ["085#0000000000000000", "585#4200100092010000"]);
}

#[test]
fn a_silent_bus_stays_silent() {
    let mut bench = Bench::operational();
    bench.pass(0);
    bench.see(|drive, now| {
        drive.set_inputs(now, |inputs| inputs.bus = BusState::Off);
    });
    assert_eq!(bench.pass(1000), [""; 0]);
    bench.see(|drive, now| {
        drive.set_inputs(now, |inputs| inputs.bus = BusState::Active);
    });
    let heard = bench.pass(0);
    assert!(heard.contains(&"085#4081110000000000".into()), "{heard:?}");
}
