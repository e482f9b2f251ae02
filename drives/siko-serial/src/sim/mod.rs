//! The simulated AG02 behind its serial port: the drive of [`siko_ag02::sim`], the same motion, the same parameters.
//!
//! # Decisions where the manual is silent
//!
//! | Question | Here |
//! |---|---|
//! | what ends a command whose rest does not come, or is wrong | no time; the first byte that cannot belong to it, which is answered by 02 |
//! | which error an unknown letter has | 01 |
//! | line ends and spaces between commands | are left out, so that a terminal may send them |
//! | which error comes first, when several hold | 03, 10, 04, 11, 05 to 08, 09 |
//! | a setpoint beyond a limit | 09 in positioning mode; 02 beyond the gear's velocity, since velocity mode has no limits |
//! | `K`, `,` and `.` when they are refused | do nothing, and are never answered |
//! | `I` without a travel | is carried out; in velocity mode it is refused by 04 |
//! | `M` in an intermediate stop | goes on; to the new setpoint, if there is one |
//! | `M` in velocity mode while it turns | is carried out |
//! | `P` while it moves | the motor runs out |
//! | `,` and `.` that go on after a stop | move nothing until none has come for 100 ms |
//! | what happens to a travel when the bus takes command | the motor is released |
//! | `K` while it moves | as switching the supply off and on |
//! | what `S11103` says while the cause is still there | 10 |
//! | CR behind the answer to `W` | does not come (chapter 6, "zur Ausgabe") |
//! | the texts of `A` | `02.00   `, that of the software; `CAN     `, `55:1    `; the hardware is `01.00   ` |
//! | the default of parameter 25 | 0: full deceleration, as in the text |

mod line;

use std::collections::VecDeque;

use lexican_driver::Direction;
use lexican_runtime::cia301::PREDEFINED_ERROR_FIELD as FAULTS;
use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Duration, Instant, NodeId};
use siko::words::system;
use siko_ag02::od;
use siko_ag02::sim::motion::Job;
use siko_ag02::sim::parameters::Mode as DriveMode;
use siko_ag02::sim::{Braking, MODEL, Order, SimulatedDrive};

pub use line::VirtualLine;

use crate::answer::{Answer, Flags};
use crate::command::{Command, Decoder, Identity, Long, Mode, Setting, Turning};
use crate::error::ErrorNumber;
use crate::parameter;
use crate::telegram::Telegram;

/// The time without its character after which inching operation 2 ends (chapter 2.2.1.2).
const INCHING_WITHOUT: Duration = Duration::from_millis(100);

/// The value that restores when written to 1011h.
const LOAD: i64 = u32::from_le_bytes(*b"load") as i64;

/// A simulated drive behind its serial port.
#[derive(Clone, Debug)]
pub struct SerialDrive {
    drive: SimulatedDrive,
    decoder: Decoder,
    answers: VecDeque<Telegram>,
    /// Inching operation 2, and when it ends without another character.
    inching: Option<(Direction, Instant)>,
}

/// A new drive, powered on at time 0, on no bus.
impl Default for SerialDrive {
    fn default() -> Self {
        SerialDrive::new(SimulatedDrive::new(&MODEL, NodeId::literal(127)))
    }
}

impl SerialDrive {
    /// The serial port of `drive`.
    #[must_use]
    pub fn new(drive: SimulatedDrive) -> Self {
        SerialDrive { drive, decoder: Decoder::default(), answers: VecDeque::new(), inching: None }
    }

    /// The drive.
    #[must_use]
    pub fn drive(&self) -> &SimulatedDrive {
        &self.drive
    }

    /// The drive, to change its inputs and its bus.
    pub fn drive_mut(&mut self) -> &mut SimulatedDrive {
        &mut self.drive
    }

    /// The drive without its serial port.
    #[must_use]
    pub fn into_drive(self) -> SimulatedDrive {
        self.drive
    }

