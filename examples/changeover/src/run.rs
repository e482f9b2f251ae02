//! Runs the change-over: all drives of a network, each in its own task.

use std::future::Future;

use lexican_machine::tokio::Machine;
use lexican_runtime::{CobId, Frame, Instant};

use crate::axis::Axis;
use crate::progress::Progress;
use crate::recipe::Recipe;
use crate::stop::{Reason, Stop};

/// The drives of a recipe, connected and checked.
pub(crate) struct Run<'a> {
    machine: Machine,
    pub(crate) recipe: &'a Recipe,
    pub(crate) axes: Vec<Axis>,
    stop: Stop,
    /// When SYNC released the drives.
    pub(crate) released: Option<Instant>,
}

impl<'a> Run<'a> {
    /// Boots the machine, connects to all drives, and checks whether they can reach their positions. The error is the
    /// text to print.
    pub(crate) async fn connect(machine: Machine, recipe: &'a Recipe, stop: Stop) -> Result<Self, String> {
        machine.boot().await.map_err(|error| error.to_string())?;
        let connected = at_once(recipe.drives.clone(), |entry| Axis::connect(machine.clone(), entry)).await;
        let (mut axes, mut problems) = (Vec::new(), Vec::new());
        for axis in connected {
            match axis {
                Ok(axis) => axes.push(axis),
                Err(problem) => problems.push(problem),
            }
        }
        if problems.is_empty() {
            Ok(Run { machine, recipe, axes, stop, released: None })
        } else {
            Err(recipe.source.report(&problems))
        }
    }

    /// Moves all drives. Afterwards no drive that still responds is enabled or waits for SYNC, whatever has happened.
    pub(crate) async fn change_over(&mut self) {
        self.each(Axis::enable).await;
        self.each(Axis::prepare).await;
        if self.stop.reason().is_none() {
            self.travel().await;
        }
        self.each(Axis::disable).await;
    }

    /// Why it ended before all drives were in position.
    pub(crate) fn reason(&self) -> Option<Reason> {
        self.stop.reason()
    }

    /// Does the same work for all drives at once.
    async fn each<F: Future<Output = Axis> + Send + 'static>(&mut self, work: impl Fn(Axis, Stop) -> F) {
        self.axes = at_once(std::mem::take(&mut self.axes), |axis| work(axis, self.stop.clone())).await;
    }

    /// Releases all waiting drives by one SYNC, starts the others, and waits for all of them.
    async fn travel(&mut self) {
        let progress = Progress::new(self.axes.iter().map(|axis| axis.entry.name.as_str()));
        // Ignore an error: drives without SYNC report that they have not started.
        let _ = self.machine.network().send(Frame::from_array(CobId::SYNC, [])).await;
        self.released = self.machine.network().now().await.ok();
        let mut axes = std::mem::take(&mut self.axes);
        axes.sort_by_key(|axis| !axis.by_sync);
        let mut tasks = Vec::with_capacity(axes.len());
        for mut axis in axes {
            if !axis.by_sync && self.stop.reason().is_some() {
                self.axes.push(axis);
                continue;
            }
            let bar = progress.begin(&axis.entry.name, axis.from, axis.to);
            bar.say(&format!("{} to {}", axis.show(axis.from), axis.show(axis.to)));
            let started = if axis.by_sync { Ok(()) } else { axis.start().await };
            tasks.push(tokio::spawn(axis.travel(started, bar, self.stop.clone())));
        }
        for task in tasks {
            self.axes.push(task.await.expect("no task panics or is aborted"));
        }
        // In the order of the recipe.
        self.axes.sort_by_key(|axis| axis.entry.node_span.start);
    }
}

/// Does the same work for all items at once; the results are in their order.
async fn at_once<T, R, F>(items: impl IntoIterator<Item = T>, work: impl Fn(T) -> F) -> Vec<R>
where
    F: Future<Output = R> + Send + 'static,
    R: Send + 'static,
{
    let tasks: Vec<_> = items.into_iter().map(|item| tokio::spawn(work(item))).collect();
    let mut results = Vec::with_capacity(tasks.len());
    for task in tasks {
        results.push(task.await.expect("no task panics or is aborted"));
    }
    results
}
