//! The driver of a controller as a link.
#![cfg(all(feature = "embedded-can", feature = "std"))]

#[allow(dead_code, reason = "several tests share it")]
use std::cell::Cell;
use std::collections::VecDeque;
use std::rc::Rc;

use crate::shell_support::{DEVICE_TYPE, station};
use embedded_can::ErrorKind;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{EmbeddedCan, Incoming, Link, LinkError, Node, Station};
use lexican_runtime::{CobId, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);

/// A controller with one transmit buffer, which is sent while the bus is idle, to the only device.
struct Controller {
    device: Station<28>,
    is_idle: Rc<Cell<bool>>,
    buffer: Option<Frame>,
    sent: Vec<Frame>,
    errors: Vec<ErrorKind>,
    received: VecDeque<Frame>,
}

impl Controller {
    fn new() -> Self {
        let (buffer, sent, errors, received) = (None, Vec::new(), Vec::new(), VecDeque::new());
        let mut device = station(NODE);
        // Its boot-up message.
        assert!(Node::poll_transmit(&mut device, Instant::ZERO).is_some());
        Controller { device, is_idle: Rc::new(Cell::new(true)), buffer, sent, errors, received }
    }
}

impl embedded_can::nb::Can for Controller {
    type Frame = Frame;
    type Error = ErrorKind;

    fn transmit(&mut self, frame: &Frame) -> nb::Result<Option<Frame>, ErrorKind> {
        if !self.is_idle.get() {
            let replaced = match self.buffer {
                Some(waits) if waits.id() <= frame.id() => return Err(nb::Error::WouldBlock),
                waits => waits,
            };
            self.buffer = Some(*frame);
            return Ok(replaced);
        }
        for frame in self.buffer.take().into_iter().chain([*frame]) {
            self.sent.push(frame);
            self.device.handle_frame(Instant::ZERO, &frame);
        }
        while let Some(answer) = Node::poll_transmit(&mut self.device, Instant::ZERO) {
            self.received.push_back(answer);
        }
        Ok(None)
    }

    fn receive(&mut self) -> nb::Result<Frame, ErrorKind> {
        match self.errors.pop() {
            Some(error) => Err(nb::Error::Other(error)),
            None => self.received.pop_front().ok_or(nb::Error::WouldBlock),
        }
    }
}

#[test]
fn objects_are_read_through_a_driver() {
    let mut network = Network::new(EmbeddedCan::new(Controller::new()));
    assert_eq!(network.read(NODE, DEVICE_TYPE).unwrap(), 0x0002_0192);
}

#[test]
fn a_replaced_frame_is_sent_again_and_a_full_buffer_refuses() {
    let controller = Controller::new();
    let is_idle = Rc::clone(&controller.is_idle);
    is_idle.set(false);
    let mut link = EmbeddedCan::new(controller);
    let frame = |id| Frame::from_array(CobId::standard(id).unwrap(), [1]);
    link.try_send(&frame(0x300)).unwrap();
    link.try_send(&frame(0x200)).unwrap();
    assert!(matches!(link.try_send(&frame(0x400)), Err(LinkError::Full)));
    is_idle.set(true);
    link.receive(Instant::ZERO).unwrap();
    assert_eq!(link.into_driver().sent, [frame(0x200), frame(0x300)]);
}

#[test]
fn an_overrun_is_a_gap_and_an_error_of_the_bus_is_none() {
    let errors = vec![ErrorKind::Other, ErrorKind::Stuff, ErrorKind::Overrun];
    let mut link = EmbeddedCan::new(Controller { errors, ..Controller::new() });
    assert_eq!(link.receive(Instant::ZERO).unwrap(), Some(Incoming::Gap(1)));
    // The stuff error.
    assert_eq!(link.receive(Instant::ZERO).unwrap(), None);
    assert!(link.receive(Instant::ZERO).unwrap_err().is_final());
}
