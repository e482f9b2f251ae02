//! Stations of a scripted segment.

use std::cell::Cell;
use std::collections::VecDeque;
use std::io::ErrorKind;

use lexican_profibus::bus::{AddressError, Bus, Exchange, Notice, Station};
use lexican_profibus::dp::Lengths;
use lexican_profibus::master::{Master, Segment};
use lexican_profibus::virtual_line::VirtualLine;
use lexican_runtime::{Duration, Instant};
use profirust::Baudrate;
use profirust::dp::{Peripheral, PeripheralEvent, PeripheralHandle, PeripheralOptions};
use profirust::fdl::ParametersBuilder;

const LENGTHS: Lengths = Lengths { inputs: 2, outputs: 2 };

struct Line {
    master: Master<VirtualLine>,
    handles: Vec<PeripheralHandle>,
    now: Instant,
    /// What happens, to which slave.
    events: VecDeque<(Instant, usize, PeripheralEvent)>,
    failed: Option<ErrorKind>,
    polls: usize,
    /// How often its time has been asked for, which is the time in milliseconds of one in real time.
    looks: Cell<u64>,
    is_real_time: bool,
}

impl Segment for Line {
    fn now(&self) -> Instant {
        let looks = self.looks.get() + 1;
        self.looks.set(looks);
        assert!(self.is_real_time || looks < 200, "it does not end");
        if self.is_real_time { Instant::ZERO + Duration::from_millis(looks) } else { self.now }
    }

    fn is_real_time(&self) -> bool {
        self.is_real_time
    }

    fn failed(&self) -> Option<ErrorKind> {
        self.failed
    }

    fn add(&mut self, address: u8, options: PeripheralOptions<'static>, lengths: Lengths) -> PeripheralHandle {
        self.handles.push(self.master.add(address, options, lengths));
        self.handles[self.handles.len() - 1]
    }

    fn peripheral(&mut self, handle: PeripheralHandle) -> &mut Peripheral<'static> {
        self.master.peripheral(handle)
    }

    fn poll(&mut self, now: Instant) -> Option<(PeripheralHandle, PeripheralEvent)> {
        self.polls += 1;
        assert!(self.polls < if self.is_real_time { 10_000 } else { 100 }, "it does not end");
        let next = self.events.front().copied().filter(|(at, ..)| *at <= now);
        self.now = self.now.max(next.map_or(now, |(at, ..)| at));
        let (_, slave, event) = next?;
        self.events.pop_front();
        Some((self.handles[slave], event))
    }
}

struct Rig {
    bus: Bus<Line>,
    stations: [Station<Line>; 2],
}

impl Rig {
    fn new() -> Self {
        let parameters = ParametersBuilder::new(0, Baudrate::B500000).build();
        let master = Master::new(parameters, VirtualLine::new(Baudrate::B500000));
        let (handles, events) = (Vec::new(), VecDeque::new());
        let bus = Bus::new(Line {
            master,
            handles,
            now: Instant::ZERO,
            events,
            failed: None,
            polls: 0,
            looks: Cell::new(0),
            is_real_time: false,
        });
        let stations = [7, 8].map(|address| bus.station(address, PeripheralOptions::default(), LENGTHS).unwrap());
        Rig { bus, stations }
    }

    /// Something happens to a slave, a millisecond from now.
    fn happens(&self, slave: usize, event: PeripheralEvent) {
        self.bus.with(|line| {
            let last = line.events.back().map_or(line.now, |(at, ..)| *at);
            line.events.push_back((last + Duration::from_millis(1), slave, event));
        });
    }

    /// Waits for what is new for the first station, for ten milliseconds.
    fn wait(&mut self) -> Option<Notice> {
        let until = self.stations[0].now() + Duration::from_millis(10);
        self.stations[0].wait(until).unwrap()
    }

    /// The same, while data is exchanged: what was sent.
    #[track_caller]
    fn exchanges(&mut self) -> Vec<u8> {
        self.happens(0, PeripheralEvent::DataExchanged);
        match self.wait() {
            Some(Notice::Exchanged(Exchange { sent, received })) => {
                assert_eq!(received, [0; 2]);
                sent
            }
            other => panic!("{other:?}"),
        }
    }

    /// What the master sends to the slaves.
    fn outputs(&self) -> [Vec<u8>; 2] {
        self.bus.with(|line| [0, 1].map(|slave| line.master.peripheral(line.handles[slave]).pi_q().to_vec()))
    }
}

