//! A device that follows a script: it answers reads from a table, and expects orders in sequence.
//!
//! Each line of a script begins with its kind, and may end with where it is written:
//!
//! ```text
//! > 205#0601       an order, exactly this frame: NMT, PDO or SDO download
//! = 6041:00 0231   the object has another value from then on
//! < 185#3102       a frame that the device sends unasked
//! ~ 300            so many milliseconds pass
//! @ travel 36000 1237    what node 3 is ordered again and again, and shows: see `handshake`
//! ```
//!
//! SDO uploads are not orders: the driver may read as often as it likes.

use std::collections::VecDeque;
use std::fmt::Debug;
use std::sync::{Arc, Mutex};

use lexican_driver::{Drive, Error, Kind};
use lexican_runtime::host::{Node, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// The description of a device.
#[derive(Clone, Copy)]
pub(crate) struct Sheet {
    pub(crate) node: NodeId,
    /// Index, sub-index, bytes, value.
    pub(crate) objects: &'static [(u16, u8, usize, u64)],
    /// Whether reads are answered by 42h, for any size, and only 23h writes.
    pub(crate) always_four_bytes: bool,
}

/// A driver on a bus with a device, which it has recognised as one of its kind.
pub(crate) struct Rig<K: Kind> {
    pub(crate) bus: VirtualBus,
    pub(crate) device: Arc<Mutex<Device>>,
    pub(crate) drive: Drive<VirtualLink, K>,
}

impl<K: Kind> Rig<K> {
    #[track_caller]
    pub(crate) fn new(sheet: Sheet) -> Self {
        let (bus, device) = bus(sheet);
        let drive = Drive::connect_unprotected(bus.link(), sheet.node).expect("it is of its kind");
        Rig { bus, device, drive }
    }

    /// Runs `operate` while the device follows the script, and checks that nothing else was ordered and no step is
    /// left.
    #[track_caller]
    pub(crate) fn check<T: Debug>(
        &mut self,
        script: &str,
        operate: impl FnOnce(&mut Drive<VirtualLink, K>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.follow(script);
        let result = operate(&mut self.drive);
        // The last frame is still in transit.
        self.bus.advance(Duration::from_millis(1));
        self.check_through(&format!("{result:?}"));
        result
    }

    /// Gives the device a script.
    pub(crate) fn follow(&self, script: &str) {
        self.device.lock().unwrap().follow(self.bus.now(), script);
    }

    /// Checks that the script was followed to its end.
    #[track_caller]
    pub(crate) fn check_through(&self, what: &str) {
        let device = self.device.lock().unwrap();
        assert_eq!(device.unexpected, [""; 0], "unexpected, with {what}; left: {:?}", device.steps);
        assert_eq!(device.steps, [], "left over, with {what}");
    }

    /// Drops the driver, and checks that the script was followed to its end, with no other orders.
    #[track_caller]
    pub(crate) fn check_dropped(self) {
        let Rig { bus, device, drive } = self;
        drop(drive);
        bus.advance(Duration::from_millis(10));
        assert!(device.lock().unwrap().is_through());
    }

    /// Checks that an operation fails with this message, without sending anything.
    #[track_caller]
    pub(crate) fn check_unsupported<T: Debug>(
        &mut self,
        message: &str,
        operate: impl FnOnce(&mut Drive<VirtualLink, K>) -> Result<T, Error>,
    ) {
        let before = self.device.lock().unwrap().heard;
        let error = operate(&mut self.drive).expect_err("it does not have it");
        assert_eq!(error.to_string(), message);
        assert_eq!(self.device.lock().unwrap().heard, before, "something was sent");
    }
}

pub(crate) fn bus(sheet: Sheet) -> (VirtualBus, Arc<Mutex<Device>>) {
    let bus = VirtualBus::with_bit_rate(500);
    let device = Arc::new(Mutex::new(Device::new(sheet)));
    bus.attach(Arc::clone(&device));
    (bus, device)
}

#[derive(Clone, Debug, PartialEq)]
enum Step {
    Order(String),
    Set(Address, u64),
    Send(Frame),
    Wait(Duration),
}

/// The device on the bus.
pub(crate) struct Device {
    sheet: Sheet,
    values: Vec<(Address, usize, u64)>,
    steps: VecDeque<Step>,
    outbox: VecDeque<Frame>,
    waits_until: Option<Instant>,
    unexpected: Vec<String>,
    heard: u64,
}

impl Device {
    fn new(sheet: Sheet) -> Self {
        let values = sheet.objects.iter().map(|&(index, sub, size, value)| (Address::new(index, sub), size, value));
        Device {
            sheet,
            values: values.collect(),
            steps: VecDeque::new(),
            outbox: VecDeque::new(),
            waits_until: None,
            unexpected: Vec::new(),
            heard: 0,
        }
    }

    fn set(&mut self, index: u16, sub: u8, value: u64) {
        *self.find(Address::new(index, sub)).expect("an object of the sheet").1 = value;
    }

    fn find(&mut self, address: Address) -> Option<(usize, &mut u64)> {
        self.values.iter_mut().find(|(of, ..)| *of == address).map(|(_, size, value)| (*size, value))
    }

    /// Carries out the steps up to the next order or wait.
    fn go_on(&mut self, now: Instant) {
        while self.waits_until.is_none() {
            match self.steps.front() {
                None | Some(Step::Order(_)) => return,
                Some(&Step::Set(address, value)) => self.set(address.index(), address.sub(), value),
                Some(&Step::Send(frame)) => self.outbox.push_back(frame),
                Some(&Step::Wait(span)) => self.waits_until = Some(now + span),
            }
            self.steps.pop_front();
        }
    }

    fn is_next(&mut self, now: Instant, frame: &Frame) -> bool {
        let text = frame.to_string();
        let next = self.waits_until.is_none() && self.steps.front() == Some(&Step::Order(text.clone()));
        if next {
            self.steps.pop_front();
            self.go_on(now);
        } else {
            self.unexpected.push(text);
        }
        next
    }

    /// Begins a script.
    pub(crate) fn follow(&mut self, now: Instant, script: &str) {
        self.steps = steps(script);
        self.go_on(now);
    }

    /// Whether it has received all that it expects, and nothing else.
    pub(crate) fn is_through(&self) -> bool {
        self.steps.is_empty() && self.unexpected.is_empty()
    }

    /// Its answer to an upload request.
    pub(crate) fn answer_to(&mut self, request: &str) -> String {
        self.handle_frame(Instant::ZERO, &frame(request));
        self.outbox.pop_front().expect("an answer").to_string()
    }

    /// The direct effect of a receive PDO: RPDO1, 3 and 4, as mapped by CiA 402-3.
    fn map(&mut self, frame: &Frame) {
        let of = |base| frame.id() == CobId::of_node(base, self.sheet.node);
        let target = if of(0x400) {
            Some(0x607A)
        } else if of(0x500) {
            Some(0x60FF)
        } else {
            None
        };
        if let (Some(index), [_, _, value @ ..]) = (target, frame.data())
            && let (Some((_, stored)), Ok(value)) = (self.find(Address::new(index, 0)), value.try_into())
        {
            *stored = u32::from_le_bytes(value).into();
        }
    }

    fn upload(&mut self, address: Address) -> [u8; 8] {
        let four_bytes = self.sheet.always_four_bytes;
        let Some((size, value)) = self.find(address) else { return abort(address, 0x0602_0000) };
        let command = if four_bytes { 0x42 } else { 0x43 | ((4 - size) as u8) << 2 };
        answer(command, address, *value as u32)
    }

    fn download(&mut self, now: Instant, frame: &Frame, command: u8, address: Address, value: u32) -> [u8; 8] {
        if self.sheet.always_four_bytes && command != 0x23 {
            self.unexpected.push(format!("{frame}: not 23h"));
            return abort(address, 0x0504_0001);
        }
        // First the effect of the write itself, then that of the script.
        if let Some((_, stored)) = self.find(address) {
            *stored = value.into();
        }
        if self.is_next(now, frame) { answer(0x60, address, 0) } else { abort(address, 0x0800_0022) }
    }
}

impl Node for Device {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.heard += 1;
        if frame.id() != CobId::of_node(0x600, self.sheet.node) {
            self.map(frame);
            self.is_next(now, frame);
            return;
        }
        let Ok([command, index_low, index_high, sub, a, b, c, d]) = <[u8; 8]>::try_from(frame.data()) else {
            return self.unexpected.push(frame.to_string());
        };
        let address = Address::new(u16::from_le_bytes([index_low, index_high]), sub);
        let answer = match command {
            0x40 => self.upload(address),
            0x80 => return,
            _ => self.download(now, frame, command, address, u32::from_le_bytes([a, b, c, d])),
        };
        self.outbox.push_back(Frame::from_array(CobId::of_node(0x580, self.sheet.node), answer));
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.waits_until.is_some_and(|until| until <= now) {
            self.waits_until = None;
            self.go_on(now);
        }
    }

    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        self.outbox.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.waits_until
    }
}

