//! Every fault at every frame of every kind of transfer: the transfer ends with the right data or with a clean error,
//! and the next one works.

use crate::sdo_support::{Bus, Fault, Growing, NODE, Od, at, frame, pattern};
use lexican_runtime::object::{Access, Address, DataType};
use lexican_runtime::service::sdo_client::{Event, SdoClient, SdoError};
use lexican_runtime::service::sdo_server::{self, Side};
use lexican_runtime::{AbortCode, Duration, Frame, Instant};
use proptest::prelude::*;

const DOMAIN: Address = at(0x2003, 0);
const VALUE: Address = at(0x2000, 8);

/// A transfer to be disturbed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Case {
    verb: Verb,
    address: Address,
    len: usize,
    block_size: u8,
    /// Whether the server does not announce sizes.
    hides_len: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Verb {
    Read,
    Write,
    ReadBlock,
    WriteBlock,
}

const VERBS: [Verb; 4] = [Verb::Read, Verb::Write, Verb::ReadBlock, Verb::WriteBlock];

fn cases() -> Vec<Case> {
    let mut cases = vec![];
    for verb in VERBS {
        for (len, block_size) in [(0, 127), (3, 127), (8, 2), (28, 2), (29, 1), (33, 4), (64, 127)] {
            cases.push(Case { verb, address: DOMAIN, len, block_size, hides_len: false });
        }
        cases.push(Case { verb, address: DOMAIN, len: 36, block_size: 3, hides_len: true });
        cases.push(Case { verb, address: VALUE, len: 8, block_size: 127, hides_len: false });
    }
    cases
}

impl Case {
    /// The bus before the transfer.
    fn bus(&self) -> Bus {
        let data = pattern(self.len);
        let held = |address, other: &[u8]| match self.verb {
            Verb::Read | Verb::ReadBlock if self.address == address => data.clone(),
            _ => other.to_vec(),
        };
        let od = Od::default().with(DOMAIN, DataType::Domain, Access::Rw, &held(DOMAIN, b"old")).with(
            VALUE,
            DataType::Unsigned64,
            Access::Rw,
            &held(VALUE, &[0; 8]),
        );
        let mut bus = Bus::new(Od { hides_len: self.hides_len, ..od });
        bus.server = bus.server.with_block_size(self.block_size);
        bus
    }

    /// Runs the transfer, and returns the data that arrived.
    fn run(&self, bus: &mut Bus, fault: Fault<'_>) -> (Event, Vec<u8>) {
        let mut payload = self.begin(bus);
        let event = bus.run(&mut payload, fault);
        match self.verb {
            Verb::Read | Verb::ReadBlock => (event, payload.0),
            Verb::Write | Verb::WriteBlock => (event, bus.od.value(self.address).to_vec()),
        }
    }

    fn begin(&self, bus: &mut Bus) -> Growing {
        let from = if self.verb == Verb::WriteBlock { 0 } else { u32::MAX };
        bus.client = bus.client.clone().with_block_writes_from(from).with_block_size(self.block_size);
        let begun = match self.verb {
            Verb::Read => bus.client.read(bus.now, self.address),
            Verb::ReadBlock => bus.client.read_block(bus.now, self.address),
            Verb::Write | Verb::WriteBlock => bus.client.write(bus.now, self.address, self.len as u32),
        };
        begun.expect("the client is idle");
        match self.verb {
            Verb::Read | Verb::ReadBlock => Growing(vec![]),
            Verb::Write | Verb::WriteBlock => Growing(pattern(self.len)),
        }
    }

    fn done(&self) -> Event {
        Event::Done { address: self.address, len: self.len as u32 }
    }

    /// The number of frames of an undisturbed transfer.
    fn frames(&self) -> usize {
        let mut bus = self.bus();
        assert_eq!(self.run(&mut bus, &mut pass), (self.done(), pattern(self.len)), "{self:?}");
        bus.settle();
        bus.log.len()
    }
}

fn pass(_: usize, frame: Frame) -> Vec<Frame> {
    vec![frame]
}

/// Runs every kind of transfer in turn, undisturbed.
#[track_caller]
fn check_that_the_next_work(bus: &mut Bus, context: &str) {
    for verb in [Verb::Write, Verb::Read, Verb::WriteBlock, Verb::ReadBlock] {
        for (address, len) in [(VALUE, 8), (DOMAIN, 30)] {
            let next = Case { verb, address, len, block_size: 127, hides_len: false };
            assert_eq!(next.run(bus, &mut pass), (next.done(), pattern(len)), "after {context}, {next:?}");
        }
    }
}

/// Applies `fault` to frame `k` of every transfer, for every `k`.
fn check_every_frame(name: &str, is_detected: bool, mut fault: impl FnMut(usize, usize, Frame) -> Vec<Frame>) {
    for case in cases() {
        for k in 0..case.frames() {
            let mut bus = case.bus();
            let (event, data) = case.run(&mut bus, &mut |i, frame| fault(k, i, frame));
            let context = format!("{name} of frame {k} of {case:?}: {event:?}");
            if !is_detected {
                // The client may have taken a frame for an abort that was none; the server has to time out.
                bus.settle();
            } else if event == case.done() {
                assert_eq!(data, pattern(case.len), "{context}");
            }
            assert!(bus.now < Instant::ZERO + Duration::from_secs(3), "{context} took until {}", bus.now);
            check_that_the_next_work(&mut bus, &context);
        }
    }
}

