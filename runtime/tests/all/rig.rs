//! A device as a node of a bus, and a link whose frames a test can change.

use crate::common::testing::TestOd;
use crate::common::{FULL, NODE};
use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::host::{Incoming, Link, LinkError, Node};
use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Frame, Instant, NodeId};

/// The name, which can be written.
pub(crate) const TEXT: Address = Address::new(0x1008, 0);

/// A device that counts its frames and records its events.
pub(crate) struct Recorder {
    pub(crate) device: Device<3, 3, 2, 3>,
    pub(crate) od: TestOd,
    pub(crate) heard: usize,
    pub(crate) events: Vec<Event>,
}

impl Recorder {
    /// A device with every service, which has just been switched on.
    pub(crate) fn full() -> Self {
        Recorder::of(NODE, TestOd::new(FULL))
    }

    /// A device whose name has `len` bytes, enough for block transfers.
    pub(crate) fn named(node: NodeId, len: usize) -> Self {
        let name = format!("1008:00 text rw - {}", "n".repeat(len));
        Recorder::of(node, TestOd::new(FULL).without(0x1200).with(&name))
    }

    fn of(node: NodeId, mut od: TestOd) -> Self {
        let mut device = Device::new(node, Behaviour::CIA_301);
        device.restart(Instant::ZERO, &mut od);
        Recorder { device, od, heard: 0, events: Vec::new() }
    }
}

impl Node for Recorder {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.heard += 1;
        self.events.extend(self.device.handle_frame(now, frame, &mut self.od));
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.events.extend(self.device.handle_timeout(now, &mut self.od));
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.device.poll_transmit(now, &mut self.od)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.device.poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        self.device.cob_ids().collect()
    }
    fn generation(&self) -> u32 {
        self.device.generation()
    }
}

/// A link over another one; the test's functions send and receive its frames.
pub(crate) struct Tampered<L, S, R> {
    link: L,
    send: S,
    receive: R,
}

/// With `Link::send` and `Link::receive`, nothing is changed.
pub(crate) fn tampered<L: Link, S, R>(link: L, send: S, receive: R) -> Tampered<L, S, R>
where
    S: FnMut(&mut L, &Frame) -> Result<(), LinkError>,
    R: FnMut(&mut L, Instant) -> Result<Option<Incoming>, LinkError>,
{
    Tampered { link, send, receive }
}

impl<L: Link, S, R> Link for Tampered<L, S, R>
where
    S: FnMut(&mut L, &Frame) -> Result<(), LinkError>,
    R: FnMut(&mut L, Instant) -> Result<Option<Incoming>, LinkError>,
{
    fn now(&self) -> Instant {
        self.link.now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        (self.send)(&mut self.link, frame)
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        (self.receive)(&mut self.link, until)
    }
}
