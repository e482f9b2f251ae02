//! The state machine: edges of the control word become orders, and reports become the status word.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use siko::gateway::{Job, Report};
use siko::order::Order;
use siko::words::system::{
    ABOVE_UPPER_LIMIT, BATTERY_LOW, BELOW_LOWER_LIMIT, ENABLE_INACTIVE, FAULT, IN_POSITION, LAG_ERROR, MOTOR_RELEASED,
    MOVING, NO_SUPPLY, NOT_READY, OVERCURRENT, POSITIONING,
};

use super::rig::*;

#[test]
fn the_states_are_those_of_table_22() {
    let mut rig = Rig::operational(1);
    let mut shows = |word: u16, ordered: Option<Order>, released: bool, state: u16| {
        let jobs: Vec<Job> = ordered.into_iter().map(|ordered| order(ordered, 0)).collect();
        assert_eq!(rig.control(word), jobs, "{word:04X}");
        if ordered.is_some() {
            rig.sees_and_is_done(if released { MOTOR_RELEASED } else { 0 });
        }
        assert_eq!(rig.status(), state, "after {word:04X}");
    };
    shows(0x010F, None, true, 0x0270);
    shows(0x0106, None, true, 0x0231);
    shows(0x0107, None, true, 0x0233);
    shows(0x010F, Some(Order::Enable), false, 0x0337);
    shows(0x0107, Some(Order::Release), true, 0x0233);
    shows(0x010F, Some(Order::Enable), false, 0x0337);
    shows(0x0106, Some(Order::Release), true, 0x0231);
    shows(0x0107, None, true, 0x0233);
    shows(0x010F, Some(Order::Enable), false, 0x0337);
    shows(0x0102, Some(Order::Hold), false, 0x0217);
    shows(0x0100, Some(Order::Release), true, 0x0270);
}

#[test]
fn a_word_is_at_most_one_order() {
    let rest: fn() -> Rig = || Rig::enabled(1);
    let travel: fn() -> Rig = Rig::travelling;
    let ready: fn() -> Rig = || {
        let mut rig = Rig::operational(1);
        rig.control(0x0106);
        rig
    };
    for (from, word, jobs) in [
        (rest, 0x010F, vec![]),
        (rest, 0x011F, vec![]),
        (rest, 0xE10F, vec![]),
        (rest, 0x000F, vec![Job::Look]),
        (rest, 0x001F, vec![Job::Look, order(Order::Start, 0)]),
        (rest, 0x200F, vec![Job::Look, order(Order::Step, 0)]),
        (rest, 0x400F, vec![Job::Look, order(UP, 0)]),
        (rest, 0x800F, vec![Job::Look, order(DOWN, 0)]),
        (rest, 0xE01F, vec![Job::Look, order(Order::Start, 0)]),
        (travel, 0x001F, vec![]),
        (travel, 0x000F, vec![Job::Look]),
        (travel, 0xE00F, vec![Job::Look]),
        (travel, 0x011F, vec![order(STOPPED, 0)]),
        (travel, 0x0002, vec![order(Order::Hold, 0)]),
        (travel, 0x0006, vec![order(Order::Release, 0)]),
        (ready, 0x0016, vec![]),
    ] {
        let mut rig = from();
        let mut found = rig.control(word);
        if found == [Job::Look] {
            found.extend(rig.done(Ok(0)));
        }
        assert_eq!(found, jobs, "{word:04X}");
    }
}

#[test]
fn a_travel_is_interrupted_and_resumed_by_stop() {
    let mut rig = Rig::travelling();
    assert_eq!(rig.status() & 0xD000, 0xD000);
    for _ in 0..2 {
        assert_eq!(rig.control(0x011F), [order(STOPPED, 0)]);
        rig.sees_and_is_done(POSITIONING);
        assert_eq!(rig.starts(0x001F), [order(Order::Resume, 0)]);
        rig.sees_and_is_done(POSITIONING | MOVING);
    }
    rig.sees(IN_POSITION);
    assert_eq!(rig.status(), 0x1737);
    rig.sees(POSITIONING | MOVING);
    // Once the travel is over, it cannot be resumed, and the next edge begins another one.
    rig.control(0x011F);
    rig.sees_and_is_done(IN_POSITION);
    assert_eq!((rig.starts(0x001F), rig.starts(0x000F)), (vec![], vec![]));
    assert_eq!(rig.starts(0x001F), [order(Order::Start, 0)]);
}

