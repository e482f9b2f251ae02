//! Trials that show what a program leaves behind when it ends or is disturbed at any moment. It runs against a
//! simulated plant, and a seed decides when and how it is disturbed. The trial judges what moves then, what is half
//! written, and what the program claims.
//!
//! A [`Plan`] says what is done and when. [`Running`] is the plant as a [`Node`](lexican_runtime::host::Node): it cuts
//! bus or supply as planned, says which signals the process gets, and ends as a [`Trial`]. A first run without a plan
//! gives the [`Reference`]. The caller handles processes and files.

mod judge;
mod plan;
mod rig;
mod seen;
mod trial;

pub use judge::judge_file;
pub use plan::{Disturbance, Moment, Plan};
pub use rig::Record;
pub use seen::{End, Finding, Level, Reference};
pub use trial::{Act, GRACE, Running, Settings, Signal, Trial};
