//! A device and its dictionary, tested by scripts of frames in virtual time.
#![allow(dead_code, unreachable_pub, reason = "every test file uses its own part, and none exports it")]

#[path = "../../src/testing.rs"]
pub mod testing;

use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::object::ObjectDictionary;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use testing::TestOd;

pub const NODE: NodeId = NodeId::literal(5);
/// No frames.
pub const NOTHING: [&str; 0] = [];

/// A dictionary with every service, with the COB-IDs of node 5.
pub const FULL: &str = "
    1000:00 u32  ro - 0x192
    1001:00 u8   ro tpdo 0
    1003:00 u8   rw - 0
    1003:01 u32  ro - 0
    1003:02 u32  ro - 0
    1003:03 u32  ro - 0
    1005:00 u32  rw - 0x80
    1006:00 u32  rw - 0
    1007:00 u32  rw - 0
    1008:00 text const - test-device
    100C:00 u16  rw - 0
    100D:00 u8   rw - 0
    1012:00 u32  rw - 0x80000100
    1014:00 u32  rw - 0x85
    1015:00 u16  rw - 0
    1016:00 u8   const - 3
    1016:01 u32  rw - 0
    1016:02 u32  rw - 0
    1016:03 u32  rw - 0
    1017:00 u16  rw - 0
    1018:00 u8   const - 1
    1018:01 u32  ro - 0x195
    1019:00 u8   rw - 0
    1029:00 u8   const - 1
    1029:01 u8   rw - 0
    1200:00 u8   const - 2
    1200:01 u32  ro - 0x605
    1200:02 u32  ro - 0x585
    1201:00 u8   const - 3
    1201:01 u32  rw - 0x80000000
    1201:02 u32  rw - 0x80000000
    1201:03 u8   rw - 0
    1400:00 u8   const - 5
    1400:01 u32  rw - 0x205
    1400:02 u8   rw - 255
    1400:05 u16  rw - 0
    1401:01 u32  ro - 0x305
    1402:00 u8   const - 5
    1402:01 u32  rw - 0x405
    1402:02 u8   rw - 255
    1402:05 u16  rw - 0
    1600:00 u8   rw - 1
    1600:01 u32  rw - 0x60400010
    1600:02 u32  rw - 0
    1602:00 u8   rw - 2
    1602:01 u32  rw - 0x60400010
    1602:02 u32  rw - 0x607A0020
    1602:03 u32  rw - 0
    1800:00 u8   const - 6
    1800:01 u32  rw - 0x185
    1800:02 u8   rw - 255
    1800:03 u16  rw - 0
    1800:05 u16  rw - 0
    1800:06 u8   rw - 0
    1802:00 u8   const - 6
    1802:01 u32  rw - 0x385
    1802:02 u8   rw - 253
    1802:03 u16  rw - 0
    1802:05 u16  rw - 0
    1802:06 u8   rw - 0
    1A00:00 u8   rw - 1
    1A00:01 u32  rw - 0x60410010
    1A00:02 u32  rw - 0
    1A00:03 u32  rw - 0
    1A02:00 u8   rw - 2
    1A02:01 u32  rw - 0x60410010
    1A02:02 u32  rw - 0x60640020
    2000:01 u1   rw both 0
    2000:02 u8   rw both 0
    2000:03 u64  rw both 0
    2001:00 u32  wo - 0
    6040:00 u16  rw rpdo 0
    6041:00 u16  ro tpdo 0x1234
    6064:00 i32  ro tpdo -2
    607A:00 i32  rw rpdo 0
";

/// A device under test.
pub struct Rig<O = TestOd> {
    pub device: Device<3, 3, 2, 3>,
    pub od: O,
    pub now: Instant,
    pub events: Vec<Event>,
}

impl Rig {
    pub fn full() -> Self {
        Rig::with("")
    }

    /// A device with changed entries in its dictionary.
    pub fn with(changes: &str) -> Self {
        Rig::new(TestOd::new(FULL).with(changes), Behaviour::CIA_301)
    }

    /// A device that deviates from CiA 301.
    pub fn deviating(behaviour: Behaviour) -> Self {
        Rig::new(TestOd::new(FULL), behaviour)
    }
}

impl<O: ObjectDictionary> Rig<O> {
    /// A device that has sent its boot-up message.
    pub fn new(od: O, behaviour: Behaviour) -> Self {
        let mut rig = Rig { device: Device::new(NODE, behaviour), od, now: Instant::ZERO, events: Vec::new() };
        rig.restart();
        assert_eq!(rig.sent(), ["705#00"]);
        rig
    }

