//! A dictionary for tests, written as a table. Unit tests and integration tests share this file, so that
//! it speaks of the crate by its name.

use std::collections::BTreeMap;
use std::vec::Vec;

use lexican_runtime::AbortCode;
use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary, PdoMapping};

/// A dictionary that holds what a table says.
#[derive(Clone, Debug, Default)]
pub struct TestOd {
    entries: BTreeMap<Address, (Entry, Vec<u8>)>,
}

impl TestOd {
    /// One entry per line: `6040:00 u16 rw rpdo 0x0000`; types u1, u8, u16, u24, u32, u64, i8, i16, i32 and
    /// text; the mapping is one of `-`, `rpdo`, `tpdo`, `both`.
    pub fn new(table: &str) -> Self {
        let mut od = TestOd::default();
        table.lines().map(str::trim).filter(|line| !line.is_empty()).for_each(|line| od.add(line));
        od
    }

    /// With more entries, or entries in the place of others.
    pub fn with(mut self, table: &str) -> Self {
        self.entries.extend(TestOd::new(table).entries);
        self
    }

    /// Without the entries of an index.
    pub fn without(mut self, index: u16) -> Self {
        self.entries.retain(|address, _| address.index() != index);
        self
    }

    fn add(&mut self, line: &str) {
        let [address, data_type, access, mapping, value] =
            line.split_whitespace().collect::<Vec<_>>().try_into().expect("five words per line");
        let (index, sub) = address.split_once(':').expect("index:sub");
        let address = Address::new(u16::from_str_radix(index, 16).unwrap(), u8::from_str_radix(sub, 16).unwrap());
        let data_type = match data_type {
            "u1" => DataType::Boolean,
            "u8" => DataType::Unsigned8,
            "u16" => DataType::Unsigned16,
            "u24" => DataType::Unsigned24,
            "u32" => DataType::Unsigned32,
            "u64" => DataType::Unsigned64,
            "i8" => DataType::Integer8,
            "i16" => DataType::Integer16,
            "i32" => DataType::Integer32,
            "text" => DataType::VisibleString,
            other => panic!("no type {other}"),
        };
        let bytes = match data_type.size() {
            None => value.as_bytes().to_vec(),
            Some(size) => {
                let value = match value.strip_prefix("0x") {
                    Some(hex) => i128::from_str_radix(hex, 16).unwrap(),
                    None => value.parse().unwrap(),
                };
                value.to_le_bytes()[..size].to_vec()
            }
        };
        let access = match access {
            "ro" => Access::Ro,
            "wo" => Access::Wo,
            "rw" => Access::Rw,
            "const" => Access::Const,
            other => panic!("no access {other}"),
        };
        let mapping = match mapping {
            "-" => PdoMapping::None,
            "rpdo" => PdoMapping::Rpdo,
            "tpdo" => PdoMapping::Tpdo,
            "both" => PdoMapping::Both,
            other => panic!("no mapping {other}"),
        };
        let capacity = bytes.len().max(8) as u16;
        let entry = Entry { address, data_type, access, mapping, offset: 0, capacity, limit: 0, plus_node: false };
        self.entries.insert(address, (entry, bytes));
    }

    /// The number at `index:sub`.
    pub fn get(&self, index: u16, sub: u8) -> u64 {
        let (_, bytes) = &self.entries[&Address::new(index, sub)];
        bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
    }

    /// Sets the number at `index:sub`.
    pub fn set(&mut self, index: u16, sub: u8, value: u64) {
        let (_, bytes) = self.entries.get_mut(&Address::new(index, sub)).expect("the entry exists");
        let len = bytes.len();
        bytes.copy_from_slice(&value.to_le_bytes()[..len]);
    }
}

impl ObjectDictionary for TestOd {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        match self.entries.get(&address) {
            Some((entry, _)) => Ok(*entry),
            None => {
                let object = Address::new(address.index(), 0)..=Address::new(address.index(), 0xFF);
                let exists = self.entries.range(object).next().is_some();
                Err(if exists { AbortCode::NO_SUCH_SUB_INDEX } else { AbortCode::NO_SUCH_OBJECT })
            }
        }
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        Some(self.entries[&entry.address].1.len() as u32)
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        let bytes = self.entries[&entry.address].1.get(offset as usize..).unwrap_or(&[]);
        let len = bytes.len().min(buffer.len());
        buffer[..len].copy_from_slice(&bytes[..len]);
        Ok(len)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], _last: bool) -> Result<(), AbortCode> {
        match entry.data_type.size() {
            Some(size) if data.len() < size => return Err(AbortCode::LENGTH_TOO_LOW),
            Some(size) if data.len() > size => return Err(AbortCode::LENGTH_TOO_HIGH),
            _ => {}
        }
        let (_, bytes) = self.entries.get_mut(&entry.address).expect("the entry came from here");
        bytes.truncate(offset as usize);
        bytes.extend_from_slice(data);
        Ok(())
    }
}
