//! What the port may do: control authority, switches, limits, inputs, values, and what is kept.

use super::serial_rig::Rig;
use lexican_driver::Direction;
use lexican_runtime::host::Node;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use siko_ag02::sim::{MODEL, Setup, SimulatedDrive};
use siko_serial::Settings;
use siko_serial::answer::{Answer, Flags};
use siko_serial::command::{Command, Identity, Long, Mode, PosType, Setting, Short, Turning};
use siko_serial::error::ErrorNumber;
use siko_serial::sim::SerialDrive;

const LIMIT_SWITCHES: [(usize, Direction, ErrorNumber); 2] =
    [(0, Direction::Positive, ErrorNumber::LIMIT_SWITCH_1), (1, Direction::Negative, ErrorNumber::LIMIT_SWITCH_2)];

/// Sends the drive an NMT command over its bus.
fn nmt(rig: &mut Rig, command: u8, state: NmtState) {
    rig.drive.line().with_drive(|drive, now| {
        let drive = drive.drive_mut();
        while drive.poll_transmit(now).is_some() {}
        drive.handle_frame(now, &Frame::from_array(CobId::NMT, [command, 0]));
        assert_eq!(drive.nmt_state(), state);
    });
}

#[test]
fn the_bus_in_command_leaves_reading_and_the_stops() {
    for (command, state) in [(0x01, NmtState::Operational), (0x02, NmtState::Stopped)] {
        let mut rig = Rig::new();
        rig.done(Command::WriteLong(Long::Setpoint, 5000));
        rig.done(Command::Start);
        rig.pass(Duration::from_secs(1));
        nmt(&mut rig, command, state);
        assert!(rig.is("xxxx xxxx 1xxx xxxx"), "the bus finds the motor released");
        rig.pass(Duration::from_secs(5));
        for command in [
            Command::WriteLong(Long::Setpoint, 1),
            Command::WriteShort(Short::Window, 1),
            Command::Abort,
            Command::SetPosType(PosType::Direct),
            Command::Start,
            Command::Release,
            Command::Set(Setting::ResetFault),
            Command::SetTurning(Turning::JogStopsFully),
            Command::SetMode(Mode::Velocity),
            Command::Step,
        ] {
            rig.refuses(command, ErrorNumber::NO_AUTHORITY);
        }
        rig.done(Command::EmergencyStop);
        rig.done(Command::Stop);
        assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 5000);
        // Neither is answered, and neither does anything.
        let before = rig.number(Command::Position);
        rig.drive.start_inching(Direction::Positive);
        rig.pass(Duration::from_secs(1));
        rig.drive.stop_inching();
        rig.done(Command::Restart);
        assert_eq!((rig.number(Command::Position), rig.number(Command::ReadLong(Long::Setpoint))), (before, 5000));
        nmt(&mut rig, 0x80, NmtState::PreOperational);
        rig.done(Command::Start);
    }
}

/// `N` and `O` stop what the bus has ordered.
#[test]
fn the_stops_interrupt_a_travel_of_the_bus() {
    let mut rig = Rig::new();
    nmt(&mut rig, 0x01, NmtState::Operational);
    rig.drive.line().with_drive(|drive, now| {
        for word in [0x06, 0x07, 0x0F] {
            drive
                .drive_mut()
                .handle_frame(now, &Frame::from_array(CobId::of_node(0x200, NodeId::literal(127)), [word, 1]));
        }
        let travel = [0x1F, 0x00, 0x88, 0x13, 0x00, 0x00];
        drive.drive_mut().handle_frame(now, &Frame::from_array(CobId::of_node(0x400, NodeId::literal(127)), travel));
    });
    rig.reaches("x1xx 10x0 0001 0000");
    rig.done(Command::Stop);
    rig.reaches("x10x 10x0 0000 0000");
    assert!(rig.number(Command::Position) < 5000);
}

