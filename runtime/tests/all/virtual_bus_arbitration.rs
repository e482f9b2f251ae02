//! The virtual bus compared with a model of arbitration, bit by bit.
#![cfg(feature = "std")]

use std::collections::VecDeque;

use crate::shell_support::observed;
use lexican_runtime::host::{Node, VirtualBus, wire_bits};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use proptest::prelude::*;

/// Sends frames, each not before its time.
struct Talker {
    frames: VecDeque<(Instant, Frame)>,
    /// The time of the next frame that was not ready when the node was last called.
    next: Option<Instant>,
}

impl Talker {
    fn new(frames: &[(u64, Frame)]) -> Self {
        let frames: VecDeque<_> = frames.iter().map(|(us, frame)| (Instant::from_micros(*us), *frame)).collect();
        Talker { next: frames.front().map(|(ready, _)| *ready), frames }
    }
}

impl Node for Talker {
    fn handle_frame(&mut self, _: Instant, _: &Frame) {}
    fn handle_timeout(&mut self, now: Instant) {
        self.next = self.frames.iter().map(|(ready, _)| *ready).find(|ready| *ready > now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.frames.front().filter(|(ready, _)| *ready <= now)?;
        self.frames.pop_front().map(|(_, frame)| frame)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

/// The bits of a number, the highest of `count` first; `true` is recessive.
fn bits(number: u32, count: u32) -> impl Iterator<Item = bool> {
    (0..count).rev().map(move |place| number >> place & 1 == 1)
}

/// The bits that decide arbitration: from the start of the frame to the last bit that tells whether data follow.
fn arbitration_field(frame: &Frame) -> Vec<bool> {
    let id = frame.id().raw();
    let mut field = vec![false];
    if frame.id().is_extended() {
        field.extend(bits(id >> 18, 11).chain([true, true]).chain(bits(id, 18)).chain([frame.is_remote()]));
    } else {
        field.extend(bits(id, 11).chain([frame.is_remote(), false]));
    }
    field
}

/// The length of a frame, found by writing it out: the bits, then with stuff bits, then the end without any.
fn length(frame: &Frame) -> u64 {
    let mut bits_of = arbitration_field(frame);
    let reserved = if frame.id().is_extended() { 2 } else { 1 };
    bits_of.extend(std::iter::repeat_n(false, reserved));
    bits_of.extend(bits(frame.dlc().into(), 4));
    bits_of.extend(frame.data().iter().flat_map(|byte| bits((*byte).into(), 8)));
    bits_of.extend(bits(checksum(&bits_of), 15));
    let mut stuffed: Vec<bool> = Vec::new();
    for bit in bits_of {
        stuffed.push(bit);
        if stuffed.len() >= 5 && stuffed[stuffed.len() - 5..].iter().all(|other| *other == bit) {
            stuffed.push(!bit);
        }
    }
    // Two delimiters, the acknowledge slot, the end of frame, the intermission.
    stuffed.len() as u64 + 2 + 1 + 7 + 3
}

/// The remainder of the division by x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1.
fn checksum(message: &[bool]) -> u32 {
    let mut rest: Vec<bool> = message.iter().copied().chain([false; 15]).collect();
    for at in 0..message.len() {
        if rest[at] {
            for power in [15, 14, 10, 8, 7, 4, 3, 0] {
                rest[at + 15 - power] ^= true;
            }
        }
    }
    rest[message.len()..].iter().fold(0, |sum, bit| sum << 1 | u32::from(*bit))
}

/// The frames on the wire, each with the microsecond in which it ends; and how long the bus is idle before the last
/// one, in 1/`kbit_per_s` us, the unit of all times here.
fn model(kbit_per_s: u64, stations: &[Vec<(u64, Frame)>]) -> (Vec<(u64, Frame)>, u64) {
    let mut waiting: Vec<VecDeque<(u64, Frame)>> =
        stations.iter().map(|frames| frames.iter().copied().collect()).collect();
    let (mut log, mut free, mut idle) = (Vec::new(), 0, 0);
    while let Some(ready) = waiting.iter().filter_map(|frames| Some(frames.front()?.0 * kbit_per_s)).min() {
        let start = free.max(ready);
        idle += start - free;
        let contends = |frames: &VecDeque<(u64, Frame)>| {
            frames.front().filter(|(ready, _)| ready * kbit_per_s <= start).map(|(_, frame)| arbitration_field(frame))
        };
        let contenders = waiting.iter().enumerate().filter_map(|(place, frames)| Some((contends(frames)?, place)));
        let (_, winner) = contenders.min().expect("one is ready");
        let (_, frame) = waiting[winner].pop_front().expect("it has a frame");
        free = start + length(&frame) * 1000;
        log.push((free / kbit_per_s, frame));
    }
    (log, idle)
}

/// Frames that often have the same base identifier, or differ only in the last bit.
fn frames() -> impl Strategy<Value = Frame> {
    let base = prop::sample::select(vec![0_u16, 0x080, 0x100, 0x101, 0x585, 0x605, 0x705, 0x7FF]);
    let low = prop::sample::select(vec![0, 1, 0x3_FFFF]);
    (base, prop::option::of(low), any::<bool>(), prop::collection::vec(any::<u8>(), 0..=8)).prop_map(
        |(base, low, is_remote, data)| {
            let id = match low {
                Some(low) => CobId::extended(u32::from(base) << 18 | low),
                None => CobId::standard(base),
            };
            let id = id.expect("it has 11 or 29 bits");
            let frame = if is_remote { Frame::remote(id, data.len() as u8) } else { Frame::new(id, &data) };
            frame.expect("eight bytes at most")
        },
    )
}

/// Frames with the times at which they are ready: often at once, or while another frame is on the wire.
fn script() -> impl Strategy<Value = Vec<(u64, Frame)>> {
    let pause = prop_oneof![Just(0_u64), 0..300_u64, Just(2_000), 0..20_000_u64];
    prop::collection::vec((pause, frames()), 0..8).prop_map(|script| {
        let mut now = 0;
        let ready = |(pause, frame)| {
            now += pause;
            (now, frame)
        };
        script.into_iter().map(ready).collect()
    })
}

proptest! {
    #[test]
    fn a_frame_is_as_long_as_its_bits(frame in frames()) {
        prop_assert_eq!(u64::from(wire_bits(&frame)), length(&frame));
    }

    #[test]
    fn frames_are_on_the_wire_in_the_order_of_arbitration_and_as_long_as_their_bits(
        kbit_per_s in prop::sample::select(vec![10_u32, 33, 50, 83, 125, 250, 500, 800, 1000]),
        stations in prop::collection::vec(script(), 1..6),
    ) {
        let bus = VirtualBus::with_bit_rate(kbit_per_s);
        for frames in &stations {
            bus.attach(Talker::new(frames));
        }
        let frames = observed(&bus);
        bus.advance(Duration::from_secs(10));
        let (expected, idle) = model(kbit_per_s.into(), &stations);
        let frames = frames.lock().unwrap();
        let seen: Vec<_> = frames.iter().map(|(now, frame)| (now.as_micros(), *frame)).collect();
        prop_assert_eq!(&seen, &expected);
        if let Some((end, _)) = seen.last() {
            let bits: u64 = seen.iter().map(|(_, frame)| u64::from(wire_bits(frame))).sum();
            prop_assert_eq!(*end, (bits * 1000 + idle) / u64::from(kbit_per_s));
        }
    }
}
