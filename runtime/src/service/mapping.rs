//! Which objects a PDO carries, and moving them between the PDO and the dictionary
//! (CiA 301, 7.5.2.36 and 7.5.2.38).

use super::objects;
use crate::abort::AbortCode;
use crate::cia301;
use crate::object::{self, Address, DataType, Direction, Entry, Mapped, ObjectDictionary, PdoMapping};

/// The objects of a PDO, at most `N` of them, at most 64 bits in all. 64 are as many objects as there are bits.
#[derive(Clone, Copy, Debug)]
pub struct Mapping<const N: usize = 64> {
    // As mapping parameters hold them: half the size of `Mapped`. Behind `len` they are 0.
    entries: [u32; N],
    // 1 + where in the dictionary's image each byte of the PDO is copied from or to; 0 if the dictionary is asked for its object.
    places: [u16; 8],
    len: u8,
    bits: u8,
}

impl<const N: usize> PartialEq for Mapping<N> {
    fn eq(&self, other: &Self) -> bool {
        self.len == other.len && self.entries.iter().zip(&other.entries).all(|(one, other)| one == other)
    }
}

impl<const N: usize> Eq for Mapping<N> {}

impl<const N: usize> Mapping<N> {
    /// Nothing mapped.
    pub const EMPTY: Self = Mapping { entries: [0; N], places: [0; 8], len: 0, bits: 0 };

    /// The mapping that the dictionary holds at `index`, 1600h or 1A00h and up. It is empty when there
    /// is none, when its length is not 1 to `N` (so also for multiplexed PDOs), or when it has more than 64 bits.
    #[must_use]
    pub fn load(index: u16, od: &mut (impl ObjectDictionary + ?Sized)) -> Self {
        let len = objects::read_u8(od, index, 0).filter(|&len| usize::from(len) <= N).unwrap_or(0);
        let mut mapping = Mapping::EMPTY;
        for at in 0..len {
            let pushed =
                objects::read_u32(od, index, at + 1).is_some_and(|entry| mapping.push(Mapped::from_parameter(entry)));
            if !pushed {
                mapping = Mapping::EMPTY;
                break;
            }
        }
        mapping.find_places(index, od);
        mapping
    }

    /// Finds out which bytes a PDO with the mapping parameter `index` copies.
    fn find_places(&mut self, index: u16, od: &(impl ObjectDictionary + ?Sized)) {
        let mut places = [0; 8];
        for (mapped, low) in self.placed() {
            // Of an object that is mapped twice, the last value counts.
            let is_once = self.iter().filter(|other| other.address == mapped.address).count() == 1;
            if let Some(offset) = copied_from(mapped, low, index, od).filter(|_| is_once) {
                let bytes = places.iter_mut().skip(usize::from(low / 8)).take(usize::from(mapped.bits / 8));
                bytes.zip(offset + 1..).for_each(|(place, next)| *place = next);
            }
        }
        self.places = places;
    }

    /// Appends an object; false, and nothing appended, when it does not fit any more.
    pub fn push(&mut self, mapped: Mapped) -> bool {
        let Some(bits) = bits_with(self.bits, mapped) else { return false };
        let Some(slot) = self.entries.get_mut(usize::from(self.len)) else { return false };
        *slot = mapped.to_parameter();
        self.len += 1;
        self.bits = bits;
        true
    }

