//! The parameters of a device: read as a [`backup`], written back by [`restore`], and compared ([`compare`]).
//!
//! Every operation reports its [`Progress`] as values and can be stopped by the answer; nothing is printed.

pub mod backup;
pub mod compare;
pub mod order;
pub mod restore;
pub mod settings;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use lexican_eds::model::{AccessType, Device, Entry, Value};
use lexican_eds::types::DataType;
use lexican_runtime::cia301;
use lexican_runtime::host::{AccessError, Bytes, Link};
use lexican_runtime::object::Address;

use crate::followed::Followed;
use crate::remote::{Refusal, RemoteNode};
use crate::values::wire::parse_padded;
use crate::values::{address, is_pdo_mapping};

/// What an operation is about to do, or has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress<'a> {
    /// Reads the entry `at` of `of`, counted from 1.
    Reading {
        /// The entry.
        address: Address,
        /// Which it is.
        at: usize,
        /// How many there are.
        of: usize,
    },
    /// Writes an entry, and reads it back.
    Writing {
        /// The entry.
        address: Address,
        /// Which it is.
        at: usize,
        /// How many there are.
        of: usize,
    },
    /// Transfers the value of the entry that is read or written, which is a long one.
    Transferring {
        /// The entry.
        address: Address,
        /// How many bytes have been transferred.
        bytes: u32,
    },
    /// An entry has been written, and read back with its value.
    Written {
        /// The entry.
        address: Address,
        /// What it had before, if that could be read.
        before: Option<&'a [u8]>,
    },
    /// Lets the device store its parameters.
    Storing,
}

/// Gets the progress; the operation stops at a [`ControlFlow::Break`].
pub type OnProgress<'a> = &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>;

/// Why an operation ended early.
#[derive(Debug, thiserror::Error)]
pub enum Ended {
    /// The caller has stopped it.
    #[error("it was interrupted")]
    Stopped,
    /// The link has failed, or the node is gone.
    #[error(transparent)]
    Lost(#[from] AccessError),
}

impl From<lexican_runtime::host::LinkError> for Ended {
    fn from(error: lexican_runtime::host::LinkError) -> Self {
        Ended::Lost(error.into())
    }
}

/// Whether writing an entry makes the device do something, rather than change a parameter: 1003h, 1010h, 1011h, programs
/// (1F50h), NMT (1F80h), and the control word of CiA 402.
#[must_use]
pub fn is_command(entry: &Entry) -> bool {
    matches!(
        entry.index,
        cia301::PREDEFINED_ERROR_FIELD | cia301::STORE_PARAMETERS | cia301::RESTORE_DEFAULT_PARAMETERS
            | 0x1F50..=0x1F5F | cia301::NMT_STARTUP..=0x1F8F | 0x6040
    )
}

/// Whether an entry of CiA 402 is a set-point: it is what the drive is to do now, and no parameter.
const fn is_set_point(index: u16) -> bool {
    // Target velocity (vl), torque, position, offsets, touch probe function, digital outputs, and target velocity (pv).
    matches!(index, 0x6042 | 0x6071 | 0x607A | 0x60B0..=0x60B2 | 0x60B8 | 0x60C1 | 0x60FE | 0x60FF)
}

/// Whether an entry is a parameter whose value a data sheet can say: not a DOMAIN.
#[must_use]
pub fn is_setting(device: &Device, entry: &Entry) -> bool {
    is_kept(device, entry) && entry.data_type != DataType::Domain
}

/// Whether an entry is what a device is set to: it can be read and written, and is neither process data (`rwr`, `rww`,
/// set-points of CiA 402) nor a command.
#[must_use]
pub fn is_kept(device: &Device, entry: &Entry) -> bool {
    let is_drive = device.profile == Some(402);
    entry.access == AccessType::Rw && !is_command(entry) && !(is_drive && is_set_point(entry.index))
}

/// The settings that were read, and the reasons of those that were not.
#[derive(Clone, Debug, Default)]
pub struct Read {
    /// The values.
    pub values: BTreeMap<Address, Value>,
    /// What was refused, or is no value of its type.
    pub refused: Vec<(Address, Refusal)>,
}

/// Reads entries, ascending. Of a PDO mapping, only what is mapped.
///
/// # Errors
///
/// [`Ended`].
pub fn read<'d, L: Link>(
    node: &mut RemoteNode<'_, L>,
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

/// Reports how far a transfer is, if it is a long one. Others end soon, and are not stopped half way.
fn if_long(address: Address, bytes: u32, progress: OnProgress<'_>) -> ControlFlow<()> {
    const SHORT: u32 = 1024;
    if bytes < SHORT { ControlFlow::Continue(()) } else { progress(Progress::Transferring { address, bytes }) }
}

/// Reads an entry, and reports how far it is.
fn read_entry<L: Link>(
    node: &mut RemoteNode<'_, L>,
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

/// Writes an entry, and reports how far it is.
fn write_entry<L: Link>(
    node: &mut RemoteNode<'_, L>,
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

/// The longest value that is read: 64 MiB.
const LONGEST: usize = 64 << 20;

/// Whether an entry of a PDO mapping is beyond the number of those that are mapped.
fn is_beyond_mapping(values: &BTreeMap<Address, Value>, address: Address) -> bool {
    let count = values.get(&Address::new(address.index(), 0)).and_then(Value::as_integer);
    is_pdo_mapping(address.index()) && count.is_some_and(|count| i128::from(address.sub()) > count)
}
