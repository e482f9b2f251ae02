//! A simulated servo as a node of a bus.

use std::path::Path;

use lexican_runtime::device::{Device, Event};
use lexican_runtime::host::Node;
use lexican_runtime::object::{Address, Entry, Layer, ObjectDictionary};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::storage::{self, Storing};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::sdo::{Abort, ServerResponse};
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId, cia301};

use crate::eeprom::EepromError;
use crate::memory::{Memory, read};
use crate::script::Following;
use crate::servo::script::{Change, Script, Seen};
use crate::servo::{Inputs, Servo, ServoModel, follow, report};
use crate::storage::{Storage, raw_of, signed};

/// A servo with its device and its dictionary, as a [`Node`] of a bus.
///
/// Its device type (1000h) is that of a servo drive of CiA 402 if the data sheet has none.
///
/// Entries that 1010h has stored, and those that [`ServoModel::persistent`] names, survive a power cut and a reset.
#[derive(Clone, Debug)]
pub struct SimulatedServo {
    model: &'static ServoModel,
    device: Device<16, 16, 1, 4>,
    storage: Box<dyn Storage>,
    servo: Servo,
    memory: Memory,
    on: bool,
    following: Following<Change>,
}

/// COB-ID, without the node-ID, of the answers of the default SDO server.
const SDO_ANSWERS: u16 = 0x580;
/// The command byte of an SDO abort.
const ABORT: u8 = 0x80;

const DEVICE_TYPE: Address = Address::new(cia301::DEVICE_TYPE, 0);
/// 1000h: device profile 402, a servo drive.
const SERVO_DRIVE: u64 = 0x0002_0192;

impl SimulatedServo {
    /// A servo with the dictionary of its model, switched on at `now`.
    #[must_use]
    pub fn new(now: Instant, model: &'static ServoModel, node: NodeId) -> Self {
        SimulatedServo::with_memory(now, model, node, Memory::default())
    }

    /// The same with the content of the file at `path`, to which every change of it is written.
    pub fn with_eeprom(
        now: Instant,
        model: &'static ServoModel,
        node: NodeId,
        path: impl AsRef<Path>,
    ) -> Result<Self, EepromError> {
        let storage = (model.storage)(node);
        let writable = writable(&*storage);
        let memory = Memory::open(path.as_ref(), |address, value| {
            let known = writable.contains(&address) || model.persistent.contains(&address);
            known
                && storage.entry(address).is_ok_and(|entry| {
                    entry
                        .data_type
                        .size()
                        .map_or(value.len() <= usize::from(entry.capacity), |size| size == value.len())
                })
        })?;
        Ok(SimulatedServo::with_memory(now, model, node, memory))
    }

    fn with_memory(now: Instant, model: &'static ServoModel, node: NodeId, memory: Memory) -> Self {
        let mut servo = SimulatedServo {
            model,
            device: Device::new(node, model.behaviour),
            storage: (model.storage)(node),
            servo: Servo::new(now, model),
            memory,
            on: true,
            following: Following::default(),
        };
        servo.memory.writable = writable(&*servo.storage);
        servo.boot(now, 0..=0xFFFF);
        servo
    }

