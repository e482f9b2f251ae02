//! A PDO that the device transmits (CiA 301, 7.2.2; 1800h and 1A00h).
//!
//! ```text
//! 0          an event, then the next SYNC    sampled at that SYNC
//! 1 to 240   every n-th SYNC                 sampled at that SYNC
//! 252        a remote frame                  sampled at the last SYNC
//! 253        a remote frame                  sampled when sent
//! 254, 255   an event, or the event timer    sampled when sent, not within the inhibit time
//! ```

use super::mapping::Mapping;
use crate::frame::Frame;
use crate::id::CobId;
use crate::object::{Address, ObjectDictionary};
use crate::time::{self, Duration, Instant, sooner};
use crate::wire::pdo::{PdoCobId, TransmissionType};

/// The communication parameter of a TPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// 1800h:01.
    pub cob_id: PdoCobId,
    /// 1800h:02.
    pub transmission: TransmissionType,
    /// 1800h:03: the shortest time between two PDOs; zero for none.
    pub inhibit: Duration,
    /// 1800h:05: the longest time between two PDOs; zero for none.
    pub event_timer: Duration,
    /// 1800h:06: the SYNC counter with which counting begins; 0 for the first SYNC that comes.
    pub sync_start: u8,
}

impl Parameters {
    /// The parameters of a disabled PDO.
    pub const OFF: Parameters = Parameters {
        cob_id: PdoCobId::OFF,
        transmission: TransmissionType::EventProfile,
        inhibit: Duration::ZERO,
        event_timer: Duration::ZERO,
        sync_start: 0,
    };
}

/// What makes a device send a TPDO of an event-driven type, 254 or 255: CiA 301 leaves it to the
/// manufacturer and to the profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Triggers {
    /// Entering OPERATIONAL.
    pub start: bool,
    /// A change of a mapped object.
    pub change: bool,
    /// The event timer.
    pub timer: bool,
    /// The inhibit time holds.
    pub inhibit: bool,
}

impl Triggers {
    /// All of them.
    pub const ALL: Triggers = Triggers { start: true, change: true, timer: true, inhibit: true };
    /// None: for the types that are not event-driven.
    pub const NONE: Triggers = Triggers { start: false, change: false, timer: false, inhibit: false };
}

/// Transmits one PDO.
#[derive(Clone, Copy, Debug)]
pub struct Tpdo<const N: usize = 64> {
    parameters: Parameters,
    mapping: Mapping<N>,
    triggers: Triggers,
    acyclic_always: bool,
    /// An event happened that SYNC or `poll_transmit` has not seen yet.
    changed: bool,
    /// The PDO is to be sent: with the data that were sampled, or with those at the time of sending.
    is_pending: bool,
    /// The data of the SYNC that made the PDO pending, or of the last one for type 252.
    sampled: Option<[u8; 8]>,
    /// The data sent last; before the first PDO, those at the start. Of type 252, those that were asked for last.
    sent: Option<[u8; 8]>,
    /// SYNCs since the last n-th one; `None` until the SYNC start value has come.
    syncs: Option<u8>,
    inhibited: Option<Instant>,
    event: Option<Instant>,
}

impl<const N: usize> Tpdo<N> {
    /// Transmits `mapping` under `parameters`, at what `triggers` counts as events.
    #[must_use]
    pub const fn new(parameters: Parameters, mapping: Mapping<N>, triggers: Triggers) -> Self {
        Tpdo {
            parameters,
            mapping,
            triggers,
            acyclic_always: false,
            changed: false,
            is_pending: false,
            sampled: None,
            sent: None,
            syncs: None,
            inhibited: None,
            event: None,
        }
    }

    /// Whether type 0 is sent at every SYNC, whether there was an event or not.
    pub const fn set_acyclic_always(&mut self, acyclic_always: bool) {
        self.acyclic_always = acyclic_always;
    }

    /// The communication parameter.
    #[must_use]
    pub const fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The mapping.
    #[must_use]
    pub const fn mapping(&self) -> &Mapping<N> {
        &self.mapping
    }

    /// Whether the PDO exists: valid, and something is mapped.
    #[must_use]
    pub const fn is_active(&self) -> bool {
        self.parameters.cob_id.is_valid() && !self.mapping.is_empty()
    }

    /// The device entered OPERATIONAL, or this PDO was switched on in it.
    pub fn start(&mut self, now: Instant) {
        self.suspend();
        if !self.is_active() {
            return;
        }
        self.syncs = if self.parameters.sync_start == 0 { Some(0) } else { None };
        self.start_event_timer(now);
        if self.triggers.start && self.parameters.transmission.is_event_driven() {
            self.is_pending = true;
        }
        self.changed = self.parameters.transmission == TransmissionType::SynchronousAcyclic;
    }

