//! A simulated drive behind PROFIBUS.

use lexican_profibus::pkw::{Parameter, ParameterTable, Pkw, PkwServer, Refusal};
use lexican_profibus::{Application, State};
use lexican_runtime::Instant;
use lexican_runtime::abort::AbortCode;
use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use siko::order::{Braking, Order};
use siko::sim::controller::Network;
use siko::sim::{Setup, SimulatedDrive};
use siko::state;
use siko::state::Mode;
use siko::words::{status as can_status, system};

use crate::model::{Model, NODE, PPO};
use crate::table::{self, Content};
use crate::words::{BEYOND_LIMIT, INCHING_NEGATIVE, READY_TO_TRAVEL, control, status};

/// A simulated drive with control words of PROFIDRIVE, and with parameters by PROFIBUS number. Motion, parameters,
/// faults and conditions are those of the same drive on CANopen.
///
/// # Decisions where the manuals are silent
///
/// | Question | Here |
/// |---|---|
/// | the order of bytes in a word | the high one first |
/// | a control word that enables and starts a travel at once | only enables |
/// | enabling without supply (ZSW.0 is 0) | is not possible |
/// | switching on when the data exchange begins with STW.0 set | as any other: no interlock |
/// | acknowledging a fault while STW.0 is 0 | the interlock shows once and is over with the next telegram |
/// | ZSW.12 | changes whenever a travel is taken |
/// | bit 15 of STW changes while inching 2 is on | counts from the next inching on |
/// | STW.8 is cleared while a step is under way | the step goes on |
/// | a target out of range | no travel is started |
/// | PNU 945: empty places, and which is the newest | 0, and index 0 |
/// | a write of 1016 or 1017 that makes limit 1 the lower one | error 2 |
/// | a write that travelling does not allow | error 17 |
/// | reading PNU 970 | error 18 |
/// | the outputs when data exchange ends | zero, which is OFF 1 |
/// | the drive between two telegrams | is brought up to date by the next one |
#[derive(Clone, Debug)]
pub struct ProfibusDrive {
    model: &'static Model,
    address: u8,
    drive: SimulatedDrive,
    tasks: PkwServer,
    reply: Pkw,
    control: u16,
    /// A fault has been acknowledged, and no OFF 1 has come since.
    inhibited: bool,
    /// ZSW.12.
    acknowledged: bool,
    /// Velocity mode: the set-point is enabled.
    turns: bool,
}

impl ProfibusDrive {
    /// A drive that is switched on at `now`, with `address` in its switches or its parameter 22.
    #[must_use]
    pub fn new(now: Instant, model: &'static Model, address: u8) -> Self {
        ProfibusDrive::power_on(now, model, Setup::new(model.drive, NODE), address)
    }

    /// The same with a set-up: EEPROM, gear, and so on.
    #[must_use]
    pub fn power_on(now: Instant, model: &'static Model, setup: Setup, address: u8) -> Self {
        ProfibusDrive::of(now, model, SimulatedDrive::power_on(now, setup), address)
    }

    /// The same with an existing drive.
    #[must_use]
    pub fn of(now: Instant, model: &'static Model, drive: SimulatedDrive, address: u8) -> Self {
        let mut it = ProfibusDrive {
            model,
            address: Model::address(address),
            drive,
            tasks: PkwServer::new(),
            reply: Pkw::default(),
            control: 0,
            inhibited: false,
            acknowledged: false,
            turns: false,
        };
        it.advance(now);
        it
    }

    /// The address at power-on.
    #[must_use]
    pub fn address(&self) -> u8 {
        self.address
    }

    /// The drive.
    #[must_use]
    pub fn drive(&self) -> &SimulatedDrive {
        &self.drive
    }

    /// The drive, to change its inputs.
    pub fn drive_mut(&mut self) -> &mut SimulatedDrive {
        &mut self.drive
    }

