//! Text formats: durations, files, times of day, node-IDs, TOML, and JSON.

pub(crate) mod calendar;
pub mod duration;
pub mod files;
pub mod json;
pub mod node_id;
pub mod similarity;
pub mod time_of_day;
pub mod toml_text;
