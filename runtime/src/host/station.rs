//! A device that needs only its dictionary.

use std::boxed::Box;
use std::vec::Vec;

use super::Node;
use crate::device::{Behaviour, Device, Event};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::Dictionary;
use crate::service::nmt::Reset;
use crate::time::Instant;

/// A device with its dictionary, as a [`Node`]. A reset, and power-on, which is one, restore the defaults of the data
/// sheet. The application [follows](Station::follow) the device's events, as in the example on the [front page](crate).
pub struct Station<
    const N: usize,
    const RPDOS: usize = 4,
    const TPDOS: usize = 4,
    const SERVERS: usize = 1,
    const MONITORED: usize = 4,
> {
    device: Device<RPDOS, TPDOS, SERVERS, MONITORED>,
    od: Dictionary<N>,
    application: Box<Application<Device<RPDOS, TPDOS, SERVERS, MONITORED>, Dictionary<N>>>,
}

/// Handles the events of a device.
type Application<D, O> = dyn FnMut(Instant, &mut D, &mut O, Event) + Send;

impl<const N: usize> Station<N> {
    /// A device that behaves as CiA 301 specifies, and starts now.
    #[must_use]
    pub fn new(now: Instant, node: NodeId, od: Dictionary<N>) -> Self {
        Station::with_device(now, Device::new(node, Behaviour::CIA_301), od)
    }
}

impl<const N: usize, const RPDOS: usize, const TPDOS: usize, const SERVERS: usize, const MONITORED: usize>
    Station<N, RPDOS, TPDOS, SERVERS, MONITORED>
{
    /// A device of another size or [`Behaviour`], which starts now.
    #[must_use]
    pub fn with_device(
        now: Instant,
        mut device: Device<RPDOS, TPDOS, SERVERS, MONITORED>,
        mut od: Dictionary<N>,
    ) -> Self {
        device.restart(now, &mut od);
        Station { device, od, application: Box::new(|_, _, _, _| {}) }
    }

    /// Calls `application` with each event of the device. At a reset, the dictionary has its defaults again: the
    /// application then restores what the device stores permanently.
    #[must_use]
    pub fn follow(
        self,
        application: impl FnMut(Instant, &mut Device<RPDOS, TPDOS, SERVERS, MONITORED>, &mut Dictionary<N>, Event)
        + Send
        + 'static,
    ) -> Self {
        Station { application: Box::new(application), ..self }
    }

    /// The device and its dictionary, for example to store a measured value.
    pub const fn parts(&mut self) -> (&mut Device<RPDOS, TPDOS, SERVERS, MONITORED>, &mut Dictionary<N>) {
        (&mut self.device, &mut self.od)
    }

    fn follow_event(&mut self, now: Instant, event: Event) {
        if let Event::Reset(reset) = event {
            let indices = match reset {
                Reset::Node => 0..=0xFFFF,
                Reset::Communication => 0x1000..=0x1FFF,
            };
            self.od.reset(self.device.node(), indices);
        }
        (self.application)(now, &mut self.device, &mut self.od, event);
        if let Event::Reset(_) = event {
            self.device.restart(now, &mut self.od);
        }
    }
}

impl<const N: usize, const RPDOS: usize, const TPDOS: usize, const SERVERS: usize, const MONITORED: usize> Node
    for Station<N, RPDOS, TPDOS, SERVERS, MONITORED>
{
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if let Some(event) = self.device.handle_frame(now, frame, &mut self.od) {
            self.follow_event(now, event);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if let Some(event) = self.device.handle_timeout(now, &mut self.od) {
            self.follow_event(now, event);
        }
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

    fn set_power(&mut self, now: Instant, on: bool) {
        if on {
            self.follow_event(now, Event::Reset(Reset::Node));
        }
    }
}
