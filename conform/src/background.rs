//! A test in a thread of its own, for programs that ask for one case after the other.

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

/// A test that has begun. Each case waits until the end of the one before was taken.
#[derive(Debug)]
pub struct Running {
    ends: Receiver<End>,
    cancelled: Arc<AtomicBool>,
}

/// What has ended.
#[derive(Debug)]
pub enum End {
    /// A case.
    Case(Box<CaseReport>),
    /// The test: nothing comes after it.
    Test(Box<Report>),
}

impl Running {
    /// Begins with cases in this order, as [`run`] does. What is `beside` the link, such as devices that it simulates, lasts as long as the
    /// test.
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
            // Nobody may wait for it.
            let _ = sender.send(End::Test(Box::new(report)));
            drop(beside);
        };
        std::thread::Builder::new().spawn(test)?;
        Ok(Running { ends, cancelled })
    }

    /// Waits for what ends next. Errors: nothing has within this time; or nothing does any more.
    pub fn next(&self, within: Duration) -> Result<End, RecvTimeoutError> {
        self.ends.recv_timeout(within)
    }

    /// Ends it, when all is put back; [`next`](Running::next) still has what ends until then.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

/// Passes on how cases have ended.
struct Passing<'a>(&'a SyncSender<End>);

impl Observer for Passing<'_> {
    fn begins(&mut self, _: usize, _: usize, _: &Case) {}

    fn ended(&mut self, report: &CaseReport) {
        // Nobody may wait for it.
        let _ = self.0.send(End::Case(Box::new(report.clone())));
    }
}
