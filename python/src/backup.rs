//! Backup and restore of nodes and machines.

use std::ops::ControlFlow;
use std::path::Path;

use lexican_machine::parameters::{
    ParametersError, Restored as Done, backup_machine, backup_node, restore_machine, restore_node,
};
use lexican_machine::tokio as shell;
use lexican_runtime::host::tokio::Runner;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::parameters::archive::Archive;
use lexican_toolbox::parameters::restore::{Options, configured, domains as files};
use lexican_toolbox::parameters::{Ended, OnProgress, Progress};
use lexican_toolbox::text::time_of_day;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::error::{OrRaise, Raise, also, wrong};
use crate::frames::unix_time;
use crate::wait::Run;

/// What a restore has done.
#[pyclass(module = "lexican", frozen, get_all)]
pub(crate) struct Restored {
    /// Index and sub-index of what was written, in this order.
    written: Vec<(u16, u8)>,
    /// How many had their value.
    equal: usize,
    /// Whether the node has stored its parameters.
    stored: bool,
}

impl From<Done> for Restored {
    fn from(Done { outcome, .. }: Done) -> Self {
        let written = outcome.written.iter().map(|address| (address.index(), address.sub())).collect();
        Restored { written, equal: outcome.equal, stored: outcome.stored }
    }
}

/// A function of the program.
pub(crate) type Call = Option<Py<PyAny>>;

/// A backup or a restore, and who sees what is done.
pub(crate) struct Seen<'py>(pub(crate) Python<'py>, pub(crate) Run, pub(crate) Call);

impl<'py> Seen<'py> {
    /// Does something without the interpreter's lock, until a signal or the function of the program raises.
    fn by<T: Send>(
        &self,
        work: impl FnOnce(&Runner, OnProgress<'_>) -> Result<T, ParametersError> + Send,
    ) -> PyResult<T> {
        let (mut raised, runner, function) = (None, &**self.1, self.2.as_ref());
        let done = self.0.detach(|| {
            work(runner, &mut |progress| {
                let step = match progress {
                    Progress::Reading { address, at, of } => Some((format!("reading {address}"), at, of)),
                    Progress::Writing { address, at, of } => Some((format!("writing {address}"), at, of)),
                    Progress::Storing => Some(("storing".to_owned(), 1, 1)),
                    Progress::Transferring { .. } | Progress::Written { .. } => None,
                };
                let seen = Python::attach(|py| {
                    py.check_signals()?;
                    step.zip(function).map_or(Ok(()), |(step, function)| function.call1(py, step).map(drop))
                });
                raised = seen.err();
                if raised.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        });
        done.map_err(|error| match raised {
            Some(raised) => also(self.0, raised, &error.to_string()),
            None => error.raise(),
        })
    }

    /// Saves the parameters of a node. What it did not give.
    pub(crate) fn save(&self, node: &shell::Node, path: &Path, domains: bool) -> PyResult<Vec<String>> {
        let mut backup = self.by(|runner, see| backup_node(node, runner, domains, see))?;
        for (file, data) in backup.domain_files(&path.file_stem().unwrap_or_default().to_string_lossy()) {
            std::fs::write(path.with_file_name(file), data)?;
        }
        std::fs::write(path, backup.dcf())?;
        Ok(backup.left_out.iter().map(|(address, why)| format!("{address}: {why}")).collect())
    }

    /// Saves the parameters of a machine. What is missing.
    pub(crate) fn save_all(&self, machine: &shell::Machine, path: &Path) -> PyResult<Vec<String>> {
        let made = time_of_day::of_unix((unix_time() * 1e3) as u64).unwrap_or_default();
        let archive = self.by(|runner, see| backup_machine(machine, runner, made, see))?;
        std::fs::write(path, archive.to_bytes()?)?;
        Ok(archive.missing().collect())
    }

    /// Writes the parameters of a DCF into a node.
    pub(crate) fn write(&self, node: &shell::Node, path: &Path, store: bool, force: bool) -> PyResult<Restored> {
        let dcf = DataSheet::load_unjudged(&path.to_string_lossy(), &[]).or_raise()?.device;
        let mut settings = configured(&dcf, node.id());
        settings.extend(files(&dcf, node.id(), path.parent().unwrap_or(Path::new(""))).map_err(wrong)?);
        let options = Options { store, ..Options::default() };
        self.by(|runner, see| restore_node(node, runner, (&dcf, &settings), options, force, see)).map(Restored::from)
    }

    /// Writes the parameters of a backup into the nodes that it has.
    pub(crate) fn write_all(
        &self,
        machine: &shell::Machine,
        path: &Path,
        store: bool,
        force: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let archive = Archive::read(&std::fs::read(path)?).map_err(wrong)?;
        let options = Options { store, ..Options::default() };
        let restored = self.by(|runner, see| restore_machine(machine, runner, &archive, options, force, see))?;
        restored.into_iter().map(|it| (it.node.clone(), Restored::from(it))).into_py_dict(self.0)
    }
}

impl Raise for ParametersError {
    fn raise(self) -> PyErr {
        let text = self.to_string();
        match self {
            ParametersError::Machine(error) => error.raise(),
            ParametersError::Ended(Ended::Lost(error)) => error.raise(),
            ParametersError::Interrupted { ended: Ended::Lost(error), restored } => {
                Python::attach(|py| also(py, error.raise(), &format!("{restored}; the same call goes on from there")))
            }
            _ => wrong(text),
        }
    }
}
