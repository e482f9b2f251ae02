//! What all tabs share: the current tab, selections, and the prompt.

use super::action::Action;
use super::list::Listed;
use super::prompt::{Field, Prompt, Then};
use super::tab::Tab;
use super::text::{Language, Text};
use crate::view::{Node, View};

#[derive(Default)]
pub(super) struct Ui {
    pub(super) language: Language,
    /// The number of this client.
    pub(super) client: u32,
    pub(super) tab: Tab,
    /// The selected node, and below it the selected drive: their rows change when others appear.
    pub(super) node: Option<u8>,
    pub(super) drive: Option<u8>,
    /// The selected row in each tab.
    pub(super) rows: [usize; 8],
    pub(super) prompt: Option<Prompt>,
    /// Where rows of the tab were drawn.
    pub(super) listed: Vec<Listed>,
}

impl Ui {
    pub(super) fn text(&self, text: Text) -> &'static str {
        text.of(self.language)
    }

    /// The selected node, or else the first one.
    pub(super) fn node<'v>(&self, view: &'v View) -> Option<&'v Node> {
        let selected = view.nodes.iter().find(|node| Some(node.id) == self.node);
        selected.or_else(|| view.nodes.first())
    }

    /// The selected row in the tab.
    pub(super) fn row(&self) -> usize {
        self.rows[self.tab as usize]
    }

    pub(super) fn set_row(&mut self, row: usize) {
        self.rows[self.tab as usize] = row;
    }

    /// Finds the rows of the selected node and drive in the new view, so that a key refers to the one that was shown.
    pub(super) fn follow(&mut self, view: &View) {
        self.node = self.node.or_else(|| view.nodes.first().map(|node| node.id));
        self.drive = self.drive.or_else(|| view.drives.first().map(|drive| drive.node));
        let node = view.nodes.iter().position(|node| Some(node.id) == self.node);
        let drive = view.drives.iter().position(|drive| Some(drive.node) == self.drive);
        self.rows[Tab::Nodes as usize] = node.unwrap_or_default();
        self.rows[Tab::Drives as usize] = drive.unwrap_or_default();
    }

    /// Selects another node, and its first row.
    pub(super) fn select_node(&mut self, view: &View, by: isize) {
        let count = view.nodes.len().max(1) as isize;
        let place = (self.rows[Tab::Nodes as usize] as isize + by).rem_euclid(count) as usize;
        self.node = view.nodes.get(place).map(|node| node.id);
        self.rows = [0; 8];
        self.follow(view);
    }

    /// The number of rows visible.
    pub(super) fn lines(&self) -> usize {
        self.listed.last().map_or(1, |listed| usize::from(listed.area.height).max(1))
    }

    /// Prompts for the value of a request.
    pub(super) fn ask(
        &mut self,
        title: Text,
        of: String,
        then: impl FnOnce(String) -> Result<Action, String> + 'static,
    ) -> Option<Action> {
        self.ask_in_words(self.text(title), of, then)
    }

    /// The same with a title that is not among the terminal's texts.
    pub(super) fn ask_in_words(
        &mut self,
        title: &'static str,
        of: String,
        then: impl FnOnce(String) -> Result<Action, String> + 'static,
    ) -> Option<Action> {
        self.prompt = Some(Prompt { title, of, typed: String::new(), then: Then::Ask(Box::new(then)) });
        None
    }

    /// Prompts for a field of the screen.
    pub(super) fn ask_for(&mut self, field: Field) -> Option<Action> {
        let (title, of, typed) = (self.text(field.title()), String::new(), String::new());
        self.prompt = Some(Prompt { title, of, typed, then: Then::Set(field) });
        None
    }
}
