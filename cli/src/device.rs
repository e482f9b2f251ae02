//! The data sheet of a command, from a file or the device library.

use std::path::{Path, PathBuf};

use lexican_eds::{Input, Source};
use lexican_toolbox::data_sheet::{DataSheet, DataSheetError, find_known, with_overlays};
use lexican_toolbox::text::files::Existing;

use crate::output::{Failure, plural, warn};

#[derive(clap::Args, Debug)]
pub(crate) struct DeviceArgs {
    /// An EDS, DCF or XDD file, or a device that lexican knows, such as siko/ag03-1 (see `lexican devices`)
    #[arg(value_name = "FILE|DEVICE")]
    device: String,

    /// Corrections and meanings in addition to the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,
}

impl DeviceArgs {
    pub(crate) fn name(&self) -> &str {
        &self.device
    }

    pub(crate) fn has_overlays(&self) -> bool {
        !self.overlay.is_empty()
    }

    /// Refuses to overwrite one of the files that are read.
    pub(crate) fn guard(&self, output: &Path) -> Result<(), Failure> {
        guard(output, Some(self.device.as_str()), &self.overlay)
    }

    /// Loads the data sheet, as far as it can be read.
    pub(crate) fn load(&self) -> Result<DataSheet, Failure> {
        Ok(DataSheet::load(&self.device, &self.overlay)?)
    }
}

/// Refuses to overwrite one of these data sheets and overlays.
pub(crate) fn guard<'a>(
    output: &Path,
    sheets: impl IntoIterator<Item = &'a str>,
    overlays: &'a [PathBuf],
) -> Result<(), Failure> {
    let read = sheets.into_iter().map(Path::new).chain(overlays.iter().map(PathBuf::as_path));
    Existing::Replace.guard(output, read).map_err(|error| Failure::file("write", output, &error))
}

/// The texts with this name, of a machine's node, a file, or a device of the library; for the last, with its id.
#[cfg(feature = "full")]
pub(crate) fn find(name: &str) -> Result<(Input, Option<&'static str>), DataSheetError> {
    match crate::machine::sheet_of_node(name) {
        Some(sheet) => Ok((sheet.input, sheet.library)),
        None => find_known(name),
    }
}

/// Loads a data sheet with overlays; warns about its errors.
#[cfg(feature = "full")]
pub(crate) fn load(name: &str, overlays: &[PathBuf]) -> Result<DataSheet, Failure> {
    let (input, library) = find(name)?;
    Ok(DataSheet { library, ..load_input(input, overlays)? })
}

/// Reads a data sheet with overlays; warns about its errors.
pub(crate) fn load_input(input: Input, overlays: &[PathBuf]) -> Result<DataSheet, Failure> {
    let sheet = DataSheet::new(with_overlays(input, overlays)?)?;
    warn_of_errors(&sheet);
    Ok(sheet)
}

/// Warns about the errors in a data sheet.
pub(crate) fn warn_of_errors(sheet: &DataSheet) {
    let errors = sheet.errors().count();
    if errors > 0 {
        let name = sheet.input.eds.name();
        let files = sheet.input.overlays.iter().map(Source::name).filter(|name| Path::new(name).is_file());
        let overlays = files.map(|name| format!(" --overlay {name}"));
        let overlays: String = overlays.collect();
        let errors = plural(errors, "error");
        warn(format_args!("{name} has {errors}; `lexican eds lint {name}{overlays}` shows them"));
    }
}

/// Prints errors in full on stderr; returns whether there are any.
pub(crate) fn show_errors(sheet: &DataSheet) -> bool {
    let errors = in_full(sheet);
    anstream::eprint!("{errors}");
    !errors.is_empty()
}

/// The errors in a data sheet, with their lines.
pub(crate) fn in_full(sheet: &DataSheet) -> String {
    sheet.errors().map(|finding| format!("{}\n\n", finding.render(&sheet.input))).collect()
}

impl From<DataSheetError> for Failure {
    fn from(error: DataSheetError) -> Self {
        let failure = Failure::new(&error).help_if(error.remedy());
        match error {
            DataSheetError::NoObject { sheet } => failure.after(in_full(&sheet)),
            _ => failure,
        }
    }
}

/// Devices for tests.
#[cfg(test)]
pub(crate) mod samples {
    use lexican_eds::model::Device;
    use lexican_eds::{Input, Source};
    use lexican_toolbox::data_sheet::DataSheet;

    pub(crate) fn drive() -> Device {
        DataSheet::load("siko/ag03-1", &[]).unwrap().device
    }

    pub(crate) fn sensor() -> Device {
        let source = Source::new("sensor.eds", include_str!("../tests/sensor.eds"));
        DataSheet::parse(Input::new(source)).device
    }
}
