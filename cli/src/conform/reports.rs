//! The report files of a test.

use std::path::PathBuf;

use lexican_conform::{About, Document};
use lexican_toolbox::text::time_of_day;

use crate::output::{Failure, ForceArgs};
use crate::send::time::now;

#[derive(clap::Args, Debug)]
pub(crate) struct ReportArgs {
    /// Write a report: an HTML page (FILE.html), JSON (FILE.json), or JUnit's XML for build servers (FILE.xml); may be given several times
    ///
    /// The page and JSON have every frame of the test, in words.
    #[arg(long, value_name = "FILE", value_parser = ReportFile::new)]
    report: Vec<ReportFile>,

    #[command(flatten)]
    pub(crate) force: ForceArgs,
}

#[derive(Clone, Debug)]
struct ReportFile {
    path: PathBuf,
    format: fn(&Document) -> String,
}

impl ReportFile {
    fn new(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let format = match path.extension().and_then(|extension| extension.to_str()) {
            Some("html") => Document::html,
            Some("json") => Document::json,
            Some("xml") => Document::junit,
            _ => return Err("which format is it? let it end in .html, .json or .xml (JUnit)".to_owned()),
        };
        Ok(ReportFile { path, format })
    }
}

impl ReportArgs {
    pub(crate) fn is_empty(&self) -> bool {
        self.report.is_empty()
    }

    /// Before the test, refuses report files that would replace existing ones, or that `guard` refuses.
    pub(crate) fn guard(&self, guard: impl Fn(&std::path::Path) -> Result<(), Failure>) -> Result<(), Failure> {
        self.report.iter().try_for_each(|file| self.force.guard(&file.path, []).and_then(|()| guard(&file.path)))
    }

    pub(crate) fn write(&self, document: &Document) -> Result<(), Failure> {
        let mut files = self.report.iter();
        files.try_for_each(|ReportFile { path, format }| self.force.write(path, format(document).as_bytes()))
    }
}

/// The head of a report: date, version, and more.
pub(crate) fn about(more: impl IntoIterator<Item = (&'static str, String)>) -> About {
    let date = now().map_or_else(|| "not known".to_owned(), |time| format!("{} UTC", time_of_day::text(time)));
    let first = [("date", date), ("version", format!("lexican {}", env!("CARGO_PKG_VERSION")))];
    let facts = first.into_iter().chain(more).map(|(name, text)| (name.to_owned(), text));
    About { facts: facts.collect(), ..About::default() }
}
