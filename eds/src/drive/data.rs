//! A drive of CiA 402, as a data sheet describes it.

use crate::model::types::DataType;
pub use lexican_cia::cia402::Signal;

/// What a driver has to know, as far as a data sheet says it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drive {
    /// What to call it: `ProductName`, or else what 1008h holds.
    pub name: String,
    /// How it is recognised.
    pub identity: Identity,
    /// Every write by SDO takes four bytes, as the overlay says.
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
    /// 606Ch. A drive without it has 6064h, by which it is seen to stand.
    pub actual_velocity: Option<Number>,
    /// 607Ah. A drive that has profile position mode has it.
    pub target_position: Option<Number>,
    /// 6081h, 6083h and 6084h, of a drive with profile position mode.
    pub profile: Option<Profile>,
    /// 60FFh, of a drive with profile velocity mode or the cyclic one.
    pub target_velocity: Option<Number>,
    /// 6071h and 6077h, of a drive with torque profile mode or the cyclic one.
    pub torque: Option<Torque>,
    /// 60C1h:01, of a drive with interpolated position mode.
    pub interpolated_position: Option<Number>,
    /// 6067h.
    pub position_window: Option<Number>,
    /// 607Dh: the lower and the upper limit.
    pub position_limits: Option<[Number; 2]>,
    /// 1003h:01.
    pub latest_fault: Option<Number>,
    /// The numbers of its modes (6060h), ascending, as CiA 402 has them: 1 is profile position, 3 profile velocity.
    /// One of these two is there.
    pub modes: Vec<i8>,
    /// Homing, if it has the mode.
    pub homing: Option<Homing>,
    /// The option codes that it has of 605Ah to 605Eh.
    pub option_codes: Vec<Number>,
    /// The positions that its touch probes latch, of 60BAh to 60BDh; none without 60B8h and 60B9h.
    pub latched: Vec<Number>,
    /// The PDOs by which it takes orders.
    pub outputs: Outputs,
    /// The PDOs in which it sends its status word by itself.
    pub inputs: Vec<Pdo>,
    /// 1010h:01.
    pub store: Option<Number>,
    /// 1011h:01.
    pub restore: Option<Number>,
    /// 1014h, if it can be written.
    pub emergencies: Option<Number>,
    /// What 606Ch is counted in, if the overlay says it: `rev/min`, `1/1000 rev/min`.
    pub velocity_unit: Option<String>,
    /// The emergency codes that the overlay names.
    pub codes: Vec<Code>,
}

/// How a drive is recognised.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// What 1018h:01 may hold, 0 also where it is missing; empty if the data sheet does not say it.
    pub vendor_ids: Vec<u32>,
    /// The low half of 1000h.
    pub profile: u16,
    /// What 1008h holds, empty if the data sheet does not say it; `None` if there is no 1008h.
    pub name: Option<String>,
}

/// An object that holds a whole number of one, two, four or eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Number {
    pub index: u16,
    pub sub: u8,
    pub data_type: DataType,
    /// The limits, if they are narrower than the data type.
    pub limits: Option<(i64, i64)>,
}

/// The velocity and the ramps of a travel.
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

/// Homing mode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Homing {
    /// 6098h.
    pub method: Number,
    /// 607Ch.
    pub offset: Number,
    /// The methods that it has: 60E3h, or what the overlay or the limits of 6098h say; empty where nothing says it.
    pub methods: Vec<i8>,
}

/// The PDOs by which a drive takes orders. Each carries nothing else: a driver fills what it does not know with zeros, which
/// would be orders, too.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The control word. Without it, orders go by SDO, which keeps them in their order.
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
    /// What velocities are counted in, if that is known. Without 606Ch the driver measures them.
    #[must_use]
    pub fn velocity_unit(&self) -> Option<&str> {
        self.velocity_unit.as_deref().or(self.actual_velocity.is_none().then_some("units of 6064h per second"))
    }
}

impl Number {
    /// The bytes on the wire.
    #[must_use]
    pub fn size(&self) -> u8 {
        self.data_type.bits().unwrap_or(0) / 8
    }
}

impl Homing {
    /// The method that takes the current position for the home position: 35, or 37 for a drive that has only that one.
    /// `None` for a drive that has neither.
    #[must_use]
    pub fn on_the_spot(&self) -> Option<i8> {
        [35, 37].into_iter().find(|method| self.methods.is_empty() || self.methods.contains(method))
    }
}
