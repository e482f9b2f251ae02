//! What the command `lexican` shares with other tools: no terminal, no link to a real bus, no simulated device.
//!
//! | room | what is in it |
//! | --- | --- |
//! | [`log`] | recorded frames, read and written in every common format |
//! | [`decode`] | a frame in words and fields, by the data sheet of its device |
//! | [`bus`] | of all frames: filters, changes, SDO transfers as one thing each, statistics |
//! | [`node`] | one device: recognised, read and written, checked against its data sheet, given a program |
//! | [`lss`] | devices found and configured by their identity |
//! | [`parameters`] | what a device is set to: kept, restored, compared |
//! | [`pdo`] | what PDOs map, plans to change it, and a CAN database (DBC) of it |
//! | [`values`] | values of objects as people write them, and objects by name |
//! | [`trace`] | values over time; as pictures with the feature `pictures` |
//! | [`data_sheet`] | a data sheet, found by file or by its name in the library |
//! | [`doc`] | a data sheet as a page for people, in HTML or Markdown |
//! | [`text`] | files, TOML, times of day, node-IDs |
//! | `replace` | a device in the place of another one, with the feature `archive` |
//! | `drive` | orders to a drive by hand, with the feature `drives` |

pub mod bus;
pub mod data_sheet;
pub mod decode;
pub mod doc;
#[cfg(feature = "drives")]
pub mod drive;
pub mod log;
pub mod lss;
pub mod node;
pub mod parameters;
pub mod pdo;
#[cfg(feature = "archive")]
pub mod replace;
pub mod text;
pub mod trace;
pub mod values;

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
