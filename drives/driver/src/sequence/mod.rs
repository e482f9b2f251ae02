//! What the driver does, step by step: each operation is one `async fn` over a [`DriveContext`](crate::DriveContext),
//! the same in every shell.
//!
//! ```text
//! start_by_sync                                                                           travels that begin together
//!   travel  set_points  inching  velocity  torque  homing  latch  pass  cyclic            the operations of a drive
//!   setup  protect  parameters  process_data  identify  measure  history  bus_load
//!     power                                                                               the way from state to state
//!       standstill                                                                        the way to a standstill
//!       refusal                                                                           what would be refused
//!         observe                                                                         what the drive reports
//! ```
//!
//! Each uses only modules below it; inching also uses what ends a travel.

mod bus_load;
mod cyclic;
mod history;
mod homing;
mod identify;
mod inching;
mod latch;
mod measure;
mod observe;
mod parameters;
mod pass;
mod power;
mod process_data;
mod protect;
mod recover;
mod refusal;
mod set_points;
mod setup;
mod standstill;
mod start_by_sync;
mod torque;
mod travel;
mod velocity;

pub use bus_load::{UnpacedPdo, unpaced_pdos};
pub use cyclic::prepare_cyclic;
pub use history::{clear_fault_history, warning};
pub use homing::{calibrate, home};
pub use identify::identify;
pub use inching::{inch, step, stop_inching};
pub use latch::{arm_latch, disarm_latch, latched};
pub use measure::{battery_voltage, set_torque_threshold, temperature, torque_deactivated, torque_threshold};
pub use observe::{cause, fault_history, mode, state};
pub use parameters::{Difference, Setting, compare_parameters, read_parameters, restore, store, write_parameters};
pub use pass::pass;
pub use power::{disable, enable, reset_fault};
pub use process_data::{configure_pdos, receive_pdo, send_pdo};
pub use protect::{protect, unprotect};
pub use recover::{Recovered, Recovery, recover};
pub use refusal::{Order, limits, refuse};
pub use set_points::add_set_point;
pub use setup::{approach, firmware, reaction, set_approach, set_emergencies, set_mode, set_reaction, units};
pub(crate) use standstill::look_for_standstill;
pub use standstill::{quick_stop, stop};
pub use start_by_sync::{prepare_travel, set_start_by_sync};
pub use torque::{apply_torque, torque};
pub use travel::{Progress, confirm_start, drop_travel, finish, interrupt, resume, start_travel, travel};
pub use velocity::run_at;
