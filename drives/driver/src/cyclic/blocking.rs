//! Following a path over a link.

use lexican_runtime::Duration;
use lexican_runtime::host::{Link, LinkError, Pump};

use super::follower::Follower;
use super::path::Path;
use super::report::Report;
use crate::cancel::CancelHandle;

/// How often the loop checks for cancellation.
const LOOK: Duration = Duration::from_millis(50);

/// Follows a path until it is over and all axes are released; `cancel` stops them from another thread. If this function
/// is left in another way, such as by a panic of the path, all axes are sent a quick stop.
///
/// Errors: [`LinkError`] if the link is gone for good: nothing could be sent, not even a stop. A bus that carries no
/// frames for a while is not an error: PDOs are missing then.
pub fn follow<L: Link + ?Sized, P: Path>(
    link: &mut L,
    follower: &mut Follower<P>,
    cancel: &CancelHandle,
) -> Result<Report, LinkError> {
    let run = Run { link, follower };
    let mut pump = Pump::new();
    while !run.follower.is_over() {
        if cancel.take() {
            run.follower.cancel();
        }
        let until = run.link.now() + LOOK;
        match pump.turn(run.link, run.follower, until) {
            Err(error) if error.is_final() => return Err(error),
            Ok(_) | Err(_) => {}
        }
    }
    Ok(run.follower.report())
}

struct Run<'a, L: Link + ?Sized, P: Path> {
    link: &'a mut L,
    follower: &'a mut Follower<P>,
}

impl<L: Link + ?Sized, P: Path> Drop for Run<'_, L, P> {
    fn drop(&mut self) {
        for frame in self.follower.let_go() {
            // There is no caller to report a lost link to.
            let _ = self.link.send(&frame);
        }
    }
}
