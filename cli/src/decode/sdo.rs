//! SDO transfers as seen by somebody who listens (CiA 301, 7.2.4): segments have no address, so what
//! they belong to has to be remembered.

use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::{ClientRequest, Content, ServerResponse};
use lexican_runtime::wire::sdo_block::BlockSegment;

use crate::values::wire::{fitting, parse};
use crate::values::{Known, hex, plain};

/// So many bytes of a transfer are kept; nobody reads more on a terminal.
const MAX_KEPT: usize = 4096;

/// One client and one server.
#[derive(Default)]
pub(crate) struct Channel {
    transfer: Option<Transfer>,
    /// Who sends the data of a block now; such frames have no command.
    block: Option<Side>,
}

/// The two ends of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Client,
    Server,
}

struct Transfer {
    address: Address,
    data: Vec<u8>,
    len: usize,
    last: bool,
}

impl Transfer {
    fn new(address: Address, data: &[u8]) -> Self {
        let mut transfer = Transfer { address, data: Vec::new(), len: 0, last: false };
        transfer.take(data);
        transfer
    }

    fn take(&mut self, data: &[u8]) {
        self.len += data.len();
        let room = MAX_KEPT.saturating_sub(self.data.len());
        self.data.extend(data.iter().take(room));
    }
}

/// What a frame says.
pub(crate) struct Said {
    pub(crate) text: String,
    pub(crate) abort: bool,
}

impl Channel {
    /// What a frame from `side` says; with the device known, by name and unit.
    pub(crate) fn decode(&mut self, side: Side, data: &[u8], known: Option<&mut Known<'_>>) -> Said {
        if data.len() != 8 {
            let text = format!("{} bytes: an SDO has 8", data.len());
            return Said { text, abort: false };
        }
        if self.block == Some(side)
            && let Some(segment) = BlockSegment::parse(data)
        {
            return self.block_segment(&segment);
        }
        match side {
            Side::Client => match ClientRequest::parse(data) {
                Some(request) => self.request(request, known),
                None => unknown_command(),
            },
            Side::Server => match ServerResponse::parse(data) {
                Some(response) => self.response(response, known),
                None => unknown_command(),
            },
        }
    }

    fn request(&mut self, request: ClientRequest, known: Option<&mut Known<'_>>) -> Said {
        let name = |address| name(address, known.as_deref());
        let text = match request {
            ClientRequest::InitiateUpload { address } => {
                *self = Channel { transfer: Some(Transfer::new(address, &[])), block: None };
                format!("read {}", name(address))
            }
            ClientRequest::InitiateDownload { address, content } => {
                let (data, text) = content_of(content);
                *self = Channel { transfer: Some(Transfer::new(address, data.as_deref().unwrap_or(&[]))), block: None };
                match data {
                    Some(data) => format!("write {} = {}", name(address), value(address, &data, known.as_deref())),
                    None => format!("write {}, {text}", name(address)),
                }
            }
            ClientRequest::DownloadSegment(segment) => {
                self.segment(segment.data(), segment.last, known.as_deref(), "write")
            }
            ClientRequest::UploadSegment { .. } => format!("next segment{}", self.of_what(known.as_deref())),
            ClientRequest::Abort(abort) => return self.abort(abort.address, abort.code, known.as_deref()),
            ClientRequest::InitiateBlockUpload { address, block_size, .. } => {
                *self = Channel { transfer: Some(Transfer::new(address, &[])), block: None };
                format!("read {} by blocks of {block_size}", name(address))
            }
            ClientRequest::StartBlockUpload => {
                self.block = Some(Side::Server);
                "start of the blocks".to_owned()
            }
            ClientRequest::ConfirmBlockUpload(it) => self.confirmed(it.sequence, it.block_size, Side::Server),
            ClientRequest::EndBlockUpload => format!("end of blocks confirmed{}", self.of_what(known.as_deref())),
            ClientRequest::InitiateBlockDownload { address, size, .. } => {
                *self = Channel { transfer: Some(Transfer::new(address, &[])), block: None };
                format!("write {} by blocks, {}", name(address), bytes_to_come(size))
            }
            ClientRequest::EndBlockDownload(_) => self.end_of_blocks(known.as_deref(), "write"),
        };
        Said { text, abort: false }
    }

    fn response(&mut self, response: ServerResponse, mut known: Option<&mut Known<'_>>) -> Said {
        let text = match response {
            ServerResponse::InitiateUpload { address, content } => {
                let (data, text) = content_of(content);
                let name = name(address, known.as_deref());
                match data {
                    Some(data) => {
                        learn(address, &data, known.as_deref_mut());
                        format!("{name} = {}", value(address, &data, known.as_deref()))
                    }
                    None => format!("{name}, {text}"),
                }
            }
            ServerResponse::InitiateDownload { address } => {
                if let Some(transfer) = &self.transfer {
                    learn(transfer.address, &transfer.data, known.as_deref_mut());
                }
                format!("taken {}", name(address, known.as_deref()))
            }
            ServerResponse::UploadSegment(segment) => {
                let text = self.segment(segment.data(), segment.last, known.as_deref(), "");
                if let Some(transfer) = self.transfer.as_ref().filter(|_| segment.last) {
                    learn(transfer.address, &transfer.data, known);
                }
                text
            }
            ServerResponse::DownloadSegment { .. } => format!("segment taken{}", self.of_what(known.as_deref())),
            ServerResponse::Abort(abort) => return self.abort(abort.address, abort.code, known.as_deref()),
            ServerResponse::InitiateBlockDownload { address, block_size, .. } => {
                self.block = Some(Side::Client);
                format!("ready for blocks of {block_size} of {}", name(address, known.as_deref()))
            }
            ServerResponse::ConfirmBlockDownload(it) => self.confirmed(it.sequence, it.block_size, Side::Client),
            ServerResponse::EndBlockDownload => format!("blocks taken{}", self.of_what(known.as_deref())),
            ServerResponse::InitiateBlockUpload { address, size, .. } => {
                format!("{} by blocks, {}", name(address, known.as_deref()), bytes_to_come(size))
            }
            ServerResponse::EndBlockUpload(_) => self.end_of_blocks(known.as_deref(), ""),
        };
        Said { text, abort: false }
    }