#[test]
fn inching_ends_with_its_own_bit() {
    for (own, other, inching) in [(0x400F, 0x800F, UP), (0x800F, 0x400F, DOWN)] {
        let mut rig = Rig::enabled(1);
        assert_eq!(rig.starts(own), [order(inching, 0)]);
        rig.sees_and_is_done(MOVING);
        assert_eq!((rig.starts(own | other), rig.starts(own)), (vec![], vec![]));
        assert_eq!(rig.starts(0x000F), [order(Order::StopInching, 0)]);
        rig.sees_and_is_done(0);
        assert_eq!(rig.starts(other), [order(if inching == UP { DOWN } else { UP }, 0)]);
    }
    let mut rig = Rig::enabled(1);
    assert_eq!(rig.starts(0x200F), [order(Order::Step, 0)]);
    rig.sees_and_is_done(MOVING);
    assert_eq!((rig.starts(0x000F), rig.starts(0x001F)), (vec![], vec![]), "it moves");
    assert_eq!(rig.sees(IN_POSITION), []);
    assert_eq!(rig.status(), 0x0737);
}

#[test]
fn in_velocity_mode_stop_and_new_targets_are_orders() {
    let mut rig = Rig::enabled(2);
    assert_eq!(rig.status(), 0x1337);
    let velocity = |rig: &mut Rig, velocity: u8| {
        let write = Job::Write(Address::new(0x60FF, 0), velocity.into());
        assert_eq!(rig.send(&format!("605#23FF6000{velocity:02X}000000")), [write]);
        assert_eq!(rig.done(Ok(0)), []);
        assert_eq!(rig.frames(), ["585#60FF600000000000"]);
    };
    velocity(&mut rig, 20);
    // A target that the drive refuses does not count.
    rig.send("605#23FF600028000000");
    rig.done(Err(AbortCode::INVALID_VALUE));
    assert_eq!(rig.frames(), ["585#80FF600030000906"]);
    assert_eq!(rig.control(0x011F), []);
    assert_eq!(rig.starts(0x000F), [order(Order::Start, 20)]);
    rig.sees_and_is_done(MOVING);
    assert_eq!(rig.status(), 0x0337);
    assert_eq!(rig.starts(0x001F), []);
    velocity(&mut rig, 30);
    assert_eq!(rig.starts(0x000F), [order(Order::Start, 30)]);
    rig.sees_and_is_done(MOVING | IN_POSITION);
    assert_eq!(rig.status(), 0x0737);
    assert_eq!(rig.control(0x010F), [order(STOPPED, 30)]);
    rig.sees_and_is_done(0);
    assert_eq!(rig.control(0x011F), []);
    assert_eq!(rig.starts(0x000F), [order(Order::Start, 30)]);
    rig.sees_and_is_done(MOVING);
    // By PDO, the target comes with the word.
    assert_eq!(rig.send("505#0F0028000000"), [order(Order::Start, 40)]);
}

#[test]
fn the_status_word_shows_what_the_drive_shows() {
    for (mode, shown, word) in [
        (1, 0, 0x0337),
        (1, NOT_READY, 0x0237),
        (1, BATTERY_LOW, 0x03B7),
        (1, OVERCURRENT, 0x03B7),
        (1, LAG_ERROR, 0x03B7),
        (1, IN_POSITION, 0x0337),
        (1, ABOVE_UPPER_LIMIT, 0x0B37),
        (1, BELOW_LOWER_LIMIT, 0x0B37),
        (1, POSITIONING, 0x4337),
        (1, MOVING, 0x8337),
        (2, 0, 0x1337),
        (2, IN_POSITION, 0x1737),
        (2, ABOVE_UPPER_LIMIT | BELOW_LOWER_LIMIT | POSITIONING, 0x1337),
        (2, MOVING, 0x0337),
        // The enable input is not the supply.
        (1, ENABLE_INACTIVE | MOTOR_RELEASED, 0x0337),
    ] {
        let mut rig = Rig::enabled(mode);
        rig.sees(shown);
        assert_eq!(rig.status(), word, "mode {mode}, {shown:04X}");
    }
    let mut rig = Rig::enabled(1);
    rig.send("000#8005");
    rig.sees_and_is_done(MOTOR_RELEASED);
    assert_eq!(rig.status(), 0x0070, "it takes no control words");
}

