//! The carrier of a [`ProfibusDoor`] on a bus (feature `master`).

use lexican_profibus::bus::{AddressError, Bus, Notice, Station};
use lexican_profibus::master::Segment;
use lexican_runtime::host::LinkError;
use lexican_runtime::{Duration, Instant, NodeId};
use profirust::dp::PeripheralOptions;
use siko::gateway::{Carrier, Gateway, GatewayLink, GatewayNode};

use crate::bus::options;
use crate::gateway::ProfibusDoor;
use crate::model::{Model, PPO};

/// How often a node of a virtual CAN bus runs its PROFIBUS: a cycle with one drive takes a third of that at 1.5 Mbit/s.
const LOOKS: Duration = Duration::from_millis(1);

/// A drive on a bus as a link with this drive as its only node. The node-ID is the PROFIBUS address, up to 126. Further
/// drives on the same bus have their own links.
pub fn link<S: Segment>(
    bus: &Bus<S>,
    model: &'static Model,
    address: NodeId,
) -> Result<GatewayLink<ProfibusDoor, Station<S>>, AddressError> {
    link_with(bus, model, address, options(model))
}

/// The same with other options, such as those of its GSD file (`lexican_profibus::gsd`), whose configuration has to fit
/// the data of [`PPO`].
pub fn link_with<S: Segment>(
    bus: &Bus<S>,
    model: &'static Model,
    address: NodeId,
    options: PeripheralOptions<'static>,
) -> Result<GatewayLink<ProfibusDoor, Station<S>>, AddressError> {
    let (gateway, station) = parts(bus, model, address, options)?;
    Ok(GatewayLink::new(gateway, station))
}

/// The same as a node of a virtual CAN bus, next to others.
pub fn node<S: Segment>(
    bus: &Bus<S>,
    model: &'static Model,
    address: NodeId,
) -> Result<GatewayNode<ProfibusDoor, Station<S>>, AddressError> {
    let (gateway, station) = parts(bus, model, address, options(model))?;
    Ok(GatewayNode::new(gateway, station))
}

fn parts<S: Segment>(
    bus: &Bus<S>,
    model: &'static Model,
    address: NodeId,
    options: PeripheralOptions<'static>,
) -> Result<(Gateway<ProfibusDoor>, Station<S>), AddressError> {
    let gateway = Gateway::new(model.drive, address, ProfibusDoor::new(model));
    Ok((gateway, bus.station(address.get(), options, PPO.lengths())?))
}

impl<S: Segment> Carrier<ProfibusDoor> for Station<S> {
    fn now(&self) -> Instant {
        self.now()
    }

    fn carry(&mut self, door: &mut ProfibusDoor, until: Instant) -> Result<(), LinkError> {
        let master = door.master_mut();
        self.set_outputs(&master.outputs());
        match self.wait(until).map_err(std::io::Error::from)? {
            Some(Notice::Exchanged(exchange)) => {
                if let (Ok(sent), Ok(received)) = (exchange.sent.try_into(), exchange.received.try_into()) {
                    master.handle_exchange(self.now(), &sent, &received);
                }
            }
            Some(Notice::Lost) => master.handle_offline(),
            None => {}
        }
        // The next exchange carries the new outputs.
        self.set_outputs(&master.outputs());
        Ok(())
    }

    fn is_real_time(&self) -> bool {
        self.is_real_time()
    }

    fn next_event(&self) -> Option<Instant> {
        // Another node of the same segment may have advanced the time.
        Some(if self.has_notice() { self.now() } else { self.now() + LOOKS })
    }
}
