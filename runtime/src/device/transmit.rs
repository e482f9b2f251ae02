//! What a device sends, and when it wants to be asked.

use super::{Device, Quiet};
use crate::frame::Frame;
use crate::object::ObjectDictionary;
use crate::service::heartbeat_consumer::HeartbeatConsumer;
use crate::service::sdo_server::SdoServer;
use crate::time::Instant;
use crate::wire::nmt::NmtState;
use crate::wire::time;

impl<const RPDOS: usize, const TPDOS: usize, const SERVERS: usize, const MONITORED: usize>
    Device<RPDOS, TPDOS, SERVERS, MONITORED>
{
    /// The next frame to send, the most important one first.
    #[inline]
    pub fn poll_transmit(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        if self.quiet.is_none()
            && let Some(frame) = self.poll_all_but_sdo(now, od)
        {
            return Some(frame);
        }
        if self.nmt.state().allows_messages() { self.poll_sdo(now, od) } else { None }
    }

    /// Where there is nothing to send, it is quiet from then on.
    #[inline(never)]
    fn poll_all_but_sdo(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        self.end_communication_error(od);
        if let Some(boot_up) = self.nmt.poll_transmit(now) {
            self.start = self.starts_itself.then_some(now);
            return Some(boot_up);
        }
        let state = self.nmt.state();
        let message = if state.allows_messages() { self.poll_messages(now, od) } else { None };
        let frame = message
            .or_else(|| self.heartbeat.poll_transmit(now, state))
            .or_else(|| self.guarding.poll_transmit(now, state));
        if frame.is_none() {
            self.quiet = Some(Quiet { until: self.deadline() });
        }
        frame
    }

    fn poll_messages(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        if let Some((sync, frame)) = self.sync_producer.poll_transmit(now) {
            self.sync_consumer.open_window(now);
            self.own_sync = Some((now, sync));
            return Some(frame);
        }
        if let Some(frame) = self.emcy.poll_transmit(now) {
            return Some(frame);
        }
        if let Some((id, time)) = self.time_producer.zip(self.time.take()) {
            return Some(time::frame(id, time));
        }
        // Outside OPERATIONAL no TPDO is due: they are suspended.
        self.tpdos.iter_mut().find_map(|slot| slot.pdo.poll_transmit(now, od))
    }

    // Always inlined, like all that it calls: so the frame is put together where the caller wants it.
    #[inline(always)]
    fn poll_sdo(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        if self.servers_changed {
            return self.poll_changed_servers(now, od);
        }
        for at in 0..SERVERS {
            let Some(Some(server)) = self.servers.get_mut(at) else { continue };
            if !server.has_answer() && is_guarded(server) {
                if let Some(frame) = self.poll_guarded(at, now, od) {
                    return Some(frame);
                }
            } else if let Some(frame) = server.poll_transmit(now, od) {
                return Some(frame);
            }
        }
        None
    }

    #[inline(never)]
    fn poll_guarded(&mut self, at: usize, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        let (server, mut checked) = self.guarded(at, od)?;
        server.poll_transmit(now, &mut checked)
    }

    #[cold]
    fn poll_changed_servers(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        let frame = (0..SERVERS).find_map(|at| self.poll_guarded(at, now, od));
        self.follow_servers(od);
        frame
    }

    /// When to call [`Device::handle_timeout`]; `None` to sleep until a frame comes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.nmt.state() == NmtState::Initialising {
            return None;
        }
        let others = self.quiet.map_or_else(|| self.deadline(), |quiet| quiet.until);
        self.servers.iter().flatten().filter_map(SdoServer::poll_timeout).chain(others).min()
    }

    /// When anything but SDO is due.
    fn deadline(&self) -> Option<Instant> {
        let own = [
            self.heartbeat.poll_timeout(),
            self.sync_producer.poll_timeout(),
            self.sync_consumer.poll_timeout(),
            self.own_sync.map(|(sent, _)| sent),
            self.emcy.poll_timeout(),
            self.guarding.poll_timeout(),
            self.reaction,
            self.start,
        ];
        let consumers = self.consumers.iter().flatten().filter_map(HeartbeatConsumer::poll_timeout);
        let rpdos = self.rpdos.iter().filter_map(|slot| slot.pdo.poll_timeout());
        let tpdos = self.tpdos.iter().filter_map(|slot| slot.pdo.poll_timeout());
        own.into_iter().flatten().chain(consumers).chain(rpdos).chain(tpdos).min()
    }
}

/// Whether the entry that a server transfers is one that [`Checked`](super::checked::Checked) looks at.
pub(super) fn is_guarded(server: &SdoServer) -> bool {
    server.transfers().is_some_and(|address| address.index() >> 12 == 1)
}
