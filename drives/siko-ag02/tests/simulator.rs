//! Where the simulated AG02 differs from SIKO's other drives.

#[path = "../../siko/tests/all/support.rs"]
mod support;

use siko_ag02::Direction;
use siko_ag02::sim::{Braking, MODEL, Order, Setup, SimulatedDrive};

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
        // The first character is in the highest byte: "2.00".
        ("605#400A100000000000", "585#420A100030302E32"),
        // A value too large for the object, and commands that are not in table 18.
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

/// Parameter 25 is set through the serial port or PROFIBUS, and restored through any interface.
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
