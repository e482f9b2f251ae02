//! PDOs mapped by a shell: received data are decoded by the mapping in force.

use crate::frame::Frame;
use crate::id::CobId;
use crate::manager::Event;
use crate::object::{AnyDevice, MappedLengthMismatch, Mapping, Rpdo, Tpdo, Values};
use crate::wire::pdo::TransmissionType;

/// When a PDO is sent or takes effect, and under which COB-ID.
#[derive(Clone, Copy, Debug)]
pub struct PdoOptions {
    pub(super) transmission: TransmissionType,
    pub(super) inhibit_100us: Option<u16>,
    pub(super) event_timer_ms: Option<u16>,
    pub(super) cob_id: Option<CobId>,
}

impl PdoOptions {
    /// With COB-ID and times unchanged. A PDO without a COB-ID gets that of the predefined connection set.
    #[must_use]
    pub const fn new(transmission: TransmissionType) -> Self {
        PdoOptions { transmission, inhibit_100us: None, event_timer_ms: None, cob_id: None }
    }

    /// With an inhibit time, the shortest time between two PDOs, in 100 us.
    #[must_use]
    pub const fn inhibit_100us(self, inhibit: u16) -> Self {
        PdoOptions { inhibit_100us: Some(inhibit), ..self }
    }

    /// With an event timer in ms: a PDO is sent when this time has passed since the last one. 0 disables it.
    #[must_use]
    pub const fn event_timer_ms(self, timer: u16) -> Self {
        PdoOptions { event_timer_ms: Some(timer), ..self }
    }

    /// Under this COB-ID.
    #[must_use]
    pub const fn cob_id(self, id: CobId) -> Self {
        PdoOptions { cob_id: Some(id), ..self }
    }
}

/// A PDO of a node, with the mapping that the node has accepted.
#[derive(Clone, Copy, Debug)]
pub struct MappedPdo<D, V: Values, N = AnyDevice> {
    id: CobId,
    mapping: Mapping<D, V, N>,
}

impl<D, V: Values, N> MappedPdo<D, V, N> {
    pub(super) const fn new(id: CobId, mapping: Mapping<D, V, N>) -> Self {
        MappedPdo { id, mapping }
    }

    /// The COB-ID: for [`Network::listen_to_own`](super::blocking::Network::listen_to_own), for example.
    #[must_use]
    pub const fn id(&self) -> CobId {
        self.id
    }
}

impl<V: Values, N> MappedPdo<Tpdo, V, N> {
    /// The values, if the event is this PDO.
    ///
    /// An error means that the frame has fewer bytes than the mapping.
    #[must_use]
    pub fn decode(&self, event: &Event) -> Option<Result<V, MappedLengthMismatch>> {
        match event {
            Event::Pdo { frame, .. } if frame.id() == self.id => Some(self.mapping.values(frame.data())),
            _ => None,
        }
    }
}

impl<V: Values, N> MappedPdo<Rpdo, V, N> {
    /// The frame that carries the values.
    #[must_use]
    pub fn frame(&self, values: V) -> Frame {
        self.mapping.frame(self.id, values)
    }
}
