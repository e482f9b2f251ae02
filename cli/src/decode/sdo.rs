//! SDO transfers as seen by somebody who listens (CiA 301, 7.2.4): segments have no address, so what
//! they belong to has to be remembered.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::{ClientRequest, Content, Segment, ServerResponse};
use lexican_runtime::wire::sdo_block::BlockSegment;

use super::detail::{Sdo, Side, Step};
use crate::values::told::Told;
use crate::values::{Known, hex};

/// So many bytes of a transfer are kept; nobody reads more on a terminal.
const MAX_KEPT: usize = 4096;

/// One client and one server.
#[derive(Default)]
pub(crate) struct Channel {
    transfer: Option<Transfer>,
    /// Who sends the data of a block now; such frames have no command.
    block: Option<Side>,
}

struct Transfer {
    address: Address,
    writes: bool,
    /// `expedited`, `segmented` or `block`; unknown until the server has answered a read.
    kind: Option<&'static str>,
    data: Vec<u8>,
    len: usize,
    /// Of a block transfer: what was there before this block. What is not confirmed is sent again.
    confirmed: usize,
    last: bool,
}

impl Transfer {
    fn new(address: Address, writes: bool, kind: Option<&'static str>) -> Self {
        Transfer { address, writes, kind, data: Vec::new(), len: 0, confirmed: 0, last: false }
    }

    fn take(&mut self, data: &[u8]) {
        self.len += data.len();
        let room = MAX_KEPT.saturating_sub(self.data.len());
        self.data.extend(data.iter().take(room));
    }

    /// The other side has so many bytes, and no others.
    fn cut(&mut self, len: usize) {
        self.last &= len >= self.len;
        self.len = self.len.min(len);
        self.confirmed = self.len;
        self.data.truncate(self.len);
    }

    /// The entry and its value, now that all of it has been seen.
    fn whole(&self, known: Option<&Known<'_>>) -> Told {
        if self.len == self.data.len() {
            return Told::transferred(known, self.address, &self.data);
        }
        let told = Told::entry(known, self.address);
        Told { text: Some(format!("{} bytes", self.len)), ..told }
    }
}

/// What a frame says, in words and in parts.
pub(crate) struct Said {
    pub(crate) text: String,
    pub(crate) detail: Sdo,
}

impl Channel {
    /// What a frame from `side` says; with the device known, by name and unit.
    pub(crate) fn decode(&mut self, side: Side, data: &[u8], known: Option<&mut Known<'_>>) -> Said {
        let unknown = |text: String| Said { text, detail: Sdo::new(side, Step::Unknown) };
        if data.len() != 8 {
            return unknown(format!("{} bytes: an SDO has 8", data.len()));
        }
        if self.block == Some(side)
            && let Some(segment) = BlockSegment::parse(data)
        {
            return self.block_segment(side, &segment);
        }
        let said = match side {
            Side::Client => ClientRequest::parse(data).map(|request| self.request(request, known)),
            Side::Server => ServerResponse::parse(data).map(|response| self.response(response, known)),
        };
        said.unwrap_or_else(|| unknown("unknown SDO command".to_owned()))
    }

