//! The parameters, telegram by telegram; `tests/tests/all/parameters.rs` compares them with the objects.

use super::rig::Rig;
use lexican_profibus::pkw::{Access, Format, Refusal, Reply, Task, Value};
use lexican_runtime::object::{Address, DataType};
use siko_profibus::table::{Content, Row};
use siko_profibus::{AG02, AG03_1, Model, table};

const DRIVES: [&Model; 2] = [&AG03_1, &AG02];

#[test]
fn there_are_as_many_as_the_manuals_have() {
    assert_eq!((AG03_1.table.len(), AG02.table.len()), (41, 27));
    for model in DRIVES {
        assert!(model.table.is_sorted_by_key(|row| row.wire.number), "{}", model.name);
        for row in AG02.table {
            let other = table::find(AG03_1.table, row.wire.number).unwrap();
            assert_eq!((row.wire.format, row.wire.access), (other.wire.format, other.wire.access));
        }
    }
}

fn is_double(row: &Row) -> bool {
    row.wire.format == Format::DoubleWord
}

#[test]
fn every_parameter_is_read_and_its_default_is_that_of_the_object() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        let storage = (model.drive.storage)(lexican_runtime::NodeId::literal(1));
        for row in model.table {
            let number = row.wire.number;
            let read = match (row.wire.format, row.wire.access) {
                (Format::Words(count), _) => {
                    let count = Reply::Count(count);
                    assert_eq!(rig.ask(Task::CountElements { number }), count);
                    continue;
                }
                (_, Access::Write) => Err(Refusal::OTHER),
                _ => Ok(()),
            };
            let value = rig.read(number);
            assert_eq!(value.map(|_| ()), read, "{number}");
            if let (Content::Object(address), true) = (row.content, row.wire.access == Access::ReadWrite) {
                let width = if is_double(row) { 32 } else { 16 };
                let default = row.parameter.of_object(storage.number(address).unwrap()).unwrap();
                let default = default as u32 as u64 & ((1 << width) - 1);
                assert_eq!(value.map(u64::from), Ok(default), "{} {number}", model.name);
            }
        }
    }
}

#[test]
fn every_parameter_takes_its_range_and_no_more() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        for row in model.table.iter().filter(|row| row.wire.access == Access::ReadWrite) {
            let number = row.wire.number;
            // Limit 1 is never below limit 2, and the calibration value is within both.
            let (first, second) = match number {
                1016 => (0, 9_999_999),
                1017 => (0, -9_999_999),
                _ => row.wire.range.unwrap(),
            };
            let (below, above) = row.wire.range.map(|(low, high)| (low - 1, high + 1)).unwrap();
            for value in [first, second] {
                let raw = value.cast_unsigned() & if is_double(row) { u32::MAX } else { 0xFFFF };
                assert_eq!(rig.write(number, value), Ok(raw), "{} {number} := {value}", model.name);
                assert_eq!(rig.read(number), Ok(raw));
            }
            for value in [below, above] {
                assert_eq!(rig.write(number, value), Err(Refusal::OUT_OF_RANGE), "{} {number} := {value}", model.name);
            }
        }
        for row in model.table.iter().filter(|row| row.wire.access == Access::Read) {
            if row.wire.format == Format::Word {
                assert_eq!(rig.write(row.wire.number, 0), Err(Refusal::READ_ONLY));
            }
        }
    }
}

/// 6060h has 1 for positioning, PNU 930 has 2.
#[test]
fn the_codes_of_the_operating_mode_are_swapped() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        for (number, object) in [(2, 1_u64), (1, 2), (2, 1)] {
            assert_eq!((rig.write(930, number), rig.read(930)), (Ok(number.unsigned_abs()), Ok(number.unsigned_abs())));
            let now = rig.now;
            let held = rig.simulated().with_dictionary(now, |od| {
                let entry = od.entry(Address::new(0x6060, 0)).unwrap();
                let mut bytes = [0; 8];
                od.read(&entry, 0, &mut bytes).unwrap();
                assert_eq!(entry.data_type, DataType::Unsigned8);
                u64::from_le_bytes(bytes)
            });
            assert_eq!(held, object);
        }
        assert_eq!(rig.write(930, 3), Err(Refusal::OUT_OF_RANGE));
    }
}

