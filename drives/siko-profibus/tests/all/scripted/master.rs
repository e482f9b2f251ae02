//! Orders are translated to words, and replies to facts.

use lexican_driver::Direction;
use lexican_profibus::pkw::{Refusal, Reply, Task, Value};
use siko::order::{Braking, Order};
use siko::sim::parameters::Mode;
use siko_profibus::AG03_1;
use siko_profibus::master::{DriveMaster, Event, Facts};

use super::rig::{MODE, Rig, SYSTEM};

const REFUSED: Event = Event::Answered(Reply::Refused(Refusal::WRONG_STATE));

fn read(number: u16) -> Task {
    Task::Read { number }
}

fn write(number: u16, value: u16) -> Task {
    Task::Write { number, value: Value::Word(value) }
}

const UP: Order = Order::Inch(Direction::Positive);
const DOWN: Order = Order::Inch(Direction::Negative);

#[test]
fn what_has_to_be_known_is_asked_for_and_then_the_status_again_and_again() {
    let mut rig = Rig::offline(&AG03_1, 2);
    assert_eq!((rig.master().outputs(), rig.master().poll_timeout()), ([0; 14], None));
    assert_eq!(rig.facts(), None);
    rig.turns(11);
    assert_eq!(rig.parameters.asked, [MODE, 1010, 1011, 1012, SYSTEM].map(read));
    let facts = Facts { status: 0x0203, system: 0x80, mode: Mode::Positioning, position: 100, velocity: 0 };
    assert_eq!(rig.facts(), Some(facts));
    rig.parameters.values.insert(SYSTEM, 0x0190);
    (rig.status, rig.actual) = (0x020B, 105);
    rig.turns(3);
    // ZSW shows a fault earlier, and its end.
    let facts = Facts { status: 0x020B, system: 0x0190, position: 105, ..facts };
    assert_eq!(rig.facts(), Some(facts));
    rig.status = 0x0203;
    rig.turn();
    assert_eq!(rig.facts(), Some(Facts { status: 0x0203, system: 0x0090, ..facts }));
    let mut rig = Rig::new(1);
    rig.actual = -30;
    rig.turn();
    let facts = rig.facts().unwrap();
    assert_eq!((facts.mode, facts.position, facts.velocity), (Mode::Velocity, 0, -30));
}

#[test]
fn an_order_is_its_words() {
    for (order, positioning, velocity) in [
        (Order::Enable, vec![0x0B, 0x3B], vec![]),
        (Order::Hold, vec![0x03], vec![0x03]),
        (Order::Release, vec![0x00], vec![0x00]),
        (Order::ResetFault, vec![0x00, 0x80, 0x00], vec![0x00, 0x80, 0x00]),
        // The target precedes the edge.
        (Order::Start, vec![0x3B, 0x7B], vec![0x4B]),
        (Order::Interrupt(Braking::Programmed), vec![0x1B], vec![]),
        (Order::Interrupt(Braking::Full), vec![0x0B, 0x3B], vec![]),
        (Order::Resume, vec![], vec![]),
        (Order::Abort(Braking::Full), vec![0x0B, 0x3B], vec![]),
        (Order::Step, vec![0x0B, 0x010B], vec![]),
        (UP, vec![0x0B, 0x020B], vec![]),
        (DOWN, vec![0x0B, 0x820B], vec![]),
        (Order::StopInching, vec![0x0B, 0x3B], vec![]),
    ] {
        for (mode, words) in [(1, velocity), (2, positioning)] {
            let mut rig = Rig::enabled(mode);
            assert_eq!(rig.order(order, 700), Event::Followed, "{order:?}");
            rig.turns(5);
            assert_eq!(rig.words(), words, "{order:?}, {mode}");
        }
    }
    // Bit 6, whose edges start travels, is unchanged in all other words.
    let mut rig = Rig::enabled(2);
    for (order, sent) in [
        (Order::Start, vec![(0x3B, 700), (0x7B, 700)]),
        (Order::Interrupt(Braking::Programmed), vec![(0x5B, 700)]),
        (Order::Resume, vec![(0x7B, 700)]),
        (Order::Interrupt(Braking::Full), vec![(0x4B, 700), (0x7B, 700)]),
        (Order::Step, vec![(0x4B, 700), (0x014B, 700)]),
        (UP, vec![(0x4B, 700), (0x024B, 700)]),
        (DOWN, vec![(0x4B, 700), (0x824B, 700)]),
        (Order::StopInching, vec![(0x4B, 700), (0x7B, 700)]),
    ] {
        assert_eq!(rig.order(order, 700), Event::Followed);
        assert_eq!(rig.sent(), sent, "{order:?}");
    }
    assert_eq!((rig.order(Order::Start, -5), rig.sent()), (Event::Followed, vec![(0x7B, -5), (0x3B, -5)]));
}

