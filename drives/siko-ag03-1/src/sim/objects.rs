//! The dictionary as the simulated drive serves it: live values are looked up when they are read, and
//! writes are refused as chapters 6 and 7.12 say.

use lexican_runtime::Instant;
use lexican_runtime::abort::AbortCode;
use lexican_runtime::object::{Address, Entry, ObjectDictionary, Value};
use lexican_runtime::wire::nmt::NmtState;

use super::controller::Controller;
use super::parameters::{Mode, Parameters};
use super::switches::Restore;
use crate::od;
use crate::parameter::{PARAMETERS, ParameterSet};

/// Storage and controller, lent to the device for one call.
pub(super) struct Objects<'a> {
    pub(super) now: Instant,
    pub(super) network: NmtState,
    pub(super) storage: &'a mut od::Storage,
    pub(super) controller: &'a Controller,
    pub(super) effects: &'a mut Vec<Effect>,
}

/// What follows from a write, once the frame has been dealt with: a PDO writes the control word before the
/// target that it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// A control word came.
    Control(u16),
    /// A control word came with a target that is out of range.
    ControlWithoutTarget(u16),
    /// The calibration value becomes the position.
    Calibrate,
}

impl ObjectDictionary for Objects<'_> {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        self.storage.entry(address)
    }

    fn len(&self, entry: &Entry) -> Option<u32> {
        self.storage.len(entry)
    }

    fn read(&mut self, entry: &Entry, offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        self.look_up(entry.address);
        self.storage.read(entry, offset, buffer)
    }

    fn write(&mut self, entry: &Entry, offset: u32, data: &[u8], last: bool) -> Result<(), AbortCode> {
        let value = Written::new(entry, data);
        self.check(entry, value)?;
        self.storage.write(entry, offset, data, last)?;
        self.follow(entry.address, value);
        Ok(())
    }
}