/// Limits 1 and 2 are swapped: limit 1 is the upper one, 607Dh:02.
#[test]
fn limit_1_is_the_second_of_607d() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        assert_eq!(rig.write(1017, 1_000_001), Err(Refusal::OUT_OF_RANGE));
        assert_eq!(rig.write(1016, -1_000_001), Err(Refusal::OUT_OF_RANGE));
    }
}

#[test]
fn faults_are_letters_and_counted() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        let element = |rig: &mut Rig, index| rig.ask(Task::ReadElement { number: 945, index });
        assert_eq!((rig.read(952), element(&mut rig, 0)), (Ok(0), Reply::Element(Value::Word(0))));
        for (count, fault) in (1..).zip(model.drive.faults.iter().filter(|fault| fault.letter() < 'F')) {
            rig.world(|inputs| inputs.force(fault.kind));
            rig.world(|inputs| inputs.clear(fault.kind));
            rig.control(0x0080);
            rig.control(0x0000);
            assert_eq!(rig.read(952), Ok(count));
            assert_eq!(element(&mut rig, 0), Reply::Element(Value::Word(fault.letter() as u16)));
        }
        assert_eq!(element(&mut rig, 4), Reply::Element(Value::Word(0x41)));
        assert_eq!(element(&mut rig, 10), Reply::Refused(Refusal::NO_SUCH_ELEMENT));
        assert_eq!(rig.write(970, 4), Ok(0));
        assert_eq!((rig.read(952), element(&mut rig, 0)), (Ok(0), Reply::Element(Value::Word(0))));
    }
}

#[test]
fn sets_of_parameters_are_restored() {
    for model in DRIVES {
        let p = if model.name == "AG02" { 250 } else { 100 };
        // Controller parameter, standard parameter, parameter 25.
        for (record, values) in [(1, [p, 10, 0]), (2, [7, 10, 0]), (3, [p, 20, 1])] {
            let mut rig = Rig::new(model);
            for (number, value) in [(1000, 7), (1009, 20), (1021, 1)] {
                assert_eq!(rig.write(number, value), Ok(value.unsigned_abs()));
            }
            let task = Task::Write { number: 970, value: Value::Word(record) };
            // Acknowledged as a double word, which is 0.
            assert_eq!(rig.ask(task), Reply::Value(Value::DoubleWord(0)));
            let read = [1000, 1009, 1021].map(|number| rig.read(number));
            assert_eq!(read, values.map(Ok), "{} {record}", model.name);
        }
        let mut rig = Rig::new(model);
        assert_eq!((rig.write(970, 0), rig.write(970, 6)), (Err(Refusal::OUT_OF_RANGE), Err(Refusal::OUT_OF_RANGE)));
    }
}

/// Both ways of chapter 3: writing the calibration value, and PNU 970.
#[test]
fn it_is_calibrated() {
    for model in DRIVES {
        let mut rig = Rig::new(model);
        assert_eq!((rig.write(1018, 10_000), rig.actual()), (Ok(10_000), 10_000));
        let now = rig.now;
        assert!(rig.simulated().turn_shaft(now, 500));
        rig.turn();
        assert_eq!(rig.actual(), 10_500);
        assert_eq!((rig.write(970, 5), rig.actual()), (Ok(0), 10_000));
    }
}

#[test]
fn the_drive_says_what_it_is() {
    let mut rig = Rig::new(&AG03_1);
    // 24:1; 15.07.2009; 24.0 V twice; 3.60 V; 25.0 degrees.
    let read = [918, 961, 965, 1033, 1034, 1040, 1041, 1042, 1027, 1031].map(|number| rig.read(number).unwrap());
    assert_eq!(read, [7, 2, 0x0100, 1, 0x1507_2009, 240, 240, 360, 250, 0x10]);
    let mut rig = Rig::new(&AG02);
    let read = [918, 961, 965].map(|number| rig.read(number).unwrap());
    assert_eq!(read, [7, 1, 0x0200]);
    assert_eq!(rig.read(1033), Err(Refusal::NO_SUCH_PARAMETER));
}

/// -5.5 degrees are a word in two's complement.
#[test]
fn a_negative_temperature_fits_into_its_word() {
    let mut rig = Rig::new(&AG03_1);
    rig.world(|inputs| inputs.temperature_100mdegc = -55);
    assert_eq!(rig.read(1027), Ok(u32::from(-55_i16 as u16)));
}

/// Setting 127 and 126 is the same (7.8).
#[test]
fn there_is_no_address_127() {
    assert_eq!([0, 1, 125, 126, 127].map(Model::address), [0, 1, 125, 126, 126]);
}
