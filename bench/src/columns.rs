//! The columns of the trace, for the terminal and the page.

use serde::Serialize;

use crate::view::Row;

/// A column of the trace.
#[derive(Serialize)]
pub(crate) struct Column {
    /// The field of [`Row`] that the page shows in it.
    pub(crate) name: &'static str,
    /// The titles in English and German.
    pub(crate) titles: [&'static str; 2],
    /// The width on the page, in CSS; `None` to leave the column out.
    page: Option<&'static str>,
    /// The width in the terminal, in characters; `None` for the rest of the line.
    #[serde(skip)]
    pub(crate) terminal: Option<u16>,
    /// The text in the terminal.
    #[serde(skip)]
    pub(crate) text: fn(&Row) -> String,
}

const fn column(
    name: &'static str,
    titles: [&'static str; 2],
    page: Option<&'static str>,
    terminal: Option<u16>,
    text: fn(&Row) -> String,
) -> Column {
    Column { name, titles, page, terminal, text }
}

/// All columns in the order of the terminal. On the page, the node precedes the meaning.
pub(crate) const TRACE: [Column; 7] = [
    column("number", ["No.", "Nr."], Some("70px"), Some(8), |row| row.number.to_string()),
    column("time", ["Time", "Zeit"], Some("86px"), Some(12), |row| format!("{:.6}", row.time)),
    column("id", ["COB-ID", "COB-ID"], Some("62px"), Some(6), |row| row.id.clone()),
    column("service", ["Service", "Dienst"], Some("104px"), Some(13), |row| row.service.clone()),
    column("data", ["Data", "Daten"], Some("180px"), Some(23), |row| row.data.clone()),
    column("node", ["ID", "ID"], None, Some(3), |row| row.node.map(|node| node.to_string()).unwrap_or_default()),
    column("text", ["Meaning", "Bedeutung"], Some("minmax(200px, 1fr)"), None, |row| row.text.clone()),
];
