//! The trace: the newest million frames with their texts, by row number.

use std::collections::{BTreeMap, VecDeque};

use lexican_runtime::object::Address;
use lexican_runtime::{Frame, Instant, NodeId};
use lexican_toolbox::bus::filter::Filter;
use lexican_toolbox::decode::{Decoded, Detail, Service, Step};
use lexican_toolbox::values::hex;

use crate::view::Row;

/// The rows of a chunk; the oldest chunk is dropped as a whole.
const CHUNK: usize = 4096;

/// The rows that one step of a search looks at, while the model is locked.
const SCAN: u64 = CHUNK as u64;

/// The number of filters whose matches are remembered.
const MOST_FILTERS: usize = 8;

/// The trace. A row takes about 100 bytes, mostly text.
pub(crate) struct Trace {
    chunks: VecDeque<Chunk>,
    /// The row number at which the first chunk begins.
    first: u64,
    /// The minimum number of rows kept.
    capacity: usize,
    /// The most recently used filter first.
    found: VecDeque<Found>,
}

/// The rows found to match a filter so far.
struct Found {
    which: Which,
    numbers: VecDeque<u64>,
    /// The row number at which to continue.
    next: u64,
}

/// Selects rows of the trace.
#[derive(Clone, Debug, Default)]
pub struct Which {
    /// Identifies the selection: equal keys mean equal selections.
    pub key: String,
    /// Which frames.
    pub filter: Filter,
    /// Whether to select only errors.
    pub alarming: bool,
    /// Whether to fold each SDO transfer into one row.
    pub transfers: bool,
}

impl Which {
    /// Whether it selects all rows without folding.
    fn is_all(&self) -> bool {
        self.key.is_empty()
    }
}

/// Rows, with their texts in one piece.
#[derive(Default)]
struct Chunk {
    rows: Vec<Stored>,
    text: String,
    addresses: Vec<Address>,
    /// SDO transfers by the row of their last frame.
    transfers: BTreeMap<u32, Transfer>,
}

struct Transfer {
    text: String,
    alarming: bool,
}

struct Stored {
    at: Instant,
    frame: Frame,
    service: Service,
    node: Option<NodeId>,
    alarming: bool,
    /// Whether it is a part of an SDO transfer.
    is_part: bool,
    /// The ends of its name, text and addresses in the chunk.
    name: u32,
    text: u32,
    addresses: u32,
}

/// A row with its texts.
struct Entry<'a> {
    stored: &'a Stored,
    name: &'a str,
    text: &'a str,
    addresses: &'a [Address],
    transfer: Option<&'a Transfer>,
}

/// A page of matching rows.
#[derive(Debug, Default)]
pub struct Page {
    /// The number of matches found so far.
    pub matching: u64,
    /// The position of the first row among the matches.
    pub from: u64,
    /// The rows.
    pub rows: Vec<Row>,
}

impl Trace {
    /// A trace that keeps at least `capacity` rows.
    #[must_use]
    pub(crate) fn new(capacity: usize) -> Self {
        Trace { chunks: VecDeque::new(), first: 0, capacity, found: VecDeque::new() }
    }

    /// The number of the oldest row.
    #[must_use]
    pub(crate) fn first(&self) -> u64 {
        self.first
    }

    /// The number after that of the newest row.
    #[must_use]
    pub(crate) fn end(&self) -> u64 {
        let full = self.chunks.len().saturating_sub(1) * CHUNK;
        self.first + full as u64 + self.chunks.back().map_or(0, |chunk| chunk.rows.len() as u64)
    }

    /// Adds a frame; returns its number.
    pub(crate) fn push(&mut self, at: Instant, frame: &Frame, decoded: &Decoded) -> u64 {
        if self.chunks.back().is_none_or(|chunk| chunk.rows.len() == CHUNK) {
            if self.chunks.len() * CHUNK >= self.capacity + CHUNK {
                self.forget();
            }
            self.chunks.push_back(Chunk { rows: Vec::with_capacity(CHUNK), ..Chunk::default() });
        }
        let number = self.end();
        let chunk = self.chunks.back_mut().expect("one was added");
        chunk.text.push_str(&decoded.name);
        let name = chunk.text.len() as u32;
        chunk.text.push_str(&decoded.text);
        chunk.addresses.extend(match &decoded.detail {
            Detail::Pdo(pdo) => pdo.fields.iter().map(|field| field.address).collect(),
            Detail::Sdo(sdo) => sdo.report.iter().map(|report| report.address).collect(),
            _ => Vec::new(),
        });
        chunk.rows.push(Stored {
            at,
            frame: *frame,
            service: decoded.service,
            node: decoded.node,
            alarming: decoded.alarming,
            is_part: is_part(decoded),
            name,
            text: chunk.text.len() as u32,
            addresses: chunk.addresses.len() as u32,
        });
        number
    }

    /// Notes the transfer that ended with a frame.
    pub(crate) fn fold(&mut self, number: u64, text: String, alarming: bool) {
        let Some((chunk, row)) = self.place(number) else { return };
        self.chunks[chunk].transfers.insert(row as u32, Transfer { text, alarming });
        // A timed-out transfer is noted long after its last frame was searched.
        for place in 0..self.found.len() {
            let found = &self.found[place];
            if number < found.next && self.matches(&found.which, number) {
                let found = &mut self.found[place];
                if let Err(at) = found.numbers.binary_search(&number) {
                    found.numbers.insert(at, number);
                }
            }
        }
    }

