//! The tests of the toolbox.

mod cantools;
#[path = "../../../eds/tests/all/cases.rs"]
mod cases;
#[path = "../../../eds/tests/all/corpus_files.rs"]
mod corpus_files;
mod data_sheets;
mod dbc;
mod doc;
mod drive;
mod flash;
mod logs;
mod parameters;
mod remedies;
mod rows;
