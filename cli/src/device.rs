//! Which device a command is about: a data sheet in a file, or one that lexican brings along.

use std::io::Read;
use std::path::{Path, PathBuf};

use lexican_eds::model::Device;
use lexican_eds::{Diagnostics, Input, Source, library};

use crate::output::{Failure, warn};

/// The arguments that name a device.
#[derive(clap::Args, Debug)]
pub(crate) struct DeviceArgs {
    /// An EDS or DCF file, or a device that lexican knows, such as siko/ag03-1 (see `lexican devices`)
    #[arg(value_name = "FILE|DEVICE")]
    device: String,

    /// Corrections and meanings beside the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,
}

impl DeviceArgs {
    /// The texts that describe the device.
    pub(crate) fn input(&self) -> Result<Input, Failure> {
        with_overlays(input(&self.device)?, &self.overlay)
    }

    /// What the device was called.
    pub(crate) fn name(&self) -> &str {
        &self.device
    }

    /// The device, as far as its data sheet can be read.
    pub(crate) fn load(&self) -> Result<Loaded, Failure> {
        Loaded::new(self.input()?)
    }
}

/// A device with what was found while reading its data sheet.
pub(crate) struct Loaded {
    pub(crate) input: Input,
    pub(crate) device: Device,
    pub(crate) diagnostics: Diagnostics,
}

impl Loaded {
    /// Reads a data sheet; one without any object is a failure, whose reasons are shown.
    pub(crate) fn new(input: Input) -> Result<Self, Failure> {
        let (device, diagnostics) = lexican_eds::load(&input);
        let loaded = Loaded { input, device, diagnostics };
        if loaded.device.objects.is_empty() {
            loaded.show_errors();
            return Err(no_object(&loaded.input));
        }
        Ok(loaded)
    }

    /// The device of this name, with errors of its data sheet as warnings.
    pub(crate) fn named(name: &str) -> Result<Self, Failure> {
        let loaded = Loaded::new(input(name)?)?;
        let errors = loaded.diagnostics.count(lexican_eds::Severity::Error);
        if errors > 0 {
            let name = loaded.input.eds.name();
            warn(format_args!("{name} has {errors} errors; `lexican eds lint {name}` shows them"));
        }
        Ok(loaded)
    }

    /// Shows errors in full on stderr; returns whether there are any.
    pub(crate) fn show_errors(&self) -> bool {
        let errors = self.diagnostics.iter().filter(|finding| finding.severity == lexican_eds::Severity::Error);
        let mut any = false;
        for finding in errors {
            any = true;
            anstream::eprintln!("{}\n", finding.render(&self.input));
        }
        any
    }
}

/// A text is no data sheet, whatever else is wrong with it.
pub(crate) fn no_object(input: &Input) -> Failure {
    Failure::new(format_args!("{}:1:1: the file describes no object", input.eds.name())).help(
        "is it an electronic data sheet? It begins with a line [FileInfo] and lists objects in [MandatoryObjects]",
    )
}

/// The texts of the device with this name: a file, else one of the library.
pub(crate) fn input(name: &str) -> Result<Input, Failure> {
    let path = Path::new(name);
    if path.is_file() {
        return Ok(Input::new(read(path)?));
    }
    if let Some(shipped) = library::find(name) {
        return Ok(shipped.input());
    }
    let failure = if looks_like_a_file(path) {
        Failure::file("read", path, &read_error(path))
    } else {
        Failure::new(format_args!("no file and no known device is called {name:?}"))
    };
    Err(failure.help(advice(name)))
}

/// The same with overlays from files.
pub(crate) fn with_overlays(input: Input, overlays: &[PathBuf]) -> Result<Input, Failure> {
    overlays.iter().try_fold(input, |input, path| Ok(input.overlay(read(path)?)))
}

/// A text file, whatever its encoding.
pub(crate) fn read(path: &Path) -> Result<Source, Failure> {
    // One byte beyond the bound is enough to be refused, which is a finding.
    let bytes = read_up_to(path, lexican_eds::text::MAX_BYTES + 1)?;
    Ok(Source::from_bytes(path.display().to_string(), &bytes))
}

/// The first bytes of a file: it may be larger than the memory, or have no end.
pub(crate) fn read_up_to(path: &Path, bound: usize) -> Result<Vec<u8>, Failure> {
    let failed = |error| Failure::file("read", path, &error);
    let file = std::fs::File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(bound as u64).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

fn read_error(path: &Path) -> std::io::Error {
    match std::fs::metadata(path) {
        Ok(data) if data.is_dir() => std::io::ErrorKind::IsADirectory.into(),
        Ok(_) => std::io::Error::other("it is not a regular file"),
        Err(error) => error,
    }
}

fn looks_like_a_file(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    path.exists() || extension == "eds" || extension == "dcf" || extension == "txt" || path.is_absolute()
}

/// Which devices could have been meant.
fn advice(name: &str) -> String {
    let near: Vec<_> = library::all()
        .iter()
        .filter(|shipped| {
            let names = shipped.names.iter().chain([&shipped.id]);
            names.clone().any(|known| near(known, name)) || shipped.id.split('/').any(|part| near(part, name))
        })
        .map(|shipped| shipped.id)
        .collect();
    if near.is_empty() {
        "give the path of an EDS or DCF file, or one of the devices that `lexican devices` lists".to_owned()
    } else {
        format!("did you mean {}?", near.join(" or "))
    }
}

fn near(known: &str, name: &str) -> bool {
    strsim::jaro_winkler(&known.to_lowercase(), &name.to_lowercase()) > 0.85
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_device_is_recognised() {
        for name in ["siko/ag03-2", "siko/ag031", "SIKO/AG03", "ag03-1", "siko-ag03-1"] {
            assert_eq!(advice(name), "did you mean siko/ag03-1?", "{name}");
        }
        assert!(advice("lenze").starts_with("give the path"));
    }
}
