//! The data sheet with its overlay, and the code that was generated from it.

use lexican_eds::model::{Device, Entry, Meaning, Parameter, Unit, Value};
use lexican_eds::{Input, Severity, Source};
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;

use crate::code::{Code, Handle};

/// Keys of the data sheet and of the overlay that say nothing about the drive.
pub const PROSE: &[(&str, &str)] = &[
    ("CreationTime", "history of the file"),
    ("CreationDate", "history of the file"),
    ("CreatedBy", "history of the file"),
    ("ModificationTime", "history of the file"),
    ("ModificationDate", "history of the file"),
    ("ModifiedBy", "history of the file"),
    ("Description", "of the file; the version of the firmware is compared"),
    ("Line1 to Line10", "comments"),
    ("description", "prose of the overlay"),
    ("reason", "prose of the overlay"),
];

/// The data sheet with its overlay, and the code that was generated from it.
pub(crate) struct Sheet {
    pub(crate) device: Device,
    /// The data sheet as other tools read it, without the overlay.
    pub(crate) alone: Device,
    pub(crate) overlay: String,
    pub(crate) code: Code,
    node: NodeId,
    pub(crate) findings: Vec<String>,
    pub(crate) code_is_stale: bool,
}

impl Sheet {
    /// Loads data sheet and overlay, and takes the code for a node.
    pub(crate) fn new([eds, overlay]: [Source; 2], code: Code, node: NodeId, code_is_stale: bool) -> Self {
        let (alone, _) = lexican_eds::load(&Input::new(eds.clone()));
        let text = overlay.text().to_owned();
        let (device, diagnostics) = lexican_eds::load(&Input::new(eds).overlay(overlay));
        // Notes are no findings.
        let findings = diagnostics.iter().filter(|finding| finding.severity > Severity::Note);
        let findings = findings.map(|finding| format!("{} {}", finding.code, finding.message)).collect();
        Sheet { device, alone, overlay: text, code, node, findings, code_is_stale }
    }

    pub(crate) fn handle(&self, entry: &Entry) -> Option<&Handle> {
        self.code.handles.get(&address(entry))
    }

    /// The parameters of another interface than CANopen.
    pub(crate) fn parameters(&self, interface: &str) -> &[Parameter] {
        self.device.interfaces.get(interface).map_or(&[], |interface| &interface.parameters)
    }

    /// The number of a value, for the node of the manual's examples.
    pub(crate) fn number(&self, value: Option<&Value>) -> Option<i128> {
        match value? {
            Value::Integer(number) => Some(*number),
            Value::NodeIdPlus(base) => Some(i128::from(*base) + i128::from(self.node.get())),
            _ => None,
        }
    }

    /// The units of a number; empty unless it is a quantity.
    pub(crate) fn units(&self, entry: &Entry) -> &[Unit] {
        match &entry.meaning {
            Meaning::Quantity(name) => self.device.quantities.get(name).map_or(&[], |quantity| &quantity.units),
            _ => &[],
        }
    }
}

pub(crate) fn address(entry: &Entry) -> Address {
    Address::new(entry.index, entry.sub)
}
