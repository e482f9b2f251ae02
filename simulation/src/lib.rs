//! Devices that exist only in software, alone or as a plant on one bus.
//!
//! A [`SimulatedDevice`] is made of its data sheet, or is a drive with a simulator of its own. A [`Plant`] describes
//! devices, their settings and the faults between them: those of a machine (`machine.toml`), in a file or in the
//! program. Its [`Segment`] is one [`Node`](lexican_runtime::host::Node), to be attached to a bus. Plants that share
//! nothing run [side by side](side_by_side), on several cores.
//!
//! A [`Command`] acts on a device from outside, whether a user types a line or presses a button.
//!
//! ```
//! use lexican_runtime::Instant;
//! use lexican_simulation::{Files, Plant, command};
//!
//! let plant = Plant::parse(
//!     "[node.feeder]\nid = 5\nsheet = 'siko/ag03-1'\n",
//!     "machine.toml",
//!     Files::Embedded(&[]),
//! )?;
//! let mut segment = plant.segment(Instant::ZERO)?;
//! let feeder = segment.nodes_mut().find(|device| device.is_called("feeder")).unwrap();
//! feeder.carry_out(Instant::ZERO, &command::parse("shaft = blocked")?.unwrap())?;
//! assert_eq!(feeder.carry_out(Instant::ZERO, &command::parse("get 6060")?.unwrap())?, "6060:00 Modes of Operation = profile position (1)");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod chaos;
pub mod command;
mod device;
mod interface;
pub mod plant;
mod segment;
mod side_by_side;
mod virtual_device;

pub use command::{Command, Power};
pub use device::{SimulatedDevice, SimulationError};
pub use lexican_machine::{Fault, Files};
pub use plant::{Plant, PlantDevice, PlantError};
pub use segment::Segment;
pub use side_by_side::{SideBySide, side_by_side};
pub use simulator::script::{Input, Range, Takes};
pub use virtual_device::VirtualDevice;

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// Devices for tests.
#[cfg(test)]
mod samples {
    use lexican_eds::library;
    use lexican_eds::model::Device;

    pub(crate) fn drive() -> Device {
        lexican_eds::load(&library::find("siko/ag03-1").unwrap().input()).0
    }

    pub(crate) fn sensor() -> Device {
        let text = include_str!("../../cli/tests/sensor.eds");
        lexican_eds::load(&lexican_eds::Input::new(lexican_eds::Source::new("sensor.eds", text))).0
    }
}
