//! Scripts for a simulated drive.
//!
//! [`simulator::script`] explains scripts; this module has the changes of SIKO's drives.
//!
//! ```
//! use lexican_runtime::host::VirtualBus;
//! use lexican_runtime::{Duration, NodeId};
//! use siko_ag03_1::driver::{Drive, Outcome};
//! use siko_ag03_1::sim::{MODEL, SimulatedDrive};
//! use siko_ag03_1::sim::inputs::Shaft;
//! use siko_ag03_1::sim::script::{Change, Condition, Script, Trigger};
//!
//! // Two seconds after the drive has set off, something holds its shaft.
//! let travelling = Trigger::When { condition: Condition::Moving, and_then: Duration::from_secs(2) };
//! let script = Script::default().then(travelling, [Change::Shaft(Shaft::Blocked)]);
//!
//! let bus = VirtualBus::with_bit_rate(500);
//! let mut simulated = SimulatedDrive::new(&MODEL, NodeId::literal(5));
//! simulated.follow(bus.now(), script);
//! bus.attach(simulated);
//!
//! let mut drive = Drive::connect(bus.link(), NodeId::literal(5))?;
//! drive.enable()?;
//! let Outcome::Fault { .. } = drive.move_to(5000)? else { panic!("the shaft is blocked") };
//! # Ok::<(), siko_ag03_1::driver::Error>(())
//! ```
//!
//! # The same in TOML
//!
//! Besides the keys of every script, a step has:
//!
//! | Key | Value | What it does |
//! |---|---|---|
//! | `supply_v` | 0 to 100 | both supplies; `output_stage_v` and `control_v` set them one by one |
//! | `battery_v` | 0 to 10 | the battery of the absolute encoder |
//! | `temperature_degc` | -100 to 200 | the output stage |
//! | `load_ma` | 0 to 32767 | the current that the motor takes while it moves |
//! | `attainable_rpm` | 1 to 255, or `"any"` | the velocity that the load allows: a lag error below what is asked for |
//! | `shaft` | `"free"`, `"blocked"` | whether the shaft can turn |
//! | `turn` | increments | somebody turns the shaft by hand; a motor that is not released holds it |
//! | `bus` | `"active"`, `"passive"`, `"off"` | fault confinement of the CAN controller |
//! | `bus_error` | `"acknowledgement"`, `"form"`, `"crc"`, `"stuff"`, `"none"` | what the CAN controller finds wrong with a frame, in drives that report it |
//! | `bus_kbit` | 15.625 to 1000, or `"any"` | the bit rate of the bus; a drive that has another one is not there |
//! | `limit_switch` | `"1"`, `"2"`, `"none"` | the limit switch that is active, in drives that have them |
//! | `calibration_switch` | true, false | the switch that calibrates, in drives that have one |
//! | `enable` | true, false | the input that enables the motor, in drives that have one |
//! | `key` | `"clockwise"`, `"counter-clockwise"`, `"none"` | the operator keys (2.2.1.2), in drives that have them |
//! | `fault` | `"A"` to `"J"`, or a name | a fault whose cause stays until it is cleared |
//! | `clear` | `"A"` to `"J"`, a name, or `"all"` | the cause of a fault goes; `"all"` is a world in which all is well |
//! | `node` | 1 to 127 | SW1 to SW7, for the next power-on |
//! | `switches` | ten digits, SW1 first | all DIP switches, for the next power-on |
//! | `restore` | `"all"`, `"standard"`, `"controller"`, `"none"` | DIP switches for factory settings (2.4) |
//! | `termination` | true, false | SW9 and SW10 |
//! | `power` | `"on"`, `"off"`, `"cycle"` | the supply is switched |
//!
//! Faults are also named `undervoltage`, `shaft blocked`, `overcurrent`, `overtemperature`, `sensor`, `internal`,
//! `overvoltage`, `bus passive`, `bus off` and `battery`. A whole example:
//!
//! ```toml
#![doc = include_str!("../../examples/rough_day.toml")]
//! ```

use lexican_runtime::NodeId;
#[cfg(feature = "script")]
pub use simulator::script::ScriptError;
pub use simulator::script::{Condition, Step, Trigger};

use super::inputs::{BusError, BusState, Key, Shaft};
use super::switches::{DipSwitches, Restore};
use crate::fault::FaultKind;

#[cfg(feature = "script")]
mod toml;
#[cfg(feature = "script")]
pub use toml::inputs;

/// What happens to a drive, step by step. See the [module](self).
pub type Script = simulator::script::Script<Change>;

/// Something that happens to a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The supply of the output stage, in 0.1 V.
    OutputStageSupply(u16),
    /// The supply of the control, in 0.1 V; without it, the drive is off.
    ControlSupply(u16),
    /// The battery of the absolute encoder, in 10 mV.
    Battery(i16),
    /// The temperature of the output stage, in 0.1 degC.
    Temperature(i16),
    /// The current that the motor takes while it moves, in mA.
    Load(u16),
    /// The velocity that the load allows, in rev/min.
    Attainable(Option<u8>),
    /// Whether the shaft can turn.
    Shaft(Shaft),
    /// Somebody turns the shaft by this many increments, if it is free to turn.
    Turn(i32),
    /// Fault confinement of the CAN controller.
    Bus(BusState),
    /// The error that the CAN controller has detected in a frame, in drives that report it.
    BusError(Option<BusError>),
    /// The bit rate of the bus, in bit/s.
    BusBitRate(Option<u32>),
    /// The enable input, in drives that have one.
    Enable(bool),
    /// Limit switches 1 and 2, in drives that have them.
    LimitSwitches([bool; 2]),
    /// The calibration switch, in drives that have one.
    CalibrationSwitch(bool),
    /// An operator key is pressed, or none.
    Key(Option<Key>),
    /// A fault whose cause persists.
    Fault(FaultKind),
    /// The cause of a fault is removed.
    Clear(FaultKind),
    /// The causes of all faults are removed.
    ClearAll,
    /// All DIP switches.
    Switches(DipSwitches),
    /// The address on SW1 to SW7.
    Node(NodeId),
    /// SW1 to SW8 for restoring factory settings, or SW8 OFF.
    Restore(Option<Restore>),
    /// SW9 and SW10.
    Termination(bool),
    /// The supply is switched on or off.
    Power(bool),
    /// The supply is switched off and on again.
    PowerCycle,
}
