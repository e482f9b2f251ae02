//! canopen-sdo: frames with identifier, checked on both sides, and deadlines, as ours. It knows no blocks, and no
//! lengths of frames. Its server keeps the whole object in a buffer of a size fixed for all objects: it gets the
//! smallest that the case allows. Its client allocates what is read.
//!
//! The dictionary is the user's affair. This one does what ours does: finds a row by binary search, checks access
//! right and length.

use std::hint::black_box;

use canopen_sdo::{ObjectDictionary, SdoAbortCode, SdoClient, SdoConfig, SdoOutcome, SdoServer, ServerConfig};

use super::transfer::{Case, Direction, Indices, Kind, Transfer, bytes_index, check, pattern};
use crate::measure::{self, Contender};

const NODE: u8 = 5;

pub(super) fn contender(case: Case) -> Option<Contender> {
    match case.kind {
        Kind::Expedited { .. } => Some(race::<8>(case)),
        Kind::Segmented { len: 32 } => Some(race::<32>(case)),
        Kind::Segmented { len: 1200 } => Some(race::<1200>(case)),
        Kind::Segmented { .. } | Kind::Block { .. } => None,
    }
}

fn race<const N: usize>(case: Case) -> Contender {
    let mut channel = Channel::<N>::new(case);
    let frames = check(case, &mut channel);
    let name = "canopen-sdo 0.2.0";
    let contender = match (case.kind, case.direction) {
        (Kind::Expedited { objects }, Direction::Read) => {
            let mut indices = Indices::new(objects);
            Contender::new(name, move || {
                let bytes = channel.read(indices.next());
                black_box(u32::from_le_bytes(bytes.try_into().expect("the server sent four bytes")));
            })
        }
        (Kind::Expedited { objects }, Direction::Write) => {
            let mut indices = Indices::new(objects);
            let mut value = 0_u32;
            Contender::new(name, move || {
                value = value.wrapping_add(1);
                channel.write(indices.next(), &black_box(value).to_le_bytes());
            })
        }
        (Kind::Segmented { len } | Kind::Block { len }, Direction::Read) => Contender::new(name, move || {
            black_box(channel.read(bytes_index(len)));
        }),
        (Kind::Segmented { len } | Kind::Block { len }, Direction::Write) => {
            let buffer = pattern(len, 0);
            Contender::new(name, move || channel.write(bytes_index(len), black_box(&buffer)))
        }
    };
    contender.with_frames(frames)
}

struct Channel<const N: usize> {
    client: SdoClient,
    server: SdoServer<N>,
    od: Dictionary,
    now: u64,
    frames: u64,
}

impl<const N: usize> Channel<N> {
    fn new(case: Case) -> Self {
        Channel {
            client: SdoClient::new(SdoConfig::default()),
            server: SdoServer::new(ServerConfig::new(NODE)),
            od: Dictionary::new(case.kind),
            now: 0,
            frames: 0,
        }
    }

    fn read(&mut self, index: u16) -> Vec<u8> {
        self.now += 1000;
        self.client.begin_upload(NODE, index, 0, self.now).expect("the transfer before is over");
        match self.exchange() {
            SdoOutcome::UploadCompleted(data) => data,
            SdoOutcome::DownloadCompleted => unreachable!("this was a read"),
        }
    }

    fn write(&mut self, index: u16, data: &[u8]) {
        self.now += 1000;
        self.client.begin_download(NODE, index, 0, data, self.now).expect("the transfer before is over");
        black_box(self.exchange());
    }

    fn exchange(&mut self) -> SdoOutcome {
        loop {
            while let Some(frame) = self.client.poll_transmit() {
                self.frames += 1;
                self.server.handle_frame(black_box(frame), self.now, &mut self.od).expect("the server aborts nothing");
            }
            while let Some(frame) = self.server.poll_transmit() {
                self.frames += 1;
                let outcome = self.client.handle_frame(black_box(frame), self.now);
                if let Some(outcome) = outcome.expect("the client aborts nothing") {
                    return outcome;
                }
            }
        }
    }
}

impl<const N: usize> Transfer for Channel<N> {
    fn read(&mut self, index: u16, _len: usize) -> Vec<u8> {
        Channel::read(self, index)
    }

    fn write(&mut self, index: u16, data: &[u8]) {
        Channel::write(self, index, data);
    }

    fn frames(&self) -> u64 {
        self.frames
    }
}

struct Dictionary {
    rows: Vec<Row>,
    image: Vec<u8>,
}

struct Row {
    address: (u16, u8),
    is_readable: bool,
    is_writable: bool,
    start: usize,
    len: usize,
}

impl Dictionary {
    fn new(kind: Kind) -> Self {
        measure::scatter();
        let row = |index, at, len| {
            let (is_readable, is_writable) = black_box((true, true));
            Row { address: (index, 0), is_readable, is_writable, start: at * len, len }
        };
        let rows: Vec<Row> = match kind {
            Kind::Expedited { objects } => (0..objects).map(|at| row(0x2000 + at, usize::from(at), 4)).collect(),
            Kind::Segmented { len } | Kind::Block { len } => vec![row(bytes_index(len), 0, len)],
        };
        let image = vec![0; rows.iter().map(|row| row.len).sum()];
        Dictionary { rows, image }
    }

    fn row(&self, index: u16, sub: u8) -> Result<&Row, SdoAbortCode> {
        let found = self.rows.binary_search_by_key(&(index, sub), |row| row.address);
        found.map(|at| &self.rows[at]).map_err(|_| SdoAbortCode::ObjectDoesNotExist)
    }
}

impl ObjectDictionary for Dictionary {
    fn read(&mut self, index: u16, sub: u8, buffer: &mut [u8]) -> Result<usize, SdoAbortCode> {
        let row = self.row(index, sub)?;
        if !row.is_readable {
            return Err(SdoAbortCode::ReadWriteOnly);
        }
        let room = buffer.get_mut(..row.len).ok_or(SdoAbortCode::OutOfMemory)?;
        room.copy_from_slice(&self.image[row.start..row.start + row.len]);
        Ok(row.len)
    }

    fn write(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), SdoAbortCode> {
        let row = self.row(index, sub)?;
        if !row.is_writable {
            return Err(SdoAbortCode::WriteReadOnly);
        }
        if data.len() != row.len {
            return Err(SdoAbortCode::DataTypeLengthMismatch);
        }
        let (start, end) = (row.start, row.start + row.len);
        self.image[start..end].copy_from_slice(data);
        Ok(())
    }
}
