//! Plausible frames in any order: no side panics or goes on for ever, and a transfer works afterwards.

use crate::sdo_support::{Bus, Growing, NODE, Od, at, pattern};
use lexican_runtime::object::{Access, Address, DataType};
use lexican_runtime::service::sdo_client::{self, SdoClient};
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::{CobId, Duration, Frame};
use proptest::prelude::*;

const ADDRESSES: [Address; 6] =
    [at(0x1000, 0), at(0x2000, 1), at(0x2000, 8), at(0x2001, 0), at(0x2002, 0), at(0x2002, 9)];

fn dictionary() -> Od {
    Od::default()
        .with(at(0x1000, 0), DataType::Unsigned32, Access::Ro, &[1, 2, 3, 4])
        .with(at(0x2000, 1), DataType::Unsigned8, Access::Rw, &[1])
        .with(at(0x2000, 8), DataType::Unsigned64, Access::Rw, &[1; 8])
        .with(at(0x2001, 0), DataType::VisibleString, Access::Rw, b"")
        .with(at(0x2002, 0), DataType::Domain, Access::Rw, &pattern(50))
}

/// What happens to a side: a frame, a wait, or the transmission of its frames.
#[derive(Clone, Debug)]
enum Step {
    Frame(Vec<u8>),
    Wait(u64),
    Pull(usize),
    Begin { verb: u8, address: Address, len: u32 },
    Abort,
}

/// Data in which commands of both directions, small numbers and existing addresses are frequent.
fn data() -> impl Strategy<Value = Vec<u8>> {
    let command = prop_oneof![
        4 => prop::sample::select(vec![
            0x00, 0x01, 0x0D, 0x0F, 0x10, 0x1F, 0x20, 0x21, 0x22, 0x23, 0x2F, 0x30, 0x40, 0x41, 0x42, 0x43, 0x60, 0x70,
            0x80, 0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xC0, 0xC1, 0xC2, 0xC4, 0xC6, 0xD9, 0xDD, 0xE0, 0xFF,
        ]),
        2 => 1..=6_u8,
        1 => 0x81..=0x86_u8,
        1 => any::<u8>(),
    ];
    let body = prop_oneof![
        3 => (prop::sample::select(ADDRESSES.to_vec()), 0..9_u8, 0..2_u8).prop_map(|(address, small, high)| {
            let [a, b] = address.index().to_le_bytes();
            vec![a, b, address.sub(), small, high * small, 0, 0]
        }),
        2 => (0..=5_u8, prop::sample::select(vec![0, 1, 2, 3, 127, 128, 255]))
            .prop_map(|(sequence, block_size)| vec![sequence, block_size, 0, 0, 0, 0, 0]),
        1 => prop::collection::vec(any::<u8>(), 7),
    ];
    let len = prop_oneof![9 => Just(8_usize), 1 => 0..=8_usize];
    (command, body, len).prop_map(|(command, body, len)| {
        let mut data = vec![command];
        data.extend(body);
        data.truncate(len);
        data
    })
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        12 => data().prop_map(Step::Frame),
        1 => (0..2_000_000_u64).prop_map(Step::Wait),
        4 => (0..200_usize).prop_map(Step::Pull),
        3 => (0..4_u8, prop::sample::select(ADDRESSES.to_vec()), 0..40_u32)
            .prop_map(|(verb, address, len)| Step::Begin { verb, address, len }),
        1 => Just(Step::Abort),
    ]
}

fn frame(id: CobId, data: &[u8]) -> Frame {
    Frame::new(id, data).expect("at most eight bytes")
}

