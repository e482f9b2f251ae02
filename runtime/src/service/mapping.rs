//! Which objects a PDO carries, and moving them between the PDO and the dictionary
//! (CiA 301, 7.5.2.36 and 7.5.2.38).

use super::objects;
use crate::abort::AbortCode;
use crate::object::{self, Address, DataType, Direction, Entry, Mapped, ObjectDictionary, PdoMapping};

/// The objects of a PDO, at most 64 of them, at most 64 bits in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapping {
    // As mapping parameters hold them: half the size of `Mapped`.
    entries: [u32; Mapping::MAX],
    len: u8,
    bits: u8,
}

impl Mapping {
    /// Nothing mapped.
    pub const EMPTY: Mapping = Mapping { entries: [0; Mapping::MAX], len: 0, bits: 0 };

    /// As many objects as there are bits.
    pub const MAX: usize = 64;

    /// The mapping that the dictionary holds at `index`, 1600h or 1A00h and up. It is empty when there
    /// is none, when its length is not 1 to 64 (so also for multiplexed PDOs), or when it has more than 64 bits.
    #[must_use]
    pub fn load(index: u16, od: &mut dyn ObjectDictionary) -> Self {
        let mut mapping = Mapping::EMPTY;
        let len = objects::read_u8(od, index, 0).filter(|&len| usize::from(len) <= Mapping::MAX).unwrap_or(0);
        for sub in 1..=len {
            let pushed =
                objects::read_u32(od, index, sub).is_some_and(|entry| mapping.push(Mapped::from_parameter(entry)));
            if !pushed {
                return Mapping::EMPTY;
            }
        }
        mapping
    }

    /// Appends an object; false, and nothing appended, when it does not fit any more.
    pub fn push(&mut self, mapped: Mapped) -> bool {
        let Some(bits) = self.bits.checked_add(mapped.bits).filter(|&bits| bits <= 64) else { return false };
        let Some(slot) = self.entries.get_mut(usize::from(self.len)) else { return false };
        *slot = mapped.to_parameter();
        self.len += 1;
        self.bits = bits;
        true
    }

    /// The objects, in their order.
    pub fn iter(&self) -> impl Iterator<Item = Mapped> + '_ {
        self.entries.iter().take(usize::from(self.len)).map(|&entry| Mapped::from_parameter(entry))
    }

    /// Whether nothing is mapped.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The length of the PDO in bytes.
    #[must_use]
    pub const fn bytes(&self) -> usize {
        (self.bits as usize).div_ceil(8)
    }

    /// Whether the object is mapped.
    #[must_use]
    pub fn maps(&self, address: Address) -> bool {
        self.iter().any(|mapped| mapped.address == address)
    }

    /// The PDO's data, as the dictionary holds them now; what it does not give is zero.
    #[must_use]
    pub fn pack(&self, od: &mut dyn ObjectDictionary) -> [u8; 8] {
        let (mut raw, mut low) = (0, 0);
        for mapped in self.iter() {
            let value = if is_dummy(mapped) { None } else { objects::read_at(od, mapped.address) };
            raw |= object::place(value.unwrap_or(0), low, mapped.bits);
            low += mapped.bits;
        }
        raw.to_le_bytes()
    }

    /// Writes a PDO's data into the dictionary; what is missing is zero. What the dictionary refuses
    /// does not hold up the rest.
    ///
    /// # Errors
    ///
    /// The first object that was refused, and why.
    pub fn unpack(&self, data: &[u8], od: &mut dyn ObjectDictionary) -> Result<(), (Address, AbortCode)> {
        let mut bytes = [0; 8];
        bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
        let (raw, mut low) = (u64::from_le_bytes(bytes), 0);
        let mut result = Ok(());
        for mapped in self.iter() {
            let value = object::take(raw, low, mapped.bits);
            low += mapped.bits;
            if !is_dummy(mapped)
                && let Err(reason) = write(mapped, value, od)
            {
                result = result.and(Err((mapped.address, reason)));
            }
        }
        result
    }
}

fn write(mapped: Mapped, value: u64, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
    let entry = od.entry(mapped.address)?;
    let size = entry.data_type.size().unwrap_or(usize::from(mapped.bits).div_ceil(8));
    let bytes = value.to_le_bytes();
    od.write(&entry, 0, bytes.get(..size).unwrap_or(&bytes), true)
}

/// Whether an entry only fills space: a data type, 0001h to 001Fh, in the place of an object
/// (CiA 301, 7.4.7.1).
#[must_use]
pub fn is_dummy(mapped: Mapped) -> bool {
    matches!(mapped.address.index(), 0x0001..=0x001F) && mapped.address.sub() == 0
}

/// Whether the dictionary lets an object be mapped. `dummies` has bit n set when data type n may stand
/// for nothing.
///
/// # Errors
///
/// [`AbortCode::NO_SUCH_OBJECT`], [`AbortCode::NO_SUCH_SUB_INDEX`] or [`AbortCode::NOT_MAPPABLE`].
pub fn check(mapped: Mapped, direction: Direction, dummies: u32, od: &dyn ObjectDictionary) -> Result<(), AbortCode> {
    let allowed = if is_dummy(mapped) {
        let code = mapped.address.index();
        let fits = DataType::from_code(code).and_then(DataType::bits) == Some(mapped.bits);
        fits && direction == Direction::Receive && dummies >> code & 1 != 0
    } else {
        let entry = od.entry(mapped.address)?;
        allows(direction, entry.mapping) && length_fits(&entry, mapped.bits)
    };
    if allowed { Ok(()) } else { Err(AbortCode::NOT_MAPPABLE) }
}

const fn allows(direction: Direction, mapping: PdoMapping) -> bool {
    matches!(
        (direction, mapping),
        (_, PdoMapping::Both) | (Direction::Receive, PdoMapping::Rpdo) | (Direction::Transmit, PdoMapping::Tpdo)
    )
}

/// An object is mapped whole; text and bytes are as long as the image has room for.
fn length_fits(entry: &Entry, bits: u8) -> bool {
    match entry.data_type.bits() {
        // A BOOLEAN is one bit, but some data sheets map a whole byte for it.
        Some(1) => bits == 1 || bits == 8,
        Some(size) => size == bits,
        None => (1..=64).contains(&bits) && bits.is_multiple_of(8) && u16::from(bits / 8) <= entry.capacity,
    }
}