#[test]
fn a_target_is_reached_by_a_travel_or_a_step_and_acknowledged_until_bit_4_falls() {
    let mut rig = Rig::travelling();
    for (shown, word) in [(MOVING, 0x9337), (POSITIONING, 0x5337)] {
        rig.sees(IN_POSITION | shown);
        assert_eq!(rig.status(), word);
    }
    rig.sees(IN_POSITION);
    assert_eq!(rig.status(), 0x1737);
    rig.starts(0x000F);
    assert_eq!(rig.status(), 0x0737);
    // A finished travel stays finished, even without torque.
    assert_eq!(rig.control(0x0007), [order(Order::Release, 0)]);
    rig.sees_and_is_done(IN_POSITION | MOTOR_RELEASED);
    assert_eq!(rig.status(), 0x0633);
    // An abandoned travel does not count as finished.
    let mut rig = Rig::travelling();
    assert_eq!(rig.control(0x0007), [order(Order::Release, 0)]);
    rig.sees_and_is_done(POSITIONING | MOTOR_RELEASED);
    rig.sees(IN_POSITION | MOTOR_RELEASED);
    assert_eq!(rig.status(), 0x0233);
    let mut rig = Rig::travelling();
    assert_eq!(rig.control(0x0002), [order(Order::Hold, 0)]);
    rig.sees_and_is_done(IN_POSITION);
    assert_eq!(rig.status(), 0x0217);
}

#[test]
fn another_mode_forgets_the_travel_and_the_same_one_does_not() {
    for mode in [1, 2] {
        let mut rig = Rig::travelling();
        rig.sees(IN_POSITION);
        assert_eq!(rig.send(&format!("605#23606000{mode:02X}000000")), [Job::Write(MODE, mode)]);
        assert_eq!(rig.done(Ok(0)), []);
        rig.frames();
        assert_eq!(rig.status(), 0x1737, "mode {mode}");
        rig.send("605#2360600001000000");
        rig.done(Ok(0));
        rig.frames();
        assert_eq!(rig.status(), if mode == 1 { 0x1737 } else { 0x0337 });
    }
}

#[test]
fn what_an_order_has_become_is_seen_if_it_is_not_known() {
    let unknown = Err(AbortCode::HARDWARE_ERROR);
    let rest: fn() -> Rig = || Rig::enabled(1);
    let travel: fn() -> Rig = Rig::travelling;
    for (from, word, result, shown, status) in [
        (rest, 0x001F, Ok(0), 0, 0x1337),
        (rest, 0x001F, Err(AbortCode::DEVICE_STATE), 0, 0x0337),
        (rest, 0x001F, Err(AbortCode::LOCAL_CONTROL), 0, 0x0137),
        (rest, 0x001F, unknown, 0, 0x0337),
        (rest, 0x001F, unknown, MOVING, 0x9337),
        (rest, 0x001F, unknown, POSITIONING, 0x5337),
        (travel, 0x0007, unknown, 0, 0x0337),
        (travel, 0x0007, unknown, MOTOR_RELEASED, 0x0233),
        (travel, 0x0002, unknown, 0, 0x0337),
        (travel, 0x0002, Err(AbortCode::DEVICE_STATE), 0, 0x0337),
    ] {
        let mut rig = from();
        if rig.control(word) == [Job::Look] {
            rig.done(Ok(0));
        }
        rig.report(&[facts(shown), Report::Done(result)]);
        assert_eq!(rig.status(), status, "{word:04X}, {result:?}, {shown:04X}");
    }
}

