//! Long-running jobs, as clients see them.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use super::lock::lock;
use crate::model::Model;
use crate::request::{Answer, Refused};
use crate::view;

/// Counts jobs, from 1.
static NUMBER: AtomicU32 = AtomicU32::new(1);

/// A running job. Dropping it before its end means that it was interrupted.
pub(super) struct Job {
    model: Arc<Mutex<Model>>,
    number: u32,
    name: String,
    has_ended: AtomicBool,
}

impl Job {
    /// Begins a job.
    pub(super) fn begin(model: &Arc<Mutex<Model>>, name: String) -> Self {
        let job = Job {
            model: Arc::clone(model),
            number: NUMBER.fetch_add(1, Ordering::Relaxed),
            name,
            has_ended: AtomicBool::new(false),
        };
        job.show(None, "waits for its turn".to_owned(), None);
        job
    }

    /// Reports the progress: from 0 to 1, and a text.
    pub(super) fn progress(&self, done: f64, text: String) {
        self.show(Some(done), text, None);
    }

    /// Reports the end.
    pub(super) fn end(&self, is_success: bool, text: String) {
        self.show(Some(1.0), text, Some(is_success));
    }

    /// Reports the end if `result` is a refusal.
    pub(super) fn conclude(&self, result: &Result<Answer, Refused>) {
        if let Err(refused) = result {
            self.end(false, refused.why.clone());
        }
    }

    fn show(&self, done: Option<f64>, text: String, is_success: Option<bool>) {
        self.has_ended.store(is_success.is_some(), Ordering::Relaxed);
        let job = view::Job { number: self.number, name: self.name.clone(), done, text, is_success };
        lock(&self.model).set_job(job);
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        if !self.has_ended.load(Ordering::Relaxed) {
            self.end(false, Refused::interrupted().why);
        }
    }
}
