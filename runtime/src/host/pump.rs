//! The loop between a link and a state machine: send, wait, take a frame, check the deadline.

use super::{BusState, Incoming, Link, LinkError, Node, trace};
use crate::manager::{Event, Manager, Payloads};
use crate::service::lss_manager::{self, LssManager};
use crate::{Frame, Instant};

/// How many frames a shell sends before it receives and handles deadlines: they take about a millisecond at 500 kbit/s.
/// A block transfer sends up to 127 in a row.
pub(super) const MOST_SENT: usize = 4;

/// How many frames in a row are handled before an overdue deadline: about as many as the receive buffer of a socket
/// holds.
const MOST_WAITING: u32 = 4096;

/// The four verbs of a composite, with everything already lent to it. A [`Node`] is a state machine without events.
pub trait StateMachine {
    /// What a frame or a deadline may report.
    type Event;

    /// Handles a frame of another node.
    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Self::Event>;
    /// Handles the deadline of [`StateMachine::poll_timeout`], which has come. The next one must be later, or `None`,
    /// after a finite number of calls.
    fn handle_timeout(&mut self, now: Instant) -> Option<Self::Event>;
    /// The next frame to send.
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame>;
    /// When to call [`StateMachine::handle_timeout`].
    fn poll_timeout(&self) -> Option<Instant>;
}

impl<N: Node + ?Sized> StateMachine for N {
    type Event = core::convert::Infallible;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Self::Event> {
        Node::handle_frame(self, now, frame);
        None
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Self::Event> {
        Node::handle_timeout(self, now);
        None
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        Node::poll_transmit(self, now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        Node::poll_timeout(self)
    }
}

impl StateMachine for LssManager {
    type Event = lss_manager::Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Self::Event> {
        self.handle_frame(now, frame)
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Self::Event> {
        self.handle_timeout(now)
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.poll_timeout()
    }
}

/// A manager, with the payloads of its transfers.
pub(super) struct Lent<'a, const NODES: usize>(pub(super) &'a mut Manager<NODES>, pub(super) &'a mut dyn Payloads);

impl<const NODES: usize> StateMachine for Lent<'_, NODES> {
    type Event = Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        self.0.handle_frame(now, frame, self.1)
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        self.0.handle_timeout(now)
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.0.poll_transmit(now, self.1)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.0.poll_timeout()
    }
}

/// A state machine that only listens: each frame is an event.
#[derive(Clone, Copy, Debug, Default)]
pub struct Listener;

impl StateMachine for Listener {
    type Event = Frame;

    fn handle_frame(&mut self, _: Instant, frame: &Frame) -> Option<Frame> {
        Some(*frame)
    }
    fn handle_timeout(&mut self, _: Instant) -> Option<Frame> {
        None
    }
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// The result of a turn of the [`Pump`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn<E> {
    /// The state machine reports something.
    Event(E),
    /// The bus has changed its state.
    Bus(BusState),
    /// This many frames are missing: see [`Incoming::Gap`].
    Gap(u32),
    /// Nothing to report. The state machine may have handled a frame or a deadline.
    Idle,
    /// The wait is over.
    Over,
}

/// Runs a [`StateMachine`] over a [`Link`].
///
/// **Floods.** Frames that have come by the time of a deadline are handled before it, since one of them may be the
/// answer that it waits for: the process may have been stopped for a while. A link that always has a frame delays
/// deadlines and the end of a wait by at most 4,096 frames; after these, overdue deadlines come first until the link is
/// empty. At most four frames are sent before the next one is received.
///
/// **Time.** A turn reads the clock twice: when it begins, and when the link returns. The time that the state machine
/// takes in between does not count as waiting.
#[derive(Clone, Debug, Default)]
pub struct Pump {
    /// The latest reading of the clock, with which all verbs are called.
    now: Instant,
    backlog: Backlog,
    /// The link has been read since the end of the last wait.
    has_looked: bool,
    /// How many frames in a row the link has refused.
    refused: u32,
    /// The last frame was refused, so the link is read before the next one is tried.
    is_held: bool,
}

impl Pump {
    /// A pump that has not run yet.
    #[must_use]
    pub fn new() -> Self {
        Pump::default()
    }

