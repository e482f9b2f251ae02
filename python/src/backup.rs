//! Backup and restore of nodes and machines.

use std::ops::ControlFlow;

use lexican_machine::parameters::{ParametersError, Restored as Done};
use lexican_runtime::host::tokio::Runner;
use lexican_toolbox::parameters::{Ended, OnProgress, Progress};
use pyo3::prelude::*;

use crate::error::{Raise, also, wrong};

/// The result of a restore.
#[pyclass(module = "lexican", frozen, get_all)]
pub(crate) struct Restored {
    /// Index and sub-index of the entries written, in this order.
    written: Vec<(u16, u8)>,
    /// The number of entries that already had their value.
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

/// A callback of the program.
pub(crate) type Call = Option<Py<PyAny>>;

/// Backs up or restores without the interpreter's lock. The callback, which gets the progress, or a signal ends it by
/// raising.
pub(crate) fn seen<T: Send>(
    py: Python<'_>,
    runner: &Runner,
    function: Call,
    work: impl FnOnce(&Runner, OnProgress<'_>) -> Result<T, ParametersError> + Send,
) -> PyResult<T> {
    let mut raised = None;
    let done = py.detach(|| {
        work(runner, &mut |progress| {
            let step = match progress {
                Progress::Reading { address, at, of } => Some((format!("reading {address}"), at, of)),
                Progress::Writing { address, at, of } => Some((format!("writing {address}"), at, of)),
                Progress::Storing => Some(("storing".to_owned(), 1, 1)),
                Progress::Transferring { .. } | Progress::Written { .. } => None,
            };
            let seen = Python::attach(|py| {
                py.check_signals()?;
                step.zip(function.as_ref()).map_or(Ok(()), |(step, function)| function.call1(py, step).map(drop))
            });
            raised = seen.err();
            if raised.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    done.map_err(|error| match raised {
        Some(raised) => also(py, raised, &error.to_string()),
        None => error.raise(),
    })
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
