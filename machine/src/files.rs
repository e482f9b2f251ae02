//! Reads the files that a machine refers to.

use std::io;
use std::path::{Path, PathBuf};

use lexican_eds::{Input, Source};
use lexican_toolbox::data_sheet::{DataSheet, DataSheetError, beside, find_known, find_shipped};
use lexican_toolbox::text::files::{ReadError, read, read_up_to};

/// Where the files are that a machine refers to.
#[derive(Clone, Copy, Debug)]
pub enum Files<'a> {
    /// In this folder, to which their names are relative.
    Folder(&'a Path),
    /// In the program, as names and texts.
    Embedded(&'a [(&'a str, &'a str)]),
}

impl Files<'_> {
    fn embedded(&self, name: &Path) -> Option<Source> {
        let Files::Embedded(files) = self else { return None };
        let (name, text) = files.iter().find(|(known, _)| Path::new(known) == name)?;
        Some(Source::new(*name, *text))
    }

    fn missing(name: &Path) -> ReadError {
        ReadError { path: name.to_owned(), error: io::ErrorKind::NotFound.into() }
    }

    /// Reads a text.
    pub fn read(&self, name: &Path) -> Result<Source, ReadError> {
        match self {
            Files::Folder(folder) => read(&folder.join(name)),
            Files::Embedded(_) => self.embedded(name).ok_or_else(|| Self::missing(name)),
        }
    }

    /// At most `bound` bytes of a file.
    pub(crate) fn bytes(&self, name: &Path, bound: usize) -> Result<Vec<u8>, ReadError> {
        match self {
            Files::Folder(folder) => read_up_to(&folder.join(name), bound),
            Files::Embedded(_) => self.read(name).map(|source| source.text().as_bytes().to_vec()),
        }
    }

    /// The path of a file as seen from outside of the machine's folder.
    #[must_use]
    pub fn path(&self, name: &Path) -> PathBuf {
        match self {
            Files::Folder(folder) => folder.join(name),
            Files::Embedded(_) => name.to_owned(),
        }
    }

    /// The name of a data sheet from outside: a path, or a device of the library.
    pub(crate) fn name(&self, sheet: &str) -> String {
        match self {
            Files::Folder(folder) => beside(folder, sheet),
            Files::Embedded(_) => sheet.to_owned(),
        }
    }

    /// Reads a data sheet with its overlays.
    pub(crate) fn data_sheet(&self, name: &str, overlays: &[PathBuf]) -> Result<DataSheet, DataSheetError> {
        let (input, library) = match self {
            Files::Folder(_) => find_known(name)?,
            Files::Embedded(_) => {
                let found = self.embedded(Path::new(name)).map(|eds| (Input::new(eds), None));
                found.map_or_else(|| find_shipped(name), Ok)?
            }
        };
        let with = |input: Input, overlay: &PathBuf| Ok::<_, ReadError>(input.overlay(self.read(overlay)?));
        let sheet = DataSheet::new(overlays.iter().try_fold(input, with)?)?;
        Ok(DataSheet { library, ..sheet })
    }
}