    /// The objects, in their order.
    pub fn iter(&self) -> impl Iterator<Item = Mapped> + '_ {
        let entries = self.entries.get(..usize::from(self.len)).unwrap_or(&self.entries);
        entries.iter().map(|&entry| Mapped::from_parameter(entry))
    }

    /// The objects, each with its lowest bit in the PDO.
    fn placed(&self) -> impl Iterator<Item = (Mapped, u8)> {
        self.iter().scan(0, |next, mapped| {
            let low = *next;
            *next += mapped.bits;
            Some((mapped, low))
        })
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

    /// Whether an object from `first` to `last` is mapped.
    pub(crate) fn maps_between(&self, first: Address, last: Address) -> bool {
        self.iter().any(|mapped| (first..=last).contains(&mapped.address))
    }

    /// Whether any object is in both mappings.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        self.iter().any(|mapped| other.maps(mapped.address))
    }

    /// The PDO's data, as the dictionary holds them now; an object that cannot be read is zero.
    #[must_use]
    pub fn pack(&self, od: &mut (impl ObjectDictionary + ?Sized)) -> [u8; 8] {
        let (image, mut data, mut is_complete) = (od.image(), [0; 8], true);
        for (byte, &place) in data.iter_mut().zip(&self.places).take(self.bytes()) {
            match image.get(usize::from(place).wrapping_sub(1)) {
                Some(held) => *byte = *held,
                None => is_complete = false,
            }
        }
        if is_complete { data } else { self.pack_asked(data, od) }
    }

    /// Writes the data of a PDO that is received into the dictionary; what is missing is zero. What the dictionary refuses
    /// does not hold up the rest.
    pub fn unpack(&self, data: &[u8], od: &mut (impl ObjectDictionary + ?Sized)) -> Result<(), (Address, AbortCode)> {
        let (image, data, mut is_complete) = (od.image(), object::number(data).to_le_bytes(), true);
        for (byte, &place) in data.iter().zip(&self.places).take(self.bytes()) {
            match image.get_mut(usize::from(place).wrapping_sub(1)) {
                Some(held) => *held = *byte,
                None => is_complete = false,
            }
        }
        if is_complete { Ok(()) } else { self.unpack_asked(data, od) }
    }

    /// The objects that are not copied from or to an image of so many bytes.
    fn asked(&self, image: usize) -> impl Iterator<Item = (Mapped, u8)> {
        let place = |low: u8| self.places.get(usize::from(low / 8)).map_or(0, |&place| usize::from(place));
        self.placed().filter(move |&(mapped, low)| !(1..=image).contains(&place(low)) && !is_dummy(mapped))
    }

    #[inline(never)]
    fn pack_asked(&self, data: [u8; 8], od: &mut (impl ObjectDictionary + ?Sized)) -> [u8; 8] {
        let mut raw = u64::from_le_bytes(data);
        for (mapped, low) in self.asked(od.image().len()) {
            raw |= object::place(objects::read_at(od, mapped.address).unwrap_or(0), low, mapped.bits);
        }
        raw.to_le_bytes()
    }

    #[inline(never)]
    fn unpack_asked(
        &self,
        data: [u8; 8],
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Result<(), (Address, AbortCode)> {
        let mut result = Ok(());
        for (mapped, low) in self.asked(od.image().len()) {
            let value = object::take(u64::from_le_bytes(data), low, mapped.bits);
            let written = objects::write_at(od, mapped.address, value, usize::from(mapped.bits).div_ceil(8));
            result = result.and(written.map_err(|reason| (mapped.address, reason)));
        }
        result
    }
}

/// Where in the image a PDO copies an object from or to, which begins at bit `low`: a number of whole bytes, and, in a PDO
/// that is received, without limits.
fn copied_from(mapped: Mapped, low: u8, index: u16, od: &(impl ObjectDictionary + ?Sized)) -> Option<u16> {
    let entry = od.entry(mapped.address).ok()?;
    let is_limited = index < cia301::TPDO_1 && entry.limit > 0;
    let is_whole = (low | mapped.bits).is_multiple_of(8) && entry.data_type.bits() == Some(mapped.bits);
    let has_place = entry.offset + u32::from(entry.capacity) <= u16::MAX.into();
    (is_whole && !is_limited && has_place).then_some(entry.offset as u16)
}

/// How many bits a PDO has with another object behind `bits`; `None` if they are more than 64.
pub(crate) fn bits_with(bits: u8, mapped: Mapped) -> Option<u8> {
    bits.checked_add(mapped.bits).filter(|&bits| bits <= 64)
}

/// Whether an entry only fills space: a data type, 0001h to 001Fh, in the place of an object
/// (CiA 301, 7.4.7.1).
#[must_use]
pub fn is_dummy(mapped: Mapped) -> bool {
    matches!(mapped.address.index(), 0x0001..=0x001F) && mapped.address.sub() == 0
}