#[test]
fn on_a_limit_switch_only_inching_leads_back() {
    for (switch, towards, number) in LIMIT_SWITCHES {
        let mut rig = Rig::new();
        rig.world(|inputs| inputs.limit_switches[switch] = true);
        rig.done(Command::WriteLong(Long::Setpoint, 5000));
        rig.refuses(Command::Start, number);
        let (there, back) = if towards == Direction::Positive { (100, -100) } else { (-100, 100) };
        rig.done(Command::WriteLong(Long::DeltaJog, there));
        rig.refuses(Command::Step, number);
        rig.drive.start_inching(towards);
        rig.pass(Duration::from_secs(1));
        rig.drive.stop_inching();
        rig.pass(Duration::from_secs(1));
        assert_eq!(rig.number(Command::Position), 0);
        rig.done(Command::WriteLong(Long::DeltaJog, back));
        rig.done(Command::Step);
        rig.pass(Duration::from_secs(5));
        assert_eq!(rig.number(Command::Position), back);
        // In velocity mode they have no meaning.
        rig.done(Command::SetMode(Mode::Velocity));
        rig.done(Command::Start);
    }
}

#[test]
fn beyond_a_limit_only_inching_leads_back() {
    for (limit, setpoint, number) in [
        (Command::WriteLong(Long::UpperLimit, -10), -20, ErrorNumber::UPPER_LIMIT),
        (Command::WriteLong(Long::LowerLimit, 10), 20, ErrorNumber::LOWER_LIMIT),
    ] {
        let mut rig = Rig::new();
        rig.done(limit);
        rig.done(Command::WriteLong(Long::Setpoint, setpoint));
        rig.refuses(Command::Start, number);
        rig.done(Command::WriteLong(Long::DeltaJog, -setpoint));
        rig.refuses(Command::Step, number);
        rig.done(Command::WriteLong(Long::DeltaJog, setpoint));
        rig.done(Command::Step);
    }
}

#[test]
fn without_the_enable_input_nothing_moves() {
    let mut rig = Rig::new();
    rig.world(|inputs| inputs.enable = false);
    assert!(rig.is("xxxx 11xx 1xxx xxxx"));
    rig.refuses(Command::Start, ErrorNumber::NOT_ENABLED);
    rig.refuses(Command::Step, ErrorNumber::NOT_ENABLED);
    rig.world(|inputs| inputs.limit_switches = [true; 2]);
    rig.refuses(Command::Step, ErrorNumber::NOT_ENABLED);
}

#[test]
fn values_are_those_of_chapter_8() {
    use ErrorNumber as E;
    let mut rig = Rig::new();
    for (command, number) in [
        (Command::WriteShort(Short::ControllerP, 0), E::VALUE_RANGE),
        (Command::WriteShort(Short::APos, 101), E::VALUE_RANGE),
        (Command::WriteShort(Short::APos, 300), E::VALUE_RANGE),
        (Command::WriteShort(Short::VPos, 101), E::VALUE_RANGE),
        (Command::WriteShort(Short::Window, 99_999), E::VALUE_RANGE),
        (Command::WriteShort(Short::BitRate, 12), E::VALUE_RANGE),
        (Command::WriteShort(Short::BusAddress, 128), E::VALUE_RANGE),
        (Command::WriteLong(Long::CalibrationValue, 1_000_000), E::VALUE_RANGE),
        (Command::WriteLong(Long::DeltaJog, 1_000_001), E::VALUE_RANGE),
        // "Wert muss groesser 'unterer Grenzwert' sein", and equal ones switch the limits off.
        (Command::WriteLong(Long::UpperLimit, -1_000_001), E::VALUE_RANGE),
        (Command::WriteLong(Long::LowerLimit, 1_000_001), E::VALUE_RANGE),
        (Command::WriteLong(Long::Setpoint, 1_000_001), E::SETPOINT_BEYOND_LIMIT),
    ] {
        rig.refuses(command, number);
    }
    rig.done(Command::SetMode(Mode::Velocity));
    rig.refuses(Command::WriteLong(Long::Setpoint, 101), E::VALUE_RANGE);
    rig.done(Command::WriteLong(Long::Setpoint, -100));
    rig.done(Command::Start);
    rig.refuses(Command::SetMode(Mode::Positioning), E::OPERATING_STATE);
    rig.refuses(Command::Set(Setting::Calibrate), E::OPERATING_STATE);
}

