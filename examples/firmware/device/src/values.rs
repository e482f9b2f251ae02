//! The values of the device: the generated dictionary, and the notebook, which is too long for that.

use lexican_runtime::object::{Address, Entry, ObjectDictionary};
use lexican_runtime::{AbortCode, NodeId};

use crate::od;

/// The initial node-ID of the dictionary; the device gets its own when it boots.
const NO_NODE: NodeId = NodeId::literal(127);

/// Whether 1010h stores an entry: parameters, but not the outputs.
pub(crate) fn is_stored(address: Address) -> bool {
    !matches!(address.index(), 0x2000..=0x5FFF | 0x6200 | 0x6411)
}

/// All values of the device.
pub(crate) struct Values {
    pub(crate) od: od::Storage,
    pub(crate) notebook: Notebook,
}

/// 2000h: bytes that a client has written.
pub(crate) struct Notebook {
    /// Borrowed, so that moving the device does not move it.
    bytes: &'static mut [u8],
    len: usize,
}

impl Notebook {
    pub(crate) const fn clear(&mut self) {
        self.len = 0;
    }

    fn read(&self, offset: usize, buffer: &mut [u8]) -> usize {
        let rest = self.bytes.get(offset..self.len).unwrap_or(&[]);
        let pairs = buffer.iter_mut().zip(rest);
        pairs.map(|(to, from)| *to = *from).count()
    }

    /// While a value arrives in pieces, the notebook is empty.
    fn write(&mut self, offset: usize, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let end = offset.checked_add(data.len()).ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        let place = self.bytes.get_mut(offset..end).ok_or(AbortCode::LENGTH_TOO_HIGH)?;
        place.copy_from_slice(data);
        self.len = if last { end } else { 0 };
        Ok(())
    }
}

impl Values {
    pub(crate) fn new(notebook: &'static mut [u8]) -> Self {
        Values { od: od::storage(NO_NODE), notebook: Notebook { bytes: notebook, len: 0 } }
    }

    fn is_notebook(entry: &Entry) -> bool {
        entry.address == od::NOTEBOOK.address()
    }
}

impl ObjectDictionary for Values {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.od.entry(address)
    }

    // No PDO maps the notebook.
    fn image(&mut self) -> &mut [u8] {
        self.od.image()
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        if Values::is_notebook(entry) { u32::try_from(self.notebook.len).ok() } else { self.od.len(entry) }
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        match Values::is_notebook(entry) {
            true => Ok(self.notebook.read(offset as usize, buffer)),
            false => self.od.read(entry, offset, buffer),
        }
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        match Values::is_notebook(entry) {
            true => self.notebook.write(offset as usize, data, last),
            false => self.od.write(entry, offset, data, last),
        }
    }

    fn take_changes(&mut self) -> Option<(Address, Address)> {
        self.od.take_changes()
    }
}
