//! Random frames from the axes of a path never make a follower panic, delay its end, or make it send unordered motion.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use lexican_driver::Mode;
use lexican_driver::cyclic::{self, AxisSettings, Event, Follower, Path, Settings, Stop, Supply, SyncSource};
use lexican_runtime::host::{Link, Pump, StateMachine, Turn, VirtualLink};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use proptest::prelude::*;

use crate::rig::{DESCRIPTION, MOST, PERIOD, Rig, start};

/// How far from its start an axis may travel.
const REACH: i32 = 300;

/// An event of a test.
#[derive(Clone, Debug)]
enum Happening {
    /// A frame from outside.
    Frame(Frame),
    /// The follower runs for this long.
    Pass(Duration),
    /// The process does not run for this long.
    Stall(Duration),
    /// The link has no room for this many frames.
    Full(u32),
    Cancel,
}

fn happening() -> impl Strategy<Value = Happening> {
    let id = prop_oneof![
        5 => (0_usize..8).prop_map(|at| [0x381_u16, 0x382, 0x081, 0x082, 0x701, 0x702, 0x080, 0x000][at]),
        1 => 0_u16..0x800,
    ];
    let any_frame = (id, proptest::collection::vec(any::<u8>(), 0..=8));
    let state = prop_oneof![8 => Just(0x27_u16), 1 => (0_usize..7).prop_map(|at| [0, 0x40, 0x21, 0x23, 7, 8, 0xF][at])];
    let position = prop_oneof![4 => 500..2500_i32, 1 => any::<i32>()];
    let report = (0x381_u16..=0x382, state, any::<bool>(), position).prop_map(|(id, state, follows, position)| {
        let status_word = state | u16::from(follows) << 12;
        (id, [&status_word.to_le_bytes()[..], &position.to_le_bytes()].concat())
    });
    let frame = prop_oneof![1 => any_frame, 2 => report].prop_map(|(id, data): (u16, Vec<u8>)| {
        Happening::Frame(Frame::new(CobId::standard(id).expect("eleven bits"), &data).expect("eight bytes at most"))
    });
    prop_oneof![
        6 => frame,
        6 => (0_u64..20_000).prop_map(|us| Happening::Pass(Duration::from_micros(us))),
        1 => (0_u64..5_000).prop_map(|us| Happening::Stall(Duration::from_micros(us))),
        2 => (1_u32..5).prop_map(Happening::Full),
        1 => Just(Happening::Cancel),
    ]
}

/// The program's steps of both axes for a cycle, mostly within their limits.
fn supply() -> impl Strategy<Value = Option<[i32; 2]>> {
    let step = prop_oneof![20 => -20_i32..=20, 1 => -100_i32..=100];
    prop_oneof![20 => [step.clone(), step].prop_map(Some), 1 => Just(None)]
}

/// The set-points that the path has supplied for each cycle; `None` if they were late.
type Ordered = Rc<RefCell<Vec<Option<Vec<i32>>>>>;

