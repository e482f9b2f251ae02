//! With any frames on the bus, a device neither panics nor hangs nor stops answering.

use crate::common::Rig;
use lexican_runtime::{CobId, Duration, Frame};
use proptest::prelude::*;

/// Mostly identifiers that the device receives, and bytes with a meaning.
fn any_frame() -> impl Strategy<Value = Frame> {
    let known = prop::sample::select(vec![
        0x000_u16, 0x080, 0x100, 0x185, 0x205, 0x385, 0x405, 0x605, 0x605, 0x605, 0x605, 0x705, 0x710,
    ]);
    let id = prop_oneof![
        8 => known.prop_filter_map("11 bits", CobId::standard),
        1 => (0..0x800_u16).prop_filter_map("11 bits", CobId::standard),
        1 => (0..0x2000_0000_u32).prop_filter_map("29 bits", CobId::extended),
    ];
    let communication =
        (any::<u8>(), 0x1000..0x1C00_u16, 0..4_u8, any::<[u8; 4]>()).prop_map(|(command, index, sub, data)| {
            let [low, high] = index.to_le_bytes();
            [&[command, low, high, sub], &data[..]].concat()
        });
    let nmt = (prop::sample::select(vec![1_u8, 2, 0x80, 0x81, 0x82]), prop::sample::select(vec![0_u8, 5, 6]))
        .prop_map(|(command, node)| vec![command, node]);
    let data = prop_oneof![communication, nmt, prop::collection::vec(any::<u8>(), 0..=8)];
    prop_oneof![
        9 => (id.clone(), data).prop_filter_map("8 bytes", |(id, data)| Frame::new(id, &data)),
        1 => (id, 0..=8_u8).prop_filter_map("8 bytes", |(id, len)| Frame::remote(id, len)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn any_frames_at_any_time_leave_a_device_that_boots_and_answers(
        script in prop::collection::vec((any_frame(), 0..50_000_u64), 0..60)
    ) {
        let mut rig = Rig::full();
        for (frame, pause_us) in script {
            rig.device.handle_frame(rig.now, &frame, &mut rig.od);
            rig.sent();
            let sent = rig.pass(Duration::from_micros(pause_us));
            prop_assert!(sent.len() < 1 + 2 * pause_us as usize, "a burst without end");
            if rig.state() == lexican_runtime::wire::nmt::NmtState::Initialising {
                rig.restart();
                rig.sent();
            }
        }
        rig.send("000#8105");
        rig.restart();
        let sent = rig.sent();
        prop_assert_eq!(sent.first().map(String::as_str), Some("705#00"));
        prop_assert_eq!(rig.read(0x1000, 0), Ok(0x192));
    }
}
