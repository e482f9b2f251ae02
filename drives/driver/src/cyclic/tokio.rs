//! Following a path over a network of tokio.

use std::pin::pin;

use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::host::{LinkError, StateMachine};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Instant, NodeId, manager};
use tokio::sync::broadcast::error::RecvError;

use super::axis::Member;
use super::follower::Follower;
use super::path::Path;
use super::report::Report;

/// Follows a path until it is over and all axes are released. If this future is dropped before, all axes are sent a
/// quick stop. To stop them along the path, let the path end.
///
/// The SYNC of another node can be [followed](super::SyncSource::Followed) if the network reports it, as
/// [`manager::Event::Sync`] or as a PDO. A network that [listens only to its own frames](Network::listen_to_own) has to
/// be given the COB-ID of SYNC besides.
pub async fn follow<P: Path>(network: &Network, follower: &mut Follower<P>) -> Result<Report, LinkError> {
    let mut events = network.events();
    let mut now = network.now().await?;
    let mut run = Run { network, follower };
    loop {
        while let Some(frame) = run.follower.poll_transmit(now) {
            // Without waiting for each one, so that all frames of a cycle leave together.
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
                // Events that came before the alarm are handled first.
                biased;
                event = events.recv() => event,
                now = &mut alarm => break now?,
            };
            match event {
                Ok(Event::Manager(manager::Event::Pdo { frame, .. } | manager::Event::Sync(frame)))
                    if run.follower.begins_cycle(&frame) =>
                {
                    let now = network.now().await?;
                    run.follower.handle_frame(now, &frame);
                    break now;
                }
                Ok(Event::Manager(event)) => run.hear(now, event),
                Ok(_) => {}
                // PDOs that were missed count as missing.
                Err(RecvError::Lagged(_)) => {}
                // The network has ended: the call reports why.
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
    fn member(&mut self, node: NodeId, hears: impl FnOnce(&mut Member)) {
        if let Some(member) = self.follower.member(node) {
            hears(member);
        }
    }

    /// Handles an event at the time of the cycle.
    fn hear(&mut self, now: Instant, event: manager::Event) {
        match event {
            manager::Event::Pdo { frame, .. } => drop(self.follower.handle_frame(now, &frame)),
            manager::Event::Emergency { node, emergency } => {
                self.member(node, |member| member.handle_emergency(emergency));
            }
            manager::Event::BootedUp { node } => {
                self.member(node, |member| member.handle_nmt_state(NmtState::Initialising));
            }
            manager::Event::Appeared { node, state }
            | manager::Event::StateChanged { node, state }
            | manager::Event::Stranger { node, state } => self.member(node, |member| member.handle_nmt_state(state)),
            _ => {}
        }
    }
}

impl<P: Path> Drop for Run<'_, P> {
    fn drop(&mut self) {
        for frame in self.follower.let_go() {
            // The network is ending or has no room: there is nothing else to try.
            let _ = self.network.post(frame);
        }
    }
}
