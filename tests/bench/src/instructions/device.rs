//! The device's side: a thousand objects, four PDOs of two objects in each direction, OPERATIONAL, with a heartbeat.

use std::hint::black_box;

use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::object::Dictionary;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Frame, Instant, NodeId};

use crate::sdo::dispatch;

const NODE: NodeId = NodeId::literal(5);
const OBJECTS: u16 = 1000;
const IMAGE: usize = dispatch::image_len(OBJECTS);
/// Sent at every SYNC.
const SYNCHRONOUS: u32 = 1;

struct Bench {
    device: Device<4, 4, 1, 4>,
    od: Box<Dictionary<IMAGE>>,
    now: Instant,
}

impl Bench {
    fn new() -> Self {
        let od = Box::new(dispatch::dictionary(OBJECTS, SYNCHRONOUS));
        let mut bench = Bench { device: Device::new(NODE, Behaviour::CIA_301), od, now: Instant::ZERO };
        bench.device.restart(bench.now, &mut *bench.od);
        bench.settle();
        bench.device.enter(bench.now, NmtState::Operational);
        bench.settle();
        bench
    }

    /// What a shell calls before it waits; how many frames were sent.
    fn settle(&mut self) -> u32 {
        let mut sent = 0;
        while black_box(self.device.poll_transmit(self.now, &mut *self.od)).is_some() {
            sent += 1;
        }
        black_box(self.device.poll_timeout());
        sent
    }

    /// Takes the same frame again and again, which is answered by `answers` frames.
    fn round<const N: usize>(
        mut self,
        id: CobId,
        data: [u8; N],
        answers: u32,
        event: fn(&Event) -> bool,
    ) -> Box<dyn FnMut()> {
        let frame = Frame::from_array(id, data);
        Box::new(move || {
            let got = self.device.handle_frame(self.now, black_box(&frame), &mut *self.od);
            assert!(got.as_ref().is_none_or(event), "{got:?}");
            assert_eq!(self.settle(), answers);
        })
    }
}

pub(super) fn other(_: u8) -> Box<dyn FnMut()> {
    Bench::new().round(CobId::of_node(0x180, NodeId::literal(6)), [0; 8], 0, |_| false)
}

pub(super) fn sdo_read(_: u8) -> Box<dyn FnMut()> {
    // 2200h, in the middle.
    Bench::new().round(CobId::of_node(0x600, NODE), [0x40, 0x00, 0x22, 0, 0, 0, 0, 0], 1, |_| false)
}

pub(super) fn rpdo(_: u8) -> Box<dyn FnMut()> {
    let is_received = |event: &Event| matches!(event, Event::RpdoReceived { .. });
    Bench::new().round(CobId::of_node(0x200, NODE), [1, 2, 3, 4, 5, 6, 7, 8], 0, is_received)
}

pub(super) fn sync(_: u8) -> Box<dyn FnMut()> {
    Bench::new().round(CobId::SYNC, [], 4, |event| matches!(event, Event::Sync { .. }))
}