#[test]
fn a_fault_is_reported_and_reset_by_an_edge() {
    let mut rig = Rig::operational(1);
    rig.send("000#8005");
    assert_eq!((rig.send("605#2314100085000040"), rig.frames()), (vec![], vec!["585#6014100000000000".to_owned()]));
    rig.send("000#0105");
    assert_eq!(rig.sees(FAULT | MOTOR_RELEASED), [Job::Read(FAULTS)]);
    assert_eq!(rig.done(Ok(0x4210)), []);
    assert_eq!(rig.frames(), ["085#1042010000000000"]);
    assert_eq!(rig.sees(FAULT | MOTOR_RELEASED), [], "it is reported once");
    assert_eq!(rig.status() & 0x6F, 0x28);
    for (result, shown, state) in [
        (Err(AbortCode::DEVICE_STATE), FAULT | MOTOR_RELEASED, 0x28),
        (Err(AbortCode::HARDWARE_ERROR), FAULT | MOTOR_RELEASED, 0x28),
        (Ok(0), MOTOR_RELEASED, 0x60),
    ] {
        assert_eq!(rig.control(0x0000), []);
        assert_eq!(rig.control(0x0080), [order(Order::ResetFault, 0)]);
        rig.report(&[facts(shown), Report::Done(result)]);
        assert_eq!(rig.status() & 0x6F, state, "{result:?}");
    }
    // Meanwhile the node is stopped: the fault remains, and the control word starts anew.
    rig.sees(FAULT | MOTOR_RELEASED);
    rig.done(Ok(0x4210));
    rig.send("000#8005");
    rig.send("000#0105");
    assert_eq!(rig.status() & 0x6F, 0x28);
    assert_eq!(rig.control(0x0080), [order(Order::ResetFault, 0)]);
    // A fault that comes with an order decides.
    let mut rig = Rig::enabled(1);
    assert_eq!(rig.starts(0x001F), [order(Order::Start, 0)]);
    assert_eq!(rig.sees_and_is_done(FAULT), [Job::Read(FAULTS)]);
    rig.done(Ok(0x4210));
    assert_eq!(rig.status(), 0x0238);
    // The fault ends by itself, too.
    let mut rig = Rig::operational(1);
    rig.sees(FAULT | MOTOR_RELEASED);
    rig.done(Ok(0x4210));
    rig.sees(MOTOR_RELEASED);
    assert_eq!(rig.status(), 0x0270);
}

#[test]
fn torque_that_is_lost_is_noticed_once_it_was_there() {
    let mut rig = Rig::travelling();
    rig.sees(IN_POSITION);
    rig.sees(IN_POSITION | MOTOR_RELEASED);
    assert_eq!(rig.status(), 0x0270, "the travel is forgotten");
    let mut rig = Rig::operational(1);
    rig.control(0x0106);
    rig.sees(0);
    rig.sees(MOTOR_RELEASED);
    assert_eq!(rig.control(0x0107), [], "no state without torque is lost");
    assert_eq!(rig.control(0x010F), [order(Order::Enable, 0)]);
    rig.sees_and_is_done(MOTOR_RELEASED);
    rig.sees(MOTOR_RELEASED);
    assert_eq!(rig.status() & 0x6F, 0x27, "it has had no torque yet");
    rig.sees(0);
    rig.sees(MOTOR_RELEASED | ENABLE_INACTIVE);
    assert_eq!(rig.status() & 0x6F, 0x27, "the enable input takes it away, and gives it back");
}

#[test]
fn without_an_enable_input_bit_4_is_the_supply() {
    let mut rig = Rig::of(&siko_ag03_1::sim::MODEL);
    rig.sees(MOTOR_RELEASED);
    rig.done(Ok(1));
    rig.frames();
    for (shown, word) in [(MOTOR_RELEASED, 0x0010), (MOTOR_RELEASED | NO_SUPPLY, 0)] {
        rig.sees(shown);
        assert_eq!(rig.status() & 0x0010, word);
    }
    assert_eq!(rig.send("605#4008100000000000"), [], "its name is the gateway's");
    assert_eq!(rig.frames(), ["585#4208100041473033"]);
}
