//! canopen-rs: bare eight bytes, without identifiers, lengths of frames, or time, and without a check that an answer
//! is about the object that was asked for. Its dictionary is a linear map with access rights and types. No object
//! has more than 32 bytes, and blocks are not served.

use std::hint::black_box;

use canopen_rs::datatypes::{ByteString, DataType, Value};
use canopen_rs::object_dictionary::{Address, Entry, ObjectDictionary};
use canopen_rs::sdo::{SdoClient, SdoEvent, SdoServer};
use canopen_rs::types::NodeId;

use super::transfer::{Case, Direction, Indices, Kind, Transfer, bytes_index, check, pattern};
use crate::measure::{self, Contender};

pub(super) fn contender(case: Case) -> Option<Contender> {
    match case.kind {
        Kind::Expedited { objects: 10 } | Kind::Segmented { len: 32 } => Some(race::<10>(case)),
        Kind::Expedited { .. } => Some(race::<1000>(case)),
        Kind::Segmented { .. } | Kind::Block { .. } => None,
    }
}

fn race<const N: usize>(case: Case) -> Contender {
    let mut channel = Channel::<N>::new(case.kind);
    let frames = check(case, &mut channel);
    let name = "canopen-rs 0.6.1";
    let contender = match (case.kind, case.direction) {
        (Kind::Expedited { objects }, Direction::Read) => {
            let mut indices = Indices::new(objects);
            Contender::new(name, move || {
                black_box(channel.read(indices.next(), DataType::Unsigned32));
            })
        }
        (Kind::Expedited { objects }, Direction::Write) => {
            let mut indices = Indices::new(objects);
            let mut value = 0_u32;
            Contender::new(name, move || {
                value = value.wrapping_add(1);
                channel.write(indices.next(), Value::Unsigned32(black_box(value)));
            })
        }
        (Kind::Segmented { len } | Kind::Block { len }, Direction::Read) => Contender::new(name, move || {
            black_box(channel.read(bytes_index(len), DataType::OctetString));
        }),
        (Kind::Segmented { len } | Kind::Block { len }, Direction::Write) => {
            let value = bytes(&pattern(len, 0));
            Contender::new(name, move || channel.write(bytes_index(len), *black_box(&value)))
        }
    };
    contender.with_frames(frames)
}

fn bytes(data: &[u8]) -> Value {
    Value::OctetString(ByteString::from_bytes(data).expect("at most 32 bytes"))
}

struct Channel<const N: usize> {
    client: SdoClient,
    server: SdoServer,
    od: Box<ObjectDictionary<N>>,
    frames: u64,
}

impl<const N: usize> Channel<N> {
    fn new(kind: Kind) -> Self {
        let node = NodeId::new(5).expect("1 to 127");
        measure::scatter();
        let mut od = Box::new(ObjectDictionary::new());
        let entries: Vec<(u16, Value)> = match kind {
            Kind::Expedited { objects } => (0..objects).map(|at| (0x2000 + at, Value::Unsigned32(0))).collect(),
            Kind::Segmented { len } | Kind::Block { len } => vec![(bytes_index(len), bytes(&vec![0; len]))],
        };
        for (index, value) in entries {
            od.insert(Address::new(index, 0), Entry::rw(value)).expect("N was made for it");
        }
        Channel { client: SdoClient::new(node), server: SdoServer::new(node), od, frames: 0 }
    }

    fn read(&mut self, index: u16, data_type: DataType) -> Value {
        let request = self.client.read(Address::new(index, 0), data_type);
        self.exchange(request).expect("this was a read")
    }

    fn write(&mut self, index: u16, value: Value) {
        let request = self.client.write(Address::new(index, 0), value);
        black_box(self.exchange(request));
    }

    fn exchange(&mut self, mut request: [u8; 8]) -> Option<Value> {
        loop {
            let response = self.server.handle(&mut self.od, black_box(&request)).expect("every request is answered");
            self.frames += 2;
            match self.client.on_response(black_box(&response)) {
                SdoEvent::Send(next) => request = next,
                SdoEvent::Complete(value) => return value,
                SdoEvent::Aborted(code) => panic!("aborted: {code:08X}"),
            }
        }
    }
}

impl<const N: usize> Transfer for Channel<N> {
    fn read(&mut self, index: u16, len: usize) -> Vec<u8> {
        match Channel::read(self, index, if len == 4 { DataType::Unsigned32 } else { DataType::OctetString }) {
            Value::Unsigned32(value) => value.to_le_bytes().to_vec(),
            Value::OctetString(bytes) => bytes.as_bytes().to_vec(),
            other => panic!("neither a number nor bytes: {other:?}"),
        }
    }

    fn write(&mut self, index: u16, data: &[u8]) {
        let number = <[u8; 4]>::try_from(data).map(u32::from_le_bytes).map(Value::Unsigned32);
        Channel::write(self, index, number.unwrap_or_else(|_| bytes(data)));
    }

    fn frames(&self) -> u64 {
        self.frames
    }
}
