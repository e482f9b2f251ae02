//! The device of a command: a data sheet in a file, or a device of the library.

use std::io::Read;
use std::path::{Path, PathBuf};

use lexican_eds::model::Device;
use lexican_eds::{Diagnostics, Input, Source, library};

use crate::output::{Failure, plural, warn};

#[derive(clap::Args, Debug)]
pub(crate) struct DeviceArgs {
    /// An EDS or DCF file, or a device that lexican knows, such as siko/ag03-1 (see `lexican devices`)
    #[arg(value_name = "FILE|DEVICE")]
    device: String,

    /// Corrections and meanings in addition to the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,
}

impl DeviceArgs {
    pub(crate) fn input(&self) -> Result<Input, Failure> {
        with_overlays(input(&self.device)?, &self.overlay)
    }

    pub(crate) fn name(&self) -> &str {
        &self.device
    }

    pub(crate) fn has_overlays(&self) -> bool {
        !self.overlay.is_empty()
    }

    /// The device, as far as its data sheet can be read.
    pub(crate) fn load(&self) -> Result<Loaded, Failure> {
        Loaded::new(self.input()?)
    }
}

/// A device, and the findings about its data sheet.
pub(crate) struct Loaded {
    pub(crate) input: Input,
    pub(crate) device: Device,
    pub(crate) diagnostics: Diagnostics,
}

impl Loaded {
    /// Reads a data sheet. Fails after printing the errors if it has no objects.
    pub(crate) fn new(input: Input) -> Result<Self, Failure> {
        let (device, diagnostics) = lexican_eds::load(&input);
        let loaded = Loaded { input, device, diagnostics };
        if loaded.device.objects.is_empty() {
            loaded.show_errors();
            return Err(no_object(&loaded.input));
        }
        Ok(loaded)
    }

    /// Reads the data sheet of this name; warns about its errors.
    pub(crate) fn named(name: &str) -> Result<Self, Failure> {
        Loaded::with_warning(input(name)?)
    }

    /// As [`Loaded::named`], with overlays.
    pub(crate) fn with_overlays(name: &str, overlays: &[PathBuf]) -> Result<Self, Failure> {
        Loaded::with_warning(with_overlays(input(name)?, overlays)?)
    }

    /// Reads a data sheet; warns about its errors.
    pub(crate) fn with_warning(input: Input) -> Result<Self, Failure> {
        let loaded = Loaded::new(input)?;
        let errors = loaded.diagnostics.count(lexican_eds::Severity::Error);
        if errors > 0 {
            let name = loaded.input.eds.name();
            let overlays = loaded.input.overlays.iter().map(|overlay| format!(" --overlay {}", overlay.name()));
            let overlays: String = overlays.collect();
            let errors = plural(errors, "error");
            warn(format_args!("{name} has {errors}; `lexican eds lint {name}{overlays}` shows them"));
        }
        Ok(loaded)
    }

    /// Prints errors in full on stderr; returns whether there are any.
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

/// The failure for a text that is no data sheet.
pub(crate) fn no_object(input: &Input) -> Failure {
    Failure::new(format_args!("{}:1:1: the file describes no object", input.eds.name())).help(
        "is it an electronic data sheet? It begins with a line [FileInfo] and lists objects in [MandatoryObjects]",
    )
}

/// The data sheet of this name: a file, else a device of the library.
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

/// The name of a device in a file: a data sheet in the folder of the file, else a device that lexican knows.
pub(crate) fn beside(folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    if path.is_file() { path.display().to_string() } else { name.to_owned() }
}

/// Adds overlays from files.
pub(crate) fn with_overlays(input: Input, overlays: &[PathBuf]) -> Result<Input, Failure> {
    overlays.iter().try_fold(input, |input, path| Ok(input.overlay(read(path)?)))
}

/// Reads a text file in any encoding.
pub(crate) fn read(path: &Path) -> Result<Source, Failure> {
    // One byte beyond the bound, so that the file is reported as too large.
    let bytes = read_up_to(path, lexican_eds::text::MAX_BYTES + 1)?;
    Ok(Source::from_bytes(path.display().to_string(), &bytes))
}

/// Reads the first bytes of a file, which may be larger than the memory, or have no end.
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

/// Suggests similar names, the most similar first.
fn advice(name: &str) -> String {
    let similarity = |shipped: &library::Shipped| {
        let names = shipped.names.iter().copied().chain([shipped.id]).chain(shipped.id.split('/'));
        names.map(|known| similarity(known, name)).fold(0.0, f64::max)
    };
    let all = library::all().iter().map(|shipped| (similarity(shipped), shipped.id));
    let mut near: Vec<_> = all.filter(|(similarity, _)| *similarity > 0.85).collect();
    near.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    if near.is_empty() {
        "give the path of an EDS or DCF file, or one of the devices that `lexican devices` lists".to_owned()
    } else {
        let names: Vec<_> = near.into_iter().map(|(_, id)| id).collect();
        format!("did you mean {}?", names.join(" or "))
    }
}

fn similarity(known: &str, name: &str) -> f64 {
    strsim::jaro_winkler(&known.to_lowercase(), &name.to_lowercase())
}

/// Devices for tests.
#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    pub(crate) fn drive() -> Device {
        Loaded::named("siko/ag03-1").unwrap().device
    }

    pub(crate) fn sensor() -> Device {
        let source = Source::new("sensor.eds", include_str!("../tests/sensor.eds"));
        lexican_eds::load(&Input::new(source)).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_device_is_recognised() {
        for name in ["siko/ag03-3", "siko/ag031", "SIKO/AG03", "ag03-1", "siko-ag03-1"] {
            let advice = advice(name);
            assert!(advice.starts_with("did you mean siko/ag03-1"), "{name}: {advice}");
        }
        assert!(advice("lenze").starts_with("give the path"));
    }
}
