//! A new data sheet to begin with: the mandatory objects of CiA 301, those of a device profile, and PDOs that map them.

use crate::model::types::DataType;
use crate::model::{AccessType, Device, DeviceInfo, Direction, Entry, FileInfo, Object, ObjectKind, ObjectList, Value};
use crate::text::Span;
use lexican_cia::cia301;

/// The contents of a new data sheet.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Template {
    pub file_name: String,
    pub vendor_name: String,
    /// The vendor-ID that CiA has given them.
    pub vendor_number: u32,
    /// Also the value of 1008h.
    pub product_name: String,
    /// The product code.
    pub product_number: u32,
    /// The revision number: major in the higher 16 bits, minor in the lower.
    pub revision_number: u32,
    pub profile: Profile,
    /// How many PDOs it receives: up to 512.
    pub receive_pdos: u16,
    /// How many PDOs it transmits: up to 512.
    pub transmit_pdos: u16,
}

/// The kind of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// CiA 301 only; its PDOs map nothing yet.
    Cia301,
    /// CiA 401: inputs and outputs of two bytes and four words each.
    Cia401,
    /// CiA 402: a servo drive with profile position, profile velocity, homing and cyclic synchronous modes.
    Cia402,
}

impl Template {
    #[must_use]
    /// Makes the device, to be written with [`write::eds`](crate::write::eds).
    pub fn device(&self) -> Device {
        let info = DeviceInfo {
            vendor_name: Some(self.vendor_name.clone()),
            vendor_number: Some(self.vendor_number),
            product_name: Some(self.product_name.clone()),
            product_number: Some(self.product_number),
            revision_number: Some(self.revision_number),
            bit_rates_kbit: vec![125, 250, 500, 1000],
            simple_boot_up_slave: true,
            granularity: Some(8),
            receive_pdos: Some(self.receive_pdos),
            transmit_pdos: Some(self.transmit_pdos),
            lss: true,
            ..DeviceInfo::default()
        };
        let file = FileInfo {
            name: Some(self.file_name.clone()),
            version: Some(1),
            revision: Some(0),
            eds_version: Some("4.0".to_owned()),
            description: Some(format!("Data sheet of {}", self.product_name)),
            ..FileInfo::default()
        };
        let mut objects = self.communication();
        objects.extend(match self.profile {
            Profile::Cia301 => Vec::new(),
            Profile::Cia401 => inputs_and_outputs(),
            Profile::Cia402 => drive(),
        });
        for (direction, count) in [(Direction::Receive, self.receive_pdos), (Direction::Transmit, self.transmit_pdos)] {
            let mappings = self.profile.mappings(direction);
            for number in 1..=count.min(512) {
                let mapped = mappings.get(usize::from(number) - 1).copied().unwrap_or_default();
                objects.extend(pdo(direction, number, mapped));
            }
        }
        objects.sort_by_key(|object| object.index);
        Device { file, info, dummies: DUMMIES.to_vec(), objects, ..Device::default() }
    }