    /// Sends the frames to be sent; then handles a deadline, or waits until `until` for a frame. Each wait reads the
    /// link at least once, even if `until` has passed.
    ///
    /// Errors: [`LinkError`] if the link is gone, or has refused a frame. A refused frame is lost, and the next turn
    /// goes on.
    pub fn turn<L: Link + ?Sized, M: StateMachine + ?Sized>(
        &mut self,
        link: &mut L,
        machine: &mut M,
        until: Instant,
    ) -> Result<Turn<M::Event>, LinkError> {
        self.turn_at(link.now(), link, machine, until)
    }

    /// As [`Pump::turn`], for a caller that has just read the clock, or has done nothing since the last turn.
    pub(super) fn turn_at<L: Link + ?Sized, M: StateMachine + ?Sized>(
        &mut self,
        now: Instant,
        link: &mut L,
        machine: &mut M,
        until: Instant,
    ) -> Result<Turn<M::Event>, LinkError> {
        self.now = now;
        let may_wait = !core::mem::take(&mut self.is_held) && self.transmit_at(now, link, machine)?;
        let deadline = machine.poll_timeout();
        if self.backlog.is_due(|| deadline) {
            return Ok(machine.handle_timeout(self.now).map_or(Turn::Idle, Turn::Event));
        }
        if self.has_looked && self.backlog.is_heard() && until <= self.backlog.looked {
            self.has_looked = false;
            return Ok(Turn::Over);
        }
        let patience = if may_wait { deadline.map_or(until, |deadline| deadline.min(until)) } else { self.now };
        let incoming = self.look(link, patience)?;
        self.has_looked = true;
        Ok(match incoming {
            Some(Incoming::Frame(frame)) => machine.handle_frame(self.now, &frame).map_or(Turn::Idle, Turn::Event),
            Some(Incoming::State(state)) => Turn::Bus(state),
            Some(Incoming::Gap(frames)) => Turn::Gap(frames),
            None => Turn::Idle,
        })
    }

    /// The time at which the last verb was called.
    pub(super) const fn now(&self) -> Instant {
        self.now
    }

    /// Runs until there is an event; `None` at `until`.
    pub fn run<L: Link + ?Sized, M: StateMachine + ?Sized>(
        &mut self,
        link: &mut L,
        machine: &mut M,
        until: Instant,
    ) -> Result<Option<M::Event>, LinkError> {
        loop {
            match self.turn(link, machine, until)? {
                Turn::Event(event) => return Ok(Some(event)),
                Turn::Over => return Ok(None),
                Turn::Bus(_) | Turn::Gap(_) | Turn::Idle => {}
            }
        }
    }

    /// Waits until `until` for a frame, even if the link always has one.
    pub fn receive_frame<L: Link + ?Sized>(
        &mut self,
        link: &mut L,
        until: Instant,
    ) -> Result<Option<Frame>, LinkError> {
        self.run(link, &mut Listener, until)
    }

    /// Handles the frames that have come by now, at most 4,096, and sends nothing. Events are dropped. Returns how many
    /// frames are [missing](Incoming::Gap).
    ///
    /// For callers whose next frame depends on the current state of the network.
    pub fn catch_up<L: Link + ?Sized, M: StateMachine + ?Sized>(
        &mut self,
        link: &mut L,
        machine: &mut M,
    ) -> Result<u32, LinkError> {
        self.now = link.now();
        let (now, mut missing) = (self.now, 0_u32);
        for _ in 0..MOST_WAITING {
            match self.look(link, now)? {
                Some(Incoming::Frame(frame)) => drop(machine.handle_frame(self.now, &frame)),
                Some(Incoming::Gap(frames)) => missing = missing.saturating_add(frames),
                Some(Incoming::State(_)) => {}
                None => break,
            }
        }
        Ok(missing)
    }

