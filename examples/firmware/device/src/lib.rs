//! An I/O device of the kind of CiA 401: digital and analogue inputs and outputs, three PDOs each way, stored parameters,
//! and its node-ID by LSS.
//!
//! It knows no board: a [`Board`] has the inputs and outputs, a [`Flash`] what survives a loss of power, and the program
//! moves frames and time by the four verbs of the runtime.
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

/// How often the inputs are read.
const SAMPLING: Duration = Duration::from_millis(1);

/// How often the stack is measured.
const MEASURING: Duration = Duration::from_millis(100);

/// Where the node-ID is kept, below the objects that 1010h stores.
const NODE_ID: Address = Address::new(0x0001, 0);

/// LSS entry 2 of table 0: 500 kbit/s, the one bit rate of the device.
const BIT_RATE: (u8, u8) = (0, 2);

/// How many bytes the notebook (2000h) has.
pub const NOTEBOOK: usize = 10_240;

/// The device. Its memory is in it, but for the notebook.
pub struct IoDevice<B, F> {
    board: B,
    /// `None` while it has no node-ID.
    device: Option<od::Services>,
    values: Values,
    stored: Snapshot<F>,
    lss: LssDevice,
    process: Process,
    next_sample: Instant,
    next_measurement: Instant,
}

impl<B: Board, F: Flash> IoDevice<B, F> {
    /// Power-on. Without a stored node-ID the device waits for one by LSS.
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

    /// Begins anew with the defaults and what is stored.
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
        // A flash that fails leaves defaults, and the device in reach.
        let loaded = self.stored.load(node, indices, &mut self.values.od);
        let device = self.device.get_or_insert(od::Services::new(node, Behaviour::CIA_301));
        device.restart_as(node, now, &mut self.values);
        if loaded.is_err() {
            device.emergency(ErrorCode::DATA_SET, ErrorRegister::MANUFACTURER, [0; 5], &mut self.values);
        }
        self.process.drive(&mut self.board, &self.values.od);
    }

    /// A frame came in.
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

    /// The time of [`IoDevice::poll_timeout`] has come.
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

    /// The error code in the low half of 2002h, and two bytes of the manufacturer in the other.
    fn report_emergency(&mut self) {
        let [low, high, info @ ..] = self.values.od.get(od::EMERGENCY_TO_BE_REPORTED).to_le_bytes();
        let [first, second] = info;
        if let Some(device) = &mut self.device {
            let code = ErrorCode(u16::from_le_bytes([low, high]));
            device.emergency(code, ErrorRegister::MANUFACTURER, [first, second, 0, 0, 0], &mut self.values);
        }
    }
}

/// What LSS changes: the node-ID.
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
