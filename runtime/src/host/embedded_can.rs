//! Drivers of CAN controllers as links.

use std::collections::VecDeque;
use std::format;
use std::io;

use embedded_can::nb::Can;
use embedded_can::{Error, ErrorKind};
use nb::Error::{Other, WouldBlock};

use super::clock::{Clock, pause};
use super::link::PATIENCE;
use super::{Incoming, Link, LinkError};
use crate::{Duration, Frame, Instant};

/// How often a driver is polled for a frame, or for room.
const NAP: Duration = Duration::from_millis(1);

/// A [`Link`] over a driver that implements [`embedded_can::nb::Can`]. The driver is polled every millisecond; its
/// filters are left as they are.
///
/// ```
/// use lexican_runtime::NodeId;
/// use lexican_runtime::host::{AccessError, EmbeddedCan, blocking::Network};
/// # use lexican_runtime::object::{Object, Ro};
/// # const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);
///
/// fn device_type(driver: impl embedded_can::nb::Can) -> Result<u32, AccessError> {
///     Network::new(EmbeddedCan::new(driver)).read(NodeId::literal(5), DEVICE_TYPE)
/// }
/// ```
#[derive(Debug)]
pub struct EmbeddedCan<C: Can> {
    can: C,
    clock: Clock,
    /// Frames that the driver has given back in exchange for others of higher priority.
    replaced: VecDeque<C::Frame>,
}

impl<C: Can> EmbeddedCan<C> {
    /// A link over `can`, whose controller must be active on the bus.
    pub fn new(can: C) -> Self {
        EmbeddedCan { can, clock: Clock::new(), replaced: VecDeque::new() }
    }

    /// Returns the driver.
    pub fn into_driver(self) -> C {
        self.can
    }

    /// Hands a frame to the driver, and keeps the one that it replaces.
    fn transmit(&mut self, frame: &C::Frame) -> Result<(), LinkError> {
        match self.can.transmit(frame) {
            Ok(replaced) => self.replaced.extend(replaced),
            Err(WouldBlock) => return Err(LinkError::Full),
            Err(Other(error)) => return Err(failure(&error)),
        }
        Ok(())
    }

    /// Sends the replaced frames again, as far as there is room.
    fn transmit_replaced(&mut self) -> Result<(), LinkError> {
        for _ in 0..self.replaced.len() {
            let Some(frame) = self.replaced.pop_front() else { break };
            match self.transmit(&frame) {
                Err(LinkError::Full) => {
                    self.replaced.push_front(frame);
                    break;
                }
                outcome => outcome?,
            }
        }
        Ok(())
    }
}

fn failure(error: &impl Error) -> LinkError {
    LinkError::Io(io::Error::other(format!("{error:?}")))
}

impl<C: Can> Link for EmbeddedCan<C> {
    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn is_real_time(&self) -> bool {
        true
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let until = self.now() + PATIENCE;
        loop {
            match self.try_send(frame) {
                Err(LinkError::Full) if self.now() < until => pause(NAP),
                outcome => return outcome,
            }
        }
    }

    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.transmit_replaced()?;
        let invalid = || io::Error::new(io::ErrorKind::InvalidData, "the driver's frames do not hold a CAN frame");
        self.transmit(&frame.to_embedded().ok_or_else(invalid)?)
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            self.transmit_replaced()?;
            match self.can.receive() {
                // CANopen has no longer frames.
                Ok(frame) => match Frame::from_embedded(&frame) {
                    Some(frame) => return Ok(Some(Incoming::Frame(frame))),
                    None => continue,
                },
                Err(Other(error)) => match error.kind() {
                    // The number of lost frames is not reported.
                    ErrorKind::Overrun => return Ok(Some(Incoming::Gap(1))),
                    // The controller repeats the frame.
                    ErrorKind::Bit | ErrorKind::Stuff | ErrorKind::Crc | ErrorKind::Form | ErrorKind::Acknowledge => {}
                    _ => return Err(failure(&error)),
                },
                Err(WouldBlock) => {}
            }
            let now = self.now();
            if now >= until {
                return Ok(None);
            }
            pause(until.since(now).min(NAP));
        }
    }
}