proptest! {
    // 1,500 times some 35 frames to each side are 100,000 frames.
    #![proptest_config(ProptestConfig::with_cases(1_500))]

    #[test]
    fn a_server_withstands_any_frames(
        steps in prop::collection::vec(step(), 1..120),
        block_size in prop::sample::select(vec![1, 2, 5, 127_u8]),
        padded: bool,
        expedited: [bool; 4],
        longer: bool,
    ) {
        let mut bus = Bus::new(dictionary());
        bus.server = bus.server.with_block_size(block_size).with_padded_writes(padded);
        bus.server = bus.server.with_sizes_indicated(SizesIndicated { expedited, longer });
        for step in steps {
            match step {
                Step::Frame(data) => {
                    let before = bus.server.is_busy();
                    let frame = frame(bus.server.request_id(), &data);
                    let event = bus.server.handle_frame(bus.now, &frame, &mut bus.od);
                    prop_assert!(before || bus.server.is_busy() || data.len() != 8 || data[0] & 0xE0 == 0x80 || event.is_some());
                }
                Step::Wait(us) => {
                    bus.now += Duration::from_micros(us);
                    bus.server.handle_timeout(bus.now);
                }
                Step::Pull(n) => (0..n).for_each(|_| {
                    let _ = bus.server.poll_transmit(bus.now, &mut bus.od);
                }),
                Step::Begin { .. } | Step::Abort => {}
            }
        }
        // Without further requests, it sends at most one block and its aborts, and is soon idle.
        let mut sent = 0;
        while bus.server.is_busy() {
            while bus.server.poll_transmit(bus.now, &mut bus.od).is_some() {
                sent += 1;
                prop_assert!(sent < 140);
            }
            if let Some(deadline) = bus.server.poll_timeout() {
                bus.now = bus.now.max(deadline);
                bus.server.handle_timeout(bus.now);
            }
        }
        prop_assert_eq!(bus.server.poll_timeout(), None);
        while bus.server.poll_transmit(bus.now, &mut bus.od).is_some() {}
        let data = pattern(33);
        let done = sdo_client::Event::Done { address: at(0x2002, 0), len: 33 };
        prop_assert_eq!(bus.write(at(0x2002, 0), &data), done);
        prop_assert_eq!(bus.read_block(at(0x2002, 0)), (done, data));
    }

    #[test]
    fn a_client_withstands_any_frames(
        steps in prop::collection::vec(step(), 1..120),
        block_size in prop::sample::select(vec![1, 2, 5, 127_u8]),
        blocks_from in prop::sample::select(vec![0, 20, u32::MAX]),
        room in 0..60_usize,
        padded: bool,
    ) {
        let mut bus = Bus::new(dictionary());
        bus.client = SdoClient::of_node(NODE)
            .with_block_size(block_size)
            .with_block_writes_from(blocks_from)
            .with_always_four_bytes(padded);
        let mut buffer = pattern(room);
        let mut payload = &mut buffer[..];
        for step in steps {
            match step {
                Step::Frame(data) => {
                    let frame = frame(bus.client.response_id(), &data);
                    let was_busy = bus.client.is_busy();
                    let event = bus.client.handle_frame(bus.now, &frame, &mut payload);
                    prop_assert_eq!(event.is_some(), was_busy && !bus.client.is_busy());
                }
                Step::Wait(us) => {
                    bus.now += Duration::from_micros(us);
                    bus.client.handle_timeout(bus.now);
                }
                Step::Pull(n) => (0..n).for_each(|_| {
                    let _ = bus.client.poll_transmit(bus.now, &mut payload);
                }),
                Step::Begin { verb, address, len } => {
                    let was_busy = bus.client.is_busy();
                    let begun = match verb {
                        0 => bus.client.read(bus.now, address),
                        1 => bus.client.read_block(bus.now, address),
                        _ => bus.client.write(bus.now, address, len),
                    };
                    prop_assert_eq!(begun.is_err(), was_busy);
                    // Send the request, because most frames are answers only if something was asked.
                    let _ = bus.client.poll_transmit(bus.now, &mut payload);
                }
                Step::Abort => bus.client.abort(lexican_runtime::AbortCode::GENERAL),
            }
        }
        let mut sent = 0;
        while bus.client.is_busy() {
            while bus.client.poll_transmit(bus.now, &mut payload).is_some() {
                sent += 1;
                prop_assert!(sent < 140);
            }
            if let Some(deadline) = bus.client.poll_timeout() {
                bus.now = bus.now.max(deadline);
                bus.client.handle_timeout(bus.now);
            }
        }
        prop_assert_eq!(bus.client.poll_timeout(), None);
        let mut read = Growing(vec![]);
        bus.client.read_block(bus.now, at(0x2002, 0)).expect("the client is idle");
        let event = bus.run(&mut read, &mut |_, frame| vec![frame]);
        prop_assert_eq!(event, sdo_client::Event::Done { address: at(0x2002, 0), len: 50 });
        prop_assert_eq!(read.0, pattern(50));
    }
}
