//! Reading, judging, changing and writing data sheets. `memory` is a separate program, because it measures its own
//! process.

mod cases;
mod corpus;
mod corpus_files;
mod drive;
mod edit;
mod exercise;
mod golden;
mod nothing_dropped;
mod output;
mod overlay;
mod precision;
mod quirks;
mod remedies;
mod remedy;
mod robust;
mod xdd;
mod xdd_edit;