    pub fn restart(&mut self) {
        self.device.restart(self.now, &mut self.od);
    }

    /// The device in OPERATIONAL, after the TPDOs that are sent on entering.
    pub fn operational(mut self) -> Self {
        self.send("000#0105");
        self.events.clear();
        self
    }

    /// Sends the device a frame in the notation of candump, and returns the answers.
    pub fn send(&mut self, frame: &str) -> Vec<String> {
        self.events.extend(self.device.handle_frame(self.now, &self::frame(frame), &mut self.od));
        self.sent()
    }

    /// The frames that the device sends now.
    pub fn sent(&mut self) -> Vec<String> {
        let mut sent = Vec::new();
        loop {
            while let Some(frame) = self.device.poll_transmit(self.now, &mut self.od) {
                sent.push(frame.to_string());
            }
            match self.device.poll_timeout() {
                Some(due) if due <= self.now => self.timeout(),
                _ => return sent,
            }
        }
    }

    fn timeout(&mut self) {
        self.events.extend(self.device.handle_timeout(self.now, &mut self.od));
    }

    /// Lets time pass, and returns what the device sends, with the time in us since the call.
    pub fn pass(&mut self, span: Duration) -> Vec<String> {
        let (start, end) = (self.now, self.now + span);
        let mut sent = Vec::new();
        while let Some(due) = self.device.poll_timeout().filter(|&due| due <= end) {
            self.now = due.max(self.now);
            self.timeout();
            let at_us = self.now.since(start).as_micros();
            sent.extend(self.sent().into_iter().map(|frame| format!("{at_us} {frame}")));
        }
        self.now = end;
        sent
    }

    pub fn pass_ms(&mut self, ms: u64) -> Vec<String> {
        self.pass(Duration::from_millis(ms))
    }

    /// Writes through SDO: `Err` has the abort code.
    pub fn write(&mut self, index: u16, sub: u8, size: usize, value: u32) -> Result<(), u32> {
        let command = 0x23 | ((4 - size as u8) << 2);
        let answer = self.request(command, index, sub, value);
        match answer[0] {
            0x60 => Ok(()),
            0x80 => Err(number(&answer)),
            other => panic!("{index:04X}:{sub:02X} answered with {other:02X}"),
        }
    }

    /// Reads through SDO: `Err` has the abort code.
    pub fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let answer = self.request(0x40, index, sub, 0);
        match answer[0] {
            0x42 | 0x43 | 0x47 | 0x4B | 0x4F => Ok(number(&answer)),
            0x80 => Err(number(&answer)),
            other => panic!("{index:04X}:{sub:02X} answered with {other:02X}"),
        }
    }

    fn request(&mut self, command: u8, index: u16, sub: u8, value: u32) -> [u8; 8] {
        let mut data = [command, 0, 0, sub, 0, 0, 0, 0];
        data[1..3].copy_from_slice(&index.to_le_bytes());
        data[4..].copy_from_slice(&value.to_le_bytes());
        let request = Frame::from_array(CobId::standard(0x605).unwrap(), data);
        self.events.extend(self.device.handle_frame(self.now, &request, &mut self.od));
        // Skip other frames that are due first.
        let answer = core::iter::from_fn(|| self.device.poll_transmit(self.now, &mut self.od))
            .find(|frame| frame.id() == CobId::standard(0x585).unwrap())
            .expect("the server answers");
        answer.data().try_into().unwrap()
    }

    pub fn state(&self) -> NmtState {
        self.device.nmt_state()
    }

    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

fn number(answer: &[u8; 8]) -> u32 {
    u32::from_le_bytes(answer[4..].try_into().unwrap())
}

/// Parses a frame in the notation of candump: `605#4000100000000000`, `705#R`, `00000585#01`; spaces are ignored.
pub fn frame(text: &str) -> Frame {
    let text: String = text.split_whitespace().collect();
    let (id, data) = text.split_once('#').unwrap();
    let raw = u32::from_str_radix(id, 16).unwrap();
    let id = if id.len() > 3 { CobId::extended(raw) } else { CobId::standard(raw as u16) }.unwrap();
    if let Some(len) = data.strip_prefix('R') {
        return Frame::remote(id, len.parse().unwrap_or(0)).unwrap();
    }
    let bytes: Vec<u8> =
        (0..data.len()).step_by(2).map(|at| u8::from_str_radix(&data[at..at + 2], 16).unwrap()).collect();
    Frame::new(id, &bytes).unwrap()
}
