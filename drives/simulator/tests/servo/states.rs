//! The state machine with its option codes, halt, faults and the loss of power.

use lexican_runtime::profile::cia402::State::{self, *};

use lexican_runtime::wire::emcy::ErrorRegister;
use simulator::servo::Causes;

use crate::support::Rig;

/// Brings a servo into a state.
fn servo_in(state: State) -> Rig {
    let mut rig = Rig::new();
    match state {
        SwitchOnDisabled => {}
        ReadyToSwitchOn => drop(rig.control(0x06)),
        SwitchedOn => drop(rig.control(0x06).control(0x07)),
        OperationEnabled => drop(rig.enable()),
        QuickStopActive => drop(rig.set(0x605A, 0, 6).enable().control(0x02)),
        Fault => {
            rig.inputs(|inputs| inputs.faults = 0x4310.into()).inputs(|inputs| inputs.faults = Causes::NONE);
        }
        _ => unreachable!("not commanded"),
    }
    assert_eq!(rig.state(), state);
    rig
}

#[test]
fn every_command_leads_where_figure_8_has_it() {
    // Shutdown, switch on, disable voltage, quick stop, enable operation, fault reset.
    let words = [0x06, 0x07, 0x00, 0x02, 0x0F, 0x80];
    let [off, ready, on, enabled] = [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled];
    let [stopped, fault] = [QuickStopActive, Fault];
    for (from, to) in [
        (off, [ready, off, off, off, off, off]),
        (ready, [ready, on, off, off, ready, ready]),
        (on, [ready, on, off, off, enabled, on]),
        (enabled, [ready, on, off, stopped, enabled, enabled]),
        (stopped, [stopped, stopped, off, stopped, enabled, stopped]),
        (fault, [fault, fault, fault, fault, fault, off]),
    ] {
        for (word, to) in words.into_iter().zip(to) {
            let mut rig = servo_in(from);
            rig.set(0x605A, 0, 6).control(word).pass(1);
            assert_eq!(rig.state(), to, "{word:#04X} in {from}");
        }
    }
}

#[test]
fn a_servo_that_stands_is_disabled_at_once() {
    let mut rig = servo_in(OperationEnabled);
    rig.control(0x07);
    assert_eq!(rig.state(), SwitchedOn);
    for option in 1..=4 {
        let mut rig = servo_in(OperationEnabled);
        rig.set(0x605A, 0, option).control(0x02);
        assert_eq!(rig.state(), SwitchOnDisabled, "605Ah is {option}");
    }
}

/// A servo that moves with 1000 units/s in velocity mode, where ramps are easiest to write.
fn running() -> Rig {
    let mut rig = Rig::enabled(3);
    rig.set(0x60FF, 0, 1000).pass(1000);
    assert_eq!(rig.velocity(), 1000);
    rig
}

/// Checks how an option code stops a running axis: the time until it stands, and the states meanwhile and at last.
#[track_caller]
fn check_stop(rig: &mut Rig, stands_after_ms: u64, meanwhile: State, at_last: State) {
    if stands_after_ms > 0 {
        rig.pass(stands_after_ms - 1);
        assert_ne!(rig.velocity(), 0);
        assert_eq!(rig.state(), meanwhile);
        rig.pass(1);
    }
    assert_eq!(rig.velocity(), 0);
    assert_eq!(rig.state(), at_last);
}

