//! The output of the demo: the frames, and in real time a progress line below them.

use std::fmt::Display;
use std::io::Write;

use anstyle::Style;
use indicatif::ProgressBar;

use crate::output::{progress, styled};

/// Stdout for the frames, and a progress display on stderr.
pub(crate) struct Console {
    progress: ProgressBar,
    /// Whether stdout is open. If it is closed, the run goes on to its checks.
    is_open: bool,
}

impl Console {
    /// A console for a run of so many steps; in real time with a progress display.
    pub(crate) fn new(realtime: bool, steps: usize) -> Self {
        let template = "{bar:12.cyan/dim} {pos:>2}/{len}  {wide_msg}";
        let progress = if realtime { progress(template, steps as u64) } else { ProgressBar::hidden() };
        Console { progress, is_open: true }
    }

    #[cfg(test)]
    pub(crate) fn silent() -> Self {
        Console { progress: ProgressBar::hidden(), is_open: false }
    }

    pub(crate) fn line(&mut self, line: impl Display) {
        if self.is_open {
            let written = self.progress.suspend(|| writeln!(anstream::stdout().lock(), "{line}"));
            self.is_open = written.is_ok();
        }
    }

    pub(crate) fn heading(&mut self, text: impl Display) {
        self.line(format_args!("\n{}\n", styled(Style::new().bold().underline(), text)));
    }

    /// Prints a remark between frames.
    pub(crate) fn remark(&mut self, text: impl Display) {
        self.line(styled(Style::new().dimmed().italic(), format_args!("{:>14}{text}", "")));
    }

    pub(crate) fn step(&self) {
        self.progress.inc(1);
    }

    /// Shows the current state.
    pub(crate) fn status(&self, text: String) {
        if !self.progress.is_hidden() {
            self.progress.set_message(text);
        }
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.progress.finish_and_clear();
    }
}