    /// The status word (tables 12 and 14).
    #[must_use]
    pub fn status_word(&self, now: Instant) -> u16 {
        let controller = self.drive.controller();
        let (seen, systems) = (controller.status_word(now), controller.system_status(now));
        let (motion, mode) = (controller.motion(), self.drive.parameters().mode);
        let moves = systems & system::MOVING != 0 || motion.is_active(now) && !motion.is_interrupted();
        let is_ready = self.is_ready();
        let fixed = status::NO_OFF_3 | status::CONTROL_REQUESTED | status::REFERENCED;
        let of_mode = match mode {
            Mode::Positioning => bits(&[
                (status::NO_LAG, systems & system::LAG_ERROR == 0),
                (status::TARGET_REACHED, seen & can_status::TARGET_REACHED != 0),
                (status::ORDER_ACKNOWLEDGED, self.acknowledged),
                (BEYOND_LIMIT, seen & can_status::INTERNAL_LIMIT != 0),
                (READY_TO_TRAVEL, seen & can_status::READY != 0),
            ]),
            Mode::Velocity => bits(&[
                (status::VELOCITY_IN_WINDOW, seen & can_status::TARGET_REACHED != 0),
                (status::TARGET_REACHED | status::ORDER_ACKNOWLEDGED, true),
                (BEYOND_LIMIT, self.model.velocity_bit_14),
                (READY_TO_TRAVEL, seen & can_status::READY != 0 && !self.turns),
            ]),
        };
        fixed
            | of_mode
            | bits(&[
                (status::READY_TO_SWITCH_ON | status::READY, is_ready),
                (status::OPERATION_ENABLED, self.drive.state() == state::State::OperationEnabled),
                (status::FAULT, self.drive.state() == state::State::Fault),
                (status::NO_OFF_2, self.control & control::NO_OFF_2 != 0),
                (status::SWITCH_ON_INHIBITED, self.inhibited),
                (status::WARNING, seen & can_status::WARNING != 0),
                (status::STANDSTILL, !moves),
            ])
    }

    /// The actual value: the position, or the velocity in rev/min.
    #[must_use]
    pub fn actual_value(&self, now: Instant) -> i32 {
        match self.drive.parameters().mode {
            Mode::Positioning => self.drive.position(now),
            Mode::Velocity => self.drive.velocity(now),
        }
    }

    /// Whether the supply is applied (ZSW.0).
    fn is_ready(&self) -> bool {
        self.drive.is_on() && self.drive.inputs().supply_is_present()
    }

    /// Brings the drive up to date. Its CAN side is not connected, so its frames are dropped.
    fn advance(&mut self, now: Instant) {
        self.drive.handle_timeout(now);
        while self.drive.poll_transmit(now).is_some() {}
    }

    /// Sets the target; returns whether the drive takes it.
    fn take_target(&mut self, now: Instant, target: i32) -> bool {
        let object = match self.drive.parameters().mode {
            Mode::Positioning => TARGET_POSITION,
            Mode::Velocity => TARGET_VELOCITY,
        };
        let held = read_object(&mut self.drive, now, object).map(u32::cast_signed);
        held == Ok(target) || write_object(&mut self.drive, now, object, target).is_ok()
    }

    fn take_control(&mut self, now: Instant, word: u16, target_is_valid: bool) {
        let before = core::mem::replace(&mut self.control, word);
        let (rising, falling) = (word & !before, before & !word);
        if word & control::ON == 0 {
            self.inhibited = false;
        }
        if self.drive.state() == state::State::Fault {
            if rising & control::ACKNOWLEDGE != 0 {
                self.inhibited = self.order(now, Order::ResetFault);
            }
            return;
        }
        let was_enabled = self.drive.state() == state::State::OperationEnabled;
        let is_on = word & control::ON != 0 && word & control::NO_OFF_2 != 0 && !self.inhibited;
        let enables = word & control::ENABLE_OPERATION != 0;
        match self.drive.state() {
            state::State::OperationEnabled | state::State::QuickStopActive if !is_on => {
                self.order(now, Order::Release);
            }
            state::State::OperationEnabled if !enables => {
                self.order(now, Order::Hold);
            }
            _ if is_on && enables => {
                self.order(now, Order::Enable);
            }
            _ => {}
        }
        if self.drive.state() != state::State::OperationEnabled {
            self.turns = false;
        } else if was_enabled {
            match self.drive.parameters().mode {
                Mode::Positioning => self.control_positioning(now, word, (rising, falling), target_is_valid),
                Mode::Velocity => self.control_velocity(now, word, target_is_valid),
            }
        }
    }

