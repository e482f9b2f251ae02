//! Decodes many frames of one PDO at once: one column of numbers per entry.

use lexican_eds::model::Value;
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::Address;
use lexican_runtime::{Frame, Instant};

use crate::log::{LogError, Reader};
use crate::pdo::PdoState;
use crate::values::DeviceValues;
use crate::values::wire::of_bits;

/// One entry of a PDO, to decode its numbers in any number of frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The entry.
    pub address: Address,
    /// The name of the entry; if another column has the same, preceded by the name of its object or by its address.
    pub name: String,
    /// The unit of the numbers; `None` for counts of the device.
    pub unit: Option<String>,
    data_type: DataType,
    /// Factor and divisor for the unit.
    scale: Option<(f64, f64)>,
    low: u32,
    bits: u8,
}

/// The numbers of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Counts of the device.
    Integers(Vec<i64>),
    /// Counts that do not fit `i64`.
    Unsigned(Vec<u64>),
    /// Numbers in the unit, or of a REAL type.
    Reals(Vec<f64>),
}

impl Column {
    /// The columns of a PDO without dummy entries, in the units that hold by the values seen. Bits of entries that the
    /// data sheet lacks become numbers.
    #[must_use]
    pub fn of_pdo(values: &DeviceValues<'_>, pdo: &PdoState) -> Vec<Column> {
        let (mut columns, mut low) = (Vec::<Column>::new(), 0);
        for mapped in &pdo.mapping {
            let (address, bits) = (mapped.address, mapped.bits);
            let at = low;
            low += u32::from(bits);
            let entry = values.entry(address);
            if bits == 0 || low > 64 || entry.is_none() && DataType::from_code(address.index()).bits().is_some() {
                continue;
            }
            let names = entry.map(|entry| [entry.name.clone(), values.name(entry)]).into_iter().flatten();
            let name = names.chain([address.to_string()]).find(|name| columns.iter().all(|other| other.name != *name));
            // A REAL is in its unit already.
            let counts = entry.filter(|entry| entry.data_type.class() != Class::Real);
            let unit = counts.and_then(|entry| values.unit(entry));
            columns.push(Column {
                address,
                name: name.unwrap_or_else(|| format!("{address} at bit {at}")),
                unit: unit.map(|unit| unit.symbol.clone()),
                data_type: entry.map_or(DataType::Unsigned64, |entry| entry.data_type),
                scale: unit.map(|unit| (unit.num as f64, unit.den as f64)),
                low: at,
                bits,
            });
        }
        columns
    }

    /// The numbers of frames, given as little-endian words.
    #[must_use]
    pub fn numbers(&self, frames: &[u64]) -> Numbers {
        let up = 64 - u32::from(self.bits.clamp(1, 64));
        let low = self.low;
        let unsigned = frames.iter().map(|raw| (raw >> low) << up >> up);
        let signed = frames.iter().map(|raw| ((raw >> low) << up).cast_signed() >> up);
        match (self.data_type.class(), self.scale) {
            (Class::Real, _) => Numbers::Reals(unsigned.map(|raw| self.real(raw)).collect()),
            (Class::Signed, Some((num, den))) => Numbers::Reals(signed.map(|it| it as f64 * num / den).collect()),
            (Class::Signed, None) => Numbers::Integers(signed.collect()),
            (_, Some((num, den))) => Numbers::Reals(unsigned.map(|it| it as f64 * num / den).collect()),
            (_, None) if self.bits < 64 => Numbers::Integers(unsigned.map(u64::cast_signed).collect()),
            (_, None) => Numbers::Unsigned(unsigned.collect()),
        }
    }

    /// A REAL; NaN if its size is not that of its type.
    fn real(&self, raw: u64) -> f64 {
        match of_bits(self.data_type, self.bits, raw) {
            Value::Real(number) => number,
            _ => f64::NAN,
        }
    }
}

/// The bytes of a frame as a little-endian number, filled up with zeros.
#[must_use]
pub fn word(data: &[u8]) -> u64 {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    u64::from_le_bytes(bytes)
}

/// The times and data of a PDO in a log. Frames shorter than its mapping are left out, as receivers ignore them (CiA
/// 301, 7.2.2.4).
pub fn of_log(log: Reader, pdo: &PdoState) -> Result<(Vec<Instant>, Vec<u64>), LogError> {
    let is_wanted =
        |frame: &Frame| frame.id() == pdo.cob_id.id() && !frame.is_remote() && u32::from(frame.dlc()) * 8 >= pdo.bits();
    let (mut times, mut words) = (Vec::new(), Vec::new());
    for record in log {
        let record = record?;
        if is_wanted(&record.frame) {
            times.push(record.at);
            words.push(word(record.frame.data()));
        }
    }
    Ok((times, words))
}

