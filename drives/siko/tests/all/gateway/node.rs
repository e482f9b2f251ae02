//! The node: requests that wait for the drive, those dropped when the drive is lost, and its objects.

use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured};
use siko::gateway::{Facts, Job, Report};
use siko::order::Order;
use siko::words::system::{BATTERY_LOW, FAULT, IN_POSITION, MOTOR_RELEASED, MOVING, POSITIONING};

use super::rig::*;

#[test]
fn before_the_drive_answers_the_node_is_silent() {
    let mut rig = Rig::silent();
    assert!(!rig.gateway.is_connected() && !rig.gateway.is_busy());
    // A client has one request at a time, and no longer waits for an earlier one.
    assert_eq!(rig.send("605#4060600000000000"), []);
    assert_eq!((rig.send("605#4000100000000000"), rig.frames()), (vec![], vec![]));
    assert_eq!(rig.send("000#0105"), []);
    assert!(rig.gateway.is_busy());
    rig.sees(MOTOR_RELEASED);
    assert_eq!((rig.gateway.is_connected(), rig.frames()), (true, vec!["705#00".to_owned()]));
    assert_eq!((rig.done(Ok(1)), rig.frames()), (vec![], vec!["585#4200100092010000".to_owned()]));
    assert_eq!(rig.status() & 0x0200, 0x0200, "it has been started");
    // A lost drive is silent, and its waiting requests are dropped.
    rig.control(0x0106);
    assert_eq!(rig.send("605#4060600000000000"), [Job::Read(MODE)]);
    assert_eq!(rig.report(&[Report::Lost]), []);
    assert!(!rig.gateway.is_busy() && !rig.gateway.is_connected());
    assert_eq!((rig.send("605#4000100000000000"), rig.frames()), (vec![], vec![]));
    assert_eq!(rig.sees(MOTOR_RELEASED), [Job::Read(MODE)]);
    rig.done(Ok(1));
    assert_eq!((rig.frames(), rig.status()), (vec![], 0x0231), "it is as it was");
}

/// Nothing reports this, as when the line or its thread has died.
#[test]
fn a_node_whose_facts_are_too_old_is_silent_and_then_lost() {
    const BEFORE: Duration = Duration::from_micros(1_999_999);
    let mut rig = Rig::travelling();
    rig.frames();
    rig.now += BEFORE;
    rig.gateway.handle_timeout(rig.now);
    assert_eq!(rig.frames(), ["185#37D3"], "its TPDO1, by its event timer");
    rig.now = Instant::ZERO + WORST_CYCLE;
    rig.gateway.handle_timeout(rig.now);
    rig.gateway.handle_timeout(rig.now + Duration::from_millis(500));
    assert_eq!((rig.frames(), rig.gateway.is_connected()), (vec![], true), "old facts are not sent");
    // A program that returns to its link asks while the door still looks.
    assert_eq!(rig.send("605#4041600000000000"), [Job::Look]);
    rig.sees_and_is_done(POSITIONING | MOVING);
    assert_eq!(rig.frames().last().unwrap(), "585#4241600037D30000");
    rig.now += WORST_CYCLE;
    assert_eq!(rig.send("605#4041600000000000"), [Job::Look]);
    assert_eq!(rig.gateway.poll_timeout().map(|at| at <= rig.now + WORST_CYCLE), Some(true));
    rig.now += BEFORE;
    rig.gateway.handle_timeout(rig.now);
    assert_eq!((rig.gateway.door_mut().lost, rig.gateway.is_busy()), (0, true));
    rig.now += Duration::from_micros(1);
    rig.gateway.handle_timeout(rig.now);
    assert_eq!((rig.gateway.door_mut().lost, rig.gateway.is_connected(), rig.gateway.is_busy()), (1, false, false));
    // A drive that is back has its former state.
    assert_eq!(rig.sees(0), [Job::Read(MODE)]);
    rig.done(Ok(1));
    assert_eq!(rig.status() & 0x006F, 0x0027);
}

