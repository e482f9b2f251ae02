//! Simulated devices, and programs that are disturbed at them.

mod chaos;
#[path = "../../../eds/tests/all/corpus_files.rs"]
mod corpus_files;
mod dead_man;
mod declared;
mod replace;
mod side_by_side;