    /// Follows the control word in positioning mode (table 11).
    fn control_positioning(&mut self, now: Instant, word: u16, (rising, falling): (u16, u16), target_is_valid: bool) {
        let motion = self.drive.controller().motion();
        let (is_positioning, is_interrupted) = (motion.is_positioning(now), motion.is_interrupted());
        if word & control::NO_STOP == 0 {
            if is_positioning {
                self.order(now, Order::Abort(Braking::Full));
            }
        } else if word & control::NO_INTERMEDIATE_STOP == 0 {
            if is_positioning {
                self.order(now, Order::Interrupt(Braking::Programmed));
            }
        } else if is_interrupted {
            self.order(now, Order::Resume);
        } else if (rising | falling) & control::START != 0 && target_is_valid && self.order(now, Order::Start) {
            self.acknowledged = !self.acknowledged;
        }
        if falling & control::INCHING_2 != 0 {
            self.order(now, Order::StopInching);
        }
        if rising & control::INCHING_1 != 0 {
            self.order(now, Order::Step);
        } else if rising & control::INCHING_2 != 0 {
            let negative = word & INCHING_NEGATIVE != 0;
            let direction = if negative { siko_ag03_1::Direction::Negative } else { siko_ag03_1::Direction::Positive };
            self.order(now, Order::Inch(direction));
        }
    }

    /// Follows the control word in velocity mode (table 13).
    fn control_velocity(&mut self, now: Instant, word: u16, target_is_valid: bool) {
        let enabled = word & control::ENABLE_SETPOINT != 0;
        if enabled && !self.turns && target_is_valid {
            self.turns = self.order(now, Order::Start);
        } else if !enabled {
            self.order(now, Order::Interrupt(Braking::Programmed));
            self.turns = false;
        }
    }

    /// Gives an order; returns whether the drive takes it. A refusal shows only in the status word.
    fn order(&mut self, now: Instant, order: Order) -> bool {
        self.drive.order(now, order).is_ok()
    }
}

impl Application for ProfibusDrive {
    fn take_outputs(&mut self, now: Instant, outputs: &[u8]) {
        self.advance(now);
        let task = PPO.pkw(outputs).unwrap_or_default();
        let mut tasks = core::mem::take(&mut self.tasks);
        self.reply = tasks.handle(task, &mut Lent { drive: self, now });
        self.tasks = tasks;
        let target_is_valid = PPO.double_word(outputs, 1).is_some_and(|target| self.take_target(now, target));
        self.take_control(now, PPO.word(outputs, 0).unwrap_or(0), target_is_valid);
    }

    fn write_inputs(&mut self, now: Instant, inputs: &mut [u8]) {
        self.advance(now);
        PPO.set_pkw(inputs, self.reply);
        PPO.set_word(inputs, 0, self.status_word(now));
        PPO.set_double_word(inputs, 1, self.actual_value(now));
    }

    /// The operator keys are locked while data is exchanged (2.2.1.2).
    fn enter(&mut self, now: Instant, state: State) {
        let exchanges = state == State::DataExchange;
        self.drive.set_network(now, if exchanges { Network::Operational } else { Network::PreOperational });
        self.tasks.reset();
    }
}

/// A drive at one time, as a table of parameters.
struct Lent<'a> {
    drive: &'a mut ProfibusDrive,
    now: Instant,
}

