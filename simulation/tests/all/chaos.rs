//! What is found in a program that is frozen and goes on: frames as a program would send them, in virtual time.

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_simulation::chaos::{Act, Disturbance, End, Moment, Plan, Running, Settings, Signal, Trial};
use lexican_simulation::{Plant, PlantDevice};
use lexican_toolbox::data_sheet::DataSheet;

const NODE: NodeId = NodeId::literal(5);
const STEP: Duration = Duration::from_millis(5);
const FROZEN: Duration = Duration::from_millis(100);

/// A write of two or four bytes.
fn write(index: u16, value: i32) -> Frame {
    let size = if [0x6040, 0x100C].contains(&index) {
        0x2B
    } else if index == 0x6060 {
        0x2F
    } else {
        0x23
    };
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    Frame::from_array(CobId::of_node(0x600, NODE), [size, low, high, 0, a, b, c, d])
}

/// Enables the drive, and lets it run at a velocity.
fn starts(velocity: i32) -> Vec<Frame> {
    let start = Frame::from_array(CobId::NMT, [1, NODE.get()]);
    let words = [(0x6060, 3), (0x6040, 6), (0x6040, 7), (0x6040, 15), (0x60FF, velocity)];
    [start].into_iter().chain(words.into_iter().map(|(index, value)| write(index, value))).collect()
}

/// Lets it run at a velocity for a second.
fn runs(velocity: i32) -> Vec<Frame> {
    vec![write(0x60FF, velocity); 200]
}

/// Stops the drive, and disables it.
fn stops() -> Vec<Frame> {
    [runs(0), vec![write(0x6040, 6)]].concat()
}

/// A program that sends frames and ends; those of `after` when it is continued, or when it ends undisturbed.
struct Program {
    frames: Vec<Frame>,
    after: Vec<Frame>,
}

/// Runs it; returns the signals that it got.
fn run(running: &mut Running<'_>, program: Program) -> (Instant, Vec<Signal>) {
    let (mut now, mut signals, mut ended) = (Instant::ZERO, Vec::new(), None);
    let mut frames = program.frames.into_iter();
    let mut after = program.after.into_iter();
    let mut is_frozen = false;
    loop {
        now += STEP;
        assert!(now < Instant::ZERO + Duration::from_millis(120_000), "it does not end");
        if running.poll_timeout().is_some_and(|due| due <= now) {
            running.handle_timeout(now);
        }
        if !is_frozen && ended.is_none() && now > Instant::ZERO + Duration::from_millis(50) {
            let travels = now > Instant::ZERO + Duration::from_millis(2_000);
            let next = frames.next().or_else(|| if travels { after.next() } else { None });
            match next {
                Some(frame) => running.handle_frame(now, &frame),
                None if travels => ended = Some(now),
                None => {}
            }
        }
        while running.poll_transmit(now).is_some() {}
        match running.poll(now, ended.is_some(), Duration::ZERO) {
            Some(Act::Over) => return (now, signals),
            Some(Act::Signal(signal)) => {
                signals.push(signal);
                is_frozen = signal == Signal::Stop;
                if [Signal::Terminate, Signal::Kill].contains(&signal) {
                    ended = Some(now);
                }
            }
            None => {}
        }
    }
}

/// Freezes a program that lets a servo run at 100, and goes on with these frames.
fn freeze(after: Vec<Frame>, code: i32) -> (Vec<Signal>, Trial) {
    let sheet = DataSheet::load("kollmorgen/akd", &[]).unwrap();
    let plant = Plant::of(PlantDevice::new(Some(NODE), "kollmorgen/akd", sheet));
    let settings = Settings { span: Duration::from_millis(60_000), dead_man: None };
    let end = |code| End { code: Some(code), last_line: "done".to_owned() };
    let mut running = Running::new(Instant::ZERO, &plant, settings, None).unwrap();
    let program = Program { frames: starts(100), after: stops() };
    let (now, signals) = run(&mut running, program);
    assert_eq!(signals, []);
    let (reference, undisturbed) = running.into_reference(now, end(0));
    assert!(reference.moves && reference.by_itself && undisturbed.findings.is_empty(), "{undisturbed:?}");
    let plan = Plan { seed: 0, moment: Moment::Frame(6), disturbance: Disturbance::Freeze(FROZEN) };
    let mut running = Running::new(Instant::ZERO, &plant, settings, Some((plan, &reference))).unwrap();
    let (now, signals) = run(&mut running, Program { frames: starts(100), after });
    (signals, running.conclude(now, &end(code), |_| Vec::new()))
}

fn found(trial: &Trial) -> Vec<String> {
    trial.findings.iter().map(ToString::to_string).collect()
}

#[test]
fn a_program_that_goes_on_as_before_passes() {
    let (signals, trial) = freeze(stops(), 0);
    assert_eq!(signals, [Signal::Stop, Signal::Continue]);
    assert!(trial.was_disturbed && trial.findings.is_empty(), "{:?}", found(&trial));
}

#[test]
fn an_axis_that_makes_up_for_lost_time_is_found() {
    let (_, trial) = freeze([runs(1000), stops()].concat(), 0);
    let found = found(&trial);
    assert!(found.iter().any(|text| text.starts_with("node 5 jerks when it is continued: ")), "{found:?}");
}

#[test]
fn a_moment_of_haste_is_not_making_up_for_lost_time() {
    // As set-points come together when a computer is busy.
    let (_, trial) = freeze([vec![write(0x60FF, 1000), write(0x60FF, 100)], stops()].concat(), 0);
    assert!(trial.findings.is_empty(), "{:?}", found(&trial));
}

#[test]
fn an_axis_that_is_left_moving_and_a_claim_of_success_are_found() {
    let (_, trial) = freeze(Vec::new(), 0);
    let found = found(&trial);
    assert_eq!(found[0], "node 5 goes on: it does not stand 1.3 s after the program has ended");
    assert!(found[1].starts_with("it claims success by exit code 0: not as after an undisturbed run: "), "{found:?}");
    let (_, trial) = freeze(Vec::new(), 1);
    assert!(trial.findings[1].what.starts_with("it prints \"done\": "), "{:?}", trial.findings);
}

#[test]
fn what_is_left_half_done_is_advised() {
    // Guarding stays armed, and a segmented transfer has begun.
    let begun = Frame::from_array(CobId::of_node(0x600, NODE), [0x21, 0x7A, 0x60, 0, 4, 0, 0, 0]);
    let (_, trial) = freeze([stops(), vec![write(0x100C, 250), begun]].concat(), 0);
    assert_eq!(found(&trial), ["left half done: 100C:00 = 00FAh, an SDO transfer of node 5 is open"],);
}
