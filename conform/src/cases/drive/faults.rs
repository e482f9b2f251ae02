//! Faults that the test can cause by itself: a lost heartbeat (6007h), and a set-point too far away (6065h).

use lexican_runtime::profile::cia402::{Command, State};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, NodeId};

use super::cyclic::{cycle, cyclic};
use super::options;
use crate::axis::{Axis, CYCLIC_POSITION, Ramp};
use crate::case::{Case, drive};
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure, failed, not_applicable};

const LOST: &str = "6007h says what the drive does when it loses its connection.";

pub(crate) const CASES: &[Case] = &[
    drive("402/8.1/13", "a fault stops the drive, and leads to FAULT (13, 14)", |t| {
        let mut axis = Axis::of(t)?;
        consumes_heartbeat(&mut axis)?;
        axis.stops(loses_heartbeat)?;
        is_faulty(&mut axis)?;
        axis.stays(State::Fault, "a fault")
    })
    .requires("A fault leads by FAULT REACTION ACTIVE to FAULT, in which the drive stands."),
    drive("402/8.1/15", "fault reset leads out of FAULT (15)", |t| {
        let mut axis = faulty(t)?;
        axis.order(0)?;
        axis.leads_to(Command::FaultReset.apply(0), &[State::SwitchOnDisabled])?;
        axis.stays(State::SwitchOnDisabled, "fault reset")
    })
    .requires("Fault reset leads from FAULT to SWITCH ON DISABLED once the fault is gone."),
    drive("402/8.4.1/7", "no command but fault reset leads out of FAULT", |t| {
        let mut axis = faulty(t)?;
        [0x00, 0x02, 0x06, 0x07, 0x0F].into_iter().try_for_each(|word| axis.ignores(word, State::Fault))
    })
    .requires("In FAULT the control word has no command but fault reset."),
    drive("402/8.4.1/8", "a fault is reset by the rising edge of bit 7, not by its level", |t| {
        let mut axis = Axis::of(t)?;
        consumes_heartbeat(&mut axis)?;
        for (word, state) in [
            (0x80, State::SwitchOnDisabled),
            (0x86, State::ReadyToSwitchOn),
            (0x87, State::SwitchedOn),
            (0x8F, State::OperationEnabled),
        ] {
            axis.order(word)?;
            axis.t.hear_ms(100)?;
            if axis.state()? != state {
                return Err(not_applicable("no command counts while bit 7 is set, so a fault cannot meet it"));
            }
        }
        loses_heartbeat(&mut axis)?;
        is_faulty(&mut axis)?;
        [0x8F, 0x80].into_iter().try_for_each(|word| axis.ignores(word, State::Fault))
    })
    .requires("Fault reset is the change of bit 7 from 0 to 1."),
    drive("402/603Fh/1", "a fault has a code in 603Fh, and an emergency with it comes", |t| {
        t.has(&[0x603F])?;
        let mut axis = faulty(t)?;
        axis.t.hear_ms(100)?;
        let code = axis.number(0x603F, 0)?;
        ensure(code != 0, || "603Fh is 0 in FAULT")?;
        ensure(emergencies(&axis).contains(&(code as u16)), || format!("no emergency with {code:04X}h came"))
    })
    .requires("603Fh has the code of the last error, which an emergency carries as well."),
    drive("402/603Fh/2", "when no fault and no error is left, an emergency says so (0000h)", |t| {
        let mut axis = faulty(t)?;
        resets(&mut axis)?;
        axis.t.hear_ms(100)?;
        ensure(emergencies(&axis).last() == Some(&0), || "no emergency 0000h came")
    })
    .requires("The emergency 0000h says that no error is left."),
    drive("402/605Eh/1", "the fault reaction stops the drive with each value of 605Eh", |t| {
        let mut axis = Axis::of(t)?;
        for code in axis.options(0x605E, 0..=4)? {
            axis.set(0x605E, 0, code)?;
            consumes_heartbeat(&mut axis)?;
            axis.stops(loses_heartbeat)?;
            is_faulty(&mut axis)?;
            resets(&mut axis)?;
        }
        Ok(())
    })
    .requires("605Eh says how the drive is brought to rest when a fault comes."),
    drive("402/605Eh/2", "the fault reaction has the ramp that 605Eh asks for", |t| {
        // This may be inapplicable, so it comes before any motion.
        consumes_heartbeat(&mut Axis::of(t)?)?;
        options::ramps(t, 0x605E, &[(1, Ramp::SlowDown), (2, Ramp::QuickStop)], |axis| {
            if axis.state()? != State::OperationEnabled {
                return Err(failed("the drive does not stay enabled"));
            }
            loses_heartbeat(axis)
        })
    })
    .requires(options::RAMPS),
    drive("402/6007h/1", "a lost heartbeat does with each value of 6007h what it asks for", |t| {
        let mut axis = Axis::of(t)?;
        for code in axis.options(0x6007, 0..=3)? {
            consumes_heartbeat(&mut axis)?;
            axis.set(0x6007, 0, code)?;
            axis.enable()?;
            loses_heartbeat(&mut axis)?;
            match code {
                0 => axis.stays(State::OperationEnabled, "6007h with 0")?,
                1 => is_faulty(&mut axis)?,
                2 => _ = axis.reaches(&[State::SwitchOnDisabled])?,
                _ => _ = axis.reaches(&[State::QuickStopActive, State::SwitchOnDisabled])?,
            }
            resets(&mut axis)?;
        }
        Ok(())
    })
    .requires(LOST),
    drive("402/6007h/2", "NMT stop is a lost connection, too", |t| {
        let mut axis = Axis::of(t)?;
        axis.options(0x6007, 1..=1)?;
        axis.enable()?;
        axis.t.enter(NmtState::Stopped)?;
        axis.t.hear_ms(100)?;
        axis.t.enter(NmtState::Operational)?;
        is_faulty(&mut axis)
    })
    .requires(LOST),
    drive("402/6065h/1", "a set-point of mode 8 beyond 6065h is a following error", |t| {
        t.has(&[0x6065])?;
        let mut axis = cyclic(t, CYCLIC_POSITION, &[0x607A, 0x6064])?;
        let (here, travel) = (axis.position()?, axis.motion.travel);
        axis.set(0x607A, 0, here)?;
        axis.set(0x6065, 0, 1)?;
        axis.set_if_it_can(0x6066, 0)?;
        axis.bring(State::OperationEnabled)?;
        cycle(&mut axis)?;
        axis.set(0x607A, 0, here + travel)?;
        for _ in 0..10 {
            cycle(&mut axis)?;
        }
        let state = axis.state()?;
        ensure(state == State::Fault || state == State::FaultReactionActive, || format!("the drive is in {state}"))
    })
    .requires("A following error larger than 6065h, for longer than 6066h, is shown by bit 13."),
];

