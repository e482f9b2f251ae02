//! A simulated drive on a virtual bus, and a manager's way to ask it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use siko_ag03_1::sim::{Setup, SimulatedDrive};

/// The node of the manual's examples.
pub(crate) const NODE: NodeId = NodeId::literal(5);

/// What the drive answers, remembered: it is the same whatever the tables say, and they are asked about again
/// and again while single cells of them are altered.
pub(crate) type Memory<K, V> = Mutex<BTreeMap<K, V>>;

/// Asks unless it is remembered.
pub(crate) fn once<K: Ord, V: Clone>(memory: &Memory<K, V>, key: K, ask: impl FnOnce() -> V) -> V {
    let known = memory.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
    known.unwrap_or_else(|| {
        let answer = ask();
        memory.lock().unwrap_or_else(PoisonError::into_inner).insert(key, answer.clone());
        answer
    })
}

/// A drive that has booted, and a link to it. A frame takes no time here.
pub(crate) struct Bench {
    bus: VirtualBus,
    link: VirtualLink,
    drive: Arc<Mutex<SimulatedDrive>>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Bench::with(Setup::new(NODE))
    }

    pub(crate) fn with(setup: Setup) -> Self {
        let bus = VirtualBus::new();
        let drive = Arc::new(Mutex::new(SimulatedDrive::power_on(bus.now(), setup)));
        bus.attach(Arc::clone(&drive));
        let link = bus.link();
        Bench { bus, link, drive }
    }

    /// In OPERATIONAL.
    pub(crate) fn operational() -> Self {
        let mut bench = Bench::new();
        bench.nmt(0x01);
        bench.hear(0);
        bench
    }

    /// In OPERATION ENABLED, by the control words of the examples.
    pub(crate) fn enabled() -> Self {
        let mut bench = Bench::operational();
        bench.enable();
        bench
    }

    pub(crate) fn enable(&mut self) {
        for word in [0x0106, 0x0107, 0x010F] {
            self.control(word);
        }
    }

    pub(crate) fn send(&mut self, id: u16, data: &[u8]) {
        if let Some(frame) = CobId::standard(id).and_then(|id| Frame::new(id, data)) {
            // A virtual bus that is well takes every frame.
            let _ = self.link.send(&frame);
        }
    }

    pub(crate) fn request(&mut self, id: u16) {
        if let Some(frame) = CobId::standard(id).and_then(|id| Frame::remote(id, 8)) {
            let _ = self.link.send(&frame);
        }
    }

    pub(crate) fn nmt(&mut self, command: u8) {
        self.send(0x000, &[command, NODE.get()]);
    }

    /// Sends RPDO1.
    pub(crate) fn control(&mut self, word: u16) {
        self.send(0x205, &word.to_le_bytes());
        self.hear(0);
    }

    /// Sends RPDO3 or RPDO4.
    pub(crate) fn command(&mut self, id: u16, word: u16, target: i32) {
        let mut data = [0; 6];
        data[..2].copy_from_slice(&word.to_le_bytes());
        data[2..].copy_from_slice(&target.to_le_bytes());
        self.send(id, &data);
        self.hear(0);
    }

    /// What comes within so many milliseconds.
    pub(crate) fn hear(&mut self, ms: u64) -> Vec<Frame> {
        let until = self.bus.now() + Duration::from_millis(ms);
        std::iter::from_fn(|| self.link.receive_frame(until).ok().flatten()).collect()
    }

    /// The data of what comes with this identifier.
    pub(crate) fn hear_from(&mut self, id: u16, ms: u64) -> Vec<Vec<u8>> {
        let frames = self.hear(ms);
        frames.iter().filter(|frame| frame.id().raw() == u32::from(id)).map(|frame| frame.data().to_vec()).collect()
    }

    /// Sends a frame to the SDO server, and hears its answer.
    pub(crate) fn sdo(&mut self, data: &[u8]) -> Option<[u8; 8]> {
        self.hear(0);
        self.send(0x605, data);
        self.hear_from(0x585, 0).first().and_then(|data| data.as_slice().try_into().ok())
    }

    /// Reads: the four bytes as a number, or the abort code (0 when nothing answers).
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        match self.sdo(&[0x40, low, high, sub, 0, 0, 0, 0]) {
            Some([0x80, _, _, _, a, b, c, d]) => Err(u32::from_le_bytes([a, b, c, d])),
            Some([_, _, _, _, a, b, c, d]) => Ok(u32::from_le_bytes([a, b, c, d])),
            None => Err(0),
        }
    }

    /// Writes `size` bytes; `Err` has the abort code (0 when nothing answers).
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64, size: u8) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut data = [0x23 | (4 - size.clamp(1, 4)) << 2, low, high, sub, 0, 0, 0, 0];
        let bytes = value.to_le_bytes();
        let size = usize::from(size.clamp(1, 4));
        data[4..4 + size].copy_from_slice(&bytes[..size]);
        match self.sdo(&data) {
            Some([0x60, ..]) => Ok(()),
            Some([_, _, _, _, a, b, c, d]) => Err(u32::from_le_bytes([a, b, c, d])),
            None => Err(0),
        }
    }

    /// Writes these: index, sub-index, value, and size. What is not taken shows in what follows.
    pub(crate) fn set(&mut self, values: &[(u16, u8, i64, u8)]) {
        for &(index, sub, value, size) in values {
            let _ = self.write(index, sub, value, size);
        }
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        let mut drive = self.drive.lock().unwrap_or_else(PoisonError::into_inner);
        look(&mut drive, self.bus.now())
    }

    /// Lets the world around the drive change.
    pub(crate) fn world(&mut self, change: impl FnOnce(&mut siko_ag03_1::sim::inputs::Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
    }

    /// The status word, whether or not the network lets anybody read it.
    pub(crate) fn status(&self) -> u16 {
        self.see(|drive, now| drive.status_word(now))
    }

    /// The system status word.
    pub(crate) fn system(&self) -> u16 {
        self.see(|drive, now| drive.controller().system_status(now))
    }
}