/// 6084h takes 100 ms, 6085h 10 ms, the strongest ramp 1 ms, and an axis without torque 100 ms.
#[test]
fn option_codes_stop_as_they_say() {
    let [off, ready, on] = [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn];
    let [enabled, stopped, reacts] = [OperationEnabled, QuickStopActive, FaultReactionActive];
    for (object, option, word, ms, meanwhile, at_last) in [
        (0x605A, 0, 0x02, 100, off, off),
        (0x605A, 1, 0x02, 100, stopped, off),
        (0x605A, 2, 0x02, 10, stopped, off),
        (0x605A, 3, 0x02, 1, stopped, off),
        (0x605A, 4, 0x02, 1, stopped, off),
        (0x605A, 5, 0x02, 100, stopped, stopped),
        (0x605A, 6, 0x02, 10, stopped, stopped),
        (0x605A, 7, 0x02, 1, stopped, stopped),
        (0x605A, 8, 0x02, 1, stopped, stopped),
        (0x605B, 0, 0x06, 100, ready, ready),
        (0x605B, 1, 0x06, 100, enabled, ready),
        (0x605C, 0, 0x07, 100, on, on),
        (0x605C, 1, 0x07, 100, enabled, on),
        (0x605D, 1, 0x10F, 100, enabled, enabled),
        (0x605D, 2, 0x10F, 10, enabled, enabled),
        (0x605D, 3, 0x10F, 1, enabled, enabled),
        // There is no option: the axis coasts.
        (0x6060, 3, 0x00, 100, off, off),
    ] {
        let mut rig = running();
        rig.set(object, 0, option).control(word);
        check_stop(&mut rig, ms, meanwhile, at_last);
    }
    for (option, ms, meanwhile) in [(0, 100, Fault), (1, 100, reacts), (2, 10, reacts), (3, 1, reacts), (4, 1, reacts)]
    {
        let mut rig = running();
        rig.set(0x605E, 0, option).inputs(|inputs| inputs.faults = 0x7500.into());
        check_stop(&mut rig, ms, meanwhile, Fault);
    }
    for (option, ms, meanwhile, at_last) in [(1, 10, reacts, Fault), (2, 100, off, off), (3, 10, stopped, off)] {
        let mut rig = running();
        rig.set(0x6007, 0, option);
        rig.servo.lose_connection(rig.now, &mut rig.od);
        check_stop(&mut rig, ms, meanwhile, at_last);
    }
}

#[test]
fn a_lost_connection_without_action_changes_nothing() {
    let mut rig = running();
    rig.set(0x6007, 0, 0);
    rig.servo.lose_connection(rig.now, &mut rig.od);
    rig.pass(100);
    assert_eq!((rig.velocity(), rig.state()), (1000, OperationEnabled));
}

#[test]
fn disable_operation_is_taken_back_while_the_axis_brakes() {
    let mut rig = running();
    rig.control(0x07).pass(50).control(0x0F).pass(1000);
    assert_eq!((rig.velocity(), rig.state()), (1000, OperationEnabled));
}

#[test]
fn quick_stop_is_left_to_go_on_only_with_options_5_to_8() {
    let mut rig = running();
    rig.control(0x02).pass(1).control(0x0F);
    assert_eq!(rig.state(), QuickStopActive);
    let mut rig = running();
    rig.set(0x605A, 0, 6).control(0x02).pass(100);
    assert!(rig.status(1 << 10), "it stands");
    rig.set(0x60FF, 0, 0).control(0x0F).pass(10);
    assert_eq!((rig.velocity(), rig.state()), (0, OperationEnabled));
}

#[test]
fn a_fault_is_reported_once_and_reset_when_its_cause_is_gone() {
    let mut rig = running();
    rig.inputs(|inputs| inputs.faults = 0x4310.into()).pass(100);
    assert_eq!((rig.state(), rig.get(0x603F, 0), rig.emergencies()), (Fault, 0x4310, vec![0x4310]));
    rig.control(0x80);
    assert_eq!(rig.state(), Fault, "the cause lasts");
    rig.inputs(|inputs| inputs.faults = Causes::NONE).control(0x00).control(0x80);
    assert_eq!((rig.state(), rig.get(0x603F, 0), rig.emergencies()), (SwitchOnDisabled, 0, vec![0]));
}

#[test]
fn a_warning_changes_nothing_but_bit_7() {
    let mut rig = running();
    rig.inputs(|inputs| inputs.warnings = 0x4300.into()).pass(1);
    assert!(rig.status(1 << 7));
    assert_eq!((rig.state(), rig.velocity(), rig.emergencies()), (OperationEnabled, 1000, vec![0x4300]));
    rig.inputs(|inputs| inputs.warnings = Causes::NONE);
    assert!(!rig.status(1 << 7));
    assert_eq!(rig.emergencies(), [0]);
}

