//! What a device made of a dictionary keeps without power: the entries that 1010h stores, others that it keeps at once,
//! and the node-ID from LSS. In a file these are lines such as `2410:01 64 00` and `node 5`.

use std::collections::BTreeMap;
use std::path::Path;

use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::lss_device::{LssHost, StoreError};
use lexican_runtime::service::storage::{Storage, is_of_group};
use lexican_runtime::wire::lss::BIT_TIMING_TABLE;
use lexican_runtime::{AbortCode, NodeId};

use crate::eeprom::{EepromError, EepromFile, EepromFormat, entry_of_line};

const FORMAT: EepromFormat = EepromFormat {
    text: KeptFormat { name: "lexican parameters", version: 2 },
    device: "device",
    line: "a node-ID, nor an entry that this device stores, with its length",
};

/// The data that a device keeps, with a file or without.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// The entries that can be stored.
    pub writable: Vec<Address>,
    /// The bit rates in kbit/s that the device takes by LSS.
    pub bit_rates_kbit: Vec<u16>,
    /// The data sheet that the device serves (1021h).
    pub data_sheet: Vec<u8>,
    kept: Kept,
    file: Option<EepromFile<Kept>>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Kept {
    values: BTreeMap<Address, Vec<u8>>,
    node: Option<NodeId>,
}

impl Memory {
    /// Reads the file at `path`, to which every change is written from now on. `can_keep` says whether the device keeps
    /// a value of an entry.
    pub fn open(path: &Path, can_keep: impl Fn(Address, &[u8]) -> bool) -> Result<Self, EepromError> {
        let (file, kept) = EepromFile::open(path, |text| Kept::read(text, &can_keep))?;
        let mut memory = Memory { kept: kept.unwrap_or_default(), file: Some(file), ..Memory::default() };
        memory.save()?;
        Ok(memory)
    }

    /// The values that are kept.
    #[must_use]
    pub fn values(&self) -> &BTreeMap<Address, Vec<u8>> {
        &self.kept.values
    }

    /// The node-ID that LSS has stored.
    #[must_use]
    pub fn node(&self) -> Option<NodeId> {
        self.kept.node
    }

    /// Keeps a value at once, without 1010h.
    pub fn keep(&mut self, address: Address, value: Vec<u8>) {
        self.kept.values.insert(address, value);
        // `trouble` reports a failure; the write of the client is already confirmed.
        let _ = self.save();
    }

    /// Why the file could not be written the last time; `None` if it could.
    #[must_use]
    pub fn trouble(&self) -> Option<&EepromError> {
        self.file.as_ref()?.trouble()
    }

    fn save(&mut self) -> Result<(), EepromError> {
        self.file.as_mut().map_or(Ok(()), |file| file.save(&self.kept, Kept::text))
    }
}

impl Kept {
    fn text(&self) -> String {
        let node = self.node.iter().map(|node| format!("node {node}"));
        let entries = self.values.iter().map(|(address, value)| {
            let bytes: Vec<String> = value.iter().map(|byte| format!("{byte:02X}")).collect();
            format!("{address} {}", bytes.join(" "))
        });
        FORMAT.text.seal(&node.chain(entries).collect::<Vec<_>>())
    }

    fn read(text: &str, can_keep: impl Fn(Address, &[u8]) -> bool) -> Result<Self, EepromError> {
        let mut kept = Kept::default();
        FORMAT.read(text, |line| kept.take(line, &can_keep))?;
        Ok(kept)
    }

    fn take(&mut self, line: &str, can_keep: impl Fn(Address, &[u8]) -> bool) -> Option<()> {
        if let Some(node) = line.strip_prefix("node ") {
            self.node = Some(NodeId::new(node.parse().ok()?)?);
            return Some(());
        }
        let (address, value) = entry_of_line(line)?;
        let bytes = value.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).ok());
        let bytes: Vec<u8> = bytes.collect::<Option<_>>()?;
        can_keep(address, &bytes).then(|| self.values.insert(address, bytes))?;
        Some(())
    }
}

impl Storage for Memory {
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
        for &address in self.writable.iter().filter(|address| is_of_group(group, **address)) {
            self.kept.values.insert(address, read(od, address)?);
        }
        self.save().map_err(|_| AbortCode::HARDWARE_ERROR)
    }

    fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
        self.kept.values.retain(|address, _| !is_of_group(group, *address));
        self.save().map_err(|_| AbortCode::HARDWARE_ERROR)
    }
}

impl LssHost for Memory {
    fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
        let rate = BIT_TIMING_TABLE.get(usize::from(index)).copied().flatten();
        table == 0 && rate.is_some_and(|rate| self.bit_rates_kbit.contains(&rate))
    }

    fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError> {
        self.kept.node = node;
        self.save().map_err(|_| StoreError::Failed)
    }
}

/// The bytes of an entry, as the bus would read them.
pub fn read(od: &mut dyn ObjectDictionary, address: Address) -> Result<Vec<u8>, AbortCode> {
    let entry = od.entry(address)?;
    let mut value = vec![0; od.len(&entry).unwrap_or(entry.capacity.into()) as usize];
    let len = od.read(&entry, 0, &mut value)?;
    value.truncate(len);
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device that keeps two bytes of 2410h.
    fn can_keep(address: Address, value: &[u8]) -> bool {
        address.index() == 0x2410 && value.len() == 2
    }

    #[test]
    fn what_is_kept_is_read_back() {
        let values =
            BTreeMap::from([(Address::new(0x2410, 1), vec![0x64, 0]), (Address::new(0x2410, 2), vec![1, 0xFF])]);
        for kept in [Kept { values, node: NodeId::new(5) }, Kept::default()] {
            assert_eq!(Kept::read(&kept.text(), can_keep).unwrap(), kept);
        }
    }

    #[test]
    fn other_lines_are_refused_with_their_number() {
        for line in ["2410:01 64", "2410:01", "2410:01 XX 00", "2411:01 00 00", "241001 00 00", "node 0", "node", ""] {
            let text = FORMAT.text.seal(&["2410:00 00 00".to_owned(), line.to_owned()]);
            let wrong = Kept::read(&text, can_keep).unwrap_err().to_string();
            assert!(wrong.starts_with(&format!("line 3: `{line}` is neither a node-ID")), "{line}: {wrong}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        for (text, words) in [
            ("", "empty, as after a power failure; remove it"),
            ("nonsense\nend\n", "not the EEPROM of a simulated device: the first line is not `lexican parameters 2`"),
            ("lexican parameters 1\nend\n", "the EEPROM of a simulated device, but of another version than 2"),
            ("lexican parameters 2\n2410:01 64\n", "cut off or changed"),
        ] {
            let wrong = Kept::read(text, can_keep).unwrap_err().to_string();
            assert!(wrong.starts_with(words), "{text:?}: {wrong}");
        }
    }
}