#[test]
fn any_frame_may_get_lost() {
    check_every_frame("loss", true, |k, i, frame| if i == k { vec![] } else { vec![frame] });
}

#[test]
fn any_two_frames_may_get_lost() {
    for case in cases() {
        for first in 0..case.frames() {
            // The second loss is any later frame, including those that recover from the first loss.
            let mut bus = case.bus();
            case.run(&mut bus, &mut |i, frame| if i == first { vec![] } else { vec![frame] });
            for second in first + 1..bus.log.len() {
                let mut bus = case.bus();
                let lost = [first, second];
                let (event, data) =
                    case.run(&mut bus, &mut |i, frame| if lost.contains(&i) { vec![] } else { vec![frame] });
                let context = format!("loss of frames {first} and {second} of {case:?}: {event:?}");
                if event == case.done() {
                    assert_eq!(data, pattern(case.len), "{context}");
                }
                assert!(bus.now < Instant::ZERO + Duration::from_secs(3), "{context} took until {}", bus.now);
                check_that_the_next_work(&mut bus, &context);
            }
        }
    }
}

#[test]
fn any_frame_may_come_twice() {
    check_every_frame("repetition", true, |k, i, frame| if i == k { vec![frame, frame] } else { vec![frame] });
}

#[test]
fn any_frame_may_be_overtaken_by_the_next() {
    let mut held = None;
    check_every_frame("delay", true, |k, i, frame| match i {
        0 if k != 0 => {
            held = None;
            vec![frame]
        }
        _ if i == k => {
            held = Some(frame);
            vec![]
        }
        _ => [frame].into_iter().chain(held.take()).collect(),
    });
}

#[test]
fn any_bit_may_flip() {
    for bit in 0..64 {
        check_every_frame("corruption", false, |k, i, frame| vec![if i == k { flipped(frame, bit) } else { frame }]);
    }
}

#[test]
fn a_flipped_bit_in_the_data_of_a_block_is_noticed() {
    for case in cases().into_iter().filter(|case| matches!(case.verb, Verb::ReadBlock | Verb::WriteBlock)) {
        for k in 3..case.frames() {
            for bit in 0..64 {
                let mut bus = case.bus();
                let (event, data) =
                    case.run(&mut bus, &mut |i, frame| vec![if i == k { flipped(frame, bit) } else { frame }]);
                // A short value is read without a block, and so without a checksum.
                if event == case.done() && bus.log[1].data()[0] & 0xE0 != 0x40 && bus.log[1].data()[0] != 0x60 {
                    assert_eq!(data, pattern(case.len), "bit {bit} of frame {k} of {case:?}");
                }
            }
        }
    }
}

fn flipped(frame: Frame, bit: usize) -> Frame {
    let mut data = frame.data().to_vec();
    data[bit / 8] ^= 1 << (bit % 8);
    Frame::new(frame.id(), &data).expect("the length stays")
}

#[test]
fn a_frame_may_come_as_late_as_in_the_next_transfer() {
    for case in cases() {
        for k in 0..case.frames() {
            let mut bus = case.bus();
            let mut late = None;
            case.run(&mut bus, &mut |i, frame| {
                if i == k {
                    late = Some(frame);
                    return vec![];
                }
                vec![frame]
            });
            let context = format!("late frame {k} of {case:?}");
            let begin = bus.log.len();
            let next = Case { verb: Verb::Read, address: VALUE, len: 8, block_size: 127, hides_len: false };
            let held = bus.od.value(VALUE).to_vec();
            let (event, data) = next.run(&mut bus, &mut |i, frame| {
                let late = late.filter(|_| i == begin);
                [frame].into_iter().chain(late).collect()
            });
            assert!(event != next.done() || data == held, "{context}");
            check_that_the_next_work(&mut bus, &context);
        }
    }
}

#[test]
fn the_client_may_abort_at_every_point() {
    for case in cases() {
        for k in 0..case.frames() {
            let mut bus = case.bus();
            let mut payload = case.begin(&mut bus);
            while bus.log.len() <= k && bus.client.is_busy() {
                bus.step(&mut payload, &mut pass);
            }
            bus.client.abort(AbortCode::LOCAL_CONTROL);
            assert!(!bus.client.is_busy());
            check_that_the_next_work(&mut bus, &format!("abort by the client after frame {k} of {case:?}"));
        }
    }
}

