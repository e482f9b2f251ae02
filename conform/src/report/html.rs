//! One page for people: the report as data, and a script that shows it.

use super::{Document, escaped};

const PAGE: &str = include_str!("page.html");

pub(super) fn page(document: &Document) -> String {
    // In a script, only `</` would end the data.
    let data = document.json().replace("</", "<\\/");
    PAGE.replace("{{title}}", &escaped(&document.about.device)).replace("{{report}}", &data)
}
