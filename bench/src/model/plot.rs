//! Watched values and curves.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use lexican_pictures::{self as pictures, Picture};
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, Instant, Measured, NodeId};
use lexican_toolbox::trace::sampler::Signal;
use lexican_toolbox::trace::series::{Recording, number};
use lexican_toolbox::values::report::ValueReport;

use super::age::{DRIVE, old_after, shown, time};
use crate::view;

/// The curves of each node.
#[derive(Clone, Default)]
pub(crate) struct Plot {
    nodes: BTreeMap<NodeId, Curves>,
}

#[derive(Clone)]
struct Curves {
    /// With their intervals of reading, in ms.
    signals: Vec<(Signal, u32)>,
    recording: Recording,
}

impl Plot {
    /// Adds signals of a node; returns those that are new.
    pub(crate) fn add(
        &mut self,
        node: NodeId,
        signals: impl IntoIterator<Item = Signal>,
        every_ms: u32,
    ) -> Vec<Signal> {
        let curves = self.nodes.entry(node);
        let began = Instant::ZERO;
        let curves = curves.or_insert_with(|| Curves { signals: Vec::new(), recording: Recording::beginning(began) });
        let new: Vec<_> =
            signals.into_iter().filter(|signal| curves.signals.iter().all(|(known, _)| known != signal)).collect();
        curves.signals.extend(new.iter().map(|signal| (*signal, every_ms)));
        new
    }

    /// Removes the curves of a node, or all; returns their objects with the intervals of reading.
    pub(crate) fn clear(&mut self, node: Option<NodeId>) -> Vec<(NodeId, Address, u32)> {
        let (cleared, kept) =
            std::mem::take(&mut self.nodes).into_iter().partition(|(known, _)| node.is_none_or(|node| node == *known));
        self.nodes = kept;
        let cleared: BTreeMap<NodeId, Curves> = cleared;
        let objects = cleared.into_iter().flat_map(|(node, curves)| {
            curves.signals.into_iter().filter_map(move |(signal, every_ms)| match signal {
                Signal::Object(address) => Some((node, address, every_ms)),
                Signal::Pdo { .. } => None,
            })
        });
        objects.collect()
    }

    /// Removes a signal of a node; returns its interval.
    pub(crate) fn remove(&mut self, node: NodeId, signal: Signal) -> Option<u32> {
        let curves = self.nodes.get_mut(&node)?;
        let place = curves.signals.iter().position(|(known, _)| *known == signal)?;
        let (_, every_ms) = curves.signals.remove(place);
        let signals = &curves.signals;
        let has_pdo = signals.iter().any(|(signal, _)| matches!(signal, Signal::Pdo { .. }));
        curves.recording.retain(|address| {
            // The mapping of the remaining PDOs is unknown here, so their curves are kept.
            (has_pdo && signal != Signal::Object(address))
                || signals.iter().any(|(known, _)| *known == Signal::Object(address))
        });
        if curves.signals.is_empty() {
            self.nodes.remove(&node);
        }
        Some(every_ms)
    }

    /// The same signals without values.
    pub(crate) fn rewound(mut self) -> Self {
        for curves in self.nodes.values_mut() {
            curves.recording = Recording::beginning(Instant::ZERO);
        }
        self
    }

    /// Takes a value.
    pub(crate) fn take(&mut self, at: Instant, node: NodeId, report: &ValueReport) {
        self.take_if(at, node, report, |signal| *signal == Signal::Object(report.address));
    }

    /// Takes the values in a PDO.
    pub(crate) fn take_pdo(&mut self, at: Instant, node: NodeId, pdo: Signal, fields: &[ValueReport]) {
        for report in fields {
            self.take_if(at, node, report, |signal| *signal == pdo || *signal == Signal::Object(report.address));
        }
    }

    fn take_if(&mut self, at: Instant, node: NodeId, report: &ValueReport, wants: impl Fn(&Signal) -> bool) {
        if let Some(curves) = self.nodes.get_mut(&node)
            && curves.signals.iter().any(|(signal, _)| wants(signal))
        {
            curves.recording.take(at, report);
        }
    }

