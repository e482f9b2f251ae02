//! A PDO that the device receives (CiA 301, 7.2.2; 1400h and 1600h).

use super::mapping::Mapping;
use crate::abort::AbortCode;
use crate::frame::Frame;
use crate::id::CobId;
use crate::object::{Address, ObjectDictionary, number};
use crate::time::{self, Duration, Instant};
use crate::wire::pdo::{PdoCobId, TransmissionType};

/// The communication parameter of an RPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// 1400h:01.
    pub cob_id: PdoCobId,
    /// 1400h:02.
    pub transmission: TransmissionType,
    /// 1400h:05: how long the next PDO may take; zero for any time.
    pub deadline: Duration,
}

impl Parameters {
    /// The parameters of a disabled PDO.
    pub const OFF: Parameters =
        Parameters { cob_id: PdoCobId::OFF, transmission: TransmissionType::EventProfile, deadline: Duration::ZERO };
}

/// The result of a PDO or of its deadline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Event {
    /// Its objects are in the dictionary now.
    Received,
    /// The same, but the dictionary refused at least one object: this was the first.
    Refused { address: Address, reason: AbortCode },
    /// It waits for SYNC.
    Waiting,
    /// It is shorter than the mapping, and was ignored.
    TooShort {
        /// The length of the mapping in bytes.
        expected: usize,
        got: usize,
    },
    /// The next PDO did not come within its deadline.
    TimedOut,
}

/// How the last PDO's length was wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LengthError {
    /// Too short: not processed (EMCY 8210h).
    // From 1 on, so that no error is 0 (a device clears the places of its PDOs).
    TooShort = 1,
    /// Too long: the first bytes were processed (EMCY 8220h).
    TooLong,
}

/// Receives one PDO.
#[derive(Clone, Copy, Debug)]
pub struct Rpdo<const N: usize = 64> {
    parameters: Parameters,
    mapping: Mapping<N>,
    /// A synchronous PDO that waits for SYNC.
    waiting: Option<[u8; 8]>,
    /// Whether the last SYNC did something, and what the dictionary refused then.
    is_applied: bool,
    refused: Option<(Address, AbortCode)>,
    length_error: Option<LengthError>,
    due: Option<Instant>,
    timed_out: bool,
    /// SYNCs since the last n-th one.
    syncs: u8,
}

impl<const N: usize> Rpdo<N> {
    /// Receives `mapping` under `parameters`.
    #[must_use]
    pub const fn new(parameters: Parameters, mapping: Mapping<N>) -> Self {
        Rpdo {
            parameters,
            mapping,
            waiting: None,
            is_applied: false,
            refused: None,
            length_error: None,
            due: None,
            timed_out: false,
            syncs: 0,
        }
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

    /// Whether the PDO exists and has this COB-ID.
    #[must_use]
    pub fn listens_to(&self, id: CobId) -> bool {
        self.is_active() && self.parameters.cob_id.id() == id
    }

    /// How the last PDO's length was wrong.
    #[must_use]
    pub const fn length_error(&self) -> Option<LengthError> {
        self.length_error
    }

    /// Whether the deadline has passed, and no PDO came since.
    #[must_use]
    pub const fn has_timed_out(&self) -> bool {
        self.timed_out
    }

    /// The result of the last SYNC: [`Event::Received`] or [`Event::Refused`]; `None` if no PDO
    /// waited for it.
    #[must_use]
    pub fn applied(&self) -> Option<Event> {
        self.is_applied.then(|| event(self.refused))
    }

    /// The parameters of a PDO changed, which was `before`. What was received under the same identifier and mapping
    /// stays valid; the deadline starts with the next PDO.
    pub fn resume(&mut self, before: &Self) {
        let same = self.parameters.cob_id == before.parameters.cob_id && self.mapping == before.mapping;
        if same && before.is_active() {
            self.waiting = before.waiting.filter(|_| self.parameters.transmission.is_synchronous());
            (self.is_applied, self.refused) = (before.is_applied, before.refused);
            self.syncs = before.syncs;
            self.length_error = before.length_error;
        }
    }

    /// The device left OPERATIONAL: what waits is forgotten, and the deadline starts with the next PDO.
    pub const fn suspend(&mut self) {
        self.waiting = None;
        self.is_applied = false;
        self.due = None;
        self.timed_out = false;
        self.syncs = 0;
    }

    /// Takes the PDO: writes its objects, or keeps them for SYNC.
    pub fn handle_frame(
        &mut self,
        now: Instant,
        frame: &Frame,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Event> {
        if frame.is_remote() || !self.listens_to(frame.id()) {
            return None;
        }
        Some(self.take(now, frame, od))
    }

    /// The same of a frame that is known to be this PDO.
    pub(crate) fn take(&mut self, now: Instant, frame: &Frame, od: &mut (impl ObjectDictionary + ?Sized)) -> Event {
        let (expected, got) = (self.mapping.bytes(), frame.data().len());
        let Some(data) = frame.data().get(..expected) else {
            self.length_error = Some(LengthError::TooShort);
            return Event::TooShort { expected, got };
        };
        self.length_error = (got > expected).then_some(LengthError::TooLong);
        self.timed_out = false;
        self.due = time::after(now, self.parameters.deadline);
        if self.parameters.transmission.is_synchronous() {
            self.waiting = Some(number(data).to_le_bytes());
            return Event::Waiting;
        }
        event(self.mapping.unpack(data, od).err())
    }

    /// SYNC came: what waited takes effect.
    #[inline]
    pub fn handle_sync(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        let waiting = self.waiting.take();
        self.is_applied = waiting.is_some();
        if let Some(data) = waiting {
            self.refused = self.mapping.unpack(&data, od).err();
        }
    }

    /// The same for a device whose PDOs of type n, from 1 to 240, ignore n-1 SYNCs before one counts.
    pub fn handle_nth_sync(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.syncs += 1;
        match self.parameters.transmission {
            TransmissionType::SynchronousCyclic(n) if self.syncs < n => self.is_applied = false,
            _ => {
                self.syncs = 0;
                self.handle_sync(od);
            }
        }
    }

    /// The deadline has passed.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        if !time::expire(&mut self.due, now) {
            return None;
        }
        self.timed_out = true;
        Some(Event::TimedOut)
    }

