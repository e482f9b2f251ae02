//! A simulated drive on a virtual bus, and a manager's requests to it.

use std::any::{Any, type_name};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::panic::Location;
use std::sync::{Arc, Mutex, PoisonError};

use lexican_runtime::host::{Link, Node, VirtualBus, VirtualLink};
use lexican_runtime::profile::cia402::{State, Transitions};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// A drive in software, for the comparisons of any drive.
pub(crate) trait Simulator: Sized + 'static {
    type Drive: Node + Send + 'static;

    /// The node-ID of the manual's examples.
    const NODE: NodeId;
    /// Whether the drive takes no SDO write but that of four bytes (23h).
    const WRITES_FOUR_BYTES: bool = false;

    /// The transitions of the drive, as its crate has them.
    fn transitions() -> Transitions;
    fn start(now: Instant) -> Self::Drive;
    /// Changes a drive as delivered so that most comparisons are possible.
    fn prepare(_rig: &mut Rig<Self>) {}
    fn nmt(drive: &Self::Drive) -> NmtState;
    fn state(drive: &Self::Drive) -> State;
    fn status_word(drive: &mut Self::Drive, now: Instant) -> u16;
    /// Causes a fault that is over at once.
    fn fail(drive: &mut Self::Drive, now: Instant);
}

/// Remembers answers: while cells of the tables are mutated, the drive is asked again and again, and answers the same.
/// The key must contain everything on which the answer depends, besides the drive `S` and the place of the call.
#[track_caller]
pub(crate) fn once<S, V: Clone + Send + 'static>(key: impl Debug, ask: impl FnOnce() -> V) -> V {
    static MEMORY: Mutex<BTreeMap<String, Box<dyn Any + Send>>> = Mutex::new(BTreeMap::new());
    let key = format!("{} {} {} {key:?}", Location::caller(), type_name::<S>(), type_name::<V>());
    let memory = || MEMORY.lock().unwrap_or_else(PoisonError::into_inner);
    let known = memory().get(&key).and_then(|answer| answer.downcast_ref::<V>()).cloned();
    known.unwrap_or_else(|| {
        let answer = ask();
        memory().insert(key, Box::new(answer.clone()));
        answer
    })
}

/// A drive that has booted, and a link to it. On this bus, frames take no time.
pub(crate) struct Rig<S: Simulator> {
    bus: VirtualBus,
    link: VirtualLink,
    drive: Arc<Mutex<S::Drive>>,
}

impl<S: Simulator> Rig<S> {
    /// A drive prepared for comparisons.
    pub(crate) fn new() -> Self {
        let mut rig = Rig::as_delivered();
        S::prepare(&mut rig);
        rig
    }

    pub(crate) fn as_delivered() -> Self {
        Rig::with(S::start)
    }

    pub(crate) fn with(start: impl FnOnce(Instant) -> S::Drive) -> Self {
        let bus = VirtualBus::new();
        let drive = Arc::new(Mutex::new(start(bus.now())));
        bus.attach(Arc::clone(&drive));
        let link = bus.link();
        Rig { bus, link, drive }
    }

    /// A drive in OPERATIONAL.
    pub(crate) fn operational() -> Self {
        let mut rig = Rig::new();
        rig.nmt(0x01);
        rig.hear(0);
        rig
    }

    /// A drive in OPERATION ENABLED, by the control words of the examples.
    pub(crate) fn enabled() -> Self {
        let mut rig = Rig::operational();
        rig.enable();
        rig
    }

    pub(crate) fn enable(&mut self) {
        self.controls(&[0x0106, 0x0107, 0x010F]);
    }

    /// An identifier of this node.
    pub(crate) fn own(base: u16) -> u16 {
        base + u16::from(S::NODE.get())
    }

    pub(crate) fn send(&mut self, id: u16, data: &[u8]) {
        if let Some(frame) = CobId::standard(id).and_then(|id| Frame::new(id, data)) {
            // A virtual bus without faults takes every frame.
            let _ = self.link.send(&frame);
        }
    }

    /// Asks for a frame by RTR.
    pub(crate) fn request(&mut self, id: u16) {
        if let Some(frame) = CobId::standard(id).and_then(|id| Frame::remote(id, 8)) {
            let _ = self.link.send(&frame);
        }
    }

