//! An I/O device of CiA 401: digital and analogue inputs and outputs, three PDOs in each direction, stored parameters,
//! and a node-ID by LSS.
//!
//! It is independent of the board: a [`Board`] provides inputs and outputs, a [`Flash`] persistent memory, and the
//! program drives it with frames and time through the four verbs of the runtime.
#![no_std]

mod board;
pub mod od;
mod process;
mod values;

use lexican_runtime::device::{Behaviour, Event};
use lexican_runtime::object::Address;
use lexican_runtime::service::lss_device::{self, LssDevice, LssHost, StoreError};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::snapshot::{Flash, Snapshot};
use lexican_runtime::service::storage::Storing;
use lexican_runtime::service::{guarding, heartbeat_consumer};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::lss::{self, Identity};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Frame, Instant, NodeId};

pub use board::{Board, Channels};

use process::Process;
use values::Values;

/// The interval of reading the inputs.
const SAMPLING: Duration = Duration::from_millis(1);

/// The interval of measuring the stack.
const MEASURING: Duration = Duration::from_millis(100);

/// The address under which the node-ID is stored, below all objects that 1010h stores.
const NODE_ID: Address = Address::new(0x0001, 0);

/// LSS table 0, entry 2: 500 kbit/s, the only bit rate of the device.
const BIT_RATE: (u8, u8) = (0, 2);

/// The size of the notebook (2000h), in bytes.
pub const NOTEBOOK: usize = 10_240;

/// The device with all its memory, except the notebook.
pub struct IoDevice<B, F> {
    board: B,
    /// `None` until it has a node-ID.
    device: Option<od::Services>,
    values: Values,
    stored: Snapshot<F>,
    lss: LssDevice,
    process: Process,
    next_sample: Instant,
    next_measurement: Instant,
}

impl<B: Board, F: Flash> IoDevice<B, F> {
    /// Switches the device on. Without a stored node-ID it waits for one by LSS.
    pub fn new(now: Instant, board: B, flash: F, notebook: &'static mut [u8; NOTEBOOK]) -> Self {
        let mut stored = Snapshot::new(flash, &od::TABLE, values::is_stored);
        let node = stored.kept(NODE_ID, &mut [0]).and_then(|kept| NodeId::new(*kept.first()?));
        let values = Values::new(notebook);
        let identity = Identity {
            vendor: od::VENDOR_ID,
            product: od::PRODUCT_CODE,
            revision: od::REVISION_NUMBER,
            serial: values.od.get(od::IDENTITY_OBJECT.serial_number()),
        };
        let mut io = IoDevice {
            board,
            device: None,
            values,
            stored,
            lss: LssDevice::new(identity, node),
            process: Process::default(),
            next_sample: now,
            next_measurement: now,
        };
        io.boot(now, Reset::Node, node);
        io
    }

    /// Starts with the defaults and the stored values.
    fn boot(&mut self, now: Instant, reset: Reset, node: Option<NodeId>) {
        let Some(node) = node else {
            self.device = None;
            return;
        };
        let indices = match reset {
            Reset::Node => 0..=0xFFFF,
            Reset::Communication => 0x1000..=0x1FFF,
        };
        if reset == Reset::Node {
            self.values.notebook.clear();
            self.process = Process::default();
        }
        self.values.od.reset(node, indices.clone());
        // Ignore an error of the flash: the device starts with the defaults, and can be reached.
        let loaded = self.stored.load(node, indices, &mut self.values.od);
        let device = self.device.get_or_insert(od::Services::new(node, Behaviour::CIA_301));
        device.restart_as(node, now, &mut self.values);
        if loaded.is_err() {
            device.emergency(ErrorCode::DATA_SET, ErrorRegister::MANUFACTURER, [0; 5], &mut self.values);
        }
        self.process.drive(&mut self.board, &self.values.od);
    }

    /// Handles a received frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if frame.id() == lss::REQUEST {
            let event = self.lss.handle_frame(now, frame, &mut NodeIdStore(&mut self.stored));
            if let Some(lss_device::Event::NodeIdGiven(node)) = event {
                self.boot(now, Reset::Node, Some(node));
            }
            return;
        }
        let Some(device) = &mut self.device else { return };
        let event = device.handle_frame(now, frame, &mut Storing::new(&mut self.values, &mut self.stored));
        self.follow(now, event);
    }

    /// To be called at the time of [`IoDevice::poll_timeout`].
    pub fn handle_timeout(&mut self, now: Instant) {
        if self.next_sample <= now {
            self.next_sample = now + SAMPLING;
            self.process.sample(now, &mut self.board, &mut self.values.od, self.device.as_mut());
        }
        if self.next_measurement <= now {
            self.next_measurement = now + MEASURING;
            self.values.od.set(od::UNUSED_STACK, self.board.unused_stack());
        }
        while let Some(device) = &mut self.device
            && device.poll_timeout().is_some_and(|due| due <= now)
        {
            let event = device.handle_timeout(now, &mut self.values);
            self.follow(now, event);
        }
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let answer = self.lss.poll_transmit(now);
        let device = self.device.as_mut();
        answer.or_else(|| device?.poll_transmit(now, &mut Storing::new(&mut self.values, &mut self.stored)))
    }

    /// When to call [`IoDevice::handle_timeout`].
    pub fn poll_timeout(&self) -> Instant {
        let device = self.device.as_ref().and_then(od::Services::poll_timeout);
        let own = self.next_sample.min(self.next_measurement);
        device.map_or(own, |device| device.min(own))
    }

    fn follow(&mut self, now: Instant, event: Option<Event>) {
        let Some(event) = event else { return };
        #[cfg(feature = "defmt")]
        defmt::debug!("{}", event);
        match event {
            Event::Reset(reset) => {
                let node = self.lss.reset();
                self.boot(now, reset, node);
            }
            Event::Written(address) if address == od::EMERGENCY_TO_BE_REPORTED.address() => self.report_emergency(),
            Event::StateChanged(NmtState::Stopped)
            | Event::Heartbeat { event: heartbeat_consumer::Event::Lost, .. }
            | Event::LifeGuarding(guarding::Event::Lost) => process::take_error_values(&mut self.values.od),
            _ => {}
        }
        self.process.drive(&mut self.board, &self.values.od);
    }

    /// Sends the error code in the low half of 2002h, with two manufacturer-specific bytes in the high half.
    fn report_emergency(&mut self) {
        let [low, high, info @ ..] = self.values.od.get(od::EMERGENCY_TO_BE_REPORTED).to_le_bytes();
        let [first, second] = info;
        if let Some(device) = &mut self.device {
            let code = ErrorCode(u16::from_le_bytes([low, high]));
            device.emergency(code, ErrorRegister::MANUFACTURER, [first, second, 0, 0, 0], &mut self.values);
        }
    }
}

/// Stores what LSS configures: the node-ID.
struct NodeIdStore<'a, F>(&'a mut Snapshot<F>);

impl<F: Flash> LssHost for NodeIdStore<'_, F> {
    fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
        (table, index) == BIT_RATE
    }

    fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError> {
        let node = node.map(|node| [node.get()]);
        self.0.keep(NODE_ID, node.as_ref().map(|node| &node[..])).map_err(|_| StoreError::Failed)
    }
}