    /// Which servo it is.
    #[must_use]
    pub fn model(&self) -> &'static ServoModel {
        self.model
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.device.node()
    }

    /// The NMT state.
    #[must_use]
    pub fn nmt_state(&self) -> NmtState {
        self.device.nmt_state()
    }

    /// The servo: state, faults, shaft.
    #[must_use]
    pub fn servo(&self) -> &Servo {
        &self.servo
    }

    /// The values of its objects as they were last measured or written.
    #[must_use]
    pub fn storage(&self) -> &dyn Storage {
        &*self.storage
    }

    /// Whether it has power.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Switches it off or on. A moving axis coasts when switched off.
    pub fn set_power(&mut self, now: Instant, on: bool) {
        if on == self.on {
            return;
        }
        self.on = on;
        self.servo.update(now, &mut *self.storage);
        self.servo.restart(now);
        if on {
            self.boot(now, 0..=0xFFFF);
        }
    }

    /// Changes the inputs of the servo.
    pub fn set_inputs(&mut self, now: Instant, change: impl FnOnce(&mut Inputs)) {
        self.servo.set_inputs(now, &mut *self.storage, change);
        self.report(now);
    }

    /// Gives `call` the servo and its dictionary, without the bus.
    pub fn with_servo<T>(&mut self, now: Instant, call: impl FnOnce(&mut Servo, &mut dyn Storage) -> T) -> T {
        self.servo.update(now, &mut *self.storage);
        let result = call(&mut self.servo, &mut *self.storage);
        self.servo.update(now, &mut *self.storage);
        self.report(now);
        result
    }

    /// Writes an object without the bus. Access rights are not enforced; all other checks and effects are the same.
    ///
    /// Errors: the abort code that a client would get; nothing has changed then.
    pub fn write(&mut self, now: Instant, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        self.servo.update(now, &mut *self.storage);
        self.with_device(|device, od| device.write(now, address, data, od))?;
        self.take(now, Some(Event::Written(address)));
        Ok(())
    }

    /// Why the file of [`SimulatedServo::with_eeprom`] could not be written the last time.
    #[must_use]
    pub fn eeprom_trouble(&self) -> Option<&EepromError> {
        self.memory.trouble()
    }

    /// Runs `script` from `now` on, and drops one that still runs.
    pub fn follow(&mut self, now: Instant, script: Script) {
        self.following = Following::new(now, script);
        self.run_script(now);
    }

    /// How many steps of the script have not happened yet.
    #[must_use]
    pub fn steps_left(&self) -> usize {
        self.following.steps_left()
    }

    /// Makes one change to the servo.
    pub fn apply(&mut self, now: Instant, change: &Change) {
        match change {
            Change::Input(setting) => self.set_inputs(now, |inputs| setting.apply(inputs)),
            Change::Turn(by) => _ = self.with_servo(now, |servo, od| servo.turn(now, od, *by)),
            Change::Power(on) => self.set_power(now, *on),
            Change::PowerCycle => {
                self.set_power(now, false);
                self.set_power(now, true);
            }
        }
    }

    fn seen(&self) -> Seen<'_> {
        let state = self.on.then(|| self.nmt_state());
        Seen { servo: &self.servo, storage: &*self.storage, state }
    }

    fn run_script(&mut self, now: Instant) {
        loop {
            let mut following = std::mem::take(&mut self.following);
            let changes = following.take_step(now, |at, condition| self.seen().is_so(at, condition));
            self.following = following;
            let Some(changes) = changes else { return };
            changes.iter().for_each(|change| self.apply(now, change));
        }
    }

    /// Stores a group of parameters as 1010h does; group 1 is all of them.
    pub fn store(&mut self, group: u8) -> Result<(), AbortCode> {
        storage::Storage::store(&mut self.memory, group, &mut *self.storage)
    }

    /// Resets the objects in `indices` to their power-on values, and starts the device.
    fn boot(&mut self, now: Instant, indices: std::ops::RangeInclusive<u16>) {
        let node = self.node();
        let before = std::mem::replace(&mut self.storage, (self.model.storage)(node));
        for (address, value) in self.memory.values() {
            if let Ok(entry) = self.storage.entry(*address) {
                // What another version of the data sheet does not accept stays at its default.
                let _ = self.storage.write(&entry, 0, value, true);
            }
        }
        for address in before.addresses().into_iter().filter(|address| !indices.contains(&address.index())) {
            if let Some(raw) = before.raw(address) {
                self.storage.set_raw(address, raw);
            }
        }
        // A dictionary has 0 if the data sheet has no default; the driver looks for a servo drive.
        if self.storage.raw(DEVICE_TYPE) == Some(0) {
            self.storage.set_raw(DEVICE_TYPE, SERVO_DRIVE);
        }
        self.servo.update(now, &mut *self.storage);
        self.with_device(|device, od| device.restart(now, od));
        self.report(now);
    }

    fn with_device<T>(&mut self, call: impl FnOnce(&mut Device<16, 16, 1, 4>, &mut dyn ObjectDictionary) -> T) -> T {
        let mut od = Checked { servo: &self.servo, storage: &mut *self.storage };
        call(&mut self.device, &mut Storing::new(&mut od, &mut self.memory))
    }

    /// Replaces the code of an SDO abort by the servo's own, if it has one.
    fn in_own_words(&self, frame: Frame) -> Frame {
        let id = CobId::of_node(SDO_ANSWERS, self.node());
        // A segment of a block transfer may look like an abort, but hardly in all bits that `parse` checks.
        let is_abort = frame.id() == id && frame.data().first() == Some(&ABORT);
        let answer = ServerResponse::parse(frame.data()).filter(|_| is_abort);
        let Some(ServerResponse::Abort(abort)) = answer else { return frame };
        let own = self.model.aborts.iter().find(|(instead_of, _)| *instead_of == abort.code);
        own.map_or(frame, |(_, code)| {
            let abort = ServerResponse::Abort(Abort { code: *code, ..abort });
            Frame::from_array(frame.id(), abort.to_bytes())
        })
    }

    fn take(&mut self, now: Instant, event: Option<Event>) {
        follow(&mut self.servo, now, &self.device, &mut *self.storage, event);
        match event {
            Some(Event::Reset(Reset::Node)) => {
                self.servo.restart(now);
                self.boot(now, 0..=0xFFFF);
            }
            Some(Event::Reset(Reset::Communication)) => self.boot(now, 0x1000..=0x1FFF),
            Some(Event::Written(address)) if self.model.persistent.contains(&address) => {
                if let Ok(value) = read(&mut *self.storage, address) {
                    self.memory.keep(address, value);
                }
            }
            _ => {}
        }
        self.report(now);
    }

    fn report(&mut self, now: Instant) {
        report(&mut self.servo, now, &mut self.device, &mut *self.storage);
    }
}