    fn request(&mut self, request: ClientRequest, known: Option<&mut Known<'_>>) -> Said {
        let known = known.as_deref();
        match request {
            ClientRequest::InitiateUpload { address } => {
                let mut said = self.begin(Step::InitiateUpload, Transfer::new(address, false, None), known);
                said.text = format!("read {}", said.title());
                said
            }
            ClientRequest::InitiateDownload { address, content } => self.initiate_download(address, content, known),
            ClientRequest::DownloadSegment(segment) => {
                self.segment(Side::Client, Step::DownloadSegment, segment, known)
            }
            ClientRequest::UploadSegment { toggle } => {
                let said = self.of_transfer(Side::Client, Step::UploadSegment, "next segment", known);
                said.with(|sdo| sdo.toggle = Some(toggle))
            }
            ClientRequest::Abort(abort) => self.abort(Side::Client, abort.address, abort.code, known),
            ClientRequest::InitiateBlockUpload { address, block_size, .. } => {
                let transfer = Transfer::new(address, false, Some(BLOCK));
                let mut said = self.begin(Step::InitiateBlockUpload, transfer, known);
                said.text = format!("read {} by blocks of {block_size}", said.title());
                said.with(|sdo| sdo.block_size = Some(block_size))
            }
            ClientRequest::StartBlockUpload => {
                self.block = Some(Side::Server);
                let said = self.of_transfer(Side::Client, Step::StartBlockUpload, "", known);
                Said { text: "start of the blocks".to_owned(), ..said }
            }
            ClientRequest::ConfirmBlockUpload(it) => {
                self.confirmed(Side::Client, Step::ConfirmBlockUpload, it.sequence, it.block_size, known)
            }
            ClientRequest::EndBlockUpload => {
                let said = self.of_transfer(Side::Client, Step::EndBlockUpload, "end of blocks confirmed", known);
                said.with(|sdo| sdo.complete = true)
            }
            ClientRequest::InitiateBlockDownload { address, size, .. } => {
                let transfer = Transfer::new(address, true, Some(BLOCK));
                let mut said = self.begin(Step::InitiateBlockDownload, transfer, known);
                said.text = format!("write {} by blocks, {}", said.title(), bytes_to_come(size));
                said.with(|sdo| sdo.size = size)
            }
            ClientRequest::EndBlockDownload(end) => {
                self.end_of_blocks(Side::Client, Step::EndBlockDownload, end.unused(), known)
            }
        }
    }

    fn response(&mut self, response: ServerResponse, known: Option<&mut Known<'_>>) -> Said {
        let said = match response {
            ServerResponse::InitiateUpload { address, content } => {
                self.initiate_upload(address, content, known.as_deref())
            }
            ServerResponse::InitiateDownload { address } => self.initiated_download(address, known.as_deref()),
            ServerResponse::UploadSegment(segment) => {
                self.segment(Side::Server, Step::UploadSegment, segment, known.as_deref())
            }
            ServerResponse::DownloadSegment { toggle } => {
                let mut said = self.of_transfer(Side::Server, Step::DownloadSegment, "segment taken", known.as_deref());
                if let Some(transfer) = self.transfer.as_ref().filter(|transfer| transfer.last) {
                    said.detail.told = Some(transfer.whole(known.as_deref()));
                    said.detail.complete = true;
                }
                said.with(|sdo| sdo.toggle = Some(toggle))
            }
            ServerResponse::Abort(abort) => self.abort(Side::Server, abort.address, abort.code, known.as_deref()),
            ServerResponse::InitiateBlockDownload { address, block_size, .. } => {
                self.block = Some(Side::Client);
                let mut said = self.of_transfer(Side::Server, Step::InitiateBlockDownload, "", known.as_deref());
                said.detail.told = Some(Told::entry(known.as_deref(), address));
                said.text = format!("ready for blocks of {block_size} of {}", said.title());
                said.with(|sdo| sdo.block_size = Some(block_size))
            }
            ServerResponse::ConfirmBlockDownload(it) => {
                self.confirmed(Side::Server, Step::ConfirmBlockDownload, it.sequence, it.block_size, known.as_deref())
            }
            ServerResponse::EndBlockDownload => {
                let mut said = self.of_transfer(Side::Server, Step::EndBlockDownload, "blocks taken", known.as_deref());
                said.detail.told = self.transfer.as_ref().map(|transfer| transfer.whole(known.as_deref()));
                said.with(|sdo| sdo.complete = true)
            }
            ServerResponse::InitiateBlockUpload { address, size, .. } => {
                let mut said = self.of_transfer(Side::Server, Step::InitiateBlockUpload, "", known.as_deref());
                said.detail.told = Some(Told::entry(known.as_deref(), address));
                said.text = format!("{} by blocks, {}", said.title(), bytes_to_come(size));
                said.with(|sdo| sdo.size = size)
            }
            ServerResponse::EndBlockUpload(end) => {
                self.end_of_blocks(Side::Server, Step::EndBlockUpload, end.unused(), known.as_deref())
            }
        };
        // What the server has told or taken is what its entry holds now.
        let settled = said.detail.complete && said.detail.abort.is_none();
        let told =
            said.detail.told.as_ref().filter(|_| settled || matches!(response, ServerResponse::EndBlockUpload(_)));
        if let (Some(known), Some(Told { address, value: Some(value), .. })) = (known, told) {
            known.learn(address.index(), address.sub(), value);
        }
        said
    }

