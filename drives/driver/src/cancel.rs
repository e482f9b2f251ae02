//! Ending an operation from another thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends the operation under way and stops the drive. Clones belong to the same drive.
///
/// The operation ends with [`Error::Cancelled`](crate::Error::Cancelled) once the drive stands. If none is under way,
/// the next operation of any kind ends in this way, before it sends anything else.
///
/// ```no_run
/// # fn run<L: lexican_runtime::host::Link, K: lexican_driver::Kind>(
/// #     drive: &mut lexican_driver::Drive<L, K>,
/// #     on_signal: impl Fn(Box<dyn FnMut() + Send>),
/// # ) -> Result<(), lexican_driver::Error> {
/// let handle = drive.cancel_handle();
/// // For SIGINT and SIGTERM, `ctrlc::set_handler` with its feature "termination", say.
/// on_signal(Box::new(move || handle.cancel()));
/// drive.move_to(5000)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct CancelHandle(Arc<AtomicBool>);

impl CancelHandle {
    /// Cancels, and returns at once.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Release);
    }

    pub(crate) fn take(&self) -> bool {
        self.0.swap(false, Ordering::AcqRel)
    }
}
