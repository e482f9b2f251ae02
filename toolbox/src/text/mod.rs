//! What people name and write: files, times of day, node-IDs, TOML; and what programs read, JSON.

pub mod files;
pub mod json;
pub mod node_id;
pub mod time_of_day;
pub mod toml_text;