    /// A client begins a transfer.
    fn begin(&mut self, step: Step, transfer: Transfer, known: Option<&Known<'_>>) -> Said {
        *self = Channel { transfer: Some(transfer), block: None };
        self.of_transfer(Side::Client, step, "", known)
    }

    fn initiate_download(&mut self, address: Address, content: Content, known: Option<&Known<'_>>) -> Said {
        let kind = match content {
            Content::Expedited(_) => EXPEDITED,
            Content::Segmented { .. } => SEGMENTED,
        };
        let mut said = self.begin(Step::InitiateDownload, Transfer::new(address, true, Some(kind)), known);
        match content {
            Content::Expedited(expedited) => {
                self.transfer.iter_mut().for_each(|transfer| transfer.take(expedited.data()));
                let told = Told::transferred(known, address, expedited.data());
                said.text = format!("write {} = {}", told.title(), told.words());
                said.detail.told = Some(told);
            }
            Content::Segmented { size } => {
                said.text = format!("write {}, {}", said.title(), bytes_to_come(size));
                said.detail.size = size;
            }
        }
        said
    }

    fn initiated_download(&mut self, address: Address, known: Option<&Known<'_>>) -> Said {
        let mut said = self.of_transfer(Side::Server, Step::InitiateDownload, "", known);
        // What was expedited is taken with this; of segments, none has come yet.
        let expedited =
            self.transfer.as_ref().filter(|transfer| transfer.kind == Some(EXPEDITED) && transfer.address == address);
        said.detail.complete = expedited.is_some();
        said.detail.writes = Some(true);
        let told = expedited.map_or_else(|| Told::entry(known, address), |transfer| transfer.whole(known));
        said.text = format!("taken {}", told.title());
        said.detail.told = Some(told);
        said
    }

    fn initiate_upload(&mut self, address: Address, content: Content, known: Option<&Known<'_>>) -> Said {
        let kind = match content {
            Content::Expedited(_) => EXPEDITED,
            Content::Segmented { .. } => SEGMENTED,
        };
        if let Some(transfer) = &mut self.transfer {
            transfer.kind = Some(kind);
        }
        let mut said = self.of_transfer(Side::Server, Step::InitiateUpload, "", known);
        said.detail.transfer = Some(kind);
        said.detail.writes = Some(false);
        match content {
            Content::Expedited(expedited) => {
                let told = Told::transferred(known, address, expedited.data());
                said.text = format!("{} = {}", told.title(), told.words());
                said.detail.told = Some(told);
                said.detail.complete = true;
            }
            Content::Segmented { size } => {
                said.detail.told = Some(Told::entry(known, address));
                said.text = format!("{}, {}", said.title(), bytes_to_come(size));
                said.detail.size = size;
            }
        }
        said
    }

    fn segment(&mut self, side: Side, step: Step, segment: Segment, known: Option<&Known<'_>>) -> Said {
        let Some(transfer) = &mut self.transfer else {
            let detail = Sdo { toggle: Some(segment.toggle), last: Some(segment.last), ..Sdo::new(side, step) };
            return Said { text: format!("segment {}", hex(segment.data())), detail };
        };
        transfer.take(segment.data());
        transfer.last = segment.last;
        let so_far = transfer.len;
        let mut said = self.of_transfer(side, step, "", known);
        if segment.last {
            self.tell_whole(&mut said, known);
            // Of a write, the answer is still to come.
            said.detail.complete = side == Side::Server;
        } else {
            said.text = format!("segment, {so_far} bytes so far");
        }
        said.with(|sdo| (sdo.toggle, sdo.last) = (Some(segment.toggle), Some(segment.last)))
    }

