//! A device of CiA 301 with four PDOs each way and a main loop, whose size `cargo xtask size` measures.
//!
//! It is never run: the linker keeps only what the loop reaches.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use lexican_runtime::device::{Device, Event, Selection, With, Without};
use lexican_runtime::service::lss_device::{self, LssDevice, LssHost, StoreError};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::wire::lss::{self, Identity};
use lexican_runtime::{Instant, NodeId};

use self::board::{Board, CanFrame};

#[path = "../../bare/src/board.rs"]
#[allow(dead_code, reason = "the main loop never ends")]
mod board;

#[cfg(feature = "small-memory")]
mod memory;

mod od {
    #![allow(dead_code, reason = "the application that would use the handles is not measured")]
    lexican_runtime::include_od!("ds301");
}

/// `With`, unless the feature removes it.
macro_rules! unless {
    ($feature:literal) => {
        <[(); cfg!(feature = $feature) as usize] as Chosen>::Choice
    };
}

trait Chosen {
    type Choice;
}

impl Chosen for [(); 0] {
    type Choice = With;
}

impl Chosen for [(); 1] {
    type Choice = Without;
}

/// The services that are measured.
#[derive(Clone, Copy, Debug)]
struct Measured;

impl Selection for Measured {
    type Blocks = unless!("no-blocks");
    type Guarding = unless!("no-guarding");
    type Time = unless!("no-time");
    type Behaviour = Deviation;
}

/// Where CiA 301 leaves the behaviour open: a constant, unless a feature lets the program choose it.
#[cfg(not(feature = "chosen-behaviour"))]
type Deviation = lexican_runtime::device::Cia301;
#[cfg(feature = "chosen-behaviour")]
type Deviation = lexican_runtime::device::Behaviour;

const SERVERS: usize = if cfg!(feature = "extra-servers") { 2 } else { 1 };
const CONSUMERS: usize = if cfg!(feature = "no-heartbeat-consumers") { 0 } else { 4 };

type Node = Device<4, 4, SERVERS, CONSUMERS, 8, Measured>;

/// A symbol whose size is the RAM of the device.
#[used]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".measured")]
static RAM_OF_DEVICE: [u8; size_of::<Node>()] = [0; size_of::<Node>()];

/// A symbol whose size is the RAM of the dictionary.
#[used]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".measured")]
static RAM_OF_DICTIONARY: [u8; size_of::<od::Storage>()] = [0; size_of::<od::Storage>()];

/// Stores nothing: storage is not measured.
struct Forgets;

impl LssHost for Forgets {
    fn configure_bit_timing(&mut self, _: u8, _: u8) -> bool {
        false
    }

    fn store(&mut self, _: Option<NodeId>) -> Result<(), StoreError> {
        Err(StoreError::NotSupported)
    }
}

/// The main loop.
// The symbol is where the linker starts. The attribute is unsafe because no other item may have this name.
#[unsafe(no_mangle)]
pub extern "C" fn run(board: &Board, node: u8) {
    let Some(node) = NodeId::new(node) else { return };
    let now = || Instant::from_micros((board.now_us)());
    let mut od = od::storage(node);
    let mut device = Node::new(node, Deviation::default());
    device.restart(now(), &mut od);
    let identity = Identity { vendor: 0x4C58, product: 9, revision: 0x0001_0000, serial: 0 };
    let mut lss = LssDevice::new(identity, Some(node));
    loop {
        let now = now();
        while cfg!(feature = "lss")
            && let Some(frame) = lss.poll_transmit(now)
        {
            (board.send)(&CanFrame::from_frame(&frame));
        }
        while let Some(frame) = device.poll_transmit(now, &mut od) {
            (board.send)(&CanFrame::from_frame(&frame));
        }
        let mut received = CanFrame { id: 0, is_remote: false, len: 0, data: [0; 8] };
        let event = if (board.receive)(&mut received) {
            let frame = received.to_frame();
            if cfg!(feature = "lss")
                && let Some(frame) = frame.filter(|frame| frame.id() == lss::REQUEST)
                && let Some(lss_device::Event::NodeIdGiven(node)) = lss.handle_frame(now, &frame, &mut Forgets)
            {
                device.restart_as(node, now, &mut od);
            }
            frame.and_then(|frame| device.handle_frame(now, &frame, &mut od))
        } else if device.poll_timeout().is_some_and(|due| due <= now) {
            device.handle_timeout(now, &mut od)
        } else {
            None
        };
        if let Some(Event::Reset(reset)) = event {
            let values = if reset == Reset::Node { 0..=0xFFFF } else { 0x1000..=0x1FFF };
            od.reset(device.node(), values);
            device.restart(now, &mut od);
        }
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
