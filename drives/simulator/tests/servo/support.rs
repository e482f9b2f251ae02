//! A servo with a made-up data sheet, in virtual time.

use lexican_runtime::object::{self, Access, Address, DataType, Dictionary, PdoMapping, Table};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, Instant, NodeId};
use simulator::Storage;
use simulator::servo::{Inputs, Servo, ServoModel};

/// An object of a data sheet: index, sub-index, type, default.
pub(crate) type Row = (u16, u8, DataType, i64);

use DataType::{
    Integer8 as I8, Integer16 as I16, Integer32 as I32, Unsigned8 as U8, Unsigned16 as U16, Unsigned32 as U32,
};

/// A servo with all objects that moves with 1000 units/s and ramps of 10 000 units/s².
pub(crate) const SERVO: &[Row] = &[
    (0x6007, 0, I16, 1),
    (0x603F, 0, U16, 0),
    (0x6040, 0, U16, 0),
    (0x6041, 0, U16, 0),
    (0x605A, 0, I16, 2),
    (0x605B, 0, I16, 0),
    (0x605C, 0, I16, 1),
    (0x605D, 0, I16, 1),
    (0x605E, 0, I16, 2),
    (0x6060, 0, I8, 1),
    (0x6061, 0, I8, 0),
    (0x6062, 0, I32, 0),
    (0x6064, 0, I32, 0),
    (0x6065, 0, U32, 100),
    (0x6066, 0, U16, 10),
    (0x6067, 0, U32, 10),
    (0x6068, 0, U16, 0),
    (0x606B, 0, I32, 0),
    (0x606C, 0, I32, 0),
    (0x606D, 0, U16, 5),
    (0x606E, 0, U16, 0),
    (0x606F, 0, U16, 5),
    (0x6070, 0, U16, 0),
    (0x6071, 0, I16, 0),
    (0x6072, 0, U16, 1000),
    (0x6077, 0, I16, 0),
    (0x607A, 0, I32, 0),
    (0x607C, 0, I32, 0),
    (0x607D, 1, I32, 0),
    (0x607D, 2, I32, 0),
    (0x607E, 0, U8, 0),
    (0x6081, 0, U32, 1000),
    (0x6083, 0, U32, 10_000),
    (0x6084, 0, U32, 10_000),
    (0x6085, 0, U32, 100_000),
    (0x6087, 0, U32, 1000),
    (0x6098, 0, I8, 0),
    (0x6099, 1, U32, 1000),
    (0x6099, 2, U32, 100),
    (0x609A, 0, U32, 10_000),
    (0x60B0, 0, I32, 0),
    (0x60B8, 0, U16, 0),
    (0x60B9, 0, U16, 0),
    (0x60BA, 0, I32, 0),
    (0x60BB, 0, I32, 0),
    (0x60BC, 0, I32, 0),
    (0x60BD, 0, I32, 0),
    (0x60C1, 1, I32, 0),
    (0x60C2, 1, U8, 2),
    (0x60C2, 2, I8, -3),
    (0x60F2, 0, U16, 0),
    (0x60F4, 0, I32, 0),
    (0x60FD, 0, U32, 0),
    (0x60FF, 0, I32, 0),
    (0x6502, 0, U32, 0x3ED),
];

/// A dictionary with these objects.
pub(crate) fn dictionary(rows: &[Row]) -> Dictionary<1024> {
    let mut rows = rows.to_vec();
    rows.sort_by_key(|row| (row.0, row.1));
    let (mut entries, mut image) = (Vec::new(), Vec::new());
    for &(index, sub, data_type, default) in &rows {
        let size = data_type.size().unwrap();
        let offset = u32::try_from(image.len()).unwrap();
        let row = object::Row::new(index, sub, data_type, Access::Rw, PdoMapping::Both);
        entries.push(row.at(offset, u16::try_from(size).unwrap()));
        image.extend(&default.to_le_bytes()[..size]);
    }
    image.resize(1024, 0);
    let table = Table { rows: entries.leak(), limits: &[], image: image.leak() };
    Dictionary::new(Box::leak(Box::new(table)), NodeId::literal(5))
}

/// A servo, its dictionary, and the time.
pub(crate) struct Rig {
    pub(crate) od: Dictionary<1024>,
    pub(crate) servo: Servo,
    pub(crate) now: Instant,
}

impl Rig {
    pub(crate) fn new() -> Self {
        Rig::of(&ServoModel::CIA_402, SERVO)
    }

    pub(crate) fn of(model: &'static ServoModel, rows: &[Row]) -> Self {
        let mut rig = Rig { od: dictionary(rows), servo: Servo::new(Instant::ZERO, model), now: Instant::ZERO };
        rig.servo.update(rig.now, &mut rig.od);
        rig
    }

    /// A servo in OPERATION ENABLED and a mode.
    pub(crate) fn enabled(mode: i64) -> Self {
        let mut rig = Rig::new();
        rig.set(0x6060, 0, mode).enable();
        rig
    }

    pub(crate) fn enable(&mut self) -> &mut Self {
        self.control(0x06).control(0x07).control(0x0F);
        assert_eq!(self.servo.state(), State::OperationEnabled);
        self
    }

    /// Writes an object, as an SDO or PDO does.
    pub(crate) fn set(&mut self, index: u16, sub: u8, value: i64) -> &mut Self {
        self.od.set_raw(Address::new(index, sub), value as u64);
        self.servo.update(self.now, &mut self.od);
        self
    }

    pub(crate) fn control(&mut self, word: u16) -> &mut Self {
        self.set(0x6040, 0, word.into())
    }

    /// Writes 607Ah, and pulses bit 4.
    pub(crate) fn travel(&mut self, target: i64, bits: u16) -> &mut Self {
        self.set(0x607A, 0, target).control(0x1F | bits).control(0x0F | bits & 0x100)
    }

    pub(crate) fn inputs(&mut self, change: impl FnOnce(&mut Inputs)) -> &mut Self {
        self.servo.set_inputs(self.now, &mut self.od, change);
        self
    }

    /// Lets time pass.
    pub(crate) fn pass(&mut self, ms: u64) -> &mut Self {
        self.now += Duration::from_millis(ms);
        self.servo.update(self.now, &mut self.od);
        self
    }

    pub(crate) fn sync(&mut self) -> &mut Self {
        self.servo.sync(self.now, &mut self.od);
        self
    }

    pub(crate) fn get(&self, index: u16, sub: u8) -> i64 {
        self.od.number(Address::new(index, sub)).unwrap()
    }

    pub(crate) fn position(&self) -> i64 {
        self.get(0x6064, 0)
    }

    pub(crate) fn velocity(&self) -> i64 {
        self.get(0x606C, 0)
    }

    /// Whether bits of the status word are all set.
    pub(crate) fn status(&self, bits: u16) -> bool {
        self.get(0x6041, 0) as u16 & bits == bits
    }

    /// Bits 10, 12 and 13.
    pub(crate) fn mode_bits(&self) -> [bool; 3] {
        [10, 12, 13].map(|bit| self.status(1 << bit))
    }

    pub(crate) fn state(&self) -> State {
        let shown = State::from_status_word(self.get(0x6041, 0) as u16).unwrap();
        assert_eq!(shown, self.servo.state());
        shown
    }

    /// The codes of the emergencies since the last call.
    pub(crate) fn emergencies(&mut self) -> Vec<u16> {
        std::iter::from_fn(|| self.servo.next_emergency()).map(|emergency| emergency.code).collect()
    }
}
