//! What a device made of a data sheet keeps without power: the values that were stored by 1010h, those that its data
//! sheet says survive anyway, and the node-ID that LSS gave it. With a file, beyond the end of the command.
//!
//! ```text
//! lexican parameters 1
//! node 5
//! 2410:01 64 00
//! end
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::lss_device::{LssHost, StoreError};
use lexican_runtime::service::storage::Storage;
use lexican_runtime::{AbortCode, NodeId};

use crate::output::{Failure, write_whole};
use crate::values::hex;

const HEAD: &str = "lexican parameters 1";
const END: &str = "end";

/// What a device keeps without power.
#[derive(Default)]
pub(crate) struct Memory {
    pub(super) kept: BTreeMap<Address, Vec<u8>>,
    pub(super) node: Option<NodeId>,
    /// The entries that there are to be stored.
    pub(super) writable: Vec<Address>,
    path: Option<PathBuf>,
    /// What went wrong with the file the last time.
    pub(super) trouble: Option<String>,
}

impl Memory {
    /// The memory in a file; a file that is not there is that of a new device, and is made.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let mut memory = Memory { path: Some(path.to_owned()), ..Memory::default() };
        if path.exists() {
            let text = std::fs::read_to_string(path).map_err(|error| Failure::file("read", path, &error))?;
            memory.parse(&text).map_err(|line| {
                Failure::new(format_args!(
                    "{}:{line}: this is not what `lexican simulate --eeprom` writes",
                    path.display()
                ))
                .help("name another file, or remove this one for a new device")
            })?;
        } else {
            write_whole(path, memory.text().as_bytes())?;
        }
        Ok(memory)
    }

    pub(super) fn keep(&mut self, address: Address, value: Vec<u8>) {
        self.kept.insert(address, value);
        // Nobody waits for an answer; the trouble is told.
        let _ = self.save();
    }

    fn save(&mut self) -> Result<(), AbortCode> {
        let Some(path) = &self.path else { return Ok(()) };
        let written = write_whole(path, self.text().as_bytes());
        self.trouble = written.as_ref().err().map(Failure::to_string);
        written.map_err(|_| AbortCode::HARDWARE_ERROR)
    }

    fn text(&self) -> String {
        let mut text = format!("{HEAD}\n");
        // Writing to a string cannot fail.
        let _ = self.node.iter().try_for_each(|node| writeln!(text, "node {node}"));
        let _ = self.kept.iter().try_for_each(|(address, value)| writeln!(text, "{address} {}", hex(value)));
        text + END + "\n"
    }

    /// On failure, the line that is not understood, counted from 1.
    fn parse(&mut self, text: &str) -> Result<(), usize> {
        let mut ended = false;
        for (number, line) in (1..).zip(text.lines()) {
            match line.trim() {
                HEAD if number == 1 => {}
                _ if number == 1 || ended => return Err(number),
                END => ended = true,
                line => self.take(line).ok_or(number)?,
            }
        }
        // A file that was cut off is not a new device.
        if ended { Ok(()) } else { Err(text.lines().count().max(1)) }
    }

    fn take(&mut self, line: &str) -> Option<()> {
        let (name, value) = line.split_once(' ').unwrap_or((line, ""));
        if name == "node" {
            self.node = Some(NodeId::new(value.parse().ok()?)?);
            return Some(());
        }
        let (index, sub) = name.split_once(':')?;
        let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
        let bytes = value.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).ok());
        self.kept.insert(address, bytes.collect::<Option<_>>()?);
        Some(())
    }
}

/// CiA 301, 7.5.2.13: all, communication, profile, and for the manufacturer the rest.
fn is_in_group(group: u8, address: Address) -> bool {
    match (group, address.index()) {
        (1, _) => true,
        (2, index) => (0x1000..=0x1FFF).contains(&index),
        (3, index) => (0x6000..=0x9FFF).contains(&index),
        (_, index) => (0x2000..=0x5FFF).contains(&index),
    }
}

impl Storage for Memory {
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
        for &address in self.writable.iter().filter(|address| is_in_group(group, **address)) {
            let entry = od.entry(address)?;
            let mut value = vec![0; od.len(&entry).unwrap_or(0) as usize];
            let len = od.read(&entry, 0, &mut value)?;
            value.truncate(len);
            self.kept.insert(address, value);
        }
        self.save()
    }

    fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
        self.kept.retain(|address, _| !is_in_group(group, *address));
        self.save()
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

    #[test]
    fn what_is_kept_reads_back_as_written() {
        let kept = BTreeMap::from([(Address::new(0x2410, 1), vec![0x64, 0]), (Address::new(0x2000, 0), vec![])]);
        let memory = Memory { kept, node: NodeId::new(5), ..Memory::default() };
        let mut read = Memory::default();
        assert_eq!(read.parse(&memory.text()), Ok(()));
        assert_eq!((read.kept, read.node), (memory.kept, memory.node));
    }

    #[test]
    fn what_was_not_written_by_us_is_refused() {
        for (text, line) in [
            ("", 1),
            ("nonsense\nend\n", 1),
            ("lexican parameters 1\n", 1),
            ("lexican parameters 1\n2410:01 64\n", 2),
            ("lexican parameters 1\nnode 0\nend\n", 2),
            ("lexican parameters 1\n2410:01 XX\nend\n", 2),
            ("lexican parameters 1\nend\nnode 5\n", 3),
        ] {
            assert_eq!(Memory::default().parse(text), Err(line), "{text:?}");
        }
    }
}
