//! One page for people: the report as data, and a script that shows it.

use lexican_eds::text::escaped;

use super::Document;

const PAGE: &str = include_str!("page.html");

impl Document {
    /// As one HTML page with the frames of each case folded in; it loads nothing.
    #[must_use]
    pub fn html(&self) -> String {
        // In a script, `</` ends the data, and `<!--` changes what ends it.
        let data = self.json().replace('<', "\\u003c");
        let (head, rest) = PAGE.split_once("{{title}}").unwrap_or((PAGE, ""));
        let (middle, tail) = rest.split_once("{{report}}").unwrap_or((rest, ""));
        [head, &escaped(&self.about.device), middle, &data, tail].concat()
    }
}
