//! A test in its own thread, for programs that wait for one case after another.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use lexican_runtime::host::Link;

use crate::case::Case;
use crate::sheet::Sheet;
use crate::suite::{CaseReport, Observer, Report, run};
use crate::tester::Settings;

/// A running test. Each case waits until the end of the previous one has been taken.
#[derive(Debug)]
pub struct Running {
    ends: Receiver<End>,
    cancelled: Arc<AtomicBool>,
}

/// The end of a case or of the test.
#[derive(Debug)]
pub enum End {
    /// A case.
    Case(Box<CaseReport>),
    /// The whole test: nothing comes after it.
    Test(Box<Report>),
}

impl Running {
    /// Starts the cases in this order, as [`run`] does. `beside` is kept as long as the test, such as simulated devices
    /// on the link.
    pub fn begin<L: Link + Send + 'static>(
        mut link: L,
        beside: impl Send + 'static,
        sheet: Arc<Sheet>,
        settings: Settings,
        cases: Vec<&'static Case>,
    ) -> io::Result<Running> {
        let (sender, ends) = sync_channel(0);
        let cancelled = Arc::<AtomicBool>::default();
        let is_cancelled = Arc::clone(&cancelled);
        let test = move || {
            let report = run(&mut link, &sheet, &settings, &cases, &is_cancelled, &mut Passing(&sender));
            // The receiver may be gone.
            let _ = sender.send(End::Test(Box::new(report)));
            drop(beside);
        };
        std::thread::Builder::new().spawn(test)?;
        Ok(Running { ends, cancelled })
    }

    /// Waits for the next end. Errors: nothing has ended within this time, or the test is over.
    pub fn next(&self, within: Duration) -> Result<End, RecvTimeoutError> {
        self.ends.recv_timeout(within)
    }

    /// Ends the test once everything is put back; [`next`](Running::next) still returns the ends until then.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

/// Sends the ends of cases.
struct Passing<'a>(&'a SyncSender<End>);

impl Observer for Passing<'_> {
    fn begins(&mut self, _: usize, _: usize, _: &Case) {}

    fn ended(&mut self, report: &CaseReport) {
        // The receiver may be gone.
        let _ = self.0.send(End::Case(Box::new(report.clone())));
    }
}