#[test]
fn a_node_that_is_stopped_releases_the_motor_until_that_is_known() {
    let mut rig = Rig::enabled(1);
    assert_eq!(rig.send("000#8005"), [order(Order::Release, 0)]);
    assert_eq!(rig.done(Err(AbortCode::HARDWARE_ERROR)), [order(Order::Release, 0)]);
    let unknown = Report::Done(Err(AbortCode::HARDWARE_ERROR));
    assert_eq!(rig.report(&[facts(MOTOR_RELEASED), unknown]), []);
    assert_eq!(rig.status(), 0x0070);
    assert_eq!(rig.send("000#8105"), [Job::Read(MODE)]);
    assert_eq!((rig.done(Ok(1)), rig.frames()), (vec![], vec!["705#00".to_owned()]));
}

#[test]
fn objects_of_the_door_are_read_and_written_there() {
    let address = Address::new(0x2410, 1);
    let mut rig = Rig::operational(1);
    for (result, answer) in [(Ok(7), "585#4210240107000000"), (Err(AbortCode::DEVICE_STATE), "585#8010240122000008")] {
        assert_eq!(rig.send("605#4010240100000000"), [Job::Read(address)]);
        assert_eq!((rig.done(result), rig.frames()), (vec![], vec![answer.to_owned()]));
    }
    for (result, answer) in [(Ok(0), "585#6010240100000000"), (Err(AbortCode::INVALID_VALUE), "585#8010240130000906")] {
        assert_eq!(rig.send("605#2310240108000000"), [Job::Write(address, 8)]);
        assert_eq!((rig.done(result), rig.frames()), (vec![], vec![answer.to_owned()]));
    }
    // A request that the client has given up is not answered; the next one is.
    assert_eq!(rig.send("605#4010240100000000"), [Job::Read(address)]);
    assert_eq!(rig.send("605#4060600000000000"), []);
    assert_eq!((rig.done(Ok(9)), rig.frames()), (vec![Job::Read(MODE)], vec![]));
    rig.done(Ok(1));
    assert_eq!(rig.frames(), ["585#4260600001000000"]);
    for (request, answer) in [
        ("605#400C100000000000", "585#800C100000000206"),
        ("605#4020240000000000", "585#8020240000000206"),
        ("605#4013240000000000", "585#8013240000000206"),
        ("605#4010240900000000", "585#8010240900000206"),
        ("605#4010240000000000", "585#4210240009000000"),
        ("605#4017100000000000", "585#4217100000000000"),
    ] {
        assert_eq!((rig.send(request), rig.frames()), (vec![], vec![answer.to_owned()]), "{request}");
    }
    // The target for the other mode waits in the gateway, as does one that the door does not have.
    for object in ["FF6000", "7A6000"] {
        let jobs = rig.send(&format!("605#23{object}14000000"));
        assert_eq!((jobs, rig.frames()), (vec![], vec![format!("585#60{object}00000000")]));
    }
    assert!(!rig.gateway.is_busy());
    // After 1011h, the mode may be another one.
    let restore = Job::Write(Address::new(0x1011, 1), 0x6461_6F6C);
    assert_eq!(rig.send("605#231110016C6F6164"), [restore]);
    assert!(rig.gateway.is_busy());
    assert_eq!(rig.done(Ok(0)), [Job::Read(MODE)]);
}

#[test]
fn an_order_waits_for_its_turn_and_not_for_the_end_of_control() {
    let mut rig = Rig::enabled(1);
    assert_eq!((rig.send("205#0F00"), rig.send("205#1F00")), (vec![Job::Look], vec![]));
    // A request does not take the place of the order.
    assert_eq!(rig.send("605#4060600000000000"), []);
    assert_eq!((rig.done(Ok(0)), rig.done(Ok(0))), (vec![Job::Look], vec![order(Order::Start, 0)]));
    // An order requested before the node is stopped is not begun afterwards.
    let mut rig = Rig::enabled(1);
    rig.starts(0x000F);
    assert_eq!((rig.send("205#1F00"), rig.send("205#1F20")), (vec![Job::Look], vec![]));
    assert_eq!((rig.send("000#8005"), rig.done(Ok(0))), (vec![], vec![order(Order::Release, 0)]));
    assert_eq!((rig.sees_and_is_done(MOTOR_RELEASED), rig.status()), (vec![], 0x0070));
    // A lost order is not resumed.
    let mut rig = Rig::enabled(1);
    assert_eq!((rig.send("205#0F00"), rig.send("205#1F00")), (vec![Job::Look], vec![]));
    rig.send("605#4017100000000000");
    assert_eq!((rig.report(&[Report::Lost]), rig.sees(0)), (vec![], vec![Job::Read(MODE)]));
    assert_eq!((rig.done(Ok(1)), rig.frames()), (vec![], vec![]));
}

