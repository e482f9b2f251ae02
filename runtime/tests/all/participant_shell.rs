//! The device shell, over the virtual bus.
#![cfg(feature = "std")]

use std::cell::Cell;

use crate::common;
use crate::rig::Recorder;
use lexican_runtime::device::Event;
use lexican_runtime::host::{BusState, Incoming, Link, LinkError, Node, Notice, Participant, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// A device behind a link, and the link of a manager.
struct Rig {
    participant: Participant<VirtualLink, Recorder>,
    other: VirtualLink,
    bus: VirtualBus,
}

impl Rig {
    fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let (link, other) = (bus.link(), bus.link());
        Rig { participant: Participant::new(link, Recorder::full()), other, bus }
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
    let mut rig = Rig::new();
    assert_eq!(rig.exchange(&["000#0105"])[0], "705#00");
    // 1400h:01: off, another identifier, on.
    let answers = rig.exchange(&["605#2300140105020080", "605#2300140134030080", "605#2300140134030000"]);
    assert_eq!(answers, ["585#6000140100000000"; 3]);
    rig.participant.node().events.clear();
    rig.exchange(&["205#3412", "334#7856"]);
    let received = Event::RpdoReceived { number: 1 };
    assert_eq!(rig.participant.node().events, [received]);
    rig.exchange(&["605#4040600000000000"]);
    assert_eq!(rig.exchange(&["605#4040600000000000"]), ["585#4B40600078560000"]);
}

#[test]
fn frames_of_others_do_not_reach_the_device() {
    let mut rig = Rig::new();
    rig.exchange(&["606#4000100000000000", "185#00", "123#0102", "7E5#04", "605#4000100000000000"]);
    // Received besides: the TPDO's identifier, because it may be requested by RTR.
    assert_eq!(rig.participant.node().heard, 2);
}

#[test]
fn the_state_of_the_bus_is_reported_and_a_series_of_refused_frames_once() {
    let mut rig = Rig::new();
    // A heartbeat every 2 ms.
    rig.exchange(&["605#2B17100002000000"]);
    rig.bus.set_state(BusState::Off);
    let notices: Vec<Option<Notice>> = (0..4)
        .map(|_| {
            let soon = rig.participant.now() + Duration::from_millis(10);
            rig.participant.run(soon).unwrap()
        })
        .collect();
    assert!(
        matches!(
            notices[..],
            [Some(Notice::State(BusState::Off)), Some(Notice::Refused(LinkError::NoBus(BusState::Off))), None, None]
        ),
        "{notices:?}"
    );
    rig.bus.set_state(BusState::Active);
    let soon = rig.participant.now() + Duration::from_millis(10);
    assert!(matches!(rig.participant.run(soon), Ok(Some(Notice::State(BusState::Active)))));
    assert!(!rig.exchange(&["080#", "080#", "080#"]).is_empty(), "heartbeats go on");
}

#[test]
fn a_flood_of_frames_delays_neither_the_heartbeat_nor_the_end() {
    let mut rig = Rig::new();
    // A heartbeat every 10 ms, and an RPDO that loses arbitration to it: its identifier is the highest extended one.
    rig.exchange(&["605#2B1710000A000000", "605#2300140105020080", "605#23001401FFFFFF3F", "000#0105"]);
    let flood = Frame::new(CobId::extended(0x1FFF_FFFF).unwrap(), &[0x34, 0x12]).unwrap();
    for _ in 0..2_000 {
        rig.other.send(&flood).unwrap();
    }
    let end = rig.participant.now() + Duration::from_millis(102);
    assert!(rig.participant.run(end).unwrap().is_none());
    assert!(rig.participant.now() < end + Duration::from_millis(1), "{}", rig.participant.now());
    let now = rig.other.now();
    assert!(rig.participant.node().heard > 500, "{}", rig.participant.node().heard);
    let beats = core::iter::from_fn(|| rig.other.receive_frame(now).unwrap());
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
    let mut recorder = Recorder::full();
    // 1006h: 1 us; then 1005h: the device produces SYNC.
    for frame in ["605#2306100001000000", "605#2305100080000040"] {
        recorder.device.poll_transmit(Instant::ZERO, &mut recorder.od);
        recorder.handle_frame(Instant::ZERO, &common::frame(frame));
    }
    recorder.heard = 0;
    let link = Slow { now: Cell::new(Instant::ZERO), frame: common::frame("605#4000100000000000") };
    let mut participant = Participant::new(link, recorder);
    assert!(participant.run(Instant::from_micros(10_000)).unwrap().is_none());
    assert!(participant.node().heard > 10, "{}", participant.node().heard);
}
