//! Reporting errors (CiA 301, 7.2.7; 1001h, 1003h, 1014h, 1015h).

use super::objects;
use crate::cia301;
use crate::frame::Frame;
use crate::id::CobId;
use crate::object::{Address, ObjectDictionary};
use crate::time::{self, Duration, Instant};
use crate::wire::emcy::{CodeOrder, Emergency, ErrorCode, ErrorRegister};

/// Sends emergencies, and keeps error register and history in the dictionary.
#[derive(Clone, Copy, Debug)]
pub struct EmcyProducer {
    id: Option<CobId>,
    order: CodeOrder,
    inhibit: Duration,
    inhibited: Option<Instant>,
    register: ErrorRegister,
    /// What is still to be sent: `len` of them, in a ring that begins at `first`.
    pending: [Emergency; EmcyProducer::PENDING],
    first: u8,
    len: u8,
    replaced: u16,
}

impl EmcyProducer {
    /// How many emergencies wait while the inhibit time holds; when there are more, the newest replaces
    /// the one before it, which is [counted](EmcyProducer::replaced). The history has them all.
    pub const PENDING: usize = 8;

    /// Sends nothing, until it has a COB-ID.
    #[must_use]
    pub const fn new() -> Self {
        EmcyProducer {
            id: None,
            order: CodeOrder::LowByteFirst,
            inhibit: Duration::ZERO,
            inhibited: None,
            register: ErrorRegister::NONE,
            pending: [NOTHING; EmcyProducer::PENDING],
            first: 0,
            len: 0,
            replaced: 0,
        }
    }

    /// Sends as `id`, `None` for not at all, with at least `inhibit` between two emergencies, and the bytes of the
    /// error code in this order.
    pub const fn configure(&mut self, id: Option<CobId>, inhibit: Duration, order: CodeOrder) {
        self.order = order;
        self.id = id;
        self.inhibit = inhibit;
    }

    /// The error register.
    #[must_use]
    pub const fn register(&self) -> ErrorRegister {
        self.register
    }

    /// An error occurred. The error register (1001h) is `register` from now on; with `record` the code
    /// is put into the history (1003h).
    pub fn raise(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        record: bool,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) {
        self.set_register(register, od);
        if record {
            // Behind the code, the history has 16 bits of additional information.
            let [low, high, ..] = vendor;
            push_history(u32::from(code.0) | u32::from(u16::from_le_bytes([low, high])) << 16, od);
        }
        self.push(Emergency { code, register, vendor });
    }

    /// An error is over, and `register` shows those that are left. The message has the code 0000h.
    pub fn clear(&mut self, register: ErrorRegister, vendor: [u8; 5], od: &mut (impl ObjectDictionary + ?Sized)) {
        self.set_register(register, od);
        self.push(Emergency { code: ErrorCode::NO_ERROR, register, vendor });
    }

    /// Changes the error register (1001h) without a message.
    pub fn set_register(&mut self, register: ErrorRegister, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.register = register;
        objects::write(od, cia301::ERROR_REGISTER, 0, u32::from(register.0));
    }

    /// How many emergencies were not sent because newer ones have taken their place; 65535 stands for more.
    #[must_use]
    pub const fn replaced(&self) -> u16 {
        self.replaced
    }

    fn push(&mut self, emergency: Emergency) {
        self.replaced = self.replaced.saturating_add(u16::from(usize::from(self.len) == Self::PENDING));
        let last = usize::from(self.len).min(Self::PENDING - 1);
        if let Some(place) = self.pending.get_mut((usize::from(self.first) + last) % Self::PENDING) {
            *place = emergency;
        }
        self.len = last as u8 + 1;
    }

    fn pop(&mut self) -> Option<Emergency> {
        let emergency = self.pending.get(usize::from(self.first) % Self::PENDING).filter(|_| self.len > 0)?;
        self.first = self.first.wrapping_add(1) % Self::PENDING as u8;
        self.len -= 1;
        Some(*emergency)
    }

