//! A client and a server on a bus in virtual time, and a dictionary with any entries.
#![allow(dead_code, unreachable_pub, reason = "every test file uses its own part of this")]

use std::collections::BTreeMap;

pub use super::common::{NODE, frame};
use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary, PdoMapping};
use lexican_runtime::service::sdo_client::{self, Payload, SdoClient};
use lexican_runtime::service::sdo_server::{self, SdoServer};
use lexican_runtime::{AbortCode, Duration, Frame, Instant};

pub const fn at(index: u16, sub: u8) -> Address {
    Address::new(index, sub)
}

/// Parses lines of `requests > responses`. A frame is given by its data, without trailing zeros.
fn script(text: &str) -> impl Iterator<Item = [Vec<[u8; 8]>; 2]> {
    let frames = |texts: &str| {
        let padded = texts.split_whitespace().map(|data| format!("000#{data:0<16}"));
        padded.map(|text| frame(&text).data().try_into().expect("eight bytes")).collect()
    };
    let lines = text.lines().map(|line| line.split_once("//").map_or(line, |(frames, _)| frames));
    lines.filter(|line| !line.trim().is_empty()).map(move |line| {
        let (requests, responses) = line.split_once('>').expect("requests > responses");
        [frames(requests), frames(responses)]
    })
}

/// Checks what the server answers.
#[track_caller]
pub fn check_server(bus: &mut Bus, text: &str) {
    for [requests, responses] in script(text) {
        let mut sent = vec![];
        for request in &requests {
            let request = Frame::from_array(bus.server.request_id(), *request);
            bus.events.extend(bus.server.handle_frame(bus.now, &request, &mut bus.od));
            sent.extend(core::iter::from_fn(|| bus.server.poll_transmit(bus.now, &mut bus.od)));
        }
        assert_eq!(data_of(&sent), responses, "the answer to {requests:02X?}");
    }
}

/// Checks what the client sends, and returns how the transfer ends.
#[track_caller]
pub fn check_client(client: &mut SdoClient, payload: &mut dyn Payload, text: &str) -> Option<sdo_client::Event> {
    let (now, mut ended) = (Instant::ZERO, None);
    for [requests, responses] in script(text) {
        let sent: Vec<Frame> = core::iter::from_fn(|| client.poll_transmit(now, payload)).collect();
        assert_eq!(data_of(&sent), requests, "before {responses:02X?}");
        for response in responses {
            assert_eq!(ended, None, "nothing is to come");
            ended = client.handle_frame(now, &Frame::from_array(client.response_id(), response), payload);
        }
    }
    ended
}

fn data_of(frames: &[Frame]) -> Vec<&[u8]> {
    frames.iter().map(Frame::data).collect()
}

/// Bytes that differ from their neighbours, so that an exchange is noticed.
pub fn pattern(len: usize) -> Vec<u8> {
    (0..len).map(|i| (i * 31 + i / 251 * 7 + 1) as u8).collect()
}

/// A dictionary in memory. Text, bytes and domains grow when they are written.
#[derive(Clone, Default)]
pub struct Od {
    pub entries: BTreeMap<Address, (Entry, Vec<u8>)>,
    /// Whether the dictionary does not know lengths in advance.
    pub hides_len: bool,
    /// The offset from which reads fail.
    pub breaks_at: Option<u32>,
    /// How often a value was written to its end.
    pub completed: usize,
}

impl Od {
    /// Adds an entry. Text, bytes and domains have no limit.
    pub fn with(mut self, address: Address, data_type: DataType, access: Access, value: &[u8]) -> Self {
        let capacity = data_type.size().unwrap_or(0) as u16;
        let entry = Entry::new(address.index(), address.sub(), data_type, access, PdoMapping::None);
        let entry = Entry { capacity, ..entry };
        self.entries.insert(address, (entry, value.to_vec()));
        self
    }

    /// Adds an entry that can be read and written, with room for `capacity` bytes.
    pub fn with_capacity(mut self, address: Address, data_type: DataType, capacity: u16, value: &[u8]) -> Self {
        let entry = Entry::new(address.index(), address.sub(), data_type, Access::Rw, PdoMapping::None);
        self.entries.insert(address, (Entry { capacity, ..entry }, value.to_vec()));
        self
    }

    pub fn value(&self, address: Address) -> &[u8] {
        &self.entries[&address].1
    }
}

impl ObjectDictionary for Od {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        match self.entries.get(&address) {
            Some((entry, _)) => Ok(*entry),
            None if self.entries.keys().any(|other| other.index() == address.index()) => {
                Err(AbortCode::NO_SUCH_SUB_INDEX)
            }
            None => Err(AbortCode::NO_SUCH_OBJECT),
        }
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        if self.hides_len { None } else { Some(self.value(entry.address).len() as u32) }
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        if self.breaks_at.is_some_and(|end| offset >= end) {
            return Err(AbortCode::HARDWARE_ERROR);
        }
        let rest = self.value(entry.address).get(offset as usize..).expect("reads stay within the value");
        let len = rest.len().min(buffer.len());
        buffer[..len].copy_from_slice(&rest[..len]);
        Ok(len)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let value = &mut self.entries.get_mut(&entry.address).expect("the entry was found before").1;
        if let Some(size) = entry.data_type.size() {
            assert_eq!((offset, data.len(), last), (0, size, true), "values of a fixed size come whole");
        }
        assert!(offset as usize <= value.len() || offset == 0, "writes leave no gaps");
        value.truncate(offset as usize);
        value.extend_from_slice(data);
        self.completed += usize::from(last);
        Ok(())
    }
}

