//! Decodes SDO transfers from the outside (CiA 301, 7.2.4). Segments carry no address, so a [`Channel`] remembers the
//! current transfer.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::{ClientRequest, Content, Segment, ServerResponse};
use lexican_runtime::wire::sdo_block::BlockSegment;

use super::decoded::{Sdo, Side, Step};
use crate::values::report::ValueReport;
use crate::values::{DeviceValues, hex};

/// The most bytes of a transfer that are kept to be shown.
const MAX_KEPT: usize = 4096;

const EXPEDITED: &str = "expedited";
const SEGMENTED: &str = "segmented";
const BLOCK: &str = "block";

/// The frame as text and fields.
type Text = (String, Sdo);
/// The device, if it is known.
type Device<'d> = Option<&'d DeviceValues<'d>>;

/// The state of one client and its server.
#[derive(Default)]
pub(super) struct Channel {
    transfer: Option<Transfer>,
    /// The side that sends the segments of a block; these have no command specifier.
    block: Option<Side>,
}

struct Transfer {
    address: Address,
    writes: bool,
    /// `expedited`, `segmented` or `block`; `None` until the server has responded to an upload.
    kind: Option<&'static str>,
    data: Vec<u8>,
    /// The number of bytes so far, of which at most [`MAX_KEPT`] are in `data`.
    len: usize,
    /// The number of bytes before the current block: unconfirmed segments are sent again.
    confirmed: usize,
    last: bool,
}

impl Transfer {
    fn new(address: Address, writes: bool, kind: Option<&'static str>) -> Self {
        Transfer { address, writes, kind, data: Vec::new(), len: 0, confirmed: 0, last: false }
    }

    fn take(&mut self, data: &[u8], last: bool) {
        self.len += data.len();
        let room = MAX_KEPT.saturating_sub(self.data.len());
        self.data.extend(data.iter().take(room));
        self.last = last;
    }

    /// Drops all bytes after the first `len`.
    fn truncate(&mut self, len: usize) {
        self.last &= len >= self.len;
        self.len = self.len.min(len);
        self.confirmed = self.len;
        self.data.truncate(self.len);
    }

    /// The entry and its value, at the end of the transfer.
    fn report(&self, device: Device<'_>) -> ValueReport {
        if self.len == self.data.len() {
            return ValueReport::of_bytes(device, self.address, &self.data);
        }
        let text = Some(format!("{} bytes", self.len));
        ValueReport { text, ..ValueReport::without_value(device, self.address) }
    }
}

impl Channel {
    /// Decodes a frame from `side`.
    pub(super) fn decode(&mut self, side: Side, data: &[u8], device: Option<&mut DeviceValues<'_>>) -> Text {
        let unknown = |text: String| (text, Sdo::new(side, Step::Unknown));
        if data.len() != 8 {
            return unknown(format!("{} bytes: an SDO has 8", data.len()));
        }
        if self.block == Some(side)
            && let Some(segment) = BlockSegment::parse(data)
        {
            return self.block_segment(side, &segment);
        }
        let decoded = match side {
            Side::Client => ClientRequest::parse(data).map(|request| self.request(request, device.as_deref())),
            Side::Server => ServerResponse::parse(data).map(|response| {
                let decoded = self.response(response, device.as_deref());
                // The entry has this value now. The client need not confirm the end of an upload.
                let sdo = &decoded.1;
                let is_over = sdo.complete && sdo.abort.is_none() || sdo.step == Step::EndBlockUpload;
                if let (Some(device), Some(report)) = (device, sdo.report.as_ref().filter(|_| is_over))
                    && let Some(value) = &report.value
                {
                    device.set(report.address, value);
                }
                decoded
            }),
        };
        decoded.unwrap_or_else(|| unknown("unknown SDO command".to_owned()))
    }