impl Node for SimulatedServo {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.on {
            self.servo.measure(now, &mut *self.storage);
            let event = self.with_device(|device, od| device.handle_frame(now, frame, od));
            self.take(now, event);
        }
        self.run_script(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.on {
            self.servo.measure(now, &mut *self.storage);
            let event = self.with_device(|device, od| device.handle_timeout(now, od));
            self.take(now, event);
        }
        self.run_script(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let frame = self.on.then(|| self.with_device(|device, od| device.poll_transmit(now, od)))??;
        Some(self.in_own_words(frame))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let own = [self.device.poll_timeout(), self.servo.next_event()];
        let script = self.seen().next_step(&self.following);
        own.into_iter().filter(|_| self.on).chain([script]).flatten().min()
    }

    fn concerns(&self) -> Vec<CobId> {
        self.device.cob_ids().collect()
    }

    fn generation(&self) -> u32 {
        self.device.generation()
    }

    fn changes_only_when_called(&self) -> bool {
        true
    }

    fn set_power(&mut self, now: Instant, on: bool) {
        // The inherent method.
        SimulatedServo::set_power(self, now, on);
    }
}

/// The dictionary as clients see it: the model may refuse their values.
struct Checked<'a> {
    servo: &'a Servo,
    storage: &'a mut dyn Storage,
}

impl<'a> Layer for Checked<'a> {
    type Under = dyn Storage + 'a;

    fn under(&self) -> &Self::Under {
        self.storage
    }

    fn under_mut(&mut self) -> &mut Self::Under {
        self.storage
    }

    fn write_entry(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let (model, raw) = (self.servo.model(), raw_of(data));
        let Some(value) = signed(entry.data_type, raw) else {
            return self.storage.write(entry, offset, data, last);
        };
        (model.check)(self.servo, self.storage, entry.address, value)?;
        self.servo.check_cycle(self.storage, entry.address, value)?;
        let kept = (model.kept)(entry.address, raw).to_le_bytes();
        // The storage refuses data that are too long for a number.
        self.storage.write(entry, offset, kept.get(..data.len()).unwrap_or(data), last)
    }
}

/// The entries that 1010h stores.
fn writable(storage: &dyn Storage) -> Vec<Address> {
    const COMMANDS: [u16; 3] =
        [cia301::STORE_PARAMETERS, cia301::RESTORE_DEFAULT_PARAMETERS, cia301::PREDEFINED_ERROR_FIELD];
    let is_stored = |address: &Address| {
        let entry = storage.entry(*address);
        !COMMANDS.contains(&address.index())
            && entry.is_ok_and(|entry| entry.access.is_readable() && entry.access.is_writable())
    };
    storage.addresses().into_iter().filter(is_stored).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Row, Rpdo, Rw, Table};

    #[test]
    fn what_the_application_has_changed_gets_through_to_the_device() {
        const POSITION: Address = Address::new(0x6064, 0);
        static ROWS: [Row; 1] = [Row::new(0x6064, 0, DataType::Integer32, Access::Rw, PdoMapping::Both).at(0, 4)];
        static TABLE: Table = Table { rows: &ROWS, limits: &[], image: &[0; 4] };
        let mut storage = Dictionary::<4>::new(&TABLE, NodeId::literal(5));
        storage.set(Object::<i32, Rw, Rpdo>::new(0x6064, 0), 100);
        let servo = Servo::new(Instant::ZERO, &ServoModel::CIA_402);
        let mut checked = Checked { servo: &servo, storage: &mut storage };
        assert_eq!(checked.take_changes(), Some((POSITION, POSITION)));
        assert_eq!(checked.take_changes(), None);
    }
}
