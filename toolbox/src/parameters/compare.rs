//! Compares the parameters of two devices, data sheets or backups.

use std::collections::{BTreeMap, BTreeSet};

use lexican_eds::model::{Device, Entry, Value};
use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, NodeId};

use super::{Ended, LeftOuts, OnProgress, Parameters, is_beyond_mapping, read_parameters};
use crate::node::remote::{Entries, Refusal};
use crate::values::report::ValueReport;
use crate::values::wire::encode;
use crate::values::{DeviceValues, address, resolved};

/// The parameters of one side of a comparison.
#[derive(Clone, Debug)]
pub struct Side {
    /// Its data sheet.
    pub device: Device,
    /// The known values.
    pub values: BTreeMap<Address, Value>,
    /// Entries that the data sheet has, but not the node.
    pub missing: BTreeSet<Address>,
    /// Entries that are no parameters, with the reason.
    pub left_out: LeftOuts,
}

/// A parameter that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The entry.
    pub address: Address,
    /// On the first side; `None` if it lacks the entry.
    pub a: Option<ValueReport>,
    /// On the second side.
    pub b: Option<ValueReport>,
}

/// The result of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// By address.
    pub differences: Vec<Difference>,
    /// The number of parameters compared.
    pub compared: usize,
    /// Entries whose value is unknown on one side.
    pub unknown: Vec<Address>,
    /// Entries that are parameters on neither side, with the reason.
    pub left_out: LeftOuts,
}

impl Side {
    /// The values in a data sheet: those that a DCF configures, or the defaults of an EDS, for the node-ID `node`.
    #[must_use]
    pub fn of_sheet(device: Device, node: NodeId) -> Self {
        let is_configured = device.entries().any(|entry| entry.configured.is_some());
        let mut values = BTreeMap::new();
        for entry in device.entries() {
            let value = if is_configured { &entry.configured } else { &entry.default };
            let value = value.as_ref().filter(|_| !is_beyond_mapping(&values, address(entry)));
            values.extend(value.map(|value| (address(entry), resolved(value, node))));
        }
        let left_out = Parameters::of_sheet(&device, node).rest(device.entries());
        Side { device, values, missing: BTreeSet::new(), left_out }
    }

    /// The values in a node.
    pub fn of_node<N: Entries>(node: &mut N, device: Device, progress: OnProgress<'_>) -> Result<Self, Ended> {
        let found = read_parameters(node, &device, progress)?;
        let is_missing = |refusal: &Refusal| {
            matches!(refusal, Refusal::Aborted(AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX))
        };
        let missing = found.refused.iter().filter(|(_, refusal)| is_missing(refusal)).map(|(address, _)| *address);
        let missing = missing.collect();
        let left_out = Parameters::of_node(&device, node.id(), &found.values).rest(device.entries());
        Ok(Side { device, values: found.values, missing, left_out })
    }

    fn entry(&self, address: Address) -> Option<&Entry> {
        self.device.entry(address.index(), address.sub()).filter(|_| !self.missing.contains(&address))
    }

    fn report(&self, address: Address) -> Option<ValueReport> {
        let mut values = DeviceValues::new(&self.device);
        for (address, value) in &self.values {
            values.set(*address, value);
        }
        Some(ValueReport::of_value(&values, self.entry(address)?, self.values.get(&address)?.clone()))
    }
}

/// Compares everything that is a parameter on either side.
#[must_use]
pub fn compare(a: &Side, b: &Side) -> Comparison {
    let parameters = |side: &Side| {
        let parameters = side.device.entries().map(address).filter(|address| !side.left_out.contains_key(address));
        parameters.collect::<BTreeSet<_>>()
    };
    let parameters: BTreeSet<_> = &parameters(a) | &parameters(b);
    let mut left_out = b.left_out.clone();
    left_out.extend(&a.left_out);
    left_out.retain(|address, _| !parameters.contains(address));
    let mut comparison = Comparison { left_out, ..Comparison::default() };
    for address in parameters {
        let is_known = |side: &Side| side.values.contains_key(&address);
        let bytes = |side: &Side| encode(side.entry(address)?.data_type, side.values.get(&address)?);
        let differ = match (a.entry(address), b.entry(address)) {
            (None, None) => continue,
            (Some(_), Some(_)) if is_known(a) && is_known(b) => {
                comparison.compared += 1;
                bytes(a) != bytes(b)
            }
            (Some(_), Some(_)) => {
                // Skip entries of a mapping beyond the number of mapped objects on both sides.
                if is_known(a) || is_known(b) {
                    comparison.unknown.push(address);
                }
                false
            }
            (Some(_), None) => is_known(a),
            (None, Some(_)) => is_known(b),
        };
        if differ {
            comparison.differences.push(Difference { address, a: a.report(address), b: b.report(address) });
        }
    }
    comparison
}
