//! The state machine of a path: the cycle, and the stop of all axes.

use std::collections::VecDeque;

use lexican_runtime::host::StateMachine;
use lexican_runtime::profile::cia402::Command;
use lexican_runtime::service::sync_producer::SyncProducer;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::axis::{Axis, DISARMING, Member};
use super::path::{Path, Supply};
use super::report::{Reason, Report};
use super::settings::{Settings, Stop, SyncSource};
use super::stopping::{Ramp, Stage, Stopping, straight_on};
use crate::context::DriveContext;
use crate::protection::{KeepAlive, Protection};

/// What happens while a path is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// All axes are enabled, and the path begins.
    Following,
    /// All axes are being stopped; `None` at the end of the path.
    Stopping(Option<Reason>),
    /// It is over, and the result is in [`Follower::report`].
    Over,
}

/// Why axes cannot follow a path together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SetUpError {
    /// The list of axes is empty.
    #[error("there is no axis")]
    NoAxis,
    /// The axes are set up with different periods, or with none.
    #[error("node {node} is set up with a period of {period}, and the first axis with another one or none")]
    Period {
        /// The axis.
        node: NodeId,
        /// Its period.
        period: Duration,
    },
    /// Two of the axes are the same drive.
    #[error("node {0} is two of the axes")]
    Twice(NodeId),
}

/// Leads axes along a [`Path`], and stops all of them if one cannot follow. The four verbs, without I/O: see
/// [the module](super).
#[derive(Debug)]
pub struct Follower<P> {
    members: Vec<Member>,
    path: P,
    settings: Settings,
    period: Duration,
    phase: Phase,
    sync: SyncProducer,
    /// With a SYNC of another node: the time by which the next one has to come.
    expects: Option<Instant>,
    /// When the last cycle began; `None` before the first.
    cycle_began: Option<Instant>,
    /// The axis that is sent its set-point next; `None` once all have been.
    sending: Option<usize>,
    keep_alive: Vec<KeepAlive>,
    /// The frames that disarm the axes at the end, one batch in each cycle, so that each node has answered before its
    /// next one.
    disarming: VecDeque<Vec<Frame>>,
    /// The rest of the batch of this cycle.
    disarms: Vec<Frame>,
    /// The first reason to stop.
    reason: Option<Reason>,
    /// Whether to ask the path for more set-points.
    has_more: bool,
    /// The next cycle of the path.
    cycle: u64,
    /// How many cycles took set-points of the path before the stop.
    followed: u64,
    /// The set-points of the last cycle and of the one before it.
    last: Vec<i32>,
    before: Vec<i32>,
    /// How many cycles in a row had no set-points.
    unsupplied: u32,
    missed: u64,
    missed_in_a_row: u64,
    latest: Duration,
}

#[derive(Debug)]
enum Phase {
    /// Not begun: it begins when it is first asked for a frame.
    New,
    Enabling,
    Following,
    Stopping(Stopping),
    Over,
}

impl<P: Path> Follower<P> {
    /// A follower of these axes, in this order. It begins when it is first polled for frames.
    pub fn new(axes: Vec<Axis>, path: P, settings: Settings) -> Result<Self, SetUpError> {
        let period = axes.first().ok_or(SetUpError::NoAxis)?.settings.period;
        for (number, axis) in axes.iter().enumerate() {
            let (node, own) = (axis.node, axis.settings.period);
            if own != period || own.is_zero() {
                return Err(SetUpError::Period { node, period: own });
            }
            if axes.iter().skip(number + 1).any(|other| other.node == node) {
                return Err(SetUpError::Twice(node));
            }
        }
        let members: Vec<Member> = axes.into_iter().map(|axis| Member::new(axis, Instant::ZERO)).collect();
        let last: Vec<i32> = members.iter().map(|member| member.set_point).collect();
        Ok(Follower {
            members,
            path,
            settings,
            period,
            phase: Phase::New,
            sync: SyncProducer::new(),
            expects: None,
            cycle_began: None,
            sending: None,
            keep_alive: Vec::new(),
            disarming: VecDeque::new(),
            disarms: Vec::new(),
            reason: None,
            has_more: true,
            cycle: 0,
            followed: 0,
            before: last.clone(),
            last,
            unsupplied: 0,
            missed: 0,
            missed_in_a_row: 0,
            latest: Duration::ZERO,
        })
    }

    /// Stops all axes, from the next cycle on.
    pub fn cancel(&mut self) {
        self.reason.get_or_insert(Reason::Cancelled);
    }

