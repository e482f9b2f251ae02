//! Ours: frames with identifier and length, checked on both sides; access rights, limits and lengths checked by the
//! server; deadlines armed by both; repeated answers distinguished from new ones. The data is lent, and streamed by offset.

use std::hint::black_box;

use lexican_runtime::abort::AbortCode;
use lexican_runtime::device::{self, Behaviour, Device};
use lexican_runtime::object::{Access, Address, DataType, Dictionary, Entry, ObjectDictionary, PdoMapping, Row, Table};
use lexican_runtime::service::sdo_client::{Event, Payload, Scalar, SdoClient};
use lexican_runtime::service::sdo_server::{self, SdoServer};
use lexican_runtime::{Duration, Frame, Instant, NodeId};

use super::transfer::{Case, Direction, Indices, Kind, Transfer, bytes_index, check, pattern};
use crate::measure::{self, Contender};
use crate::report;

const NODE: NodeId = NodeId::literal(5);

/// Client and SDO server, which is what most peers have.
pub(super) fn server(case: Case) -> Contender {
    contender(report::OURS, case, SdoServer::of_node(NODE))
}

/// Client and whole device: it finds out by the identifier what a frame is, and guards its communication objects.
pub(super) fn device(case: Case) -> Contender {
    let mut device = Device::<4, 4, 1, 4>::new(NODE, Behaviour::CIA_301);
    let mut od = dictionary(case.kind);
    device.restart(Instant::ZERO, &mut *od);
    while device.poll_transmit(Instant::ZERO, &mut *od).is_some() {}
    contender("lexican, whole device", case, device)
}

fn contender(name: &'static str, case: Case, side: impl Side + 'static) -> Contender {
    let mut channel = Channel::new(case.kind, side);
    let frames = check(case, &mut channel);
    let contender = match (case.kind, case.direction) {
        (Kind::Expedited { objects }, Direction::Read) => {
            let mut indices = Indices::new(objects);
            Contender::new(name, move || {
                let mut payload = Scalar::room_for::<u32>();
                channel.read(indices.next(), &mut payload);
                black_box(payload.get::<u32>().expect("the server sent four bytes"));
            })
        }
        (Kind::Expedited { objects }, Direction::Write) => {
            let mut indices = Indices::new(objects);
            let mut value = 0_u32;
            Contender::new(name, move || {
                value = value.wrapping_add(1);
                channel.write(indices.next(), 4, &mut Scalar::of(black_box(value)));
            })
        }
        (Kind::Segmented { len } | Kind::Block { len }, direction) => {
            let mut buffer = pattern(len, 0);
            Contender::new(name, move || {
                let mut payload = black_box(buffer.as_mut_slice());
                match direction {
                    Direction::Read => channel.read(bytes_index(len), &mut payload),
                    Direction::Write => channel.write(bytes_index(len), len as u32, &mut payload),
                }
                black_box(payload);
            })
        }
    };
    contender.with_frames(frames)
}

/// What serves the dictionary.
trait Side {
    fn handle(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary);
    fn next(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame>;
}

impl Side for SdoServer {
    fn handle(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) {
        let event = self.handle_frame(now, frame, od);
        assert!(!matches!(event, Some(sdo_server::Event::Aborted { .. })), "the server aborts nothing");
    }

    fn next(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        self.poll_transmit(now, od)
    }
}

impl Side for Device<4, 4, 1, 4> {
    fn handle(&mut self, now: Instant, frame: &Frame, od: &mut dyn ObjectDictionary) {
        let event = self.handle_frame(now, frame, od);
        assert!(!matches!(event, Some(device::Event::SdoAborted { .. })), "the server aborts nothing");
    }

    fn next(&mut self, now: Instant, od: &mut dyn ObjectDictionary) -> Option<Frame> {
        self.poll_transmit(now, od)
    }
}

struct Channel<S> {
    client: SdoClient,
    by_block: bool,
    side: S,
    od: Box<dyn ObjectDictionary>,
    now: Instant,
    frames: u64,
}

impl<S: Side> Channel<S> {
    fn new(kind: Kind, side: S) -> Self {
        let by_block = matches!(kind, Kind::Block { .. });
        let client = SdoClient::of_node(NODE).with_block_writes_from(if by_block { 0 } else { u32::MAX });
        Channel { client, by_block, side, od: dictionary(kind), now: Instant::ZERO, frames: 0 }
    }

