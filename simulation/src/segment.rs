//! Several nodes behind one link. They hear each other, and faults may happen to their frames.

use std::collections::VecDeque;

use lexican_machine::Fault;
use lexican_runtime::host::{Fate, Node};
use lexican_runtime::{CobId, Frame, Instant};

/// The nodes of a plant as one node of the bus behind a link.
pub struct Segment<N> {
    stations: Vec<Station<N>>,
    faults: Vec<Happening>,
    delayed: Vec<Delayed>,
    /// Frames that have been delivered inside, and are still to go to the link.
    outgoing: VecDeque<Frame>,
}

/// A node with the transmit buffer of its controller, where a frame that lost arbitration waits.
struct Station<N> {
    node: N,
    buffer: Option<Frame>,
}

/// A fault of the plant and its state.
struct Happening {
    fault: Fault,
    /// The number of frames that it concerns in the present cycle of `every`.
    count: u32,
    on: bool,
}

struct Delayed {
    /// `None` if the frame came from outside.
    sender: Option<usize>,
    frame: Frame,
    due: Instant,
}

impl<N: Node> Segment<N> {
    /// Nodes behind one link, with these faults between them.
    pub fn new(nodes: impl IntoIterator<Item = N>, faults: &[Fault]) -> Self {
        Segment {
            stations: nodes.into_iter().map(|node| Station { node, buffer: None }).collect(),
            faults: faults.iter().map(|fault| Happening { fault: *fault, count: 0, on: true }).collect(),
            delayed: Vec::new(),
            outgoing: VecDeque::new(),
        }
    }

    /// The nodes, in their order.
    pub fn nodes(&self) -> impl Iterator<Item = &N> {
        self.stations.iter().map(|station| &station.node)
    }

    /// The nodes, in their order.
    pub fn nodes_mut(&mut self) -> impl Iterator<Item = &mut N> {
        self.stations.iter_mut().map(|station| &mut station.node)
    }

    /// The faults, in their order, and whether they are on.
    pub fn faults(&self) -> impl Iterator<Item = (Fault, bool)> {
        self.faults.iter().map(|happening| (happening.fault, happening.on))
    }

    /// Switches the fault at this index on or off, and restarts its count. `false` if there is none.
    pub fn set_fault(&mut self, at: usize, on: bool) -> bool {
        let Some(happening) = self.faults.get_mut(at) else { return false };
        (happening.count, happening.on) = (0, on);
        true
    }

    /// The fate of a frame, from the first fault that happens to it. All faults that concern the frame count it.
    fn fate(&mut self, sender: Option<usize>, frame: &Frame) -> Fate {
        let mut fate = None;
        for Happening { fault, count, .. } in self.faults.iter_mut().filter(|happening| happening.on) {
            if fault.sender.is_none_or(|wanted| Some(wanted) == sender) && fault.id.is_none_or(|id| id == frame.id()) {
                *count += 1;
                if *count + fault.in_a_row > fault.every {
                    fate = fate.or(Some(fault.fate));
                }
                if *count >= fault.every {
                    *count = 0;
                }
            }
        }
        fate.unwrap_or(Fate::Deliver)
    }

    /// Delivers a frame to all nodes but its sender. A frame of a node also goes outside.
    fn deliver(&mut self, now: Instant, sender: Option<usize>, frame: &Frame) {
        for (receiver, station) in self.stations.iter_mut().enumerate() {
            if Some(receiver) != sender {
                station.node.handle_frame(now, frame);
            }
        }
        if sender.is_some() {
            self.outgoing.push_back(*frame);
        }
    }

    fn carry(&mut self, now: Instant, sender: Option<usize>, frame: Frame) {
        match self.fate(sender, &frame) {
            Fate::Deliver => self.deliver(now, sender, &frame),
            Fate::Lose => {}
            Fate::Repeat => {
                self.deliver(now, sender, &frame);
                self.deliver(now, sender, &frame);
            }
            Fate::Replace(other) => self.deliver(now, sender, &other),
            Fate::Delay(span) => self.delayed.push(Delayed { sender, frame, due: now + span }),
        }
    }

