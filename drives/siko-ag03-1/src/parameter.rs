//! The parameters of chapter 6 (table 6): the object and the set of each.

pub use lexican_driver::{Parameter, ParameterSet};
use lexican_runtime::object::DataType::{Unsigned8 as U8, Unsigned16 as U16};
use siko::description::{parameters, row};

/// All parameters, by number: those of all SIKO drives, and six more. The table refers parameter 12 to 2410h:02, a
/// misprint for 6091h:02. `*` in it marks the set [`Controller`](ParameterSet::Controller) (1011h:03), `**` the set
/// [`Standard`](ParameterSet::Standard) (1011h:02).
pub const PARAMETERS: &[Parameter; 27] = &parameters(&[
    row(25, 0x2416, 0x00, U8, ParameterSet::Standard),
    row(26, 0x2417, 0x00, U8, ParameterSet::Standard),
    row(27, 0x2418, 0x00, U16, ParameterSet::Standard),
    row(29, 0x2421, 0x00, U8, ParameterSet::Standard),
    row(30, 0x2450, 0x00, U8, ParameterSet::Standard),
    row(31, 0x2410, 0x0A, U8, ParameterSet::Controller),
]);

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