    fn request(&mut self, request: ClientRequest, device: Device<'_>) -> Text {
        match request {
            ClientRequest::InitiateUpload { address } => {
                let sdo = self.begin(Step::InitiateUpload, Transfer::new(address, false, None), device);
                (format!("read {}", sdo.title()), sdo)
            }
            ClientRequest::InitiateDownload { address, content } => {
                let transfer = Transfer::new(address, true, Some(kind(content)));
                let mut sdo = self.begin(Step::InitiateDownload, transfer, device);
                if let (Content::Expedited(expedited), Some(transfer)) = (content, &mut self.transfer) {
                    transfer.take(expedited.data(), false);
                }
                let text = self.content(&mut sdo, address, content, device);
                (format!("write {text}"), sdo)
            }
            ClientRequest::DownloadSegment(segment) => {
                self.segment(Side::Client, Step::DownloadSegment, segment, device)
            }
            ClientRequest::UploadSegment { toggle } => {
                let sdo = Sdo { toggle: Some(toggle), ..self.sdo(Side::Client, Step::UploadSegment, device) };
                (sdo.of_title("next segment"), sdo)
            }
            ClientRequest::Abort(abort) => self.abort(Side::Client, abort.address, abort.code, device),
            ClientRequest::InitiateBlockUpload { address, block_size, .. } => {
                let transfer = Transfer::new(address, false, Some(BLOCK));
                let sdo = self.begin(Step::InitiateBlockUpload, transfer, device);
                let text = format!("read {} by blocks of {block_size}", sdo.title());
                (text, Sdo { block_size: Some(block_size), ..sdo })
            }
            ClientRequest::StartBlockUpload => {
                self.block = Some(Side::Server);
                ("start of the blocks".to_owned(), self.sdo(Side::Client, Step::StartBlockUpload, device))
            }
            ClientRequest::ConfirmBlockUpload(it) => {
                self.confirm(Side::Client, Step::ConfirmBlockUpload, it.sequence, it.block_size, device)
            }
            ClientRequest::EndBlockUpload => {
                let sdo = Sdo { complete: true, ..self.sdo(Side::Client, Step::EndBlockUpload, device) };
                (sdo.of_title("end of blocks confirmed"), sdo)
            }
            ClientRequest::InitiateBlockDownload { address, size, .. } => {
                let transfer = Transfer::new(address, true, Some(BLOCK));
                let sdo = Sdo { size, ..self.begin(Step::InitiateBlockDownload, transfer, device) };
                (format!("write {} by blocks, {}", sdo.title(), announced(size)), sdo)
            }
            ClientRequest::EndBlockDownload(end) => {
                self.end_of_blocks(Side::Client, Step::EndBlockDownload, end.unused(), device)
            }
        }
    }

    fn response(&mut self, response: ServerResponse, device: Device<'_>) -> Text {
        match response {
            ServerResponse::InitiateUpload { address, content } => {
                if let Some(transfer) = &mut self.transfer {
                    transfer.kind = Some(kind(content));
                }
                let mut sdo = Sdo {
                    transfer: Some(kind(content)),
                    writes: Some(false),
                    complete: matches!(content, Content::Expedited(_)),
                    ..self.sdo(Side::Server, Step::InitiateUpload, device)
                };
                (self.content(&mut sdo, address, content, device), sdo)
            }
            ServerResponse::InitiateDownload { address } => {
                let is_mine = |transfer: &&Transfer| transfer.kind == Some(EXPEDITED) && transfer.address == address;
                // The response ends an expedited transfer and begins a segmented one.
                let expedited = self.transfer.as_ref().filter(is_mine);
                let report = expedited.map(|transfer| transfer.report(device));
                let sdo = Sdo {
                    complete: report.is_some(),
                    writes: Some(true),
                    report: report.or_else(|| Some(ValueReport::without_value(device, address))),
                    ..self.sdo(Side::Server, Step::InitiateDownload, device)
                };
                (format!("taken {}", sdo.title()), sdo)
            }
            ServerResponse::UploadSegment(segment) => self.segment(Side::Server, Step::UploadSegment, segment, device),
            ServerResponse::DownloadSegment { toggle } => {
                let sdo = Sdo { toggle: Some(toggle), ..self.sdo(Side::Server, Step::DownloadSegment, device) };
                let text = sdo.of_title("segment taken");
                match self.transfer.as_ref().filter(|transfer| transfer.last) {
                    Some(transfer) => (text, Sdo { report: Some(transfer.report(device)), complete: true, ..sdo }),
                    None => (text, sdo),
                }
            }
            ServerResponse::Abort(abort) => self.abort(Side::Server, abort.address, abort.code, device),
            ServerResponse::InitiateBlockDownload { address, block_size, .. } => {
                self.block = Some(Side::Client);
                let sdo = Sdo {
                    report: Some(ValueReport::without_value(device, address)),
                    block_size: Some(block_size),
                    ..self.sdo(Side::Server, Step::InitiateBlockDownload, device)
                };
                (format!("ready for blocks of {block_size} of {}", sdo.title()), sdo)
            }
            ServerResponse::ConfirmBlockDownload(it) => {
                self.confirm(Side::Server, Step::ConfirmBlockDownload, it.sequence, it.block_size, device)
            }
            ServerResponse::EndBlockDownload => {
                let sdo = self.sdo(Side::Server, Step::EndBlockDownload, device);
                let report = self.transfer.as_ref().map(|transfer| transfer.report(device));
                (sdo.of_title("blocks taken"), Sdo { report, complete: true, ..sdo })
            }
            ServerResponse::InitiateBlockUpload { address, size, .. } => {
                let report = Some(ValueReport::without_value(device, address));
                let sdo = Sdo { report, size, ..self.sdo(Side::Server, Step::InitiateBlockUpload, device) };
                (format!("{} by blocks, {}", sdo.title(), announced(size)), sdo)
            }
            ServerResponse::EndBlockUpload(end) => {
                self.end_of_blocks(Side::Server, Step::EndBlockUpload, end.unused(), device)
            }
        }
    }

    /// Begins a transfer.
    fn begin(&mut self, step: Step, transfer: Transfer, device: Device<'_>) -> Sdo {
        *self = Channel { transfer: Some(transfer), block: None };
        self.sdo(Side::Client, step, device)
    }