    /// The parameters of a PDO changed, which was `before`: the event timer starts anew, and what
    /// waits to be sent goes on waiting.
    pub fn resume(&mut self, now: Instant, before: &Self) {
        self.start(now);
        if !self.is_active() {
            return;
        }
        self.is_pending = false;
        self.changed = false;
        // Data of another mapping are neither sent nor compared with.
        let is_same = self.mapping == before.mapping;
        self.sent = before.sent.filter(|_| is_same);
        self.inhibited = before.inhibited;
        if self.parameters.transmission == before.parameters.transmission {
            (self.is_pending, self.changed) = (before.is_pending, before.changed);
            (self.sampled, self.syncs) = (before.sampled.filter(|_| is_same), before.syncs);
        } else if before.is_pending || before.changed {
            self.request();
        }
    }

    /// The device left OPERATIONAL.
    pub const fn suspend(&mut self) {
        self.changed = false;
        self.is_pending = false;
        (self.sampled, self.sent) = (None, None);
        self.syncs = None;
        (self.inhibited, self.event) = (None, None);
    }

    /// Asks for the PDO to be sent, as an event of the application. Does nothing if the PDO does not exist.
    pub fn request(&mut self) {
        if !self.is_active() {
            return;
        }
        match self.parameters.transmission {
            TransmissionType::SynchronousAcyclic => self.changed = true,
            _ if self.parameters.transmission.is_event_driven() => self.is_pending = true,
            _ => {}
        }
    }

    /// An object changed. It is an event when the PDO maps it and changes count as events.
    pub fn changed(&mut self, address: Address) {
        if self.counts_changes() && self.mapping.maps(address) {
            self.request();
        }
    }

    /// Asks for the PDO to be sent if its data differ from those sampled to be sent, else from those sent last; before the
    /// first one, from those at the start. For dictionaries that cannot report changes by [`Tpdo::changed`].
    pub fn compare(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.compare_masked(u64::MAX, od);
    }

    /// The same for the bits of its data that are set in `mask`, whose lowest bit is that of the first byte.
    pub fn compare_masked(&mut self, mask: u64, od: &mut (impl ObjectDictionary + ?Sized)) {
        let known = self.sampled.filter(|_| self.is_pending).or(self.sent);
        let mut differs = |known| (u64::from_le_bytes(known) ^ u64::from_le_bytes(self.mapping.pack(od))) & mask != 0;
        if self.counts_changes() && self.is_active() && known.is_some_and(&mut differs) {
            self.request();
        }
    }

    /// Whether a change of a mapped object is an event.
    pub(crate) fn counts_changes(&self) -> bool {
        self.triggers.change || self.parameters.transmission == TransmissionType::SynchronousAcyclic
    }

    /// Whether the PDO exists and has this COB-ID.
    #[must_use]
    pub fn listens_to(&self, id: CobId) -> bool {
        self.is_active() && self.parameters.cob_id.id() == id
    }

    /// Takes a remote frame that asks for the PDO.
    pub fn handle_frame(&mut self, _now: Instant, frame: &Frame) {
        let asked = frame.is_remote() && self.listens_to(frame.id());
        if !asked || !self.parameters.cob_id.allows_remote() {
            return;
        }
        match self.parameters.transmission {
            // Before the first SYNC there are no data.
            TransmissionType::SynchronousRemote => {
                self.sent = self.sampled;
                self.is_pending = self.sent.is_some();
            }
            TransmissionType::Reserved(_) => {}
            _ => self.is_pending = true,
        }
    }

    /// SYNC came, with this counter. Returns whether the PDO is to be sent, with the data that it has now.
    pub fn handle_sync(&mut self, counter: Option<u8>, od: &mut (impl ObjectDictionary + ?Sized)) -> bool {
        if !self.is_active() {
            return false;
        }
        let is_due = match self.parameters.transmission {
            TransmissionType::SynchronousAcyclic => core::mem::take(&mut self.changed) || self.acyclic_always,
            TransmissionType::SynchronousCyclic(n) => self.counts(counter, n),
            TransmissionType::SynchronousRemote => {
                self.sampled = Some(self.mapping.pack(od));
                false
            }
            _ => false,
        };
        if is_due {
            self.sampled = Some(self.mapping.pack(od));
            self.is_pending = true;
        }
        is_due
    }

    /// Counts a SYNC, and returns whether it is the n-th. The one with the start value is an n-th.
    fn counts(&mut self, counter: Option<u8>, n: u8) -> bool {
        let count = match self.syncs {
            Some(count) => count + 1,
            None if counter.is_none_or(|counter| counter == self.parameters.sync_start) => n,
            None => return false,
        };
        let due = count >= n;
        self.syncs = Some(if due { 0 } else { count });
        due
    }

    /// The SYNC window closed: a synchronous PDO that was not sent is dropped. Of type 0, its event waits for the
    /// next SYNC.
    pub fn close_window(&mut self) {
        if self.parameters.transmission.is_synchronous() {
            let dropped = core::mem::take(&mut self.is_pending);
            self.sampled = None;
            self.changed |= dropped && self.parameters.transmission == TransmissionType::SynchronousAcyclic;
        }
    }

    /// The event timer or the inhibit time has passed.
    pub fn handle_timeout(&mut self, now: Instant) {
        time::expire(&mut self.inhibited, now);
        if time::expire(&mut self.event, now) {
            self.is_pending = true;
            self.start_event_timer(now);
        }
    }