#[test]
fn an_order_is_followed_when_its_words_have_arrived_and_the_status_shows_it() {
    for (order, before, after, words) in [
        (Order::Enable, 0x0203, 0x0207, vec![0x0B, 0x3B, 0x00]),
        (Order::Hold, 0x0207, 0x0203, vec![0x03]),
        (Order::Release, 0x0207, 0x0203, vec![]),
        (Order::ResetFault, 0x020B, 0x0203, vec![0x80, 0x00]),
        (Order::ResetFault, 0x0243, 0x0203, vec![0x80, 0x00]),
        (Order::Start, 0x0207, 0x1207, vec![0x3B, 0x7B]),
        (Order::Start, 0x1207, 0x0207, vec![0x3B, 0x7B]),
    ] {
        let ordered = || {
            let mut rig = Rig::new(2);
            (rig.follows, rig.status) = (false, before);
            rig.turns(5);
            let now = rig.now;
            rig.master().order(now, order, 700);
            rig
        };
        let mut rig = ordered();
        rig.turns(20);
        assert_eq!(rig.master().poll(), None, "{order:?}");
        rig.status = after;
        assert_eq!(rig.next().0, Event::Followed, "{order:?}");
        // An order that could still be followed later is withdrawn.
        let mut rig = ordered();
        assert_eq!(rig.next(), (Event::NotFollowed, 400), "{order:?}");
        rig.turns(5);
        assert_eq!(rig.words(), words, "{order:?}");
    }
    // The result must be known: an earlier request for the status does not count.
    for turns in 0..4 {
        for order in [Order::Release, Order::Start, Order::Step] {
            let mut rig = Rig::enabled(2);
            rig.turns(turns);
            let now = rig.now;
            rig.master().order(now, order, 700);
            let mut carried = 0;
            while carried < 3 && rig.master().poll().is_none() {
                rig.turn();
                carried += rig.words().len();
                rig.parameters.values.insert(SYSTEM, 0x1000 + carried as u32);
                if carried == if order == Order::Release { 1 } else { 2 } {
                    break;
                }
            }
            assert_eq!(rig.next().0, Event::Followed);
            let system = 0x1000 + if order == Order::Release { 1 } else { 2 };
            assert_eq!(rig.facts().unwrap().system, system, "{order:?} after {turns}");
        }
    }
    // A telegram that was in transit contains nothing of the order.
    for order in [Order::Step, Order::Enable, Order::Release] {
        let mut rig = Rig::enabled(2);
        let before = rig.master().outputs();
        rig.stuck = Some(rig.last);
        let now = rig.now;
        rig.master().order(now, order, 0);
        let outputs = rig.master().outputs();
        assert_ne!(outputs[8..], before[8..], "{order:?} goes out at once");
        rig.turns(50);
        assert_eq!((rig.master().poll(), &rig.master().outputs()[8..]), (None, &outputs[8..]), "{order:?}");
        rig.stuck = None;
        assert_eq!(rig.next().0, Event::Followed);
    }
    // The order is followed, but nothing is known about it.
    let mut rig = Rig::new(2);
    rig.answers = false;
    assert_eq!(rig.order(Order::Enable, 0), Event::Silent);
    rig.turns(5);
    assert_eq!(rig.words(), [0x0B, 0x3B]);
    let mut rig = Rig::enabled(2);
    rig.answers = false;
    assert_eq!(rig.order(Order::Step, 0), Event::Silent);
    assert_eq!(rig.words(), [0x0B, 0x010B]);
    rig.answers = true;
    assert_eq!(rig.order(Order::Resume, 0), Event::Followed);
}

