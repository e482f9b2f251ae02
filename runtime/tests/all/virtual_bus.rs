//! Nodes of the virtual bus that are unplugged, without power or slow, or whose frames do not arrive.
#![cfg(feature = "std")]

#[allow(dead_code, reason = "several tests share it")]
use std::sync::{Arc, Mutex};

use crate::shell_support::station;
use lexican_runtime::host::{Attachment, Fate, Incoming, Link, Node, VirtualBus, VirtualLink, wire_bits};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);

/// Longer than a frame takes to arrive, be handled and be answered, at the lowest bit rate here.
const LONG: Duration = Duration::from_millis(10);

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(CobId::standard(id).unwrap(), data).unwrap()
}

/// Reads the device type, 1000h.
fn question() -> Frame {
    frame(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])
}

/// Sets a heartbeat of 50 ms.
fn set_heartbeat() -> Frame {
    frame(0x605, &[0x2B, 0x17, 0x10, 0, 50, 0, 0, 0])
}

/// Records the first byte of each received frame, and the time.
#[derive(Default)]
struct Ear(Vec<(u8, Instant)>);

impl Node for Ear {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.0.push((frame.data()[0], now));
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

fn ear(bus: &VirtualBus) -> (Arc<Mutex<Ear>>, Attachment) {
    let ear = Arc::new(Mutex::new(Ear::default()));
    let attachment = bus.attach(Arc::clone(&ear));
    (ear, attachment)
}

fn bytes(ear: &Mutex<Ear>) -> Vec<u8> {
    ear.lock().unwrap().0.iter().map(|(byte, _)| *byte).collect()
}

/// A device with a heartbeat every 50 ms, just after a heartbeat; and a link.
fn device(bus: &VirtualBus) -> (Attachment, VirtualLink) {
    let (device, mut link) = (bus.attach(station(NODE)), bus.link());
    assert_eq!(heard(&mut link), [(0x705, 0)]);
    link.send(&set_heartbeat()).unwrap();
    heard(&mut link);
    assert_eq!(link.receive_frame(bus.now() + LONG.times(10)).unwrap().unwrap().id().raw(), 0x705);
    (device, link)
}

/// The identifiers and first bytes of the received frames.
fn heard(link: &mut VirtualLink) -> Vec<(u32, u8)> {
    let until = link.now() + LONG;
    let frames = std::iter::from_fn(|| link.receive_frame(until).unwrap());
    frames.map(|frame| (frame.id().raw(), frame.data()[0])).collect()
}

#[test]
fn a_device_that_is_unplugged_neither_hears_nor_sends() {
    for bus in [VirtualBus::new(), VirtualBus::with_bit_rate(125)] {
        let (device, mut link) = device(&bus);
        device.detach();
        link.send(&question()).unwrap();
        bus.advance(Duration::from_millis(980));
        assert_eq!(heard(&mut link), []);
        device.attach();
        // One heartbeat has waited in the controller, and one more in the device.
        assert_eq!(heard(&mut link), [(0x705, 0x7F), (0x705, 0x7F)]);
        link.send(&question()).unwrap();
        assert_eq!(heard(&mut link), [(0x585, 0x43)]);
    }
}

#[test]
fn a_frame_that_is_cut_off_is_sent_when_the_plug_is_back() {
    let bus = VirtualBus::with_bit_rate(125);
    let (mut one, mut other) = (bus.link(), bus.link());
    one.send(&frame(0x80, &[1])).unwrap();
    one.send(&frame(0x80, &[2])).unwrap();
    bus.advance(Duration::from_micros(200));
    one.attachment().detach();
    assert_eq!(heard(&mut other), []);
    one.attachment().attach();
    assert_eq!(heard(&mut other), [(0x80, 1), (0x80, 2)]);
}

#[test]
fn a_device_without_power_forgets_and_boots_again() {
    for bus in [VirtualBus::new(), VirtualBus::with_bit_rate(125)] {
        let (device, mut link) = device(&bus);
        // The request is still in the mailbox then.
        device.set_response_time(Duration::from_millis(5));
        link.send(&question()).unwrap();
        bus.advance(Duration::from_millis(3));
        device.power_off();
        bus.advance(Duration::from_secs(1));
        assert_eq!(heard(&mut link), []);
        device.power_on();
        assert_eq!(heard(&mut link), [(0x705, 0)]);
        device.power_on();
        bus.advance(Duration::from_secs(1));
        assert_eq!(heard(&mut link), [], "it has no heartbeat time any more, and was on already");
    }
}

#[test]
fn a_frame_of_a_device_that_loses_its_power_is_lost() {
    for is_lost in [false, true] {
        let bus = VirtualBus::with_bit_rate(125);
        let (device, mut link) = device(&bus);
        // In the middle of a heartbeat.
        bus.advance(Duration::from_millis(50) - Duration::from_micros(100));
        if is_lost {
            device.power_off();
        }
        assert_eq!(heard(&mut link).is_empty(), is_lost);
    }
}

#[test]
fn a_device_takes_its_time_for_each_frame_and_one_after_the_other() {
    let bus = VirtualBus::with_bit_rate(500);
    let (ear, slow) = ear(&bus);
    let (quick, at_once) = self::ear(&bus);
    slow.set_response_time(Duration::from_millis(1));
    at_once.set_response_time(Duration::ZERO);
    let mut link = bus.link();
    let frames = [1, 2, 3].map(|byte| frame(0x181, &[byte]));
    let mut over = Instant::ZERO;
    for frame in &frames {
        link.send(frame).unwrap();
    }
    bus.advance(Duration::from_millis(5));
    let mut handled = Instant::ZERO;
    for (place, frame) in frames.iter().enumerate() {
        over += Duration::from_micros(u64::from(wire_bits(frame)) * 2);
        handled = over.max(handled) + Duration::from_millis(1);
        assert_eq!(quick.lock().unwrap().0[place].1, over);
        assert_eq!(ear.lock().unwrap().0[place].1, handled);
    }
}

#[test]
fn a_device_answers_after_its_response_time() {
    for (bus, usual) in [(VirtualBus::new(), 0), (VirtualBus::with_bit_rate(1000), 100)] {
        let (device, mut link) = device(&bus);
        let delay = |link: &mut VirtualLink| {
            link.send(&question()).unwrap();
            let sent = link.now();
            let answer = link.receive_frame(sent + LONG).unwrap().unwrap();
            let on_wire = if usual == 0 { 0 } else { u64::from(wire_bits(&question()) + wire_bits(&answer)) };
            link.now().since(sent).as_micros() - on_wire
        };
        assert_eq!(delay(&mut link), usual);
        device.set_response_time(Duration::from_millis(7));
        assert_eq!(delay(&mut link), 7_000);
        // Frames for other nodes do not concern it.
        for _ in 0..20 {
            link.send(&frame(0x609, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])).unwrap();
        }
        heard(&mut link);
        assert_eq!(delay(&mut link), 7_000);
    }
}

