//! What numbers mean that CiA standards define: where the overlay says nothing, and the object has the data
//! type of the standard.
//!
//! Objects of the communication profile (CiA 301) mean the same in every device. Objects of a device
//! profile mean what it says only in a device that follows it.

use lexican_eds::Span;
use lexican_eds::model::{BitField, Bits, Device, Enumeration, Meaning, Named};
use lexican_eds::types::DataType;

/// What a standard says of one index.
struct Standard {
    /// The device profile; 301 for all devices.
    profile: u16,
    index: u16,
    /// Sub-index 0 of a single value, or all sub-indices but 0.
    elements: bool,
    data_type: DataType,
    name: &'static str,
    description: &'static str,
    kind: Kind,
}

enum Kind {
    Values(&'static [(i128, &'static str)]),
    /// Lowest bit, highest bit, name.
    Bits(&'static [(u8, u8, &'static str)]),
}

/// The device with the meanings of the standards.
pub(crate) fn complete(device: &Device) -> Device {
    let mut device = device.clone();
    for standard in STANDARDS {
        if standard.profile == 301 || device.profile == Some(standard.profile) {
            standard.apply(&mut device);
        }
    }
    device
}

impl Standard {
    fn apply(&self, device: &mut Device) {
        // The overlay may use the name for something else.
        let known = device.enumerations.contains_key(self.name)
            || device.bit_fields.contains_key(self.name)
            || device.quantities.contains_key(self.name);
        let name = if known && !self.is_defined(device) { format!("{} standard", self.name) } else { self.name.into() };
        let entries =
            device.objects.iter_mut().filter(|object| object.index == self.index).flat_map(|o| &mut o.entries);
        let mut span = None;
        for entry in entries.filter(|entry| (entry.sub > 0) == self.elements) {
            if entry.data_type == self.data_type && entry.meaning == Meaning::Plain {
                entry.meaning = match self.kind {
                    Kind::Values(_) => Meaning::Enumeration(name.clone()),
                    Kind::Bits(_) => Meaning::BitField(name.clone()),
                };
                span.get_or_insert(entry.span);
            }
        }
        if let Some(span) = span {
            self.define(device, name, span);
        }
    }

    /// Whether another index of this table has brought the same meaning already.
    fn is_defined(&self, device: &Device) -> bool {
        let described = |description: &Option<String>| description.as_deref() == Some(self.description);
        device.enumerations.get(self.name).is_some_and(|enumeration| described(&enumeration.description))
            || device.bit_fields.get(self.name).is_some_and(|field| described(&field.description))
    }

    fn define(&self, device: &mut Device, name: String, span: Span) {
        fn named<T>(name: &str, value: T) -> Named<T> {
            Named { name: name.into(), description: None, value }
        }
        let description = Some(self.description.to_owned());
        match self.kind {
            Kind::Values(values) => {
                let values = values.iter().map(|&(value, name)| named(name, value)).collect();
                device.enumerations.insert(name, Enumeration { description, values, span });
            }
            Kind::Bits(fields) => {
                let fields = fields.iter().map(|&(low, high, name)| named(name, Bits { low, high })).collect();
                device.bit_fields.insert(name, BitField { description, fields, span });
            }
        }
    }
}

