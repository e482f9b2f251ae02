//! Messages, and notices that stay until the user has seen them.

use ratatui::style::Stylize;
use ratatui::text::Line;

use super::list::{ALARM, WRONG};
use super::text::Text;
use super::ui::Ui;
use crate::request::Refused;
use crate::view::{Job, View};

/// The most jobs shown.
const MOST_JOBS: usize = 4;

/// Messages to the user.
#[derive(Default)]
pub(super) struct Notices {
    /// The last message.
    said: Option<Said>,
    /// A drive could not be stopped. Later answers do not replace this.
    alarm: Option<String>,
    /// Whether the stop of the alarm is still being sent, until it is confirmed.
    is_sent_on: bool,
    /// The jobs whose ends the user has seen.
    seen: Vec<u32>,
}

enum Said {
    Good(String),
    Bad(String),
}

impl Notices {
    pub(super) fn say(&mut self, text: impl Into<String>) {
        self.said = Some(Said::Good(text.into()));
    }

    pub(super) fn complain(&mut self, text: impl Into<String>) {
        self.said = Some(Said::Bad(text.into()));
    }

    /// Shows that something could not be stopped.
    pub(super) fn alarm(&mut self, text: String) {
        self.said = None;
        (self.alarm, self.is_sent_on) = (Some(text), false);
    }

    /// Removes an alarm that has been confirmed since.
    pub(super) fn follow(&mut self, ui: &Ui, view: &View) {
        let is_unconfirmed = view.drives.iter().any(|drive| drive.unconfirmed.is_some());
        if self.alarm.is_some() && self.is_sent_on && !is_unconfirmed {
            self.say_stopped(ui.text(Text::Stopped));
        }
        self.is_sent_on = self.alarm.is_some() && (self.is_sent_on || is_unconfirmed);
    }

    pub(super) fn say_stopped(&mut self, text: &str) {
        self.alarm = None;
        self.say(text);
    }

    /// The user has seen a notice: the last message first, then an alarm, then the ends of jobs.
    pub(super) fn dismiss(&mut self, view: &View) {
        if self.said.take().is_none() && self.alarm.take().is_none() {
            self.seen = view.jobs.iter().filter(|job| job.is_success.is_some()).map(|job| job.number).collect();
        }
    }

    /// The lines shown in every tab above the last line.
    pub(super) fn lasting(&self, ui: &Ui, view: &View) -> Vec<Line<'static>> {
        let mut lines: Vec<_> = self.jobs(view).into_iter().map(|job| job_line(ui, job)).collect();
        // A drive that may be moving cannot be dismissed.
        let moving = view.drives.iter().filter_map(|drive| drive.ending.as_ref().filter(|it| it.may_be_moving));
        let moving = moving.map(|ending| ending.text.clone());
        let unconfirmed = view.drives.iter().filter_map(|drive| Some((drive, drive.unconfirmed.as_ref()?)));
        let unconfirmed = unconfirmed.filter(|(drive, _)| drive.ending.as_ref().is_none_or(|it| !it.may_be_moving));
        let unconfirmed = unconfirmed.map(|(drive, unconfirmed)| {
            let seconds = view.time - unconfirmed.since;
            format!("{} {}: {} {seconds:.1} s", drive.node, drive.name, ui.text(Text::Unconfirmed))
        });
        let alarm = self.alarm.as_ref().map(|text| format!("{text}  {}", ui.text(Text::Dismiss)));
        let alarms = moving
            .chain(unconfirmed)
            .chain(alarm)
            .map(|text| Line::from(format!(" {ALARM} {text}")).red().bold().reversed());
        lines.extend(alarms);
        lines
    }

    /// The last message.
    pub(super) fn last(&self) -> Option<Line<'static>> {
        self.said.as_ref().map(|said| match said {
            Said::Good(text) => Line::from(format!(" {text}")).green(),
            Said::Bad(text) => Line::from(format!(" {WRONG} {text}")).red(),
        })
    }

    /// The jobs that run, those that failed, and the newest one, except those whose end was seen or has just been
    /// shown.
    fn jobs<'v>(&self, view: &'v View) -> Vec<&'v Job> {
        let newest = view.jobs.iter().map(|job| job.number).max();
        let is_said = |job: &Job| matches!(&self.said, Some(Said::Bad(text)) if text.starts_with(&*job.text));
        let is_shown = |job: &&Job| match job.is_success {
            None => true,
            Some(_) if self.seen.contains(&job.number) => false,
            Some(true) => Some(job.number) == newest,
            Some(false) => !is_said(job),
        };
        let mut shown: Vec<_> = view.jobs.iter().filter(is_shown).collect();
        // Failed jobs first, then ended ones, then running ones.
        shown.sort_by_key(|job| (job.is_success != Some(false), job.is_success.is_none(), job.number));
        shown.truncate(MOST_JOBS);
        shown
    }
}

fn job_line(ui: &Ui, job: &Job) -> Line<'static> {
    let Job { name, text, .. } = job;
    match job.is_success {
        None => {
            let percent = job.done.map_or_else(String::new, |done| format!("{:3.0} % ", done * 100.0));
            Line::from(format!(" {percent}{name}: {text}")).cyan()
        }
        Some(is_success) => {
            let (mark, word) = if is_success { ("", Text::JobDone) } else { (WRONG, Text::JobFailed) };
            let text = format!(" {mark}{name} {}: {text}  {}", ui.text(word), ui.text(Text::Dismiss));
            if is_success { Line::from(text).green() } else { Line::from(text).red() }
        }
    }
}

/// A refusal with its remedy, as text.
pub(super) fn words(refused: &Refused) -> String {
    match &refused.remedy {
        Some(remedy) => format!("{} ({remedy})", refused.why),
        None => refused.why.clone(),
    }
}