fn path(steps: Vec<Option<[i32; 2]>>, ordered: Ordered) -> impl Path {
    let mut steps = steps.into_iter();
    move |_, set_points: &mut [i32]| match steps.next() {
        None => Supply::End,
        Some(None) => {
            ordered.borrow_mut().push(None);
            Supply::Late
        }
        Some(Some(steps)) => {
            set_points.iter_mut().zip(steps).for_each(|(it, step)| *it = it.saturating_add(step));
            ordered.borrow_mut().push(Some(set_points.to_vec()));
            Supply::Ready
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Enabling,
    Following,
    Stopping,
    Over,
}

/// What a follower has received from an axis and sent to it.
#[derive(Debug)]
struct Heard {
    state: Option<State>,
    positions: Vec<i32>,
    has_booted: bool,
    sent: i32,
    /// How often the link has had no room since then: cycles may have been skipped.
    skipped: u32,
}

/// A follower, and what it is allowed to send.
struct Watched<P> {
    follower: Follower<P>,
    /// How often the link will have no room.
    full: u32,
    settings: AxisSettings,
    phase: Phase,
    ordered: Ordered,
    axes: BTreeMap<u8, Heard>,
}

impl<P: Path> Watched<P> {
    fn note(&mut self, event: Option<Event>) -> Option<Event> {
        match event {
            Some(Event::Following) => self.phase = Phase::Following,
            Some(Event::Stopping(_)) => self.phase = Phase::Stopping,
            Some(Event::Over) => self.phase = Phase::Over,
            None => {}
        }
        event
    }

    fn hear(&mut self, frame: &Frame) {
        let (function, node) = (frame.id().raw() & 0x780, (frame.id().raw() & 0x7F) as u8);
        let Some(axis) = self.axes.get_mut(&node).filter(|_| !frame.id().is_extended()) else { return };
        match (function, frame.data()) {
            (0x380, &[low, high, a, b, c, d, ..]) => {
                axis.state = State::from_status_word(u16::from_le_bytes([low, high]));
                axis.positions.push(i32::from_le_bytes([a, b, c, d]));
            }
            (0x700, &[0]) => axis.has_booted = true,
            _ => {}
        }
    }

    fn check(&mut self, frame: &Frame) {
        let (function, node) = (frame.id().raw() & 0x780, (frame.id().raw() & 0x7F) as u8);
        let (0x300, &[low, high, a, b, c, d]) = (function, frame.data()) else {
            assert_eq!(frame.id(), CobId::SYNC, "{frame}");
            return;
        };
        let (word, set_point) = (u16::from_le_bytes([low, high]), i32::from_le_bytes([a, b, c, d]));
        let axis = self.axes.get_mut(&node).expect("it is one of the axes");
        assert!(self.phase != Phase::Over && !axis.has_booted, "{frame} in {:?}: {axis:?}", self.phase);
        // Bits 0 to 3 of "enable operation" (CiA 402-2, table of commands).
        let keeps_enabled = axis.state == Some(State::OperationEnabled);
        let enables = word & 0x0F == 0x0F && !keeps_enabled;
        let leads_on = matches!(word & 0x0F, 0x06 | 0x07);
        assert!(self.phase == Phase::Enabling || !enables && !leads_on, "{frame} in {:?}: {axis:?}", self.phase);

        let before = std::mem::replace(&mut axis.sent, set_point);
        let skipped = std::mem::take(&mut axis.skipped);
        let ordered = self.ordered.borrow();
        if self.settings.mode == Mode::CyclicVelocity {
            let fastest = ordered.iter().flatten().map(|it| it[usize::from(node) - 1].unsigned_abs()).max();
            assert!(set_point.unsigned_abs() <= fastest.unwrap_or(0), "{frame}: {ordered:?}");
            return;
        }
        if self.phase == Phase::Enabling {
            assert!(set_point == before || axis.positions.contains(&set_point), "{frame}: {axis:?}");
            return;
        }
        assert!(before.abs_diff(set_point) <= MOST * (1 + skipped), "{frame} steps from {before}: {ordered:?}");
        let home = start(NodeId::literal(node));
        let (low, high) = (before.min(home - REACH), before.max(home + REACH));
        assert!((low..=high).contains(&set_point), "{frame} leads from {before} out of the limits");
        if let (Phase::Following, Some(Some(last))) = (self.phase, ordered.last()) {
            assert_eq!(set_point, last[usize::from(node) - 1], "{frame}: {ordered:?}");
        }
    }
}

impl<P: Path> StateMachine for Watched<P> {
    type Event = Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        self.hear(frame);
        let event = self.follower.handle_frame(now, frame);
        self.note(event)
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        let event = self.follower.handle_timeout(now);
        self.note(event)
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.full > 0 && self.follower.poll_timeout().is_some() {
            self.full -= 1;
            self.axes.values_mut().for_each(|axis| axis.skipped += 1);
            return None;
        }
        let frame = self.follower.poll_transmit(now)?;
        self.check(&frame);
        Some(frame)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.follower.poll_timeout()
    }
}

/// The longest ramp of all.
const RAMP: Duration = Duration::from_millis(20);

fn run(mode: Mode, settings: Settings, steps: Vec<Option<[i32; 2]>>, happenings: &[Happening]) {
    let mut rig = Rig::new(2);
    let axis_settings = AxisSettings { mode, following_error: u32::MAX, ..Rig::settings() };
    let nodes = || (1..=2).map(NodeId::literal);
    let axes = nodes().map(|node| {
        let home = start(node);
        cyclic::Axis::new(node, &DESCRIPTION, axis_settings, home).within(home - REACH, home + REACH)
    });
    let ordered = Ordered::default();
    let ends = steps.len();
    let follower = Follower::new(axes.collect(), path(steps, Rc::clone(&ordered)), settings).unwrap();
    let heard = |node| {
        let sent = if mode == Mode::CyclicVelocity { 0 } else { start(node) };
        (node.get(), Heard { state: None, positions: Vec::new(), has_booted: false, sent, skipped: 0 })
    };
    let mut watched = Watched {
        follower,
        full: 0,
        settings: axis_settings,
        phase: Phase::Enabling,
        ordered,
        axes: nodes().map(heard).collect(),
    };
    let (mut pump, mut other) = (Pump::new(), rig.bus.link());
    let mut pass = |link: &mut VirtualLink, watched: &mut Watched<_>, span| {
        let until = link.now() + span;
        while pump.turn(link, watched, until).unwrap() != Turn::Over {}
    };
    for happening in happenings {
        match happening {
            Happening::Frame(frame) => other.send(frame).unwrap(),
            Happening::Pass(span) => pass(&mut rig.link, &mut watched, *span),
            Happening::Stall(span) => rig.bus.advance(*span),
            Happening::Full(times) => watched.full = *times,
            Happening::Cancel => watched.follower.cancel(),
        }
    }
    watched.follower.cancel();
    // Lost SYNC is noticed within three cycles; some more are for changes between stages.
    pass(&mut rig.link, &mut watched, RAMP + settings.settle.times(3) + PERIOD.times(10));
    let report = watched.follower.report();
    assert!(watched.follower.is_over(), "{:?}: {:?}: {report}", watched.phase, watched.axes);
    assert!(report.reason.is_some() || watched.ordered.borrow().len() == ends, "{report}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn no_frames_make_a_follower_send_what_was_not_ordered(
        mode in prop_oneof![
            2 => Just(Mode::CyclicPosition),
            1 => Just(Mode::InterpolatedPosition),
            1 => Just(Mode::CyclicVelocity),
        ],
        stop in prop_oneof![Just(Stop::Ramp(RAMP)), Just(Stop::Quick)],
        sync in prop_oneof![
            2 => Just(Settings::default().sync),
            1 => Just(SyncSource::Followed { id: CobId::SYNC }),
        ],
        steps in proptest::collection::vec(supply(), 0..100),
        happenings in proptest::collection::vec(happening(), 0..20),
    ) {
        run(mode, Settings { stop, sync, ..Settings::default() }, steps, &happenings);
    }
}
