//! The device under test, as a tester sees it.

use std::collections::BTreeMap;

use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::object::{Address, Entry, ObjectDictionary};
use lexican_runtime::service::storage::{Storage, Storing};
use lexican_runtime::wire::crc;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

use crate::od;

pub const NODE: NodeId = NodeId::literal(5);

/// What survives a reset.
#[derive(Default)]
struct Memory {
    stored: BTreeMap<Address, Vec<u8>>,
}

impl Memory {
    pub fn range(group: u8) -> std::ops::RangeInclusive<u16> {
        if group == 2 { 0x1000..=0x1FFF } else { 0..=0xFFFF }
    }
}

impl Storage for Memory {
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
        let range = Memory::range(group);
        for entry in od::TABLE.entries.iter().filter(|entry| range.contains(&entry.address.index())) {
            let mut buffer = [0; 32];
            let len = od.read(entry, 0, &mut buffer)?;
            self.stored.insert(entry.address, buffer[..len].to_vec());
        }
        Ok(())
    }
    fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
        let range = Memory::range(group);
        self.stored.retain(|address, _| !range.contains(&address.index()));
        Ok(())
    }
}

/// The device under test, just booted.
pub struct Dut {
    pub device: Device<3, 3, 2, 3>,
    pub od: od::Storage,
    memory: Memory,
    now: Instant,
    pub events: Vec<Event>,
    sent: Vec<String>,
}

impl Dut {
    pub fn new() -> Self {
        let device = Device::new(NODE, Behaviour::CIA_301);
        let (memory, now) = (Memory::default(), Instant::ZERO);
        let mut dut = Dut { device, od: od::storage(NODE), memory, now, events: Vec::new(), sent: Vec::new() };
        dut.boot();
        assert_eq!(dut.take_sent(), ["705#00"]);
        dut
    }

    pub fn boot(&mut self) {
        self.od = od::storage(NODE);
        for (address, bytes) in &self.memory.stored {
            let entry = self.od.entry(*address).unwrap();
            self.od.write(&entry, 0, bytes, true).unwrap();
        }
        self.device.restart(self.now, &mut self.od);
        self.pull();
    }

    pub fn pull(&mut self) {
        let mut od = Storing::new(&mut self.od, &mut self.memory);
        while let Some(frame) = self.device.poll_transmit(self.now, &mut od) {
            self.sent.push(frame.to_string());
        }
    }

    pub fn take_sent(&mut self) -> Vec<String> {
        std::mem::take(&mut self.sent)
    }

    pub fn send(&mut self, text: &str) -> Vec<String> {
        let mut od = Storing::new(&mut self.od, &mut self.memory);
        let event = self.device.handle_frame(self.now, &frame(text), &mut od);
        self.events.extend(event);
        if let Some(Event::Reset(_)) = event {
            self.boot();
        }
        self.pull();
        self.take_sent()
    }

    pub fn pass_ms(&mut self, ms: u64) -> Vec<String> {
        let end = self.now + Duration::from_millis(ms);
        while let Some(due) = self.device.poll_timeout().filter(|&due| due <= end) {
            self.now = due.max(self.now);
            let mut od = Storing::new(&mut self.od, &mut self.memory);
            self.events.extend(self.device.handle_timeout(self.now, &mut od));
            self.pull();
        }
        self.now = end;
        self.take_sent()
    }

    pub fn enter(&mut self, state: NmtState) {
        let command = match state {
            NmtState::Operational => "000#0105",
            NmtState::Stopped => "000#0205",
            _ => "000#8005",
        };
        let sent = self.send(command);
        self.sent.extend(sent);
        assert_eq!(self.device.nmt_state(), state);
    }

    /// The eight bytes with which the server answers.
    pub fn request(&mut self, bytes: &[u8]) -> Vec<u8> {
        let hex: String = (0..8).map(|at| format!("{:02X}", bytes.get(at).unwrap_or(&0))).collect();
        let answers = self.send(&format!("605#{hex}"));
        let answer = answers.iter().find_map(|answer| answer.strip_prefix("585#")).expect("the server answers");
        (0..8).map(|at| u8::from_str_radix(&answer[2 * at..2 * at + 2], 16).unwrap()).collect()
    }

