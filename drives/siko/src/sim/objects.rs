//! The dictionary of the simulated drive: live values are calculated when they are read, and writes are refused as
//! chapters 6 and 7.12 say.

use lexican_driver::ParameterSet;
use lexican_runtime::abort::AbortCode;
use lexican_runtime::cia301;
use lexican_runtime::object::{Address, Entry, Layer};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Instant, NodeId};
use simulator::{Storage, raw_of, signed};

use super::address;
use super::controller::Controller;
use super::switches::Restore;
use crate::model::Model;

/// Storage and controller, borrowed by the device for one call.
pub(super) struct Objects<'a> {
    pub(super) now: Instant,
    pub(super) model: &'static Model,
    pub(super) node: NodeId,
    pub(super) network: NmtState,
    /// Whether an SDO request is being served.
    pub(super) by_sdo: bool,
    pub(super) storage: &'a mut dyn Storage,
    /// Parameter 25, if no object holds it.
    pub(super) inching_stop: &'a mut u8,
    pub(super) parameters_written: &'a mut bool,
    pub(super) controller: &'a Controller,
    pub(super) effects: &'a mut Vec<Effect>,
}

/// An effect of a write, which takes place after the whole frame: a PDO writes the control word before the target that
/// belongs to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// A control word came.
    Control(u16),
    /// A control word came with a target that is out of range.
    ControlWithoutTarget(u16),
    /// The calibration value becomes the position.
    Calibrate,
}

impl<'a> Layer for Objects<'a> {
    type Under = dyn Storage + 'a;

    fn under(&self) -> &Self::Under {
        self.storage
    }

    fn under_mut(&mut self) -> &mut Self::Under {
        self.storage
    }

    fn read_entry(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        self.look_up(entry.address);
        self.storage.read(entry, offset, buffer)
    }

    fn write_entry(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        // A text is not a number, and nothing depends on it.
        let value = signed(entry.data_type, raw_of(data)).unwrap_or_default();
        self.check(entry, value)?;
        self.storage.write(entry, offset, data, last)?;
        *self.parameters_written = true;
        self.follow(entry.address, value);
        Ok(())
    }
}