#[test]
fn a_task_is_answered_or_given_up() {
    let mut rig = Rig::new(2);
    rig.parameters.values.insert(1004, 30);
    assert_eq!(rig.ask(read(1004)), Event::Answered(Reply::Value(Value::Word(30))));
    assert_eq!(rig.ask(write(1004, 40)), Event::Answered(Reply::Value(Value::Word(40))));
    rig.parameters.refusal = Some(Refusal::WRONG_STATE);
    assert_eq!(rig.ask(read(1004)), REFUSED);
    rig.parameters.refusal = None;
    rig.master().look();
    rig.parameters.values.insert(SYSTEM, 0x4321);
    let (event, ms) = rig.next();
    assert!(event == Event::Looked && ms <= 5, "{event:?} after {ms} ms");
    // Before its time, a deadline has no effect.
    rig.master().look();
    let now = rig.now;
    rig.master().handle_timeout(now);
    assert_eq!((rig.master().poll(), rig.next().0), (None, Event::Looked));
    assert_eq!(rig.facts().unwrap().system, 0x4221);
    // Nothing is asked of an absent drive.
    let mut offline = Rig::offline(&AG03_1, 2);
    let now = offline.now;
    offline.master().order(now, Order::Enable, 0);
    let due = offline.master().poll_timeout().unwrap();
    offline.master().handle_timeout(due);
    assert_eq!((offline.master().poll(), offline.master().poll_timeout()), (Some(Event::NotFollowed), None));
    // Answers to the master's own requests are no events.
    rig.answers = false;
    rig.turns(1000);
    assert_eq!(rig.master().poll(), None);
    for look in [true, false] {
        let mut rig = Rig::new(2);
        rig.turns(usize::from(look));
        rig.answers = false;
        if look {
            rig.master().look();
        } else {
            rig.master().ask(read(1004));
        }
        let (event, ms) = rig.next();
        assert!(event == Event::Silent && (399..=801).contains(&ms), "{event:?} after {ms} ms");
        rig.turns(1000);
        assert_eq!(rig.master().poll(), None);
        rig.answers = true;
        assert_eq!(rig.ask(read(1004)), Event::Answered(Reply::Value(Value::Word(0))));
    }
}

#[test]
fn another_mode_is_entered_at_rest_and_its_words_start_nothing() {
    for moves in [0x4000, 0x0010] {
        let mut rig = Rig::enabled(2);
        rig.parameters.values.insert(SYSTEM, moves);
        rig.turns(10);
        assert_eq!((rig.ask(write(MODE, 1)), rig.words()), (REFUSED, vec![]));
        assert_eq!(rig.ask(write(1004, 40)), Event::Answered(Reply::Value(Value::Word(40))));
        assert_eq!(rig.order(Order::Release, 0), Event::Followed);
        assert_eq!(rig.ask(write(MODE, 1)), Event::Answered(Reply::Value(Value::Word(1))));
        // The word that releases it counts, though the drive still shows that it is enabled.
        let mut rig = Rig::enabled(2);
        rig.parameters.values.insert(SYSTEM, moves);
        rig.follows = false;
        assert_eq!((rig.order(Order::Release, 0), rig.words()), (Event::NotFollowed, vec![0]));
        assert_eq!(rig.ask(write(MODE, 1)), Event::Answered(Reply::Value(Value::Word(1))));
        rig.turns(20);
        assert!(rig.words().is_empty());
    }
    let mut rig = Rig::enabled(2);
    rig.parameters.values.insert(SYSTEM, 0);
    rig.turns(10);
    assert_eq!(rig.ask(write(MODE, 1)), Event::Answered(Reply::Value(Value::Word(1))));
    rig.turns(10);
    assert_eq!((rig.facts().unwrap().mode, rig.words()), (Mode::Velocity, vec![0x0B]));
    assert_eq!((rig.order(Order::Start, 30), rig.words()), (Event::Followed, vec![0x4B]));
    assert_eq!(rig.order(Order::Interrupt(Braking::Programmed), 0), Event::Followed);
    rig.words();
    assert_eq!(rig.ask(write(MODE, 2)), Event::Answered(Reply::Value(Value::Word(2))));
    rig.turns(10);
    assert_eq!((rig.facts().unwrap().mode, rig.words()), (Mode::Positioning, vec![0x3B]));
    // PNU 970 may change the mode.
    for (begins, starts, ends, words) in [
        (2, true, 1, vec![0x0B]),
        (2, true, 2, vec![]),
        (1, true, 1, vec![]),
        (1, true, 2, vec![0x7B]),
        (1, false, 2, vec![0x3B]),
    ] {
        let mut rig = Rig::enabled(begins);
        if starts {
            rig.order(Order::Start, 10);
        }
        rig.words();
        assert!(matches!(rig.ask(write(970, 1)), Event::Answered(Reply::Value(_))));
        rig.parameters.values.insert(MODE, ends);
        rig.parameters.asked.clear();
        rig.turns(20);
        assert_eq!(rig.words(), words, "from {begins} to {ends}");
        assert_eq!(rig.parameters.asked, [MODE, 1010, 1011, 1012, SYSTEM].map(read));
    }
    // This does not enable a drive, and an intermediate stop is not over.
    for (stops, begins, ends) in [(false, 2, 1), (false, 1, 2), (true, 2, 2)] {
        let mut rig = if stops { Rig::enabled(begins) } else { Rig::new(begins) };
        if stops {
            rig.order(Order::Interrupt(Braking::Programmed), 0);
        }
        rig.words();
        rig.ask(write(970, 1));
        rig.parameters.values.insert(MODE, ends);
        rig.turns(20);
        assert!(rig.words().is_empty());
    }
    // The mode is not written before a word has arrived that starts nothing in either mode.
    let mut rig = Rig::enabled(2);
    rig.parameters.values.insert(SYSTEM, 0);
    rig.turns(10);
    rig.stuck = Some(rig.last);
    rig.master().ask(write(MODE, 1));
    rig.turns(50);
    assert_eq!(rig.parameters.values[&MODE], 2);
    // An order waits until the mode is known.
    let mut rig = Rig::enabled(2);
    rig.ask(write(970, 1));
    rig.parameters.values.insert(MODE, 1);
    assert_eq!((rig.order(Order::Start, 10), rig.words()), (Event::Followed, vec![0x4B]));
}

