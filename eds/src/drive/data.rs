//! A drive of CiA 402, as a data sheet describes it.

use crate::model::types::DataType;
pub use lexican_cia::cia402::Signal;

/// What a driver has to know, as far as the data sheet says it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drive {
    /// `ProductName`, or else the value of 1008h.
    pub name: String,
    /// What the device must answer to be taken for this drive.
    pub identity: Identity,
    /// Whether every SDO write has to carry four bytes (overlay).
    pub always_four_bytes: bool,
    /// 6040h.
    pub control_word: Number,
    /// 6041h.
    pub status_word: Number,
    /// 6060h.
    pub mode: Number,
    /// 6061h.
    pub mode_display: Option<Number>,
    /// 6064h. A drive that has profile position mode has it.
    pub actual_position: Option<Number>,
    /// 606Ch. Without it, the driver watches 6064h to see whether the drive stands still.
    pub actual_velocity: Option<Number>,
    /// 607Ah. A drive that has profile position mode has it.
    pub target_position: Option<Number>,
    /// 6081h, 6083h and 6084h, of a drive with profile position mode.
    pub profile: Option<Profile>,
    /// 60FFh, of a drive with profile velocity or cyclic synchronous velocity mode.
    pub target_velocity: Option<Number>,
    /// 6071h and 6077h, of a drive with profile torque or cyclic synchronous torque mode.
    pub torque: Option<Torque>,
    /// 60C1h:01, of a drive with interpolated position mode.
    pub interpolated_position: Option<Number>,
    /// 6067h.
    pub position_window: Option<Number>,
    /// 607Dh: the lower and the upper limit.
    pub position_limits: Option<[Number; 2]>,
    /// 1003h:01.
    pub latest_fault: Option<Number>,
    /// The modes (numbers of 6060h), ascending. Profile position (1) or profile velocity (3) is among them.
    pub modes: Vec<i8>,
    /// `None` if the drive has no homing mode.
    pub homing: Option<Homing>,
    /// The option codes 605Ah to 605Eh that the drive has.
    pub option_codes: Vec<Number>,
    /// The latched positions of the touch probes (60BAh to 60BDh); empty without 60B8h and 60B9h.
    pub latched: Vec<Number>,
    /// The PDOs by which it takes orders.
    pub outputs: Outputs,
    /// The PDOs that carry the status word and that the drive sends unasked.
    pub inputs: Vec<Pdo>,
    /// 1010h:01.
    pub store: Option<Number>,
    /// 1011h:01.
    pub restore: Option<Number>,
    /// 1014h, if it is writable.
    pub emergencies: Option<Number>,
    /// The unit of 606Ch, if the overlay gives it: `rev/min`, `1/1000 rev/min`.
    pub velocity_unit: Option<String>,
    /// The emergency codes that the overlay names.
    pub codes: Vec<Code>,
}

/// How a drive is recognised.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The possible values of 1018h:01, which include 0 where it may be missing; empty if the data sheet gives none.
    pub vendor_ids: Vec<u32>,
    /// The low half of 1000h.
    pub profile: u16,
    /// The value of 1008h, empty if the data sheet gives none; `None` without 1008h.
    pub name: Option<String>,
}

/// An object that holds a whole number of one, two, four or eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Number {
    pub index: u16,
    pub sub: u8,
    pub data_type: DataType,
    /// `None` if the limits are those of the data type.
    pub limits: Option<(i64, i64)>,
}

/// Velocity and ramps of a motion in profile position mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Profile {
    /// 6081h.
    pub velocity: Number,
    /// 6083h.
    pub acceleration: Option<Number>,
    /// 6084h.
    pub deceleration: Option<Number>,
}

/// The torque modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Torque {
    /// 6071h.
    pub target: Number,
    /// 6077h.
    pub actual: Number,
}

/// The objects of homing mode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Homing {
    /// 6098h.
    pub method: Number,
    /// 607Ch.
    pub offset: Number,
    /// The supported methods, from 60E3h, or else the overlay or the limits of 6098h; empty if none of them says it.
    pub methods: Vec<i8>,
}

/// The PDOs by which a drive takes orders. They map nothing else: a driver would fill unknown objects with zeros, which
/// are orders, too.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// Control word alone. Without this PDO, orders go by SDO, which keeps them in order.
    pub control: Option<Pdo>,
    /// Control word and target position.
    pub position: Option<Pdo>,
    /// Control word and target velocity.
    pub velocity: Option<Pdo>,
}

/// A PDO, mapped by default, with the COB-ID of the predefined connection set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pdo {
    /// The COB-ID without the node-ID: 200h.
    pub base: u16,
    /// What it carries, the first byte first.
    pub signals: Vec<Signal>,
}

/// An emergency code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Code {
    /// The code.
    pub number: u16,
    /// What the overlay calls it.
    pub text: String,
}

impl Drive {
    /// The unit of velocities, if known. Without 606Ch, the driver measures them in units of 6064h per second.
    #[must_use]
    pub fn velocity_unit(&self) -> Option<&str> {
        self.velocity_unit.as_deref().or(self.actual_velocity.is_none().then_some("units of 6064h per second"))
    }
}

impl Number {
    /// The length on the wire, in bytes.
    #[must_use]
    pub fn size(&self) -> u8 {
        self.data_type.bits().unwrap_or(0) / 8
    }
}

impl Homing {
    /// The method that sets the current position as the home position: 35, or else 37. `None` if the drive has neither.
    #[must_use]
    pub fn on_the_spot(&self) -> Option<i8> {
        [35, 37].into_iter().find(|method| self.methods.is_empty() || self.methods.contains(method))
    }
}
