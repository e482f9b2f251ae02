//! The sections of a data sheet about the file and the device as a whole.

/// `[FileInfo]` (CiA 306-1, 6.3).
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct FileInfo {
    pub name: Option<String>,
    pub version: Option<u8>,
    pub revision: Option<u8>,
    /// `EDSVersion`.
    pub eds_version: Option<String>,
    pub description: Option<String>,
    /// `CreationTime`, as written.
    pub creation_time: Option<String>,
    /// `CreationDate`, as written.
    pub creation_date: Option<String>,
    pub created_by: Option<String>,
    /// `ModificationTime`, as written.
    pub modification_time: Option<String>,
    /// `ModificationDate`, as written.
    pub modification_date: Option<String>,
    /// `ModifiedBy`.
    pub modified_by: Option<String>,
    /// `LastEDS` of a DCF: the data sheet it was made from.
    pub last_eds: Option<String>,
}

/// `[DeviceInfo]` (CiA 306-1, 6.4).
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct DeviceInfo {
    pub vendor_name: Option<String>,
    pub vendor_number: Option<u32>,
    pub product_name: Option<String>,
    pub product_number: Option<u32>,
    pub revision_number: Option<u32>,
    pub order_code: Option<String>,
    /// The bit rates in kbit/s whose `BaudRate_*` is 1, ascending.
    pub bit_rates_kbit: Vec<u16>,
    pub simple_boot_up_master: bool,
    pub simple_boot_up_slave: bool,
    /// `Granularity`: the smallest size in bits that a PDO maps.
    pub granularity: Option<u8>,
    /// `DynamicChannelsSupported`.
    pub dynamic_channels: bool,
    pub group_messaging: bool,
    /// `NrOfRXPDO`.
    pub receive_pdos: Option<u16>,
    /// `NrOfTXPDO`.
    pub transmit_pdos: Option<u16>,
    /// `LSS_Supported`.
    pub lss: bool,
    /// `CompactPDO`: which PDO parameters the data sheet leaves out because they can be computed.
    pub compact_pdo: u32,
    /// `CANopenSafetySupported`.
    pub safety: bool,
    /// The values of keys that CiA 306-1 reserves or that tools have in common. They are kept, but nothing depends on
    /// them.
    pub reserved: Vec<(&'static str, String)>,
}

/// A program for the device (`[Tools]`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tool {
    /// `Name`.
    pub name: String,
    /// `Command`.
    pub command: String,
}

/// `[DeviceComissioning]` of a DCF (CiA 306-1, 7).
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Commissioning {
    pub node_id: Option<u8>,
    pub node_name: Option<String>,
    /// `NodeRefd`: the reference designator of the node.
    pub node_designator: Option<String>,
    /// `Baudrate` in kbit/s.
    pub bit_rate_kbit: Option<u16>,
    pub net_number: Option<u32>,
    pub network_name: Option<String>,
    /// `NetRefd`: the reference designator of the network.
    pub network_designator: Option<String>,
    /// `CANopenManager`.
    pub manager: Option<bool>,
    /// `LSS_SerialNumber`.
    pub serial_number: Option<u32>,
}
