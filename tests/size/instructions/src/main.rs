//! Counts the instructions of a device for a frame: all calls of a main loop, including everything that is sent.
//!
//! In QEMU, each instruction takes one nanosecond, so the board's timer counts instructions.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Frame, Instant, NodeId};
use panic_semihosting as _;

mod od {
    #![allow(dead_code, reason = "few of the objects are used")]
    lexican_runtime::include_od!("ds301");
}

const NODE: NodeId = NodeId::literal(5);

/// The number of times each frame is sent, because a tick of the timer is many instructions.
const TIMES: u32 = 1000;

/// The timer counts down 25 million times per second, from 2²⁴.
const INSTRUCTIONS_PER_TICK: u32 = 40;
const TICKS: u32 = 1 << 24;

struct Node {
    device: Device<4, 4, 1, 4, 8>,
    od: od::Storage,
}

impl Node {
    /// A device in OPERATIONAL, with an RPDO and two TPDOs of three objects each, which are sent at each SYNC.
    fn new() -> Self {
        let mut od = od::storage(NODE);
        let rpdo = od::RPDO_1_MAPPING_PARAMETER;
        od.set(od::RPDO_1_COMMUNICATION_PARAMETER.transmission_type(), 255);
        od.set(rpdo.mapped_object_1(), 0x6200_0108);
        od.set(rpdo.mapped_object_2(), 0x6200_0208);
        od.set(rpdo.mapped_object_3(), 0x6200_0308);
        od.set(rpdo.highest_sub_index(), 3);
        let tpdo = od::TPDO_1_MAPPING_PARAMETER;
        od.set(od::TPDO_1_COMMUNICATION_PARAMETER.transmission_type(), 1);
        od.set(tpdo.mapped_object_1(), 0x6000_0108);
        od.set(tpdo.mapped_object_2(), 0x6000_0208);
        od.set(tpdo.mapped_object_3(), 0x6000_0308);
        od.set(tpdo.highest_sub_index(), 3);
        let tpdo = od::TPDO_2_MAPPING_PARAMETER;
        od.set(od::TPDO_2_COMMUNICATION_PARAMETER.transmission_type(), 1);
        od.set(tpdo.mapped_object_1(), 0x6000_0408);
        od.set(tpdo.mapped_object_2(), 0x6000_0508);
        od.set(tpdo.mapped_object_3(), 0x6000_0608);
        od.set(tpdo.highest_sub_index(), 3);
        let mut node = Node { device: Device::new(NODE, Behaviour::CIA_301), od };
        node.device.restart(Instant::ZERO, &mut node.od);
        node.send();
        node.device.enter(Instant::ZERO, NmtState::Operational);
        node.send();
        node
    }

    /// Sends all that is due, and returns the number of frames.
    fn send(&mut self) -> usize {
        let mut sent = 0;
        while let Some(frame) = self.device.poll_transmit(Instant::ZERO, &mut self.od) {
            black_box(frame);
            sent += 1;
        }
        sent
    }

    /// Handles a frame as a main loop does.
    fn take(&mut self, frame: &Frame) -> usize {
        black_box(self.device.handle_frame(Instant::ZERO, frame, &mut self.od));
        let sent = self.send();
        black_box(self.device.poll_timeout());
        sent
    }
}

#[entry]
fn main() -> ! {
    let mut timer = cortex_m::Peripherals::take().expect("nothing else has the board").SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS - 1);
    timer.enable_counter();
    let id = |id| CobId::standard(id).expect("the identifier has 11 bits");
    let frames = [
        ("a frame of another node", Frame::from_array(id(0x206), [1, 2, 3, 4, 5, 6, 7, 8]), 0),
        ("SDO read of 4 bytes, both frames", Frame::from_array(id(0x605), [0x40, 0x18, 0x10, 1, 0, 0, 0, 0]), 1),
        ("an RPDO of 3 objects", Frame::from_array(id(0x205), [1, 2, 3]), 0),
        ("SYNC, and 2 TPDOs of 3 objects each", Frame::from_array(CobId::SYNC, []), 2),
    ];
    let mut node = Node::new();
    for (name, frame, sent) in &frames {
        assert_eq!(node.take(frame), *sent, "{name}");
        let instructions = count(&mut timer, || black_box(&mut node).take(black_box(frame))) - count(&mut timer, || 0);
        hprintln!("| {} | {} |", name, instructions);
    }
    assert_eq!(node.od.get(od::WRITE_OUTPUT_8_BIT.at(3).expect("there are eight")), 3, "the RPDO was taken");
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

/// The instructions of one call.
fn count(timer: &mut SYST, mut call: impl FnMut() -> usize) -> u32 {
    timer.clear_current();
    for _ in 0..TIMES {
        black_box(call());
    }
    (TICKS - SYST::get_current()) * INSTRUCTIONS_PER_TICK / TIMES
}
