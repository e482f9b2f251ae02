//! LSS (CiA 305): gives node-IDs to devices without one, or with another one.

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

/// Runs an LSS session on the bus of a URL or of a simulated network. Ctrl-C is noticed at its end, after seconds.
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

/// The identities of all devices without node-ID, by LSS fastscan: vendor-ID, product code, revision and serial number.
/// `bus` is a URL that no network has open, or a simulated network.
///
/// Raises LexicanError if two devices have the same identity; LinkFailed.
#[pyfunction]
pub(crate) fn lss_scan(bus: &Bound<'_, PyAny>) -> PyResult<Vec<Numbers>> {
    let found = converse(bus, |session| session.find_all::<Trouble>(|_| Ok(true), |_| {}))?;
    Ok(found.iter().map(|it| (it.vendor, it.product, it.revision, it.serial)).collect())
}

/// Gives a node-ID to the device with this identity, or to the only one on the bus. The device uses it at once, and
/// stores it with `store`. Returns whether it has booted with it.
///
/// Raises LexicanError if no device answers, or several do, or the device refuses; LinkFailed.
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
