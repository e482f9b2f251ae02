//! Data sheets of nodes, which are kept until the program ends.

use lexican_driver::Description;
use lexican_eds::model::Device;
use lexican_eds::{Input, library};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::{Fact, Verdict, explain_sheet};
use lexican_toolbox::node::identity::Shipped;

use crate::view::Lack;

/// The data sheet of a node. Decoders and drivers refer to its texts until the program ends, so each is read only once.
#[derive(Clone, Copy)]
pub struct Sheet {
    /// `siko/ag03-1`, `drive.eds`.
    pub name: &'static str,
    /// The parsed data sheet.
    pub device: &'static Device,
    /// How to move the drive; `None` if it is none.
    pub drive: Option<&'static Description>,
    /// Facts about moving the drive by the data sheet, as in `lexican drive NODE --explain`, the worst first; empty if
    /// it is no drive.
    pub lacks: &'static [Fact],
    /// The same for the view.
    pub(crate) shown_lacks: &'static [Lack],
}

impl Sheet {
    /// Keeps a data sheet.
    #[must_use]
    pub fn new(name: &str, sheet: DataSheet) -> Self {
        let name = sheet.library.unwrap_or_else(|| String::leak(name.to_owned()));
        Sheet::of(name, &sheet.input, Box::leak(Box::new(sheet.device)))
    }

    /// The data sheet of a device in the library.
    pub(crate) fn of_library(shipped: &'static Shipped) -> Self {
        match library::find(shipped.id) {
            Some(found) => Sheet::of(shipped.id, &found.input(), &shipped.device),
            None => Sheet { name: shipped.id, device: &shipped.device, drive: None, lacks: &[], shown_lacks: &[] },
        }
    }

    fn of(name: &'static str, input: &Input, device: &'static Device) -> Self {
        let (drive, mut facts) = explain_sheet(input, device);
        // Control word and status word: no other profile has these indices.
        let is_drive = device.profile == Some(402) || device.object(0x6040).or(device.object(0x6041)).is_some();
        facts.retain(|fact| is_drive && fact.verdict != Verdict::Ready);
        let shown_lacks = facts.iter().map(lack).collect::<Vec<_>>().leak();
        Sheet { name, device, drive, lacks: facts.leak(), shown_lacks }
    }
}

/// A fact with its remedy in one line.
pub(crate) fn lack(fact: &Fact) -> Lack {
    let remedy = fact.remedy.as_ref().map_or_else(String::new, |remedy| format!(": {remedy}"));
    Lack { is_needed: fact.verdict == Verdict::Missing, text: format!("{}{remedy}", fact.text).into() }
}
