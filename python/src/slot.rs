//! A drive until it is closed, and how it is stopped.

use std::sync::Arc;

use lexican_driver::shared::{self, StopHandle};
use lexican_driver::{Any, Error};
use lexican_machine::{MachineError, tokio as shell};
use lexican_runtime::host::tokio::Runner;
use pyo3::prelude::*;
use tokio::sync::Mutex;

use crate::error::OrRaise;
use crate::wait::{Run, Unlocked};

type Described = shared::Drive<Any, shell::Drive>;

/// The drive itself, until it is closed.
pub(crate) struct Slot {
    pub(crate) drive: Unlocked<Arc<Mutex<Option<Described>>>>,
    pub(crate) runner: Run,
    pub(crate) stop: StopHandle,
}

impl Slot {
    pub(crate) fn new(drive: shell::Drive, runner: Run) -> Self {
        let stop = StopHandle::default();
        let drive = shared::Drive::new(drive, Runner::clone(&runner), stop.clone());
        Slot { drive: Unlocked::new(Arc::new(Mutex::new(Some(drive)))), runner, stop }
    }

    /// Stops it, if it may be moving, waits until it stands, and lets it go.
    pub(crate) fn end(&self) -> PyResult<()> {
        self.stop.stop();
        let drive = self.runner.block_on(self.drive.lock()).take();
        match drive.map(|mut drive| stopped(&mut drive, &self.stop)) {
            None | Some(MachineError::Drive(Error::Cancelled { .. })) => Ok(()),
            Some(error) => Err(error).or_raise(),
        }
    }
}

/// Stops a drive that may be moving, and waits until it stands; what that comes to.
pub(crate) fn stopped(drive: &mut Described, stop: &StopHandle) -> MachineError {
    stop.stop();
    let nothing: Result<(), MachineError> = drive.call(async |_| std::future::pending().await);
    nothing.expect_err("what has no end was cancelled")
}