#[test]
fn of_a_flood_of_control_words_the_oldest_go() {
    for (words, state) in [(15, 0x33), (16, 0x70)] {
        let mut rig = Rig::operational(1);
        rig.send("605#4060600000000000");
        rig.send("205#0600");
        (0..words).for_each(|at| drop(rig.send(if at % 2 == 0 { "205#0700" } else { "205#0701" })));
        rig.done(Ok(1));
        rig.frames();
        assert_eq!(rig.status() & 0x7F, state, "{words} after the first one");
    }
    // The same control word again changes nothing.
    let mut rig = Rig::operational(1);
    rig.send("605#4060600000000000");
    rig.send("205#0600");
    (0..100).for_each(|_| drop(rig.send("205#0700")));
    rig.done(Ok(1));
    rig.frames();
    assert_eq!(rig.status() & 0x7F, 0x33);
    // Before the drive has answered, the NMT command waits.
    let mut rig = Rig::silent();
    rig.send("205#0600");
    assert!(!rig.gateway.is_busy());
    (0..16).for_each(|_| drop(rig.send("000#0105")));
    rig.send("000#8005");
    rig.sees(MOTOR_RELEASED);
    rig.frames();
    rig.done(Ok(1));
    assert_eq!(rig.status(), 0x0270);
}

#[test]
fn control_words_count_in_operational_alone() {
    let mut rig = Rig::silent();
    rig.sees(MOTOR_RELEASED);
    rig.done(Ok(1));
    rig.frames();
    for word in [0x0006, 0x0007, 0x000F] {
        assert_eq!(rig.control(word), []);
    }
    assert_eq!(rig.status(), 0x0070);
    assert_eq!((rig.send("000#0105"), rig.status()), (vec![], 0x0270));
    // A motor that something else holds is released.
    for command in ["000#0105", "000#8005", "000#8105"] {
        let mut rig = Rig::silent();
        rig.sees(0);
        rig.done(Ok(1));
        rig.frames();
        if command != "000#0105" {
            rig.send("000#0105");
            rig.sees_and_is_done(MOTOR_RELEASED);
            rig.sees(0);
        }
        assert_eq!(rig.send(command), [order(Order::Release, 0)], "{command}");
    }
    // So is a motor that the drive does not hold yet, but may hold at the next order.
    let mut rig = Rig::operational(1);
    rig.control(0x0106);
    rig.control(0x0107);
    assert_eq!(rig.control(0x010F), [order(Order::Enable, 0)]);
    rig.sees_and_is_done(MOTOR_RELEASED);
    assert_eq!(rig.send("000#8005"), [order(Order::Release, 0)]);
    let mut rig = Rig::enabled(1);
    assert_eq!(rig.send("000#8005"), [order(Order::Release, 0)]);
    assert_eq!(rig.done(Err(AbortCode::DEVICE_STATE)), [], "only what is not known is ordered again");
    assert_eq!(rig.status(), 0x0070);
}

#[test]
fn a_target_out_of_range_starts_nothing_and_the_word_beside_it_may_stop() {
    for by_sync in [false, true] {
        let set_up = |mode: i64, rpdo: u8| {
            let mut rig = Rig::silent();
            rig.sees(MOTOR_RELEASED);
            rig.done(Ok(mode));
            rig.frames();
            if by_sync {
                rig.send(&format!("605#23{rpdo:02X}140201000000"));
                assert_eq!(rig.frames().len(), 1);
            }
            rig.send("000#0105");
            rig.control(0x0106);
            rig.control(0x0107);
            rig.control(0x010F);
            rig.sees_and_is_done(0);
            rig
        };
        let send = |rig: &mut Rig, frame: &str| {
            let jobs = rig.send(frame);
            if by_sync { rig.send("080#") } else { jobs }
        };
        let mut rig = set_up(1, 2);
        assert_eq!(rig.starts(0x000F), []);
        assert_eq!(send(&mut rig, "405#1F00FFFFFF7F"), [], "it is the word before, without bit 4");
        assert_eq!(send(&mut rig, "405#1F0010270000"), [Job::Look]);
        assert_eq!(rig.done(Ok(0)), [order(Order::Start, 10_000)]);
        rig.sees_and_is_done(POSITIONING | MOVING);
        assert_eq!(send(&mut rig, "405#0F01FFFFFF7F"), [order(STOPPED, 10_000)]);
        rig.sees_and_is_done(POSITIONING);
        assert_eq!(send(&mut rig, "405#0F00FFFFFF7F"), [], "it is not resumed");
        assert_eq!(send(&mut rig, "405#0200FFFFFF7F"), [order(Order::Hold, 0)]);
        let mut rig = set_up(2, 3);
        assert_eq!(send(&mut rig, "505#0F00FFFFFF7F"), [], "bit 8 falls");
        assert_eq!(send(&mut rig, "505#0F0014000000"), [Job::Look]);
        assert_eq!(rig.done(Ok(0)), [order(Order::Start, 20)]);
    }
}