const STANDARDS: &[Standard] = &[
    Standard {
        profile: 301,
        index: 0x1001,
        elements: false,
        data_type: DataType::Unsigned8,
        name: "Error register",
        description: "Which kinds of error are present (CiA 301, 7.5.2.2).",
        kind: Kind::Bits(&[
            (0, 0, "generic error"),
            (1, 1, "current"),
            (2, 2, "voltage"),
            (3, 3, "temperature"),
            (4, 4, "communication error"),
            (5, 5, "device profile specific"),
            (7, 7, "manufacturer specific"),
        ]),
    },
    Standard {
        profile: 301,
        index: 0x1029,
        elements: true,
        data_type: DataType::Unsigned8,
        name: "Error behaviour",
        description: "Which NMT state a device goes to by itself in an error (CiA 301).",
        kind: Kind::Values(&[(0, "pre-operational"), (1, "no change"), (2, "stopped")]),
    },
    Standard {
        profile: 402,
        index: 0x6040,
        elements: false,
        data_type: DataType::Unsigned16,
        name: "Controlword",
        description: "Commands to the drive (CiA 402).",
        kind: Kind::Bits(&[
            (0, 0, "switch on"),
            (1, 1, "enable voltage"),
            (2, 2, "quick stop"),
            (3, 3, "enable operation"),
            (4, 6, "operation mode specific"),
            (7, 7, "fault reset"),
            (8, 8, "halt"),
            (9, 9, "operation mode specific 9"),
            (11, 15, "manufacturer specific"),
        ]),
    },
    Standard {
        profile: 402,
        index: 0x6041,
        elements: false,
        data_type: DataType::Unsigned16,
        name: "Statusword",
        description: "The state of the drive (CiA 402).",
        kind: Kind::Bits(&[
            (0, 0, "ready to switch on"),
            (1, 1, "switched on"),
            (2, 2, "operation enabled"),
            (3, 3, "fault"),
            (4, 4, "voltage enabled"),
            (5, 5, "quick stop"),
            (6, 6, "switch on disabled"),
            (7, 7, "warning"),
            (8, 8, "manufacturer specific"),
            (9, 9, "remote"),
            (10, 10, "target reached"),
            (11, 11, "internal limit active"),
            (12, 13, "operation mode specific"),
            (14, 15, "manufacturer specific 14"),
        ]),
    },
    Standard { index: 0x6060, ..MODE },
    Standard { index: 0x6061, ..MODE },
    Standard {
        profile: 402,
        index: 0x605A,
        elements: false,
        data_type: DataType::Integer16,
        name: "Quick stop option",
        description: "How the drive stops in a quick stop, and where it stays (CiA 402).",
        kind: Kind::Values(&[
            (0, "disable drive function"),
            (1, "slow down ramp"),
            (2, "quick stop ramp"),
            (3, "current limit"),
            (4, "voltage limit"),
            (5, "slow down ramp and stay"),
            (6, "quick stop ramp and stay"),
            (7, "current limit and stay"),
            (8, "voltage limit and stay"),
        ]),
    },
    Standard {
        profile: 402,
        index: 0x605B,
        elements: false,
        data_type: DataType::Integer16,
        name: "Shutdown option",
        description: "What the drive does when operation enabled is left for ready to switch on (CiA 402).",
        kind: Kind::Values(RAMP_OR_NOT),
    },
    Standard {
        profile: 402,
        index: 0x605C,
        elements: false,
        data_type: DataType::Integer16,
        name: "Disable operation option",
        description: "What the drive does when operation enabled is left for switched on (CiA 402).",
        kind: Kind::Values(RAMP_OR_NOT),
    },
    Standard {
        profile: 402,
        index: 0x605D,
        elements: false,
        data_type: DataType::Integer16,
        name: "Halt option",
        description: "How the drive stops for bit 8 of the control word (CiA 402).",
        kind: Kind::Values(&[
            (1, "slow down ramp"),
            (2, "quick stop ramp"),
            (3, "current limit"),
            (4, "voltage limit"),
        ]),
    },
    Standard {
        profile: 402,
        index: 0x605E,
        elements: false,
        data_type: DataType::Integer16,
        name: "Fault reaction option",
        description: "How the drive stops for a fault (CiA 402).",
        kind: Kind::Values(&[
            (0, "disable drive function"),
            (1, "slow down ramp"),
            (2, "quick stop ramp"),
            (3, "current limit"),
            (4, "voltage limit"),
        ]),
    },
    Standard {
        profile: 402,
        index: 0x6502,
        elements: false,
        data_type: DataType::Unsigned32,
        name: "Supported drive modes",
        description: "Which modes of operation the drive has (CiA 402).",
        kind: Kind::Bits(&[
            (0, 0, "profile position"),
            (1, 1, "velocity"),
            (2, 2, "profile velocity"),
            (3, 3, "torque profile"),
            (5, 5, "homing"),
            (6, 6, "interpolated position"),
            (7, 7, "cyclic synchronous position"),
            (8, 8, "cyclic synchronous velocity"),
            (9, 9, "cyclic synchronous torque"),
            (16, 31, "manufacturer specific"),
        ]),
    },
];

const MODE: Standard = Standard {
    profile: 402,
    index: 0,
    elements: false,
    data_type: DataType::Integer8,
    name: "Mode of operation",
    description: "What the drive controls; negative values are the manufacturer's (CiA 402).",
    kind: Kind::Values(&[
        (0, "none"),
        (1, "profile position"),
        (2, "velocity"),
        (3, "profile velocity"),
        (4, "torque profile"),
        (6, "homing"),
        (7, "interpolated position"),
        (8, "cyclic synchronous position"),
        (9, "cyclic synchronous velocity"),
        (10, "cyclic synchronous torque"),
    ]),
};

const RAMP_OR_NOT: &[(i128, &str)] = &[(0, "disable drive function"), (1, "slow down ramp")];
