//! The device shell, over the virtual bus.
#![cfg(feature = "std")]

use std::cell::Cell;

use crate::common;
use crate::rig::Station;
use lexican_runtime::device::Event;
use lexican_runtime::host::{BusState, Incoming, Link, LinkError, Node, Notice, Participant, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// A device behind a link, and the link of a manager.
struct Bench {
    participant: Participant<VirtualLink, Station>,
    other: VirtualLink,
    bus: VirtualBus,
}

impl Bench {
    fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let (link, other) = (bus.link(), bus.link());
        Bench { participant: Participant::new(link, Station::full()), other, bus }
    }

    /// Sends frames, a millisecond apart, and returns the answers.
    fn exchange(&mut self, frames: &[&str]) -> Vec<String> {
        let mut answers = Vec::new();
        for frame in frames {
            self.other.send(&common::frame(frame)).unwrap();
            let soon = self.participant.now() + Duration::from_millis(1);
            assert!(self.participant.run(soon).unwrap().is_none());
            let now = self.other.now();
            while let Some(answer) = self.other.receive_frame(now).unwrap() {
                answers.push(answer.to_string());
            }
        }
        answers
    }
}

#[test]
fn a_device_receives_its_pdo_under_an_identifier_that_sdo_has_just_set() {
    let mut bench = Bench::new();
    assert_eq!(bench.exchange(&["000#0105"])[0], "705#00");
    // Off, another identifier, on: 1400h:01.
    let answers = bench.exchange(&["605#2300140105020080", "605#2300140134030080", "605#2300140134030000"]);
    assert_eq!(answers, ["585#6000140100000000"; 3]);
    bench.participant.node().events.clear();
    bench.exchange(&["205#3412", "334#7856"]);
    let received = Event::RpdoReceived { number: 1 };
    assert_eq!(bench.participant.node().events, [received]);
    bench.exchange(&["605#4040600000000000"]);
    assert_eq!(bench.exchange(&["605#4040600000000000"]), ["585#4B40600078560000"]);
}

#[test]
fn frames_of_others_do_not_reach_the_device() {
    let mut bench = Bench::new();
    bench.exchange(&["606#4000100000000000", "185#00", "123#0102", "7E5#04", "605#4000100000000000"]);
    // With the TPDO's identifier, which may be asked for.
    assert_eq!(bench.participant.node().heard, 2);
}

#[test]
fn the_state_of_the_bus_is_reported_and_a_series_of_refused_frames_once() {
    let mut bench = Bench::new();
    // A heartbeat every 2 ms.
    bench.exchange(&["605#2B17100002000000"]);
    bench.bus.set_state(BusState::Off);
    let notices: Vec<Option<Notice>> = (0..4)
        .map(|_| {
            let soon = bench.participant.now() + Duration::from_millis(10);
            bench.participant.run(soon).unwrap()
        })
        .collect();
    assert!(
        matches!(
            notices[..],
            [Some(Notice::State(BusState::Off)), Some(Notice::Refused(LinkError::NoBus(BusState::Off))), None, None]
        ),
        "{notices:?}"
    );
    bench.bus.set_state(BusState::Active);
    let soon = bench.participant.now() + Duration::from_millis(10);
    assert!(matches!(bench.participant.run(soon), Ok(Some(Notice::State(BusState::Active)))));
    assert!(!bench.exchange(&["080#", "080#", "080#"]).is_empty(), "heartbeats go on");
}

#[test]
fn a_flood_of_frames_delays_neither_the_heartbeat_nor_the_end() {
    let mut bench = Bench::new();
    // A heartbeat every 10 ms, and an RPDO that yields to it on the bus: extended, the last one that there is.
    bench.exchange(&["605#2B1710000A000000", "605#2300140105020080", "605#23001401FFFFFF3F", "000#0105"]);
    let flood = Frame::new(CobId::extended(0x1FFF_FFFF).unwrap(), &[0x34, 0x12]).unwrap();
    for _ in 0..2_000 {
        bench.other.send(&flood).unwrap();
    }
    let end = bench.participant.now() + Duration::from_millis(102);
    assert!(bench.participant.run(end).unwrap().is_none());
    assert!(bench.participant.now() < end + Duration::from_millis(1), "{}", bench.participant.now());
    let now = bench.other.now();
    assert!(bench.participant.node().heard > 500, "{}", bench.participant.node().heard);
    let beats = core::iter::from_fn(|| bench.other.receive_frame(now).unwrap());
    assert_eq!(beats.filter(|frame| frame.id().raw() == 0x705).count(), 10);
}

/// A link on which reading the clock takes 10 us, and which always has a frame.
struct Slow {
    now: Cell<Instant>,
    frame: Frame,
}

impl Link for Slow {
    fn now(&self) -> Instant {
        self.now.set(self.now.get() + Duration::from_micros(10));
        self.now.get()
    }
    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        assert!(self.now() < Instant::from_micros(1_000_000), "the device goes on sending without end");
        Ok(())
    }
    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        Ok(Some(Incoming::Frame(self.frame)))
    }
}

#[test]
fn a_sync_period_that_the_machine_cannot_keep_does_not_stop_reception() {
    let mut station = Station::full();
    // 1006h: 1 us; then 1005h: the device produces SYNC.
    for frame in ["605#2306100001000000", "605#2305100080000040"] {
        station.device.poll_transmit(Instant::ZERO, &mut station.od);
        station.handle_frame(Instant::ZERO, &common::frame(frame));
    }
    station.heard = 0;
    let link = Slow { now: Cell::new(Instant::ZERO), frame: common::frame("605#4000100000000000") };
    let mut participant = Participant::new(link, station);
    assert!(participant.run(Instant::from_micros(10_000)).unwrap().is_none());
    assert!(participant.node().heard > 10, "{}", participant.node().heard);
}
