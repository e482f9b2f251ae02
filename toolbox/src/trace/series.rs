//! Values over time, as curves and as table rows.

use lexican_eds::model::Value;
use lexican_pictures::{Curve, Panel, Picture, held};
use lexican_runtime::Instant;
use lexican_runtime::object::Address;

use crate::values::report::ValueReport;

/// The most points of a curve; beyond, every second one is dropped.
const MOST: usize = 200_000;

/// The values of one entry over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The entry.
    pub address: Address,
    /// From the data sheet, else the address.
    pub name: String,
    /// `None` for counts of the device.
    pub unit: Option<String>,
    /// Time in seconds from the beginning, ascending, and value.
    pub points: Vec<(f64, f64)>,
    /// The last value as text.
    pub text: String,
    /// The lowest and the highest value.
    pub bounds: (f64, f64),
    /// The number of changes.
    pub changes: u64,
    /// The time of the last change, in seconds from the beginning.
    pub changed: f64,
    /// Only every nth value becomes a point; a table still gets each value.
    step: usize,
    skipped: usize,
}

/// The curves of several entries over the same time.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    began: Option<Instant>,
    series: Vec<Series>,
}

impl Recording {
    /// A recording whose time begins at `at`, not at its first value.
    #[must_use]
    pub fn beginning(at: Instant) -> Self {
        Recording { began: Some(at), series: Vec::new() }
    }

    /// Adds a value; returns whether it differs from the previous one.
    pub fn take(&mut self, at: Instant, report: &ValueReport) -> bool {
        let seconds = at.since(*self.began.get_or_insert(at)).as_secs_f64();
        let place = self.series.iter().position(|series| series.address == report.address);
        let place = place.unwrap_or_else(|| {
            self.series.push(Series::new(report));
            self.series.len() - 1
        });
        self.series[place].take(seconds, report)
    }

    /// The curves, in the order of their first values.
    #[must_use]
    pub fn series(&self) -> &[Series] {
        &self.series
    }

    /// Removes the curves for which `is_kept` is false.
    pub fn retain(&mut self, mut is_kept: impl FnMut(Address) -> bool) {
        self.series.retain(|series| is_kept(series.address));
    }

    /// The time from the first to the last value, in seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        let last = self.series.iter().filter_map(|series| series.points.last());
        last.map(|(at, _)| *at).fold(0.0, f64::max)
    }

    /// The units of curves with points, without duplicates.
    #[must_use]
    pub fn units(&self) -> Vec<Option<&str>> {
        let mut units = Vec::new();
        for series in self.series.iter().filter(|series| !series.points.is_empty()) {
            if !units.contains(&series.unit.as_deref()) {
                units.push(series.unit.as_deref());
            }
        }
        units
    }

    /// The curves with this unit.
    pub fn of_unit<'s>(&'s self, unit: Option<&'s str>) -> impl Iterator<Item = &'s Series> {
        self.series.iter().filter(move |series| series.unit.as_deref() == unit && !series.points.is_empty())
    }

    /// A picture with one panel for each unit. Curves are steps: a value holds until the next.
    #[must_use]
    pub fn picture(&self, title: String) -> Picture {
        let end = self.seconds().max(1e-3);
        let panel = |unit: Option<&str>| {
            let unit_text = unit.map_or_else(|| "value".to_owned(), |unit| format!("[{unit}]"));
            let curves: Vec<_> =
                self.of_unit(unit).map(|series| Curve::new(&*series.name, held(&series.points))).collect();
            match &curves[..] {
                // A single curve needs no legend.
                [curve] => Panel::curves(format!("{} {unit_text}", curve.name), curves),
                _ => Panel::curves(unit_text, curves),
            }
        };
        let values: usize = self.series.iter().map(|series| series.points.len()).sum();
        Picture {
            title,
            subtitle: format!("{values} values in {end:.3} s"),
            axis: "time [s]".to_owned(),
            span: 0.0..end,
            panels: self.units().into_iter().map(panel).collect(),
            events: Vec::new(),
        }
    }
}

