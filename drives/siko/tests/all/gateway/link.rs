//! The gateway as a link and as a node: when the line runs, and for how long.

use std::cell::RefCell;
use std::collections::VecDeque;

use lexican_runtime::host::{Incoming, Link, LinkError, Node, candump};
use lexican_runtime::{Duration, Frame, Instant};
use siko::gateway::{Carrier, GatewayLink, GatewayNode, Report};
use siko::words::system::MOTOR_RELEASED;

use super::rig::*;

/// A line whose reports come at times set by the test.
#[derive(Default)]
struct Line {
    now: Instant,
    reports: VecDeque<(Instant, Report)>,
    /// The periods in which it was carried, in ms.
    carried: Vec<(u64, u64)>,
    is_gone: bool,
    /// Whether it panics when it is carried.
    panics: bool,
}

impl Carrier<Scripted> for &RefCell<Line> {
    fn now(&self) -> Instant {
        self.borrow().now
    }

    fn carry(&mut self, door: &mut Scripted, until: Instant) -> Result<(), LinkError> {
        let mut line = self.borrow_mut();
        assert!(line.carried.len() < 20, "it does not end");
        let now = in_ms(line.now);
        line.carried.push((now, in_ms(until)));
        assert!(!line.panics, "as the test says");
        if line.is_gone {
            return Err(LinkError::Closed);
        }
        let next = line.reports.front().copied().filter(|(at, _)| *at <= until);
        line.reports.drain(..usize::from(next.is_some()));
        line.now = next.map_or(until, |(at, _)| at).max(line.now);
        door.reports.extend(next.map(|(_, report)| report));
        Ok(())
    }

    fn is_real_time(&self) -> bool {
        false
    }

    fn next_event(&self) -> Option<Instant> {
        self.borrow().reports.front().map(|(at, _)| *at)
    }
}

fn ms(ms: u64) -> Instant {
    Instant::ZERO + Duration::from_millis(ms)
}

fn in_ms(at: Instant) -> u64 {
    at.since(Instant::ZERO).as_micros() / 1000
}

impl Line {
    /// The drive appears after 10 ms, and its positioning mode after 20.
    fn new() -> RefCell<Self> {
        let reports = [(ms(10), facts(MOTOR_RELEASED)), (ms(20), Report::Done(Ok(1)))];
        RefCell::new(Line { reports: reports.into(), ..Line::default() })
    }
}

fn start() -> Frame {
    "(0000000000.000000) can0 000#0105".parse::<candump::Line>().unwrap().frame
}

/// The received frame, and the time at which the wait ends.
fn receives(link: &mut impl Link, until: u64) -> (Option<String>, u64) {
    let frame = link.receive(ms(until)).unwrap().map(|incoming| match incoming {
        Incoming::Frame(frame) => frame.to_string(),
        other => panic!("{other:?}"),
    });
    (frame, in_ms(link.now()))
}

#[test]
fn a_link_waits_for_frames_deadlines_and_the_line() {
    let line = Line::new();
    let mut link = GatewayLink::new(Rig::silent().gateway, &line);
    let carried = || std::mem::take(&mut line.borrow_mut().carried);
    assert!(!link.is_real_time());
    assert_eq!(receives(&mut link, 5), (None, 5));
    assert_eq!(receives(&mut link, 30), (Some("705#00".to_owned()), 10));
    link.send(&start()).unwrap();
    assert_eq!(receives(&mut link, 30), (None, 30));
    assert_eq!(carried(), [(0, 5), (5, 30), (10, 30), (20, 30)]);
    assert_eq!(receives(&mut link, 500), (Some("185#7002".to_owned()), 110), "TPDO1");
    assert_eq!(carried(), [(30, 110)]);
    // Reports that have come are also taken by a wait that is over before it begins.
    line.borrow_mut().reports.push_back((ms(110), Report::Lost));
    assert_eq!((receives(&mut link, 0), link.gateway().is_connected()), ((None, 110), false));
    assert_eq!(carried(), [(110, 110)]);
    line.borrow_mut().is_gone = true;
    assert!(matches!(link.receive(ms(500)), Err(LinkError::Closed)));
}

