//! Moving a drive by hand: one [`Order`], carried out with a [`Look`] at the drive whenever it has changed, up to its
//! [`Ending`].
//!
//! [`carry_out`] is a sequence of `lexican_driver`, so it runs in both shells:
//! `drive.run(async |context| carry_out(&context, order, times, &mut look, &mut wanted).await)`. What ends a program while the drive
//! moves is the shell's matter. [`Scales`] has positions and velocities in the units of the data sheet.

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