/// A value as a number, in its unit if it has one.
#[must_use]
pub fn number(report: &ValueReport) -> Option<f64> {
    report.unit.as_ref().map(|(_, scaled)| *scaled).or(match &report.value {
        Some(Value::Integer(number)) => Some(*number as f64),
        Some(Value::Real(number)) if number.is_finite() => Some(*number),
        _ => None,
    })
}

impl Series {
    fn new(report: &ValueReport) -> Self {
        Series {
            address: report.address,
            name: report.name.as_deref().map_or_else(|| report.address.to_string(), str::to_owned),
            unit: report.unit.as_ref().map(|(symbol, _)| symbol.clone()),
            points: Vec::new(),
            text: String::new(),
            bounds: (f64::INFINITY, f64::NEG_INFINITY),
            changes: 0,
            changed: 0.0,
            step: 1,
            skipped: 0,
        }
    }

    fn take(&mut self, seconds: f64, report: &ValueReport) -> bool {
        let is_first = self.text.is_empty();
        let is_new = self.text != report.text();
        if is_new {
            report.text().clone_into(&mut self.text);
            self.changes += u64::from(!is_first);
            self.changed = seconds;
        }
        if let Some(number) = number(report) {
            self.bounds = (self.bounds.0.min(number), self.bounds.1.max(number));
            self.skipped += 1;
            if self.skipped >= self.step {
                self.skipped = 0;
                self.points.push((seconds, number));
            }
            if self.points.len() > MOST {
                let mut places = 0..;
                self.points.retain(|_| places.next().is_some_and(|place: usize| place.is_multiple_of(2)));
                self.step *= 2;
            }
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_pictures::Content;

    fn report(number: i128, unit: Option<(&str, f64)>) -> ValueReport {
        ValueReport {
            value: Some(Value::Integer(number)),
            text: Some(number.to_string()),
            unit: unit.map(|(symbol, factor)| (symbol.to_owned(), number as f64 * factor)),
            ..ValueReport::without_value(None, Address::new(0x6064, 0))
        }
    }

    #[test]
    fn a_series_knows_its_bounds_and_changes() {
        let mut recording = Recording::default();
        let at = |ms: u64| Instant::from_micros(5_000_000 + ms * 1000);
        let new: Vec<_> = [(0, 5), (10, 5), (20, -7), (30, 2)]
            .map(|(ms, number)| recording.take(at(ms), &report(number, Some(("mm", 0.1)))))
            .into();
        assert_eq!(new, [true, false, true, true]);
        let series = &recording.series()[0];
        assert_eq!((series.changes, series.text.as_str()), (2, "2"));
        assert!((series.bounds.0 + 0.7).abs() < 1e-9 && (series.bounds.1 - 0.5).abs() < 1e-9);
        assert_eq!(series.points[2].0, 0.02);
        let picture = recording.picture("t".to_owned());
        assert_eq!(picture.panels[0].title, "6064:00 [mm]");
        let Content::Curves(curves) = &picture.panels[0].content else { panic!("{picture:?}") };
        assert_eq!(curves[0].points.len(), 4 + 2, "each change is a step");
    }

    #[test]
    fn a_long_recording_gets_coarser() {
        let mut recording = Recording::default();
        let count = MOST as u64 * 3;
        for number in 0..count {
            recording.take(Instant::from_micros(number * 1000), &report(number.into(), None));
        }
        let series = &recording.series()[0];
        assert!((MOST / 2..=MOST).contains(&series.points.len()), "{}", series.points.len());
        assert!(series.points.is_sorted_by(|one, two| one.0 < two.0));
        assert_eq!(series.bounds, (0.0, (count - 1) as f64));
        let gaps: Vec<_> = series.points.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
        assert!(gaps.iter().all(|gap| *gap == gaps[0]), "evenly");
    }
}
