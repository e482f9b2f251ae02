//! The device: its dictionary, the behaviour of the objects, and the loop that runs it over a link.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::host::{Link, Node, Participant};
use lexican_runtime::object::{Address, DataType, Entry, ObjectDictionary};
use lexican_runtime::service::lss_device::{self, LssDevice, LssHost, StoreError};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::lss::{self, Identity};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

use crate::od;

pub(crate) type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const SETPOINT: Address = Address::new(0x2000, 0);
const ACTUAL: Address = Address::new(0x2001, 0);
const RAISE_ERROR: Address = Address::new(0x2004, 0);

/// The longest value of the domain in the dictionary, in bytes.
const STORE: usize = 1 << 20;

/// The identity in 1018h.
const IDENTITY: Identity = Identity { vendor: 0x4C58, product: 7, revision: 0x0001_0002, serial: 0x1234_5678 };

/// Serves until standard input ends.
pub(crate) fn run(link: impl Link, node: Option<NodeId>) -> Outcome<()> {
    let ended = end_of_input();
    let peer = Peer::new(link.now(), node);
    let mut participant = Participant::new(link, peer);
    println!("ready");
    while !ended.load(Ordering::Relaxed) {
        let look = participant.now() + Duration::from_millis(100);
        // A failure of the bus is temporary.
        let _ = participant.run(look)?;
    }
    Ok(())
}

fn end_of_input() -> Arc<AtomicBool> {
    let ended = Arc::new(AtomicBool::new(false));
    let at_end = Arc::clone(&ended);
    std::thread::spawn(move || {
        // Input is ignored; its end, or an error, ends the device.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        at_end.store(true, Ordering::Relaxed);
    });
    ended
}

/// A device with LSS. Without a node-ID, only LSS works.
struct Peer {
    device: Option<Device>,
    od: Od,
    lss: LssDevice,
}

impl Peer {
    fn new(now: Instant, node: Option<NodeId>) -> Self {
        let any = node.unwrap_or(NodeId::MAX);
        let mut peer = Peer { device: None, od: Od::new(any), lss: LssDevice::new(IDENTITY, node) };
        if let Some(node) = node {
            peer.boot(now, node);
        }
        peer
    }

    fn boot(&mut self, now: Instant, node: NodeId) {
        self.od = Od { store: std::mem::take(&mut self.od.store), ..Od::new(node) };
        let device = self.device.get_or_insert_with(|| Device::new(node, Behaviour::CIA_301));
        device.restart_as(node, now, &mut self.od);
    }

    /// The behaviour of the objects: the actual value follows the setpoint, and errors are raised on request.
    fn follow(&mut self, now: Instant, event: Event) {
        let Some(device) = &mut self.device else { return };
        match event {
            Event::Reset(Reset::Node | Reset::Communication) => {
                if let Some(node) = self.lss.reset() {
                    self.boot(now, node);
                }
            }
            Event::RpdoReceived { .. } | Event::Written(SETPOINT) => {
                let setpoint = self.od.image.get(od::SETPOINT);
                self.od.image.set(od::ACTUAL_VALUE, setpoint);
                device.changed(ACTUAL);
            }
            Event::Time(time) => self.od.image.set(od::TIME_RECEIVED, time),
            Event::Written(RAISE_ERROR) => match self.od.image.get(od::RAISE_ERROR) {
                0 => device.clear(ErrorRegister(0xFF), &mut self.od),
                code => device.emergency(ErrorCode(code), ErrorRegister::GENERIC, [1, 2, 3, 4, 5], &mut self.od),
            },
            _ => {}
        }
    }
}

impl Node for Peer {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if let Some(lss_device::Event::NodeIdGiven(node)) = self.lss.handle_frame(now, frame, &mut Host) {
            self.boot(now, node);
        }
        if let Some(event) = self.device.as_mut().and_then(|device| device.handle_frame(now, frame, &mut self.od)) {
            self.follow(now, event);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if let Some(event) = self.device.as_mut().and_then(|device| device.handle_timeout(now, &mut self.od)) {
            self.follow(now, event);
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let device = self.device.as_mut().and_then(|device| device.poll_transmit(now, &mut self.od));
        device.or_else(|| self.lss.poll_transmit(now))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.device.as_ref().and_then(Device::poll_timeout)
    }

    fn concerns(&self) -> Vec<CobId> {
        let device = self.device.iter().flat_map(Device::cob_ids);
        [lss::REQUEST].into_iter().chain(device).collect()
    }

    fn generation(&self) -> u32 {
        self.device.as_ref().map_or(0, Device::generation)
    }
}

/// The generated dictionary, and the domain, which is not in its image.
struct Od {
    image: od::Storage,
    store: Vec<u8>,
}

impl Od {
    fn new(node: NodeId) -> Self {
        Od { image: od::storage(node), store: Vec::new() }
    }
}

impl ObjectDictionary for Od {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.image.entry(address)
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        match entry.data_type {
            DataType::Domain => u32::try_from(self.store.len()).ok(),
            _ => self.image.len(entry),
        }
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        if entry.data_type != DataType::Domain {
            return self.image.read(entry, offset, buffer);
        }
        let rest = self.store.get(offset as usize..).unwrap_or_default();
        Ok(buffer.iter_mut().zip(rest).map(|(to, from)| *to = *from).count())
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        if entry.data_type != DataType::Domain {
            return self.image.write(entry, offset, data, last);
        }
        self.store.truncate(offset as usize);
        if self.store.len() + data.len() > STORE {
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        self.store.extend_from_slice(data);
        Ok(())
    }
}

/// Stores nothing, and has only one bit rate.
struct Host;

impl LssHost for Host {
    fn configure_bit_timing(&mut self, _table: u8, _index: u8) -> bool {
        false
    }

    fn store(&mut self, _node: Option<NodeId>) -> Result<(), StoreError> {
        Ok(())
    }
}