fn answer(command: u8, address: Address, value: u32) -> [u8; 8] {
    let ([low, high], [a, b, c, d]) = (address.index().to_le_bytes(), value.to_le_bytes());
    [command, low, high, address.sub(), a, b, c, d]
}

fn abort(address: Address, code: u32) -> [u8; 8] {
    answer(0x80, address, code)
}

fn steps(script: &str) -> VecDeque<Step> {
    let lines = script.lines().map(str::trim).filter(|line| !line.is_empty());
    lines
        .flat_map(|line| line.strip_prefix("@ ").map_or_else(|| [step(line)].into(), |word| steps(&handshake(word))))
        .collect()
}

/// The orders and answers that a word stands for. A travel has a target, and the status word that acknowledges it.
fn handshake(line: &str) -> String {
    let mut words = line.split_whitespace();
    let mut word = || words.next().unwrap_or_else(|| panic!("{line}: too short"));
    let name = word();
    match name {
        "enable" => ["06 0231", "07 0233", "0F 0237"].map(by_sdo).concat(),
        "run" => {
            let velocity = i32::from_str_radix(word(), 16).expect("a hexadecimal number");
            let set_point = velocity.swap_bytes();
            format!(
                "= 6061:00 03\n> 603#2B4060000F010000\n> 603#23FF6000{set_point:08X}\n> 603#2B4060000F000000
                = 606C:00 {velocity:08X}\n= 1002:00 20000200"
            )
        }
        "travel" | "travel-by-sdo" => {
            let target = word().parse::<i32>().expect("a number").swap_bytes();
            let [ready, start] = ["0F", "1F"].map(|word| match name {
                "travel" => format!("> 203#{word}00"),
                _ => format!("> 603#2B406000{word}000000"),
            });
            format!("{ready}\n> 603#237A6000{target:08X}\n{start}\n= 6041:00 {}\n{ready}", word())
        }
        _ => panic!("{line}: what is that?"),
    }
}