    /// When the deadline passes.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        self.due
    }
}

/// What became of a PDO, of whose objects the dictionary refused this one.
fn event(refused: Option<(Address, AbortCode)>) -> Event {
    refused.map_or(Event::Received, |(address, reason)| Event::Refused { address, reason })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Mapped;
    use crate::testing::TestOd;

    fn rpdo(transmission: u8) -> Rpdo {
        let mut mapping: Mapping = Mapping::EMPTY;
        assert!(mapping.push(Mapped::new(0x2000, 0, 16)));
        let cob_id = PdoCobId(0x205);
        let transmission = TransmissionType::from_code(transmission);
        Rpdo::new(Parameters { cob_id, transmission, deadline: Duration::from_millis(10) }, mapping)
    }

    fn feed(pdo: &mut Rpdo, ms: u64, data: &[u8], od: &mut TestOd) -> Option<Event> {
        let id = CobId::standard(0x205).unwrap();
        pdo.handle_frame(Instant::ZERO + Duration::from_millis(ms), &Frame::new(id, data).unwrap(), od)
    }

    #[test]
    fn length_and_deadline_are_watched() {
        let mut od = TestOd::new("2000:00 u16 rw rpdo 0");
        let mut pdo = rpdo(255);
        assert_eq!(pdo.poll_timeout(), None);
        assert_eq!(feed(&mut pdo, 0, &[1], &mut od), Some(Event::TooShort { expected: 2, got: 1 }));
        assert_eq!((pdo.length_error(), pdo.poll_timeout()), (Some(LengthError::TooShort), None));
        assert_eq!(feed(&mut pdo, 0, &[1, 2, 3], &mut od), Some(Event::Received));
        assert_eq!((pdo.length_error(), od.get(0x2000, 0)), (Some(LengthError::TooLong), 0x0201));
        let due = pdo.poll_timeout().unwrap();
        assert_eq!((pdo.handle_timeout(due), pdo.has_timed_out()), (Some(Event::TimedOut), true));
        assert_eq!(feed(&mut pdo, 20, &[1, 2], &mut od), Some(Event::Received));
        assert_eq!((pdo.has_timed_out(), pdo.length_error()), (false, None));
    }

    #[test]
    fn every_nth_sync_is_counted_where_the_device_counts_them() {
        let mut od = TestOd::new("2000:00 u16 rw rpdo 0");
        for (transmission, taken) in [(0, [1, 2, 3, 4]), (1, [1, 2, 3, 4]), (3, [0, 0, 3, 3])] {
            let mut pdo = rpdo(transmission);
            od.set(0x2000, 0, 0);
            let seen = [1, 2, 3, 4].map(|sync| {
                feed(&mut pdo, 0, &[sync, 0], &mut od);
                pdo.handle_nth_sync(&mut od);
                let value = od.get(0x2000, 0);
                assert_eq!(pdo.applied().is_some(), value == u64::from(sync));
                value
            });
            assert_eq!(seen, taken, "type {transmission}");
        }
    }

    #[test]
    fn remote_frames_and_a_pdo_that_is_switched_off_are_ignored() {
        let mut od = TestOd::new("2000:00 u16 rw rpdo 0");
        let mut pdo = rpdo(255);
        let remote = Frame::remote(CobId::standard(0x205).unwrap(), 2).unwrap();
        assert_eq!(pdo.handle_frame(Instant::ZERO, &remote, &mut od), None);
        pdo.parameters.cob_id = pdo.parameters.cob_id.switched_off();
        assert_eq!(feed(&mut pdo, 0, &[1, 2], &mut od), None);
    }
}