    /// The inhibit time has passed.
    pub fn handle_timeout(&mut self, now: Instant) {
        time::expire(&mut self.inhibited, now);
    }

    /// The oldest emergency that was not sent, unless the inhibit time holds.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.inhibited.is_some_and(|end| now < end) {
            return None;
        }
        let Some(id) = self.id else {
            // Register and history are kept also while EMCY is switched off.
            self.len = 0;
            return None;
        };
        let emergency = self.pop()?;
        self.inhibited = time::after(now, self.inhibit);
        Some(Frame::from_array(id, emergency.emit(self.order)))
    }

    /// When the inhibit time passes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.inhibited.filter(|_| self.len > 0)
    }
}

impl Default for EmcyProducer {
    fn default() -> Self {
        Self::new()
    }
}

/// What a place of the ring has that is free.
const NOTHING: Emergency = Emergency { code: ErrorCode::NO_ERROR, register: ErrorRegister::NONE, vendor: [0; 5] };

/// Puts an error on top of the history: 1003h:01 is the newest, 1003h:00 the number of errors.
fn push_history(error: u32, od: &mut (impl ObjectDictionary + ?Sized)) {
    let Some(len) = objects::read_u8(od, cia301::PREDEFINED_ERROR_FIELD, 0) else { return };
    let (mut newer, mut sub) = (error, 0);
    while sub < len.saturating_add(1) && od.entry(Address::new(cia301::PREDEFINED_ERROR_FIELD, sub + 1)).is_ok() {
        sub += 1;
        let older = objects::read_u32(od, cia301::PREDEFINED_ERROR_FIELD, sub).unwrap_or(0);
        objects::write(od, cia301::PREDEFINED_ERROR_FIELD, sub, newer);
        newer = older;
    }
    objects::write(od, cia301::PREDEFINED_ERROR_FIELD, 0, u32::from(sub));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TestOd;
    use std::string::String;
    use std::vec::Vec;

    fn od() -> TestOd {
        TestOd::new(
            "1001:00 u8  ro - 0
             1003:00 u8  rw - 0
             1003:01 u16 ro - 0
             1003:02 u16 ro - 0",
        )
    }

    fn sent(producer: &mut EmcyProducer, us: u64) -> Vec<String> {
        let now = Instant::from_micros(us);
        producer.handle_timeout(now);
        core::iter::from_fn(|| producer.poll_transmit(now)).map(|frame| std::format!("{frame}")).collect()
    }

    fn raise(producer: &mut EmcyProducer, code: u16, od: &mut TestOd) {
        let register = ErrorRegister::VOLTAGE | ErrorRegister::GENERIC;
        producer.raise(ErrorCode(code), register, [0; 5], true, od);
    }

    fn producer() -> EmcyProducer {
        let mut producer = EmcyProducer::new();
        producer.configure(CobId::standard(0x85), Duration::ZERO, CodeOrder::LowByteFirst);
        producer
    }

    #[test]
    fn a_history_of_16_bits_holds_the_code_alone() {
        let (mut producer, mut od) = (producer(), od());
        for code in [0x1000, 0x2000, 0x3000] {
            raise(&mut producer, code, &mut od);
        }
        assert_eq!([0, 1, 2].map(|sub| od.get(0x1003, sub)), [2, 0x3000, 0x2000]);
        assert_eq!(sent(&mut producer, 0).len(), 3);
    }

    #[test]
    fn more_than_can_wait_keep_the_oldest_and_the_newest() {
        let (mut producer, mut od) = (producer(), od());
        for code in 1..=12 {
            raise(&mut producer, code, &mut od);
        }
        let sent = sent(&mut producer, 0);
        assert_eq!(sent.len(), EmcyProducer::PENDING);
        assert_eq!((sent[0].as_str(), sent[7].as_str()), ("085#0100050000000000", "085#0C00050000000000"));
        assert_eq!(producer.replaced(), 4);
    }
}