#[test]
fn without_supply_or_enable_input_the_motor_gets_no_torque() {
    for (without, state, voltage) in [("supply", Fault, false), ("enable", SwitchOnDisabled, true)] {
        let change = |missing: bool| {
            move |inputs: &mut simulator::servo::Inputs| {
                *(if without == "supply" { &mut inputs.supply } else { &mut inputs.enable }) = !missing;
            }
        };
        let mut rig = running();
        rig.inputs(change(true));
        check_stop(&mut rig, 100, state, state);
        assert_eq!(rig.status(1 << 4), voltage);
        let mut rig = Rig::new();
        rig.inputs(change(true)).control(0x06).control(0x07);
        assert_eq!(rig.state(), ReadyToSwitchOn, "{without}");
        rig.inputs(change(false)).control(0x06).control(0x07);
        assert_eq!(rig.state(), SwitchedOn, "{without}");
    }
}

#[test]
fn an_edge_that_comes_with_the_command_to_enable_starts_nothing() {
    let mut rig = Rig::new();
    rig.set(0x607A, 0, 500).control(0x06).control(0x07).control(0x1F).pass(2000);
    assert_eq!((rig.state(), rig.position()), (OperationEnabled, 0));
}

#[test]
fn a_mode_that_the_data_sheet_does_not_list_is_not_taken() {
    let mut rig = Rig::new();
    assert_eq!(rig.get(0x6061, 0), 1);
    for (mode, shown) in [(3, 3), (2, 3), (77, 3), (6, 6), (0, 6), (-1, 6), (10, 10)] {
        rig.set(0x6060, 0, mode);
        assert_eq!(rig.get(0x6061, 0), shown, "{mode}");
    }
}

#[test]
fn a_restart_forgets_everything_but_the_world() {
    let mut rig = running();
    rig.inputs(|inputs| inputs.digital = 1 << 16);
    rig.servo.restart(rig.now);
    rig.control(0).pass(50);
    assert_eq!((rig.state(), rig.velocity()), (SwitchOnDisabled, 500), "it runs out");
    rig.pass(50);
    assert_eq!((rig.velocity(), rig.position()), (0, 50), "it counts from where it was switched on");
    assert_eq!(rig.get(0x60FD, 0), 1 << 16);
}

/// Bits 0 to 6 of the status word, and the codes of the fault, if any.
#[test]
fn every_order_of_the_axis_ends_with_the_state_that_gave_it() {
    // Shutdown, disable, quick stop, no voltage, no enable input, a fault: each while it moves to 1000.
    let orders: [fn(&mut Rig); 6] = [
        |rig| _ = rig.control(0x06),
        |rig| _ = rig.control(0x07),
        |rig| _ = rig.control(0x02),
        |rig| _ = rig.control(0x00),
        |rig| _ = rig.inputs(|inputs| inputs.enable = false).inputs(|inputs| inputs.enable = true),
        |rig| _ = rig.inputs(|inputs| inputs.faults = 0x7500.into()).inputs(|inputs| inputs.faults = Causes::NONE),
    ];
    for order in orders {
        let mut rig = Rig::enabled(1);
        rig.travel(1000, 0).pass(500).travel(2000, 0);
        order(&mut rig);
        rig.pass(1000).control(0x00).control(0x80).enable();
        let stands = rig.position();
        rig.pass(5000);
        assert_eq!((rig.position(), rig.status(1 << 10)), (stands, true), "nothing is left of the travel");
        // A relative travel begins at the present position, not at an earlier target.
        rig.travel(10, 1 << 6).pass(1000);
        assert_eq!(rig.position(), stands + 10);
    }
}

/// The axis has no torque in the first three states. If it is enabled while it coasts, it brakes with 6084h.
#[test]
fn an_axis_that_runs_out_is_braked_when_it_is_enabled() {
    let mut rig = running();
    rig.set(0x6084, 0, 50_000).control(0x00).pass(50).set(0x60FF, 0, 0).set(0x6060, 0, 1).enable();
    assert_eq!(rig.velocity(), 500);
    assert_eq!(rig.pass(10).velocity(), 0);
}