    pub fn initiate(&mut self, command: u8, at: (u16, u8), rest: &[u8]) -> Result<Vec<u8>, AbortCode> {
        let [low, high] = at.0.to_le_bytes();
        let answer = self.request(&[&[command, low, high, at.1], rest].concat());
        if answer[0] == 0x80 { Err(AbortCode(le(&answer[4..]) as u32)) } else { Ok(answer) }
    }

    pub fn read(&mut self, index: u16, sub: u8) -> Result<u32, AbortCode> {
        self.upload(index, sub).map(|bytes| le(&bytes[..bytes.len().min(4)]) as u32)
    }

    /// Expedited or in segments, as the server likes.
    pub fn upload(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, AbortCode> {
        let answer = self.initiate(0x40, (index, sub), &[])?;
        if answer[0] & 2 != 0 {
            return Ok(answer[4..8 - usize::from(answer[0] >> 2 & 3)].to_vec());
        }
        let (mut bytes, mut toggle) = (Vec::new(), 0);
        loop {
            let segment = self.request(&[0x60 | toggle]);
            assert_eq!(segment[0] & 0xF0, toggle);
            bytes.extend(&segment[1..8 - usize::from(segment[0] >> 1 & 7)]);
            if segment[0] & 1 != 0 {
                return Ok(bytes);
            }
            toggle ^= 0x10;
        }
    }

    pub fn write(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        let unused = 4 - data.len() as u8;
        self.initiate(0x23 | unused << 2, (index, sub), data).map(|answer| assert_eq!(answer[0], 0x60))
    }

    pub fn write_u32(&mut self, index: u16, sub: u8, value: u32) -> Result<(), AbortCode> {
        self.write(index, sub, &value.to_le_bytes())
    }

    pub fn download_segments(&mut self, at: (u16, u8), data: &[u8]) {
        let size = (data.len() as u32).to_le_bytes();
        assert_eq!(self.initiate(0x21, at, &size).unwrap()[0], 0x60);
        let mut chunks = data.chunks(7).enumerate().peekable();
        while let Some((number, chunk)) = chunks.next() {
            let toggle = (number as u8 & 1) << 4;
            let last = u8::from(chunks.peek().is_none());
            let command = toggle | (7 - chunk.len() as u8) << 1 | last;
            assert_eq!(self.request(&[&[command], chunk].concat())[0], 0x20 | toggle);
        }
    }

    /// At most seven bytes.
    pub fn download_block(&mut self, at: (u16, u8), data: &[u8], with_crc: bool) {
        let size = (data.len() as u32).to_le_bytes();
        let answer = self.initiate(0xC2 | u8::from(with_crc) << 2, at, &size).unwrap();
        assert_eq!(answer[0] & 0xFB, 0xA0);
        let answer = self.request(&[&[0x81], data].concat());
        assert_eq!(answer[..2], [0xA2, 1]);
        let check = if with_crc { crc_of(data) } else { 0 };
        let [low, high] = check.to_le_bytes();
        let unused = 7 - data.len() as u8;
        assert_eq!(self.request(&[0xC1 | unused << 2, low, high])[0], 0xA1);
    }

    pub fn upload_block(&mut self, index: u16, sub: u8, with_crc: bool) -> Vec<u8> {
        let answer = self.initiate(0xA0 | u8::from(with_crc) << 2, (index, sub), &[127]).unwrap();
        assert_eq!(answer[0] & 0xFB, 0xC2);
        let segments = self.send("605#A300000000000000");
        let mut bytes: Vec<u8> = segments
            .iter()
            .flat_map(|segment| (7..21).step_by(2).map(|at| u8::from_str_radix(&segment[at - 1..at + 1], 16).unwrap()))
            .collect();
        let end = self.request(&[0xA2, segments.len() as u8, 127]);
        bytes.truncate(bytes.len() - usize::from(end[0] >> 2 & 7));
        if with_crc {
            assert_eq!(le(&end[1..3]) as u16, crc_of(&bytes));
        }
        assert_eq!(self.send("605#A100000000000000"), [""; 0]);
        bytes
    }

    /// 1000 as two bytes, written in some way.
    pub fn written(&mut self, write: fn(&mut Dut, (u16, u8), &[u8]), index: u16) {
        write(self, (index, 0), &1000_u16.to_le_bytes());
        assert_eq!(self.read(index, 0), Ok(1000));
    }

    pub fn aborts(&mut self, request: &str, code: AbortCode) {
        let answer = self.send(request).concat();
        let bytes: String = code.0.to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
        assert!(answer.starts_with("585#80") && answer.ends_with(&bytes), "{answer}");
        // The server is ready again.
        assert_eq!(self.read(0x1000, 0), Ok(0x192));
    }

    pub fn entries(&self, wanted: fn(&Entry) -> bool) -> Vec<Entry> {
        od::TABLE.entries.iter().filter(|entry| wanted(entry)).copied().collect()
    }

    pub fn scan(&mut self, indices: std::ops::RangeInclusive<u16>, at_least: usize) {
        let entries = self.entries(|_| true);
        let entries = entries.iter().filter(|entry| indices.contains(&entry.address.index()));
        let mut found = 0;
        for entry in entries {
            self.read(entry.address.index(), entry.address.sub()).unwrap();
            found += usize::from(entry.address.sub() == 1);
        }
        assert!(found >= at_least);
    }

    /// Switches a PDO off, and its mapping.
    pub fn unmap(&mut self, parameter: u16) {
        let cob_id = self.read(parameter, 1).unwrap();
        self.write_u32(parameter, 1, cob_id | 0x8000_0000).unwrap();
        self.write(parameter + 0x200, 0, &[0]).unwrap();
    }

    pub fn map(&mut self, parameter: u16, entry: u32) -> Result<(), AbortCode> {
        self.unmap(parameter);
        self.write_u32(parameter + 0x200, 1, entry)?;
        self.write(parameter + 0x200, 0, &[1])
    }

    pub fn emergency(&mut self) -> Vec<String> {
        self.device.emergency(ErrorCode(0x3120), ErrorRegister::VOLTAGE, [0; 5], &mut self.od);
        self.pull();
        self.take_sent()
    }

    pub fn produce_sync(&mut self) {
        self.write_u32(0x1006, 0, 10_000).unwrap();
        self.write_u32(0x1005, 0, 0x4000_0080).unwrap();
    }

    pub fn guard(&mut self) {
        self.write(0x100C, 0, &[100, 0]).unwrap();
        self.write(0x100D, 0, &[2]).unwrap();
    }

    pub fn stores(&mut self, group: u8) {
        self.write(0x1017, 0, &[100, 0]).unwrap();
        self.write(0x1010, group, b"save").unwrap();
        self.write(0x1017, 0, &[200, 0]).unwrap();
        self.send("000#8105");
        assert_eq!(self.read(0x1017, 0), Ok(100));
    }

    pub fn restores(&mut self, group: u8) {
        self.stores(group);
        self.write(0x1011, group, b"load").unwrap();
        assert_eq!(self.read(0x1017, 0), Ok(100), "the values change with the reset");
        self.send("000#8105");
        assert_eq!(self.read(0x1017, 0), Ok(0));
    }

    /// Whether the state allows SDO, and PDO both ways; error control always works.
    pub fn allows(&mut self, sdo: bool, pdo: bool) {
        self.take_sent();
        assert_eq!(self.send("605#4000100000000000").len(), usize::from(sdo));
        assert_eq!(self.send("385#R6").len(), usize::from(pdo));
        self.send("405#1F0088130000");
        assert_eq!(self.od.get(od::TARGET_POSITION), if pdo { 5000 } else { 0 });
        assert_eq!(self.send("705#R1").len(), 1);
    }
}

pub fn le(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn crc_of(bytes: &[u8]) -> u16 {
    let mut crc = crc::Crc::new();
    crc.update(bytes);
    crc.get()
}

/// A frame as candump writes it: `605#4000100000000000`, `705#R1`.
fn frame(text: &str) -> Frame {
    let (id, data) = text.split_once('#').unwrap();
    let id = CobId::standard(u16::from_str_radix(id, 16).unwrap()).unwrap();
    if let Some(len) = data.strip_prefix('R') {
        return Frame::remote(id, len.parse().unwrap()).unwrap();
    }
    let bytes: Vec<u8> =
        (0..data.len()).step_by(2).map(|at| u8::from_str_radix(&data[at..at + 2], 16).unwrap()).collect();
    Frame::new(id, &bytes).unwrap()
}
