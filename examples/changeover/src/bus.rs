//! The simulated bus, with all drives of a recipe on it.

use std::str::FromStr;

use clap::ValueEnum;
use lexican_runtime::host::{self, Link, Node};
use lexican_runtime::{Duration, Frame, Instant, NodeId};

use crate::kinds::{Fail, Lines};
use crate::recipe::Recipe;

/// How fast simulated time passes.
#[derive(Clone, Copy, Default, ValueEnum)]
pub(crate) enum Pace {
    /// As fast as the machine can compute it
    #[default]
    Virtual,
    /// As fast as on a real machine, to watch
    Real,
}

/// Which simulated drive fails, and when.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    node: NodeId,
    at: Instant,
}

impl FromStr for Fault {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (node, seconds) = text.split_once('@').ok_or("say which node, and when: 7@2.5")?;
        let node = node.parse().ok().and_then(NodeId::new).ok_or("a node-ID is 1 to 127")?;
        let seconds = seconds.parse::<f64>().ok().filter(|seconds| (0.0..1e6).contains(seconds));
        let micros = (seconds.ok_or("the time is a number of seconds")? * 1e6) as u64;
        Ok(Fault { node, at: Instant::ZERO + Duration::from_micros(micros) })
    }
}

/// A bus with the drives of the recipe.
pub(crate) fn simulated(recipe: &Recipe, pace: Pace, fault: Option<Fault>) -> Result<Box<dyn Link + Send>, String> {
    let lines = Lines::new();
    let mut failing = None;
    for drive in &recipe.drives {
        let fail = (drive.kind.simulate)(&lines, drive.node);
        if let Some(fault) = fault.filter(|fault| fault.node == drive.node) {
            failing = Some(Alarm { at: fault.at, fail: Some(fail) });
        }
    }
    match (failing, fault) {
        (Some(alarm), _) => drop(lines.can.attach(alarm)),
        (None, Some(Fault { node, .. })) => return Err(format!("--fault: the recipe has no drive at node {node}")),
        (None, None) => {}
    }
    lines.can.set_pace(match pace {
        Pace::Virtual => host::Pace::Virtual,
        Pace::Real => host::Pace::RealTime,
    });
    Ok(Box::new(lines.can.link()))
}

/// Has a drive fail when its time has come. It is a node of the bus, which calls its nodes in virtual time.
struct Alarm {
    at: Instant,
    fail: Option<Fail>,
}

impl Node for Alarm {
    fn handle_frame(&mut self, _: Instant, _: &Frame) {}

    fn handle_timeout(&mut self, now: Instant) {
        if let Some(fail) = self.fail.take() {
            fail(now);
        }
    }

    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.fail.as_ref().map(|_| self.at)
    }
}
