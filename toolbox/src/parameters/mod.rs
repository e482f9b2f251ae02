//! The parameters of a device: [`backup`], [`restore`] and [`compare`]; with the feature `archive`, those of a whole
//! machine in one file.
//!
//! Operations report [`Progress`] to a callback, which can stop them. Nothing is printed.

#[cfg(feature = "archive")]
pub mod archive;
pub mod backup;
pub mod compare;
pub mod order;
pub mod restore;
mod selection;
pub mod settings;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use lexican_eds::model::{Device, Entry, Value};
use lexican_eds::types::DataType;
use lexican_runtime::cia301::is_pdo_mapping;
use lexican_runtime::host::{AccessError, Bytes};
use lexican_runtime::object::Address;

use crate::node::followed::Followed;
use crate::node::remote::{Entries, Refusal};
use crate::values::address;
use crate::values::wire::parse_padded;

pub use selection::{LeftOut, LeftOuts, Parameters};

/// A step of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress<'a> {
    /// Entry `at`, from 1, of `of` entries is about to be read.
    Reading {
        /// The entry.
        address: Address,
        /// From 1.
        at: usize,
        /// The total.
        of: usize,
    },
    /// Entry `at`, from 1, of `of` entries is about to be written and read back.
    Writing {
        /// The entry.
        address: Address,
        /// From 1.
        at: usize,
        /// The total.
        of: usize,
    },
    /// The long value of an entry is being transferred.
    Transferring {
        /// The entry.
        address: Address,
        /// The number of bytes so far.
        bytes: u32,
    },
    /// An entry was written and read back.
    Written {
        /// The entry.
        address: Address,
        /// The value before, if it could be read.
        before: Option<&'a [u8]>,
    },
    /// The device is about to store its parameters.
    Storing,
}

/// Gets the progress; the operation stops at a [`ControlFlow::Break`].
pub type OnProgress<'a> = &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>;

/// Why an operation ended early.
#[derive(Debug, thiserror::Error)]
pub enum Ended {
    /// The callback has stopped it.
    #[error("it was interrupted")]
    Stopped,
    /// The node has booted meanwhile, and may have lost what was written.
    #[error("the node has restarted meanwhile")]
    Restarted,
    /// The link has failed, or the node is gone.
    #[error(transparent)]
    Lost(#[from] AccessError),
}

impl From<lexican_runtime::host::LinkError> for Ended {
    fn from(error: lexican_runtime::host::LinkError) -> Self {
        Ended::Lost(error.into())
    }
}

/// The values that were read, and refusals.
#[derive(Clone, Debug, Default)]
pub struct Read {
    /// The values.
    pub values: BTreeMap<Address, Value>,
    /// Entries that were refused, or whose value does not fit their type.
    pub refused: Vec<(Address, Refusal)>,
}

/// Reads entries in ascending order; of PDO mappings, only the entries in use.
pub fn read<'d, N: Entries>(
    node: &mut N,
    entries: impl IntoIterator<Item = &'d Entry>,
    progress: OnProgress<'_>,
) -> Result<Read, Ended> {
    let entries: Vec<_> = entries.into_iter().collect();
    let (mut read, of) = (Read::default(), entries.len());
    for (entry, at) in entries.into_iter().zip(1..) {
        let address = address(entry);
        if is_beyond_mapping(&read.values, address) {
            continue;
        }
        if progress(Progress::Reading { address, at, of }).is_break() {
            return Err(Ended::Stopped);
        }
        match read_entry(node, address, progress)? {
            Ok(data) => match parse_padded(entry.data_type, &data) {
                Some(value) => {
                    read.values.insert(address, value);
                }
                None => {
                    let text = format!("{} bytes are no {}", data.len(), entry.data_type);
                    read.refused.push((address, Refusal::Failed(text)));
                }
            },
            Err(refusal) => read.refused.push((address, refusal)),
        }
    }
    Ok(read)
}

/// Reads every entry that may be a parameter, which shows which RPDOs are active.
fn read_parameters<N: Entries>(node: &mut N, sheet: &Device, progress: OnProgress<'_>) -> Result<Read, Ended> {
    let parameters = Parameters::of_sheet(sheet, node.id());
    let may_be = |entry: &&Entry| match parameters.left_out(entry) {
        None => entry.access.readable(),
        Some(reason) => reason == LeftOut::Mapped && entry.access.readable() && entry.data_type != DataType::Domain,
    };
    read(node, sheet.entries().filter(may_be), progress)
}

/// Reports the progress of a long transfer. Short ones are not interrupted.
fn if_long(address: Address, bytes: u32, progress: OnProgress<'_>) -> ControlFlow<()> {
    const SHORT: u32 = 1024;
    if bytes < SHORT { ControlFlow::Continue(()) } else { progress(Progress::Transferring { address, bytes }) }
}

/// Reads an entry with progress.
fn read_entry<N: Entries>(
    node: &mut N,
    address: Address,
    progress: OnProgress<'_>,
) -> Result<Result<Vec<u8>, Refusal>, Ended> {
    let bytes = Bytes::room_for(LONGEST);
    let mut followed = Followed::new(bytes, |bytes| if_long(address, bytes, progress));
    let len = node.read_into(address, &mut followed)?;
    if followed.is_interrupted() {
        return Err(Ended::Stopped);
    }
    Ok(len.map(|len| followed.into_payload().into_vec(len)))
}

/// Writes an entry with progress.
fn write_entry<N: Entries>(
    node: &mut N,
    address: Address,
    data: &[u8],
    progress: OnProgress<'_>,
) -> Result<Result<(), Refusal>, Ended> {
    let Ok(len) = u32::try_from(data.len()) else {
        return Ok(Err(Refusal::Failed("SDO transfers less than 4 GiB".to_owned())));
    };
    let mut followed = Followed::new(data, |bytes| if_long(address, bytes, progress));
    let result = node.write_from(address, len, &mut followed)?;
    if followed.is_interrupted() { Err(Ended::Stopped) } else { Ok(result) }
}

/// The longest value that is read, in bytes.
const LONGEST: usize = 64 << 20;

/// Whether an entry of a PDO mapping is beyond the number of mapped objects.
fn is_beyond_mapping(values: &BTreeMap<Address, Value>, address: Address) -> bool {
    let count = values.get(&Address::new(address.index(), 0)).and_then(Value::as_integer);
    is_pdo_mapping(address.index()) && count.is_some_and(|count| i128::from(address.sub()) > count)
}
