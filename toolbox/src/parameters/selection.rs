//! Decides which entries of a device are parameters, and gives the reason for the others.

use std::collections::{BTreeMap, BTreeSet};

use lexican_eds::model::{Device, Direction, Entry, Value};
use lexican_eds::standard::{Role, role};
use lexican_eds::types::DataType;
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;

use crate::decode::pdo;
use crate::values::{DeviceValues, address};

/// Why an entry is no parameter. Access types `rwr` and `rww` are no reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LeftOut {
    /// A set-point or an output of the device profile.
    SetPoint,
    /// An active RPDO maps it.
    Mapped,
    /// Writing it is a command.
    Command,
    /// It cannot be read, and the DCF does not give it a value.
    WriteOnly,
    /// A DOMAIN: possibly long, and not contained in a data sheet.
    Domain,
    /// It cannot be written.
    ReadOnly,
}

impl LeftOut {
    /// One word, as in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            LeftOut::SetPoint => "set-point",
            LeftOut::Mapped => "mapped",
            LeftOut::Command => "command",
            LeftOut::WriteOnly => "write-only",
            LeftOut::Domain => "domain",
            LeftOut::ReadOnly => "read-only",
        }
    }

    /// After a number: `3 written by an RPDO`.
    #[must_use]
    pub const fn words(self, count: usize) -> &'static str {
        match (self, count) {
            (LeftOut::SetPoint, 1) => "set-point",
            (LeftOut::SetPoint, _) => "set-points",
            (LeftOut::Mapped, _) => "written by an RPDO",
            (LeftOut::Command, 1) => "command",
            (LeftOut::Command, _) => "commands",
            (LeftOut::WriteOnly, _) => "write-only",
            (LeftOut::Domain, 1) => "DOMAIN",
            (LeftOut::Domain, _) => "DOMAINs",
            (LeftOut::ReadOnly, _) => "read-only",
        }
    }
}

/// The entries that were left out, with the reason.
pub type LeftOuts = BTreeMap<Address, LeftOut>;

/// The parameters of a device: the common rule of backup, restore, compare and apply.
#[derive(Clone, Debug)]
pub struct Parameters<'a> {
    device: &'a Device,
    /// The entries that active RPDOs map.
    mapped: BTreeSet<Address>,
}

impl<'a> Parameters<'a> {
    /// By a data sheet or DCF.
    #[must_use]
    pub fn of_sheet(device: &'a Device, node: NodeId) -> Self {
        Self::of(&DeviceValues::new(device), node)
    }

    /// By the values read from a node, which show its active RPDOs and what they map.
    #[must_use]
    pub fn of_node(device: &'a Device, node: NodeId, read: &BTreeMap<Address, Value>) -> Self {
        let mut values = DeviceValues::new(device);
        read.iter().for_each(|(address, value)| values.set(*address, value));
        Self::of(&values, node)
    }

    fn of(values: &DeviceValues<'a>, node: NodeId) -> Self {
        let rpdos = values.device.pdos.iter().filter(|pdo| pdo.direction == Direction::Receive);
        let active = rpdos.filter(|rpdo| pdo::cob_id(values, node, rpdo).is_some());
        let mapped = active.flat_map(|rpdo| pdo::mapping(values, rpdo));
        let mapped = mapped.map(|mapped| Address::new(mapped.index, mapped.sub)).collect();
        Parameters { device: values.device, mapped }
    }

    /// Why an entry is no parameter; `None` if it is one.
    #[must_use]
    pub fn left_out(&self, entry: &Entry) -> Option<LeftOut> {
        let has_value = entry.configured.is_some() || entry.download_file.is_some();
        match role(self.device, entry.index, entry.sub) {
            _ if !entry.access.writable() => Some(LeftOut::ReadOnly),
            Some(Role::Command) => Some(LeftOut::Command),
            Some(Role::SetPoint) => Some(LeftOut::SetPoint),
            None if self.mapped.contains(&address(entry)) => Some(LeftOut::Mapped),
            None if !entry.access.readable() && !has_value => Some(LeftOut::WriteOnly),
            None if entry.data_type == DataType::Domain => Some(LeftOut::Domain),
            None => None,
        }
    }

    /// The parameters.
    pub fn entries(&self) -> impl Iterator<Item = &'a Entry> {
        self.device.entries().filter(|entry| self.left_out(entry).is_none())
    }

    /// Those of the entries that are no parameters, with the reason.
    pub fn rest<'e>(&self, entries: impl IntoIterator<Item = &'e Entry>) -> LeftOuts {
        entries.into_iter().filter_map(|entry| Some((address(entry), self.left_out(entry)?))).collect()
    }
}
