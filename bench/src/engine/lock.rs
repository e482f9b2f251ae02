//! Locks of the threads.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks, and ignores poisoning: a thread that panicked has left the data whole.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