    /// The points after a time. A curve whose next point is overdue is old.
    pub(crate) fn since(&self, seconds: f64, now: Instant, latency: Duration) -> Vec<view::Curve> {
        let of_node = |(node, curves): (&NodeId, &Curves)| {
            let of_series = |series: &lexican_toolbox::trace::series::Series| {
                let first = series.points.partition_point(|(at, _)| *at <= seconds);
                let every = curves.signals.iter().find(|(signal, _)| *signal == Signal::Object(series.address));
                // The interval of a PDO is unknown.
                let every = every.map_or(DRIVE, |(_, every_ms)| Duration::from_millis((*every_ms).into()));
                let last = series.points.last().map(|(at, _)| Measured::new((), time(*at)));
                view::Curve {
                    node: node.get(),
                    address: series.address.to_string(),
                    name: series.name.clone(),
                    unit: series.unit.clone(),
                    seen: last.map(|last| shown(&last, now, old_after(every, latency))),
                    points: series.points[first..].to_vec(),
                }
            };
            curves.recording.series().iter().map(of_series).collect::<Vec<_>>()
        };
        self.nodes.iter().flat_map(of_node).collect()
    }

    /// All points as a table, by time.
    pub(crate) fn csv(&self) -> String {
        let curves = self.since(f64::NEG_INFINITY, Instant::ZERO, Duration::ZERO);
        let mut rows: Vec<_> =
            curves.iter().flat_map(|curve| curve.points.iter().map(move |(at, value)| (*at, *value, curve))).collect();
        rows.sort_by(|one, two| one.0.total_cmp(&two.0));
        let mut text = "time,node,address,name,unit,value\n".to_owned();
        for (at, value, curve) in rows {
            let name = curve.name.replace('"', "\"\"");
            let unit = curve.unit.as_deref().unwrap_or_default();
            let _ = writeln!(text, "{at:.6},{},{},\"{name}\",{unit},{value}", curve.node, curve.address);
        }
        text
    }

    /// An SVG document with a panel for each node and unit.
    pub(crate) fn svg(&self, title: &str) -> String {
        let mut picture = Picture { title: title.to_owned(), axis: "time [s]".to_owned(), ..Picture::default() };
        for (node, curves) in &self.nodes {
            let of_node = curves.recording.picture(String::new());
            picture.span.end = picture.span.end.max(of_node.span.end);
            for mut panel in of_node.panels {
                panel.title = format!("node {node} {}", panel.title);
                picture.panels.push(panel);
            }
        }
        pictures::svg(&[picture])
    }
}

/// A watched value.
pub(crate) struct Watched {
    /// The interval of reading, in ms.
    pub(crate) every_ms: u32,
    /// The last value, and statistics of the earlier ones.
    pub(crate) value: Option<Measured<view::Value>>,
    bounds: Option<(f64, f64)>,
    changes: u64,
}

impl Watched {
    /// Without a value yet.
    pub(crate) fn new(every_ms: u32) -> Self {
        Watched { every_ms, value: None, bounds: None, changes: 0 }
    }

    /// Takes a value.
    pub(crate) fn take(&mut self, report: &ValueReport, value: Measured<view::Value>) {
        if let Some(number) = number(report) {
            let (low, high) = self.bounds.unwrap_or((number, number));
            self.bounds = Some((low.min(number), high.max(number)));
        }
        self.changes += u64::from(self.value.as_ref().is_some_and(|before| before.value.text != value.value.text));
        self.value = Some(value);
    }

    /// The watched value in the view.
    pub(crate) fn view(
        &self,
        now: Instant,
        latency: Duration,
        node: NodeId,
        address: Address,
        name: String,
    ) -> view::Watched {
        let limit = old_after(Duration::from_millis(self.every_ms.into()), latency);
        view::Watched {
            node: node.get(),
            address: address.to_string(),
            name,
            every_ms: self.every_ms,
            value: self.value.as_ref().map(|seen| seen.value.clone()),
            seen: self.value.as_ref().map(|seen| shown(seen, now, limit)),
            bounds: self.bounds,
            changes: self.changes,
        }
    }
}
