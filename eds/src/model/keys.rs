//! The keys of a data sheet, as CiA 306-1 spells them.

/// The keys of an object or a sub-index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    ParameterName,
    ObjectType,
    DataType,
    AccessType,
    PdoMapping,
    DefaultValue,
    LowLimit,
    HighLimit,
    SubNumber,
    CompactSubObj,
    ObjFlags,
    ParameterValue,
    Denotation,
    UploadFile,
    DownloadFile,
    ParamRefd,
    SrdoMapping,
    InvertedSrad,
}

/// The spellings, in the order of [`Key`].
pub(crate) const KEYS: [&str; 18] = [
    "ParameterName",
    "ObjectType",
    "DataType",
    "AccessType",
    "PDOMapping",
    "DefaultValue",
    "LowLimit",
    "HighLimit",
    "SubNumber",
    "CompactSubObj",
    "ObjFlags",
    "ParameterValue",
    "Denotation",
    "UploadFile",
    "DownloadFile",
    "ParamRefd",
    "SRDOMapping",
    "InvertedSRAD",
];

impl Key {
    /// As CiA 306 spells it.
    pub(crate) fn name(self) -> &'static str {
        KEYS[self as usize]
    }

    /// The key of this name, as CiA 306 spells it; the word may be in upper or lower case.
    pub(crate) fn of(word: &str) -> Option<&'static str> {
        KEYS.into_iter().find(|key| key.eq_ignore_ascii_case(word))
    }
}

/// The bit rates of CiA 301 in kbit/s, in the order of [`DEVICE_INFO`]'s keys.
pub(crate) const BIT_RATES_KBIT: [u16; 9] = [10, 20, 50, 100, 125, 250, 500, 800, 1000];

pub(crate) const FILE_INFO: [&str; 12] = [
    "FileName",
    "FileVersion",
    "FileRevision",
    "EDSVersion",
    "Description",
    "CreationTime",
    "CreationDate",
    "CreatedBy",
    "ModificationTime",
    "ModificationDate",
    "ModifiedBy",
    "LastEDS",
];

/// The keys of `[DeviceInfo]`. The last nine have no effect: CiA 306-1 reserves six of them for older versions, and the
/// three of node guarding are those of CiA 311, as CANopenEditor writes them.
pub(crate) const DEVICE_INFO: [&str; 34] = [
    "VendorName",
    "VendorNumber",
    "ProductName",
    "ProductNumber",
    "RevisionNumber",
    "OrderCode",
    "BaudRate_10",
    "BaudRate_20",
    "BaudRate_50",
    "BaudRate_100",
    "BaudRate_125",
    "BaudRate_250",
    "BaudRate_500",
    "BaudRate_800",
    "BaudRate_1000",
    "SimpleBootUpMaster",
    "SimpleBootUpSlave",
    "Granularity",
    "DynamicChannelsSupported",
    "GroupMessaging",
    "NrOfRXPDO",
    "NrOfTXPDO",
    "LSS_Supported",
    "CompactPDO",
    "CANopenSafetySupported",
    "ProductVersion",
    "ProductRevision",
    "LMT_ManufacturerName",
    "LMT_ProductName",
    "ExtendedBootUpMaster",
    "ExtendedBootUpSlave",
    "NG_Slave",
    "NG_Master",
    "NrOfNG_MonitoredNodes",
];

pub(crate) const COMMISSIONING: [&str; 9] = [
    "NodeID",
    "NodeName",
    "NodeRefd",
    "Baudrate",
    "NetNumber",
    "NetworkName",
    "NetRefd",
    "CANopenManager",
    "LSS_SerialNumber",
];
