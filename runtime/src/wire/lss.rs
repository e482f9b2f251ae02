//! LSS: assigning node-IDs and bit rates to devices by their identity (CiA 305).

use crate::frame::Frame;
use crate::id::{CobId, NodeId};

/// The unique identity of a device: object 1018h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// 1018h:01.
    pub vendor: u32,
    /// 1018h:02.
    pub product: u32,
    /// 1018h:03.
    pub revision: u32,
    /// 1018h:04.
    pub serial: u32,
}

/// A part of the identity, in the order of 1018h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Part {
    Vendor,
    Product,
    Revision,
    Serial,
}

impl Part {
    /// All parts, in order.
    pub const ALL: [Part; 4] = [Part::Vendor, Part::Product, Part::Revision, Part::Serial];

    /// 0 to 3.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The name in CiA 301: `vendor-ID`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Part::Vendor => "vendor-ID",
            Part::Product => "product code",
            Part::Revision => "revision number",
            Part::Serial => "serial number",
        }
    }

    /// The part after this one; after the last, the first.
    #[must_use]
    pub const fn next(self) -> Part {
        match self {
            Part::Vendor => Part::Product,
            Part::Product => Part::Revision,
            Part::Revision => Part::Serial,
            Part::Serial => Part::Vendor,
        }
    }

    fn from_number(number: u8) -> Option<Part> {
        Part::ALL.get(usize::from(number)).copied()
    }
}

impl Identity {
    /// The value of a part.
    #[must_use]
    pub const fn part(self, part: Part) -> u32 {
        match part {
            Part::Vendor => self.vendor,
            Part::Product => self.product,
            Part::Revision => self.revision,
            Part::Serial => self.serial,
        }
    }

    /// The same with another value for a part.
    #[must_use]
    pub const fn with(self, part: Part, value: u32) -> Self {
        match part {
            Part::Vendor => Identity { vendor: value, ..self },
            Part::Product => Identity { product: value, ..self },
            Part::Revision => Identity { revision: value, ..self },
            Part::Serial => Identity { serial: value, ..self },
        }
    }
}

/// The LSS state of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LssState {
    /// Waits to be selected.
    Waiting,
    /// Selected, and may be configured.
    Configuration,
}

/// A bound of the range of identities in LSS identify.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Bound {
    /// Vendor-ID, which has to be equal.
    Vendor,
    /// Product code, which has to be equal.
    Product,
    RevisionLow,
    RevisionHigh,
    SerialLow,
    SerialHigh,
}

impl Bound {
    const ALL: [Bound; 6] =
        [Bound::Vendor, Bound::Product, Bound::RevisionLow, Bound::RevisionHigh, Bound::SerialLow, Bound::SerialHigh];
}

/// A request of a manager.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum LssRequest {
    /// All devices enter a state. Not answered.
    SwitchGlobal(LssState),
    /// One part of the identity of the device to select; the serial number is answered.
    SwitchSelective(Part, u32),
    /// Sets the node-ID of the device; `None` removes it.
    ConfigureNode(Option<NodeId>),
    /// Sets the bit rate of the device: entry `index` of `table`.
    ConfigureBitTiming {
        /// 0 is the table in CiA 305.
        table: u8,
        index: u8,
    },
    /// All devices change to their new bit rate after `delay_ms`, and may transmit again after twice that time.
    ActivateBitTiming {
        /// In ms.
        delay_ms: u16,
    },
    /// The device stores node-ID and bit rate.
    Store,
    /// One bound of the identities to search for; the highest serial number is answered.
    Identify(Bound, u32),
    /// Devices without a node-ID answer.
    IdentifyUnconfigured,
    /// Finds a device without node-ID, bit by bit.
    Fastscan {
        /// The bits known so far.
        value: u32,
        /// How many low bits are not compared, 0 to 31; 128 starts anew.
        bits_left: u8,
        part: Part,
        /// The part that comes next if this one matches.
        next: Part,
    },
    /// Asks for a part of the identity.
    Inquire(Part),
    /// Asks for the node-ID.
    InquireNode,
}

