//! The SDO servers of a device: they serve the dictionary as [`Checked`](super::checked::Checked) lets clients write
//! it, and what they have written takes effect. So does what local control writes.

use super::event::Event;
use super::{Device, Selection, identifiers};
use crate::abort::AbortCode;
use crate::cia301;
use crate::frame::Frame;
use crate::id::CobId;
use crate::object::{Address, ObjectDictionary};
use crate::service::sdo_server::{self, SdoServer, default_channel};
use crate::time::Instant;

impl<
    const RPDOS: usize,
    const TPDOS: usize,
    const SERVERS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Device<RPDOS, TPDOS, SERVERS, MONITORED, MAPPED, S>
{
    /// The place of the server that has requests of this identifier.
    pub(super) fn server_of(&self, id: CobId) -> Option<usize> {
        let services = self.services.get();
        // If a data sheet gives SYNC or TIME the COB-ID of an SDO server, the frame is taken as SYNC or TIME.
        let is_message = services.sync_consumer.id() == Some(id) || services.time_id() == Some(id);
        if is_message || !services.nmt.state().allows_messages() {
            return None;
        }
        self.servers.iter().position(|server| server.as_ref().is_some_and(|server| server.request_id() == id))
    }

    /// A request to the server in place `at`.
    pub(super) fn handle_request(
        &mut self,
        at: usize,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Event> {
        let server = self.servers.get_mut(at)?.as_mut()?;
        let event = server.handle_frame(now, frame, &mut self.services.get().checked(od, SERVERS))?;
        self.follow_sdo(now, event, od)
    }

    /// What a server did to an entry.
    fn follow_sdo(
        &mut self,
        now: Instant,
        event: sdo_server::Event,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Event> {
        let event = reported(event)?;
        if let Event::Written(address) = event {
            self.take_up(now, address, od);
        }
        Some(event)
    }

    /// Writes an entry by local control, whatever its access. Communication objects are checked as if a client wrote them,
    /// and what they configure takes effect at once; the dictionary is lent as for a frame.
    ///
    /// Errors: the abort code that a client would get; nothing has changed.
    pub fn write(
        &mut self,
        now: Instant,
        address: Address,
        data: &[u8],
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), AbortCode> {
        let entry = od.entry(address)?;
        self.services.get().checked(od, SERVERS).write(&entry, 0, data, true)?;
        self.take_up(now, address, od);
        Ok(())
    }

    /// What was written takes effect.
    fn take_up(&mut self, now: Instant, address: Address, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.reconfigure(now, address, od);
        self.changed(address);
        self.end_communication_error(od);
    }

    /// Configures what a written entry concerns.
    fn reconfigure(&mut self, now: Instant, address: Address, od: &mut (impl ObjectDictionary + ?Sized)) {
        if !cia301::COMMUNICATION.contains(&address.index()) {
            return;
        }
        // The answer to this very write leaves under the identifiers that the request came to.
        self.servers_changed |= (cia301::SDO_SERVER_1..=cia301::SDO_SERVER_128).contains(&address.index());
        self.services.get_mut().reconfigure(now, address, od);
        self.listen();
    }

    /// A device that has stopped forgets its transfers.
    // Out of line on a microcontroller: it is the last thing that three functions do.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    pub(super) fn follow_state(&mut self, event: Option<Event>) -> Option<Event> {
        if !self.nmt_state().allows_messages() {
            self.servers.iter_mut().flatten().for_each(SdoServer::reset);
        }
        event
    }

    pub(super) fn handle_server_timeout(&mut self, now: Instant) -> Option<Event> {
        let event = self.servers.iter_mut().flatten().find_map(|server| server.handle_timeout(now))?;
        reported(event)
    }

    pub(super) fn poll_servers(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        if !self.nmt_state().allows_messages() {
            return None;
        }
        let mut checked = self.services.get().checked(od, SERVERS);
        let frame = self.servers.iter_mut().flatten().find_map(|server| server.poll_transmit(now, &mut checked));
        if self.servers_changed && !self.servers.iter().flatten().any(SdoServer::has_answer) {
            self.load_servers(od);
            self.listen();
        }
        frame
    }

    /// The default server, and those of 1201h and up that are valid, as long as there is room. A server
    /// whose parameters have not changed goes on with its transfer.
    pub(super) fn load_servers(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.servers_changed = false;
        // The identifiers of the default server are fixed, also if 1200h has others (CiA 301, 7.5.2.33).
        let (request, response) = default_channel(self.node());
        let sizes_indicated = self.behaviour().sdo_sizes_indicated;
        let new = |(request, response)| SdoServer::of_channel(request, response).with_sizes_indicated(sizes_indicated);
        // One server is the default one, whatever 1201h and up say; firmware with one has no code for more.
        if let [server] = self.servers.as_mut_slice() {
            server.get_or_insert(new((request, response)));
            return;
        }
        let old = core::mem::replace(&mut self.servers, [const { None }; SERVERS]);
        let others = (cia301::SDO_SERVER_2..=cia301::SDO_SERVER_128).filter_map(|index| identifiers::sdo(index, od));
        let channels = core::iter::once((request, response)).chain(others);
        for (place, channel) in self.servers.iter_mut().zip(channels) {
            let same = |old: &&SdoServer<S::Blocks>| (old.request_id(), old.response_id()) == channel;
            *place = Some(old.iter().flatten().find(same).cloned().unwrap_or(new(channel)));
        }
    }
}

const fn reported(event: sdo_server::Event) -> Option<Event> {
    match event {
        sdo_server::Event::Read(_) => None,
        sdo_server::Event::Written(address) => Some(Event::Written(address)),
        sdo_server::Event::Aborted { address, code, .. } => Some(Event::SdoAborted { address, reason: code }),
    }
}
