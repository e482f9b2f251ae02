//! Locks of the threads.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// A thread that panics has done no harm to what it held.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
