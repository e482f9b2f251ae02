//! The parameters of chapter 6 (table 6): which object holds which, and to which set it belongs.

pub use lexican_driver::{Parameter, ParameterSet};
use lexican_runtime::object::{Address, DataType};

const fn row(number: u8, index: u16, sub: u8, data_type: DataType, set: ParameterSet) -> Parameter {
    Parameter { number, address: Address::new(index, sub), data_type, set }
}

/// All parameters, by number. Number 24 is one parameter in two objects, one for each operating mode; the
/// table points parameter 12 to 2410h:02, which is a misprint for 6091h:02. `*` in the table is the set
/// [`Controller`](ParameterSet::Controller) (1011h:03), `**` is [`Standard`](ParameterSet::Standard) (1011h:02).
pub const PARAMETERS: &[Parameter] = {
    use DataType::{Integer32 as I32, Unsigned8 as U8, Unsigned16 as U16};
    use ParameterSet::{Controller, Standard};
    &[
        row(1, 0x2410, 0x01, U16, Controller),
        row(2, 0x2410, 0x02, U16, Controller),
        row(3, 0x2410, 0x03, U16, Controller),
        row(4, 0x2410, 0x04, U8, Controller),
        row(5, 0x2410, 0x05, U8, Controller),
        row(6, 0x2410, 0x06, U8, Controller),
        row(8, 0x2410, 0x08, U8, Controller),
        row(9, 0x2410, 0x09, U8, Controller),
        row(10, 0x6067, 0x00, U16, Standard),
        row(11, 0x6091, 0x01, U16, Standard),
        row(12, 0x6091, 0x02, U16, Standard),
        row(13, 0x2412, 0x00, U16, Standard),
        row(14, 0x607C, 0x00, I32, Standard),
        row(15, 0x607D, 0x02, I32, Standard),
        row(16, 0x607D, 0x01, I32, Standard),
        row(17, 0x2415, 0x00, I32, Standard),
        row(18, 0x607E, 0x00, U8, Standard),
        row(19, 0x2413, 0x00, U8, Standard),
        row(20, 0x6060, 0x00, U8, Standard),
        row(24, 0x607A, 0x00, I32, Standard),
        row(24, 0x60FF, 0x00, I32, Standard),
        row(25, 0x2416, 0x00, U8, Standard),
        row(26, 0x2417, 0x00, U8, Standard),
        row(27, 0x2418, 0x00, U16, Standard),
        row(29, 0x2421, 0x00, U8, Standard),
        row(30, 0x2450, 0x00, U8, Standard),
        row(31, 0x2410, 0x0A, U8, Controller),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::od;

    #[test]
    fn the_data_sheet_has_the_same_types() {
        for parameter in PARAMETERS {
            let entry = od::TABLE.entry(parameter.address).expect("a parameter is an object");
            assert_eq!(parameter.data_type, entry.data_type, "{}", parameter.address);
        }
    }
}
