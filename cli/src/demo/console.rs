//! What the demo shows while it runs: the frames, and at the drive's own pace a line that stays below them.

use std::fmt::Display;
use std::io::Write;

use anstyle::Style;
use indicatif::ProgressBar;

use crate::output::{progress, styled};

/// Stdout for the frames, and a progress display on stderr.
pub(crate) struct Console {
    progress: ProgressBar,
    /// Whether anybody still reads stdout; if not, the run goes on and checks itself all the same.
    listened_to: bool,
}

impl Console {
    /// A console for a run of so many steps; in real time with a progress display.
    pub(crate) fn new(realtime: bool, steps: usize) -> Self {
        let template = "{bar:12.cyan/dim} {pos:>2}/{len}  {wide_msg}";
        let progress = if realtime { progress(template, steps as u64) } else { ProgressBar::hidden() };
        Console { progress, listened_to: true }
    }

    /// A console that shows nothing.
    #[cfg(test)]
    pub(crate) fn silent() -> Self {
        Console { progress: ProgressBar::hidden(), listened_to: false }
    }

    pub(crate) fn line(&mut self, line: impl Display) {
        if self.listened_to {
            let written = self.progress.suspend(|| writeln!(anstream::stdout().lock(), "{line}"));
            self.listened_to = written.is_ok();
        }
    }

    pub(crate) fn heading(&mut self, text: impl Display) {
        self.line(format_args!("\n{}\n", styled(Style::new().bold().underline(), text)));
    }

    /// Something that is no frame.
    pub(crate) fn remark(&mut self, text: impl Display) {
        self.line(styled(Style::new().dimmed().italic(), format_args!("{:>14}{text}", "")));
    }

    /// One step of the run is done.
    pub(crate) fn step(&self) {
        self.progress.inc(1);
    }

    /// What is going on now.
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