    fn communication(&self) -> Vec<Object> {
        use AccessType::{Const, Ro, Rw};
        use DataType as D;
        let number = |number: u32| Value::Integer(number.into());
        let unsigned = |name, access, value: u32| field(name, D::Unsigned32, access, value.into());
        vec![
            variable(cia301::DEVICE_TYPE, unsigned("Device type", Ro, self.profile.device_type())),
            variable(cia301::ERROR_REGISTER, mappable(field("Error register", D::Unsigned8, Ro, 0))),
            with_count(
                list(
                    cia301::PREDEFINED_ERROR_FIELD,
                    ObjectKind::Array,
                    "Pre-defined error field",
                    vec![unsigned("Standard error field", Ro, 0)],
                ),
                Rw,
                0,
            ),
            variable(cia301::COB_ID_SYNC, unsigned("COB-ID SYNC message", Rw, 0x80)),
            variable(
                cia301::MANUFACTURER_DEVICE_NAME,
                Entry {
                    default: Some(Value::Text(self.product_name.clone())),
                    ..field("Manufacturer device name", D::VisibleString, Const, 0)
                },
            ),
            variable(
                cia301::COB_ID_EMCY,
                Entry {
                    default: Some(Value::NodeIdPlus(cia301::connection::EMCY.into())),
                    ..unsigned("COB-ID emergency message", Rw, 0)
                },
            ),
            variable(cia301::PRODUCER_HEARTBEAT_TIME, field("Producer heartbeat time", D::Unsigned16, Rw, 0)),
            list(
                cia301::IDENTITY,
                ObjectKind::Record,
                "Identity object",
                vec![
                    Entry { default: Some(number(self.vendor_number)), ..unsigned("Vendor-ID", Ro, 0) },
                    Entry { default: Some(number(self.product_number)), ..unsigned("Product code", Ro, 0) },
                    Entry { default: Some(number(self.revision_number)), ..unsigned("Revision number", Ro, 0) },
                    unsigned("Serial number", Ro, 0),
                ],
            ),
        ]
    }
}

/// Data types with which receive PDOs may leave gaps.
const DUMMIES: [DataType; 6] = [
    DataType::Integer8,
    DataType::Integer16,
    DataType::Integer32,
    DataType::Unsigned8,
    DataType::Unsigned16,
    DataType::Unsigned32,
];

/// Entries of a mapping parameter: index, sub-index and length.
type Mapping = &'static [u32];

impl Profile {
    /// 1000h: the number of the profile, and the supported functions.
    fn device_type(self) -> u32 {
        match self {
            Self::Cia301 => 0,
            // Digital and analogue inputs and outputs.
            Self::Cia401 => 0x000F_0191,
            // A servo drive.
            Self::Cia402 => 0x0002_0192,
        }
    }

    /// The mappings of the first PDOs by the profile.
    fn mappings(self, direction: Direction) -> &'static [Mapping] {
        match (self, direction) {
            (Self::Cia301, _) => &[],
            (Self::Cia401, Direction::Receive) => {
                &[&[0x6200_0108, 0x6200_0208], &[0x6411_0110, 0x6411_0210, 0x6411_0310, 0x6411_0410]]
            }
            (Self::Cia401, Direction::Transmit) => {
                &[&[0x6000_0108, 0x6000_0208], &[0x6401_0110, 0x6401_0210, 0x6401_0310, 0x6401_0410]]
            }
            (Self::Cia402, Direction::Receive) => {
                &[&[0x6040_0010], &[0x6040_0010, 0x6060_0008], &[0x6040_0010, 0x607A_0020], &[0x6040_0010, 0x60FF_0020]]
            }
            (Self::Cia402, Direction::Transmit) => {
                &[&[0x6041_0010], &[0x6041_0010, 0x6061_0008], &[0x6041_0010, 0x6064_0020], &[0x6041_0010, 0x606C_0020]]
            }
        }
    }
}

/// CiA 401.
fn inputs_and_outputs() -> Vec<Object> {
    use DataType as D;
    let each = |count: u8, name: &dyn Fn(u8) -> String, data_type, access| {
        let fields = (0..count).map(|at| mappable(field(&name(at), data_type, access, 0)));
        fields.collect::<Vec<_>>()
    };
    let bytes = |what: &'static str| move |at: u8| format!("{what} {} to {}", 8 * at + 1, 8 * at + 8);
    let words = |what: &'static str| move |at: u8| format!("{what} {}", at + 1);
    let array = |index, name, fields| list(index, ObjectKind::Array, name, fields);
    vec![
        array(0x6000, "Read input 8-bit", each(2, &bytes("Inputs"), D::Unsigned8, AccessType::Ro)),
        array(0x6200, "Write output 8-bit", each(2, &bytes("Outputs"), D::Unsigned8, AccessType::Rww)),
        array(0x6401, "Read analogue input 16-bit", each(4, &words("Analogue input"), D::Integer16, AccessType::Ro)),
        array(
            0x6411,
            "Write analogue output 16-bit",
            each(4, &words("Analogue output"), D::Integer16, AccessType::Rww),
        ),
        variable(0x6423, field("Analogue input global interrupt enable", D::Boolean, AccessType::Rw, 0)),
    ]
}

