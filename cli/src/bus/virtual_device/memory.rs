//! The stored parameters of a device made of a data sheet: the entries that 1010h stores, those that are persistent by the
//! data sheet, and the node-ID from LSS. The file has the format of [`lexican_runtime::host::kept`], with a line `node 5`.

use std::collections::BTreeMap;
use std::path::Path;

use lexican_eds::model;
use lexican_runtime::host::kept::{KeptError, KeptFile, KeptFormat};
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::lss_device::{LssHost, StoreError};
use lexican_runtime::service::storage::{Storage, is_of_group};
use lexican_runtime::{AbortCode, NodeId};

use super::dictionary::NO_NODE;
use super::dictionary::SheetDictionary;
use crate::output::{Failure, reason};
use crate::values::hex;

const FORMAT: KeptFormat = KeptFormat { name: "lexican parameters", version: 2 };

#[derive(Default)]
pub(crate) struct Memory {
    pub(super) kept: BTreeMap<Address, Vec<u8>>,
    pub(super) node: Option<NodeId>,
    /// The entries that can be stored.
    pub(super) writable: Vec<Address>,
    file: Option<KeptFile>,
    /// Why the file could not be written the last time.
    pub(super) trouble: Option<String>,
}

impl Memory {
    pub(crate) fn open(path: &Path, sheet: &model::Device) -> Result<Self, Failure> {
        let (file, text) = KeptFile::open(path).map_err(|error| Failure::file("read", path, &error))?;
        let mut memory = Memory { file: Some(file), ..Memory::default() };
        match text {
            Some(text) => memory
                .parse(&text, &SheetDictionary::new(NO_NODE, sheet))
                .map_err(|wrong| Failure::new(format_args!("{}{wrong}", path.display())))?,
            None => memory.save().map_err(|error| Failure::file("write", path, &error))?,
        }
        Ok(memory)
    }

    pub(super) fn keep(&mut self, address: Address, value: Vec<u8>) {
        self.kept.insert(address, value);
        // `trouble` has the error; the write is already confirmed.
        let _ = self.save();
    }

    fn save(&mut self) -> std::io::Result<()> {
        let text = self.text();
        let saved = self.file.as_mut().map_or(Ok(()), |file| file.save(text));
        self.trouble =
            saved.as_ref().err().map(|error| format!("cannot write the stored parameters: {}", reason(error)));
        saved
    }

    fn text(&self) -> String {
        let node = self.node.iter().map(|node| format!("node {node}"));
        let entries = self.kept.iter().map(|(address, value)| format!("{address} {}", hex(value)));
        FORMAT.seal(&node.chain(entries).collect::<Vec<_>>())
    }

    /// On failure, the line and the reason, to follow the path.
    fn parse(&mut self, text: &str, dictionary: &SheetDictionary) -> Result<(), String> {
        let lines = FORMAT.unseal(text).map_err(|error| match error {
            KeptError::Foreign(_) => format!(":1: this is not what `lexican simulate --eeprom` writes: {error}"),
            _ => format!(": {error}"),
        })?;
        for (number, line) in (2..).zip(&lines) {
            self.take(line, dictionary).ok_or_else(|| {
                format!(
                    ":{number}: `{line}` is neither a node-ID nor an entry that this device stores, with its length; \
                     name another file, or remove this one to begin with a new device"
                )
            })?;
        }
        Ok(())
    }

    fn take(&mut self, line: &str, dictionary: &SheetDictionary) -> Option<()> {
        let (name, value) = line.split_once(' ').unwrap_or((line, ""));
        if name == "node" {
            self.node = Some(NodeId::new(value.parse().ok()?)?);
            return Some(());
        }
        let (index, sub) = name.split_once(':')?;
        let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
        let bytes = value.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).ok());
        let bytes: Vec<u8> = bytes.collect::<Option<_>>()?;
        dictionary.can_keep(address, &bytes).then(|| self.kept.insert(address, bytes))?;
        Some(())
    }
}

impl Storage for Memory {
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
        for &address in self.writable.iter().filter(|address| is_of_group(group, **address)) {
            let entry = od.entry(address)?;
            let mut value = vec![0; od.len(&entry).unwrap_or(0) as usize];
            let len = od.read(&entry, 0, &mut value)?;
            value.truncate(len);
            self.kept.insert(address, value);
        }
        self.save().map_err(|_| AbortCode::HARDWARE_ERROR)
    }

    fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
        self.kept.retain(|address, _| !is_of_group(group, *address));
        self.save().map_err(|_| AbortCode::HARDWARE_ERROR)
    }
}

impl LssHost for Memory {
    /// The bit rates of CiA 305; entry 5 of its table is reserved.
    fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
        table == 0 && index <= 8 && index != 5
    }

    fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError> {
        self.node = node;
        self.save().map_err(|_| StoreError::Failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::samples;

    fn dictionary() -> SheetDictionary {
        SheetDictionary::new(NO_NODE, &samples::drive())
    }

    #[test]
    fn stored_parameters_are_read_back() {
        let kept =
            BTreeMap::from([(Address::new(0x2410, 1), vec![0x64, 0]), (Address::new(0x607A, 0), vec![1, 2, 3, 4])]);
        let memory = Memory { kept, node: NodeId::new(5), ..Memory::default() };
        let mut read = Memory::default();
        assert_eq!(read.parse(&memory.text(), &dictionary()), Ok(()));
        assert_eq!((read.kept, read.node), (memory.kept, memory.node));
    }

    #[test]
    fn other_entries_are_refused() {
        let check = |line: &str, words: &str| {
            let text = FORMAT.seal(&[line.to_owned()]);
            let wrong = Memory::default().parse(&text, &dictionary()).unwrap_err();
            assert!(wrong.starts_with(words), "{line}: {wrong}");
        };
        check("2410:01 64", ":2: `2410:01 64` is neither");
        check("2410:01", ":2: ");
        check("2410:01 XX 00", ":2: ");
        check("1018:01 00 00 00 00", ":2: ");
        check("1010:01 00 00 00 00", ":2: ");
        check("5555:00 00", ":2: ");
        check("node 0", ":2: ");
    }

    #[test]
    fn other_files_are_refused() {
        for (text, words) in [
            ("", ": empty, as after a power failure; remove it"),
            (
                "nonsense\nend\n",
                ":1: this is not what `lexican simulate --eeprom` writes: the first line is not `lexican parameters 2`",
            ),
            ("lexican parameters 1\nend\n", ": of another version than 2"),
            ("lexican parameters 2\n2410:01 64\n", ": cut off or changed"),
        ] {
            let wrong = Memory::default().parse(text, &dictionary()).unwrap_err();
            assert!(wrong.starts_with(words), "{text:?}: {wrong}");
        }
    }
}