#[test]
fn what_is_set_between_two_exchanges_is_carried_by_the_next_one_and_otherwise_by_the_one_after() {
    let mut rig = Rig::new();
    rig.stations[0].set_outputs(&[1; 2]);
    assert_eq!(rig.outputs(), [[0; 2]; 2], "one may be under way");
    assert_eq!((rig.exchanges(), rig.outputs()), (vec![0; 2], [vec![1; 2], vec![0; 2]]));
    rig.stations[0].set_outputs(&[2; 2]);
    assert_eq!(rig.outputs(), [[2; 2], [0; 2]]);
    assert_eq!(rig.exchanges(), [2; 2]);
    assert_eq!(rig.wait(), None);
    rig.stations[0].set_outputs(&[3; 2]);
    assert_eq!(rig.outputs(), [[2; 2], [0; 2]]);
    assert_eq!([rig.exchanges(), rig.exchanges()], [[2; 2], [3; 2]]);
    // What has another length is none.
    rig.stations[0].set_outputs(&[4]);
    assert_eq!((rig.exchanges(), rig.stations[0].exchanges()), (vec![3; 2], 5));
    // Each has its own.
    rig.stations[1].set_outputs(&[5; 2]);
    rig.happens(1, PeripheralEvent::DataExchanged);
    assert_eq!((rig.wait(), rig.stations[1].has_notice()), (None, true));
    assert_eq!((rig.outputs(), rig.stations[1].exchanges()), ([vec![3; 2], vec![5; 2]], 1));
    // Of several, it is the last.
    rig.stations[0].set_outputs(&[6; 2]);
    rig.happens(0, PeripheralEvent::DataExchanged);
    rig.happens(0, PeripheralEvent::DataExchanged);
    rig.happens(1, PeripheralEvent::DataExchanged);
    let now = rig.stations[1].now();
    assert!(matches!(rig.stations[1].wait(now), Ok(Some(Notice::Exchanged(_)))), "it is there at once");
    rig.stations[1].wait(now + Duration::from_millis(5)).unwrap();
    assert_eq!(rig.wait(), Some(Notice::Exchanged(Exchange { sent: vec![6; 2], received: vec![0; 2] })));
    assert!(!rig.stations[0].has_notice());
}

#[test]
fn a_slave_is_lost_once_and_its_outputs_are_zero_until_others_are_set() {
    let mut rig = Rig::new();
    // It has not been there.
    rig.happens(0, PeripheralEvent::Offline);
    assert_eq!((rig.wait(), rig.stations[0].has_notice()), (None, false));
    rig.stations[0].set_outputs(&[1; 2]);
    assert_eq!([rig.exchanges(), rig.exchanges()], [[0; 2], [1; 2]]);
    rig.happens(0, PeripheralEvent::Diagnostics);
    assert_eq!((rig.wait(), rig.outputs()[0].as_slice()), (None, &[1; 2][..]));
    rig.happens(0, PeripheralEvent::DataExchanged);
    rig.happens(0, PeripheralEvent::Offline);
    rig.happens(1, PeripheralEvent::DataExchanged);
    let until = rig.stations[1].now() + Duration::from_millis(10);
    rig.stations[1].wait(until).unwrap();
    assert!(rig.stations[0].has_notice());
    // Outputs that are set before the loss is noticed are those of before.
    rig.stations[0].set_outputs(&[2; 2]);
    assert_eq!(rig.outputs(), [[0; 2]; 2]);
    assert_eq!((rig.wait(), rig.wait()), (Some(Notice::Lost), None));
    assert_eq!([rig.exchanges(), rig.exchanges()], [[0; 2]; 2]);
    rig.stations[0].set_outputs(&[2; 2]);
    assert_eq!(rig.exchanges(), [2; 2]);
    // Parameterised again is lost, too.
    rig.happens(0, PeripheralEvent::Configured);
    assert_eq!(rig.wait(), Some(Notice::Lost));
    rig.happens(0, PeripheralEvent::Offline);
    assert_eq!(rig.wait(), None);
}

#[test]
fn a_wait_ends_with_its_time_or_with_the_segment() {
    let mut rig = Rig::new();
    let begin = rig.stations[0].now();
    assert_eq!((rig.wait(), rig.stations[0].now()), (None, begin + Duration::from_millis(10)));
    assert!(!rig.stations[0].is_real_time());
    rig.bus.with(|line| line.failed = Some(ErrorKind::BrokenPipe));
    let now = rig.stations[0].now();
    assert_eq!(rig.stations[0].wait(now), Ok(None));
    assert_eq!(rig.stations[0].wait(now + Duration::from_millis(1)), Err(ErrorKind::BrokenPipe));
}

#[test]
fn a_wait_in_real_time_leaves_it_to_a_thread_to_poll() {
    let mut rig = Rig::new();
    rig.bus.with(|line| line.is_real_time = true);
    assert!(rig.stations[0].is_real_time());
    assert_eq!((rig.wait(), rig.bus.with(|line| line.polls)), (None, 0));
    let at = Instant::ZERO + Duration::from_millis(100);
    rig.bus.with(|line| line.events.push_back((at, 0, PeripheralEvent::DataExchanged)));
    rig.bus.keep(Duration::from_millis(1)).unwrap();
    let until = at + Duration::from_millis(400);
    assert!(matches!(rig.stations[0].wait(until), Ok(Some(Notice::Exchanged(_)))));
}

/// It would write to all slaves.
#[test]
fn an_address_that_no_slave_has_is_refused() {
    let rig = Rig::new();
    let station = |address| rig.bus.station(address, PeripheralOptions::default(), LENGTHS);
    assert!(station(126).is_ok());
    for address in [127, 128, 255] {
        assert_eq!(station(address).err(), Some(AddressError(address)));
    }
}
