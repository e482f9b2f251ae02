//! The report as one page for people: data, and a script that shows it.

use lexican_eds::text::escaped;

use super::Document;

const PAGE: &str = include_str!("page.html");

impl Document {
    /// As one HTML page, in which the frames of each case are folded; it loads nothing.
    #[must_use]
    pub fn html(&self) -> String {
        // In a script element, `</` and `<!--` would be taken for markup.
        let data = self.json().replace('<', "\\u003c");
        let (head, rest) = PAGE.split_once("{{title}}").unwrap_or((PAGE, ""));
        let (middle, tail) = rest.split_once("{{report}}").unwrap_or((rest, ""));
        [head, &escaped(&self.about.device), middle, &data, tail].concat()
    }
}