/// The first fault decides: later ones add their codes, and change neither ramp nor state.
#[test]
fn faults_add_up_and_one_reset_clears_them() {
    let mut rig = running();
    rig.set(0x605E, 0, 1).inputs(|inputs| inputs.faults = 0x7500.into()).pass(50);
    assert_eq!((rig.state(), rig.velocity()), (FaultReactionActive, 500));
    rig.inputs(|inputs| _ = inputs.faults.insert(0x4310)).pass(49);
    assert_eq!(rig.state(), FaultReactionActive, "the ramp goes on");
    rig.pass(1);
    assert_eq!((rig.state(), rig.velocity(), rig.get(0x603F, 0)), (Fault, 0, 0x4310));
    assert_eq!((rig.servo.faults().to_vec(), rig.emergencies()), (vec![0x7500, 0x4310], vec![0x7500, 0x4310]));
    rig.inputs(|inputs| inputs.faults = Causes::NONE).pass(0);
    assert_eq!((rig.state(), rig.emergencies()), (Fault, vec![0]), "the last one waits for the reset");
    rig.control(0x00).control(0x80);
    assert_eq!(
        (rig.state(), rig.emergencies(), rig.servo.error_register()),
        (SwitchOnDisabled, vec![0], ErrorRegister::NONE)
    );
}

/// A fault of a servo without torque, or at standstill, has no reaction.
#[test]
fn a_fault_at_rest_is_a_fault_at_once() {
    for state in [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, QuickStopActive] {
        let mut rig = servo_in(state);
        rig.set(0x605E, 0, 1).inputs(|inputs| inputs.faults = 0x7500.into());
        assert_eq!(rig.state(), Fault, "in {state}");
    }
    // Without supply, it cannot brake.
    let mut rig = running();
    rig.set(0x605E, 0, 2).inputs(|inputs| inputs.supply = false);
    check_stop(&mut rig, 100, Fault, Fault);
}

#[test]
fn a_lost_connection_acts_only_on_an_enabled_axis() {
    for option in 0..=3 {
        for state in [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, Fault] {
            let mut rig = servo_in(state);
            rig.set(0x6007, 0, option);
            rig.servo.lose_connection(rig.now, &mut rig.od);
            assert_eq!(rig.state(), state, "option {option}");
        }
        let mut rig = servo_in(QuickStopActive);
        rig.set(0x6007, 0, option);
        rig.servo.lose_connection(rig.now, &mut rig.od);
        let to = [QuickStopActive, Fault, SwitchOnDisabled, QuickStopActive][option as usize];
        assert_eq!(rig.state(), to, "option {option}");
    }
}

/// CiA 301, table 48, by the class of the code of CiA 402-2, table 5.
#[test]
fn the_error_register_has_the_bit_of_the_code() {
    for (code, register) in [
        (0x1000, 0x01),
        (0x2310, 0x02),
        (0x2FFF, 0x02),
        (0x3210, 0x04),
        (0x3FFF, 0x04),
        (0x4310, 0x08),
        (0x4FFF, 0x08),
        (0x5530, 0x01),
        (0x7121, 0x20),
        (0x7300, 0x20),
        (0x7500, 0x01),
        (0x8110, 0x10),
        (0x8210, 0x10),
        (0x8611, 0x20),
        (0x8700, 0x20),
        (0xFF01, 0x80),
    ] {
        let mut rig = Rig::new();
        rig.inputs(|inputs| inputs.faults = code.into());
        assert_eq!(rig.servo.error_register().0 & !1, register & !1, "{code:04X}h");
    }
}

/// Events between two calls have the same result, whichever call comes second.
#[test]
fn every_call_first_lets_pass_what_has_passed() {
    let calls: [fn(&mut Rig); 5] = [
        |rig| rig.servo.lose_connection(rig.now, &mut rig.od),
        |rig| rig.servo.set_inputs(rig.now, &mut rig.od, |inputs| inputs.digital = 1 << 20),
        |rig| _ = rig.servo.turn(rig.now, &mut rig.od, 5.0),
        |rig| rig.servo.sync(rig.now, &mut rig.od),
        |rig| rig.servo.measure(rig.now, &mut rig.od),
    ];
    for (number, call) in calls.into_iter().enumerate() {
        let run = |update: bool| {
            let mut rig = running();
            rig.set(0x6007, 0, 3).control(0x02);
            rig.now += lexican_runtime::Duration::from_millis(10);
            if update {
                rig.pass(0);
            }
            call(&mut rig);
            let shown = (rig.get(0x6041, 0), rig.position(), rig.velocity(), rig.get(0x60FD, 0));
            (rig.servo.shaft(rig.now).position, shown, rig.servo.state())
        };
        assert_eq!(run(false), run(true), "call {number}");
    }
}

