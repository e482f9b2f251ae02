//! The slave's side: carries out each task once, and repeats the answer until there is another task.

use super::{Pkw, Refusal, Reply, Task, Value};

/// The properties of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// PNU.
    pub number: u16,
    /// What a master may do with it.
    pub access: Access,
    /// Its width, and the number of elements of an array.
    pub format: Format,
    /// The lowest and the highest value, as a signed number; `None` if every number is allowed.
    pub range: Option<(i32, i32)>,
    /// Whether writing a word is answered by a double word.
    pub acknowledged_double: bool,
}

/// What a master may do with a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Access {
    Read,
    Write,
    ReadWrite,
}

/// The format of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// One word, unsigned.
    Word,
    /// Two words, signed.
    DoubleWord,
    /// This many words, by index from 0.
    Words(u16),
    /// This many double words, by index from 0.
    DoubleWords(u16),
}

impl Format {
    /// The number of elements of an array; `None` if it is not an array.
    #[must_use]
    pub const fn elements(self) -> Option<u16> {
        match self {
            Format::Words(count) | Format::DoubleWords(count) => Some(count),
            Format::Word | Format::DoubleWord => None,
        }
    }

    pub(super) const fn is_double(self) -> bool {
        matches!(self, Format::DoubleWord | Format::DoubleWords(_))
    }
}

/// The parameters of a slave, borrowed for each task.
pub trait ParameterTable {
    /// The parameter with a number.
    fn parameter(&self, number: u16) -> Option<Parameter>;

    /// Reads a parameter or an element. Index and access have been checked.
    fn read(&mut self, number: u16, index: u16) -> Result<u32, Refusal>;

    /// Writes a value, and returns the value for the reply. Index, access, width and range have been checked.
    fn write(&mut self, number: u16, index: u16, value: u32) -> Result<u32, Refusal>;

    /// Whether the master, and no other interface, has control of the parameters.
    fn is_authorised(&self) -> bool {
        true
    }
}

/// The slave's side of the PKW.
#[derive(Clone, Debug, Default)]
pub struct PkwServer {
    task: Pkw,
    reply: Pkw,
}

impl PkwServer {
    /// A server without a task.
    #[must_use]
    pub const fn new() -> Self {
        const NONE: Pkw = Pkw { identifier: 0, number: 0, index: 0, value: 0 };
        PkwServer { task: NONE, reply: NONE }
    }

    /// Handles the PKW of a telegram and returns the answer. A repeated task is carried out once, but a reading task
    /// reads the value anew.
    pub fn handle(&mut self, pkw: Pkw, table: &mut impl ParameterTable) -> Pkw {
        let reads = matches!(pkw.identifier, 1 | 6);
        if pkw != self.task || reads {
            self.reply = match Task::parse(pkw) {
                Ok(None) => Pkw::default(),
                _ if !table.is_authorised() => Reply::NoAuthority.pkw(pkw),
                Ok(Some(task)) => carry_out(task, table).unwrap_or_else(Reply::Refused).pkw(pkw),
                Err(_) => Reply::Refused(Refusal::OTHER).pkw(pkw),
            };
            self.task = pkw;
        }
        self.reply
    }

    /// Drops the task, as when data exchange ends: the next one counts as new.
    pub fn reset(&mut self) {
        *self = PkwServer::new();
    }
}

