//! A SIKO drive as data: what its gateway and its simulator have to know of it.

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

/// A drive of the family. Objects have the same indices and types in all of its drives, so what a drive has is what
/// its dictionary has: without 2418h the loop has the length of [`Model::loop_length`], without 2421h there is no
/// torque deactivation, and so on. Everything else is here.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// What messages call it: `AG03/1`.
    pub name: &'static str,
    /// The first line of the file of its EEPROM.
    pub eeprom: KeptFormat,
    /// The dictionary with the defaults of the data sheet for a node-ID.
    pub storage: fn(NodeId) -> Box<dyn Storage>,
    /// The entries that the EEPROM keeps.
    pub persistent: &'static [Address],
    /// In which NMT states entries may be written, where not in all of them.
    pub writable_in: &'static [WritableIn],
    /// Limits that depend on other entries, such as the gear.
    pub ranges: &'static [ConditionalLimit],
    /// What 1011h restores.
    pub parameters: &'static [Parameter],
    /// What the firmware says of itself: name, version, date.
    pub constants: &'static [(Address, u64)],
    /// The gear of a new drive, as 2102h has it.
    pub gear: u8,
    /// In what it deviates from CiA 301, or fills in what that leaves open.
    pub behaviour: Behaviour,
    /// Its faults; what is not among them does not make it fail.
    pub faults: &'static [Fault],
    /// What it reports besides its faults.
    pub notices: &'static [Code],
    /// Whether 0000h is sent when the bus is well again, and not only when a fault has been reset.
    pub reports_recovery: bool,
    /// How long the motor current may be too high.
    pub overcurrent_for: Duration,
    /// The bit of 1014h without which no EMCY is sent, if it is not the one of CiA 301.
    pub emergencies: Option<EmergencySwitch>,
    /// Whether control words come by SDO, too, and not by PDO only.
    pub control_by_sdo: bool,
    /// Whether 23h is the only SDO command that writes, with four bytes for an object of any size.
    pub writes_four_bytes: bool,
    /// Where the node-ID comes from.
    pub addressing: Addressing,
    /// Whether there is an input without which the motor gets no torque: bit 10 of 1002h shows its absence.
    pub enable_input: bool,
    /// Whether there are two limit switches and one for calibration: bits 0 to 2 of 1002h show them.
    pub switches: bool,
    /// Whether there are operator keys.
    pub keys: bool,
    /// The length of a loop in increments, where no object has it.
    pub loop_length: u16,
}

/// In what SIKO's drives deviate from CiA 301, or fill in what that leaves open.
pub const BEHAVIOUR: Behaviour = Behaviour {
    // By event timer only.
    triggers_255: Triggers { start: false, change: false, timer: true, inhibit: false },
    type_0_at_every_sync: true,
    // 1400h:05 is a compatibility entry, or missing.
    rpdo_deadlines: false,
    changes: ChangeRule::InPreOperational,
    dummies: 0,
    empty_history_is_zero: true,
    // Table 20 has no code for what a device notices by itself in frames.
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
