//! The objects of CiA 301's communication profile area (1000h to 1FFFh), and the predefined connection set.
//!
//! Ranges of objects have two names, for the first and for the last one.

use core::ops::Range;

/// The communication profile area.
pub const COMMUNICATION: Range<u16> = 0x1000..0x2000;

/// 1000h: the device profile and its options.
pub const DEVICE_TYPE: u16 = 0x1000;
/// 1001h: the error register.
pub const ERROR_REGISTER: u16 = 0x1001;
/// 1002h: a manufacturer-specific status word.
pub const MANUFACTURER_STATUS_REGISTER: u16 = 0x1002;
/// 1003h: the history of errors.
pub const PREDEFINED_ERROR_FIELD: u16 = 0x1003;
/// 1005h: the COB-ID of SYNC; bit 30 if the device produces it.
pub const COB_ID_SYNC: u16 = 0x1005;
/// 1006h: the period of SYNC, in µs.
pub const COMMUNICATION_CYCLE_PERIOD: u16 = 0x1006;
/// 1007h: how long after SYNC synchronous PDOs may be sent, in µs.
pub const SYNCHRONOUS_WINDOW_LENGTH: u16 = 0x1007;
/// 1008h: the name of the device.
pub const MANUFACTURER_DEVICE_NAME: u16 = 0x1008;
/// 1009h: the version of the hardware.
pub const MANUFACTURER_HARDWARE_VERSION: u16 = 0x1009;
/// 100Ah: the version of the software.
pub const MANUFACTURER_SOFTWARE_VERSION: u16 = 0x100A;
/// 100Ch: the guard time, in ms.
pub const GUARD_TIME: u16 = 0x100C;
/// 100Dh: the life time is this many guard times.
pub const LIFE_TIME_FACTOR: u16 = 0x100D;
/// 1010h: stores parameters.
pub const STORE_PARAMETERS: u16 = 0x1010;
/// 1011h: restores default parameters.
pub const RESTORE_DEFAULT_PARAMETERS: u16 = 0x1011;
/// 1012h: the COB-ID of TIME; bit 31 if the device consumes it, bit 30 if it produces it.
pub const COB_ID_TIME: u16 = 0x1012;
/// 1013h: a time stamp with a resolution of 1 µs.
pub const HIGH_RESOLUTION_TIME_STAMP: u16 = 0x1013;
/// 1014h: the COB-ID of EMCY; bit 31 if there is none.
pub const COB_ID_EMCY: u16 = 0x1014;
/// 1015h: the inhibit time of EMCY, in multiples of 100 µs.
pub const INHIBIT_TIME_EMCY: u16 = 0x1015;
/// 1016h: the nodes whose heartbeat is consumed, and the time for each in ms.
pub const CONSUMER_HEARTBEAT_TIME: u16 = 0x1016;
/// 1017h: the period of the heartbeat, in ms.
pub const PRODUCER_HEARTBEAT_TIME: u16 = 0x1017;
/// 1018h: vendor, product, revision and serial number.
pub const IDENTITY: u16 = 0x1018;
/// 1019h: the highest value of the SYNC counter, after which it restarts at 1.
pub const SYNCHRONOUS_COUNTER_OVERFLOW: u16 = 0x1019;
/// 1020h: date and time of the configuration.
pub const VERIFY_CONFIGURATION: u16 = 0x1020;
/// 1021h: the device's own data sheet.
pub const STORE_EDS: u16 = 0x1021;
/// 1022h: the format of 1021h: 0 for text, from 128 on manufacturer-specific.
pub const STORE_FORMAT: u16 = 0x1022;
/// 1023h: a command to the operating system.
pub const OS_COMMAND: u16 = 0x1023;
/// 1024h: how the operating system executes commands.
pub const OS_COMMAND_MODE: u16 = 0x1024;
/// 1025h: commands to the debugger of the operating system.
pub const OS_DEBUGGER_INTERFACE: u16 = 0x1025;
/// 1026h: standard input and output.
pub const OS_PROMPT: u16 = 0x1026;
/// 1027h: the modules of a modular device.
pub const MODULE_LIST: u16 = 0x1027;
/// 1028h: the COB-IDs of emergencies that are consumed.
pub const EMERGENCY_CONSUMER: u16 = 0x1028;
/// 1029h: the NMT state to enter on errors.
pub const ERROR_BEHAVIOUR: u16 = 0x1029;
/// 1200h: the default SDO server.
pub const SDO_SERVER_1: u16 = 0x1200;
/// 1201h: the first SDO server after the default one.
pub const SDO_SERVER_2: u16 = 0x1201;
/// 127Fh: the last SDO server.
pub const SDO_SERVER_128: u16 = 0x127F;
/// 1280h: the first SDO client.
pub const SDO_CLIENT_1: u16 = 0x1280;
/// 12FFh: the last SDO client.
pub const SDO_CLIENT_128: u16 = 0x12FF;
/// 1400h: the communication parameter of the first RPDO.
pub const RPDO_1: u16 = 0x1400;
/// 15FFh: the communication parameter of the last RPDO.
pub const RPDO_512: u16 = 0x15FF;
/// 1600h: the mapping of the first RPDO.
pub const RPDO_MAPPING_1: u16 = 0x1600;
/// 17FFh: the mapping of the last RPDO.
pub const RPDO_MAPPING_512: u16 = 0x17FF;
/// 1800h: the communication parameter of the first TPDO.
pub const TPDO_1: u16 = 0x1800;
/// 19FFh: the communication parameter of the last TPDO.
pub const TPDO_512: u16 = 0x19FF;
/// 1A00h: the mapping of the first TPDO.
pub const TPDO_MAPPING_1: u16 = 0x1A00;
/// 1BFFh: the mapping of the last TPDO.
pub const TPDO_MAPPING_512: u16 = 0x1BFF;
/// The distance from a PDO's communication parameter to its mapping parameter.
pub const TO_MAPPING: u16 = RPDO_MAPPING_1 - RPDO_1;
/// 1F26h: the configuration date that a node is expected to have (CiA 302-3). In objects 1F2xh and 1F8xh about nodes,
/// the sub-index is the node-ID.
pub const EXPECTED_CONFIGURATION_DATE: u16 = 0x1F26;
/// 1F27h: the configuration time, likewise.
pub const EXPECTED_CONFIGURATION_TIME: u16 = 0x1F27;
/// 1F50h: the programs of a device, to be downloaded (CiA 302-3).
pub const PROGRAM_DATA: u16 = 0x1F50;
/// 1F51h: 0 stops, 1 starts, 2 resets and 3 clears a program; reads 2 if there is none (CiA 302-3).
pub const PROGRAM_CONTROL: u16 = 0x1F51;
/// 1F56h: identifies the software of a program (CiA 302-3).
pub const PROGRAM_SOFTWARE_IDENTIFICATION: u16 = 0x1F56;
/// 1F57h: bit 0 is set while the flash is busy; bits 1 to 7 hold the error of the last download (CiA 302-3).
pub const PROGRAM_FLASH_STATUS: u16 = 0x1F57;
/// 1F80h: what a device does after its boot-up (CiA 302-2).
pub const NMT_STARTUP: u16 = 0x1F80;
/// 1F81h: the nodes that a manager's network has, and how it treats each of them (CiA 302-2).
pub const NMT_SLAVE_ASSIGNMENT: u16 = 0x1F81;
/// 1F84h: the device type that a node is expected to have (CiA 302-2).
pub const EXPECTED_DEVICE_TYPE: u16 = 0x1F84;
/// 1F85h: the vendor-ID, likewise.
pub const EXPECTED_VENDOR: u16 = 0x1F85;
/// 1F86h: the product code, likewise.
pub const EXPECTED_PRODUCT: u16 = 0x1F86;
/// 1F87h: the revision number, likewise.
pub const EXPECTED_REVISION: u16 = 0x1F87;
/// 1F88h: the serial number, likewise.
pub const EXPECTED_SERIAL: u16 = 0x1F88;