    fn block_segment(&mut self, side: Side, segment: &BlockSegment) -> Said {
        if let Some(transfer) = &mut self.transfer {
            transfer.take(segment.data());
            transfer.last = segment.last;
        }
        let last = if segment.last { ", the last" } else { "" };
        let mut said = self.of_transfer(side, Step::BlockSegment, "", None);
        said.text = format!("block segment {}{last}", segment.sequence());
        said.with(|sdo| (sdo.sequence, sdo.last) = (Some(segment.sequence()), Some(segment.last)))
    }

    /// A block was confirmed: the next one follows, unless it had the last segment.
    fn confirmed(&mut self, side: Side, step: Step, sequence: u8, block_size: u8, known: Option<&Known<'_>>) -> Said {
        let last = self.transfer.as_mut().is_some_and(|transfer| {
            transfer.cut(transfer.confirmed + 7 * usize::from(sequence));
            transfer.last
        });
        let sender = if side == Side::Client { Side::Server } else { Side::Client };
        self.block = (!last).then_some(sender);
        let said = self.of_transfer(side, step, "", known);
        let said = said.with(|sdo| (sdo.sequence, sdo.block_size) = (Some(sequence), Some(block_size)));
        Said { text: format!("{sequence} segments taken, next block of {block_size}"), ..said }
    }

    fn end_of_blocks(&mut self, side: Side, step: Step, unused: u8, known: Option<&Known<'_>>) -> Said {
        self.block = None;
        if let Some(transfer) = &mut self.transfer {
            transfer.cut(transfer.len.saturating_sub(unused.into()));
        }
        let mut said = self.of_transfer(side, step, "", known);
        if self.transfer.is_some() {
            self.tell_whole(&mut said, known);
            said.text = format!("end of blocks: {}", said.text);
        } else {
            "end of blocks".clone_into(&mut said.text);
        }
        said
    }

    /// `write 2001:00 Name = "text"`; of a read without the verb.
    fn tell_whole(&self, said: &mut Said, known: Option<&Known<'_>>) {
        let Some(transfer) = &self.transfer else { return };
        let told = transfer.whole(known);
        let verb = if transfer.writes { "write " } else { "" };
        said.text = format!("{verb}{} = {}", told.title(), told.words());
        said.detail.told = Some(told);
    }

    /// A frame that belongs to the transfer that is going on.
    fn of_transfer(&self, side: Side, step: Step, text: &str, known: Option<&Known<'_>>) -> Said {
        let mut detail = Sdo::new(side, step);
        let mut text = text.to_owned();
        if let Some(transfer) = &self.transfer {
            let told = Told::entry(known, transfer.address);
            text += &format!(" of {}", told.title());
            detail.told = Some(told);
            detail.writes = Some(transfer.writes);
            detail.transfer = transfer.kind;
        }
        Said { text, detail }
    }

    fn abort(&mut self, side: Side, address: Address, code: AbortCode, known: Option<&Known<'_>>) -> Said {
        let mut said = self.of_transfer(side, Step::Abort, "", known);
        *self = Channel::default();
        said.detail.told = Some(Told::entry(known, address));
        said.text = format!("abort {}: {code}", said.title());
        said.with(|sdo| (sdo.abort, sdo.complete) = (Some(code), true))
    }
}

const EXPEDITED: &str = "expedited";
const SEGMENTED: &str = "segmented";
const BLOCK: &str = "block";

impl Said {
    fn title(&self) -> String {
        self.detail.told.as_ref().map(Told::title).unwrap_or_default()
    }

    fn with<T>(mut self, change: impl FnOnce(&mut Sdo) -> T) -> Self {
        change(&mut self.detail);
        self
    }
}

fn bytes_to_come(size: Option<u32>) -> String {
    size.map_or("size not told".to_owned(), |size| format!("{size} bytes to come"))
}
