//! The states of a drive, and which control words lead from one to another.

use lexican_eds::model::Direction;
use lexican_runtime::CobId;
use lexican_runtime::profile::cia402::{Cause, Command, State, Transitions, control, status};
use lexican_runtime::wire::nmt::NmtCommand;

use crate::axis::{Axis, ENABLE};
use crate::case::{Case, drive};
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure, not_applicable};

const TRANSITIONS: &str =
    "A command of the control word brings about the transitions that the state machine has for it.";
const NO_OTHER: &str = "A command for which a state has no transition has no effect in it.";

pub(crate) const CASES: &[Case] = &[
    drive("402/8.1/1", "a reset leads to SWITCH ON DISABLED", |t| {
        Axis::of(t)?.bring(State::OperationEnabled)?;
        t.reset(NmtCommand::ResetNode)?;
        Axis::of(t)?.reaches(&[State::SwitchOnDisabled]).map(|_| ())
    })
    .requires("After a reset the power stage is off, and the drive comes to SWITCH ON DISABLED by itself."),
    drive("402/8.1/2", "shutdown leads to READY TO SWITCH ON (2)", |t| transition(t, 2)).requires(TRANSITIONS),
    drive("402/8.1/3", "switch on leads to SWITCHED ON (3)", |t| transition(t, 3)).requires(TRANSITIONS),
    drive("402/8.1/4", "enable operation leads to OPERATION ENABLED (4)", |t| transition(t, 4)).requires(TRANSITIONS),
    drive("402/8.1/5", "disable operation leads back to SWITCHED ON (5)", |t| transition(t, 5)).requires(TRANSITIONS),
    drive("402/8.1/6", "shutdown leads back to READY TO SWITCH ON (6)", |t| transition(t, 6)).requires(TRANSITIONS),
    drive("402/8.1/7", "disable voltage leads out of READY TO SWITCH ON (7)", |t| transition(t, 7))
        .requires(TRANSITIONS),
    drive("402/8.1/8", "shutdown leads out of OPERATION ENABLED (8)", |t| transition(t, 8)).requires(TRANSITIONS),
    drive("402/8.1/9", "disable voltage leads out of OPERATION ENABLED (9)", |t| transition(t, 9))
        .requires(TRANSITIONS),
    drive("402/8.1/10", "disable voltage leads out of SWITCHED ON (10)", |t| transition(t, 10)).requires(TRANSITIONS),
    drive("402/8.1/11", "quick stop leads out of OPERATION ENABLED (11)", |t| {
        let mut axis = Axis::of(t)?;
        axis.enable()?;
        let states = [State::QuickStopActive, State::SwitchOnDisabled];
        axis.leads_to(Command::QuickStop.apply(0), &states).map(|_| ())
    })
    .requires(TRANSITIONS),
    drive("402/8.1/12", "disable voltage leads out of QUICK STOP ACTIVE (12)", |t| {
        let mut axis = Axis::of(t)?;
        axis.bring_to_quick_stop()?;
        axis.leads_to(Command::DisableVoltage.apply(0), &[State::SwitchOnDisabled]).map(|_| ())
    })
    .requires(TRANSITIONS),
    drive(
        "402/8.1/16",
        "enable operation leads out of QUICK STOP ACTIVE, if the drive stays there by 605Ah (16)",
        |t| {
            t.has(&[0x605A])?;
            let mut axis = Axis::of(t)?;
            axis.bring_to_quick_stop()?;
            axis.leads_to(ENABLE, &[State::OperationEnabled]).map(|_| ())
        },
    )
    .requires(TRANSITIONS),
    drive("402/8.1/17", "quick stop leads out of READY TO SWITCH ON and SWITCHED ON (7, 10)", |t| {
        let mut axis = Axis::of(t)?;
        axis.names_its_kind()?;
        for from in [State::ReadyToSwitchOn, State::SwitchedOn] {
            axis.bring(from)?;
            axis.leads_to(Command::QuickStop.apply(0), &[State::SwitchOnDisabled])?;
        }
        Ok(())
    })
    .requires(TRANSITIONS),
    drive("402/8.4.1/1", "no command but shutdown leads out of SWITCH ON DISABLED", |t| {
        stays(t, State::SwitchOnDisabled, &[0x00, 0x02, 0x07, 0x0F, 0x80])
    })
    .requires(NO_OTHER),
    drive("402/8.4.1/2", "shutdown and fault reset do not lead out of READY TO SWITCH ON", |t| {
        stays(t, State::ReadyToSwitchOn, &[0x06, 0x86])
    })
    .requires(NO_OTHER),
    drive("402/8.4.1/3", "switch on and fault reset do not lead out of SWITCHED ON", |t| {
        stays(t, State::SwitchedOn, &[0x07, 0x87])
    })
    .requires(NO_OTHER),
    drive("402/8.4.1/4", "enable operation and fault reset do not lead out of OPERATION ENABLED", |t| {
        stays(t, State::OperationEnabled, &[0x0F, 0x8F])
    })
    .requires(NO_OTHER),
    drive("402/8.4.1/5", "switch on, shutdown and fault reset do not lead out of QUICK STOP ACTIVE", |t| {
        let mut axis = Axis::of(t)?;
        axis.bring_to_quick_stop()?;
        [0x02, 0x06, 0x07, 0x82].into_iter().try_for_each(|word| axis.ignores(word, State::QuickStopActive))
    })
    .requires(NO_OTHER),
    drive("402/8.4.1/6", "the bits of the modes and halt do not matter to the state", |t| {
        let mut axis = Axis::of(t)?;
        for (command, state) in [
            (Command::Shutdown, State::ReadyToSwitchOn),
            (Command::SwitchOn, State::SwitchedOn),
            (Command::EnableOperation, State::OperationEnabled),
        ] {
            axis.leads_to(command.apply(control::HALT), &[state])?;
        }
        axis.leads_to(control::HALT, &[State::SwitchOnDisabled]).map(|_| ())
    })
    .requires("The bits of a control word that belong to the mode, and halt, are no part of its commands."),
    drive("402/8.4.2/1", "in OPERATION ENABLED and SWITCHED ON the voltage is shown as enabled (bit 4)", |t| {
        shows_in(t, status::VOLTAGE_ENABLED, &[State::SwitchedOn, State::OperationEnabled])
    })
    .requires("Bit 4 of the status word is set while the power stage has its voltage.")
    .recommended(),
    drive("402/8.4.2/2", "remote is shown while control words count (bit 9)", |t| {
        shows_in(t, status::REMOTE, &[State::ReadyToSwitchOn, State::OperationEnabled])
    })
    .requires("Bit 9 of the status word is set while the drive obeys the control word.")
    .recommended(),
    drive("402/6040h/1", "an RPDO gives control words", |t| {
        let mut axis = Axis::of(t)?;
        axis.has_control_pdo()?;
        axis.leads_to(0x06, &[State::ReadyToSwitchOn]).map(|_| ())
    })
    .requires("The control word may be mapped into an RPDO, and is obeyed as it comes."),
    drive("402/6040h/2", "SDO gives control words", |t| {
        let mut axis = Axis::of(t)?;
        axis.order_by_sdo(0x06)?;
        axis.reaches(&[State::ReadyToSwitchOn]).map(|_| ())
    })
    .requires("The control word can be written by SDO.")
    .recommended(),
    drive("402/6041h/1", "the TPDO that begins with the status word is sent when the state changes", |t| {
        let mut axis = Axis::of(t)?;
        let pdo = axis.t.sheet.device.pdos.iter().find(|pdo| {
            let begins = pdo.mapping.first().is_some_and(|mapped| (mapped.index, mapped.sub) == (0x6041, 0));
            begins && pdo.direction == Direction::Transmit && pdo.transmission_type >= Some(254)
        });
        let number =
            pdo.ok_or_else(|| not_applicable("no TPDO begins with the status word and is sent by events"))?.number;
        let cob_id = axis.t.read(0x17FF + number, 1)? as u32;
        if cob_id >> 31 != 0 {
            return Err(not_applicable("the TPDO that begins with the status word is not valid by default"));
        }
        let id = CobId::from_parameter(cob_id);
        let before = axis.t.frames().len();
        axis.order(0x06)?;
        axis.t.hear_ms(500)?;
        // The last PDO counts, since it has the final state.
        let last = axis.t.frames()[before..].iter().rfind(|record| record.frame.id() == id);
        let word = last.and_then(|record| record.frame.data().first_chunk().copied()).map(u16::from_le_bytes);
        let sent = word.and_then(State::from_status_word) == Some(State::ReadyToSwitchOn);
        ensure(sent, || format!("{id} does not come with READY TO SWITCH ON"))
    })
    .requires("A TPDO with the status word is sent when that changes, if it is event-driven."),
];

