//! Parameters by PROFIBUS number (PNU, table 15): the rows of `od::profibus`, from the overlays of the data sheets.

use lexican_profibus::pkw::Parameter;
use lexican_runtime::object::{Address, ParameterRow};
use siko_ag02::od as ag02;
use siko_ag03_1::od as ag03_1;

/// A parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Its form in the PKW.
    pub wire: Parameter,
    /// Its row in the overlay: name, object, numbers.
    pub parameter: ParameterRow<u16>,
    /// What it holds.
    pub content: Content,
}

/// The content of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A CANopen object, or the elements of an array, with the numbers of [`Row::parameter`].
    Object(Address),
    /// The address of the slave, which is not that of CAN (2101h).
    Address,
    /// The version of the PROFIBUS firmware in BCD, which is not that of 100Ah.
    Version,
    /// Commands by number, which 1011h and clearing 1003h have on CANopen.
    Load,
    /// Parameter 25, for which the AG02 has no object.
    InchingStop,
}

impl Row {
    const fn new(parameter: ParameterRow<u16>) -> Self {
        const LOAD: u16 = ag02::profibus::LOAD_DATA_RECORD.number();
        let content = match (parameter.object, parameter.number) {
            (Some(object), _) => Content::Object(object),
            (None, number) if number == ag02::profibus::PROFIBUS_ADDRESS.number() => Content::Address,
            (None, number) if number == ag02::profibus::SOFTWARE_VERSION.number() => Content::Version,
            (None, LOAD) => Content::Load,
            (None, number) if number == ag02::profibus::STOP_MODE_INCHING_MODE_2.number() => Content::InchingStop,
            (None, _) => panic!("a parameter without an object that this crate does not know"),
        };
        // Marked "word*" in table 15.
        let acknowledged_double = parameter.number == LOAD;
        Row { wire: Parameter { acknowledged_double, ..Parameter::of(&parameter) }, parameter, content }
    }
}

const fn rows<const N: usize>(table: &[ParameterRow<u16>]) -> [Row; N] {
    let mut rows = [Row::new(table[0]); N];
    let mut at = 1;
    while at < N {
        rows[at] = Row::new(table[at]);
        at += 1;
    }
    rows
}

/// The parameters of the AG02, by number.
pub static AG02: &[Row] = &rows::<{ ag02::profibus::TABLE.len() }>(ag02::profibus::TABLE);
/// The parameters of the AG03/1, by number.
pub static AG03_1: &[Row] = &rows::<{ ag03_1::profibus::TABLE.len() }>(ag03_1::profibus::TABLE);

/// The row with this number.
#[must_use]
pub fn find(table: &'static [Row], number: u16) -> Option<&'static Row> {
    table.iter().find(|row| row.wire.number == number)
}