    fn segment(&mut self, data: &[u8], last: bool, known: Option<&Known<'_>>, verb: &str) -> String {
        let Some(transfer) = &mut self.transfer else { return format!("segment {}", hex(data)) };
        transfer.take(data);
        if last { self.whole(known, verb) } else { format!("segment, {} bytes so far", transfer.len) }
    }

    fn block_segment(&mut self, segment: &BlockSegment) -> Said {
        if let Some(transfer) = &mut self.transfer {
            transfer.take(segment.data());
            transfer.last = segment.last;
        }
        let last = if segment.last { ", the last" } else { "" };
        Said { text: format!("block segment {}{last}", segment.sequence()), abort: false }
    }

    /// A block was confirmed: the next one follows, unless it had the last segment.
    fn confirmed(&mut self, sequence: u8, block_size: u8, sender: Side) -> String {
        let last = self.transfer.as_ref().is_some_and(|transfer| transfer.last);
        self.block = (!last).then_some(sender);
        format!("{sequence} segments taken, next block of {block_size}")
    }

    fn end_of_blocks(&mut self, known: Option<&Known<'_>>, verb: &str) -> String {
        self.block = None;
        match &self.transfer {
            Some(_) => format!("end of blocks: {}", self.whole(known, verb)),
            None => "end of blocks".to_owned(),
        }
    }

    /// The entry and its value, now that all of it has been seen.
    fn whole(&self, known: Option<&Known<'_>>, verb: &str) -> String {
        let Some(transfer) = &self.transfer else { return String::new() };
        let value = if transfer.len > transfer.data.len() {
            format!("{} bytes", transfer.len)
        } else {
            value(transfer.address, &transfer.data, known)
        };
        let gap = if verb.is_empty() { "" } else { " " };
        format!("{verb}{gap}{} = {value}", name(transfer.address, known))
    }

    fn of_what(&self, known: Option<&Known<'_>>) -> String {
        self.transfer.as_ref().map(|transfer| format!(" of {}", name(transfer.address, known))).unwrap_or_default()
    }

    fn abort(&mut self, address: Address, code: lexican_runtime::AbortCode, known: Option<&Known<'_>>) -> Said {
        *self = Channel::default();
        Said { text: format!("abort {}: {code}", name(address, known)), abort: true }
    }
}

fn unknown_command() -> Said {
    Said { text: "unknown SDO command".to_owned(), abort: false }
}

/// The data that came at once, or what is to come.
fn content_of(content: Content) -> (Option<Vec<u8>>, String) {
    match content {
        Content::Expedited(expedited) => (Some(expedited.data().to_vec()), String::new()),
        Content::Segmented { size } => (None, bytes_to_come(size)),
    }
}

fn bytes_to_come(size: Option<u32>) -> String {
    size.map_or("size not told".to_owned(), |size| format!("{size} bytes to come"))
}

/// `6064:00 Position actual value`.
fn name(address: Address, known: Option<&Known<'_>>) -> String {
    let Some(known) = known else { return address.to_string() };
    let (object, entry) = (known.device.object(address.index()), known.device.entry(address.index(), address.sub()));
    match (object, entry) {
        (Some(object), Some(entry)) if object.entries.len() > 1 => format!("{address} {}, {}", object.name, entry.name),
        (_, Some(entry)) => format!("{address} {}", entry.name),
        _ => address.to_string(),
    }
}

/// The value by the data sheet; else the bytes, as text where they are text.
fn value(address: Address, data: &[u8], known: Option<&Known<'_>>) -> String {
    let entry = known.and_then(|known| Some((known, known.device.entry(address.index(), address.sub())?)));
    match entry {
        Some((known, entry)) => match parse(entry.data_type, fitting(entry.data_type, data)) {
            Some(value) => known.describe(entry, &value),
            None => hex(data),
        },
        None if data.len() > 4 && data.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ') => {
            plain(lexican_eds::types::DataType::VisibleString, &text(data))
        }
        None => hex(data),
    }
}

fn text(data: &[u8]) -> lexican_eds::model::Value {
    lexican_eds::model::Value::Text(String::from_utf8_lossy(data).into_owned())
}

fn learn(address: Address, data: &[u8], known: Option<&mut Known<'_>>) {
    let Some(known) = known else { return };
    let Some(entry) = known.device.entry(address.index(), address.sub()) else { return };
    if let Some(value) = parse(entry.data_type, fitting(entry.data_type, data)) {
        known.learn(address.index(), address.sub(), &value);
    }
}
