//! A device of CiA 301 with four PDOs each way, and a main loop around it: what is measured by `cargo xtask size`.
//!
//! It is never run: the linker takes what the loop reaches, and nothing else.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use lexican_runtime::device::{Behaviour, Device, Event, Selection, With, Without};
use lexican_runtime::service::lss_device::{self, LssDevice, LssHost, StoreError};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::wire::lss::{self, Identity};
use lexican_runtime::{CobId, Frame, Instant, NodeId};

mod od {
    #![allow(dead_code, reason = "the application that would use the handles is not measured")]
    lexican_runtime::include_od!("ds301");
}

/// `With`, unless the feature leaves it out.
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
}

const SERVERS: usize = if cfg!(feature = "extra-servers") { 2 } else { 1 };
const CONSUMERS: usize = if cfg!(feature = "no-heartbeat-consumers") { 0 } else { 4 };

type Node = Device<4, 4, SERVERS, CONSUMERS, 8, Measured>;

/// The RAM of the device, as the size of a symbol.
#[used]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".measured")]
static RAM_OF_DEVICE: [u8; size_of::<Node>()] = [0; size_of::<Node>()];

/// The same for its dictionary.
#[used]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".measured")]
static RAM_OF_DICTIONARY: [u8; size_of::<od::Storage>()] = [0; size_of::<od::Storage>()];

/// Keeps nothing: what stores is not measured.
struct Forgets;

impl LssHost for Forgets {
    fn configure_bit_timing(&mut self, _: u8, _: u8) -> bool {
        false
    }

    fn store(&mut self, _: Option<NodeId>) -> Result<(), StoreError> {
        Err(StoreError::NotSupported)
    }
}

/// What the board brings.
#[repr(C)]
pub struct Board {
    /// Microseconds since power-on.
    pub now_us: extern "C" fn() -> u64,
    /// Takes a frame from the controller; false when there is none.
    pub receive: extern "C" fn(&mut CanFrame) -> bool,
    /// Gives the controller a frame; it is copied.
    pub send: extern "C" fn(&CanFrame),
}

/// A frame as the controller has it.
#[repr(C)]
pub struct CanFrame {
    /// The identifier, 0 to 7FFh.
    pub id: u16,
    /// A remote frame has a length and no data.
    pub is_remote: bool,
    /// 0 to 8.
    pub len: u8,
    /// `len` of them count.
    pub data: [u8; 8],
}

/// The main loop.
// The symbol is where the linker starts. The attribute is unsafe because no other item may have this name.
#[unsafe(no_mangle)]
pub extern "C" fn run(board: &Board, node: u8) {
    let Some(node) = NodeId::new(node) else { return };
    let now = || Instant::from_micros((board.now_us)());
    let mut od = od::storage(node);
    let mut device = Node::new(node, Behaviour::CIA_301);
    device.restart(now(), &mut od);
    let identity = Identity { vendor: 0x4C58, product: 9, revision: 0x0001_0000, serial: 0 };
    let mut lss = LssDevice::new(identity, Some(node));
    loop {
        while cfg!(feature = "lss")
            && let Some(frame) = lss.poll_transmit(now())
        {
            (board.send)(&CanFrame::from_frame(&frame));
        }
        while let Some(frame) = device.poll_transmit(now(), &mut od) {
            (board.send)(&CanFrame::from_frame(&frame));
        }
        let mut received = CanFrame { id: 0, is_remote: false, len: 0, data: [0; 8] };
        let event = if (board.receive)(&mut received) {
            let frame = received.to_frame();
            if cfg!(feature = "lss")
                && let Some(frame) = frame.filter(|frame| frame.id() == lss::REQUEST)
                && let Some(lss_device::Event::NodeIdGiven(node)) = lss.handle_frame(now(), &frame, &mut Forgets)
            {
                device.restart_as(node, now(), &mut od);
            }
            frame.and_then(|frame| device.handle_frame(now(), &frame, &mut od))
        } else if device.poll_timeout().is_some_and(|due| due <= now()) {
            device.handle_timeout(now(), &mut od)
        } else {
            None
        };
        if let Some(Event::Reset(reset)) = event {
            let values = if reset == Reset::Node { 0..=0xFFFF } else { 0x1000..=0x1FFF };
            od.reset(device.node(), values);
            device.restart(now(), &mut od);
        }
    }
}

impl CanFrame {
    fn to_frame(&self) -> Option<Frame> {
        let id = CobId::standard(self.id)?;
        if self.is_remote {
            return Frame::remote(id, self.len);
        }
        Frame::new(id, self.data.get(..usize::from(self.len))?)
    }

    fn from_frame(frame: &Frame) -> Self {
        let mut data = [0; 8];
        data.iter_mut().zip(frame.data()).for_each(|(to, from)| *to = *from);
        CanFrame { id: frame.id().raw() as u16, is_remote: frame.is_remote(), len: frame.dlc(), data }
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