/// Tries each arrow of the standard's figure with this number that a command makes, except for quick stop.
fn transition(t: &mut Tester<'_>, number: u8) -> Outcome {
    let mut axis = Axis::of(t)?;
    for arrow in Transitions::CIA_402.0.iter().filter(|arrow| arrow.number == number) {
        let Cause::Command(command) = arrow.cause else { continue };
        if command == Command::QuickStop {
            continue;
        }
        axis.bring(State::SwitchOnDisabled)?;
        axis.bring(arrow.from)?;
        axis.leads_to(command.apply(0), &[arrow.to])?;
        // The state has to last.
        axis.stays(arrow.to, "the command")?;
    }
    Ok(())
}

fn stays(t: &mut Tester<'_>, state: State, words: &[u16]) -> Outcome {
    let mut axis = Axis::of(t)?;
    axis.bring(state)?;
    words.iter().try_for_each(|word| axis.ignores(*word, state))
}

fn shows_in(t: &mut Tester<'_>, bits: u16, states: &[State]) -> Outcome {
    let mut axis = Axis::of(t)?;
    for state in states {
        axis.bring(*state)?;
        let word = axis.status()?;
        ensure(word & bits == bits, || format!("the status word is {word:04X}h in {state}"))?;
    }
    Ok(())
}
