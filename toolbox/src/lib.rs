//! What the command `lexican` shares with other tools: no terminal, no link to a real bus.
//!
//! [`log`] reads and writes recorded frames, [`decode`] turns frames into words and fields, [`values`] does so with the values of
//! objects, both by the data sheet of the device; [`object`] finds what people call an object, and [`identity`] recognises the
//! devices of the library by what they are on the bus. A [`data_sheet`] is found by its name, and [`simulation`] makes devices of
//! data sheets, alone or as a plant. Of a bus, [`filter`] and [`changes`] choose what is worth a look, [`transfers`]
//! makes one thing of the frames of an SDO transfer, and [`statistics`] counts. A [`sampler`] follows values over time, [`series`]
//! keeps them and makes a picture.
//! [`check`] compares a device with its data sheet, and [`parameters`] keeps, restores and compares what it is set to, through a
//! [`remote`] node. [`lss`] finds and configures devices by their identity, [`pdo`] shows and plans what PDOs map, [`flash`] transfers a program, long transfers are [`followed`], [`drive`] moves a drive by hand, [`dbc`] writes a CAN database, and
//! what a program leaves behind that ends at any moment is judged by [`chaos`],
//! [`time_of_day`] reads and writes dates; [`node_id`], [`files`] and [`toml_text`] read what people name and write.
//!
//! What takes the crates of drives is there with the feature `drives`: [`drive`], [`simulation`] and [`chaos`]; what draws, with
//! `pictures`: [`series`].

pub mod changes;
#[cfg(feature = "drives")]
pub mod chaos;
pub mod check;
pub mod cob_ids;
pub mod data_sheet;
pub mod dbc;
pub mod decode;
#[cfg(feature = "drives")]
pub mod drive;
pub mod files;
pub mod filter;
pub mod flash;
pub mod followed;
pub mod identity;
pub mod json;
pub mod log;
pub mod lss;
pub mod node_id;
pub mod object;
pub mod parameters;
pub mod pdo;
pub mod remote;
pub mod sampler;
pub mod sdo_channel;
#[cfg(feature = "pictures")]
pub mod series;
#[cfg(feature = "drives")]
pub mod simulation;
pub mod statistics;
pub mod time_of_day;
pub mod toml_text;
pub mod transfers;
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
