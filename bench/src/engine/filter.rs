//! Filters and exports the trace.

use std::sync::Mutex;

use lexican_runtime::{Duration, Frame, Instant};
use lexican_toolbox::bus::cob_ids::CobIds;
use lexican_toolbox::bus::filter::Filter;
use lexican_toolbox::log::{Direction, Format, INTERFACE, Record, Writer};
use lexican_toolbox::text::node_id::node_ids;

use super::lock::lock;
use crate::model::{Model, Which};
use crate::request::Refused;
use crate::view::{Frames, TraceFilter};

/// Parses a filter in the notation of `lexican monitor`'s options.
pub(super) fn which(filter: &TraceFilter) -> Result<Which, Refused> {
    if *filter == TraceFilter::default() {
        return Ok(Which::default());
    }
    fn list<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<Vec<T>, Refused> {
        let words = text.split(',').map(str::trim).filter(|word| !word.is_empty());
        words.map(|word| word.parse().map_err(Refused::new)).collect()
    }
    let some = |text: &String| Some(text.trim().to_owned()).filter(|text| !text.is_empty());
    Ok(Which {
        key: format!("{filter:?}"),
        filter: Filter {
            nodes: some(&filter.nodes).map_or(Ok(Vec::new()), |text| node_ids(&text)).map_err(Refused::new)?,
            services: list(&filter.services)?,
            without: list(&filter.without)?,
            objects: some(&filter.object).into_iter().collect(),
            ids: some(&filter.ids).map(|ids| ids.parse::<CobIds>().map_err(Refused::new)).transpose()?,
            texts: some(&filter.text).into_iter().collect(),
        },
        alarming: filter.alarming,
        transfers: filter.transfers,
    })
}

/// The extension of a log file.
pub(super) fn extension(format: &str) -> &str {
    match format {
        "candump" => "log",
        trc if trc.starts_with("trc") => "trc",
        other => other,
    }
}

/// The most steps of a search in one request; the next request continues.
const STEPS: usize = 50;

/// The pause between two steps, so that others can lock the model.
const BREATH: Duration = Duration::from_micros(50);

/// Works on the model step by step, with pauses for others, until `step` returns that it was the last.
fn step_by_step(steps: usize, mut step: impl FnMut() -> bool) {
    for _ in 0..steps {
        if step() {
            return;
        }
        #[expect(clippy::disallowed_methods, reason = "the bench runs in real time")]
        std::thread::sleep(BREATH.into());
    }
}

/// Rows of the trace.
pub(super) fn rows(model: &Mutex<Model>, which: &Which, at: Option<u64>, from: i64, count: usize) -> Frames {
    step_by_step(STEPS, || lock(model).search(which));
    lock(model).rows(which, at, from, count)
}

/// The frames of the trace as a log.
pub(super) fn log_file(model: &Mutex<Model>, which: &Which, format: Format) -> Result<Vec<u8>, String> {
    let (mut frames, mut next) = (Vec::<(Instant, Frame)>::new(), Some(0));
    step_by_step(usize::MAX, || {
        next = next.and_then(|from| lock(model).frames(which, from, &mut frames));
        next.is_none()
    });
    let mut writer = Writer::in_memory(format);
    for (at, frame) in frames {
        let record = Record { at, interface: INTERFACE.into(), direction: Direction::Received, frame };
        writer.write(&record).map_err(|error| error.to_string())?;
    }
    Ok(writer.into_bytes())
}