/// Returns the frames that replace frame `k`.
pub type Fault<'a> = &'a mut dyn FnMut(usize, Frame) -> Vec<Frame>;

/// A client and a server of node 5.
pub struct Bus {
    pub client: SdoClient,
    pub server: SdoServer,
    pub od: Od,
    pub now: Instant,
    /// All frames that were sent, lost or not.
    pub log: Vec<Frame>,
    /// What the server reported.
    pub events: Vec<sdo_server::Event>,
}

impl Bus {
    pub fn new(od: Od) -> Self {
        let (client, server) = (SdoClient::of_node(NODE), SdoServer::of_node(NODE));
        Bus { client, server, od, now: Instant::ZERO, log: vec![], events: vec![] }
    }

    pub fn read(&mut self, address: Address) -> (sdo_client::Event, Vec<u8>) {
        self.client.read(self.now, address).expect("the client is idle");
        let mut buffer = Growing::default();
        let event = self.run(&mut buffer, &mut |_, frame| vec![frame]);
        (event, buffer.0)
    }

    pub fn read_block(&mut self, address: Address) -> (sdo_client::Event, Vec<u8>) {
        self.client.read_block(self.now, address).expect("the client is idle");
        let mut buffer = Growing::default();
        let event = self.run(&mut buffer, &mut |_, frame| vec![frame]);
        (event, buffer.0)
    }

    pub fn write(&mut self, address: Address, data: &[u8]) -> sdo_client::Event {
        self.client.write(self.now, address, data.len() as u32).expect("the client is idle");
        self.run(&mut { data }, &mut |_, frame| vec![frame])
    }

    /// Runs the transfer in progress until it ends. Every frame takes 250 us.
    pub fn run(&mut self, payload: &mut dyn Payload, fault: Fault<'_>) -> sdo_client::Event {
        for _ in 0..100_000 {
            if let Some(event) = self.step(payload, fault) {
                return event;
            }
        }
        panic!(
            "the transfer does not end: {:#?} {:#?} {:?}",
            self.client,
            self.server,
            &self.log[self.log.len() - 20..]
        );
    }

    /// Runs everything to its end, while the client begins nothing new.
    pub fn settle(&mut self) {
        while self.server.is_busy() || self.client.is_busy() {
            self.step(&mut [0_u8; 0], &mut |_, frame| vec![frame]);
        }
        while let Some(frame) = self.client.poll_transmit(self.now, &mut [0_u8; 0]) {
            self.log.push(frame);
            self.server.handle_frame(self.now, &frame, &mut self.od);
        }
        while let Some(frame) = self.server.poll_transmit(self.now, &mut self.od) {
            self.log.push(frame);
            self.client.handle_frame(self.now, &frame, &mut [0_u8; 0]);
        }
    }

    /// One frame from each side, or one deadline.
    pub fn step(&mut self, payload: &mut dyn Payload, fault: Fault<'_>) -> Option<sdo_client::Event> {
        let from_client = self.client.poll_transmit(self.now, payload);
        if let Some(event) = from_client.and_then(|frame| self.deliver(frame, payload, fault)) {
            return Some(event);
        }
        let from_server = self.server.poll_transmit(self.now, &mut self.od);
        if let Some(event) = from_server.and_then(|frame| self.deliver(frame, payload, fault)) {
            return Some(event);
        }
        if from_client.is_some() || from_server.is_some() {
            return None;
        }
        let next = self.client.poll_timeout().into_iter().chain(self.server.poll_timeout()).min();
        self.now = self.now.max(next.expect("one side waits for something"));
        self.events.extend(self.server.handle_timeout(self.now));
        self.client.handle_timeout(self.now)
    }

    fn deliver(&mut self, frame: Frame, payload: &mut dyn Payload, fault: Fault<'_>) -> Option<sdo_client::Event> {
        let k = self.log.len();
        self.log.push(frame);
        let mut ended = None;
        for frame in fault(k, frame) {
            self.now += Duration::from_micros(250);
            self.events.extend(self.server.handle_frame(self.now, &frame, &mut self.od));
            ended = ended.or(self.client.handle_frame(self.now, &frame, payload));
        }
        ended
    }
}

/// A payload without a limit.
#[derive(Default)]
pub struct Growing(pub Vec<u8>);

impl Payload for Growing {
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        (&self.0[..]).load(offset, buffer)
    }

    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        assert_eq!(offset as usize, self.0.len(), "data comes ascending and without gaps");
        self.0.extend_from_slice(data);
        data.len()
    }
}