    fn read(&mut self, index: u16, payload: &mut dyn Payload) {
        self.now += Duration::from_micros(1);
        let address = Address::new(index, 0);
        let begun =
            if self.by_block { self.client.read_block(self.now, address) } else { self.client.read(self.now, address) };
        begun.expect("the transfer before is over");
        self.exchange(payload);
    }

    fn write(&mut self, index: u16, len: u32, payload: &mut dyn Payload) {
        self.now += Duration::from_micros(1);
        self.client.write(self.now, Address::new(index, 0), len).expect("the transfer before is over");
        self.exchange(payload);
    }

    /// Carries frames to and fro until the transfer is over and neither has any left.
    fn exchange(&mut self, payload: &mut dyn Payload) {
        let mut is_over = false;
        loop {
            while let Some(frame) = self.client.poll_transmit(self.now, payload) {
                self.frames += 1;
                self.side.handle(self.now, black_box(&frame), &mut *self.od);
            }
            if is_over {
                return;
            }
            while let Some(frame) = self.side.next(self.now, &mut *self.od) {
                self.frames += 1;
                match self.client.handle_frame(self.now, black_box(&frame), payload) {
                    None => {}
                    Some(Event::Done { .. }) => is_over = true,
                    Some(Event::Failed(error)) => panic!("{error}"),
                }
            }
        }
    }
}

impl<S: Side> Transfer for Channel<S> {
    fn read(&mut self, index: u16, len: usize) -> Vec<u8> {
        let mut buffer = vec![0; len];
        Channel::read(self, index, &mut &mut buffer[..]);
        buffer
    }

    fn write(&mut self, index: u16, data: &[u8]) {
        Channel::write(self, index, data.len() as u32, &mut &data[..]);
    }

    fn frames(&self) -> u64 {
        self.frames
    }
}

fn dictionary(kind: Kind) -> Box<dyn ObjectDictionary> {
    measure::scatter();
    match kind {
        Kind::Expedited { objects: 10 } => numbers::<40>(),
        Kind::Expedited { .. } => numbers::<4000>(),
        Kind::Segmented { len: 32 } | Kind::Block { len: 32 } => bytes::<34>(),
        Kind::Segmented { len: 1200 } | Kind::Block { len: 1200 } => bytes::<1202>(),
        Kind::Segmented { len } | Kind::Block { len } => Box::new(Domain(vec![0; len])),
    }
}

/// A quarter as many numbers as the image has bytes.
fn numbers<const N: usize>() -> Box<dyn ObjectDictionary> {
    let row = |at: u16| {
        let row = Row::new(0x2000 + at, 0, DataType::Unsigned32, Access::Rw, PdoMapping::Both);
        row.at(u32::from(at) * 4, 4)
    };
    table::<N>((0..(N / 4) as u16).map(row).collect())
}

/// All of the image in one object, behind its length.
fn bytes<const N: usize>() -> Box<dyn ObjectDictionary> {
    let len = N - 2;
    let row = Row::new(bytes_index(len), 0, DataType::OctetString, Access::Rw, PdoMapping::None);
    table::<N>(vec![row.at(2, len as u16)])
}

/// Generated code has this in statics.
fn table<const N: usize>(rows: Vec<Row>) -> Box<dyn ObjectDictionary> {
    let image: &'static [u8] = Box::leak(vec![0; N].into_boxed_slice());
    let table = Table { rows: rows.leak(), limits: &[], image };
    Box::new(Dictionary::<N>::new(Box::leak(Box::new(table)), NODE))
}

/// What no image holds, since it is longer than 65,535 bytes: the application's own memory.
struct Domain(Vec<u8>);

impl ObjectDictionary for Domain {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        if address == Address::new(0x4002, 0) {
            Ok(Entry::new(0x4002, 0, DataType::Domain, Access::Rw, PdoMapping::None))
        } else {
            Err(AbortCode::NO_SUCH_OBJECT)
        }
    }

    fn len(&self, _entry: &Entry) -> Option<u32> {
        u32::try_from(self.0.len()).ok()
    }

    fn read(&mut self, _entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        let rest = self.0.get(offset as usize..).unwrap_or(&[]);
        let len = rest.len().min(buffer.len());
        buffer[..len].copy_from_slice(&rest[..len]);
        Ok(len)
    }

    fn write(&mut self, _entry: &Entry, offset: u32, data: &[u8], _last: bool) -> Result<(), AbortCode> {
        let start = offset as usize;
        let room = self.0.get_mut(start..start + data.len()).ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        room.copy_from_slice(data);
        Ok(())
    }
}
