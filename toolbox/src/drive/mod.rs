//! Moves a drive by hand: carries out an [`Order`], reports a [`Look`] at the drive whenever something has changed, and
//! returns the [`Ending`].
//!
//! [`carry_out`] is a sequence of `lexican_driver`, so it runs in both shells: `drive.run(async |context|
//! carry_out(&context, order, times, &mut look, &mut wanted).await)`. Reacting to the end of the program while the
//! drive moves is up to the shell. [`Scales`] converts positions and velocities to the units of the data sheet.

mod described;
mod ending;
mod explain;
mod look;
mod order;
mod profile;
mod safe_end;
mod scales;
mod verb;

pub use described::describe;
pub use ending::Ending;
pub use explain::{Fact, Verdict, explain_drive, explain_profile, explain_settings, explain_sheet};
pub use look::Look;
pub use order::{Times, carry_out, has_ended, prepare, see};
pub use profile::set_profile;
pub use safe_end::{RESCUE, SafeEnd, end_safely, unstoppable};
pub use scales::Scales;
pub use verb::{Order, Verb};