fn carry_out(task: Task, table: &mut impl ParameterTable) -> Result<Reply, Refusal> {
    let number = task.number();
    let parameter = table.parameter(number).ok_or(Refusal::NO_SUCH_PARAMETER)?;
    let value = |raw| Value::of(parameter.format.is_double(), raw);
    match task {
        Task::Read { .. } => {
            // An assumption: an array read without an index has the wrong type.
            require(parameter.format.elements().is_none(), Refusal::WRONG_TYPE)?;
            require(parameter.access != Access::Write, Refusal::OTHER)?;
            Ok(Reply::Value(value(table.read(number, 0)?)))
        }
        Task::ReadElement { index, .. } => {
            parameter.has_element(index)?;
            require(parameter.access != Access::Write, Refusal::OTHER)?;
            Ok(Reply::Element(value(table.read(number, index)?)))
        }
        Task::Write { value: new, .. } => {
            require(parameter.format.elements().is_none(), Refusal::WRONG_TYPE)?;
            parameter.takes(new)?;
            let shown = table.write(number, 0, new.raw())?;
            let is_double = parameter.format.is_double() || parameter.acknowledged_double;
            Ok(Reply::Value(Value::of(is_double, shown)))
        }
        Task::WriteElement { index, value: new, .. } => {
            parameter.has_element(index)?;
            parameter.takes(new)?;
            Ok(Reply::Element(value(table.write(number, index, new.raw())?)))
        }
        Task::CountElements { .. } => parameter.format.elements().map(Reply::Count).ok_or(Refusal::NO_ARRAY),
        // The drives' manuals list these tasks, but no descriptions.
        Task::ReadDescription { .. } => Err(Refusal::NO_DESCRIPTION),
        Task::WriteDescription { .. } => Err(Refusal::DESCRIPTION_READ_ONLY),
    }
}

impl Parameter {
    fn has_element(&self, index: u16) -> Result<(), Refusal> {
        let count = self.format.elements().ok_or(Refusal::NO_ARRAY)?;
        require(index < count, Refusal::NO_SUCH_ELEMENT)
    }

    fn takes(&self, value: Value) -> Result<(), Refusal> {
        require(self.access != Access::Read, Refusal::READ_ONLY)?;
        require(value.is_double() == self.format.is_double(), Refusal::WRONG_TYPE)?;
        let number = value.raw().cast_signed();
        require(self.range.is_none_or(|(low, high)| (low..=high).contains(&number)), Refusal::OUT_OF_RANGE)
    }
}

