//! Following a path over a network of tokio.

use std::pin::pin;

use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::host::{LinkError, StateMachine};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Instant, manager};
use tokio::sync::broadcast::error::RecvError;

use super::follower::Follower;
use super::path::Path;
use super::report::Report;

/// Follows a path until all is over, and all axes are released. If this future is dropped before, all axes are sent a quick
/// stop. To stop them along the path, have the path end.
///
/// SYNC is produced by the follower; its own cannot be [followed](super::SyncSource::Followed), since a network reports no
/// SYNC.
///
/// # Errors
///
/// [`LinkError`] when the link is gone for good, as [`follow`](super::follow).
pub async fn follow<P: Path>(network: &Network, follower: &mut Follower<P>) -> Result<Report, LinkError> {
    let mut events = network.events();
    let mut now = network.now().await?;
    let mut run = Run { network, follower };
    loop {
        while let Some(frame) = run.follower.poll_transmit(now) {
            // Without waiting for each, so that all of a cycle leave together.
            let Err(frame) = network.post(frame) else { continue };
            match network.send(frame).await {
                Err(error) if error.is_final() => return Err(error),
                Ok(()) | Err(_) => {}
            }
        }
        if run.follower.is_over() {
            return Ok(run.follower.report());
        }
        let mut alarm = pin!(network.sleep_until(run.follower.poll_timeout().unwrap_or(Instant::MAX)));
        now = loop {
            let event = tokio::select! {
                // What has come by then is heard first.
                biased;
                event = events.recv() => event,
                now = &mut alarm => break now?,
            };
            match event {
                Ok(event) => run.hear(now, event),
                // PDOs that were missed count as missing.
                Err(RecvError::Lagged(_)) => {}
                // The network has ended: it reports why.
                Err(RecvError::Closed) => break (&mut alarm).await?,
            }
        };
        while run.follower.poll_timeout().is_some_and(|due| due <= now) {
            run.follower.handle_timeout(now);
        }
    }
}

struct Run<'a, P: Path> {
    network: &'a Network,
    follower: &'a mut Follower<P>,
}

impl<P: Path> Run<'_, P> {
    /// Takes note of an event, at the time of the cycle.
    fn hear(&mut self, now: Instant, event: Event) {
        let Event::Manager(event) = event else { return };
        match event {
            manager::Event::Pdo { frame, .. } => drop(self.follower.handle_frame(now, &frame)),
            manager::Event::Emergency { node, emergency } => {
                if let Some(member) = self.follower.member(node) {
                    member.handle_emergency(emergency);
                }
            }
            manager::Event::BootedUp { node } => {
                if let Some(member) = self.follower.member(node) {
                    member.handle_nmt_state(NmtState::Initialising);
                }
            }
            _ => {}
        }
    }
}

impl<P: Path> Drop for Run<'_, P> {
    fn drop(&mut self) {
        for frame in self.follower.let_go() {
            // The network ends, or has no room: nothing more can be done from here.
            let _ = self.network.post(frame);
        }
    }
}