    /// Whether the follower has nothing more to do.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        matches!(self.phase, Phase::Over)
    }

    /// What has happened so far.
    #[must_use]
    pub fn report(&self) -> Report {
        let tolerated = self.settings.tolerance.pdos;
        let end = self.cycle_began.unwrap_or_default();
        let axes = self.members.iter().map(|member| member.report(tolerated, member.stands(end, Instant::ZERO)));
        Report {
            reason: self.reason,
            cycles: self.followed,
            missed: self.missed,
            latest: self.latest,
            axes: axes.collect(),
        }
    }

    /// The frames that stop all axes at once, for a program that cannot go on: a quick stop for each axis, and the SYNC
    /// that makes them take effect. Empty if nothing is to be stopped.
    pub fn let_go(&mut self) -> Vec<Frame> {
        if matches!(self.phase, Phase::New | Phase::Over) {
            return Vec::new();
        }
        self.members.iter_mut().for_each(|member| member.command(Command::QuickStop));
        self.sync.handle_timeout(Instant::MAX);
        let sync = self.sync.poll_transmit(Instant::MAX).map(|(_, frame)| frame);
        self.members.iter().filter_map(Member::frame).chain(sync).collect()
    }

    /// The axis of a node, for a shell that gets emergencies and heartbeats as events and not as frames.
    #[cfg(feature = "tokio")]
    pub(super) fn member(&mut self, node: NodeId) -> Option<&mut Member> {
        self.members.iter_mut().find(|member| member.axis.node == node)
    }
}

impl<P: Path> Follower<P> {
    /// Whether the frame is the SYNC of another node that this follower waits for.
    pub(super) fn begins_cycle(&self, frame: &Frame) -> bool {
        self.expects.is_some() && self.settings.sync == SyncSource::Followed { id: frame.id() }
    }

    fn begin(&mut self, now: Instant) {
        self.phase = Phase::Enabling;
        self.members.iter_mut().for_each(|member| *member = Member::new(member.axis, now));
        match self.settings.sync {
            SyncSource::Produced { id, overflow } => self.sync.configure(now, id, self.period, overflow),
            SyncSource::Followed { .. } => self.expects = Some(now + self.patience()),
        }
        let mut heartbeats = Vec::new();
        for Axis { node, protection, .. } in self.members.iter().map(|member| member.axis) {
            // All who watch a manager share one heartbeat.
            if let Protection::Heartbeat { manager, period, .. } = protection {
                if heartbeats.contains(&(manager, period)) {
                    continue;
                }
                heartbeats.push((manager, period));
            }
            self.keep_alive.push(KeepAlive::new(now, node, protection));
        }
    }

    /// How long the SYNC of another producer may be missing.
    fn patience(&self) -> Duration {
        self.period.times(self.settings.tolerance.cycles.saturating_add(2))
    }

    /// Produces SYNC itself when the other producer's is missing: without SYNC the axes take no set-points, not even
    /// those that stop them.
    fn take_over(&mut self, now: Instant, id: CobId) {
        self.expects = None;
        self.reason.get_or_insert(Reason::SyncLost { silent: self.patience() });
        self.sync.configure(now, id, self.period, 0);
    }

    /// Notes how late our own cycle begins, and whether frames of the previous one are unsent.
    fn note_lateness(&mut self, late: Duration) {
        self.latest = self.latest.max(late);
        let missed = late.as_micros() / self.period.as_micros();
        let unsent = self.sending.is_some();
        let all = missed + u64::from(unsent);
        self.missed += all;
        self.missed_in_a_row = if all == 0 { 0 } else { self.missed_in_a_row + all };
        let runs = matches!(self.phase, Phase::Enabling | Phase::Following);
        if runs && self.missed_in_a_row > self.settings.tolerance.cycles.into() {
            let reason = if unsent { Reason::BusFull } else { Reason::CycleMissed { late } };
            self.reason.get_or_insert(reason);
        }
    }

    /// Judges the previous cycle, and decides what the axes are sent in this one.
    fn run_cycle(&mut self, now: Instant) -> Option<Event> {
        if self.cycle_began.replace(now).is_some() {
            self.members.iter_mut().for_each(Member::end_cycle);
        }
        let begun = match self.phase {
            Phase::New | Phase::Over => return None,
            Phase::Enabling => self.enable(now),
            Phase::Following => self.go_on(now),
            Phase::Stopping(_) => None,
        };
        let ended = self.stop_on(now);
        self.sending = (!self.is_over()).then_some(0);
        // A stop that has just begun does not end in the same cycle.
        begun.or(ended)
    }

    fn trouble(&mut self, now: Instant) -> Option<Reason> {
        let tolerated = self.settings.tolerance.pdos;
        self.reason.or_else(|| self.members.iter().find_map(|member| member.trouble(now, tolerated)))
    }

    fn enable(&mut self, now: Instant) -> Option<Event> {
        let trouble = self.trouble(now);
        let reason =
            trouble.or_else(|| self.members.iter_mut().fold(None, |reason, member| reason.or(member.lead(now))));
        self.last = self.members.iter().map(|member| member.set_point).collect();
        self.before.clone_from(&self.last);
        if reason.is_some() {
            return Some(self.begin_stop(now, reason, Stage::Settle));
        }
        self.members.iter().all(Member::follows).then(|| {
            self.phase = Phase::Following;
            Event::Following
        })
    }