    /// Takes the frame that wins arbitration among those that wait.
    fn arbitrate(&mut self, now: Instant) -> Option<(usize, Frame)> {
        for station in &mut self.stations {
            if station.buffer.is_none() {
                station.buffer = station.node.poll_transmit(now);
            }
        }
        let waiting = self.stations.iter().enumerate();
        let waiting = waiting.filter_map(|(sender, station)| station.buffer.map(|frame| (sender, frame)));
        let winner = waiting.min_by_key(|(_, frame)| frame.arbitration())?;
        self.stations[winner.0].buffer = None;
        Some(winner)
    }
}

impl<N: Node> Node for Segment<N> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.carry(now, None, *frame);
    }

    fn handle_timeout(&mut self, now: Instant) {
        while let Some(due) = self.delayed.iter().position(|delayed| delayed.due <= now) {
            let Delayed { sender, frame, .. } = self.delayed.remove(due);
            self.deliver(now, sender, &frame);
        }
        for node in self.nodes_mut() {
            if node.poll_timeout().is_some_and(|deadline| deadline <= now) {
                node.handle_timeout(now);
            }
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        while self.outgoing.is_empty() {
            let (sender, frame) = self.arbitrate(now)?;
            self.carry(now, Some(sender), frame);
        }
        self.outgoing.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.nodes().filter_map(Node::poll_timeout).chain(self.delayed.iter().map(|delayed| delayed.due)).min()
    }

    fn concerns(&self) -> Vec<CobId> {
        let each: Vec<Vec<CobId>> = self.nodes().map(Node::concerns).collect();
        // An empty list means all frames, so one station without filters needs all of them.
        if each.iter().any(Vec::is_empty) { Vec::new() } else { each.concat() }
    }

    fn generation(&self) -> u32 {
        self.nodes().fold(0, |sum, node| sum.wrapping_add(node.generation()))
    }

    fn set_power(&mut self, now: Instant, on: bool) {
        self.nodes_mut().for_each(|node| node.set_power(now, on));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::Duration;

    /// A node that sends some frames, and notes the identifiers of those that it hears, with the time in ms.
    #[derive(Default)]
    struct Talker {
        says: VecDeque<Frame>,
        heard: Vec<(u32, u64)>,
    }

    impl Node for Talker {
        fn handle_frame(&mut self, now: Instant, frame: &Frame) {
            self.heard.push((frame.id().raw(), now.since(Instant::ZERO).as_micros() / 1000));
        }
        fn handle_timeout(&mut self, _: Instant) {}
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            self.says.pop_front()
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }

    fn frame(id: u16) -> Frame {
        Frame::new(CobId::standard(id).unwrap(), &[]).unwrap()
    }

    fn segment(says: [&[u16]; 2], faults: &[Fault]) -> Segment<Talker> {
        let talker = |ids: &[u16]| Talker { says: ids.iter().map(|id| frame(*id)).collect(), heard: Vec::new() };
        Segment::new(says.map(talker), faults)
    }

    /// The identifiers that leave the segment.
    fn sent(segment: &mut Segment<Talker>, now: Instant) -> Vec<u32> {
        std::iter::from_fn(|| segment.poll_transmit(now)).map(|frame| frame.id().raw()).collect()
    }

    fn heard(segment: &Segment<Talker>) -> Vec<Vec<u32>> {
        segment.nodes().map(|node| node.heard.iter().map(|(id, _)| *id).collect()).collect()
    }

    #[test]
    fn nodes_hear_each_other_and_the_lowest_identifier_is_sent_first() {
        let mut plant = segment([&[0x185, 0x181], &[0x182]], &[]);
        assert_eq!(sent(&mut plant, Instant::ZERO), [0x182, 0x185, 0x181]);
        plant.handle_frame(Instant::ZERO, &frame(0x80));
        assert_eq!(heard(&plant), [vec![0x182, 0x80], vec![0x185, 0x181, 0x80]]);
    }

    #[test]
    fn faults_are_of_a_sender_of_an_identifier_or_of_each_nth_frame() {
        let fault = Fault { sender: None, id: None, every: 1, in_a_row: 1, fate: Fate::Lose };
        let first = Fault { sender: Some(0), ..fault };
        let heartbeat = Fault { id: CobId::standard(0x702), ..fault };
        let second = Fault { every: 2, ..fault };
        let most = Fault { every: 4, in_a_row: 3, ..fault };
        let twice = Fault { fate: Fate::Repeat, ..heartbeat };
        // The first fault that happens to a frame decides; all of them count it.
        for (faults, expected) in [
            (&[][..], &[0x81, 0x701, 0x702, 0x82][..]),
            (&[first], &[0x702, 0x82]),
            (&[heartbeat], &[0x81, 0x701, 0x82]),
            (&[second], &[0x81, 0x702]),
            (&[most], &[0x81]),
            (&[twice], &[0x81, 0x701, 0x702, 0x702, 0x82]),
            (&[second, twice], &[0x81, 0x702, 0x702]),
        ] {
            let mut plant = segment([&[0x81, 0x701], &[0x702, 0x82]], faults);
            assert_eq!(sent(&mut plant, Instant::ZERO), expected, "{faults:?}");
        }
        let mut plant = segment([&[], &[]], &[first, heartbeat]);
        plant.handle_frame(Instant::ZERO, &frame(0x702));
        plant.handle_frame(Instant::ZERO, &frame(0x80));
        assert_eq!(heard(&plant), [[0x80], [0x80]], "a fault of a sender leaves the world outside alone");
    }

    #[test]
    fn a_fault_is_switched_off_and_on() {
        let fault = Fault { sender: None, id: None, every: 2, in_a_row: 1, fate: Fate::Lose };
        let mut plant = segment([&[0x81, 0x82, 0x83], &[]], &[fault]);
        assert!(plant.set_fault(0, false) && !plant.set_fault(1, false));
        assert_eq!(plant.faults().collect::<Vec<_>>(), [(fault, false)]);
        assert_eq!(sent(&mut plant, Instant::ZERO), [0x81, 0x82, 0x83]);
        plant.set_fault(0, true);
        plant.nodes_mut().next().unwrap().says.extend([0x84, 0x85].map(frame));
        assert_eq!(sent(&mut plant, Instant::ZERO), [0x84], "it counts anew");
    }

    #[test]
    fn a_fault_in_words_says_what_happens_to_which_frames() {
        let fault = Fault { sender: None, id: CobId::standard(0x707), every: 20, in_a_row: 4, fate: Fate::Lose };
        assert_eq!(fault.to_string(), "4 of 20 frames with COB-ID 707h are lost");
        let fate = Fate::Delay(Duration::from_millis(20));
        assert_eq!(Fault { id: None, every: 1, in_a_row: 1, fate, ..fault }.to_string(), "all frames are 20 ms late");
        assert_eq!(Fault { fate: Fate::Repeat, ..fault }.to_string(), "4 of 20 frames with COB-ID 707h come twice");
    }

    #[test]
    fn a_delayed_frame_comes_later() {
        let fate = Fate::Delay(Duration::from_millis(20));
        let mut plant = segment(
            [&[0x81], &[0x82]],
            &[Fault { sender: None, id: CobId::standard(0x81), every: 1, in_a_row: 1, fate }],
        );
        assert_eq!(sent(&mut plant, Instant::ZERO), [0x82]);
        plant.handle_frame(Instant::ZERO, &frame(0x81));
        let due = plant.poll_timeout().unwrap();
        assert_eq!(due, Instant::from_micros(20_000));
        plant.handle_timeout(due);
        assert_eq!(sent(&mut plant, due), [0x81], "what came from outside stays inside");
        let heard: Vec<_> = plant.nodes().map(|node| node.heard.clone()).collect();
        assert_eq!(heard, [vec![(0x82, 0), (0x81, 20)], vec![(0x81, 20), (0x81, 20)]]);
        assert_eq!(plant.poll_timeout(), None);
    }
}