/// The mask of the identifier in a COB-ID parameter (CiA 301, 7.5.2.5): 29 bits if [`EXTENDED`] is set, else 11.
pub const IDENTIFIER: u32 = 0x1FFF_FFFF;
/// The mask of an 11-bit identifier.
pub const BASE_IDENTIFIER: u32 = 0x7FF;
/// The bit of a COB-ID parameter that marks a 29-bit identifier.
pub const EXTENDED: u32 = 0x2000_0000;
/// The bit of a COB-ID parameter that disables it.
pub const INVALID: u32 = 0x8000_0000;

/// Whether an object is the communication parameter of a PDO.
#[must_use]
pub const fn is_pdo_communication(index: u16) -> bool {
    matches!(index, RPDO_1..=RPDO_512 | TPDO_1..=TPDO_512)
}

/// Whether an object is the mapping of a PDO.
#[must_use]
pub const fn is_pdo_mapping(index: u16) -> bool {
    matches!(index, RPDO_MAPPING_1..=RPDO_MAPPING_512 | TPDO_MAPPING_1..=TPDO_MAPPING_512)
}

/// Whether sub-index 0 of an object counts the entries in use instead of all entries.
#[must_use]
pub const fn counts_entries(index: u16) -> bool {
    index == PREDEFINED_ERROR_FIELD || is_pdo_mapping(index)
}

