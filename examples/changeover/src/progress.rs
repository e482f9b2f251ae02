//! Shows the progress on stderr: a bar for each drive on a terminal, else a line for each start and end.

use std::io::{self, IsTerminal};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// The display of all drives.
pub(crate) struct Progress {
    bars: Option<MultiProgress>,
    longest_name: usize,
}

/// The display of one drive.
#[derive(Clone)]
pub(crate) struct Bar {
    bar: ProgressBar,
    name: String,
    from: i32,
    prints_lines: bool,
}

impl Progress {
    pub(crate) fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let longest_name = names.map(|name| name.chars().count()).max().unwrap_or_default();
        Progress { bars: io::stderr().is_terminal().then(MultiProgress::new), longest_name }
    }

    pub(crate) fn begin(&self, name: &str, from: i32, to: i32) -> Bar {
        let bar = match &self.bars {
            Some(bars) => bars.add(ProgressBar::new(to.abs_diff(from).into())),
            None => ProgressBar::hidden(),
        };
        let template = format!("{{prefix:{}}} {{bar:30.cyan/dim}} {{wide_msg}}", self.longest_name);
        bar.set_style(ProgressStyle::with_template(&template).expect("the template is valid"));
        bar.set_prefix(name.to_owned());
        Bar { bar, name: name.to_owned(), from, prints_lines: self.bars.is_none() }
    }
}

impl Bar {
    pub(crate) fn at(&self, position: i32) {
        self.bar.set_position(position.abs_diff(self.from).into());
    }

    pub(crate) fn end(&self, text: &str) {
        self.say(text);
        self.bar.abandon();
    }

    pub(crate) fn say(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        if self.prints_lines {
            eprintln!("{}: {text}", self.name);
        }
    }
}