#[test]
fn what_is_shown_is_what_has_come_last() {
    let mut rig = Rig::operational(1);
    // By SDO: with the next look.
    assert_eq!(rig.send("605#4041600000000000"), [Job::Look]);
    rig.report(&[facts(MOTOR_RELEASED | BATTERY_LOW), Report::Done(Ok(0))]);
    assert_eq!(rig.frames(), ["585#42416000F0020000"]);
    rig.send("605#4002100000000000");
    rig.report(&[facts(MOTOR_RELEASED | IN_POSITION), Report::Done(Ok(0))]);
    assert_eq!(rig.frames(), ["585#4202100088000000"]);
    for (object, value) in [("646000", 77), ("6C6000", -7)] {
        let [a, b, c, d] = i32::to_le_bytes(value);
        rig.send(&format!("605#40{object}00000000"));
        rig.done(Ok(value.into()));
        assert_eq!(rig.frames(), [format!("585#42{object}{a:02X}{b:02X}{c:02X}{d:02X}")]);
    }
    // By PDO: TPDO3 on change, TPDO1 by its timer.
    rig.send("000#8005");
    rig.send("605#23021802FE000000");
    rig.send("000#0105");
    rig.frames();
    rig.report(&[Report::Facts(Measured::new(Facts { system: MOTOR_RELEASED, position: 5, velocity: 0 }, rig.now))]);
    assert_eq!(rig.frames(), ["385#700205000000"]);
    rig.send("205#0600");
    assert_eq!(rig.frames(), ["385#310205000000"]);
    assert_eq!(rig.sees(MOTOR_RELEASED), []);
    rig.frames();
    rig.now = rig.gateway.poll_timeout().unwrap();
    assert_eq!(rig.now, Instant::ZERO + Duration::from_millis(100));
    rig.gateway.handle_timeout(rig.now);
    assert_eq!(rig.frames(), ["185#3102"]);
}

#[test]
fn deadlines_are_those_of_the_door_and_of_the_device_while_it_is_there() {
    let ms = |ms| Instant::ZERO + Duration::from_millis(ms);
    let mut rig = Rig::operational(1);
    let device = rig.gateway.poll_timeout();
    assert_eq!(device, Some(ms(100)), "TPDO1");
    for (at, timeouts) in [(49, 0), (50, 1), (51, 2)] {
        rig.gateway.door_mut().deadline = Some(ms(50));
        assert_eq!(rig.gateway.poll_timeout(), Some(ms(50)));
        rig.gateway.handle_timeout(ms(at));
        assert_eq!(rig.gateway.door().timeouts, timeouts);
    }
    rig.gateway.door_mut().deadline = Some(ms(200));
    assert_eq!((rig.gateway.poll_timeout(), rig.frames()), (device, vec![]));
    // Pending reports of the door are taken then, and before a frame.
    rig.gateway.door_mut().reports.push_back(facts(MOTOR_RELEASED | IN_POSITION));
    rig.gateway.handle_timeout(ms(60));
    assert!(rig.gateway.door().reports.is_empty());
    rig.gateway.door_mut().reports.push_back(Report::Lost);
    assert_eq!((rig.send("605#4017100000000000"), rig.frames()), (vec![], vec![]));
    assert_eq!(rig.gateway.poll_timeout(), Some(ms(200)));
    rig.now = ms(150);
    rig.gateway.handle_timeout(rig.now);
    rig.send("000#8005");
    rig.sees(MOTOR_RELEASED);
    rig.done(Ok(1));
    assert_eq!(rig.frames(), Vec::<String>::new());
    rig.gateway.handle_timeout(rig.now);
    assert_eq!(rig.frames(), ["185#7002"], "NMT that came while it was lost is not heard either");
}