/// A response of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LssResponse {
    /// The device was selected by its identity.
    Selected,
    /// [`LssRequest::ConfigureNode`] was done, unless `error` is not 0.
    ConfigureNode {
        /// 1: node-ID out of range; 255: see `specific`.
        error: u8,
        /// The device's own error code.
        specific: u8,
    },
    /// [`LssRequest::ConfigureBitTiming`] was done, unless `error` is not 0.
    ConfigureBitTiming {
        /// 1: bit rate not supported; 255: see `specific`.
        error: u8,
        /// The device's own error code.
        specific: u8,
    },
    /// [`LssRequest::Store`] was done, unless `error` is not 0.
    Store {
        /// 1: not supported; 2: the storage failed; 255: see `specific`.
        error: u8,
        /// The device's own error code.
        specific: u8,
    },
    /// The identity is in the range to search for, or matches the fastscan.
    Identified,
    /// The device has no node-ID.
    Unconfigured,
    /// A part of the identity.
    Inquired(Part, u32),
    /// The node-ID; `None` if the device has none.
    InquiredNode(Option<NodeId>),
}

/// The COB-ID of requests.
pub const REQUEST: CobId = lss_id(0x7E5);
/// The COB-ID of responses.
pub const RESPONSE: CobId = lss_id(0x7E4);

const fn lss_id(id: u16) -> CobId {
    match CobId::standard(id) {
        Some(id) => id,
        None => panic!("an LSS identifier has 11 bits"),
    }
}

/// CiA 305, table 1: the bit rates of table 0 in kbit/s, by index. `None` is reserved.
pub const BIT_TIMING_TABLE: [Option<u16>; 9] =
    [Some(1000), Some(800), Some(500), Some(250), Some(125), None, Some(50), Some(20), Some(10)];

/// Stands for no node-ID on the wire.
const NO_NODE: u8 = 0xFF;

impl LssRequest {
    /// `None` if the data are not eight bytes, or the command is unknown or has an impossible parameter.
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let &[command, a, b, c, d, e, f, g] = data else { return None };
        let number = u32::from_le_bytes([a, b, c, d]);
        Some(match command {
            0x04 => LssRequest::SwitchGlobal(match a {
                0 => LssState::Waiting,
                1 => LssState::Configuration,
                _ => return None,
            }),
            0x11 if a == NO_NODE => LssRequest::ConfigureNode(None),
            0x11 => LssRequest::ConfigureNode(Some(NodeId::new(a)?)),
            0x13 => LssRequest::ConfigureBitTiming { table: a, index: b },
            0x15 => LssRequest::ActivateBitTiming { delay_ms: u16::from_le_bytes([a, b]) },
            0x17 => LssRequest::Store,
            0x40..=0x43 => LssRequest::SwitchSelective(Part::from_number(command - 0x40)?, number),
            0x46..=0x4B => LssRequest::Identify(*Bound::ALL.get(usize::from(command - 0x46))?, number),
            0x4C => LssRequest::IdentifyUnconfigured,
            0x51 if e < 32 || e == 0x80 => LssRequest::Fastscan {
                value: number,
                bits_left: e,
                part: Part::from_number(f)?,
                next: Part::from_number(g)?,
            },
            0x5A..=0x5D => LssRequest::Inquire(Part::from_number(command - 0x5A)?),
            0x5E => LssRequest::InquireNode,
            _ => return None,
        })
    }

    /// The data on the wire.
    #[must_use]
    pub const fn emit(self) -> [u8; 8] {
        match self {
            LssRequest::SwitchGlobal(state) => bytes(0x04, state as u32),
            LssRequest::SwitchSelective(part, value) => bytes(0x40 + part.number(), value),
            LssRequest::ConfigureNode(node) => bytes(0x11, node_byte(node) as u32),
            LssRequest::ConfigureBitTiming { table, index } => bytes(0x13, table as u32 | (index as u32) << 8),
            LssRequest::ActivateBitTiming { delay_ms } => bytes(0x15, delay_ms as u32),
            LssRequest::Store => bytes(0x17, 0),
            LssRequest::Identify(bound, value) => bytes(0x46 + bound as u8, value),
            LssRequest::IdentifyUnconfigured => bytes(0x4C, 0),
            LssRequest::Fastscan { value, bits_left, part, next } => {
                let [command, a, b, c, d, ..] = bytes(0x51, value);
                [command, a, b, c, d, bits_left, part.number(), next.number()]
            }
            LssRequest::Inquire(part) => bytes(0x5A + part.number(), 0),
            LssRequest::InquireNode => bytes(0x5E, 0),
        }
    }

    /// The whole frame.
    #[must_use]
    pub const fn frame(self) -> Frame {
        Frame::from_array(REQUEST, self.emit())
    }
}

