//! Cyclic modes: a program gives the set-points of several axes in every cycle of 1 to 10 ms, and SYNC releases them.
//!
//! ```text
//! SYNC   axes send status word and position (TPDO), and take the set-points of the cycle before
//! RPDO   control word and the next set-point, one frame per axis
//! ...    until the next SYNC: what the axes have sent is judged, and the Path is asked for the next set-points
//! ```
//!
//! 1. [`Drive::prepare_cyclic`](crate::Drive::prepare_cyclic) sets up each drive by SDO, and moves nothing: it maps the
//!    PDOs, writes the period (60C2h), **sets 607Ah to 6064h and only then 6060h**, and returns an [`Axis`].
//! 2. A [`Follower`] of these axes sends SYNC, leads them to OPERATION ENABLED with their set-points where they stand,
//!    and follows a [`Path`], which is a closure or a [`Queue`]. It is a state machine without I/O.
//! 3. [`follow`] runs it over a link until all is over; [`tokio::follow`] runs it over a network of tokio. Both return a
//!    [`Report`].
//!
//! ```no_run
//! use lexican_driver::cyclic::{AxisSettings, Follower, Settings, Supply, follow};
//! use lexican_driver::{CancelHandle, Drive, Kind, Mode};
//! use lexican_runtime::host::Link;
//! use lexican_runtime::{Duration, NodeId};
//!
//! fn circle<L: Link, K: Kind>(mut link: L) -> Result<(), Box<dyn std::error::Error>> {
//!     let settings = AxisSettings::new(Mode::CyclicPosition, Duration::from_millis(2), 50);
//!     let mut axes = Vec::new();
//!     for node in [5, 6].map(NodeId::literal) {
//!         // The path keeps the axes' protection alive, which `prepare_cyclic` arms.
//!         axes.push(Drive::<_, K>::connect_unprotected(&mut link, node)?.prepare_cyclic(settings)?);
//!     }
//!     let start: Vec<i32> = axes.iter().map(|axis| axis.position()).collect();
//!     let path = move |cycle: u64, set_points: &mut [i32]| {
//!         let (sin, cos) = (cycle as f64 / 500.0).sin_cos();
//!         set_points[0] = start[0] + (1000.0 * (1.0 - cos)) as i32;
//!         set_points[1] = start[1] + (1000.0 * sin) as i32;
//!         if cycle < 3142 { Supply::Ready } else { Supply::End }
//!     };
//!     let mut follower = Follower::new(axes, path, Settings::default())?;
//!     println!("{}", follow(&mut link, &mut follower, &CancelHandle::default())?);
//!     Ok(())
//! }
//! ```
//!
//! # How it ends
//!
//! The path ends ([`Supply::End`]), or there is a [`Reason`] to stop: a missed cycle, a missing PDO, a following error,
//! a fault, a lost drive, a drive that has left OPERATION ENABLED, late set-points, or a step that is too large and is
//! not sent. Then **all axes are stopped**, within a time that does not depend on them:
//!
//! 1. by a ramp along the path ([`Stop::Ramp`], by default 200 ms): the path is followed ever more slowly. When it has
//!    no more set-points, the axes go straight on. All axes slow down in the same proportion, so that they stay on the
//!    path. Or by quick stop of each axis on its own ([`Stop::Quick`]), as its 6085h and 605Ah say;
//! 2. axes that do not stand within [`Settings::settle`] are sent a quick stop, and get the same time again;
//! 3. all motors are released (Disable voltage), and SYNC ends.
//!
//! For each axis, the [`Report`] has its position and whether it has been seen to stand. An axis that has restarted is
//! sent nothing more, since its PDOs are not known any more; one that has left OPERATION ENABLED is never sent a word
//! that leads there again. A reset of its communication undoes the set-up of a drive.
//!
//! A [`Follower`] that is dropped while it follows sends nothing more. In that case [`follow`] sends a quick stop to
//! all axes, as it does when the path panics. A process that is killed sends nothing, and the drives notice that SYNC
//! or the heartbeat of [`Axis::protected_by`] is missing. None of this replaces an emergency stop.
//!
//! # Time
//!
//! SYNC is sent by the program's clock: when its thread wakes up and the interface has room. How even that is depends
//! on the machine: `examples/circle` prints the times from SYNC to SYNC, and its README has those of a slow one over
//! vcan. Drives interpolate between set-points by their own clock; how much jitter they tolerate is in their 1007h and
//! their manual. Each cycle that is late by a whole period is counted, and [`Tolerance::cycles`] says how many in a row
//! are tolerated. Timers of tokio have a resolution of 1 ms: over a network of tokio, take a period of 5 ms or more.
//!
//! An axis takes two frames of 6 bytes, at 1 Mbit/s up to 230 us with stuff bits, and SYNC takes 55 us. So the bus has
//! room for 4 axes at 1 ms, 8 at 2 ms, 21 at 5 ms, 43 at 10 ms.

mod axis;
mod blocking;
mod follower;
mod path;
mod report;
mod settings;
mod stopping;
#[cfg(feature = "tokio")]
pub mod tokio;

pub use axis::Axis;
pub use blocking::follow;
pub use follower::{Event, Follower, SetUpError};
pub use path::{Path, Queue, Supply};
pub use report::{AxisReport, End, Reason, Report};
pub use settings::{AxisSettings, Settings, Stop, SyncSource, Tolerance};
