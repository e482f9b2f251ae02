//! Random frames: nothing panics, and the next access works.

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use proptest::prelude::*;
use siko_serial::Settings;
use siko_serial::gateway::{self, SerialNode};
use siko_serial::sim::{SerialDrive, VirtualLine};

use super::rig::NODE;

type Gateway = SerialNode<VirtualLine>;

/// Frames with identifiers and commands that a node receives, more often than with others.
fn frame() -> impl Strategy<Value = Frame> {
    let id = prop_oneof![
        Just(0x000),
        Just(0x080),
        Just(0x600 + u16::from(NODE.get())),
        Just(0x200 + u16::from(NODE.get())),
        Just(0x400 + u16::from(NODE.get())),
        Just(0x500 + u16::from(NODE.get())),
        0..0x800_u16,
    ];
    let index =
        prop_oneof![Just(0x6040_u16), Just(0x6041), Just(0x6060), Just(0x607A), 0x1000..0x1020_u16, any::<u16>()];
    let sdo = (prop_oneof![Just(0x23_u8), Just(0x40), any::<u8>()], index, 0..4_u8, any::<[u8; 4]>()).prop_map(
        |(command, index, sub, [a, b, c, d])| {
            let [low, high] = index.to_le_bytes();
            vec![command, low, high, sub, a, b, c, d]
        },
    );
    let data = prop_oneof![sdo, prop::collection::vec(any::<u8>(), 0..=8)];
    (id, data).prop_map(|(id, data)| Frame::new(CobId::standard(id).unwrap(), &data).unwrap())
}

/// Lets time pass. Returns the answer of the SDO server, if any.
fn pass(node: &mut Gateway, now: &mut Instant, span: Duration) -> Option<Frame> {
    let (until, mut answer) = (*now + span, None);
    loop {
        while let Some(frame) = node.poll_transmit(*now) {
            if frame.id() == CobId::of_node(0x580, NODE) {
                answer = Some(frame);
            }
        }
        match node.poll_timeout().filter(|at| *at <= until) {
            Some(at) => *now = at.max(*now),
            None => {
                *now = until;
                return answer;
            }
        }
        node.handle_timeout(*now);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]
    /// 10^5 frames.
    #[test]
    fn the_next_access_works(frames in prop::collection::vec((frame(), 0..30_u64), 200)) {
        let mut node = gateway::node(VirtualLine::new(SerialDrive::default()), Settings::default(), NODE);
        let mut now = Instant::ZERO;
        pass(&mut node, &mut now, Duration::from_millis(500));
        for (frame, ms) in frames {
            node.handle_frame(now, &frame);
            pass(&mut node, &mut now, Duration::from_millis(ms));
        }
        pass(&mut node, &mut now, Duration::from_secs(2));
        node.handle_frame(now, &Frame::from_array(CobId::NMT, [0x80, NODE.get()]));
        let abort = [0x80, 0, 0, 0, 0, 0, 0, 0];
        node.handle_frame(now, &Frame::from_array(CobId::of_node(0x600, NODE), abort));
        pass(&mut node, &mut now, Duration::from_secs(2));
        node.handle_frame(now, &Frame::from_array(CobId::of_node(0x600, NODE), [0x40, 0x64, 0x60, 0, 0, 0, 0, 0]));
        let answer = pass(&mut node, &mut now, Duration::from_secs(1));
        let answer = answer.map(|frame| frame.data().to_vec()).unwrap_or_default();
        prop_assert_eq!(answer.get(..4), Some(&[0x42, 0x64, 0x60, 0][..]));
    }
}
