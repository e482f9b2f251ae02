//! Lists with a selected row. Selection and errors have marks, since not every terminal has colours.

use ratatui::Frame;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::{Modifier, Stylize};
use ratatui::widgets::{HighlightSpacing, Row, Table, TableState};

use crate::view::Seen;

/// The mark of the selected row.
pub(super) const SELECTED: &str = "▸";

/// The mark of something wrong.
pub(super) const WRONG: &str = "!";

/// The mark of something possibly dangerous.
pub(super) const ALARM: &str = "!!";

/// The position of rows on the screen: from row `first` on, one line each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Listed {
    pub(super) area: Rect,
    pub(super) first: usize,
}

/// The age of a value that should have been seen again; `None` if it is current.
pub(super) fn age(seen: Option<Seen>, now: f64) -> Option<f64> {
    seen.filter(|seen| seen.is_old).map(|seen| now - seen.at)
}

/// The age as text; empty if the value is current.
pub(super) fn ago(seen: Option<Seen>, now: f64) -> String {
    age(seen, now).map_or_else(String::new, |seconds| format!(" (-{seconds:.1} s)"))
}

/// The heads and widths of columns.
pub(super) struct Columns<H, W> {
    /// Empty for no heads.
    pub(super) head: H,
    pub(super) widths: W,
}

impl<'h, const N: usize> Columns<[&'h str; N], [Constraint; N]> {
    pub(super) fn new(columns: [(&'h str, Constraint); N]) -> Self {
        Columns { head: columns.map(|(title, _)| title), widths: columns.map(|(_, width)| width) }
    }
}

impl<'h, H, W> Columns<H, W>
where
    H: AsRef<[&'h str]>,
    W: IntoIterator<Item = Constraint>,
{
    /// Draws as many rows as fit, including the selected one.
    pub(super) fn draw<'r, T>(
        self,
        frame: &mut Frame<'_>,
        area: Rect,
        selected: Option<usize>,
        items: impl Iterator<Item = T>,
        row: impl Fn(T) -> Row<'r>,
    ) -> Listed {
        let has_head = self.head.as_ref().iter().any(|title| !title.is_empty());
        let [top, height] = [area.y + u16::from(has_head), area.height.saturating_sub(u16::from(has_head))];
        let lines = usize::from(height);
        let first = selected.unwrap_or_default().saturating_sub(lines.saturating_sub(1));
        let table = Table::new(items.skip(first).take(lines).map(row), self.widths)
            .row_highlight_style(Modifier::REVERSED)
            .highlight_symbol(SELECTED)
            .highlight_spacing(HighlightSpacing::Always);
        let table = if has_head { table.header(Row::new(self.head.as_ref().iter().copied()).bold()) } else { table };
        let mut state = TableState::new().with_selected(selected.map(|row| row - first));
        frame.render_stateful_widget(table, area, &mut state);
        Listed { area: Rect { y: top, height, ..area }, first }
    }
}
