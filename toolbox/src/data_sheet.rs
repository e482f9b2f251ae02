//! Data sheets, from a file or from the device library.

use std::io;
use std::path::{Path, PathBuf};

use lexican_eds::convert::Format;
use lexican_eds::model::Device;
use lexican_eds::{Diagnostic, Diagnostics, Input, Severity, library};

use crate::text::files::{ReadError, read};
use crate::text::similarity::similarity;

/// A device as described by its data sheet, with the findings about it.
#[derive(Clone, Debug)]
pub struct DataSheet {
    /// The texts: the data sheet and its overlays.
    pub input: Input,
    /// What they describe.
    pub device: Device,
    /// The findings. A data sheet with [errors](DataSheet::errors) is still used as far as it could be read; the user
    /// is told so.
    pub diagnostics: Diagnostics,
    /// The id of the device in the library, if it is from there.
    pub library: Option<&'static str>,
}

/// Why there is no usable data sheet.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataSheetError {
    /// The file exists, but cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The name looks like that of a file, which does not exist, and no known device has it.
    #[error("{error}")]
    NoFile {
        /// As given.
        name: String,
        /// From looking for the file.
        #[source]
        error: ReadError,
    },
    /// Neither a file nor a known device has this name.
    #[error("no file and no known device is called {name:?}")]
    Unknown {
        /// As given.
        name: String,
    },
    /// The text describes no object.
    #[error("{}:1:1: the file describes no object", sheet.input.eds.name())]
    NoObject {
        /// The text with its findings.
        sheet: Box<DataSheet>,
    },
}

impl DataSheetError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> Option<String> {
        match self {
            DataSheetError::Read(_) => None,
            DataSheetError::NoFile { name, .. } | DataSheetError::Unknown { name } => Some(similar(name)),
            DataSheetError::NoObject { .. } => Some(
                "is it an electronic data sheet? It begins with a line [FileInfo] and lists objects in [MandatoryObjects]"
                    .to_owned(),
            ),
        }
    }
}

impl DataSheet {
    /// Reads the texts; the device may turn out to have no object.
    #[must_use]
    pub fn parse(input: Input) -> Self {
        let (device, diagnostics) = lexican_eds::load(&input);
        DataSheet { input, device, diagnostics, library: None }
    }

    /// Reads the texts. Errors: [`DataSheetError::NoObject`] if the device has no object.
    pub fn new(input: Input) -> Result<Self, DataSheetError> {
        let sheet = DataSheet::parse(input);
        if sheet.device.objects.is_empty() { Err(DataSheetError::NoObject { sheet: sheet.into() }) } else { Ok(sheet) }
    }

    /// Loads the data sheet with this name, of a file or else of the library, with overlays from files. The name may
    /// also be one that [`recognise`](crate::node::identity::recognise) returns.
    pub fn load(name: &str, overlays: &[PathBuf]) -> Result<Self, DataSheetError> {
        let (input, library) = find_known(name)?;
        let sheet = DataSheet::new(with_overlays(input, overlays)?)?;
        Ok(DataSheet { library, ..sheet })
    }

    /// As [`load`](DataSheet::load), but without applying rules.
    pub fn load_unjudged(name: &str, overlays: &[PathBuf]) -> Result<Self, DataSheetError> {
        let (input, library) = find_known(name)?;
        let input = with_overlays(input, overlays)?;
        let device = lexican_eds::device(&input);
        let sheet = DataSheet { device, diagnostics: Diagnostics::default(), library, input };
        // If it has no object, load it with findings, which say why.
        if sheet.device.objects.is_empty() { DataSheet::new(sheet.input) } else { Ok(sheet) }
    }

    /// The findings that are errors: something could not be read.
    pub fn errors(&self) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics.iter().filter(|finding| finding.severity == Severity::Error)
    }
}

/// The texts with this name, from a file or else from the library.
pub fn find(name: &str) -> Result<Input, DataSheetError> {
    find_known(name).map(|(input, _)| input)
}