    fn start_event_timer(&mut self, now: Instant) {
        let runs = self.parameters.transmission.is_event_driven() && self.triggers.timer;
        self.event = if runs { time::after(now, self.parameters.event_timer) } else { None };
    }

    /// Whether `poll_transmit` has something to send.
    #[must_use]
    pub fn is_due(&self, now: Instant) -> bool {
        self.is_pending && self.inhibited.is_none_or(|end| end <= now)
    }

    /// The PDO, when it is due and not inhibited.
    // Inlined where speed counts: after a SYNC, most of those that are asked have nothing to send.
    #[inline]
    pub fn poll_transmit(&mut self, now: Instant, od: &mut (impl ObjectDictionary + ?Sized)) -> Option<Frame> {
        if self.sent.is_none() && self.counts_changes() && self.is_active() {
            self.sent = Some(self.mapping.pack(od));
        }
        if !self.is_due(now) {
            return None;
        }
        self.is_pending = false;
        let is_asked = self.parameters.transmission == TransmissionType::SynchronousRemote;
        let data = if is_asked { self.sent } else { self.sampled.take() };
        let data = data.unwrap_or_else(|| self.mapping.pack(od));
        self.sent = Some(data);
        if self.parameters.transmission.is_event_driven() {
            self.start_event_timer(now);
            if self.triggers.inhibit {
                self.inhibited = time::after(now, self.parameters.inhibit);
            }
        }
        Frame::of_buffer(self.parameters.cob_id.id(), data, self.mapping.bytes())
    }

    /// When the event timer or the inhibit time passes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let inhibited = self.inhibited.filter(|_| self.is_pending);
        sooner(inhibited, self.event)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Mapped;
    use crate::testing::TestOd;
    use std::string::String;
    use std::vec::Vec;

    fn tpdo(transmission: u8, triggers: Triggers) -> Tpdo {
        let mut mapping: Mapping = Mapping::EMPTY;
        assert!(mapping.push(Mapped::new(0x2000, 0, 8)));
        let parameters = Parameters {
            cob_id: PdoCobId(0x185),
            transmission: TransmissionType::from_code(transmission),
            inhibit: Duration::from_millis(10),
            event_timer: Duration::from_millis(25),
            sync_start: 0,
        };
        let mut pdo = Tpdo::new(parameters, mapping, triggers);
        pdo.start(Instant::ZERO);
        pdo
    }

    /// What is sent from 0 to 60 ms, when the object changes at 3 and 5 ms.
    fn run(mut pdo: Tpdo) -> Vec<String> {
        let mut od = TestOd::new("2000:00 u8 ro tpdo 7");
        let mut sent = Vec::new();
        for ms in 0..=60 {
            let now = Instant::ZERO + Duration::from_millis(ms);
            if matches!(ms, 3 | 5) {
                od.set(0x2000, 0, ms);
                pdo.changed(Address::new(0x2000, 0));
            }
            if pdo.poll_timeout().is_some_and(|due| due <= now) {
                pdo.handle_timeout(now);
            }
            sent.extend(pdo.poll_transmit(now, &mut od).map(|frame| std::format!("{ms} {frame}")));
        }
        sent
    }

    #[test]
    fn triggers_say_what_is_an_event() {
        let all = Triggers::ALL;
        assert_eq!(run(tpdo(254, all)), ["0 185#07", "10 185#05", "35 185#05", "60 185#05"]);
        let without_start = Triggers { start: false, ..all };
        assert_eq!(run(tpdo(254, without_start)), ["3 185#03", "13 185#05", "38 185#05"]);
        let timer_only = Triggers { timer: true, ..Triggers::NONE };
        assert_eq!(run(tpdo(255, timer_only)), ["25 185#05", "50 185#05"]);
        let not_inhibited = Triggers { inhibit: false, timer: false, ..all };
        assert_eq!(run(tpdo(254, not_inhibited)), ["0 185#07", "3 185#03", "5 185#05"]);
        assert_eq!(run(tpdo(253, Triggers::NONE)), [""; 0]);
    }

    #[test]
    fn data_of_another_mapping_are_not_sent() {
        let mut od = TestOd::new("2000:00 u8 ro tpdo 7\n2001:00 u16 ro tpdo 8");
        let mut before = tpdo(1, Triggers::NONE);
        assert!(before.mapping.push(Mapped::new(0x2001, 0, 16)));
        assert!(before.handle_sync(None, &mut od));
        let mut pdo = tpdo(1, Triggers::NONE);
        pdo.resume(Instant::ZERO, &before);
        let sent = pdo.poll_transmit(Instant::ZERO, &mut od).map(|frame| std::format!("{frame}"));
        assert_eq!(sent.as_deref(), Some("185#07"));
    }

    #[test]
    fn nothing_is_left_to_wait_for_when_suspended() {
        let mut pdo = tpdo(254, Triggers::ALL);
        pdo.suspend();
        assert_eq!((pdo.poll_timeout(), pdo.is_due(Instant::ZERO)), (None, false));
    }
}