/// Whether the dictionary lets an object be mapped. `dummies` has bit n set when data type n may fill
/// space.
///
/// Errors: [`AbortCode::NO_SUCH_OBJECT`], [`AbortCode::NO_SUCH_SUB_INDEX`] or [`AbortCode::NOT_MAPPABLE`].
pub fn check(
    mapped: Mapped,
    direction: Direction,
    dummies: u32,
    od: &(impl ObjectDictionary + ?Sized),
) -> Result<(), AbortCode> {
    let allowed = if is_dummy(mapped) {
        let code = mapped.address.index();
        let fits = DataType::bits_of_code(code) == Some(mapped.bits);
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

/// An object is mapped whole; text and bytes are as long as the image has room for. A type that the device defines
/// itself (DEFTYPE) is held in the smallest UNSIGNED that has its bits: 12 bits are an UNSIGNED16.
fn length_fits(entry: &Entry, bits: u8) -> bool {
    match (entry.data_type, entry.data_type.size()) {
        // A BOOLEAN is one bit, but some data sheets map a whole byte for it.
        (DataType::Boolean, _) => bits == 1 || bits == 8,
        (data_type, Some(size)) if data_type.is_unsigned() => usize::from(bits).div_ceil(8) == size,
        (data_type, Some(_)) => data_type.bits() == Some(bits),
        (_, None) => (1..=64).contains(&bits) && bits.is_multiple_of(8) && u16::from(bits / 8) <= entry.capacity,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::NodeId;
    use crate::object::{Access, Dictionary, Layer, Limit, Row, Table};
    use crate::testing::TestOd;
    use std::vec::Vec;

    fn od() -> TestOd {
        TestOd::new(
            "1A00:00 u8  rw - 3
             1A00:01 u32 rw - 0x20000101
             1A00:02 u32 rw - 0x20000208
             1A00:03 u32 rw - 0x20000310
             1A01:00 u8  rw - 2
             1A01:01 u32 rw - 0x20000440
             1A01:02 u32 rw - 0x20000101
             1A02:00 u8  rw - 254
             1A03:00 u8  rw - 2
             1A03:01 u32 rw - 0x20000101
             2000:01 u1  rw both 1
             2000:02 u8  ro tpdo 0x81
             2000:03 i16 rw rpdo -2
             2000:04 u64 rw both 0
             2001:00 text rw both abc",
        )
    }

    #[test]
    fn a_mapping_is_loaded_whole_or_not_at_all() {
        let mapping = Mapping::<64>::load(0x1A00, &mut od());
        assert_eq!((mapping.iter().count(), mapping.bytes()), (3, 4));
        assert!(mapping.maps(Address::new(0x2000, 3)) && !mapping.maps(Address::new(0x2000, 4)));
        // 65 bits, a multiplexed PDO, an entry that is missing, no mapping.
        for index in [0x1A01, 0x1A02, 0x1A03, 0x1A04] {
            assert_eq!(Mapping::<64>::load(index, &mut od()), Mapping::EMPTY, "{index:04X}");
        }
    }

    #[test]
    fn what_is_packed_is_unpacked() {
        let mut od = od();
        let mapping = Mapping::<64>::load(0x1A00, &mut od);
        let data = mapping.pack(&mut od);
        // 1 bit, 8 bits, 16 bits, from the lowest up.
        assert_eq!(u64::from_le_bytes(data), 1 | 0x81 << 1 | 0xFFFE << 9);
        [1, 2, 3].into_iter().for_each(|sub| od.set(0x2000, sub, 0));
        assert_eq!(mapping.unpack(&data, &mut od), Ok(()));
        assert_eq!([1, 2, 3].map(|sub| od.get(0x2000, sub)), [1, 0x81, 0xFFFE]);
    }

    /// A dictionary that is asked for every object.
    struct Asked(Dictionary<22>);

    impl Layer for Asked {
        type Under = Dictionary<22>;

        fn under(&self) -> &Self::Under {
            &self.0
        }

        fn under_mut(&mut self) -> &mut Self::Under {
            &mut self.0
        }
    }

    #[test]
    fn what_is_copied_is_what_the_dictionary_would_give_and_take() {
        const fn row(sub: u8, data_type: DataType) -> Row {
            Row::new(0x2000, sub, data_type, Access::Rw, PdoMapping::Both)
        }
        static ROWS: [Row; 6] = [
            row(1, DataType::Boolean).at(0, 1),
            row(2, DataType::Unsigned8).at(1, 1).limited(0),
            row(3, DataType::Integer16).at(2, 2),
            row(4, DataType::Unsigned24).at(4, 3),
            row(5, DataType::VisibleString).at(9, 5),
            row(6, DataType::Unsigned64).at(14, 8),
        ];
        static TABLE: Table = Table { rows: &ROWS, limits: &[Limit { low: 1, high: 0x7F }], image: &[0; 22] };
        let bits = [(0, 3), (1, 1), (1, 8), (2, 8), (2, 5), (3, 16), (4, 24), (4, 20), (5, 16), (6, 64), (7, 8)];
        let objects = bits.map(|(sub, bits)| Mapped::new(0x2000, sub, bits)).into_iter().chain([Mapped::new(5, 0, 8)]);
        let objects: Vec<_> = objects.collect();
        let [mut copies, mut asks] = [0, 0];
        for at in 0..objects.len().pow(3) {
            let node = NodeId::literal(1);
            let mut od = Dictionary::<22>::new(&TABLE, node);
            let mut mapping = Mapping::<64>::EMPTY;
            for place in 0..3 {
                mapping.push(objects[at / objects.len().pow(place) % objects.len()]);
            }
            for parameter in [0x1600, 0x1A00] {
                mapping.find_places(parameter, &od);
                copies += mapping.placed().count() - mapping.asked(22).count();
                asks += mapping.asked(22).count();
                for data in [[0x55; 8], [0xFF; 8], [1, 2, 3, 4, 5, 6, 7, 8], [0; 8]] {
                    let mut asked = Asked(od.clone());
                    if parameter == 0x1600 {
                        assert_eq!(mapping.unpack(&data, &mut od), mapping.unpack(&data, &mut asked), "{mapping:?}");
                    }
                    assert_eq!(od.image(), asked.0.image(), "{mapping:?}");
                    assert_eq!(mapping.pack(&mut od), mapping.pack(&mut asked), "{mapping:?}");
                }
            }
        }
        assert!(copies > 1000 && asks > 1000, "{copies} {asks}");
    }

    #[test]
    fn what_may_be_mapped_depends_on_direction_and_length() {
        let check = |sub, bits, direction| check(Mapped::new(0x2000, sub, bits), direction, 0, &od());
        assert_eq!(check(2, 8, Direction::Transmit), Ok(()));
        assert_eq!(check(2, 8, Direction::Receive), Err(AbortCode::NOT_MAPPABLE));
        assert_eq!(check(3, 16, Direction::Receive), Ok(()));
        assert_eq!(check(3, 16, Direction::Transmit), Err(AbortCode::NOT_MAPPABLE));
        assert_eq!(check(3, 8, Direction::Receive), Err(AbortCode::NOT_MAPPABLE));
        assert_eq!(check(1, 1, Direction::Receive), Ok(()));
        assert_eq!(check(9, 8, Direction::Receive), Err(AbortCode::NO_SUCH_SUB_INDEX));
        // A DEFTYPE of 60 bits is an UNSIGNED64 here; one of 56 bits would be an UNSIGNED56.
        for (bits, expected) in [(57, Ok(())), (60, Ok(())), (64, Ok(())), (56, Err(AbortCode::NOT_MAPPABLE))] {
            assert_eq!(check(4, bits, Direction::Transmit), expected, "{bits} bits");
        }
        assert_eq!(check(2, 1, Direction::Transmit), Ok(()));
        for (sub, bits) in [(2, 0), (2, 9), (3, 12)] {
            assert_eq!(check(sub, bits, Direction::Receive), Err(AbortCode::NOT_MAPPABLE), "{sub}: {bits} bits");
        }
        let text = |bits| super::check(Mapped::new(0x2001, 0, bits), Direction::Receive, 0, &od());
        assert_eq!((text(24), text(25)), (Ok(()), Err(AbortCode::NOT_MAPPABLE)));
    }
}
