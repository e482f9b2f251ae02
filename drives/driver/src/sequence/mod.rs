//! What the driver does, step by step: each operation is one `async fn` over a [`Desk`](crate::Desk), whatever shell
//! runs it.

mod identify;
mod inching;
mod measure;
mod parameters;
mod power;
mod refusal;
mod setup;
mod travel;
mod velocity;

pub use identify::identify;
pub use inching::{inch, step, stop_inching};
pub use measure::{battery_voltage, set_torque_threshold, temperature, torque_deactivated, torque_threshold};
pub use parameters::{Difference, Setting, compare_parameters, read_parameters, restore, store, write_parameters};
pub use power::{cause, disable, enable, quick_stop, reset_fault, state};
pub use refusal::{Order, refuse};
pub use setup::{approach, calibrate, firmware, mode, set_approach, set_emergencies, set_mode, units};
pub use travel::{Progress, finish, interrupt, resume, start_travel, travel};
pub use velocity::{run_at, stop};
