//! How devices differ where CiA 301 leaves it open, and where they deviate from it: as data.

use core::fmt::Debug;

use crate::object::WritableIn;
use crate::service::sdo_server::SizesIndicated;
use crate::service::tpdo::Triggers;
use crate::wire::emcy::{CodeOrder, ErrorCode};
use crate::wire::pdo::TransmissionType;

/// When a manager may change the parameters of PDOs and the COB-IDs of SYNC and EMCY.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ChangeRule {
    /// As CiA 301 has it: an identifier only while the object is switched off (bit 31; bit 30 of SYNC).
    WhileInvalid,
    /// In PRE-OPERATIONAL only, but there without switching off.
    InPreOperational,
}

/// What happens when both heartbeat (1017h) and life guarding (100Ch, 100Dh) are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ErrorControlRule {
    /// As CiA 301 has it: heartbeat is used, and guarding requests stay unanswered.
    HeartbeatFirst,
    /// The one that would be the second is refused with [`AbortCode::PARAMETER_INCOMPATIBLE`](crate::AbortCode).
    Exclusive,
}

/// What CiA 301 leaves open, and in what a device deviates from it. [`Behaviour::CIA_301`] is the
/// standard; a device's own is written as the difference: `Behaviour { pdo_bit_30: false, ..Behaviour::CIA_301 }`.
#[derive(Clone, Copy, Debug)]
pub struct Behaviour {
    /// In which order EMCY carries the bytes of the error code.
    pub emcy_code_order: CodeOrder,
    /// Whether the generic bit of the error register is set with every other one. An error that has no bit of its own sets
    /// it anyway.
    pub generic_error: bool,
    /// What makes the device send TPDOs of type 254.
    pub triggers_254: Triggers,
    /// The numbers of TPDOs whose type 254 does what 255 does.
    pub tpdos_of_255: &'static [u16],
    /// What makes the device send TPDOs of type 255.
    pub triggers_255: Triggers,
    /// Whether TPDOs of type 0 are sent at every SYNC, and not only at one after an event.
    pub type_0_at_every_sync: bool,
    /// Where the device has masks of the bits of its TPDOs whose change counts: the index of the first TPDO's, with the
    /// first four bytes in sub-index 1, and the last in 2. Changes are found by [`Device::compare`](super::Device::compare)
    /// then, and not by [`Device::changed`](super::Device::changed).
    pub tpdo_masks: Option<u16>,
    /// Whether RPDOs of type n, from 1 to 240, take effect with every n-th SYNC, and not with the next one.
    pub rpdos_count_syncs: bool,
    /// Whether bit 31 of a PDO's COB-ID switches it off. Where it does not, every PDO exists.
    pub pdo_bit_31: bool,
    /// Whether bit 30 of a TPDO's COB-ID forbids remote frames. Where it does not, none is refused.
    pub pdo_bit_30: bool,
    /// Whether the application sends the time ([`Device::send_time`](super::Device::send_time)). Otherwise 1012h
    /// does not let the device produce TIME.
    pub produces_time: bool,
    /// Whether 1400h:05 is the deadline of an RPDO.
    pub rpdo_deadlines: bool,
    /// When communication parameters may be changed.
    pub changes: ChangeRule,
    /// In which NMT states entries may be written, where not in all of them: what generated code calls
    /// `WRITABLE_IN`. Others are refused with [`AbortCode::DEVICE_STATE`](crate::AbortCode::DEVICE_STATE).
    pub writable_in: &'static [WritableIn],
    /// Which data types may fill space in an RPDO: bit n for data type n (`DummyUsage` of an EDS).
    pub dummies: u32,
    /// Whether empty fields of the error history (1003h) are read as zero, and not refused with
    /// [`AbortCode::NO_DATA`](crate::AbortCode::NO_DATA).
    pub empty_history_is_zero: bool,
    /// Whether errors of communication that the device notices itself come into the history.
    pub records_communication_errors: bool,
    /// Which errors of communication the device does not report, of those that it notices itself: 8130h,
    /// 8210h, 8220h, 8240h, 8250h.
    pub unreported: &'static [ErrorCode],
    /// What happens when heartbeat and guarding are both asked for.
    pub error_control: ErrorControlRule,
    /// Which answers to SDO reads indicate how many bytes they have.
    pub sdo_sizes_indicated: SizesIndicated,
}

impl Behaviour {
    /// As CiA 301 has it; everything that can be an event is one.
    pub const CIA_301: Behaviour = Behaviour {
        emcy_code_order: CodeOrder::LowByteFirst,
        generic_error: true,
        triggers_254: Triggers::ALL,
        tpdos_of_255: &[],
        triggers_255: Triggers::ALL,
        type_0_at_every_sync: false,
        tpdo_masks: None,
        rpdos_count_syncs: false,
        pdo_bit_31: true,
        pdo_bit_30: true,
        produces_time: false,
        rpdo_deadlines: true,
        changes: ChangeRule::WhileInvalid,
        writable_in: &[],
        dummies: 0xFE,
        empty_history_is_zero: false,
        records_communication_errors: true,
        unreported: &[],
        error_control: ErrorControlRule::HeartbeatFirst,
        sdo_sizes_indicated: SizesIndicated::ALL,
    };

    /// What makes the device send the TPDO with this number.
    pub(super) fn triggers(&self, number: u16, transmission: TransmissionType) -> Triggers {
        match transmission {
            TransmissionType::EventManufacturer if self.tpdos_of_255.contains(&number) => self.triggers_255,
            TransmissionType::EventManufacturer => self.triggers_254,
            TransmissionType::EventProfile => self.triggers_255,
            _ => Triggers::NONE,
        }
    }
}

/// The behaviour of a device: a value that is chosen when the program runs, or a type that has it as a constant. Of a
/// constant the compiler leaves no code for what the device does not do, and no memory.
///
/// ```
/// use lexican_runtime::device::{Behaves, Behaviour};
///
/// #[derive(Clone, Copy, Debug, Default)]
/// struct Sensor;
///
/// impl Behaves for Sensor {
///     fn behaviour(&self) -> &Behaviour {
///         const { &Behaviour { rpdo_deadlines: false, ..Behaviour::CIA_301 } }
///     }
/// }
/// ```
pub trait Behaves: Copy + Debug + Default + Send + Sync + 'static {
    /// What the device does where CiA 301 leaves it open.
    fn behaviour(&self) -> &Behaviour;
}

impl Behaves for Behaviour {
    fn behaviour(&self) -> &Behaviour {
        self
    }
}

/// [`Behaviour::CIA_301`] as a constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cia301;

impl Behaves for Cia301 {
    fn behaviour(&self) -> &Behaviour {
        const { &Behaviour::CIA_301 }
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Behaviour::CIA_301
    }
}
