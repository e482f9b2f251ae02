//! One page for people: the report as data, and a script that shows it.

use super::{Document, escaped};

const PAGE: &str = include_str!("page.html");

pub(super) fn page(document: &Document) -> String {
    // In a script, `</` ends the data, and `<!--` changes what ends it.
    let data = document.json().replace('<', "\\u003c");
    let (head, rest) = PAGE.split_once("{{title}}").unwrap_or((PAGE, ""));
    let (middle, tail) = rest.split_once("{{report}}").unwrap_or((rest, ""));
    [head, &escaped(&document.about.device), middle, &data, tail].concat()
}
