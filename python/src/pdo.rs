//! PDOs of a node: what came last, and how long ago.

use std::sync::Arc;

use lexican_eds::model::{Device, Mapped};
use lexican_runtime::Frame;
use lexican_runtime::host::tokio as shell;
use lexican_runtime::manager;
use lexican_toolbox::decode::content;
use lexican_toolbox::pdo::PdoState;
use lexican_toolbox::values::DeviceValues;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tokio::sync::broadcast::error::RecvError;

use crate::error::OrRaise;
use crate::heard::Heard;
use crate::opened::Shared;
use crate::value::by_name;
use crate::wait::{lock, seconds, wait, within};

/// A PDO that a node sends, by its data sheet or by the machine's file.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Pdo {
    pub(crate) shared: Arc<Shared>,
    pub(crate) heard: Heard,
    pub(crate) network: shell::Network,
    pub(crate) device: Arc<Device>,
    pub(crate) state: PdoState,
}

impl Pdo {
    fn values<'py>(&self, py: Python<'py>, frame: &Frame) -> PyResult<Bound<'py, PyDict>> {
        let mapped = self.state.mapping.iter();
        let mapped = mapped.map(|it| Mapped { index: it.address.index(), sub: it.address.sub(), bits: it.bits });
        by_name(py, content(&mut DeviceValues::new(&self.device), &mapped.collect::<Vec<_>>(), frame.data()))
    }
}

#[pymethods]
impl Pdo {
    /// "TPDO1".
    #[getter]
    fn name(&self) -> String {
        self.state.name.to_string()
    }

    /// Its COB-ID.
    #[getter]
    fn cob_id(&self) -> u32 {
        self.state.cob_id.id().raw()
    }

    /// The values that came last, by the names of their entries, and how many seconds ago; `None` if none has come. The last ones known
    /// need not be the present ones: a PDO may be lost, and its node off.
    fn latest<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyDict>, f64)>> {
        let (_, runner) = self.shared.network()?;
        let Some((at, frame)) = lock(&self.heard).get(&self.state.cob_id.id()).copied() else { return Ok(None) };
        let now = wait(py, &runner, self.network.now())?.or_raise()?;
        Ok(Some((self.values(py, &frame)?, now.since(at).as_secs_f64())))
    }

    /// Waits for the next that comes from now on, no longer than so many seconds by the time of the bus; `None` if none has come.
    #[pyo3(signature = (timeout = None))]
    fn next<'py>(&self, py: Python<'py>, timeout: Option<f64>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let (_, runner) = self.shared.network()?;
        let (mut events, id) = (self.network.events(), self.state.cob_id.id());
        let next = async {
            loop {
                match events.recv().await {
                    Ok(shell::Event::Manager(manager::Event::Pdo { frame, .. })) if frame.id() == id => {
                        return Some(frame);
                    }
                    Err(RecvError::Closed) => return None,
                    _ => {}
                }
            }
        };
        let frame = wait(py, &runner, within(&self.network, timeout.map(seconds).transpose()?, next))?.or_raise()?;
        frame.map(|frame| self.values(py, &frame)).transpose()
    }
}