/// 6077h of a blocked shaft: full while the motor drives it, and zero without torque. A fault reaction ends at once,
/// because the axis stands.
#[test]
fn a_blocked_motor_gives_torque_while_it_has_any() {
    for (word, fault, torque) in [(0x0F, None, 1000), (0x00, None, 0), (0x0F, Some(0x7500), 0)] {
        let mut rig = running();
        rig.set(0x6065, 0, 0).set(0x605E, 0, 1).control(word).inputs(|inputs| inputs.faults = fault.into());
        rig.pass(10).inputs(|inputs| inputs.blocked = true).pass(10);
        assert_eq!((rig.velocity(), rig.get(0x6077, 0)), (0, torque), "{word:#X} {fault:?}");
    }
}

/// 60F8h: in velocity mode, bit 13 is set once the demand of a blocked shaft exceeds it.
#[test]
fn slippage_has_its_maximum() {
    let rows = [crate::support::SERVO, &[(0x60F8, 0, lexican_runtime::object::DataType::Unsigned32, 500)]].concat();
    for (velocity, slips) in [(500, false), (501, true), (-500, false), (-501, true)] {
        let mut rig = Rig::of(&simulator::servo::ServoModel::CIA_402, &rows);
        rig.set(0x6065, 0, 0).set(0x6060, 0, 3).enable().set(0x60FF, 0, velocity).pass(200);
        assert_eq!(rig.inputs(|inputs| inputs.blocked = true).mode_bits()[2], slips, "{velocity}");
    }
}

/// Bit 12 of homing remains without torque, but is not shown in another mode.
#[test]
fn homing_attained_is_shown_without_torque_in_its_mode_only() {
    let mut rig = Rig::enabled(6);
    rig.control(0x00);
    assert_eq!(rig.mode_bits(), [false; 3], "not yet");
    rig.set(0x6098, 0, 35).enable().control(0x1F).control(0x00);
    assert_eq!(rig.mode_bits(), [false, true, false]);
    rig.set(0x6060, 0, 1);
    assert_eq!(rig.mode_bits(), [false; 3]);
}

/// CiA 301, 7.2.7.1, transition 2: the end of an error is reported, with the remaining errors.
#[test]
fn an_error_that_ends_beside_others_leaves_theirs_in_the_error_register() {
    let mut rig = Rig::new();
    rig.inputs(|inputs| (inputs.warnings, inputs.faults) = (0x4300.into(), 0x7500.into()));
    let mut codes = rig.emergencies();
    codes.sort_unstable();
    assert_eq!(codes, [0x4300, 0x7500]);
    let ends = |rig: &mut Rig| {
        std::iter::from_fn(|| rig.servo.next_emergency())
            .filter(|emergency| emergency.code == 0)
            .map(|emergency| emergency.remaining)
            .collect::<Vec<_>>()
    };
    let (temperature, generic) = (ErrorRegister::TEMPERATURE, ErrorRegister::GENERIC);
    rig.inputs(|inputs| _ = inputs.warnings.insert(0x4210));
    assert_eq!(ends(&mut rig), []);
    rig.inputs(|inputs| inputs.warnings.remove(0x4300));
    assert_eq!(ends(&mut rig), [temperature | generic]);
    rig.inputs(|inputs| _ = inputs.faults.insert(0x4310));
    rig.inputs(|inputs| inputs.faults.remove(0x7500));
    assert_eq!((ends(&mut rig), rig.servo.faults().to_vec()), (vec![temperature], vec![0x4310]));
    rig.inputs(|inputs| inputs.warnings = Causes::NONE);
    assert_eq!(ends(&mut rig), [temperature]);
    rig.inputs(|inputs| inputs.faults = Causes::NONE).control(0x80);
    assert_eq!(ends(&mut rig), [ErrorRegister::NONE]);
}

#[test]
fn what_is_measured_is_not_what_is_written() {
    use lexican_runtime::object::Address;
    let measured = |index| simulator::servo::measures(Address::new(index, 0));
    assert!([0x6041, 0x6061, 0x6064, 0x606C, 0x6077, 0x60B9, 0x60BA, 0x60BD].into_iter().all(measured));
    assert!(![0x6040, 0x6060, 0x607A, 0x60B8, 0x60FF].into_iter().any(measured));
}
