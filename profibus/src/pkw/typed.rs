//! Tasks and replies with the handles and rows that are generated from an overlay's parameters (`[interface.…]`).

use lexican_runtime::object::{self, ParameterRow, Readable, Writable};

use super::{Access, Format, Parameter, Reply, Task, Value};

impl Task {
    /// Reads a parameter, or the element of an array.
    #[must_use]
    pub fn read<T: object::Value, A: Readable>(parameter: object::Parameter<T, A, u16>) -> Self {
        let number = parameter.number();
        match parameter.element() {
            Some(element) => Task::ReadElement { number, index: element.into() },
            None => Task::Read { number },
        }
    }

    /// Writes a parameter, or the element of an array; `None` if the value is out of range, or has no number on this
    /// interface.
    #[must_use]
    pub fn write<T: object::Value, A: Writable>(parameter: object::Parameter<T, A, u16>, value: T) -> Option<Self> {
        let (number, row) = (parameter.number(), parameter.row());
        let raw = parameter.encode(value)? as u32;
        let value = Value::of(Format::of(&row).is_double(), raw);
        Some(match parameter.element() {
            Some(element) => Task::WriteElement { number, index: element.into(), value },
            None => Task::Write { number, value },
        })
    }
}

impl Reply {
    /// The value of the parameter; `None` for another kind of reply, or for a number without a meaning.
    #[must_use]
    pub fn value_of<T: object::Value, A: Readable>(self, parameter: object::Parameter<T, A, u16>) -> Option<T> {
        match self {
            Reply::Value(value) | Reply::Element(value) => parameter.decode(value.number()),
            _ => None,
        }
    }
}

impl Value {
    /// As a number: double words are signed, words are not.
    #[must_use]
    pub fn number(self) -> i64 {
        match self {
            Value::Word(word) => word.into(),
            Value::DoubleWord(double_word) => double_word.cast_signed().into(),
        }
    }
}

impl Format {
    /// The format of a parameter: a word, unless its data type needs two.
    #[must_use]
    pub const fn of(row: &ParameterRow<u16>) -> Self {
        let is_double = matches!(row.data_type.bits(), Some(17..));
        match (is_double, row.elements) {
            (false, 1) => Format::Word,
            (true, 1) => Format::DoubleWord,
            (false, count) => Format::Words(count as u16),
            (true, count) => Format::DoubleWords(count as u16),
        }
    }
}

impl Parameter {
    /// The properties of a parameter in the overlay.
    #[must_use]
    pub const fn of(row: &ParameterRow<u16>) -> Self {
        let access = match row.access {
            object::Access::Ro | object::Access::Const => Access::Read,
            object::Access::Wo => Access::Write,
            object::Access::Rw => Access::ReadWrite,
        };
        let range = match (row.range, row.codes) {
            (_, [(first, _), ..]) => {
                let (mut low, mut high, mut at) = (*first, *first, 1);
                while at < row.codes.len() {
                    let (number, _) = row.codes[at];
                    low = if number < low { number } else { low };
                    high = if number > high { number } else { high };
                    at += 1;
                }
                Some((low as i32, high as i32))
            }
            (Some((low, high)), []) => Some((low as i32, high as i32)),
            (None, []) => None,
        };
        Parameter { number: row.number, access, format: Format::of(row), range, acknowledged_double: false }
    }
}

#[cfg(test)]
mod tests {
    use lexican_runtime::object::{DataType, Parameter as Handle, Ro, Rw};

    use super::*;

    const MODE: Handle<u8, Rw, u16> =
        Handle::new(930, "Mode", object::Access::Rw).within(1, 2).coded(&[(1, 2), (2, 1)]);
    const LIMIT: Handle<i32, Rw, u16> = Handle::new(1016, "Limit", object::Access::Rw).within(-5, 5);
    const FAULTS: Handle<u16, Ro, u16> = Handle::new(945, "Faults", object::Access::Ro).elements(10);
    const TEMPERATURE: Handle<i16, Ro, u16> = Handle::new(1027, "Temperature", object::Access::Ro);

    #[test]
    fn handles_make_tasks_and_read_replies() {
        let word = |value| Reply::Value(Value::Word(value));
        assert_eq!((Task::read(MODE), word(2).value_of(MODE)), (Task::Read { number: 930 }, Some(1)));
        assert_eq!(word(3).value_of(MODE), None);
        assert_eq!(Task::write(MODE, 1), Some(Task::Write { number: 930, value: Value::Word(2) }));
        let limit = Value::DoubleWord(-5_i32 as u32);
        assert_eq!(Task::write(LIMIT, -5), Some(Task::Write { number: 1016, value: limit }));
        assert_eq!((Task::write(LIMIT, -6), Reply::Value(limit).value_of(LIMIT)), (None, Some(-5)));
        let last = FAULTS.at(9).unwrap();
        assert_eq!(Task::read(last), Task::ReadElement { number: 945, index: 9 });
        assert_eq!(Reply::Element(Value::Word(65)).value_of(last), Some(65));
        assert_eq!((word(0xFFC9).value_of(TEMPERATURE), Reply::Count(1).value_of(TEMPERATURE)), (Some(-55), None));
    }

    #[test]
    fn rows_are_what_a_slave_knows() {
        let of = |row| Parameter::of(&row);
        assert_eq!((of(MODE.row()).range, of(MODE.row()).format), (Some((1, 2)), Format::Word));
        assert_eq!((of(LIMIT.row()).range, of(LIMIT.row()).format), (Some((-5, 5)), Format::DoubleWord));
        assert_eq!((of(FAULTS.row()).access, of(FAULTS.row()).format), (Access::Read, Format::Words(10)));
        assert_eq!(of(TEMPERATURE.carried_as(DataType::Integer32).row()).format, Format::DoubleWord);
    }
}