    fn go_on(&mut self, now: Instant) -> Option<Event> {
        let trouble = self.trouble(now);
        let reason = trouble
            .or_else(|| self.members.iter_mut().fold(None, |reason, member| reason.or(member.trouble_following())));
        let supplied = match reason {
            Some(reason) => Err(reason),
            None => self.supply(),
        };
        match supplied {
            Ok(true) => None,
            Ok(false) => Some(self.begin_stop(now, None, Stage::Settle)),
            Err(reason) => {
                let stage = match self.settings.stop {
                    Stop::Quick => Stage::Quick,
                    Stop::Ramp(within) => {
                        let (here, before) = (self.last.clone(), self.before.clone());
                        let there = self.beyond(&here, &before);
                        Stage::Ramp(Ramp::new(within, self.period, here, there))
                    }
                };
                Some(self.begin_stop(now, Some(reason), stage))
            }
        }
    }

    fn begin_stop(&mut self, now: Instant, reason: Option<Reason>, stage: Stage) -> Event {
        self.reason = reason;
        self.phase = Phase::Stopping(Stopping::new(stage, now));
        Event::Stopping(reason)
    }

    /// Sends the axes the next set-points; returns whether there were any.
    fn supply(&mut self) -> Result<bool, Reason> {
        let mut next = self.last.clone();
        let supply = self.path.set_points(self.cycle, &mut next);
        self.has_more = supply != Supply::End;
        match supply {
            Supply::Ready => {
                self.unsupplied = 0;
                if let Err(reason) = self.check(&next, &self.last) {
                    self.has_more = false;
                    return Err(reason);
                }
            }
            Supply::Late => {
                self.unsupplied += 1;
                if self.unsupplied > self.settings.tolerance.set_points {
                    self.has_more = false;
                    return Err(Reason::SetPointsLate { cycles: self.unsupplied });
                }
                next = self.straight_on(&self.last, &self.before);
            }
            Supply::End => return Ok(false),
        }
        for (member, &set_point) in self.members.iter_mut().zip(&next) {
            member.go_to(set_point);
            member.hold();
        }
        self.before = std::mem::replace(&mut self.last, next);
        self.cycle += 1;
        self.followed = self.cycle;
        Ok(true)
    }

    /// Checks that every axis can go from `last` to `next` in one cycle.
    fn check(&self, next: &[i32], last: &[i32]) -> Result<(), Reason> {
        for ((member, &to), &from) in self.members.iter().zip(next).zip(last) {
            let Axis { node, settings, limits, .. } = member.axis;
            if to.abs_diff(from) > settings.max_step {
                return Err(Reason::StepTooLarge { node, from, to, most: settings.max_step });
            }
            // An axis beyond its limits may stay, or move back.
            if let Some([low, high]) = limits.filter(|_| settings.follows_positions())
                && (to > high && to > from || to < low && to < from)
            {
                return Err(Reason::OutsideLimits { node, to, low, high });
            }
        }
        Ok(())
    }

    fn straight_on(&self, last: &[i32], before: &[i32]) -> Vec<i32> {
        let axes = self.members.iter().map(|member| member.axis);
        let next = axes.zip(last).zip(before).map(|((axis, &last), &before)| match axis.settings.follows_positions() {
            true => straight_on(last, before, axis.limits),
            false => last,
        });
        next.collect()
    }

    /// During a stop, the set-points after `last`: those of the path, or else straight on.
    fn beyond(&mut self, last: &[i32], before: &[i32]) -> Vec<i32> {
        let mut next = last.to_vec();
        self.has_more = self.has_more
            && self.path.set_points(self.cycle, &mut next) == Supply::Ready
            && self.check(&next, last).is_ok();
        self.cycle += 1;
        if self.has_more { next } else { self.straight_on(last, before) }
    }

