//! XDD, XDC and XPD (CiA 311, 1.0 and 1.1): data sheets in XML.
//!
//! Read, such a file is translated to the sections and keys of CiA 306, each with its place in the XML; all behind that (model,
//! overlays, rules) is the same as for an EDS, and the places are taken back. What XML alone can say, such as units
//! and enumerations, comes into the model where an overlay puts it.
//!
//! Changed, it stays byte for byte what it was, but for what a key is said by.
//!
//! Written, what XML has no word for (revision number, comments, tools, modules) is a list of characteristics whose category is the name of
//! a section in brackets, as `[DeviceInfo]`; so nothing that CiA 306 can say is lost on the way there and back.

mod document;
mod edit;
mod layout;
mod object;
mod read;
mod sheet;
mod write;
mod xml;

pub use crate::parse::is_xml;
pub(crate) use edit::{in_words, set};
pub(crate) use layout::normalise;
pub(crate) use read::translate;
pub(crate) use sheet::Sheet;
pub use write::{xdc, xdd};

use crate::model::AccessType;
use crate::model::types::DataType;

/// The namespaces of CiA 311; some tools write none.
const NAMESPACES: [&str; 2] = ["http://www.canopen.org/xml/1.0", "http://www.canopen.org/xml/1.1"];

/// `access` of a parameter. An input of the process goes into a transmit PDO.
const ACCESS: [(&str, AccessType); 6] = [
    ("const", AccessType::Const),
    ("read", AccessType::Ro),
    ("write", AccessType::Wo),
    ("readWrite", AccessType::Rw),
    ("readWriteInput", AccessType::Rwr),
    ("readWriteOutput", AccessType::Rww),
];

fn access_word(access: AccessType) -> &'static str {
    ACCESS.iter().find(|(_, of)| *of == access).map_or("read", |(word, _)| word)
}

/// `PDOmapping` of an object that may be mapped: the only PDO that its access allows, or either.
fn pdo_mapping(access: AccessType) -> &'static str {
    match access {
        AccessType::Rwr => "TPDO",
        AccessType::Rww => "RPDO",
        _ => "optional",
    }
}

/// The elementary types of IEC 61131-3; of several for one data type, the first is written.
const TYPES: [(&str, DataType); 18] = [
    ("BOOL", DataType::Boolean),
    ("SINT", DataType::Integer8),
    ("INT", DataType::Integer16),
    ("DINT", DataType::Integer32),
    ("LINT", DataType::Integer64),
    ("USINT", DataType::Unsigned8),
    ("UINT", DataType::Unsigned16),
    ("UDINT", DataType::Unsigned32),
    ("ULINT", DataType::Unsigned64),
    ("REAL", DataType::Real32),
    ("LREAL", DataType::Real64),
    ("STRING", DataType::VisibleString),
    ("WSTRING", DataType::UnicodeString),
    ("CHAR", DataType::Integer8),
    ("BYTE", DataType::Unsigned8),
    ("WORD", DataType::Unsigned16),
    ("DWORD", DataType::Unsigned32),
    ("LWORD", DataType::Unsigned64),
];

/// What every other data type is in XML; the attribute `dataType` of the object says which it is.
const BITSTRING: &str = "BITSTRING";

/// Elements of `DeviceIdentity`, and keys of `[DeviceInfo]`.
const IDENTITY: [(&str, &str); 5] = [
    ("vendorName", "VendorName"),
    ("vendorID", "VendorNumber"),
    ("productName", "ProductName"),
    ("productID", "ProductNumber"),
    ("orderNumber", "OrderCode"),
];

/// Attributes of `CANopenGeneralFeatures` and keys of `[DeviceInfo]`, with the default of the schema.
const FEATURES: [(&str, &str, Option<&str>); 7] = [
    ("granularity", "Granularity", None),
    ("nrOfRxPDO", "NrOfRXPDO", Some("0")),
    ("nrOfTxPDO", "NrOfTXPDO", Some("0")),
    ("groupMessaging", "GroupMessaging", Some("false")),
    ("dynamicChannels", "DynamicChannelsSupported", Some("0")),
    ("bootUpSlave", "SimpleBootUpSlave", Some("false")),
    ("layerSettingServiceSlave", "LSS_Supported", Some("false")),
];

/// Attributes of a `ProfileBody`, and keys of `[FileInfo]`.
const FILE: [(&str, &str); 8] = [
    ("fileName", "FileName"),
    ("fileVersion", "FileVersion"),
    ("fileCreator", "CreatedBy"),
    ("fileCreationDate", "CreationDate"),
    ("fileCreationTime", "CreationTime"),
    ("fileModifiedBy", "ModifiedBy"),
    ("fileModificationDate", "ModificationDate"),
    ("fileModificationTime", "ModificationTime"),
];

/// Attributes of `deviceCommissioning`, and keys of `[DeviceComissioning]`.
const COMMISSIONING: [(&str, &str); 6] = [
    ("NodeID", "NodeID"),
    ("nodeName", "NodeName"),
    ("actualBaudRate", "Baudrate"),
    ("networkNumber", "NetNumber"),
    ("networkName", "NetworkName"),
    ("CANopenManager", "CANopenManager"),
];