/// CiA 402-2: profile position, profile velocity, homing, cyclic synchronous position and velocity.
fn drive() -> Vec<Object> {
    use AccessType::{Ro, Rw, Rww};
    use DataType as D;
    let parameter = |index, name, data_type, value| variable(index, field(name, data_type, Rw, value));
    let actual = |index, name, data_type| variable(index, mappable(field(name, data_type, Ro, 0)));
    let target = |index, name, data_type| variable(index, mappable(field(name, data_type, Rww, 0)));
    let several = |index, name, fields| list(index, ObjectKind::Array, name, fields);
    vec![
        actual(0x603F, "Error code", D::Unsigned16),
        target(0x6040, "Controlword", D::Unsigned16),
        actual(0x6041, "Statusword", D::Unsigned16),
        parameter(0x605A, "Quick stop option code", D::Integer16, 2),
        parameter(0x605D, "Halt option code", D::Integer16, 1),
        target(0x6060, "Modes of operation", D::Integer8),
        actual(0x6061, "Modes of operation display", D::Integer8),
        actual(0x6064, "Position actual value", D::Integer32),
        parameter(0x6067, "Position window", D::Unsigned32, 10),
        parameter(0x6068, "Position window time", D::Unsigned16, 10),
        actual(0x606C, "Velocity actual value", D::Integer32),
        target(0x607A, "Target position", D::Integer32),
        parameter(0x607C, "Home offset", D::Integer32, 0),
        several(
            0x607D,
            "Software position limit",
            vec![
                field("Min position limit", D::Integer32, Rw, i32::MIN.into()),
                field("Max position limit", D::Integer32, Rw, i32::MAX.into()),
            ],
        ),
        parameter(0x607F, "Max profile velocity", D::Unsigned32, 1_000_000),
        parameter(0x6081, "Profile velocity", D::Unsigned32, 10_000),
        parameter(0x6083, "Profile acceleration", D::Unsigned32, 100_000),
        parameter(0x6084, "Profile deceleration", D::Unsigned32, 100_000),
        parameter(0x6085, "Quick stop deceleration", D::Unsigned32, 1_000_000),
        parameter(0x6098, "Homing method", D::Integer8, 37),
        several(
            0x6099,
            "Homing speeds",
            vec![
                field("Speed during search for switch", D::Unsigned32, Rw, 1_000),
                field("Speed during search for zero", D::Unsigned32, Rw, 100),
            ],
        ),
        parameter(0x609A, "Homing acceleration", D::Unsigned32, 100_000),
        list(
            0x60C2,
            ObjectKind::Record,
            "Interpolation time period",
            vec![
                field("Interpolation time period value", D::Unsigned8, Rw, 1),
                field("Interpolation time index", D::Integer8, Rw, -3),
            ],
        ),
        target(0x60FF, "Target velocity", D::Integer32),
        variable(0x6502, field("Supported drive modes", D::Unsigned32, Ro, 0x1A5)),
    ]
}