#[test]
fn flags_show_what_was_chosen() {
    let mut rig = Rig::new();
    for (command, flags) in [
        (Command::SetPosType(PosType::LoopPositive), Flags::LOOP_POSITIVE),
        (Command::SetPosType(PosType::LoopNegative), Flags::LOOP_NEGATIVE),
        (Command::SetTurning(Turning::SenseE), Flags::LOOP_NEGATIVE | Flags::SENSE_E),
        (Command::SetTurning(Turning::JogStopsByRamp), Flags::LOOP_NEGATIVE | Flags::SENSE_E),
        (Command::SetMode(Mode::Velocity), Flags::LOOP_NEGATIVE | Flags::SENSE_E | Flags::VELOCITY),
        (Command::SetTurning(Turning::SenseI), Flags::LOOP_NEGATIVE | Flags::VELOCITY),
        (Command::SetPosType(PosType::Direct), Flags::VELOCITY),
        (Command::SetMode(Mode::Positioning), 0),
    ] {
        rig.done(command);
        assert_eq!(rig.drive.request(Command::Flags).unwrap(), Answer::Flags(Flags(flags)), "{command:?}");
    }
}

#[test]
fn calibration_makes_the_value_the_position() {
    let mut rig = Rig::new();
    rig.done(Command::WriteLong(Long::CalibrationValue, 700));
    assert_eq!(rig.number(Command::Position), 700);
    rig.done(Command::Step);
    rig.pass(Duration::from_secs(10));
    assert_eq!(rig.number(Command::BinaryPosition), 2300);
    rig.done(Command::Set(Setting::Calibrate));
    assert_eq!(rig.number(Command::Position), 700);
}

#[test]
fn a_restart_keeps_parameters_and_not_the_setpoint() {
    let mut rig = Rig::new();
    for command in [
        Command::WriteShort(Short::APos, 33),
        Command::WriteLong(Long::DeltaJog, -7),
        Command::SetTurning(Turning::JogStopsByRamp),
        Command::WriteLong(Long::Setpoint, 1),
    ] {
        rig.done(command);
    }
    rig.done(Command::Restart);
    assert_eq!(rig.number(Command::ReadShort(Short::APos)), 33);
    assert_eq!(rig.number(Command::ReadLong(Long::DeltaJog)), -7);
    assert_eq!(rig.number(Command::ReadLong(Long::Setpoint)), 0);
    assert_eq!(braking(&mut rig), 400, "parameter 25 is kept, too");
    for (setting, a_pos, delta, way) in [
        (Setting::ControllerParameters, 50, -7, 400),
        (Setting::StandardParameters, 50, 1600, 50),
        (Setting::AllParameters, 50, 1600, 50),
    ] {
        rig.done(Command::Set(setting));
        assert_eq!(rig.number(Command::ReadShort(Short::APos)), a_pos);
        assert_eq!(rig.number(Command::ReadLong(Long::DeltaJog)), delta);
        assert_eq!(braking(&mut rig), way, "{setting:?}");
    }
}

/// The way in which inching operation 2 stops: from 30 rev/min, with 100 % or 12 %.
fn braking(rig: &mut Rig) -> i32 {
    let (a, v) = (Command::ReadShort(Short::AJog), Command::ReadShort(Short::VJog));
    let kept = [rig.number(a), rig.number(v)];
    rig.done(Command::WriteShort(Short::AJog, 12));
    rig.done(Command::WriteShort(Short::VJog, 30));
    rig.drive.start_inching(Direction::Positive);
    rig.pass(Duration::from_secs(3));
    rig.drive.stop_inching();
    while rig.drive.line().with_drive(|drive, now| drive.drive().velocity(now)) == 30 {
        rig.pass(Duration::from_millis(1));
    }
    let before = rig.position();
    rig.pass(Duration::from_secs(5));
    let way = rig.position() - before;
    rig.done(Command::WriteShort(Short::AJog, kept[0] as u32));
    rig.done(Command::WriteShort(Short::VJog, kept[1] as u32));
    // The last speed that shows as 30, and the millisecond, make some increments.
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
