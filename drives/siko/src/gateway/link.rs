//! A gateway as a link, and as a node of a simulated bus.

use std::panic::{AssertUnwindSafe, catch_unwind};

use lexican_runtime::host::{Incoming, Link, LinkError, Node};
use lexican_runtime::{Duration, Frame, Instant};

use super::{Door, Gateway};

/// The line behind a door, with its clock: the only I/O of a gateway.
pub trait Carrier<D> {
    /// The time on the line.
    fn now(&self) -> Instant;

    /// Sends the frames of the door, waits for the line at most until `until`, and hands the door what has come.
    fn carry(&mut self, door: &mut D, until: Instant) -> Result<(), LinkError>;

    /// Whether the clock runs in real time.
    fn is_real_time(&self) -> bool;

    /// The time of the next event on a simulated line: for [`GatewayNode`].
    fn next_event(&self) -> Option<Instant> {
        None
    }
}

/// How long a dropped link waits for its frames to leave.
const LAST_WORDS: Duration = Duration::from_millis(500);

/// A drive behind another interface, as a [`Link`] to a bus whose only node is that drive.
///
/// When it is dropped, it first sends the orders under way, for half a second at most: so a program that panics stops
/// its drive, too.
#[derive(Debug)]
pub struct GatewayLink<D: Door, C: Carrier<D>> {
    gateway: Gateway<D>,
    carrier: C,
}

impl<D: Door, C: Carrier<D>> GatewayLink<D, C> {
    /// A gateway on its line.
    #[must_use]
    pub fn new(gateway: Gateway<D>, carrier: C) -> Self {
        GatewayLink { gateway, carrier }
    }

    /// The gateway.
    #[must_use]
    pub fn gateway(&self) -> &Gateway<D> {
        &self.gateway
    }

    /// The line.
    pub fn carrier(&mut self) -> &mut C {
        &mut self.carrier
    }

    /// Lets the line run until `until`, or until something has come.
    fn turn(&mut self, until: Instant) -> Result<(), LinkError> {
        self.carrier.carry(self.gateway.door_mut(), until)?;
        self.gateway.handle_timeout(self.carrier.now());
        Ok(())
    }
}

impl<D: Door, C: Carrier<D>> Link for GatewayLink<D, C> {
    fn now(&self) -> Instant {
        self.carrier.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.gateway.handle_frame(self.carrier.now(), frame);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let mut looked = false;
        loop {
            let now = self.carrier.now();
            if let Some(frame) = self.gateway.poll_transmit(now) {
                return Ok(Some(Incoming::Frame(frame)));
            }
            if looked && now >= until {
                return Ok(None);
            }
            looked = true;
            let deadline = self.gateway.poll_timeout().unwrap_or(Instant::MAX);
            self.turn(until.min(deadline).max(now))?;
        }
    }

    fn is_real_time(&self) -> bool {
        self.carrier.is_real_time()
    }

    fn latency(&self) -> Duration {
        self.gateway.answers_within()
    }
}

impl<D: Door, C: Carrier<D>> Drop for GatewayLink<D, C> {
    fn drop(&mut self) {
        let until = self.carrier.now() + LAST_WORDS;
        // If the line panics while another panic unwinds, the process would abort, and other drives would not be told
        // to stop.
        let _ = catch_unwind(AssertUnwindSafe(|| {
            while self.gateway.is_busy() && self.carrier.now() < until {
                let deadline = self.gateway.poll_timeout().unwrap_or(until);
                if self.turn(deadline.min(until)).is_err() {
                    return;
                }
            }
        }));
    }
}

/// A drive behind another interface on a simulated line, as a node of a virtual bus, next to drives on CAN.
#[derive(Debug)]
pub struct GatewayNode<D, C> {
    gateway: Gateway<D>,
    line: C,
}

impl<D: Door, C: Carrier<D>> GatewayNode<D, C> {
    /// A gateway on its line.
    #[must_use]
    pub fn new(gateway: Gateway<D>, line: C) -> Self {
        GatewayNode { gateway, line }
    }

    /// The gateway.
    #[must_use]
    pub fn gateway(&self) -> &Gateway<D> {
        &self.gateway
    }

    /// The line, for tests and scripts to act on.
    pub fn line(&mut self) -> &mut C {
        &mut self.line
    }

    /// Lets the line run up to the time of the bus.
    fn follow(&mut self, now: Instant) {
        loop {
            // A line that has failed carries nothing.
            if self.line.carry(self.gateway.door_mut(), now).is_err() {
                return;
            }
            self.gateway.handle_timeout(self.line.now());
            if self.line.now() >= now && self.poll_timeout().is_none_or(|next| next > now) {
                // Sends the last frames of the gateway.
                let _ = self.line.carry(self.gateway.door_mut(), now);
                return;
            }
        }
    }
}

impl<D: Door, C: Carrier<D>> Node for GatewayNode<D, C> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.follow(now);
        self.gateway.handle_frame(now, frame);
        self.follow(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.follow(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.gateway.poll_transmit(now)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        [self.gateway.poll_timeout(), self.line.next_event()].into_iter().flatten().min()
    }
}
