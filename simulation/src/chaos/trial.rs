//! One run of a program: when and how it is disturbed, and what is observed then.

use std::collections::{BTreeSet, VecDeque};

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::judge::{Left, judge};
use super::plan::{Disturbance, Plan};
use super::rig::{Axis, Record, Rig};
use super::seen::{End, Finding, Level, Reference, Scene};
use crate::{Plant, PlantError, Power};

/// How long a program that is told to end may take to do so.
pub const GRACE: Duration = Duration::from_millis(5_000);
/// How long to wait for a program that has lost its bus. Also: how much longer than undisturbed a program may take that
/// goes on after a disturbance.
const PATIENCE: Duration = Duration::from_millis(10_000);
/// How long axes that have to stand are watched for renewed motion.
const QUIET: Duration = Duration::from_millis(700);
/// How long a plant that has not moved is watched.
const BRIEF: Duration = Duration::from_millis(100);

/// What the caller has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// Send a signal to the program and all processes that it has started.
    Signal(Signal),
    /// The trial is over, and the program has ended.
    Over,
}

/// A signal to the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// SIGTERM.
    Terminate,
    /// SIGINT.
    Interrupt,
    /// SIGKILL.
    Kill,
    /// SIGSTOP.
    Stop,
    /// SIGCONT.
    Continue,
}

/// The result of a trial.
#[derive(Clone, Debug)]
pub struct Trial {
    /// What was done; none in the undisturbed run.
    pub plan: Option<Plan>,
    /// Whether the moment came before the program ended.
    pub was_disturbed: bool,
    /// What was found wrong; empty if all is well.
    pub findings: Vec<Finding>,
    /// Observations that are no findings.
    pub notes: Vec<String>,
    /// How long the trial took.
    pub took: Duration,
    /// By how much this computer polled too late, at most. The time to stand is extended by this.
    pub late: Duration,
    /// The last frames.
    pub frames: Vec<Record>,
}

/// How a trial is run.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How long the program may run before it is told to end.
    pub span: Duration,
    /// How soon each drive has to stand when nothing commands it; `None` for what is known of its model.
    pub dead_man: Option<Duration>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Until the moment.
    Before,
    /// Until the disturbance is over.
    Disturbed,
    /// The plan has told the program to end, or killed it.
    Asked,
    /// The disturbance is over, and the program goes on.
    After,
    /// The trial has told the program to end, because it does not by itself.
    Ending,
    /// The program has ended.
    Gone,
}

/// A running trial: a [`Node`] to which the program is connected. It sends no signals; the caller does.
pub struct Running<'a> {
    pub(super) rig: Rig<'a>,
    plan: Option<Plan>,
    settings: Settings,
    reference: Option<&'a Reference>,
    phase: Phase,
    since: Instant,
    begun: Instant,
    /// Since when nothing commands the axes, and why.
    watch: Option<(Instant, String)>,
    /// The axes that have stood since then.
    stood: BTreeSet<usize>,
    /// Whether the program ended before the trial told it to, and was not killed.
    by_itself: bool,
    /// Whether the program ended during the disturbance, without bus or devices.
    was_cut_off: bool,
    /// The nodes whose SDO transfers the program left open. Their servers may abort them later.
    open: Vec<NodeId>,
    was_disturbed: bool,
    before: Scene,
    findings: Vec<Finding>,
    late: Duration,
}