#[cfg(test)]
mod tests {
    use lexican_eds::model::{self, Device};
    use lexican_runtime::NodeId;
    use lexican_runtime::object::Mapped;
    use lexican_runtime::wire::pdo::PdoCobId;

    use super::*;
    use crate::decode::content;
    use crate::pdo::PdoName;
    use crate::samples;

    const NODE: NodeId = NodeId::literal(5);

    /// The numbers of a column, in the form of [`content`].
    fn numbers(numbers: Numbers) -> Vec<(Option<i128>, Option<f64>)> {
        match numbers {
            Numbers::Integers(all) => all.into_iter().map(|it| (Some(it.into()), None)).collect(),
            Numbers::Unsigned(all) => all.into_iter().map(|it| (Some(it.into()), None)).collect(),
            Numbers::Reals(all) => all.into_iter().map(|it| (None, Some(it))).collect(),
        }
    }

    /// Checks that decoding all frames at once equals decoding them one by one.
    fn check(device: &Device, pdo: &PdoState) {
        let frames: Vec<u64> = (0..200_u64).map(|it| it.wrapping_mul(0x9E37_79B9_7F4A_7C15)).collect();
        let mapping = pdo.mapping.iter();
        let mapping =
            mapping.map(|it| model::Mapped { index: it.address.index(), sub: it.address.sub(), bits: it.bits });
        let mapping: Vec<_> = mapping.collect();
        let columns = Column::of_pdo(&DeviceValues::new(device), pdo);
        let all: Vec<_> = columns.iter().map(|column| numbers(column.numbers(&frames))).collect();
        for (at, frame) in frames.iter().enumerate() {
            let one = content(&mut DeviceValues::new(device), &mapping, &frame.to_le_bytes());
            assert_eq!(one.len(), columns.len());
            for ((report, column), numbers) in one.iter().zip(&columns).zip(&all) {
                let expected = match (&report.unit, &report.value) {
                    (Some((_, scaled)), _) => (None, Some(*scaled)),
                    (None, Some(Value::Real(number))) => (None, Some(*number)),
                    (None, value) => (value.as_ref().and_then(Value::as_integer), None),
                };
                assert_eq!(numbers[at], expected, "{}", column.name);
                assert_eq!(report.unit.as_ref().map(|(unit, _)| unit), column.unit.as_ref(), "{}", column.name);
            }
        }
    }

    fn pdo(mapping: &[(u16, u8, u8)]) -> PdoState {
        let mapping =
            mapping.iter().map(|(index, sub, bits)| Mapped { address: Address::new(*index, *sub), bits: *bits });
        PdoState { cob_id: PdoCobId(0x185), mapping: mapping.collect(), ..pdo_of(&samples::drive()) }
    }

    fn pdo_of(device: &Device) -> PdoState {
        PdoState::of_sheet(device, NODE, "tpdo3".parse().unwrap()).unwrap()
    }

    #[test]
    fn columns_are_what_single_frames_are() {
        let device = samples::drive();
        for name in PdoName::of_sheet(&device) {
            check(&device, &PdoState::of_sheet(&device, NODE, name).unwrap());
        }
        // A quantity, odd bits, a dummy entry, an entry that the data sheet lacks, and eight bytes.
        check(&device, &pdo(&[(0x241B, 1, 16), (0x6041, 0, 3), (5, 0, 8), (0x6064, 0, 21), (0x2FFF, 7, 16)]));
        check(&device, &pdo(&[(0x2FFF, 7, 64)]));
    }

    #[test]
    fn each_column_has_a_name_of_its_own() {
        let mapped = (0x6041, 0, 16);
        let columns = Column::of_pdo(&DeviceValues::new(&samples::drive()), &pdo(&[mapped, mapped, mapped, mapped]));
        let names: Vec<_> = columns.iter().map(|column| &*column.name).collect();
        assert_eq!(names, ["Statusword", "6041:00", "6041:00 at bit 32", "6041:00 at bit 48"]);
    }

    #[test]
    fn short_and_other_frames_of_a_log_are_left_out() {
        let text = "(1.000000) can0 385#400205000000\n(2.000000) can0 385#4002\n(3.000000) can0 385#R\n\
                    (4.000000) can0 185#4002\n(5.500000) can0 385#4102FFFFFFFF\n";
        let log = Reader::new("log", text.as_bytes(), None).unwrap();
        let (times, words) = of_log(log, &pdo_of(&samples::drive())).unwrap();
        assert_eq!(times, [Instant::from_micros(1_000_000), Instant::from_micros(5_500_000)]);
        assert_eq!(words, [0x0005_0240, 0xFFFF_FFFF_0241]);
    }
}
