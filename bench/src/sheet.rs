//! Data sheets of nodes, which stay until the program ends.

use lexican_driver::Description;
use lexican_eds::library;
use lexican_eds::model::Device;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::describe;
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
}

impl Sheet {
    /// A data sheet that was read.
    #[must_use]
    pub fn new(name: &str, sheet: DataSheet) -> Self {
        let drive = describe(&sheet.input).ok();
        let device: &'static Device = Box::leak(Box::new(sheet.device));
        Sheet { name: sheet.library.unwrap_or_else(|| String::leak(name.to_owned())), device, drive }
    }

    /// That of a device of the library.
    pub(crate) fn of_library(shipped: &'static Shipped) -> Self {
        let drive = library::find(shipped.id).and_then(|known| describe(&known.input()).ok());
        Sheet { name: shipped.id, device: &shipped.device, drive }
    }
}