/// A control word by SDO, and the status word that follows.
fn by_sdo(words: &str) -> String {
    let (control, status) = words.split_once(' ').expect("two words");
    format!("> 603#2B406000{control}000000\n= 6041:00 {status}\n")
}

fn step(line: &str) -> Step {
    let mut words = line.split_whitespace().skip(1);
    let mut word = || words.next().unwrap_or_else(|| panic!("{line}: too short"));
    match line.chars().next() {
        Some('>') => Step::Order(word().to_owned()),
        Some('<') => Step::Send(frame(word())),
        Some('~') => Step::Wait(Duration::from_millis(word().parse().expect("milliseconds"))),
        Some('=') => {
            let (index, sub) = word().split_once(':').expect("index:sub");
            let hex = |text| u64::from_str_radix(text, 16).expect("a hexadecimal number");
            Step::Set(Address::new(hex(index) as u16, hex(sub) as u8), hex(word()))
        }
        _ => panic!("{line}: what is that?"),
    }
}

fn frame(text: &str) -> Frame {
    let (id, data) = text.split_once('#').expect("id#data");
    let byte = |at: usize| u8::from_str_radix(&data[at..at + 2], 16).expect("two hexadecimal digits");
    let data: Vec<u8> = (0..data.len()).step_by(2).map(byte).collect();
    let id = u16::from_str_radix(id, 16).ok().and_then(CobId::standard).expect("an identifier");
    Frame::new(id, &data).expect("at most eight bytes")
}
