//! Data sheets of nodes, which stay until the program ends.

use lexican_driver::Description;
use lexican_eds::model::Device;
use lexican_eds::{Input, library};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::{Fact, Verdict, describe, explain_sheet};
use lexican_toolbox::identity::Shipped;

/// The data sheet of a node. Decoders and drivers refer to its texts as long as the program runs, so each is read once.
#[derive(Clone, Copy)]
pub struct Sheet {
    /// `siko/ag03-1`, `drive.eds`.
    pub name: &'static str,
    /// What it says.
    pub device: &'static Device,
    /// How to move it, if it is a drive.
    pub drive: Option<&'static Description>,
    /// What it lacks for moving its drive, and what the driver uses instead, as `lexican drive NODE --explain` has it; the worst
    /// first. Nothing of a device that is no drive.
    pub lacks: &'static [Fact],
}

impl Sheet {
    /// A data sheet that was read.
    #[must_use]
    pub fn new(name: &str, sheet: DataSheet) -> Self {
        let (drive, lacks) = (describe(&sheet.input).ok(), lacks(&sheet.input, &sheet.device));
        let device: &'static Device = Box::leak(Box::new(sheet.device));
        Sheet { name: sheet.library.unwrap_or_else(|| String::leak(name.to_owned())), device, drive, lacks }
    }

    /// That of a device of the library.
    pub(crate) fn of_library(shipped: &'static Shipped) -> Self {
        let input = library::find(shipped.id).map(library::Shipped::input);
        let drive = input.as_ref().and_then(|input| describe(input).ok());
        let lacks = input.as_ref().map_or_else(Default::default, |input| lacks(input, &shipped.device));
        Sheet { name: shipped.id, device: &shipped.device, drive, lacks }
    }
}

fn lacks(input: &Input, device: &Device) -> &'static [Fact] {
    // The control word and the status word: no other profile has them there.
    if device.profile != Some(402) && device.object(0x6040).or(device.object(0x6041)).is_none() {
        return &[];
    }
    let mut facts = explain_sheet(input, device);
    facts.retain(|fact| fact.verdict != Verdict::Ready);
    facts.leak()
}
