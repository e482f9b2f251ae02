//! A device that needs nothing but its dictionary.

use std::boxed::Box;
use std::vec::Vec;

use super::Node;
use crate::device::{Behaviour, Device, Event};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::Dictionary;
use crate::service::nmt::Reset;
use crate::time::Instant;

/// A device with its dictionary, as a [`Node`]. A reset restores the defaults of the data sheet. The application
/// [follows](Station::follow) the device's events.
///
/// ```
/// use lexican_runtime::NodeId;
/// use lexican_runtime::device::Event;
/// use lexican_runtime::host::blocking::Network;
/// use lexican_runtime::host::{Link, Station, VirtualBus};
/// # mod od {
/// #     use lexican_runtime::object::{Access, DataType, Dictionary, Entry, Object, PdoMapping, Ro, Rw, Table};
/// #     pub const TARGET: Object<u16, Rw> = Object::new(0x2000, 0);
/// #     pub const ACTUAL: Object<u16, Ro> = Object::new(0x2001, 0);
/// #     static TABLE: Table = Table {
/// #         entries: &[
/// #             Entry::new(0x2000, 0, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(0, 2),
/// #             Entry::new(0x2001, 0, DataType::Unsigned16, Access::Ro, PdoMapping::None).at(2, 2),
/// #         ],
/// #         limits: &[],
/// #         image: &[0; 4],
/// #         node_relative: &[],
/// #     };
/// #     pub fn storage(node: lexican_runtime::NodeId) -> Dictionary<4> { Dictionary::new(&TABLE, node) }
/// # }
///
/// let (bus, node) = (VirtualBus::with_bit_rate(500), NodeId::literal(7));
/// // `od` is generated from the data sheet of a valve.
/// let valve = Station::new(bus.now(), node, od::storage(node)).follow(|_, _, od, event| {
///     if event == Event::Written(od::TARGET.address()) {
///         od.set(od::ACTUAL, od.get(od::TARGET));
///     }
/// });
/// // On a machine: `Participant::new(link, valve)`, behind the link of an interface.
/// bus.attach(valve);
///
/// let mut network = Network::new(bus.link());
/// network.write(node, od::TARGET, 500)?;
/// assert_eq!(network.read(node, od::ACTUAL)?, 500);
/// # Ok::<(), lexican_runtime::host::AccessError>(())
/// ```
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

    /// Calls `application` with each event of the device. At a reset the dictionary has its defaults again:
    /// the application restores what the device stores without power.
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
}
