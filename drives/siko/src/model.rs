//! A SIKO drive as data, for its gateway and its simulator.

use lexican_driver::description::EmergencySwitch;
use lexican_driver::{Code, Parameter};
use lexican_runtime::device::{Behaviour, ChangeRule, ErrorControlRule};
use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::object::{Address, ConditionalLimit, WritableIn};
use lexican_runtime::service::tpdo::Triggers;
use lexican_runtime::wire::emcy::ErrorCode;
use lexican_runtime::{Duration, NodeId};
use simulator::Storage;

use crate::fault::{Fault, FaultKind};

/// A drive of the family. Objects have the same indices and types in all drives, so the dictionary of a drive also
/// shows its features: without 2418h the loop has the length of [`Model::loop_length`], without 2421h there is no
/// torque deactivation, and so on. All other differences are here.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// The name in messages: `AG03/1`.
    pub name: &'static str,
    /// The first line of its EEPROM file.
    pub eeprom: KeptFormat,
    /// Makes the dictionary for a node-ID, with the defaults of the data sheet.
    pub storage: fn(NodeId) -> Box<dyn Storage>,
    /// The entries that the EEPROM keeps.
    pub persistent: &'static [Address],
    /// Entries that may be written in some NMT states only.
    pub writable_in: &'static [WritableIn],
    /// Limits that depend on other entries, such as the gear.
    pub ranges: &'static [ConditionalLimit],
    /// The parameters that 1011h restores.
    pub parameters: &'static [Parameter],
    /// Values of name, version and date in the firmware.
    pub constants: &'static [(Address, u64)],
    /// The gear of a new drive, as in 2102h.
    pub gear: u8,
    /// Where it deviates from CiA 301, or decides what that leaves open.
    pub behaviour: Behaviour,
    /// Its faults; other kinds of fault have no effect.
    pub faults: &'static [Fault],
    /// The emergency codes that are not faults.
    pub notices: &'static [Code],
    /// Whether 0000h is also sent when the bus has recovered, and not only after a fault reset.
    pub reports_recovery: bool,
    /// How long the motor current may be too high before a fault.
    pub overcurrent_for: Duration,
    /// The bit of 1014h that switches EMCY on or off, if it is not that of CiA 301.
    pub emergencies: Option<EmergencySwitch>,
    /// Whether control words may also come by SDO, and not only by PDO.
    pub control_by_sdo: bool,
    /// Whether 23h is the only SDO command that writes, with four bytes for an object of any size.
    pub writes_four_bytes: bool,
    /// Where the node-ID comes from.
    pub addressing: Addressing,
    /// Whether it has an enable input, without which the motor has no torque: bit 10 of 1002h is set while it is
    /// inactive.
    pub enable_input: bool,
    /// Whether it has two limit switches and one for calibration: bits 0 to 2 of 1002h.
    pub switches: bool,
    /// Whether it has operator keys.
    pub keys: bool,
    /// The length of a loop in increments, if no object holds it.
    pub loop_length: u16,
}

/// Where SIKO's drives deviate from CiA 301, or decide what that leaves open.
pub const BEHAVIOUR: Behaviour = Behaviour {
    // By event timer only.
    triggers_255: Triggers { start: false, change: false, timer: true, inhibit: false },
    type_0_at_every_sync: true,
    // 1400h:05 is a compatibility entry, or missing.
    rpdo_deadlines: false,
    changes: ChangeRule::InPreOperational,
    dummies: 0,
    empty_history_is_zero: true,
    // Table 20 has no codes for communication errors that a device detects in frames.
    records_communication_errors: false,
    unreported: &[
        ErrorCode::LIFE_GUARD,
        ErrorCode::PDO_LENGTH,
        ErrorCode::PDO_TOO_LONG,
        ErrorCode::SYNC_LENGTH,
        ErrorCode::RPDO_TIMEOUT,
    ],
    error_control: ErrorControlRule::Exclusive,
    ..Behaviour::CIA_301
};

/// Where the node-ID comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addressing {
    /// From DIP switches, which are read when the supply is switched on.
    Switches,
    /// From 2101h, which is read at every initialisation.
    Object,
}

impl Model {
    /// The fault of a kind, if the drive has it.
    #[must_use]
    pub fn fault(&self, kind: FaultKind) -> Option<Fault> {
        self.faults.iter().find(|fault| fault.kind == kind).copied()
    }
}
