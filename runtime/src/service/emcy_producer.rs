//! Telling others of errors (CiA 301, 7.2.7; 1001h, 1003h, 1014h, 1015h).

use super::objects;
use crate::frame::Frame;
use crate::id::CobId;
use crate::object::{Address, ObjectDictionary};
use crate::time::{Duration, Instant};
use crate::wire::emcy::{CodeOrder, Emergency, ErrorCode, ErrorRegister};

/// Sends emergencies, and keeps error register and history in the dictionary.
#[derive(Clone, Copy, Debug)]
pub struct EmcyProducer {
    id: Option<CobId>,
    order: CodeOrder,
    inhibit: Duration,
    inhibited: Option<Instant>,
    register: ErrorRegister,
    /// What is still to be sent, the oldest first.
    pending: [Option<Emergency>; EmcyProducer::PENDING],
}

impl EmcyProducer {
    /// How many emergencies wait while the inhibit time holds; when there are more, the newest replaces
    /// the one before it. The history has them all.
    pub const PENDING: usize = 8;

    /// Sends nothing, until it has a COB-ID.
    #[must_use]
    pub const fn new(order: CodeOrder) -> Self {
        EmcyProducer {
            id: None,
            order,
            inhibit: Duration::ZERO,
            inhibited: None,
            register: ErrorRegister::NONE,
            pending: [None; EmcyProducer::PENDING],
        }
    }

    /// Sends as `id`, `None` for not at all, with at least `inhibit` between two emergencies.
    pub const fn configure(&mut self, id: Option<CobId>, inhibit: Duration) {
        self.id = id;
        self.inhibit = inhibit;
    }

    /// The error register.
    #[must_use]
    pub const fn register(&self) -> ErrorRegister {
        self.register
    }

    /// An error occurred. `bits` are set in the error register (1001h), and the generic error bit with
    /// them; the code comes into the history (1003h) when `record` says so.
    pub fn raise(
        &mut self,
        code: ErrorCode,
        bits: ErrorRegister,
        vendor: [u8; 5],
        record: bool,
        od: &mut dyn ObjectDictionary,
    ) {
        self.set_register(self.register | bits | ErrorRegister::GENERIC, od);
        if record {
            // Behind the code, the history has 16 bits of additional information.
            let [low, high, ..] = vendor;
            push_history(u32::from(code.0) | u32::from(u16::from_le_bytes([low, high])) << 16, od);
        }
        self.push(Emergency { code, register: self.register, vendor });
    }

    /// Errors are over: `bits` are reset in the error register, the generic error bit too when no other
    /// is left. The message has the code 0000h. Nothing is sent when none of the bits was set.
    pub fn clear(&mut self, bits: ErrorRegister, vendor: [u8; 5], od: &mut dyn ObjectDictionary) {
        if (self.register & bits).is_empty() {
            return;
        }
        let mut left = self.register & !bits;
        if (left & !ErrorRegister::GENERIC).is_empty() {
            left = ErrorRegister::NONE;
        }
        self.set_register(left, od);
        self.push(Emergency { code: ErrorCode::NO_ERROR, register: left, vendor });
    }

    fn set_register(&mut self, register: ErrorRegister, od: &mut dyn ObjectDictionary) {
        self.register = register;
        objects::write(od, 0x1001, 0, u64::from(register.0));
    }

    fn push(&mut self, emergency: Emergency) {
        let free = self.pending.iter().position(Option::is_none).unwrap_or(Self::PENDING - 1);
        if let Some(slot) = self.pending.get_mut(free) {
            *slot = Some(emergency);
        }
    }

    /// The inhibit time has passed.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.inhibited.take_if(|end| *end <= now);
    }

    /// The oldest emergency that was not sent, unless the inhibit time holds.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.inhibited.is_some_and(|end| now < end) {
            return None;
        }
        let Some(id) = self.id else {
            // A device whose EMCY is switched off still keeps register and history.
            self.pending = [None; Self::PENDING];
            return None;
        };
        let emergency = self.pending.first_mut()?.take()?;
        self.pending.rotate_left(1);
        self.inhibited = if self.inhibit.is_zero() { None } else { Some(now + self.inhibit) };
        Some(Frame::from_array(id, emergency.emit(self.order)))
    }

    /// When the inhibit time passes.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let waiting = self.pending.first().is_some_and(Option::is_some);
        self.inhibited.filter(|_| waiting)
    }
}

/// Puts an error on top of the history: 1003h:01 is the newest, 1003h:00 the number of errors.
fn push_history(error: u32, od: &mut dyn ObjectDictionary) {
    let Some(len) = objects::read_u8(od, 0x1003, 0) else { return };
    let exists = |od: &dyn ObjectDictionary, sub| od.entry(Address::new(0x1003, sub)).is_ok();
    let room = (1..=len.saturating_add(1)).take_while(|&sub| exists(od, sub)).last().unwrap_or(0);
    for sub in (2..=room).rev() {
        let older = objects::read_u32(od, 0x1003, sub - 1).unwrap_or(0);
        objects::write(od, 0x1003, sub, u64::from(older));
    }
    objects::write(od, 0x1003, 1, u64::from(error));
    objects::write(od, 0x1003, 0, u64::from(room));
}