#[test]
fn the_server_may_abort_at_every_point() {
    for case in cases() {
        // An abort after the end is none, and one before the first request is not received.
        for k in 1..case.frames() - 1 {
            let mut bus = case.bus();
            let [low, high] = case.address.index().to_le_bytes();
            let abort = [0x80, low, high, case.address.sub(), 0x21, 0, 0, 8];
            let abort = Frame::from_array(bus.server.response_id(), abort);
            let (event, _) = case.run(&mut bus, &mut |i, frame| if i == k { vec![abort] } else { vec![frame] });
            let error = SdoError::Aborted { address: case.address, code: AbortCode::LOCAL_CONTROL };
            assert_eq!(event, Event::Failed(error), "abort instead of frame {k} of {case:?}");
            // The server itself has not aborted, so it has to time out.
            bus.settle();
            check_that_the_next_work(&mut bus, &format!("abort by the server instead of frame {k} of {case:?}"));
        }
    }
}

#[test]
fn the_bus_may_fall_silent_at_every_point() {
    for case in cases() {
        for k in 0..case.frames() {
            let mut bus = case.bus();
            let (event, data) = case.run(&mut bus, &mut |i, frame| if i < k { vec![frame] } else { vec![] });
            let context = format!("silence from frame {k} of {case:?} on");
            match event {
                Event::Failed(error) => assert_eq!(error, SdoError::TimedOut { address: case.address }, "{context}"),
                // Only the confirmation of the end of a block read may be missing.
                Event::Done { .. } => assert_eq!((data, k), (pattern(case.len), case.frames() - 1), "{context}"),
            }
            check_that_the_next_work(&mut bus, &context);
        }
    }
}

#[test]
fn a_server_whose_client_has_vanished_gives_up_and_says_so() {
    for case in cases() {
        for k in 0..case.frames() - 1 {
            let mut bus = case.bus();
            let mut payload = case.begin(&mut bus);
            while bus.log.len() <= k && bus.client.is_busy() {
                bus.step(&mut payload, &mut pass);
            }
            let was_busy = bus.server.is_busy();
            bus.client = SdoClient::of_node(NODE);
            bus.settle();
            if was_busy {
                let (code, by) = (AbortCode::TIMED_OUT, Side::Server);
                let aborted = sdo_server::Event::Aborted { address: case.address, code, by };
                assert_eq!(bus.events, [aborted], "after frame {k} of {case:?}");
                let [low, high] = case.address.index().to_le_bytes();
                let abort = [0x80, low, high, case.address.sub(), 0, 0, 4, 5];
                assert_eq!(bus.log.last().unwrap().data(), abort, "after frame {k} of {case:?}");
            }
            check_that_the_next_work(&mut bus, &format!("vanishing of the client after frame {k} of {case:?}"));
        }
    }
}

/// The first byte of each frame whose loss makes the transfer fail.
fn unrecovered(case: Case) -> Vec<u8> {
    let mut commands = vec![];
    for k in 0..case.frames() {
        let mut bus = case.bus();
        let (event, data) = case.run(&mut bus, &mut |i, frame| if i == k { vec![] } else { vec![frame] });
        match event {
            Event::Done { .. } => assert_eq!(data, pattern(case.len), "loss of frame {k} of {case:?}"),
            Event::Failed(_) => commands.push(bus.log[k].data()[0]),
        }
    }
    commands
}

#[test]
fn a_block_transfer_recovers_from_the_loss_of_any_frame_once_begun() {
    for hides_len in [false, true] {
        for block_size in [2, 3, 4, 5, 127] {
            for len in [22, 28, 29, 35, 36, 63, 890] {
                let case = |verb| Case { verb, address: DOMAIN, len, block_size, hides_len };
                // The answer to the initiation of a write, because the server times out first; and the answer to the
                // end, when all is written. If the request for the initiation is lost, the write goes on in segments.
                assert_eq!(unrecovered(case(Verb::WriteBlock)), [0xA4, 0xA1], "{:?}", case(Verb::WriteBlock));
                let answer = if hides_len { 0xC4 } else { 0xC6 };
                assert_eq!(unrecovered(case(Verb::ReadBlock)), [0xA4, answer], "{:?}", case(Verb::ReadBlock));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn a_bad_bus_never_gives_wrong_data(
        verb in prop::sample::select(VERBS.to_vec()),
        len in 0..400_usize,
        block_size in 1..=127_u8,
        hides_len: bool,
        // Of 16 frames, one is lost, one is repeated, and one is overtaken.
        fates in prop::collection::vec(0..16_u8, 1..64),
    ) {
        let case = Case { verb, address: DOMAIN, len, block_size, hides_len };
        let mut bus = case.bus();
        let mut held = None;
        let (event, data) = case.run(&mut bus, &mut |i, frame| match fates[i % fates.len()] {
            0 => vec![],
            1 => vec![frame, frame],
            2 if held.is_none() => {
                held = Some(frame);
                vec![]
            }
            _ => [frame].into_iter().chain(held.take()).collect(),
        });
        prop_assert!(event != case.done() || data == pattern(len));
        bus.settle();
        check_that_the_next_work(&mut bus, "a bad bus");
    }
}

#[test]
fn frames_of_others_do_not_disturb() {
    for case in cases() {
        let mut bus = case.bus();
        let (event, data) = case.run(&mut bus, &mut |_, sent| {
            vec![frame("586#8003200000000000"), sent, frame("606#4003200000000000"), frame("585#80")]
        });
        assert_eq!((event, data), (case.done(), pattern(case.len)), "{case:?}");
    }
}
