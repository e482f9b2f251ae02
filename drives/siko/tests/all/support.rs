//! A simulated drive on a bus of its own, for tests that look at frames. Frames are written as for `cansend`, and the
//! drive is node 5.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::sync::{Arc, Mutex};

use lexican_runtime::host::candump::Line;
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use siko_ag03_1::sim::{MODEL, Setup, SimulatedDrive};
use siko_ag03_1::state::State;

pub(crate) const NODE: NodeId = NodeId::literal(5);

/// A drive, and a link to it.
pub(crate) struct Rig {
    pub(crate) bus: VirtualBus,
    pub(crate) link: VirtualLink,
    pub(crate) drive: Arc<Mutex<SimulatedDrive>>,
}

pub(crate) fn frame(text: &str) -> Frame {
    format!("(0000000000.000000) can0 {text}").parse::<Line>().unwrap().frame
}

impl Rig {
    /// A drive that has been switched on, before anything is received from it.
    pub(crate) fn of(drive: SimulatedDrive) -> Self {
        let bus = VirtualBus::new();
        let drive = Arc::new(Mutex::new(drive));
        bus.attach(Arc::clone(&drive));
        let link = bus.link();
        Rig { bus, link, drive }
    }

    /// A new drive, which has booted.
    pub(crate) fn new() -> Self {
        Rig::with(Setup::new(&MODEL, NODE))
    }

    /// A drive that has booted.
    pub(crate) fn with(setup: Setup) -> Self {
        let mut rig = Rig::of(SimulatedDrive::power_on(Instant::ZERO, setup));
        assert_eq!(rig.pass(0), ["705#00"]);
        rig
    }

    /// Lets time pass. Returns the frames received meanwhile.
    pub(crate) fn pass(&mut self, ms: u64) -> Vec<String> {
        let until = self.bus.now() + Duration::from_millis(ms);
        std::iter::from_fn(|| self.link.receive_frame(until).unwrap()).map(|frame| frame.to_string()).collect()
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        look(&mut self.drive.lock().unwrap(), self.bus.now())
    }

    pub(crate) fn send(&mut self, text: &str) {
        self.link.send(&frame(text)).unwrap();
    }

    /// Sends a frame. Returns the frames that come at once.
    pub(crate) fn ask(&mut self, text: &str) -> Vec<String> {
        self.send(text);
        self.pass(0)
    }

    /// Writes by SDO. Returns the abort code, if any.
    pub(crate) fn write(&mut self, index: u16, sub: u8, data: &[u8]) -> Option<u32> {
        let mut bytes = [0; 8];
        bytes[0] = 0x23 | (4 - data.len() as u8) << 2;
        bytes[1..3].copy_from_slice(&index.to_le_bytes());
        bytes[3] = sub;
        bytes[4..4 + data.len()].copy_from_slice(data);
        match self.request(bytes) {
            [0x60, ..] => None,
            [0x80, _, _, _, a, b, c, d] => Some(u32::from_le_bytes([a, b, c, d])),
            answer => panic!("{answer:02X?} is no answer to a write"),
        }
    }

    /// Reads by SDO: the four bytes, or the abort code.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        match self.request([0x40, low, high, sub, 0, 0, 0, 0]) {
            [0x42 | 0x4B | 0x4F, _, _, _, a, b, c, d] => Ok(u32::from_le_bytes([a, b, c, d])),
            [0x80, _, _, _, a, b, c, d] => Err(u32::from_le_bytes([a, b, c, d])),
            answer => panic!("{answer:02X?} is no answer to a read"),
        }
    }

    fn request(&mut self, bytes: [u8; 8]) -> [u8; 8] {
        self.link.send(&Frame::from_array(CobId::of_node(0x600, NODE), bytes)).unwrap();
        loop {
            let answer = self.link.receive_frame(self.bus.now()).unwrap().expect("an answer comes at once");
            if answer.id() == CobId::of_node(0x580, NODE) {
                return answer.data().try_into().unwrap();
            }
        }
    }

    pub(crate) fn state(&self) -> State {
        self.see(|drive, _| drive.state())
    }

    /// Enters NMT OPERATIONAL, and OPERATION ENABLED by the control words of the examples.
    pub(crate) fn enable(&mut self) {
        for text in ["000#0105", "205#0601", "205#0701", "205#0F01"] {
            self.send(text);
        }
        self.pass(0);
        assert_eq!(self.state(), State::OperationEnabled);
    }

    /// A new set-point, by the frames of table 25.
    pub(crate) fn travel_to(&mut self, target: i32) {
        let target = target.swap_bytes();
        self.ask(&format!("405#0F00{target:08X}"));
        self.ask(&format!("405#1F00{target:08X}"));
    }
}