#[test]
fn a_full_mailbox_loses_the_newest_frames_and_counts_them() {
    let bus = VirtualBus::with_bit_rate(1000);
    let (ear, slow) = ear(&bus);
    slow.set_response_time(Duration::from_millis(1));
    slow.set_mailbox(3);
    let mut link = bus.link();
    for byte in 0..10 {
        link.send(&frame(0x181, &[byte])).unwrap();
    }
    bus.advance(LONG);
    assert_eq!((bytes(&ear), slow.overruns()), (vec![0, 1, 2], 7));
    link.send(&frame(0x181, &[10])).unwrap();
    bus.advance(LONG);
    assert_eq!((bytes(&ear), slow.overruns()), (vec![0, 1, 2, 10], 7));
}

#[test]
fn a_link_that_is_read_too_late_reports_the_gap() {
    let bus = VirtualBus::new();
    let (mut one, mut late) = (bus.link(), bus.link());
    late.attachment().set_mailbox(2);
    for byte in 0..5 {
        one.send(&frame(0x181, &[byte])).unwrap();
    }
    bus.advance(LONG);
    one.send(&frame(0x181, &[5])).unwrap();
    let now = bus.now();
    let incoming: Vec<_> = std::iter::from_fn(|| late.receive(now).unwrap()).collect();
    let [first, second, last] = [0, 1, 5].map(|byte| Incoming::Frame(frame(0x181, &[byte])));
    assert_eq!(incoming, [first, second, Incoming::Gap(3), last]);
    assert_eq!(late.attachment().overruns(), 3);
}

#[test]
fn faults_are_of_one_sender_or_of_all() {
    let bus = VirtualBus::new();
    let (mut good, mut bad, mut listener) = (bus.link(), bus.link(), bus.link());
    bad.attachment().set_fate(|number, _| match number {
        0 => Fate::Lose,
        1 => Fate::Repeat,
        _ => Fate::Deliver,
    });
    // Counts only frames that the sender's fate has delivered.
    bus.set_fate(|number, _| if number == 2 { Fate::Lose } else { Fate::Deliver });
    for byte in 0..4 {
        good.send(&frame(0x100, &[byte])).unwrap();
        bad.send(&frame(0x200, &[byte])).unwrap();
        bus.advance(LONG);
    }
    let expected = [(0x100, 0), (0x100, 1), (0x200, 1), (0x200, 1), (0x200, 2), (0x100, 3), (0x200, 3)];
    assert_eq!(heard(&mut listener), expected);
}