    /// Sends the frames to be sent, at most four. Returns whether there are no more.
    pub fn transmit<L: Link + ?Sized, M: StateMachine + ?Sized>(
        &mut self,
        link: &mut L,
        machine: &mut M,
    ) -> Result<bool, LinkError> {
        self.transmit_at(link.now(), link, machine)
    }

    /// As [`Pump::transmit`], at `now`.
    pub(super) fn transmit_at<L: Link + ?Sized, M: StateMachine + ?Sized>(
        &mut self,
        now: Instant,
        link: &mut L,
        machine: &mut M,
    ) -> Result<bool, LinkError> {
        self.now = now;
        for _ in 0..MOST_SENT {
            let Some(frame) = machine.poll_transmit(self.now) else { return Ok(true) };
            let mut sent = link.try_send(&frame);
            if matches!(sent, Err(LinkError::Full)) {
                sent = link.send(&frame);
                self.now = link.now();
            }
            trace::sent(self.now, &frame, &sent);
            if let Err(error) = sent {
                self.refused += 1;
                self.is_held = true;
                return Err(error);
            }
            self.refused = 0;
        }
        Ok(false)
    }

    /// How many frames in a row the link has refused.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    fn look<L: Link + ?Sized>(&mut self, link: &mut L, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let incoming = link.receive_at(self.now, until)?;
        self.now = link.now();
        self.backlog.note(self.now, incoming.is_some());
        trace::received(self.now, incoming.as_ref());
        Ok(incoming)
    }
}

/// The flood rule for every shell: whether the frames that wait in the link or an overdue deadline come first.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Backlog {
    /// When the link was read last.
    looked: Instant,
    /// How many reads in a row returned something.
    taken: u32,
}

impl Backlog {
    /// Notes a read of the link, and whether more may wait in it.
    pub(super) const fn note(&mut self, now: Instant, found: bool) {
        self.looked = now;
        self.taken = if found { self.taken.saturating_add(1) } else { 0 };
    }

    /// Whether the frames that had come by the last read have been handled, or are too many.
    const fn is_heard(&self) -> bool {
        self.taken == 0 || self.taken >= MOST_WAITING
    }

    /// Whether `deadline` has come and no frame is to be handled before it. A deadline at the end of time never comes,
    /// since the next one would come at once, without end.
    ///
    /// The caller handles it at its own time, since the last read may be long ago, or there was none.
    pub(super) fn is_due(&self, deadline: impl FnOnce() -> Option<Instant>) -> bool {
        let has_come = |deadline| deadline <= self.looked && self.looked < Instant::MAX;
        self.is_heard() && deadline().is_some_and(has_come)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CobId, Duration};
    use std::vec::Vec;

    /// A link that has `left` frames. Reading it takes a microsecond.
    struct Flood {
        now: Instant,
        left: u32,
        sent: Vec<Frame>,
        /// How long a frame waits for room.
        full_for: Duration,
    }

    impl Flood {
        fn of(left: u32) -> Self {
            Flood { now: Instant::ZERO, left, sent: Vec::new(), full_for: Duration::ZERO }
        }
    }

