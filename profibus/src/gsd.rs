//! The start-up data of a slave, from its GSD file.

use std::format;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::sync::Arc;
use std::vec::Vec;

use gsd_parser::{GenericStationDescription, Module, PrmBuilder, parser};
use profirust::Baudrate;
use profirust::dp::PeripheralOptions;

use crate::dp::{Lengths, lengths};

/// Separates the names of a modular slave's modules.
pub const SEPARATOR: char = '|';

/// The data of a GSD file for a slave with certain modules.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// The name of the slave.
    pub model: String,
    /// The ident number.
    pub ident: u16,
    /// The data of Chk_Cfg.
    pub configuration: Vec<u8>,
    /// The data of Set_Prm after the first seven bytes.
    pub parameters: Vec<u8>,
    /// The longest time before an answer (maximum T_SDR) at the given bit rate, in bits.
    pub max_tsdr: u16,
}

/// Why a GSD file gives no configuration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum GsdError {
    /// The file cannot be read.
    #[error("{}: {reason}", path.display())]
    File {
        path: PathBuf,
        /// From the operating system, or where the file is not valid.
        reason: String,
    },
    /// There is no such module.
    #[error("{}: there is no module {wanted:?}; there is {}", path.display(), list(known))]
    NoModule {
        path: PathBuf,
        /// The name that was asked for.
        wanted: String,
        known: Vec<String>,
    },
    /// Several modules, or none, carry the expected data.
    #[error("{}: which module carries {} bytes of inputs and {} of outputs? There is {}", path.display(),
        expected.inputs, expected.outputs, list(known))]
    WhichModule { path: PathBuf, expected: Lengths, known: Vec<String> },
    /// The modules carry other data.
    #[error("{}: {modules} carries {}, and {} bytes of inputs and {} of outputs are expected", path.display(),
        said(*found), expected.inputs, expected.outputs)]
    OtherLengths {
        path: PathBuf,
        modules: String,
        /// The data that they carry, if that can be read.
        found: Option<Lengths>,
        expected: Lengths,
    },
}

fn list(names: &[String]) -> String {
    names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
}

fn said(lengths: Option<Lengths>) -> String {
    lengths
        .map_or("unknown data".to_string(), |it| format!("{} bytes of inputs and {} of outputs", it.inputs, it.outputs))
}

impl Configuration {
    /// Reads a GSD file. `modules` names the modules of the slave, separated by [`SEPARATOR`]; `None` takes the only
    /// one that carries as much data as `expected`.
    pub fn read(path: &Path, modules: Option<&str>, expected: Lengths, bit_rate: Baudrate) -> Result<Self, GsdError> {
        let file = |reason: String| GsdError::File { path: path.into(), reason };
        let bytes = std::fs::read(path).map_err(|error| file(error.to_string()))?;
        // The parser panics if the file refers to something that it does not define.
        let parsed = catch_unwind(|| {
            let parsed = parser::parse(path, &String::from_utf8_lossy(&bytes));
            parsed.map_err(|error| format!("no GSD file, {} at {:?}", error.variant.message(), error.line().trim()))
        });
        let gsd = parsed.unwrap_or_else(|_| Err(INCONSISTENT.into())).map_err(file)?;
        let known = || gsd.available_modules.iter().map(|module| module.name.clone()).collect();
        let plugged: Vec<&Arc<Module>> = match modules {
            Some(names) => {
                let find = |wanted: &str| {
                    let found = gsd.available_modules.iter().find(|module| module.name.trim() == wanted.trim());
                    let none = || GsdError::NoModule { path: path.into(), wanted: wanted.into(), known: known() };
                    found.ok_or_else(none)
                };
                names.split(SEPARATOR).map(find).collect::<Result<_, _>>()?
            }
            None => {
                let mut fits = gsd.available_modules.iter().filter(|one| lengths(&one.config) == Some(expected));
                match (fits.next(), fits.next()) {
                    (Some(only), None) => Vec::from([only]),
                    _ => return Err(GsdError::WhichModule { path: path.into(), expected, known: known() }),
                }
            }
        };
        let configuration: Vec<u8> = plugged.iter().flat_map(|module| module.config.iter().copied()).collect();
        let found = lengths(&configuration);
        if found != Some(expected) {
            let modules = plugged.iter().map(|module| module.name.as_str()).collect::<Vec<_>>().join(" | ");
            return Err(GsdError::OtherLengths { path: path.into(), modules, found, expected });
        }
        let parameters = catch_unwind(|| {
            let of_modules = plugged.iter().map(|module| &module.module_prm_data);
            core::iter::once(&gsd.user_prm_data)
                .chain(of_modules)
                .flat_map(|it| PrmBuilder::new(it).into_bytes())
                .collect()
        });
        Ok(Configuration {
            parameters: parameters.map_err(|_| file(INCONSISTENT.into()))?,
            configuration,
            max_tsdr: max_tsdr(&gsd, bit_rate),
            ident: gsd.ident_number,
            model: gsd.model,
        })
    }

    /// As options of the master; the memory is kept until the program ends.
    #[must_use]
    pub fn into_options(self) -> PeripheralOptions<'static> {
        PeripheralOptions {
            ident_number: self.ident,
            max_tsdr: self.max_tsdr,
            user_parameters: Some(Vec::leak(self.parameters)),
            config: Some(Vec::leak(self.configuration)),
            ..PeripheralOptions::default()
        }
    }
}

const INCONSISTENT: &str = "it refers to what it does not define, or a default is outside its range";

fn max_tsdr(gsd: &GenericStationDescription, bit_rate: Baudrate) -> u16 {
    let of = &gsd.max_tsdr;
    match bit_rate {
        Baudrate::B9600 => of.b9600,
        Baudrate::B19200 => of.b19200,
        Baudrate::B31250 => of.b31250,
        Baudrate::B45450 => of.b45450,
        Baudrate::B93750 => of.b93750,
        Baudrate::B187500 => of.b187500,
        Baudrate::B500000 => of.b500000,
        Baudrate::B1500000 => of.b1500000,
        Baudrate::B3000000 => of.b3000000,
        Baudrate::B6000000 => of.b6000000,
        Baudrate::B12000000 => of.b12000000,
    }
}
