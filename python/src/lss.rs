//! LSS (CiA 305): node-IDs for devices that have none, or another.

use lexican_machine::BoxedLink;
use lexican_runtime::host::Pace;
use lexican_runtime::wire::lss::Identity;
use lexican_toolbox::lss::{Session, Target, Times, Trouble};
use pyo3::prelude::*;

use crate::error::{LinkFailed, wrong};
use crate::network::Network;
use crate::opened::{Shared, bus_url};
use crate::sheet::node_id;

/// Vendor-ID, product code, revision number and serial number (1018h).
type Numbers = (u32, u32, u32, u32);

/// Runs a conversation on the bus of a URL, or of a simulated network: for seconds, after which Ctrl-C is noticed.
fn converse<T: Send>(
    bus: &Bound<'_, PyAny>,
    work: impl FnOnce(&mut Session<BoxedLink>) -> Result<T, Trouble> + Send,
) -> PyResult<T> {
    let (link, simulation) = match bus.cast::<Network>() {
        Ok(network) => (network.get().shared.another_link()?, None),
        Err(_) => Shared::lone_link(&bus_url(&bus.extract::<String>()?)?, Pace::Virtual)?,
    };
    let done = bus.py().detach(|| Session::run(link, Times::default(), work));
    drop(simulation);
    done.map_err(|trouble| match trouble {
        Trouble::Link(error) => LinkFailed::new_err(error.to_string()),
        other => wrong(other),
    })
}

/// The identities of all devices without node-ID, by LSS fastscan: vendor-ID, product code, revision and serial number. `bus` is
/// a URL, which no network has open, or a network that is simulated.
///
/// Raises LexicanError if two devices have the same identity; LinkFailed.
#[pyfunction]
pub(crate) fn lss_scan(bus: &Bound<'_, PyAny>) -> PyResult<Vec<Numbers>> {
    let found = converse(bus, |session| session.find_all::<Trouble>(|_| Ok(true), |_| {}))?;
    Ok(found.iter().map(|it| (it.vendor, it.product, it.revision, it.serial)).collect())
}

/// Gives the device with an identity, or the only one on the bus, a node-ID, which it takes at once, and stores with `store`. Whether
/// it has booted with it.
///
/// Raises LexicanError if no device answers, or several, or it refuses; LinkFailed.
#[pyfunction]
#[pyo3(signature = (bus, node, identity = None, store = false))]
pub(crate) fn lss_configure(
    bus: &Bound<'_, PyAny>,
    node: u8,
    identity: Option<Numbers>,
    store: bool,
) -> PyResult<bool> {
    let node = node_id(node)?;
    let target = identity.map_or(Target::Only, |(vendor, product, revision, serial)| {
        Target::Identity(Identity { vendor, product, revision, serial })
    });
    converse(bus, move |session| {
        let selected = session.give(target, node, store)?;
        session.take(selected.node, Some(node), true)
    })
}