/// The communication and the mapping parameter of a PDO, disabled if it is not in the predefined connection set.
fn pdo(direction: Direction, number: u16, mapping: Mapping) -> [Object; 2] {
    use DataType as D;
    let name = if direction == Direction::Receive { "RPDO" } else { "TPDO" };
    let cob_id = match direction.predefined_cob_id(number) {
        Some(id) => Value::NodeIdPlus(id.into()),
        None => Value::Integer(cia301::INVALID.into()),
    };
    let parameter = |name: &str, data_type, value| field(name, data_type, AccessType::Rw, value);
    let mut fields = vec![
        Entry { default: Some(cob_id), ..parameter("COB-ID", D::Unsigned32, 0) },
        parameter("Transmission type", D::Unsigned8, 255),
    ];
    if direction == Direction::Transmit {
        fields.push(parameter("Inhibit time", D::Unsigned16, 0));
        // Sub-index 4 is reserved.
        fields.push(Entry { sub: 5, ..parameter("Event timer", D::Unsigned16, 0) });
    }
    let communication = direction.communication_parameter(number);
    let words = (0..8).map(|at| {
        let word = mapping.get(at).copied().unwrap_or(0);
        parameter(&format!("Mapped object {}", at + 1), D::Unsigned32, word.into())
    });
    let words = list(
        direction.mapping_parameter(number),
        ObjectKind::Record,
        &format!("{name} {number} mapping parameter"),
        words.collect(),
    );
    [
        list(communication, ObjectKind::Record, &format!("{name} {number} communication parameter"), fields),
        with_count(words, AccessType::Rw, mapping.len() as u8),
    ]
}

fn field(name: &str, data_type: DataType, access: AccessType, value: i128) -> Entry {
    let default = Some(Value::Integer(value));
    Entry { name: name.to_owned(), data_type, access, default, ..Entry::new(0, 0, Span::default()) }
}

fn mappable(entry: Entry) -> Entry {
    Entry { pdo_mapping: true, ..entry }
}

fn variable(index: u16, entry: Entry) -> Object {
    object(index, ObjectKind::Variable, &entry.name.clone(), vec![entry])
}

/// An ARRAY or RECORD with these entries from sub-index 1 on; sub-index 0 is the highest sub-index.
fn list(index: u16, kind: ObjectKind, name: &str, fields: Vec<Entry>) -> Object {
    let fields = fields.into_iter().zip(1..).map(|(entry, sub)| Entry { sub: entry.sub.max(sub), ..entry });
    let fields: Vec<Entry> = fields.collect();
    let highest = fields.last().map_or(0, |entry| entry.sub);
    let count = field("Highest sub-index supported", DataType::Unsigned8, AccessType::Const, highest.into());
    object(index, kind, name, [vec![count], fields].concat())
}

/// The same with the number of entries in use in sub-index 0.
fn with_count(mut object: Object, access: AccessType, count: u8) -> Object {
    object.entries[0] = Entry {
        name: "Number of entries".to_owned(),
        access,
        default: Some(Value::Integer(count.into())),
        ..object.entries[0].clone()
    };
    object
}

fn object(index: u16, kind: ObjectKind, name: &str, entries: Vec<Entry>) -> Object {
    let entries = entries.into_iter().map(|entry| Entry { index, ..entry }).collect();
    Object {
        name: name.to_owned(),
        list: ObjectList::of_index(index),
        entries,
        ..Object::new(index, kind, Span::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, Source, load, write};

    #[test]
    fn nothing_is_found_in_a_new_data_sheet() {
        for profile in [Profile::Cia301, Profile::Cia401, Profile::Cia402] {
            for (receive_pdos, transmit_pdos) in [(0, 0), (1, 0), (4, 4), (6, 9), (512, 512)] {
                let template = Template {
                    file_name: "valve.eds".to_owned(),
                    vendor_name: "Nobody".to_owned(),
                    vendor_number: 0x1234,
                    product_name: "Valve".to_owned(),
                    product_number: 7,
                    revision_number: 0x1_0000,
                    profile,
                    receive_pdos,
                    transmit_pdos,
                };
                let device = template.device();
                let input = Input::new(Source::new("valve.eds", write::eds(&device)));
                let (mut read, findings) = load(&input);
                assert!(findings.is_empty(), "{}", findings.render(&input));
                read.clear_spans();
                assert_eq!(read.objects, device.objects);
                let pdos = usize::from(receive_pdos + transmit_pdos);
                let number = Some(profile.device_type() as u16).filter(|&number| number > 0);
                assert_eq!((read.pdos.len(), read.profile), (pdos, number));
            }
        }
    }
}