impl Objects<'_> {
    /// Writes a measured value into the storage, from where it is read.
    fn look_up(&mut self, address: Address) {
        let (now, controller) = (self.now, self.controller);
        let inputs = &controller.inputs;
        let measured: i64 = match address {
            address::SYSTEM_STATUS => controller.system_status(now).into(),
            address::OUTPUT_STAGE_SUPPLY => inputs.output_stage_supply_100mv.into(),
            address::CONTROL_SUPPLY => inputs.control_supply_100mv.into(),
            address::TEMPERATURE => inputs.temperature_100mdegc.into(),
            address::MOTOR_CURRENT => i16::try_from(controller.current_ma(now)).unwrap_or(i16::MAX).into(),
            address::GENERIC_STATUS => controller.generic_status().into(),
            address::TORQUE_DEACTIVATION_STATE => controller.torque_deactivation_state().into(),
            address::BATTERY => inputs.battery_10mv.into(),
            address::STATUS_WORD => controller.status_word(now).into(),
            address::POSITION => controller.position(now).into(),
            address::VELOCITY => controller.velocity(now).into(),
            _ => return,
        };
        self.storage.set_raw(address, measured as u64);
    }

    fn check(&mut self, entry: &Entry, value: i64) -> Result<(), AbortCode> {
        let address = entry.address;
        self.check_state(address)?;
        self.check_ranges(entry, value)?;
        let travelling = self.controller.is_travelling(self.now);
        match address {
            // "The states can be set in OPERATIONAL only" (7.3).
            address::CONTROL_WORD => require(self.network == NmtState::Operational, AbortCode::DEVICE_STATE),
            // Changes that would renumber the positions during a job are refused too, although the manual says so only
            // for the calibration.
            address::D_POS
            | address::SPINDLE_PITCH
            | address::MODE
            | address::SENSE_OF_ROTATION
            | address::GEAR_NUMERATOR
            | address::GEAR_DENOMINATOR => require(!travelling, AbortCode::DEVICE_STATE),
            address::CALIBRATION_VALUE => {
                require(!travelling, AbortCode::DEVICE_STATE)?;
                require(self.is_within_limits(value), AbortCode::INVALID_VALUE)
            }
            address::LIMIT_2 => require(value <= self.limits()[1], AbortCode::MAXIMUM_BELOW_MINIMUM),
            address::LIMIT_1 => require(value >= self.limits()[0], AbortCode::MAXIMUM_BELOW_MINIMUM),
            _ if address.index() == address::RESTORE_ALL.index() => {
                require(value == LOAD, AbortCode::INVALID_VALUE)?;
                require(!travelling, AbortCode::DEVICE_STATE)
            }
            // Reserved in these drives; CiA 301 has it for "on request after a SYNC". 1800h to 19FFh are TPDOs.
            _ if address.index() & !0x1FF == cia301::TPDO_1 && address.sub() == 2 => {
                require(value != 252, AbortCode::INVALID_VALUE)
            }
            _ => Ok(()),
        }
    }

    fn check_state(&self, address: Address) -> Result<(), AbortCode> {
        let Some(rule) = self.model.writable_in.iter().find(|rule| rule.address == address) else { return Ok(()) };
        let allowed = match self.network {
            NmtState::PreOperational => rule.pre_operational,
            NmtState::Operational => rule.operational,
            // During initialisation, the device itself writes.
            _ => true,
        };
        require(allowed, AbortCode::DEVICE_STATE)
    }

    /// Checks limits that depend on the gear.
    fn check_ranges(&self, entry: &Entry, value: i64) -> Result<(), AbortCode> {
        for range in self.model.ranges.iter().filter(|range| range.address == entry.address) {
            let low = signed(entry.data_type, range.limit.low);
            let high = signed(entry.data_type, range.limit.high);
            if range.when.holds(self.storage.raw(range.when.address).unwrap_or_default()) {
                require((low..=high).contains(&Some(value)), AbortCode::INVALID_VALUE)?;
            }
        }
        Ok(())
    }

    /// Limits 2 and 1, in this order.
    fn limits(&self) -> [i64; 2] {
        [address::LIMIT_2, address::LIMIT_1].map(|limit| self.storage.number(limit).unwrap_or_default())
    }

    fn is_within_limits(&self, position: i64) -> bool {
        let [low, high] = self.limits();
        low == high || (low.min(high)..=low.max(high)).contains(&position)
    }

    fn follow(&mut self, address: Address, value: i64) {
        match address {
            address::CONTROL_WORD if self.by_sdo && !self.model.control_by_sdo => {}
            address::CONTROL_WORD => self.effects.push(Effect::Control(value as u16)),
            address::CALIBRATION_VALUE | address::CALIBRATE => self.effects.push(Effect::Calibrate),
            address::RESTORE_ALL => self.restore(Restore::All),
            address::RESTORE_STANDARD => self.restore(Restore::Standard),
            address::RESTORE_CONTROLLER => self.restore(Restore::Controller),
            _ => {}
        }
    }

    fn restore(&mut self, which: Restore) {
        restore(self.model, self.node, self.storage, which);
        // Parameter 25 is a standard parameter.
        if which != Restore::Controller {
            *self.inching_stop = 0;
        }
    }
}

/// Restores parameters to factory settings; node-ID, bit rate and position stay (1011h).
pub(super) fn restore(model: &Model, node: NodeId, storage: &mut dyn Storage, which: Restore) {
    let restored = |set| match which {
        Restore::All => true,
        Restore::Standard => set == ParameterSet::Standard,
        Restore::Controller => set == ParameterSet::Controller,
    };
    let factory = (model.storage)(node);
    for parameter in model.parameters.iter().filter(|parameter| restored(parameter.set)) {
        storage.set_raw(parameter.address, factory.raw(parameter.address).unwrap_or_default());
    }
    fit(model, storage);
}

/// Reduces values that are more than the gear allows, since one default serves all gears.
pub(super) fn fit(model: &Model, storage: &mut dyn Storage) {
    for range in model.ranges {
        let Ok(entry) = storage.entry(range.address) else { continue };
        let high = signed(entry.data_type, range.limit.high);
        let holds = range.when.holds(storage.raw(range.when.address).unwrap_or_default());
        if holds && storage.number(range.address) > high {
            storage.set_raw(range.address, range.limit.high);
        }
    }
}

/// The value that restores when written to 1011h.
const LOAD: i64 = u32::from_le_bytes(*b"load") as i64;

fn require(condition: bool, code: AbortCode) -> Result<(), AbortCode> {
    if condition { Ok(()) } else { Err(code) }
}