impl LssResponse {
    /// `None` if the data are not eight bytes, or the command is unknown.
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let &[command, a, b, c, d, ..] = data else { return None };
        if data.len() != 8 {
            return None;
        }
        Some(match command {
            0x11 => LssResponse::ConfigureNode { error: a, specific: b },
            0x13 => LssResponse::ConfigureBitTiming { error: a, specific: b },
            0x17 => LssResponse::Store { error: a, specific: b },
            0x44 => LssResponse::Selected,
            0x4F => LssResponse::Identified,
            0x50 => LssResponse::Unconfigured,
            0x5A..=0x5D => LssResponse::Inquired(Part::from_number(command - 0x5A)?, u32::from_le_bytes([a, b, c, d])),
            0x5E => LssResponse::InquiredNode(NodeId::new(a)),
            _ => return None,
        })
    }

    /// The data on the wire.
    #[must_use]
    pub const fn emit(self) -> [u8; 8] {
        match self {
            LssResponse::ConfigureNode { error, specific } => bytes(0x11, error as u32 | (specific as u32) << 8),
            LssResponse::ConfigureBitTiming { error, specific } => bytes(0x13, error as u32 | (specific as u32) << 8),
            LssResponse::Store { error, specific } => bytes(0x17, error as u32 | (specific as u32) << 8),
            LssResponse::Selected => bytes(0x44, 0),
            LssResponse::Identified => bytes(0x4F, 0),
            LssResponse::Unconfigured => bytes(0x50, 0),
            LssResponse::Inquired(part, value) => bytes(0x5A + part.number(), value),
            LssResponse::InquiredNode(node) => bytes(0x5E, node_byte(node) as u32),
        }
    }

    /// The whole frame.
    #[must_use]
    pub const fn frame(self) -> Frame {
        Frame::from_array(RESPONSE, self.emit())
    }
}

const fn bytes(command: u8, number: u32) -> [u8; 8] {
    let [a, b, c, d] = number.to_le_bytes();
    [command, a, b, c, d, 0, 0, 0]
}

const fn node_byte(node: Option<NodeId>) -> u8 {
    match node {
        Some(node) => node.get(),
        None => NO_NODE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_parsed_is_emitted_and_parsed_again(data: [u8; 8]) {
            // Unused bytes are not kept, but the meaning is.
            for command in 0..=0xFF {
                let mut data = data;
                data[0] = command;
                if let Some(request) = LssRequest::parse(&data) {
                    prop_assert_eq!(LssRequest::parse(&request.emit()), Some(request));
                }
                if let Some(response) = LssResponse::parse(&data) {
                    prop_assert_eq!(LssResponse::parse(&response.emit()), Some(response));
                }
            }
        }
    }

    #[test]
    fn frames_are_those_of_the_standard() {
        let check = |request: LssRequest, frame: &str| assert_eq!(std::format!("{}", request.frame()), frame);
        check(LssRequest::SwitchGlobal(LssState::Configuration), "7E5#0401000000000000");
        check(LssRequest::SwitchSelective(Part::Serial, 0x1234), "7E5#4334120000000000");
        check(LssRequest::ConfigureNode(NodeId::new(5)), "7E5#1105000000000000");
        check(LssRequest::ConfigureNode(None), "7E5#11FF000000000000");
        check(LssRequest::Identify(Bound::SerialHigh, 7), "7E5#4B07000000000000");
        let scan = LssRequest::Fastscan { value: 0x195, bits_left: 31, part: Part::Vendor, next: Part::Product };
        check(scan, "7E5#51950100001F0001");
        assert_eq!(std::format!("{}", LssResponse::InquiredNode(None).frame()), "7E4#5EFF000000000000");
    }

    #[test]
    fn what_is_not_eight_bytes_is_none() {
        for len in (0..8).chain([9]) {
            assert_eq!(LssRequest::parse(&std::vec![0x17; len]), None);
            assert_eq!(LssResponse::parse(&std::vec![0x17; len]), None);
        }
    }
}