impl Objects<'_> {
    /// Puts what the drive measures into the storage, from where it is read.
    fn look_up(&mut self, address: Address) {
        let (now, controller, storage) = (self.now, self.controller, &mut *self.storage);
        let inputs = &controller.inputs;
        match (address.index(), address.sub()) {
            (0x1002, 0) => {
                storage.set(od::MANUFACTURER_STATUS_REGISTER, od::SystemStatus(controller.system_status(now)));
            }
            (0x241B, 1) => {
                let supply = od::SupplyVoltage(inputs.output_stage_supply_100mv);
                storage.set(od::POWER_SUPPLY_VOLTAGE.output_stage(), supply);
            }
            (0x241B, 2) => {
                storage.set(od::POWER_SUPPLY_VOLTAGE.control(), od::SupplyVoltage(inputs.control_supply_100mv));
            }
            (0x241C, 0) => storage.set(od::OUTPUT_STAGE_TEMPERATURE, od::Temperature(inputs.temperature_100mdegc)),
            (0x241E, 0) => {
                let current = i16::try_from(controller.current_ma(now)).unwrap_or(i16::MAX);
                storage.set(od::MOTOR_CURRENT, od::MotorCurrent(current));
            }
            (0x2420, 0) => storage.set(od::GENERIC_STATUS_REGISTER, od::GenericStatus(controller.generic_status())),
            (0x2422, 0) => {
                let flags = od::TorqueDeactivationFlags(controller.torque_deactivation_state());
                storage.set(od::TORQUE_DEACTIVATION_STATE, flags);
            }
            (0x2423, 0) => storage.set(od::BATTERY_VOLTAGE, od::BatteryVoltage(inputs.battery_10mv)),
            (0x6041, 0) => storage.set(od::STATUSWORD, od::Statusword(controller.status_word(now))),
            (0x6064, 0) => storage.set(od::POSITION_ACTUAL_VALUE, od::Position(controller.position(now))),
            (0x606C, 0) => storage.set(od::VELOCITY_ACTUAL_VALUE, od::Velocity(controller.velocity(now))),
            _ => {}
        }
    }

    fn check(&mut self, entry: &Entry, value: Written) -> Result<(), AbortCode> {
        let address = entry.address;
        self.check_state(address)?;
        self.check_ranges(address, value)?;
        let travelling = self.controller.is_travelling(self.now);
        match (address.index(), address.sub()) {
            // "The states can be set in OPERATIONAL only" (7.3).
            (0x6040, _) => require(self.network == NmtState::Operational, AbortCode::DEVICE_STATE),
            // Reserved here; CiA 301 has it for "on request after a SYNC".
            (0x1800..=0x1803, 2) => require(value.raw != 252, AbortCode::INVALID_VALUE),
            (0x2410, 0x0A) => require(!travelling, AbortCode::DEVICE_STATE),
            // What renumbers the positions under a running job is refused too; the manual says so of the
            // calibration only.
            (0x2412 | 0x6060 | 0x607E | 0x6091, _) => require(!travelling, AbortCode::DEVICE_STATE),
            (0x607C, _) => {
                require(!travelling, AbortCode::DEVICE_STATE)?;
                require(self.is_within_limits(value.signed), AbortCode::INVALID_VALUE)
            }
            (0x607D, 1) => require(value.signed <= i64::from(self.limits()[1]), AbortCode::MAXIMUM_BELOW_MINIMUM),
            (0x607D, 2) => require(value.signed >= i64::from(self.limits()[0]), AbortCode::MAXIMUM_BELOW_MINIMUM),
            (0x1011, _) => {
                require(value.raw == od::RestoreSignature::LOAD.to_raw(), AbortCode::INVALID_VALUE)?;
                require(!travelling, AbortCode::DEVICE_STATE)
            }
            _ => Ok(()),
        }
    }

    fn check_state(&self, address: Address) -> Result<(), AbortCode> {
        let Some(rule) = od::WRITABLE_IN.iter().find(|rule| rule.address == address) else { return Ok(()) };
        let allowed = match self.network {
            NmtState::PreOperational => rule.pre_operational,
            NmtState::Operational => rule.operational,
            // While it starts, the device itself writes.
            _ => true,
        };
        require(allowed, AbortCode::DEVICE_STATE)
    }

    /// Limits that depend on the gear.
    fn check_ranges(&mut self, address: Address, value: Written) -> Result<(), AbortCode> {
        for range in od::RANGES.iter().filter(|range| range.address == address) {
            let low = value.of_same_type(range.limit.low);
            let high = value.of_same_type(range.limit.high);
            if range.when.holds(self.raw(range.when.address)) {
                require((low..=high).contains(&value.signed), AbortCode::INVALID_VALUE)?;
            }
        }
        Ok(())
    }

    fn limits(&self) -> [i32; 2] {
        let limits = od::SOFTWARE_POSITION_LIMIT;
        [self.storage.get(limits.limit_2()).0, self.storage.get(limits.limit_1()).0]
    }

    fn is_within_limits(&self, position: i64) -> bool {
        let [low, high] = self.limits();
        low == high || (i64::from(low.min(high))..=i64::from(low.max(high))).contains(&position)
    }

    /// The number at `address`, in wire form; 0 when there is none.
    fn raw(&mut self, address: Address) -> u64 {
        raw(self.storage, address)
    }

    fn follow(&mut self, address: Address, value: Written) {
        match (address.index(), address.sub()) {
            (0x6040, _) => self.effects.push(Effect::Control(value.raw as u16)),
            (0x607C, _) | (0x1011, 4) => self.effects.push(Effect::Calibrate),
            (0x1011, sub) => {
                if let Some(which) = Restore::ALL.into_iter().find(|which| which.sub_index() == sub) {
                    restore(self.storage, which);
                }
            }
            _ => {}
        }
    }
}