impl<'a> Running<'a> {
    /// A trial of a plant that is switched on at `now`. `planned` has the plan and the undisturbed run; `None` makes
    /// this the undisturbed run.
    pub fn new(
        now: Instant,
        plant: &'a Plant,
        settings: Settings,
        planned: Option<(Plan, &'a Reference)>,
    ) -> Result<Self, PlantError> {
        let plan = planned.map(|(plan, _)| plan);
        let mut rig = Rig::new(now, plant, settings.dead_man, plan.map(|plan| plan.moment))?;
        let before = scene(&mut rig, now);
        Ok(Running {
            rig,
            plan,
            settings,
            reference: planned.map(|(_, reference)| reference),
            phase: Phase::Before,
            since: now,
            begun: now,
            watch: None,
            stood: BTreeSet::new(),
            by_itself: true,
            was_cut_off: false,
            open: Vec::new(),
            was_disturbed: false,
            before,
            findings: Vec::new(),
            late: Duration::ZERO,
        })
    }

    /// What to do now. To be called every few milliseconds, with whether the program has ended, and by how much this
    /// computer was late to call.
    pub fn poll(&mut self, now: Instant, has_ended: bool, late: Duration) -> Option<Act> {
        self.late = self.late.max(late);
        self.rig.look(now);
        self.judge_motion(now);
        let elapsed = now.since(self.since);
        match self.phase {
            Phase::Gone if elapsed >= self.aftermath() => return Some(Act::Over),
            Phase::Gone => return None,
            _ if has_ended => {
                self.was_cut_off = self.phase == Phase::Disturbed;
                self.open = self.rig.transfers.open().map(|transfer| transfer.node).collect();
                self.by_itself = self.phase != Phase::Ending && !self.is_killed();
                self.restore(now);
                self.enter(now, Phase::Gone);
                self.watch.get_or_insert((now, "the program has ended".to_owned()));
            }
            Phase::Before if self.rig.is_due => {
                let signal = self.disturb(now);
                self.rig.go_on(now);
                return signal.map(Act::Signal);
            }
            Phase::Before if elapsed >= self.settings.span => return self.end(now),
            Phase::Asked if elapsed >= GRACE => {
                if let Some(plan) = self.plan.filter(|plan| plan.disturbance.is_asked()) {
                    self.find(Level::Should, format!("it goes on for {GRACE} after {}", plan.disturbance));
                }
                return Some(Act::Signal(Signal::Kill));
            }
            Phase::Ending if elapsed >= GRACE => return Some(Act::Signal(Signal::Kill)),
            Phase::Disturbed => match self.plan.and_then(|plan| plan.disturbance.span()) {
                Some(span) if elapsed >= span => {
                    self.watch = None;
                    self.rig.axes.values_mut().for_each(Axis::forget);
                    self.enter(now, Phase::After);
                    self.restore(now);
                    let is_frozen = matches!(self.plan, Some(Plan { disturbance: Disturbance::Freeze(_), .. }));
                    return is_frozen.then_some(Act::Signal(Signal::Continue));
                }
                None if elapsed >= PATIENCE => return self.end(now),
                _ => {}
            },
            Phase::After => {
                let usual = self.reference.map_or(Duration::ZERO, |reference| reference.took);
                if elapsed >= usual + PATIENCE || !self.is_finite() {
                    return self.end(now);
                }
            }
            _ => {}
        }
        None
    }

    /// Whether the program ends by itself when nothing is done to it.
    fn is_finite(&self) -> bool {
        self.reference.is_none_or(|reference| reference.by_itself)
    }

    fn is_killed(&self) -> bool {
        self.was_disturbed && self.plan.is_some_and(|plan| plan.disturbance == Disturbance::Kill)
    }

    fn enter(&mut self, now: Instant, phase: Phase) {
        (self.phase, self.since) = (phase, now);
    }

    /// Tells a program to end that does not by itself.
    fn end(&mut self, now: Instant) -> Option<Act> {
        self.enter(now, Phase::Ending);
        Some(Act::Signal(Signal::Terminate))
    }

    /// How long to watch what the program leaves behind.
    fn aftermath(&self) -> Duration {
        match self.rig.axes.values().map(|axis| axis.limit).max() {
            Some(limit) if self.rig.has_moved() => limit + QUIET + self.late,
            _ => BRIEF,
        }
    }

    fn disturb(&mut self, now: Instant) -> Option<Signal> {
        let disturbance = self.plan?.disturbance;
        self.was_disturbed = true;
        self.enter(now, if disturbance.span().is_some() { Phase::Disturbed } else { Phase::Asked });
        let signal = match disturbance {
            Disturbance::Terminate => return Some(Signal::Terminate),
            Disturbance::Interrupt => return Some(Signal::Interrupt),
            Disturbance::Kill => Some(Signal::Kill),
            Disturbance::Freeze(_) => Some(Signal::Stop),
            Disturbance::CutBus(_) => {
                self.rig.is_cut = true;
                self.phase = Phase::Disturbed;
                None
            }
            // An axis without power coasts, whatever the program does.
            Disturbance::CutPower(_) => {
                self.rig.set_supply(now, Power::Off);
                return None;
            }
        };
        self.watch = Some((now, disturbance.to_string()));
        signal
    }

    /// Restores bus and supply.
    fn restore(&mut self, now: Instant) {
        self.rig.is_cut = false;
        if self.was_disturbed
            && let Some(Plan { disturbance: Disturbance::CutPower(_), .. }) = self.plan
        {
            self.rig.set_supply(now, Power::On);
        }
    }

    fn find(&mut self, level: Level, what: String) {
        if self.findings.iter().all(|finding| finding.what != what) {
            self.findings.push(Finding { level, what });
        }
    }

    /// Judges axes that move though nothing commands them.
    fn judge_motion(&mut self, now: Instant) {
        let Some((since, what)) = &self.watch else { return };
        let (gone, mut found) = (now.since(*since), Vec::new());
        let runs_out =
            self.was_disturbed && matches!(self.plan, Some(Plan { disturbance: Disturbance::CutPower(_), .. }));
        for (at, axis) in &self.rig.axes {
            let has_stood = self.stood.contains(at);
            if axis.velocity == 0.0 {
                self.stood.insert(*at);
            } else if gone > axis.limit + self.late && (has_stood || !runs_out) {
                let again = if has_stood { "moves again" } else { "goes on" };
                found.push(format!("{} {again}: it does not stand {} after {what}", axis.who, axis.limit));
            }
        }
        for text in found {
            self.find(Level::Must, text);
        }
    }

    /// Makes the reference of the undisturbed run, once it is over.
    pub fn into_reference(mut self, now: Instant, end: End) -> (Reference, Trial) {
        let after = scene(&mut self.rig, now);
        let axes: Vec<usize> = self.rig.axes.keys().copied().collect();
        let positioning = axes.into_iter().filter(|at| self.rig.is_positioning(now, *at)).collect();
        let reference = Reference {
            end,
            by_itself: self.by_itself,
            moves: self.rig.has_moved(),
            took: self.since.since(self.begun),
            before: self.before.clone(),
            after,
            peaks: self.rig.axes.iter().map(|(at, axis)| (*at, axis.peak)).collect(),
            positioning,
        };
        (reference, self.into_trial(now, Vec::new()))
    }

    /// The result of the trial, once it is over. `files` gets whether the program claims success, and returns the
    /// findings in the files that the program writes.
    pub fn conclude(mut self, now: Instant, end: &End, files: impl FnOnce(bool) -> Vec<Finding>) -> Trial {
        let mut notes = Vec::new();
        let Some((reference, plan)) = self.reference.zip(self.plan) else { return self.into_trial(now, notes) };
        let after = scene(&mut self.rig, now);
        let left = Left {
            plan,
            reference,
            before: &self.before,
            after: &after,
            end,
            by_itself: self.by_itself,
            was_cut_off: self.was_cut_off,
            open: &self.open,
            was_disturbed: self.was_disturbed,
            late: self.late,
        };
        let mut found = judge(&left, &self.rig, &mut notes);
        found.extend(files(left.claims_success()));
        for Finding { level, what } in found {
            self.find(level, what);
        }
        self.into_trial(now, notes)
    }

    fn into_trial(mut self, now: Instant, notes: Vec<String>) -> Trial {
        let outside: Vec<String> = self
            .rig
            .outside()
            .map(|(axis, (at, low, high))| format!("{} is at {at}, outside of its limits {low} to {high}", axis.who))
            .collect();
        outside.into_iter().for_each(|text| self.find(Level::Must, text));
        Trial {
            plan: self.plan,
            was_disturbed: self.was_disturbed,
            findings: self.findings,
            notes,
            took: now.since(self.begun),
            late: self.late,
            frames: VecDeque::into(self.rig.record),
        }
    }
}

fn scene(rig: &mut Rig<'_>, now: Instant) -> Scene {
    let positions = rig.axes.iter().map(|(at, axis)| (*at, axis.position)).collect();
    Scene { objects: rig.objects(now), positions }
}

impl Node for Running<'_> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.rig.handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.rig.handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.rig.poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.rig.poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        Vec::new()
    }
}
