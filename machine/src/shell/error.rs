//! Why a machine does not do what it was asked.

use std::path::Path;

use lexican_driver::NotADrive;
use lexican_runtime::host::url::OpenError;
use lexican_runtime::host::{AccessError, BootNetworkError, BusUrl, BusUrlError, Link, LinkError};
use lexican_toolbox::drive::Ending;
use lexican_toolbox::text::files::ReadError;
use lexican_toolbox::values::lookup::ObjectError;

use crate::model::{Machine, Node, WhichBus};
use crate::read::similar;

/// Why a machine does not do what it was asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has mistakes, which are shown with their lines.
    #[error("{file} cannot be used\n\n{findings}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    Wrong { file: String, findings: String },
    /// It has several buses.
    #[error("{0}; machine.toml#NAME is one")]
    WhichBus(#[from] WhichBus),
    /// The file names no bus.
    #[error("{0} names no bus: [bus] url = \"can0\"")]
    NoBus(String),
    /// What it names is no bus.
    #[error(transparent)]
    Url(#[from] BusUrlError),
    /// The bus cannot be opened.
    #[error("cannot open {url}: {error}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    Open { url: BusUrl, error: OpenError },
    /// There is no runtime.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// There is no node of this name.
    #[error("{file}: there is no node {name:?}; {help}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    NoNode { file: String, name: String, help: String },
    /// A node lacks what it is asked for: a data sheet, a node-ID.
    #[error("{node} has no {what}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    Lacking { node: String, what: &'static str },
    /// There is no object of this name.
    #[error("{node}: {error}; {}", .error.advice())]
    #[allow(missing_docs, reason = "the names say what it is")]
    Object { node: String, error: ObjectError },
    /// A value is none of the object, or not allowed.
    #[error("{node}: {what}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    Value { node: String, what: String },
    /// A node does not answer, or refuses.
    #[error("{node}: {error}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    Access { node: String, error: AccessError },
    /// The machine has not booted.
    #[error(transparent)]
    Boot(#[from] BootNetworkError),
    /// The bus is gone.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The data sheet of a node is not that of a drive.
    #[error("{node} is no drive: {error}")]
    #[allow(missing_docs, reason = "the names say what it is")]
    NotADrive { node: String, error: NotADrive },
    /// A drive does not do what it was ordered.
    #[error(transparent)]
    Drive(#[from] lexican_driver::Error),
    /// One of several drives has not reached its target, and so all have been stopped.
    #[error("{node}: {ending}; all drives that moved with it are stopped")]
    #[allow(missing_docs, reason = "the names say what it is")]
    Together { node: String, ending: Ending },
}

impl Machine {
    /// The machine, if nothing is wrong in its file. Warnings are left to `lexican machine check`.
    ///
    /// Errors: [`MachineError::Wrong`].
    pub fn sound(self) -> Result<Self, MachineError> {
        let findings = self.errors();
        if findings.is_empty() { Ok(self) } else { Err(MachineError::Wrong { file: self.file().to_owned(), findings }) }
    }

    /// The machine of a file in which nothing is wrong, on its only bus or the one that is named: `machine.toml#left`.
    pub(super) fn of_bus(name: &Path) -> Result<Self, MachineError> {
        let (path, bus) = Machine::file_and_bus(name);
        Ok(Machine::open(path)?.sound()?.into_bus(bus)?)
    }

    /// Opens the bus that the file names, by a kind of link of the runtime that is built in.
    pub fn link(&self) -> Result<Box<dyn Link + Send>, MachineError> {
        let url = self.bus.url.as_ref().ok_or_else(|| MachineError::NoBus(self.file().to_owned()))?;
        let url: BusUrl = url.parse()?;
        url.open().map_err(|error| MachineError::Open { url, error })
    }

    /// The name of its file.
    fn file(&self) -> &str {
        self.input.eds.name()
    }

    /// The place of the node of this name.
    pub(super) fn place(&self, name: &str) -> Result<usize, MachineError> {
        self.nodes.iter().position(|node| node.name.value == name).ok_or_else(|| {
            let names = || self.nodes.iter().map(|node| node.name.as_str());
            let help = similar(name, names())
                .unwrap_or_else(|| format!("there are {}", names().collect::<Vec<_>>().join(", ")));
            MachineError::NoNode { file: self.file().to_owned(), name: name.to_owned(), help }
        })
    }
}

impl Node {
    pub(super) fn lacks(&self, what: &'static str) -> MachineError {
        MachineError::Lacking { node: self.name.value.clone(), what }
    }

    pub(super) fn wrong(&self, what: impl ToString) -> MachineError {
        MachineError::Value { node: self.name.value.clone(), what: what.to_string() }
    }

    pub(super) fn access(&self, error: AccessError) -> MachineError {
        MachineError::Access { node: self.name.value.clone(), error }
    }
}