/// Parameters back to their factory settings; node-ID and bit rate stay, and so does the position (1011h).
pub(super) fn restore(storage: &mut od::Storage, which: Restore) {
    let restored = |set| match which {
        Restore::All => true,
        Restore::Standard => set == ParameterSet::Standard,
        Restore::Controller => set == ParameterSet::Controller,
    };
    for parameter in PARAMETERS.iter().filter(|parameter| restored(parameter.set)) {
        let table = storage.table();
        let Ok(entry) = table.entry(parameter.address) else { continue };
        let start = entry.offset as usize;
        let default = table.image.get(start..start + usize::from(entry.capacity)).unwrap_or(&[]);
        // Defaults keep their own limits, so that nothing is refused.
        let _ = storage.write(&entry, 0, default, true);
    }
}

/// The number at `address`, in wire form; 0 when there is none.
pub(super) fn raw(storage: &mut od::Storage, address: Address) -> u64 {
    let mut bytes = [0; 8];
    if let Ok(entry) = storage.entry(address) {
        // What is shorter than eight bytes leaves zeros behind it.
        let _ = storage.read(&entry, 0, &mut bytes);
    }
    u64::from_le_bytes(bytes)
}

/// What the objects say of the parameters.
pub(super) fn parameters(storage: &od::Storage) -> Parameters {
    let set = od::MOTOR_PARAMETER_SET;
    let limits = od::SOFTWARE_POSITION_LIMIT;
    Parameters {
        a_pos: storage.get(set.a_pos()).0,
        v_pos: storage.get(set.v_pos()).0,
        a_rot: storage.get(set.a_rot()).0,
        a_inch: storage.get(set.a_inch()).0,
        v_inch: storage.get(set.v_inch()).0,
        window: storage.get(od::POSITION_WINDOW).0,
        numerator: storage.get(od::GEAR_RATIO.numerator()),
        denominator: storage.get(od::GEAR_RATIO.denominator()),
        spindle_pitch: storage.get(od::SPINDLE_PITCH).0,
        calibration_value: storage.get(od::CALIBRATION_VALUE).0,
        limits: [storage.get(limits.limit_2()).0, storage.get(limits.limit_1()).0],
        delta_inch: storage.get(od::DELTA_JOG).0,
        counts_down: storage.get(od::POLARITY) == od::SenseOfRotation::E,
        positioning_type: storage.get(od::POS_TYPE).0,
        mode: match storage.get(od::MODES_OF_OPERATION) {
            od::OperatingMode::PROFILE_VELOCITY => Mode::Velocity,
            _ => Mode::Positioning,
        },
        target_position: storage.get(od::TARGET_POSITION).0,
        target_velocity: storage.get(od::TARGET_VELOCITY).0,
        inching_stop: storage.get(od::STOP_MODE_INCHING_MODE_2).0,
        in_position_mode: storage.get(od::INPOS_MODE).0,
        loop_length: storage.get(od::LOOP_LENGTH).0,
        torque_deactivation: storage.get(od::TORQUE_DEACTIVATION).0,
        inching_2_offset: storage.get(od::INCHING_2_OFFSET).0,
        d_pos: storage.get(set.d_pos()).0,
    }
}

/// A number that is being written.
#[derive(Clone, Copy)]
struct Written {
    raw: u64,
    signed: i64,
    unused_bits: u32,
    is_signed: bool,
}

impl Written {
    fn new(entry: &Entry, data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
        let raw = u64::from_le_bytes(bytes);
        let unused_bits = 64 - u32::from(entry.data_type.bits().unwrap_or(64));
        let mut written = Written { raw, signed: 0, unused_bits, is_signed: entry.data_type.is_signed() };
        written.signed = written.of_same_type(raw);
        written
    }

    fn of_same_type(self, raw: u64) -> i64 {
        let high = raw << self.unused_bits;
        if self.is_signed { (high as i64) >> self.unused_bits } else { (high >> self.unused_bits) as i64 }
    }
}

fn require(condition: bool, code: AbortCode) -> Result<(), AbortCode> {
    if condition { Ok(()) } else { Err(code) }
}