    /// Matching rows from a position on; from the end backwards if negative. With `at`, the position counts from the
    /// first match with this row number or a higher one.
    pub(crate) fn page(&mut self, which: &Which, at: Option<u64>, from: i64, count: usize) -> Page {
        if which.is_all() {
            let (first, end) = (self.first, self.end());
            let at = at.map(|at| at.clamp(first, end) - first);
            let from = start(at, from, end - first);
            let numbers = (first + from..end).take(count);
            return Page { matching: end - first, from, rows: numbers.filter_map(|it| self.row(it, false)).collect() };
        }
        let found = self.look(which);
        let matching = self.found[found].numbers.len() as u64;
        let at = at.map(|at| self.found[found].numbers.partition_point(|number| *number < at) as u64);
        let from = start(at, from, matching);
        let numbers: Vec<u64> = self.found[found].numbers.iter().skip(from as usize).take(count).copied().collect();
        let rows = numbers.into_iter().filter_map(|it| self.row(it, which.transfers)).collect();
        Page { matching, from, rows }
    }

    /// Adds matching frames of some rows, from a row number on; returns the row number to continue with, unless all are
    /// done.
    pub(crate) fn frames(&self, which: &Which, from: u64, into: &mut Vec<(Instant, Frame)>) -> Option<u64> {
        let which = Which { transfers: false, ..which.clone() };
        let from = from.max(self.first);
        let until = self.end().min(from + SCAN);
        into.extend((from..until).filter_map(|number| {
            let entry = self.entry(number)?;
            (which.is_all() || self.matches(&which, number)).then_some((entry.stored.at, entry.stored.frame))
        }));
        (until < self.end()).then_some(until)
    }

    /// A step of a search; returns whether all rows have been searched.
    pub(crate) fn search(&mut self, which: &Which) -> bool {
        which.is_all() || {
            let found = self.look(which);
            self.found[found].next == self.end()
        }
    }

    /// Searches rows that are new for a filter; returns the position of the filter.
    fn look(&mut self, which: &Which) -> usize {
        let known = self.found.iter().position(|found| found.which.key == which.key);
        let mut found = match known.and_then(|place| self.found.remove(place)) {
            Some(found) => found,
            None => Found { which: which.clone(), numbers: VecDeque::new(), next: self.first },
        };
        let oldest = found.numbers.partition_point(|number| *number < self.first);
        found.numbers.drain(..oldest);
        found.next = found.next.max(self.first);
        let until = self.end().min(found.next + SCAN);
        found.numbers.extend((found.next..until).filter(|number| self.matches(&found.which, *number)));
        found.next = until;
        self.found.push_front(found);
        self.found.truncate(MOST_FILTERS);
        0
    }

    fn matches(&self, which: &Which, number: u64) -> bool {
        let Some(entry) = self.entry(number) else { return false };
        let Entry { stored, name, text, addresses, transfer, .. } = entry;
        let (text, alarming) = match transfer {
            _ if !which.transfers || !stored.is_part => (text, stored.alarming),
            Some(transfer) => (&*transfer.text, transfer.alarming),
            // A part of a transfer, which gets a row of its own when it ends.
            None => return false,
        };
        (alarming || !which.alarming)
            && which.filter.matches_words(stored.node, stored.service, stored.frame.id(), addresses, (name, text))
    }

    fn row(&self, number: u64, is_folded: bool) -> Option<Row> {
        let entry = self.entry(number)?;
        let frame = &entry.stored.frame;
        let transfer = entry.transfer.filter(|_| is_folded);
        Some(Row {
            number,
            time: entry.stored.at.since(Instant::ZERO).as_secs_f64(),
            id: frame.id().to_string(),
            data: if transfer.is_some() { String::new() } else { hex(frame.data()) },
            node: entry.stored.node.map(NodeId::get),
            service: if transfer.is_some() { "SDO transfer" } else { entry.name }.to_owned(),
            text: transfer.map_or(entry.text, |transfer| &transfer.text).to_owned(),
            alarming: transfer.map_or(entry.stored.alarming, |transfer| transfer.alarming),
        })
    }

    fn entry(&self, number: u64) -> Option<Entry<'_>> {
        let (chunk, row) = self.place(number)?;
        let chunk = &self.chunks[chunk];
        let stored = chunk.rows.get(row)?;
        let before = row.checked_sub(1).map(|before| &chunk.rows[before]);
        let (from, addresses) = before.map_or((0, 0), |before| (before.text as usize, before.addresses as usize));
        let (name, text) = (stored.name as usize, stored.text as usize);
        Some(Entry {
            stored,
            name: &chunk.text[from..name],
            text: &chunk.text[name..text],
            addresses: &chunk.addresses[addresses..stored.addresses as usize],
            transfer: chunk.transfers.get(&(row as u32)),
        })
    }

    fn place(&self, number: u64) -> Option<(usize, usize)> {
        let offset = usize::try_from(number.checked_sub(self.first)?).ok()?;
        let place = (offset / CHUNK, offset % CHUNK);
        (place.0 < self.chunks.len()).then_some(place)
    }

    fn forget(&mut self) {
        if let Some(chunk) = self.chunks.pop_front() {
            self.first += chunk.rows.len() as u64;
        }
    }
}

/// Whether a frame is folded into its SDO transfer; one that cannot be decoded is not.
pub(crate) fn is_part(decoded: &Decoded) -> bool {
    matches!(&decoded.detail, Detail::Sdo(sdo) if sdo.step != Step::Unknown)
}

/// The position among `matching` rows.
fn start(at: Option<u64>, from: i64, matching: u64) -> u64 {
    let base = at.unwrap_or(if from < 0 { matching } else { 0 });
    base.saturating_add_signed(from).min(matching)
}