#[test]
fn a_link_that_is_dropped_carries_what_is_under_way_for_half_a_second() {
    let dropped = |reports: &[(u64, Report)], deadline: Option<u64>, is_gone: bool| {
        let reports = reports.iter().map(|(at, report)| (ms(*at), *report)).collect();
        let line = RefCell::new(Line { now: ms(1000), reports, is_gone, ..Line::default() });
        let mut rig = Rig::silent();
        rig.sees(MOTOR_RELEASED);
        rig.gateway.door_mut().deadline = deadline.map(ms);
        drop(GatewayLink::new(rig.gateway, &line));
        line.into_inner().carried
    };
    let done = Report::Done(Ok(1));
    assert_eq!(dropped(&[(1100, done)], None, false), [(1000, 1500)]);
    assert_eq!(dropped(&[(1100, facts(0)), (1200, done)], None, false), [(1000, 1500), (1100, 1500)]);
    assert_eq!(dropped(&[], None, false), [(1000, 1500)]);
    assert_eq!(dropped(&[], Some(2000), false), [(1000, 1500)]);
    assert_eq!(dropped(&[(1100, done)], Some(1200), false), [(1000, 1200)]);
    assert_eq!(dropped(&[], None, true), [(1000, 1500)]);
    let line = RefCell::default();
    drop(GatewayLink::new(Rig::silent().gateway, &line));
    assert_eq!(line.into_inner().carried, [], "nothing is under way");
}

/// The process is not aborted, and pending orders are still sent while a program panics.
#[test]
fn a_line_that_panics_while_a_program_does_harms_nobody() {
    for panics in [false, true] {
        let line = RefCell::new(Line { panics, ..Line::default() });
        let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let mut rig = Rig::silent();
            rig.sees(MOTOR_RELEASED);
            let _link = GatewayLink::new(rig.gateway, &line);
            panic!("the program");
        }));
        let message = ended.unwrap_err();
        assert_eq!(message.downcast_ref(), Some(&"the program"));
        assert_eq!(line.into_inner().carried, [(0, 500)]);
    }
}

#[test]
fn a_node_follows_the_time_of_its_bus() {
    let line = Line::new();
    let mut node = GatewayNode::new(Rig::silent().gateway, &line);
    let carried = || std::mem::take(&mut line.borrow_mut().carried);
    assert_eq!(node.poll_timeout(), Some(ms(10)));
    node.handle_timeout(ms(10));
    assert_eq!(
        (node.poll_transmit(ms(10)).unwrap().to_string().as_str(), node.poll_timeout()),
        ("705#00", Some(ms(20)))
    );
    assert_eq!(carried(), [(0, 10), (10, 10)], "what follows from what has come leaves");
    // Reports that have come by then are taken before a frame, and the consequences of the frame are sent, too.
    node.handle_frame(ms(25), &start());
    assert!(!node.gateway().is_busy());
    assert_eq!(carried(), [(10, 25), (20, 25), (25, 25), (25, 25), (25, 25)]);
    assert_eq!(node.poll_timeout(), Some(ms(125)), "TPDO1");
    node.handle_timeout(ms(125));
    assert_eq!(node.poll_transmit(ms(125)).unwrap().to_string(), "185#7002");
    // All reports due at a time are taken then.
    let lost = [(ms(130), facts(0)), (ms(130), Report::Lost)];
    line.borrow_mut().reports.extend(lost);
    node.handle_timeout(ms(130));
    assert!(!node.gateway().is_connected());
    line.borrow_mut().is_gone = true;
    node.handle_timeout(ms(225));
    assert_eq!(node.poll_transmit(ms(225)), None);
}
