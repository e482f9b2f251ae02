//! The conformance test of a device, case by case, for the pytest plugin.

use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex};

use lexican_conform::{
    Case, CaseReport, End, Hazard, HostLateness, Running, Settings, Sheet, Verdict, cases, profile_cases,
};
use lexican_runtime::host::{BusUrl, Pace};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::decode::Decoder;
use pyo3::prelude::*;

use crate::error::{Closed, Raise, wrong};
use crate::opened::{SIM, Shared, bus_url};
use crate::sheet::node_id;
use crate::wait::{SLICE, lock};

/// The conformance test of the device with a node-ID on a bus. The bus is opened when the test begins.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Conformance {
    bus: BusUrl,
    sheet: Arc<Sheet>,
    settings: Settings,
    test: Mutex<Option<Running>>,
    left: Mutex<Vec<String>>,
}

#[pymethods]
impl Conformance {
    /// A simulated device needs no data sheet. `allow` names what may move a machine or outlast the test: "motion",
    /// "outputs", "manufacturer", "store", "restore", "node-id".
    #[new]
    #[pyo3(signature = (bus, node, sheet = None, allow = Vec::new()))]
    fn new(bus: &str, node: u8, sheet: Option<PathBuf>, allow: Vec<String>) -> PyResult<Self> {
        let bus = bus_url(bus)?;
        let is_simulated = bus.scheme().name == SIM.name;
        let name = sheet.map(|sheet| sheet.to_string_lossy().into_owned());
        let name = name.or_else(|| is_simulated.then(|| bus.place().to_owned()));
        let name = name.ok_or_else(|| wrong("a device is tested by its data sheet: name it"))?;
        let sheet = Arc::new(Sheet::of(&DataSheet::load(&name, &[]).map_err(Raise::raise)?.input));
        let mut settings = Settings::new(node_id(node)?);
        for name in allow {
            let hazard = Hazard::ALL.into_iter().find(|hazard| hazard.name() == name);
            let names = Hazard::ALL.map(Hazard::name).join(", ");
            settings.allow.insert(hazard.ok_or_else(|| wrong(format_args!("{name:?} is none of {names}")))?);
        }
        if !is_simulated {
            settings.host = HostLateness::watched();
        }
        let (test, left) = Default::default();
        Ok(Conformance { bus, sheet, settings, test, left })
    }

    /// The cases for this device, each with id and title.
    fn cases(&self) -> Vec<(&'static str, &'static str)> {
        self.all().map(|case| (case.id, case.title)).collect()
    }

    /// Opens the bus and runs the cases of these ids in order. Each waits until `next` has returned the one before.
    ///
    /// Raises LinkFailed.
    fn begin(&self, py: Python<'_>, ids: Vec<String>) -> PyResult<()> {
        let cases: Vec<_> = ids.iter().filter_map(|id| self.all().find(|case| case.id == id)).collect();
        let (link, simulation) = py.detach(|| Shared::lone_link(&self.bus, Pace::Virtual))?;
        let test = Running::begin(link, simulation, Arc::clone(&self.sheet), self.settings.clone(), cases)?;
        *lock(&self.test) = Some(test);
        Ok(())
    }

    /// Waits for the end of the next case; `None` after the last one.
    fn next(&self, py: Python<'_>) -> PyResult<Option<CaseResult>> {
        loop {
            match py.detach(|| lock(&self.test).as_ref().map(|test| test.next(SLICE))) {
                Some(Ok(End::Case(report))) => return Ok(Some(self.result(&report))),
                Some(Ok(End::Test(report))) => {
                    lock(&self.test).take();
                    let ended = report.ended_early.iter().map(|why| format!("the test ended early: {why}"));
                    *lock(&self.left) = report.not_put_back.into_iter().chain(report.findings).chain(ended).collect();
                }
                Some(Err(RecvTimeoutError::Timeout)) => py.check_signals()?,
                Some(Err(RecvTimeoutError::Disconnected)) => return Err(Closed::new_err("the test has panicked")),
                None => return Ok(None),
            }
        }
    }

    /// Ends the test and restores what it has changed. Returns a sentence for everything that could not be restored.
    fn close(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        lock(&self.test).iter().for_each(Running::cancel);
        while self.next(py)?.is_some() {}
        Ok(std::mem::take(&mut *lock(&self.left)))
    }
}

impl Conformance {
    fn all(&self) -> impl Iterator<Item = &'static Case> {
        let own = self.sheet.device.profile;
        cases().chain(profile_cases()).filter(move |case| case.profile().is_none_or(|profile| own == Some(profile)))
    }

    fn result(&self, report: &CaseReport) -> CaseResult {
        let (case, verdict) = (report.case, report.verdict().to_owned());
        let reason = report.outcome.as_ref().err().map(Verdict::reason).unwrap_or_default();
        let head = format!("{verdict}: {reason}\n{} {}\n{}", case.clause(), case.title, case.requirement);
        let said = [("expected", &report.expected), ("measured", &report.measured)];
        let said = said.into_iter().flat_map(|(what, texts)| texts.iter().map(move |text| format!("{what}: {text}")));
        let mut decoder = Decoder::new();
        decoder.introduce(self.settings.node, &self.sheet.device);
        let lines = report.lines(|frame| decoder.decode(frame).words());
        let text = [head].into_iter().chain(said).chain(lines).collect::<Vec<_>>().join("\n");
        CaseResult { id: case.id.to_owned(), verdict, reason, text }
    }
}

/// The result of a case: its id; "passed", "failed", "advised" (a failed recommendation), "not applicable", "not allowed",
/// "blocked", "not decidable" or "unfinished"; why it has not passed; and its part of the report, with the last frames.
#[pyclass(module = "lexican", frozen, get_all)]
pub(crate) struct CaseResult {
    id: String,
    verdict: String,
    reason: String,
    text: String,
}