impl ParameterTable for Lent<'_> {
    fn parameter(&self, number: u16) -> Option<Parameter> {
        table::find(self.drive.model.table, number).map(|row| row.wire)
    }

    fn read(&mut self, number: u16, index: u16) -> Result<u32, Refusal> {
        let row = table::find(self.drive.model.table, number).ok_or(Refusal::NO_SUCH_PARAMETER)?;
        let drive = &mut self.drive.drive;
        match row.content {
            Content::Object(_) => {
                let element = u8::try_from(index).ok().and_then(|index| row.parameter.object_at(index));
                let number = read_object(drive, self.now, element.ok_or(Refusal::NO_SUCH_ELEMENT)?)?;
                // A fault without a number on PROFIBUS is 0.
                Ok(row.parameter.of_object(number.into()).unwrap_or(0) as u32)
            }
            Content::Address => Ok(self.drive.address.into()),
            Content::Version => Ok(self.drive.model.version.into()),
            Content::InchingStop => Ok(drive.parameters().inching_stop.into()),
            Content::Load => Err(Refusal::OTHER),
        }
    }

    fn write(&mut self, number: u16, _: u16, value: u32) -> Result<u32, Refusal> {
        let row = table::find(self.drive.model.table, number).ok_or(Refusal::NO_SUCH_PARAMETER)?;
        let drive = &mut self.drive.drive;
        match row.content {
            Content::Object(object) => {
                let number = row.parameter.in_object(value.cast_signed().into()).ok_or(Refusal::OUT_OF_RANGE)?;
                write_object(drive, self.now, object, number as i32)?;
            }
            Content::InchingStop => {
                drive.set_inching_stop(self.now, if value == 1 { Braking::Programmed } else { Braking::Full });
            }
            Content::Load => {
                load(drive, self.now, value)?;
                return Ok(0);
            }
            Content::Address | Content::Version => return Err(Refusal::READ_ONLY),
        }
        Ok(value)
    }
}

/// Writes PNU 970.
fn load(drive: &mut SimulatedDrive, now: Instant, what: u32) -> Result<(), Refusal> {
    let signature = i32::from_le_bytes(*b"load");
    let sub = match what {
        1..=3 => what as u8,
        4 => {
            return (0..=10).try_for_each(|sub| write_object(drive, now, Address::new(0x1003, sub), 0));
        }
        _ => 4,
    };
    write_object(drive, now, Address::new(0x1011, sub), signature)
}

const TARGET_POSITION: Address = Address::new(0x607A, 0);
const TARGET_VELOCITY: Address = Address::new(0x60FF, 0);

fn read_object(drive: &mut SimulatedDrive, now: Instant, address: Address) -> Result<u32, Refusal> {
    drive.with_dictionary(now, |od| {
        let entry = od.entry(address).map_err(refusal)?;
        let mut bytes = [0; 4];
        od.read(&entry, 0, &mut bytes).map_err(refusal)?;
        Ok(u32::from_le_bytes(bytes))
    })
}

fn write_object(drive: &mut SimulatedDrive, now: Instant, address: Address, value: i32) -> Result<(), Refusal> {
    drive.with_dictionary(now, |od| {
        let entry = od.entry(address).map_err(refusal)?;
        let size = entry.data_type.size().unwrap_or(0);
        let bytes = value.to_le_bytes();
        let data = bytes.get(..size).ok_or(Refusal::WRONG_TYPE)?;
        od.write(&entry, 0, data, true).map_err(refusal)
    })
}

fn refusal(code: AbortCode) -> Refusal {
    match code {
        AbortCode::INVALID_VALUE
        | AbortCode::VALUE_TOO_HIGH
        | AbortCode::VALUE_TOO_LOW
        | AbortCode::MAXIMUM_BELOW_MINIMUM => Refusal::OUT_OF_RANGE,
        AbortCode::DEVICE_STATE => Refusal::WRONG_STATE,
        _ => Refusal::OTHER,
    }
}

fn bits(bits: &[(u16, bool)]) -> u16 {
    bits.iter().filter(|(_, set)| *set).fold(0, |word, (bit, _)| word | bit)
}