#[test]
fn what_was_to_be_sent_when_the_drive_is_lost_is_not_sent_later() {
    let mut rig = Rig::operational(1);
    let lose = |rig: &mut Rig| {
        assert_eq!((rig.report(&[Report::Lost]), rig.frames()), (vec![], vec![]));
        rig.sees(MOTOR_RELEASED);
        rig.done(Ok(1));
    };
    rig.send("605#4010240100000000");
    rig.send("605#2310240108000000");
    rig.done(Ok(7));
    rig.done(Ok(7));
    lose(&mut rig);
    assert_eq!(rig.frames(), Vec::<String>::new());
    rig.send("605#4017100000000000");
    assert_eq!(rig.report(&[Report::Lost]), []);
    assert_eq!(rig.frames(), Vec::<String>::new(), "nor while it is lost");
    // Meanwhile the drive has lost its torque: it reboots.
    let mut rig = Rig::enabled(1);
    rig.sees(0);
    lose(&mut rig);
    assert_eq!((rig.frames(), rig.status()), (vec!["705#00".to_owned()], 0x0070));
}

/// Neither by a control word nor by NMT. The NMT order is repeated until its effect is known.
#[test]
fn a_drive_that_was_releasing_its_motor_when_it_was_lost_has_not_restarted() {
    for nmt in [false, true] {
        let mut rig = Rig::enabled(1);
        let ordered = if nmt { rig.send("000#8005") } else { rig.control(0x0100) };
        assert_eq!(ordered, [order(Order::Release, 0)]);
        assert_eq!(rig.report(&[Report::Lost]), []);
        let next = if nmt { order(Order::Release, 0) } else { Job::Read(MODE) };
        assert_eq!((rig.sees(MOTOR_RELEASED), rig.frames()), (vec![next], vec![]), "NMT: {nmt}");
    }
}

#[test]
fn a_reset_gives_the_communication_objects_their_defaults_and_errors_end_with_their_fault() {
    let mut rig = Rig::operational(1);
    let asks = |rig: &mut Rig, request: &str, answer: &str| {
        assert_eq!((rig.send(request), rig.frames()), (vec![], vec![answer.to_owned()]));
    };
    asks(&mut rig, "605#23171000E8030000", "585#6017100000000000");
    rig.send("000#8205");
    rig.done(Ok(1));
    rig.frames();
    asks(&mut rig, "605#4017100000000000", "585#4217100000000000");
    // 1014h switches emergencies on.
    asks(&mut rig, "605#2314100085000040", "585#6014100000000000");
    assert_eq!(rig.sees(FAULT | MOTOR_RELEASED), [Job::Read(FAULTS)]);
    rig.done(Ok(0x3120));
    // The answer to a write waits for the drive; an emergency before it does not.
    let write = rig.send("605#2310240108000000");
    assert_eq!((write.len(), rig.frames()), (1, vec!["085#2031050000000000".to_owned()]));
    assert_eq!((rig.done(Ok(0)), rig.frames()), (vec![], vec!["585#6010240100000000".to_owned()]));
    asks(&mut rig, "605#4001100000000000", "585#4201100005000000");
    assert_eq!((rig.sees(MOTOR_RELEASED), rig.frames()), (vec![], vec!["085#0000000000000000".to_owned()]));
    asks(&mut rig, "605#4001100000000000", "585#4201100000000000");
    // 1014h also switches them off, and does nothing else.
    rig.send("605#2314100085000000");
    rig.frames();
    rig.sees(FAULT | MOTOR_RELEASED);
    // A code that is in no table.
    rig.done(Ok(0x1000));
    asks(&mut rig, "605#4001100000000000", "585#4201100001000000");
    assert_eq!((rig.sees(MOTOR_RELEASED), rig.frames()), (vec![], vec![]));
    asks(&mut rig, "605#4001100000000000", "585#4201100000000000");
    // A mode that could not be read is requested again.
    rig.send("605#2360600002000000");
    assert_eq!(rig.report(&[Report::Lost]), []);
    assert_eq!(rig.sees(MOTOR_RELEASED), [Job::Read(MODE)]);
    assert_eq!(rig.done(Err(AbortCode::HARDWARE_ERROR)), [Job::Read(MODE)]);
    assert_eq!(rig.done(Err(AbortCode::DEVICE_STATE)), []);
}