    /// The fields of a frame in the current transfer.
    fn sdo(&self, side: Side, step: Step, device: Device<'_>) -> Sdo {
        let sdo = Sdo::new(side, step);
        let Some(transfer) = &self.transfer else { return sdo };
        let report = Some(ValueReport::without_value(device, transfer.address));
        Sdo { report, writes: Some(transfer.writes), transfer: transfer.kind, ..sdo }
    }

    /// The value in an initiation, or the number of bytes to follow.
    fn content(&self, sdo: &mut Sdo, address: Address, content: Content, device: Device<'_>) -> String {
        match content {
            Content::Expedited(expedited) => {
                let report = ValueReport::of_bytes(device, address, expedited.data());
                sdo.report.insert(report).equation()
            }
            Content::Segmented { size } => {
                sdo.size = size;
                let report = sdo.report.insert(ValueReport::without_value(device, address));
                format!("{}, {}", report.title(), announced(size))
            }
        }
    }

    fn segment(&mut self, side: Side, step: Step, segment: Segment, device: Device<'_>) -> Text {
        let (toggle, last) = (Some(segment.toggle), Some(segment.last));
        let Some(transfer) = &mut self.transfer else {
            return (format!("segment {}", hex(segment.data())), Sdo { toggle, last, ..Sdo::new(side, step) });
        };
        transfer.take(segment.data(), segment.last);
        let len = transfer.len;
        let mut sdo = Sdo { toggle, last, ..self.sdo(side, step, device) };
        if !segment.last {
            return (format!("segment, {len} bytes so far"), sdo);
        }
        // A download ends with the server's response.
        sdo.complete = side == Side::Server;
        (self.whole(&mut sdo, device), sdo)
    }

    fn block_segment(&mut self, side: Side, segment: &BlockSegment) -> Text {
        if let Some(transfer) = &mut self.transfer {
            transfer.take(segment.data(), segment.is_last());
        }
        let last = if segment.is_last() { ", the last" } else { "" };
        let (sequence, is_last) = (Some(segment.sequence()), Some(segment.is_last()));
        let sdo = Sdo { sequence, last: is_last, ..self.sdo(side, Step::BlockSegment, None) };
        (format!("block segment {}{last}", segment.sequence()), sdo)
    }

    /// The end of a block: the next one follows, unless it had the last segment.
    fn confirm(&mut self, side: Side, step: Step, sequence: u8, block_size: u8, device: Device<'_>) -> Text {
        let is_last = self.transfer.as_mut().is_some_and(|transfer| {
            transfer.truncate(transfer.confirmed + 7 * usize::from(sequence));
            transfer.last
        });
        let sender = if side == Side::Client { Side::Server } else { Side::Client };
        self.block = (!is_last).then_some(sender);
        let text = format!("{sequence} segments taken, next block of {block_size}");
        (text, Sdo { sequence: Some(sequence), block_size: Some(block_size), ..self.sdo(side, step, device) })
    }

    fn end_of_blocks(&mut self, side: Side, step: Step, unused: u8, device: Device<'_>) -> Text {
        self.block = None;
        let Some(transfer) = &mut self.transfer else {
            return ("end of blocks".to_owned(), Sdo::new(side, step));
        };
        transfer.truncate(transfer.len.saturating_sub(unused.into()));
        let mut sdo = self.sdo(side, step, device);
        (format!("end of blocks: {}", self.whole(&mut sdo, device)), sdo)
    }

    /// `write 2001:00 Name = "text"`; an upload has no verb.
    fn whole(&self, sdo: &mut Sdo, device: Device<'_>) -> String {
        let Some(transfer) = &self.transfer else { return String::new() };
        let verb = if transfer.writes { "write " } else { "" };
        format!("{verb}{}", sdo.report.insert(transfer.report(device)).equation())
    }

    fn abort(&mut self, side: Side, address: Address, code: AbortCode, device: Device<'_>) -> Text {
        let report = Some(ValueReport::without_value(device, address));
        let sdo = Sdo { report, abort: Some(code), complete: true, ..self.sdo(side, Step::Abort, device) };
        *self = Channel::default();
        (format!("abort {}: {code}", sdo.title()), sdo)
    }
}

impl Sdo {
    fn title(&self) -> String {
        self.report.as_ref().map(ValueReport::title).unwrap_or_default()
    }

    /// `segment taken of 2001:00 Name`.
    fn of_title(&self, text: &str) -> String {
        self.report.as_ref().map_or_else(|| text.to_owned(), |report| format!("{text} of {}", report.title()))
    }
}

fn kind(content: Content) -> &'static str {
    match content {
        Content::Expedited(_) => EXPEDITED,
        Content::Segmented { .. } => SEGMENTED,
    }
}

fn announced(size: Option<u32>) -> String {
    size.map_or("size not announced".to_owned(), |size| format!("{size} bytes to come"))
}
