//! The errors of a machine at work.

use std::path::Path;

use lexican_driver::NotADrive;
use lexican_eds::Source;
use lexican_runtime::host::url::OpenError;
use lexican_runtime::host::{AccessError, BootNetworkError, BusUrl, BusUrlError, LinkError};
use lexican_toolbox::drive::Ending;
use lexican_toolbox::lss::Trouble;
use lexican_toolbox::text::files::ReadError;
use lexican_toolbox::values::lookup::ObjectError;

use super::BoxedLink;
use crate::draft::quoted;
use crate::files::Files;
use crate::model::{Machine, Node, WhichBus};
use crate::read::similar;

/// Why a machine at work has failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names of fields say what they are")]
pub enum MachineError {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{file} cannot be used\n\n{findings}")]
    Wrong { file: String, findings: String },
    #[error("{0}; machine.toml#NAME is one")]
    WhichBus(#[from] WhichBus),
    #[error("{file} has {buses} buses, and {links} links are given")]
    Links { file: String, buses: usize, links: usize },
    #[error("{0} names no bus: [bus] url = \"can0\"")]
    NoBus(String),
    #[error(transparent)]
    Url(#[from] BusUrlError),
    #[error("cannot open {url}: {error}")]
    Open { url: BusUrl, error: OpenError },
    #[error(transparent)]
    Io(#[from] std::io::Error),
    #[error("{file}: there is no node {name:?}; {help}")]
    NoNode { file: String, name: String, help: String },
    #[error("{node} has no {what}")]
    Lacking { node: String, what: &'static str },
    #[error("{node}: {error}; {}", .error.advice())]
    Object { node: String, error: ObjectError },
    #[error("{node}: {what}")]
    Value { node: String, what: String },
    #[error("{node}: {error}")]
    Access { node: String, error: AccessError },
    #[error(transparent)]
    Lss(#[from] Trouble),
    #[error(transparent)]
    Boot(#[from] BootNetworkError),
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error("{node} is no drive: {error}")]
    NotADrive { node: String, error: NotADrive },
    #[error(transparent)]
    Drive(#[from] lexican_driver::Error),
    #[error("{node}: {ending}; all drives that moved with it are stopped")]
    Together { node: String, ending: Ending },
}

impl Machine {
    /// The machine, if its file has no errors. Warnings are ignored; `lexican machine check` shows them.
    ///
    /// Errors: [`MachineError::Wrong`].
    pub fn sound(self) -> Result<Self, MachineError> {
        let findings = self.errors();
        if findings.is_empty() { Ok(self) } else { Err(MachineError::Wrong { file: self.file().to_owned(), findings }) }
    }

    /// Reads a file without errors, with all its buses or the one named as in `machine.toml#left`.
    pub fn of_path(name: &Path) -> Result<Self, MachineError> {
        let (path, bus) = Machine::file_and_bus(name);
        let machine = Machine::open(path)?.sound()?;
        Ok(if bus.is_some() { machine.into_bus(bus)? } else { machine })
    }

    /// A machine without a file, made of nodes in the words of a file, as [`node_words`](Machine::node_words) writes
    /// them. Errors refer to it as `name`.
    pub fn of_words(name: &str, words: &str) -> Result<Self, MachineError> {
        Machine::parse(Source::new(name, words), Files::Folder(Path::new("."))).sound()
    }

    /// A node in the words of a machine's file.
    #[must_use]
    pub fn node_words(name: &str, id: u8, sheet: &str, overlays: &[String]) -> String {
        let overlays: Vec<_> = overlays.iter().map(|overlay| quoted(overlay)).collect();
        let (name, sheet) = (quoted(name), quoted(sheet));
        format!("[node.{name}]\nid = {id}\nsheet = {sheet}\noverlay = [{}]\n", overlays.join(", "))
    }

    /// Opens the bus that the file names, if the runtime has this kind of link built in.
    pub fn link(&self) -> Result<BoxedLink, MachineError> {
        let url = self.bus.url.as_ref().ok_or_else(|| MachineError::NoBus(self.file().to_owned()))?;
        let url: BusUrl = url.parse()?;
        url.open().map_err(|error| MachineError::Open { url, error })
    }

    /// Opens all its buses.
    pub fn links(&self) -> Result<Vec<BoxedLink>, MachineError> {
        self.buses().map(Machine::link).collect()
    }

    /// The names of all its nodes.
    pub(super) fn names(&self) -> Vec<&str> {
        self.buses().flat_map(|bus| &bus.nodes).map(|node| node.name.as_str()).collect()
    }

    /// The name of its file.
    pub(super) fn file(&self) -> &str {
        self.input.eds.name()
    }

    /// The position of the bus of the node with this name, and that of the node on this bus.
    pub(super) fn place(&self, name: &str) -> Result<(usize, usize), MachineError> {
        let at = |machine: &Machine| machine.nodes.iter().position(|node| node.name.value == name);
        self.buses().enumerate().find_map(|(bus, machine)| Some((bus, at(machine)?))).ok_or_else(|| {
            let names = self.names();
            let help =
                similar(name, names.iter().copied()).unwrap_or_else(|| format!("there are {}", names.join(", ")));
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
