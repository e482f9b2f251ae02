//! Faults of simulated devices, each for as long as a `with` lasts.

use std::sync::Arc;

use lexican_runtime::host::Fate;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::error::OrRaise;
use crate::opened::{Shared, no_device};
use crate::wait::lock;

/// A fault of a simulated device, which lasts as long as its `with`.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Fault {
    pub(crate) shared: Arc<Shared>,
    pub(crate) node: String,
    /// `None` if it has no power.
    pub(crate) fate: Option<Fate>,
}

impl Fault {
    fn turn(&self, on: bool) -> PyResult<()> {
        let Some(fate) = self.fate else {
            return self.shared.carry_out(&self.node, if on { "power off" } else { "power on" }).map(drop);
        };
        let it = (self.shared.machine()?.0.node(&self.node).or_raise()?.id(), fate);
        self.shared.with(|opened| {
            let simulation = opened.simulations.iter().find(|simulation| simulation.has(&self.node));
            let mut faults = lock(&simulation.ok_or_else(|| no_device(&self.node))?.faults);
            match faults.iter().rposition(|other| *other == it) {
                Some(at) if !on => drop(faults.remove(at)),
                _ if on => faults.push(it),
                _ => {}
            }
            Ok(())
        })
    }
}

#[pymethods]
impl Fault {
    fn __enter__(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.turn(true))
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        py.detach(|| self.turn(false))
    }
}