    /// The next cycle of a stop.
    fn stop_on(&mut self, now: Instant) -> Option<Event> {
        if !matches!(self.phase, Phase::Stopping(_)) {
            return None;
        }
        // Takes the stop out of `self`, which the ramp asks for more set-points meanwhile.
        let Phase::Stopping(mut stopping) = std::mem::replace(&mut self.phase, Phase::Over) else { return None };
        if let Stage::Ramp(ramp) = &mut stopping.stage {
            match ramp.advance(|last, before| self.beyond(last, before)) {
                Some(pace) => self.slow_down(ramp, pace),
                None => stopping = Stopping::new(Stage::Settle, now),
            }
        }
        let waited = now.since(stopping.since);
        let is_late = waited >= self.settings.settle;
        let stand = self.stand(now, stopping.since);
        match stopping.stage {
            Stage::Ramp(_) => {}
            Stage::Settle => self.settle(),
            Stage::Quick => self.brake(),
            Stage::Release => {
                self.members.iter_mut().for_each(|member| member.command(Command::DisableVoltage));
                let tolerated = self.settings.tolerance.pdos;
                self.disarms.extend(self.disarming.pop_front().unwrap_or_default());
                let is_disarmed = self.disarming.is_empty() && self.disarms.is_empty();
                let released = |member: &Member| member.is_gone() || member.is_heard(tolerated) && !member.has_torque();
                if is_late || !waited.is_zero() && is_disarmed && self.members.iter().all(released) {
                    self.sync.suspend();
                    self.expects = None;
                    return Some(Event::Over);
                }
            }
        }
        match stopping.stage {
            Stage::Settle | Stage::Quick if stand => {
                self.disarm();
                stopping = Stopping::new(Stage::Release, now);
            }
            Stage::Settle if is_late => stopping = Stopping::new(Stage::Quick, now),
            Stage::Quick if is_late => stopping = Stopping::new(Stage::Release, now),
            _ => {}
        }
        self.phase = Phase::Stopping(stopping);
        None
    }

    /// Whether all axes stand. One that is silent may still move and hear its commands, so it is waited for; one that
    /// has restarted is not.
    fn stand(&self, now: Instant, since: Instant) -> bool {
        let tolerated = self.settings.tolerance.pdos;
        let stands = |member: &Member| member.is_gone() || member.is_heard(tolerated) && member.stands(now, since);
        self.members.iter().all(stands)
    }

    fn slow_down(&mut self, ramp: &Ramp, pace: f64) {
        for (number, member) in self.members.iter_mut().enumerate() {
            let set_point = ramp.between(number);
            let is_position = member.axis.settings.follows_positions();
            // Slower than the set-point, so it fits.
            member.go_to(if is_position { set_point } else { (f64::from(set_point) * pace) as i32 });
            member.hold();
        }
    }

    /// At an ordered end, the drives need not react to the missing signs of life.
    fn disarm(&mut self) {
        let axes: Vec<_> = self.members.iter().filter(|member| !member.is_gone()).map(|member| member.axis).collect();
        let setting =
            |axis: &Axis, (object, value)| DriveContext::new(axis.node, axis.description).setting_frame(object, value);
        let step =
            |step: usize| axes.iter().filter_map(move |axis| Some(setting(axis, axis.disarming[step]?))).collect();
        self.disarming = (0..DISARMING).map(step).filter(|frames: &Vec<_>| !frames.is_empty()).collect();
    }

    fn settle(&mut self) {
        for member in &mut self.members {
            if !member.axis.settings.follows_positions() {
                member.go_to(0);
            }
            member.hold();
        }
    }

    fn brake(&mut self) {
        for member in &mut self.members {
            member.command(if member.has_torque() { Command::QuickStop } else { Command::DisableVoltage });
        }
    }
}

impl<P: Path> StateMachine for Follower<P> {
    type Event = Event;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Event> {
        if self.begins_cycle(frame) {
            self.expects = Some(now + self.patience());
            return self.run_cycle(now);
        }
        self.members.iter_mut().for_each(|member| member.handle_frame(now, frame));
        None
    }

    fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        self.keep_alive.iter_mut().for_each(|it| it.handle_timeout(now));
        if let Some(due) = self.sync.poll_timeout().filter(|due| *due <= now) {
            self.sync.handle_timeout(now);
            self.note_lateness(now.since(due));
            return self.run_cycle(now);
        }
        if let (SyncSource::Followed { id }, Some(_)) = (self.settings.sync, self.expects.filter(|due| *due <= now)) {
            self.take_over(now, id);
        }
        None
    }

    /// In this order: SYNC, the set-points for the next SYNC, the signs of life.
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if matches!(self.phase, Phase::New) {
            self.begin(now);
        }
        if let Some((_, sync)) = self.sync.poll_transmit(now) {
            return Some(sync);
        }
        if let Some(from) = self.sending.take() {
            let mut rest = self.members.iter().enumerate().skip(from);
            if let Some((number, frame)) = rest.find_map(|(number, member)| Some((number, member.frame()?))) {
                self.sending = rest.next().map(|_| number + 1);
                return Some(frame);
            }
        }
        let keep_alive = self.keep_alive.iter_mut().find_map(|it| it.poll_transmit(now));
        keep_alive.or_else(|| self.disarms.pop())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self.phase {
            Phase::New | Phase::Over => None,
            _ => {
                let keep_alive = self.keep_alive.iter().filter_map(KeepAlive::poll_timeout);
                keep_alive.chain(self.sync.poll_timeout()).chain(self.expects).min()
            }
        }
    }
}
