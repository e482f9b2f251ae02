//! What a program leaves behind that ends at any moment: it is run against a simulated plant, disturbed at a moment that a
//! seed decides, and judged by what moves then, what is half written, and what it claims.
//!
//! A [`Plan`] says what is done when. [`Running`] is the plant as a [`Node`](lexican_runtime::host::Node), which does to bus
//! and supply what is planned, says which signals the process gets, and ends as a [`Trial`]. A first run without a plan is the
//! [`Reference`]. Processes and files are the caller's.

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