fn require(condition: bool, refusal: Refusal) -> Result<(), Refusal> {
    if condition { Ok(()) } else { Err(refusal) }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;

    /// Six parameters, the values that were written, and a value that counts its readings.
    #[derive(Default)]
    struct Table {
        written: Vec<(u16, u16, u32)>,
        readings: u32,
        is_foreign: bool,
    }

    impl ParameterTable for Table {
        fn parameter(&self, number: u16) -> Option<Parameter> {
            let (access, format, range) = match number {
                1 => (Access::ReadWrite, Format::Word, Some((1, 500))),
                2 => (Access::ReadWrite, Format::DoubleWord, Some((-10, 10))),
                3 => (Access::Read, Format::Words(10), None),
                4 => (Access::Write, Format::Word, None),
                5 => (Access::Read, Format::Word, None),
                6 => (Access::ReadWrite, Format::DoubleWords(2), None),
                _ => return None,
            };
            Some(Parameter { number, access, format, range, acknowledged_double: number == 4 })
        }

        fn read(&mut self, number: u16, index: u16) -> Result<u32, Refusal> {
            self.readings += 1;
            Ok(u32::from(number) * 100 + u32::from(index) * 10 + self.readings)
        }

        fn write(&mut self, number: u16, index: u16, value: u32) -> Result<u32, Refusal> {
            self.written.push((number, index, value));
            if number == 4 { Ok(0) } else { Ok(value) }
        }

        fn is_authorised(&self) -> bool {
            !self.is_foreign
        }
    }

    #[track_caller]
    fn check(task: Task, reply: Reply) {
        let answer = PkwServer::new().handle(task.pkw(), &mut Table::default());
        assert_eq!(Reply::parse(answer), Ok(Some(reply)));
        assert_eq!((answer.number, answer.index), (task.pkw().number, task.pkw().index));
    }

    #[test]
    fn every_task_has_its_reply() {
        use Value::{DoubleWord, Word};
        let write = |number, value| Task::Write { number, value };
        let element = |number, index| Task::ReadElement { number, index };
        check(Task::Read { number: 1 }, Reply::Value(Word(101)));
        check(Task::Read { number: 2 }, Reply::Value(DoubleWord(201)));
        check(write(1, Word(500)), Reply::Value(Word(500)));
        check(write(2, DoubleWord(-10_i32 as u32)), Reply::Value(DoubleWord(-10_i32 as u32)));
        check(write(4, Word(1)), Reply::Value(DoubleWord(0)));
        check(element(3, 9), Reply::Element(Word(391)));
        check(element(6, 1), Reply::Element(DoubleWord(611)));
        let to_element = |value| Task::WriteElement { number: 6, index: 1, value };
        check(to_element(DoubleWord(7)), Reply::Element(DoubleWord(7)));
        check(Task::CountElements { number: 3 }, Reply::Count(10));
        for (task, refusal) in [
            (Task::Read { number: 7 }, Refusal::NO_SUCH_PARAMETER),
            (Task::Read { number: 3 }, Refusal::WRONG_TYPE),
            (Task::Read { number: 4 }, Refusal::OTHER),
            (write(5, Word(1)), Refusal::READ_ONLY),
            (write(1, Word(0)), Refusal::OUT_OF_RANGE),
            (write(2, DoubleWord(-11_i32 as u32)), Refusal::OUT_OF_RANGE),
            (write(1, DoubleWord(1)), Refusal::WRONG_TYPE),
            (write(2, Word(1)), Refusal::WRONG_TYPE),
            (write(6, DoubleWord(1)), Refusal::WRONG_TYPE),
            (to_element(Word(1)), Refusal::WRONG_TYPE),
            (element(3, 10), Refusal::NO_SUCH_ELEMENT),
            (element(1, 0), Refusal::NO_ARRAY),
            (Task::CountElements { number: 1 }, Refusal::NO_ARRAY),
            (Task::ReadDescription { number: 1, index: 0 }, Refusal::NO_DESCRIPTION),
            (Task::WriteDescription { number: 1, index: 0, value: 0 }, Refusal::DESCRIPTION_READ_ONLY),
        ] {
            check(task, Reply::Refused(refusal));
        }
    }

    #[test]
    fn a_task_that_is_repeated_is_carried_out_once() {
        let (mut server, mut table) = (PkwServer::new(), Table::default());
        let write = Task::Write { number: 1, value: Value::Word(5) }.pkw();
        let reply = server.handle(write, &mut table);
        assert_eq!((server.handle(write, &mut table), table.written.len()), (reply, 1));
        assert_eq!(server.handle(Pkw::default(), &mut table), Pkw::default());
        assert_eq!((server.handle(write, &mut table), table.written.len()), (reply, 2));
        server.reset();
        assert_eq!((server.handle(write, &mut table), table.written.len()), (reply, 3));
    }

    #[test]
    fn what_is_read_is_read_anew() {
        let (mut server, mut table) = (PkwServer::new(), Table::default());
        let read = Task::Read { number: 5 }.pkw();
        assert_eq!((server.handle(read, &mut table).value, server.handle(read, &mut table).value), (501, 502));
    }

    #[test]
    fn unknown_identifiers_and_foreign_parameters_are_refused() {
        let (mut server, mut table) = (PkwServer::new(), Table::default());
        for identifier in 10..=15 {
            let answer = server.handle(Pkw { identifier, number: 1, index: 0, value: 0 }, &mut table);
            assert_eq!(Reply::parse(answer), Ok(Some(Reply::Refused(Refusal::OTHER))));
        }
        table.is_foreign = true;
        let answer = server.handle(Task::Read { number: 1 }.pkw(), &mut table);
        assert_eq!(Reply::parse(answer), Ok(Some(Reply::NoAuthority)));
        assert_eq!(server.handle(Pkw::default(), &mut table), Pkw::default());
    }
}