#[test]
fn a_drive_that_lets_go_does_not_go_on_by_itself() {
    let mut rig = Rig::enabled(2);
    (rig.follows, rig.status) = (false, 0x0203);
    rig.turns(3);
    assert_eq!(rig.words(), [0x00]);
    rig.status = 0x0207;
    rig.turns(3);
    assert!(rig.words().is_empty());
    // A drive that is back does not go on by itself either.
    let mut rig = Rig::enabled(2);
    rig.master().ask(read(1004));
    let now = rig.now;
    rig.master().order(now, Order::Start, 700);
    rig.turn();
    rig.master().handle_offline();
    assert_eq!((rig.master().poll(), rig.master().poll()), (Some(Event::Lost), None));
    assert_eq!((rig.master().outputs(), rig.facts()), ([0; 14], None));
    rig.master().handle_offline();
    assert_eq!(rig.master().poll(), None);
    rig.turns(20);
    assert_eq!((rig.words().last(), rig.master().poll()), (Some(&0), None));
    assert_eq!(DriveMaster::default().outputs(), [0; 14]);
}

#[test]
fn velocities_are_measured_over_50_ms_in_positioning_mode() {
    let mut rig = Rig::new(2);
    let runs = |rig: &mut Rig, counts: i32, velocity: i32| {
        let mut before = rig.facts().unwrap().velocity;
        for turn in 1..=100 {
            rig.actual += if turn % 50 == 0 { counts } else { 0 };
            rig.turn();
            let measured = rig.facts().unwrap().velocity;
            before = if turn == 50 { velocity } else { before };
            assert_eq!(measured, before, "{counts}, after {turn}");
        }
    };
    // The first measurement begins with the first exchange, and each further one at the end of the previous one.
    while rig.now.as_micros() % 50_000 != 1000 {
        rig.turn();
    }
    for (counts, velocity) in [(80, 60), (-80, -60), (1, 1), (-1, -1), (3, 2), (0, 0), (4000, 3000)] {
        runs(&mut rig, counts, velocity);
    }
    // A moving drive does not stand, however slow it is.
    let mut slow = Rig::offline(&AG03_1, 2);
    slow.parameters.values.insert(1011, 10);
    slow.turns(60);
    slow.actual -= 1;
    slow.turns(50);
    assert_eq!(slow.facts().unwrap().velocity, -1);
    // Reading changes nothing about it.
    let mut moving = Rig::new(2);
    moving.turns(100);
    for _ in 0..100 {
        moving.actual += 2;
        moving.turn();
    }
    let velocity = moving.facts().unwrap().velocity;
    assert!((70..=80).contains(&velocity), "{velocity}");
    moving.ask(read(1004));
    assert_eq!(moving.facts().unwrap().velocity, velocity);
    // A write may change the position, and another mode has another actual value.
    let mut rig = Rig::new(1);
    rig.actual = 30;
    rig.turns(200);
    let stands = |rig: &mut Rig, number, value, actual| {
        rig.ask(write(number, value));
        rig.actual = actual;
        for turn in 0..100 {
            rig.turn();
            let facts = rig.facts().unwrap();
            assert!(facts.mode == Mode::Velocity || facts.velocity == 0, "{number}, after {turn}: {facts:?}");
        }
        assert_eq!(rig.facts().unwrap().position, actual);
    };
    stands(&mut rig, MODE, 2, 5000);
    stands(&mut rig, 1018, 0, 0);
}
