//! Errors: the register (1001h), the history (1003h), EMCY, and what an error of communication brings with it.

use super::Device;
use super::selection::Selection;
use super::services::{Services, Timer};
use crate::cia301;
use crate::object::{Address, ObjectDictionary};
use crate::service::heartbeat_consumer::Heartbeat;
use crate::time::Instant;
use crate::wire::emcy::{ErrorCode, ErrorRegister};

impl<
    const RPDOS: usize,
    const TPDOS: usize,
    const SERVERS: usize,
    const MONITORED: usize,
    const MAPPED: usize,
    S: Selection,
> Device<RPDOS, TPDOS, SERVERS, MONITORED, MAPPED, S>
{
    /// An error occurred: `register` is set in the error register, the code goes into the history
    /// (1003h), and an EMCY is sent. That of a lost heartbeat or life guarding (8130h) is not sent again for what the device
    /// has noticed and reported by itself.
    pub fn emergency(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        od: &mut (impl ObjectDictionary + ?Sized),
    ) {
        self.services.get_mut().raise(code, register, vendor, true, od);
    }

    /// The same without an entry in the history.
    pub fn emergency_unrecorded(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        od: &mut (impl ObjectDictionary + ?Sized),
    ) {
        self.services.get_mut().raise(code, register, vendor, false, od);
    }

    /// Errors are over: `register` is reset in the error register, and an EMCY with the code 0000h is
    /// sent when the application had set any of its bits. `ErrorRegister(0xFF)` ends all errors of the application.
    pub fn clear(&mut self, register: ErrorRegister, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.services.get_mut().clear(register, true, od);
    }

    /// One error of several is over, and `remaining` has the bits of those that are left, which may have the same ones. An
    /// EMCY with the code 0000h says so (CiA 301, 7.2.7.1, transition 2). When none is left, [`Device::clear`] says that.
    pub fn end_error(&mut self, remaining: ErrorRegister, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.services.get_mut().application_errors = remaining;
        self.services.get_mut().report_end(od);
    }

    /// The same as [`Device::clear`] without an EMCY.
    pub fn clear_unreported(&mut self, register: ErrorRegister, od: &mut (impl ObjectDictionary + ?Sized)) {
        self.services.get_mut().clear(register, false, od);
    }

    /// The bus failed (bus-off): the error behaviour (1029h) follows. Losing a heartbeat or life guarding
    /// is noticed without this.
    pub const fn communication_failed(&mut self, now: Instant) {
        self.services.get_mut().timers.set(Timer::Reaction, Some(now));
    }

    /// Resets the error of communication in the register when none is left.
    pub(super) fn end_communication_error(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        if self.services.get().communication_error {
            self.services.get_mut().end_communication_error(od);
        }
    }
}

impl<const RPDOS: usize, const TPDOS: usize, const MONITORED: usize, const MAPPED: usize, S: Selection>
    Services<RPDOS, TPDOS, MONITORED, MAPPED, S>
{
    fn raise(
        &mut self,
        code: ErrorCode,
        register: ErrorRegister,
        vendor: [u8; 5],
        record: bool,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) {
        // The generic bit is an error of its own only where it stands alone.
        let specific = register & !ErrorRegister::GENERIC;
        let errors = if specific.is_empty() { ErrorRegister::GENERIC } else { specific };
        self.application_errors = self.application_errors | errors;
        let has_reported = !self.behaviour().unreported.contains(&code);
        if code == ErrorCode::LIFE_GUARD && self.has_lost_a_node() && has_reported {
            self.show_errors(od);
        } else {
            self.report_error(code, vendor, record, od);
        }
    }

    fn report_error(
        &mut self,
        code: ErrorCode,
        vendor: [u8; 5],
        record: bool,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) {
        let before = self.emcy.register();
        self.emcy.raise(code, self.errors(), vendor, record, od);
        self.follow_register(before);
    }

    fn report_end(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        let before = self.emcy.register();
        self.emcy.clear(self.errors(), [0; 5], od);
        self.follow_register(before);
    }

    /// The error register is an object like others: TPDOs may map it.
    fn follow_register(&mut self, before: ErrorRegister) {
        if self.emcy.register() != before {
            self.changed(Address::new(cia301::ERROR_REGISTER, 0));
        }
    }

    /// What the error register has to show: the errors of the application and those that the device has
    /// noticed itself. The generic bit is set with any of them, unless the device deviates.
    fn errors(&self) -> ErrorRegister {
        let errors = self.application_errors | self.own_errors();
        let alone = errors.is_empty() || !self.behaviour().generic_error;
        if alone { errors } else { errors | ErrorRegister::GENERIC }
    }

    fn own_errors(&self) -> ErrorRegister {
        if self.communication_error { ErrorRegister::COMMUNICATION } else { ErrorRegister::NONE }
    }

    fn clear(&mut self, register: ErrorRegister, is_reported: bool, od: &mut (impl ObjectDictionary + ?Sized)) {
        let ended = self.application_errors & register;
        self.application_errors = self.application_errors & !register;
        // What the device has noticed itself does not end by this.
        if !(ended & !self.own_errors()).is_empty() && is_reported {
            self.report_end(od);
        } else {
            self.show_errors(od);
        }
    }

    /// Sets the error register without an EMCY.
    fn show_errors(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        let before = self.emcy.register();
        self.emcy.set_register(self.errors(), od);
        self.follow_register(before);
    }

    /// An error of communication that the device has noticed itself.
    pub(super) fn raise_communication_error(&mut self, code: ErrorCode, od: &mut (impl ObjectDictionary + ?Sized)) {
        if self.behaviour().unreported.contains(&code) {
            return;
        }
        self.communication_error = true;
        self.report_error(code, [0; 5], self.behaviour().records_communication_errors, od);
    }

    /// Resets the error of communication in the register when none is left. While the application has errors, the
    /// device is not free of errors, and sends no message that may be read as that.
    pub(super) fn end_communication_error(&mut self, od: &mut (impl ObjectDictionary + ?Sized)) {
        if !self.communication_error || self.has_communication_error() {
            return;
        }
        self.communication_error = false;
        if self.errors().is_empty() {
            self.report_end(od);
        } else {
            self.show_errors(od);
        }
    }

    fn has_lost_a_node(&self) -> bool {
        self.guarding.is_some_and(|guarding| guarding.is_lost())
            || self.consumers.iter().flatten().any(|consumer| consumer.heartbeat() == Heartbeat::Lost)
    }

    fn has_communication_error(&self) -> bool {
        self.sync_consumer.has_length_error()
            || self.has_lost_a_node()
            || self.rpdos.iter().any(|slot| slot.pdo.length_error().is_some() || slot.pdo.has_timed_out())
    }
}