/// Whether an object configures communication, rather than describing the device or its state.
#[must_use]
pub const fn is_parameter(index: u16) -> bool {
    matches!(index, COB_ID_SYNC..=SYNCHRONOUS_WINDOW_LENGTH | STORE_PARAMETERS..=TPDO_MAPPING_512)
}

/// Whether CiA 301 (7.5.2) allows mapping an object into a PDO. It forbids this for configuration, except that the time
/// stamp (1013h), the prompt (1026h) and the SDO parameters (1200h to 12FFh) are "optional".
#[must_use]
pub const fn can_be_mapped(index: u16) -> bool {
    let optional = matches!(index, HIGH_RESOLUTION_TIME_STAMP | OS_PROMPT | SDO_SERVER_1..=SDO_CLIENT_128);
    optional || !is_parameter(index)
}

/// Whether CiA 301, 7.3.5, table 40 restricts an 11-bit identifier: NMT, SDO, error control and LSS use it, so no
/// COB-ID may be configured to it.
#[must_use]
pub const fn is_restricted(identifier: u32) -> bool {
    matches!(identifier, 0..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF)
}

/// The communication parameter of RPDO `number`, 1 to 512.
#[must_use]
pub const fn rpdo(number: u16) -> u16 {
    RPDO_1 + number - 1
}

/// The communication parameter of TPDO `number`, 1 to 512.
#[must_use]
pub const fn tpdo(number: u16) -> u16 {
    TPDO_1 + number - 1
}

/// The number of the PDO to which a parameter at `index` belongs, 1 to 512.
#[must_use]
pub const fn pdo_number(index: u16) -> u16 {
    1 + (index & 0x01FF)
}

/// The predefined connection set (CiA 301, 7.3.3): COB-IDs without the node-ID.
pub mod connection {
    /// Emergencies.
    pub const EMCY: u16 = 0x080;
    /// The first TPDO; the next three follow in steps of 100h.
    pub const TPDO_1: u16 = 0x180;
    /// All four TPDOs.
    pub const TPDOS: [u16; 4] = [TPDO_1, TPDO_1 + 0x100, TPDO_1 + 0x200, TPDO_1 + 0x300];
    /// The first RPDO; the next three follow in steps of 100h.
    pub const RPDO_1: u16 = 0x200;
    /// Responses of the default SDO server.
    pub const SDO_RESPONSE: u16 = 0x580;
    /// Requests to the default SDO server.
    pub const SDO_REQUEST: u16 = 0x600;
    /// Boot-up, heartbeat and node guarding.
    pub const ERROR_CONTROL: u16 = 0x700;
}