/// As [`find`], with the id of the device if it is from the library.
pub fn find_known(name: &str) -> Result<(Input, Option<&'static str>), DataSheetError> {
    let path = Path::new(name);
    if path.is_file() {
        return Ok((Input::new(read(path)?), None));
    }
    match find_shipped(name) {
        Err(_) if looks_like_a_file(path) => {
            let error = ReadError { path: path.to_owned(), error: no_file(path) };
            Err(DataSheetError::NoFile { name: name.to_owned(), error })
        }
        found => found,
    }
}

/// The texts of a device in the library, with its id.
pub fn find_shipped(name: &str) -> Result<(Input, Option<&'static str>), DataSheetError> {
    let shipped = library::find(name).ok_or_else(|| DataSheetError::Unknown { name: name.to_owned() })?;
    Ok((shipped.input(), Some(shipped.id)))
}

/// A name as another file gives it: a data sheet in the folder of that file, or else a device of the library.
#[must_use]
pub fn beside(folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    if path.is_file() { path.display().to_string() } else { name.to_owned() }
}

/// Adds overlays from files.
pub fn with_overlays(input: Input, overlays: &[PathBuf]) -> Result<Input, ReadError> {
    overlays.iter().try_fold(input, |input, path| Ok(input.overlay(read(path)?)))
}

/// The error for a name that is not a readable file.
fn no_file(path: &Path) -> io::Error {
    match std::fs::metadata(path) {
        Ok(data) if data.is_dir() => io::ErrorKind::IsADirectory.into(),
        Ok(_) => io::Error::other("it is not a regular file"),
        Err(error) => error,
    }
}

fn looks_like_a_file(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    path.exists() || Format::of(path).is_some() || extension == "txt" || path.is_absolute()
}

/// A hint with similar names, the most similar first.
fn similar(name: &str) -> String {
    let similarity = |shipped: &library::Shipped| {
        let names = shipped.names.iter().copied().chain([shipped.id]).chain(shipped.id.split('/'));
        names.map(|known| similarity(known, name)).fold(0.0, f64::max)
    };
    let all = library::all().iter().map(|shipped| (similarity(shipped), shipped.id));
    let mut near: Vec<_> = all.filter(|(similarity, _)| *similarity > 0.85).collect();
    near.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    if near.is_empty() {
        "give the path of an EDS, DCF or XDD file, or one of the devices that `lexican devices` lists".to_owned()
    } else {
        let names: Vec<_> = near.into_iter().map(|(_, id)| id).collect();
        format!("did you mean {}?", names.join(" or "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_device_is_recognised() {
        for name in ["siko/ag03-3", "siko/ag031", "SIKO/AG03", "ag03-1", "siko-ag03-1"] {
            let advice = similar(name);
            assert!(advice.starts_with("did you mean siko/ag03-1"), "{name}: {advice}");
        }
        assert!(similar("lenze").starts_with("give the path"));
    }

    #[test]
    fn a_device_of_the_library_is_known_as_such() {
        assert_eq!(DataSheet::load("SikoAG03.eds", &[]).unwrap().library, Some("siko/ag03-1"));
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../cli/tests/sensor.eds");
        assert_eq!(DataSheet::load(file, &[]).unwrap().library, None);
    }

    #[test]
    fn what_is_no_data_sheet_says_what_to_do() {
        for (name, words, remedy) in [
            ("lenze", "no file and no known device is called \"lenze\"", "give the path"),
            ("missing.eds", "cannot read missing.eds: ", "give the path"),
            (env!("CARGO_MANIFEST_DIR"), "cannot read ", "give the path"),
            (concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"), ":1:1: the file describes no object", "[FileInfo]"),
        ] {
            let error = DataSheet::load(name, &[]).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
            assert!(error.remedy().unwrap().contains(remedy), "{error:?}");
        }
        let error = DataSheet::load("siko/ag02", &["missing.toml".into()]).unwrap_err();
        assert!(matches!(&error, DataSheetError::Read(ReadError { path, .. }) if path == Path::new("missing.toml")));
        assert_eq!(error.remedy(), None);
    }
}