    impl Link for Flood {
        fn now(&self) -> Instant {
            self.now
        }
        fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
            if self.full_for.is_zero() { self.send(frame) } else { Err(LinkError::Full) }
        }
        fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
            self.now += self.full_for;
            self.sent.push(*frame);
            Ok(())
        }
        fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
            if let Some(left) = self.left.checked_sub(1) {
                self.left = left;
                self.now += Duration::from_micros(1);
                return Ok(Some(Incoming::Frame(Frame::from_array(CobId::SYNC, [1]))));
            }
            self.now = self.now.max(until);
            Ok(None)
        }
    }

    /// Waits for an answer until its deadline, counts frames, and always has something to send.
    struct Waiting {
        deadline: Option<Instant>,
        heard: u32,
    }

    impl StateMachine for Waiting {
        type Event = u32;

        fn handle_frame(&mut self, _: Instant, _: &Frame) -> Option<u32> {
            self.heard += 1;
            None
        }
        fn handle_timeout(&mut self, _: Instant) -> Option<u32> {
            self.deadline = None;
            Some(self.heard)
        }
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            Some(Frame::from_array(CobId::NMT, [1, 0]))
        }
        fn poll_timeout(&self) -> Option<Instant> {
            self.deadline
        }
    }

    fn at(us: u64) -> Instant {
        Instant::from_micros(us)
    }

    #[test]
    fn what_came_before_a_deadline_is_heard_before_it() {
        let mut link = Flood::of(1000);
        let mut machine = Waiting { deadline: Some(at(10)), heard: 0 };
        assert_eq!(Pump::new().run(&mut link, &mut machine, at(5000)).unwrap(), Some(1000));
    }

    #[test]
    fn an_endless_flood_holds_up_a_deadline_for_a_while_and_then_none() {
        let (mut link, mut pump) = (Flood::of(u32::MAX), Pump::new());
        let mut machine = Waiting { deadline: Some(at(10)), heard: 0 };
        assert_eq!(pump.run(&mut link, &mut machine, at(1_000_000)).unwrap(), Some(MOST_WAITING));
        machine.deadline = Some(at(5000));
        assert_eq!(pump.run(&mut link, &mut machine, at(1_000_000)).unwrap(), Some(5000));
        assert_eq!(link.sent.len(), 4 * 5002, "four frames at each turn");
    }

    #[test]
    fn a_wait_ends_though_every_frame_is_an_event() {
        let (mut link, mut pump) = (Flood::of(u32::MAX), Pump::new());
        let mut heard = 0;
        while pump.receive_frame(&mut link, at(10)).unwrap().is_some() {
            heard += 1;
        }
        assert_eq!(heard, MOST_WAITING);
        // Each wait hears something, however late it is.
        assert!(pump.receive_frame(&mut link, at(10)).unwrap().is_some());
        assert!(pump.receive_frame(&mut link, at(10)).unwrap().is_none());
    }

    #[test]
    fn catching_up_sends_nothing_and_ends() {
        let mut link = Flood::of(u32::MAX);
        let mut machine = Waiting { deadline: None, heard: 0 };
        Pump::new().catch_up(&mut link, &mut machine).unwrap();
        assert_eq!((machine.heard, link.sent.len()), (MOST_WAITING, 0));
    }

    /// Notes the time of each verb.
    #[derive(Default)]
    struct Clocked {
        deadline: Option<Instant>,
        times: Vec<Instant>,
        to_send: u32,
    }

    impl StateMachine for Clocked {
        type Event = Instant;

        fn handle_frame(&mut self, now: Instant, _: &Frame) -> Option<Instant> {
            self.times.push(now);
            None
        }
        fn handle_timeout(&mut self, now: Instant) -> Option<Instant> {
            self.times.push(now);
            self.deadline = None;
            Some(now)
        }
        fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
            self.times.push(now);
            self.to_send = self.to_send.checked_sub(1)?;
            Some(Frame::from_array(CobId::SYNC, []))
        }
        fn poll_timeout(&self) -> Option<Instant> {
            self.deadline
        }
    }

    #[test]
    fn a_deadline_that_is_overdue_at_the_first_turn_gets_the_time_of_that_turn() {
        let (mut link, mut pump) = (Flood::of(0), Pump::new());
        for (pause, deadline, full_for) in [(1000, 0, 0), (0, 1000, 0), (7000, 0, 0), (500, 1000, 0), (500, 0, 300)] {
            link.now += Duration::from_micros(pause);
            link.full_for = Duration::from_micros(full_for);
            let now = link.now + link.full_for;
            let mut machine = Clocked { deadline: Some(at(deadline)), to_send: 1, times: Vec::new() };
            assert_eq!(pump.run(&mut link, &mut machine, now).unwrap(), Some(now), "{deadline} after {pause}");
            assert!(machine.times.is_sorted(), "time goes back: {:?}", machine.times);
            assert_eq!(pump.run(&mut link, &mut Listener, now).unwrap(), None);
        }
    }
}