/// The node whose heartbeat is lost.
fn manager(t: &Tester<'_>) -> NodeId {
    NodeId::literal(if t.node.get() == 127 { 126 } else { 127 })
}

const CONSUMER_MS: u32 = 50;

/// Makes the drive expect a heartbeat once the first one has come, and fault if it is missing (6007h).
fn consumes_heartbeat(axis: &mut Axis<'_, '_>) -> Outcome {
    axis.t.has(&[0x1016])?;
    axis.t.entry(0x1016, 1)?;
    let node = u32::from(manager(axis.t).get());
    let answer = axis.t.try_write(0x1016, 1, node << 16 | CONSUMER_MS)?;
    answer
        .map_err(|code| not_applicable(format!("1016h:01h does not take node {node} and {CONSUMER_MS} ms: {code}")))?;
    axis.set_if_it_can(0x6007, 1).map(|_| ())
}

/// Sends one heartbeat, and no more. Afterwards the drive no longer expects any.
fn loses_heartbeat(axis: &mut Axis<'_, '_>) -> Outcome {
    let id = CobId::of_node(0x700, manager(axis.t));
    axis.t.send(id, &[5])?;
    axis.t.hear(Duration::from_millis(2 * u64::from(CONSUMER_MS)))?;
    // Without a heartbeat a device leaves OPERATIONAL (CiA 301, 1029h), and RPDOs have no effect.
    axis.t.enter(NmtState::Operational)
}

/// Checks that the drive is in FAULT, or on the way there.
fn is_faulty(axis: &mut Axis<'_, '_>) -> Outcome {
    let said = axis.t.has(&[0x6007]).is_ok();
    match axis.state()? {
        State::Fault | State::FaultReactionActive => axis.reaches(&[State::Fault]).map(|_| ()),
        state if said => Err(failed(format!("the drive is in {state}, and not in FAULT"))),
        _ => Err(not_applicable("no object 6007h, and a lost heartbeat is no fault")),
    }
}

/// Leads a drive to FAULT.
fn faulty<'t, 'a>(t: &'t mut Tester<'a>) -> Outcome<Axis<'t, 'a>> {
    let mut axis = Axis::of(t)?;
    consumes_heartbeat(&mut axis)?;
    axis.enable()?;
    loses_heartbeat(&mut axis)?;
    is_faulty(&mut axis)?;
    Ok(axis)
}

fn resets(axis: &mut Axis<'_, '_>) -> Outcome {
    axis.t.write(0x1016, 1, 0)?;
    axis.bring(State::SwitchOnDisabled)
}

/// The emergency codes that have come in this case.
fn emergencies(axis: &Axis<'_, '_>) -> Vec<u16> {
    let id = axis.t.emergency_id();
    let come = axis.t.frames().iter().filter(|record| !record.sent && record.frame.id() == id);
    come.filter_map(|record| record.frame.data().first_chunk().copied()).map(u16::from_le_bytes).collect()
}
