//! Filters and formats of the trace, in the words of faces.

use lexican_toolbox::cob_ids::CobIds;
use lexican_toolbox::filter::Filter;
use lexican_toolbox::node_id::node_ids;

use crate::command::{Refused, TraceFilter};
use crate::model::Which;

/// A filter in the words of `lexican monitor`.
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

/// The end of the name of a log.
pub(super) fn extension(format: &str) -> &str {
    match format {
        "candump" => "log",
        trc if trc.starts_with("trc") => "trc",
        other => other,
    }
}
