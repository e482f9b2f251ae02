//! A device that gets its node-ID by LSS, with the dictionary that is generated from `tests/conformance/lss.eds`.

use lexican_conform::Case;
use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::host::Node;
use lexican_runtime::service::lss_device::{self, LssDevice, LssHost, StoreError};
use lexican_runtime::wire::lss::{self, Identity};
use lexican_runtime::{Frame, Instant, NodeId};

use crate::device::NODE;

pub const DATA_SHEET: &str = include_str!("../../conformance/lss.eds");

mod od {
    lexican_runtime::include_od!("lss");
}

pub fn tests(case: &&Case) -> bool {
    case.is_meant_by("305")
}

/// The bit rates of the data sheet: 1000, 500, 250 and 125 kbit/s.
struct Memory;

impl LssHost for Memory {
    fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
        table == 0 && matches!(index, 0 | 2..=4)
    }
    fn store(&mut self, _: Option<NodeId>) -> Result<(), StoreError> {
        Ok(())
    }
}

/// The device, switched on.
pub struct DeviceWithLss {
    lss: LssDevice,
    /// `None` without a node-ID.
    device: Option<Device<0, 0, 1, 0>>,
    od: od::Storage,
}

impl DeviceWithLss {
    pub fn new() -> Self {
        let od = od::storage(NODE);
        let identity = Identity {
            vendor: od.get(od::IDENTITY_OBJECT.vendor_id()),
            product: od.get(od::IDENTITY_OBJECT.product_code()),
            revision: od.get(od::IDENTITY_OBJECT.revision_number()),
            serial: od.get(od::IDENTITY_OBJECT.serial_number()),
        };
        let mut device = DeviceWithLss { lss: LssDevice::new(identity, Some(NODE)), device: None, od };
        device.boot(Instant::ZERO, Some(NODE));
        device
    }

    fn boot(&mut self, now: Instant, node: Option<NodeId>) {
        self.device = node.map(|node| {
            self.od.reset(node, 0..=0xFFFF);
            let mut device = Device::new(node, Behaviour::CIA_301);
            device.restart(now, &mut self.od);
            device
        });
    }

    fn follow(&mut self, now: Instant, event: Option<Event>) {
        if let Some(Event::Reset(_)) = event {
            let node = self.lss.reset();
            self.boot(now, node);
        }
    }
}

impl Node for DeviceWithLss {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if frame.id() == lss::REQUEST {
            let event = self.lss.handle_frame(now, frame, &mut Memory);
            if let Some(lss_device::Event::NodeIdGiven(node)) = event {
                self.boot(now, Some(node));
            }
            return;
        }
        let event = self.device.as_mut().and_then(|device| device.handle_frame(now, frame, &mut self.od));
        self.follow(now, event);
    }

    fn handle_timeout(&mut self, now: Instant) {
        let event = self.device.as_mut().and_then(|device| device.handle_timeout(now, &mut self.od));
        self.follow(now, event);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let answer = self.lss.poll_transmit(now);
        answer.or_else(|| self.device.as_mut()?.poll_transmit(now, &mut self.od))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.device.as_ref()?.poll_timeout()
    }
}
