//! What the driver does, step by step: each operation is one `async fn` over a [`Desk`](super::Desk), whatever shell
//! runs it.

mod parameters;
mod power;
mod refusal;
mod travel;
mod velocity;

pub use parameters::{
    Difference, Setting, calibrate, compare_parameters, identify, read_parameters, restore, set_mode, write_parameters,
};
pub use power::{cause, disable, enable, quick_stop, reset_fault, state};
pub use refusal::{Order, refuse};
pub use travel::{Progress, finish, inch, interrupt, resume, start_travel, step, stop_inching};
pub use velocity::{run_at, stop};
