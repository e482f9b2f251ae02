//! What the port may do: control authority, switches, limits, inputs, and what is kept. F0 is the setpoint, F1 and F2 are the limits,
//! F4 is the width of a step, H03 a-Pos.

use super::serial_rig::Rig;
use lexican_runtime::{CobId, Duration, Instant, NodeId};
use siko_ag02::sim::{MODEL, Setup, SimulatedDrive};
use siko_serial::Settings;
use siko_serial::answer::Answer;
use siko_serial::command::{Command, Identity};
use siko_serial::sim::SerialDrive;

#[track_caller]
fn plays(script: &str) {
    Rig::new().plays(script);
}

/// The bus finds the motor released. Neither inching nor a restart is answered or has an effect.
#[test]
fn the_bus_in_command_leaves_reading_and_the_stops() {
    for command in ["01", "02"] {
        let mut rig = Rig::new();
        rig.plays(&format!("F0+0005000; M; wait 1000; nmt {command}; shows released; wait 5000"));
        rig.plays("F0+0000001?3; H0900001?3; I?3; L0?3; M?3; P?3; S11103?3; T3?3; X1?3; Y?3; N; O; E0=5000");
        let before = rig.position();
        rig.plays("inch up; wait 1000; inch no-more; K; E0=5000");
        assert_eq!(rig.position(), before);
        rig.plays("nmt 80; M");
    }
}

/// `N` and `O` stop what the bus has ordered.
#[test]
fn the_stops_interrupt_a_travel_of_the_bus() {
    let mut rig = Rig::new();
    rig.plays("nmt 01");
    let node = NodeId::literal(127);
    for word in [0x06, 0x07, 0x0F] {
        rig.frame(CobId::of_node(0x200, node), &[word, 1]);
    }
    rig.frame(CobId::of_node(0x400, node), &[0x1F, 0x00, 0x88, 0x13, 0x00, 0x00]);
    rig.plays("comes-to travelling; O; comes-to x10x 10x0 0000 0000; Z<5000");
}

/// Limit switches have no meaning in velocity mode.
#[test]
fn on_a_limit_switch_only_inching_leads_back() {
    let turns = "X1; M";
    plays(&format!("switch 1; F0+0005000; M?5; F4+0000100; Y?5; F4-0000100; Y; wait 5000; Z=-100; {turns}"));
    plays(&format!("switch 2; F0+0005000; M?6; F4-0000100; Y?6; F4+0000100; Y; wait 5000; Z=100; {turns}"));
    plays("switch 1; inch up; wait 1000; inch no-more; wait 1000; Z=0");
    plays("switch 2; inch down; wait 1000; inch no-more; wait 1000; Z=0");
}

#[test]
fn beyond_a_limit_only_inching_leads_back() {
    plays("F1-0000010; F0-0000020; M?7; F4+0000020; Y?7; F4-0000020; Y");
    plays("F2+0000010; F0+0000020; M?8; F4-0000020; Y?8; F4+0000020; Y");
}

#[test]
fn without_the_enable_input_nothing_moves() {
    plays("enable off; shows xxxx 11xx 1xxx xxxx; M?11; Y?11; switch 1; switch 2; Y?11");
}

/// Ranges are in `tests/verify`. "Wert muss groesser 'unterer Grenzwert' sein", and equal ones switch the limits off.
#[test]
fn values_are_taken_where_others_allow_them() {
    plays("H0300300?2; F1-1000001?2; F2+1000001?2; F0+1000001?9");
    plays("X1; F0+0000101?2; F0-0000100; M; X0?4; S11104?4");
}

#[test]
fn calibration_makes_the_value_the_position() {
    plays("F3+0000700; Z=700; Y; wait 10000; W=2300; S11104; Z=700");
}

#[test]
fn a_restart_keeps_parameters_and_not_the_setpoint() {
    let mut rig = Rig::new();
    rig.plays("H0300033; F4-0000007; T4; F0+0000001; K; G03=33; E4=-7; E0=0");
    assert_eq!(braking(&mut rig), 400, "parameter 25 is kept, too");
    for (setting, delta, way) in [("S11102", -7, 400), ("S11101", 1600, 50), ("S11100", 1600, 50)] {
        rig.plays(&format!("{setting}; G03=50; E4={delta}"));
        assert_eq!(braking(&mut rig), way, "{setting}");
    }
}

/// The way to a stop of inching operation 2: from 30 rev/min, with 100 % or 12 %.
fn braking(rig: &mut Rig) -> i32 {
    let [a, v] = ["G07", "G08"].map(|read| rig.number(Command::parse(read.as_bytes()).unwrap()));
    rig.plays("H0700012; H0800030; inch up; wait 3000; inch no-more");
    while rig.drive.line().with_drive(|drive, now| drive.drive().velocity(now)) == 30 {
        rig.pass(Duration::from_millis(1));
    }
    let before = rig.position();
    rig.pass(Duration::from_secs(5));
    let way = rig.position() - before;
    rig.plays(&format!("H07{a:05}; H08{v:05}"));
    // The last speed that shows as 30, and the resolution of a millisecond, cost some increments.
    (way + 20) / 50 * 50
}

#[test]
fn the_drive_says_what_it_is() {
    for (gear, text) in [(1, b"55:1    "), (2, b"62:1    "), (3, b"135:1   ")] {
        let setup = Setup { gear, ..Setup::new(&MODEL, NodeId::literal(1)) };
        let drive = SimulatedDrive::power_on(Instant::ZERO, setup);
        let mut rig = Rig::with(SerialDrive::new(drive), Settings::default());
        assert_eq!(rig.drive.request(Command::Identity(Identity::Gear)).unwrap(), Answer::Text(*text));
        assert_eq!(rig.drive.request(Command::Identity(Identity::Bus)).unwrap(), Answer::Text(*b"CAN     "));
    }
}
