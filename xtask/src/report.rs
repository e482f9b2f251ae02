//! The parts of `lexican conform --report FILE.json` that tasks use.

use std::fs;
use std::path::Path;

use serde::Deserialize;

#[derive(Deserialize)]
pub(crate) struct Report {
    pub passed: usize,
    pub failed: usize,
    pub known: usize,
    pub advised: usize,
    pub not_applicable: usize,
    pub ended_early: Option<String>,
    pub cases: Vec<Case>,
}

#[derive(Deserialize)]
pub(crate) struct Case {
    pub id: String,
    pub title: String,
    pub verdict: String,
    #[serde(default)]
    pub reason: String,
    /// Why it may fail.
    pub known: Option<String>,
    #[serde(default)]
    pub measured: Vec<String>,
}

impl Report {
    /// Reads the report of a test that has come to its end.
    pub(crate) fn read(path: &Path) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let report: Report = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))?;
        match report.ended_early {
            Some(why) => Err(format!("the test ended early: {why}")),
            None => Ok(report),
        }
    }
}

impl Case {
    /// Whether the case has failed because of a measured time, for which a busy machine may be to blame.
    pub(crate) fn is_out_of_time(&self) -> bool {
        self.measured.contains(&self.reason)
    }
}