    pub(crate) fn nmt(&mut self, command: u8) {
        self.send(0x000, &[command, S::NODE.get()]);
    }

    /// Sends RPDO1.
    pub(crate) fn control(&mut self, word: u16) {
        self.send(Self::own(0x200), &word.to_le_bytes());
        self.hear(0);
    }

    /// Sends RPDO1 with each of these words.
    pub(crate) fn controls(&mut self, words: &[u16]) {
        words.iter().for_each(|word| self.control(*word));
    }

    /// Sends RPDO3 or RPDO4.
    pub(crate) fn command(&mut self, id: u16, word: u16, target: i32) {
        let mut data = [0; 6];
        data[..2].copy_from_slice(&word.to_le_bytes());
        data[2..].copy_from_slice(&target.to_le_bytes());
        self.send(id, &data);
        self.hear(0);
    }

    /// The frames of the next `ms` milliseconds.
    pub(crate) fn hear(&mut self, ms: u64) -> Vec<Frame> {
        let until = self.bus.now() + Duration::from_millis(ms);
        std::iter::from_fn(|| self.link.receive_frame(until).ok().flatten()).collect()
    }

    /// The data of the frames with this identifier.
    pub(crate) fn hear_from(&mut self, id: u16, ms: u64) -> Vec<Vec<u8>> {
        let frames = self.hear(ms);
        frames.iter().filter(|frame| frame.id().raw() == u32::from(id)).map(|frame| frame.data().to_vec()).collect()
    }

    /// The data that a remote frame brings within `ms` milliseconds.
    pub(crate) fn requested(&mut self, id: u16, ms: u64) -> Vec<Vec<u8>> {
        self.request(id);
        self.hear_from(id, ms)
    }

    /// Sends a frame to the SDO server, and hears its answer.
    pub(crate) fn sdo(&mut self, data: &[u8]) -> Option<[u8; 8]> {
        self.hear(0);
        self.send(Self::own(0x600), data);
        self.hear_from(Self::own(0x580), 0).first().and_then(|data| data.as_slice().try_into().ok())
    }

    /// Reads an entry of up to four bytes as a number. `Err` has the abort code, or 0 without an answer.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        match self.sdo(&[0x40, low, high, sub, 0, 0, 0, 0]) {
            Some([0x80, _, _, _, a, b, c, d]) => Err(u32::from_le_bytes([a, b, c, d])),
            Some([_, _, _, _, a, b, c, d]) => Ok(u32::from_le_bytes([a, b, c, d])),
            None => Err(0),
        }
    }

    /// Writes `size` bytes, or four if the drive takes nothing else. `Err` has the abort code, or 0 without an answer.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64, size: u8) -> Result<(), u32> {
        self.write_exactly(index, sub, value, if S::WRITES_FOUR_BYTES { 4 } else { size })
    }

    /// Writes `size` bytes.
    pub(crate) fn write_exactly(&mut self, index: u16, sub: u8, value: i64, size: u8) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut data = [0x23 | (4 - size.clamp(1, 4)) << 2, low, high, sub, 0, 0, 0, 0];
        let size = usize::from(size.clamp(1, 4));
        data[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
        match self.sdo(&data) {
            Some([0x60, ..]) => Ok(()),
            Some([_, _, _, _, a, b, c, d]) => Err(u32::from_le_bytes([a, b, c, d])),
            None => Err(0),
        }
    }

    /// Writes values with index, sub-index and size. Returns whether all were accepted; a refusal also shows in the
    /// steps that follow.
    pub(crate) fn set(&mut self, values: &[(u16, u8, i64, u8)]) -> bool {
        let mut taken = true;
        for &(index, sub, value, size) in values {
            taken &= self.write(index, sub, value, size).is_ok();
        }
        taken
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut S::Drive, Instant) -> T) -> T {
        let mut drive = self.drive.lock().unwrap_or_else(PoisonError::into_inner);
        look(&mut drive, self.bus.now())
    }

    /// The status word, even if the network does not let it be read.
    pub(crate) fn status(&self) -> u16 {
        self.see(S::status_word)
    }

    pub(crate) fn state(&self) -> State {
        self.see(|drive, _| S::state(drive))
    }

    pub(crate) fn nmt_state(&self) -> NmtState {
        self.see(|drive, _| S::nmt(drive))
    }
}