    /// Takes bytes of the line. A drive that is off ignores them.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for byte in bytes {
            if !self.drive.is_on() {
                return;
            }
            let answer = match self.decoder.take(*byte) {
                None => continue,
                Some(Ok(command)) => self.carry_out(now, command),
                Some(Err(number)) => Some(Answer::Refused(number)),
            };
            let encode =
                |answer: Answer| answer.encode().or_else(|| Answer::Refused(ErrorNumber::VALUE_RANGE).encode());
            self.answers.extend(answer.and_then(encode));
        }
    }

    /// The next answer.
    pub fn poll_transmit(&mut self) -> Option<Telegram> {
        self.answers.pop_front()
    }

    /// To call once the time of [`SerialDrive::poll_timeout`] has come.
    pub fn handle_timeout(&mut self, now: Instant) {
        if self.inching.is_some_and(|(_, until)| until <= now) {
            self.end_inching(now);
        }
        if self.drive.poll_timeout().is_some_and(|deadline| deadline <= now) {
            self.drive.handle_timeout(now);
        }
    }

    /// When to call [`SerialDrive::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.inching.map(|(_, until)| until).into_iter().chain(self.drive.poll_timeout()).min()
    }

    fn carry_out(&mut self, now: Instant, command: Command) -> Option<Answer> {
        // While the bus is in command, only reading, `N` and `O` are allowed (chapter 6).
        let bus_commands = matches!(self.drive.nmt_state(), NmtState::Operational | NmtState::Stopped);
        let always = command.is_read() || matches!(command, Command::EmergencyStop | Command::Stop);
        let outcome = match command {
            _ if bus_commands && !always => Err(ErrorNumber::NO_AUTHORITY),
            Command::Inch(direction) => {
                self.inch(now, direction);
                Ok(Answer::Done)
            }
            Command::Restart => {
                *self = SerialDrive::new(self.drive.clone());
                self.drive.power_cycle(now);
                Ok(Answer::Done)
            }
            _ if command.is_read() => self.read(now, command),
            _ => self.write(now, command).map(|()| Answer::Done),
        };
        (!command.reply().is_empty()).then(|| outcome.unwrap_or_else(Answer::Refused))
    }

    fn read(&mut self, now: Instant, command: Command) -> Result<Answer, ErrorNumber> {
        let controller = self.drive.controller();
        Ok(match command {
            Command::Identity(which) => Answer::Text(*match which {
                Identity::Hardware => b"01.00   ",
                Identity::Software => b"02.00   ",
                Identity::Bus => b"CAN     ",
                Identity::Gear => match self.drive.stored(od::GEAR_REDUCTION) {
                    od::GearReduction::GEAR_55_1 => b"55:1    ",
                    od::GearReduction::GEAR_62_1 => b"62:1    ",
                    _ => b"135:1   ",
                },
            }),
            Command::ReadLong(which) => Answer::Long(self.value(now, which.object(self.mode()))? as i32),
            Command::ReadShort(which) => Answer::Short(self.value(now, which.object())? as u32),
            Command::FaultCount => Answer::Count(self.value(now, Address::new(FAULTS, 0))? as u8),
            Command::Faults => Answer::Letters(self.letters(now)?),
            Command::Status => Answer::Status(controller.system_status(now)),
            Command::Velocity => Answer::Velocity(controller.velocity(now).clamp(-999, 999) as i16),
            Command::BinaryPosition => Answer::Binary(controller.position(now)),
            Command::Position => Answer::Long(controller.position(now)),
            Command::Flags => {
                let parameters = self.drive.parameters();
                let mode = if self.mode() == Mode::Velocity { Flags::VELOCITY } else { 0 };
                let sense = if parameters.counts_down { Flags::SENSE_E } else { 0 };
                Answer::Flags(Flags(mode | sense | parameters.positioning_type << 1))
            }
            _ => return Err(ErrorNumber::PARAMETER_NUMBER),
        })
    }

    fn write(&mut self, now: Instant, command: Command) -> Result<(), ErrorNumber> {
        match command {
            Command::WriteLong(Long::Setpoint, target) if self.mode() == Mode::Positioning => {
                let limits = self.drive.parameters().position_limits();
                if limits.is_some_and(|(low, high)| !(low..=high).contains(&target)) {
                    return Err(ErrorNumber::SETPOINT_BEYOND_LIMIT);
                }
                self.set(now, Long::Setpoint.object(Mode::Positioning), target.into())
            }
            Command::WriteLong(which, number) => self.set(now, which.object(self.mode()), number.into()),
            Command::WriteShort(which, number) => self.set(now, which.object(), number.into()),
            Command::SetPosType(which) => self.set(now, parameter::POS_TYPE, which.in_object().into()),
            Command::SetMode(mode) => self.set(now, parameter::MODE, mode.in_object().into()),
            Command::SetTurning(which) => {
                if let Some(sense) = which.in_object() {
                    return self.set(now, parameter::SENSE_OF_ROTATION, sense.into());
                }
                let by_ramp = which == Turning::JogStopsByRamp;
                self.drive.set_inching_stop(now, if by_ramp { Braking::Programmed } else { Braking::Full });
                Ok(())
            }
            Command::Start => self.start(now),
            Command::EmergencyStop => self.stop(now, Braking::Full),
            Command::Stop => self.stop(now, Braking::Programmed),
            Command::Abort if self.mode() == Mode::Velocity => Err(ErrorNumber::OPERATING_STATE),
            Command::Abort => self.order(now, Order::Abort(Braking::Programmed)),
            Command::Release => self.order(now, Order::Release),
            Command::Step => self.in_control(now, Order::Step),
            Command::Set(setting) => self.apply(now, setting),
            _ => Err(ErrorNumber::PARAMETER_NUMBER),
        }
    }

    fn apply(&mut self, now: Instant, setting: Setting) -> Result<(), ErrorNumber> {
        let restore = od::RESTORE_DEFAULT_PARAMETERS;
        let object = match setting {
            Setting::AllParameters => restore.all_parameters().address(),
            Setting::StandardParameters => restore.standard_parameters().address(),
            Setting::ControllerParameters => restore.controller_parameters().address(),
            Setting::Calibrate => Address::new(restore.all_parameters().address().index(), 4),
            Setting::ResetFault if !self.drive.controller().faults().is_empty() => {
                return self.order(now, Order::ResetFault);
            }
            Setting::ResetFault => return Ok(()),
            Setting::ClearFaults => {
                return (0..=10).try_for_each(|sub| self.set(now, Address::new(FAULTS, sub), 0));
            }
        };
        self.set(now, object, LOAD)
    }

    fn start(&mut self, now: Instant) -> Result<(), ErrorNumber> {
        let target = self.drive.parameters().shaft(self.drive.parameters().target_position);
        match self.drive.controller().motion().job() {
            Job::Positioning(travel) if self.drive.controller().motion().is_interrupted() => {
                if travel.target == target {
                    return self.order(now, Order::Resume);
                }
                self.order(now, Order::Abort(Braking::Programmed))?;
                self.in_control(now, Order::Start)
            }
            _ => self.in_control(now, Order::Start),
        }
    }

    fn stop(&mut self, now: Instant, braking: Braking) -> Result<(), ErrorNumber> {
        let lags = self.drive.controller().system_status(now) & system::LAG_ERROR != 0;
        self.order(now, if lags { Order::Release } else { Order::Interrupt(braking) })
    }

    /// Takes a character of inching operation 2, which is not answered.
    fn inch(&mut self, now: Instant, direction: Direction) {
        let until = now + INCHING_WITHOUT;
        match self.inching {
            Some((current, _)) if current == direction => self.inching = Some((direction, until)),
            Some(_) => self.end_inching(now),
            None => {
                let begun = self.in_control(now, Order::Inch(direction));
                self.inching = begun.is_ok().then_some((direction, until));
            }
        }
    }

    fn end_inching(&mut self, now: Instant) {
        self.inching = None;
        // A fault, or a bus that has taken command, may have ended it already.
        let _ = self.drive.order(now, Order::StopInching);
    }

    /// Takes the motor into control for an order that moves it; if the order is refused, restores the former state.
    fn in_control(&mut self, now: Instant, order: Order) -> Result<(), ErrorNumber> {
        let before = self.drive.state();
        self.order(now, Order::Enable)?;
        let outcome = self.order(now, order);
        if outcome.is_err() && before != self.drive.state() {
            self.order(now, Order::Release)?;
        }
        outcome
    }

    fn order(&mut self, now: Instant, order: Order) -> Result<(), ErrorNumber> {
        self.drive.order(now, order).map_err(ErrorNumber::from)
    }

    fn mode(&self) -> Mode {
        match self.drive.parameters().mode {
            DriveMode::Positioning => Mode::Positioning,
            DriveMode::Velocity => Mode::Velocity,
        }
    }

    /// The fault buffer, oldest first; 1003h has the newest first.
    fn letters(&mut self, now: Instant) -> Result<[u8; 10], ErrorNumber> {
        let mut letters = [b'-'; 10];
        let count = self.value(now, Address::new(FAULTS, 0))? as u8;
        for (letter, sub) in letters.iter_mut().zip((1..=count).rev()) {
            let code = self.value(now, Address::new(FAULTS, sub))?;
            let fault = self.drive.model().faults.iter().find(|fault| i64::from(fault.code.number) == code);
            *letter = fault.map_or(b'?', |fault| fault.letter() as u8);
        }
        Ok(letters)
    }

    fn value(&mut self, now: Instant, address: Address) -> Result<i64, ErrorNumber> {
        self.drive
            .with_dictionary(now, |od| {
                let (entry, mut bytes) = (od.entry(address)?, [0; 8]);
                let len = od.read(&entry, 0, &mut bytes)?;
                let unused_bits = 64 - 8 * len.clamp(1, 8) as u32;
                let high = u64::from_le_bytes(bytes) << unused_bits;
                Ok(if entry.data_type.is_signed() { high as i64 >> unused_bits } else { (high >> unused_bits) as i64 })
            })
            .map_err(refusal)
    }

    fn set(&mut self, now: Instant, address: Address, value: i64) -> Result<(), ErrorNumber> {
        self.drive
            .with_dictionary(now, |od| {
                let entry = od.entry(address)?;
                let size = entry.data_type.size().ok_or(AbortCode::UNSUPPORTED_ACCESS)?;
                let spare = value >> (8 * size as u32 - u32::from(entry.data_type.is_signed()));
                if spare != 0 && (spare != -1 || !entry.data_type.is_signed()) {
                    return Err(AbortCode::INVALID_VALUE);
                }
                od.write(&entry, 0, value.to_le_bytes().get(..size).unwrap_or_default(), true)
            })
            .map_err(refusal)
    }
}

/// The error of table 4 for an SDO abort code.
fn refusal(code: AbortCode) -> ErrorNumber {
    match code {
        AbortCode::DEVICE_STATE => ErrorNumber::OPERATING_STATE,
        AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX => ErrorNumber::PARAMETER_NUMBER,
        _ => ErrorNumber::VALUE_RANGE,
    }
}
