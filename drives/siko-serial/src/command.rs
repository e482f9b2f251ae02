//! The 24 commands of table 3: meaning to bytes, and bytes to meaning.

use lexican_driver::Direction;

use crate::answer::Reply;
use crate::error::ErrorNumber;
use crate::telegram::{self, Telegram};

macro_rules! numbered {
    ($(#[$doc:meta])* $name:ident { $($variant:ident = $number:literal, $text:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u16)]
        pub enum $name {
            $(#[doc = concat!($text, ".")] $variant = $number,)*
        }

        impl $name {
            /// All of them, by number.
            pub const ALL: &[$name] = &[$($name::$variant),*];

            /// Its number in a command.
            #[must_use]
            pub const fn number(self) -> u16 {
                self as u16
            }

            /// The one with this number.
            #[must_use]
            pub fn from_number(number: u32) -> Option<Self> {
                Self::ALL.iter().copied().find(|it| u32::from(it.number()) == number)
            }
        }
    };
}

numbered! {
    /// What `A` reads: a text of eight characters, on which the manual says no more.
    Identity {
        Hardware = 0, "version of the hardware";
        Software = 1, "version of the software";
        Bus = 2, "which bus interface is built in";
        Gear = 3, "the gear";
    }
}

numbered! {
    /// What `E` reads and `F` writes: a sign and seven digits.
    Long {
        Setpoint = 0, "parameter 24: the target position, or the target velocity in rev/min in velocity mode; not stored";
        UpperLimit = 1, "parameter 15, in units of positions";
        LowerLimit = 2, "parameter 16, in units of positions";
        CalibrationValue = 3, "parameter 14, in units of positions; writing it calibrates the drive";
        DeltaJog = 4, "parameter 17: the width of inching operation 1, in units of positions";
    }
}

numbered! {
    /// What `G` reads and `H` writes: five digits. Number 06 is reserved.
    Short {
        ControllerP = 0, "parameter 1";
        ControllerI = 1, "parameter 2";
        ControllerD = 2, "parameter 3";
        APos = 3, "parameter 4: acceleration of positioning, in per cent";
        VPos = 4, "parameter 5: velocity of positioning, in rev/min";
        ARot = 5, "parameter 6: acceleration in velocity mode, in per cent";
        AJog = 7, "parameter 8: acceleration of inching, in per cent";
        VJog = 8, "parameter 9: velocity of inching, in rev/min";
        Window = 9, "parameter 10: the window around the target, in units of positions, or in rev/min in velocity mode";
        GearNumerator = 10, "parameter 11";
        GearDenominator = 11, "parameter 12";
        BitRate = 12, "parameter 23: the code of the CAN bit rate, 0 to 11";
        SpindlePitch = 13, "parameter 13, in 1/100 mm; 0 when positions are increments";
        BusAddress = 14, "parameter 22: the address on the bus";
    }
}

numbered! {
    /// Parameter 19, which `L` writes.
    PosType {
        Direct = 0, "travels straight to the target";
        LoopPositive = 1, "approaches every target in positive direction";
        LoopNegative = 2, "approaches every target in negative direction";
    }
}

numbered! {
    /// What `T` writes: parameter 18 or parameter 25. There is no 2.
    Turning {
        SenseI = 0, "parameter 18: counter-clockwise counts up";
        SenseE = 1, "parameter 18: counter-clockwise counts down";
        JogStopsFully = 3, "parameter 25: inching operation 2 stops with full deceleration";
        JogStopsByRamp = 4, "parameter 25: inching operation 2 stops with its own deceleration";
    }
}

numbered! {
    /// Parameter 20, which `X` writes. Objects and PROFIBUS have other numbers for it.
    Mode {
        Positioning = 0, "positioning mode";
        Velocity = 1, "velocity mode";
    }
}

numbered! {
    /// What `S` does.
    Setting {
        AllParameters = 11100, "all parameters get their defaults; bus address and CAN bit rate stay";
        StandardParameters = 11101, "the standard parameters get their defaults";
        ControllerParameters = 11102, "the controller parameters get their defaults";
        ResetFault = 11103, "resets a fault whose cause is gone";
        Calibrate = 11104, "makes the calibration value the position";
        ClearFaults = 11105, "empties the fault buffer";
    }
}

/// A command of table 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `A`: what the drive is.
    Identity(Identity),
    /// `E`: reads a number of seven digits.
    ReadLong(Long),
    /// `F`: writes one.
    WriteLong(Long, i32),
    /// `G`: reads a number of five digits.
    ReadShort(Short),
    /// `H`: writes one, up to 99999.
    WriteShort(Short, u32),
    /// `I`: ends a positioning; the motor stays in control.
    Abort,
    /// `J0`: how many faults are in the buffer.
    FaultCount,
    /// `J1`: the fault buffer.
    Faults,
    /// `K`: restarts the drive. It is not answered.
    Restart,
    /// `L`: chooses how targets are approached.
    SetPosType(PosType),
    /// `M`: starts a positioning, or velocity mode.
    Start,
    /// `N`: stops with full deceleration. With a lag error, the motor is released.
    EmergencyStop,
    /// `O`: stops with the programmed deceleration. With a lag error, the motor is released, and does not brake.
    Stop,
    /// `P`: releases the motor.
    Release,
    /// `Q`: the flag register.
    Flags,
    /// `R`: the system status word.
    Status,
    /// `S`: defaults, faults, calibration.
    Set(Setting),
    /// `T`: sense of rotation, or how inching operation 2 stops.
    SetTurning(Turning),
    /// `V`: the actual velocity.
    Velocity,
    /// `W`: the position as four binary bytes.
    BinaryPosition,
    /// `X`: chooses the operating mode.
    SetMode(Mode),
    /// `Y`: starts inching operation 1.
    Step,
    /// `Z`: the position.
    Position,
    /// `,` and `.`: inching operation 2 moves as long as it is repeated within 100 ms. It is not answered.
    Inch(Direction),
}

/// The commands that have no parameters, by their letters.
const PLAIN: [(u8, Command); 14] = [
    (b'I', Command::Abort),
    (b'K', Command::Restart),
    (b'M', Command::Start),
    (b'N', Command::EmergencyStop),
    (b'O', Command::Stop),
    (b'P', Command::Release),
    (b'Q', Command::Flags),
    (b'R', Command::Status),
    (b'V', Command::Velocity),
    (b'W', Command::BinaryPosition),
    (b'Y', Command::Step),
    (b'Z', Command::Position),
    (b',', Command::Inch(Direction::Positive)),
    (b'.', Command::Inch(Direction::Negative)),
];

impl Command {
    /// The largest absolute value of `E` and `F`.
    pub const LONG: i32 = 9_999_999;
    /// The largest value of `G` and `H`.
    pub const SHORT: u32 = 99_999;

    /// The bytes to send; `None` if a number has too many digits.
    #[must_use]
    pub fn encode(self) -> Option<Telegram> {
        let letter = |letter: u8| Telegram::default().push(&[letter]);
        Some(match self {
            Command::Identity(which) => letter(b'A').digits(which.number().into(), 1),
            Command::ReadLong(which) => letter(b'E').digits(which.number().into(), 1),
            Command::WriteLong(_, number) if number.unsigned_abs() > Self::LONG.unsigned_abs() => return None,
            Command::WriteLong(which, number) => letter(b'F').digits(which.number().into(), 1).signed(number, 7),
            Command::ReadShort(which) => letter(b'G').digits(which.number().into(), 2),
            Command::WriteShort(_, number) if number > Self::SHORT => return None,
            Command::WriteShort(which, number) => letter(b'H').digits(which.number().into(), 2).digits(number, 5),
            Command::FaultCount => letter(b'J').digits(0, 1),
            Command::Faults => letter(b'J').digits(1, 1),
            Command::SetPosType(which) => letter(b'L').digits(which.number().into(), 1),
            Command::Set(which) => letter(b'S').digits(which.number().into(), 5),
            Command::SetTurning(which) => letter(b'T').digits(which.number().into(), 1),
            Command::SetMode(which) => letter(b'X').digits(which.number().into(), 1),
            _ => letter(PLAIN.iter().find(|(_, command)| *command == self)?.0),
        })
    }

    /// Parses a command; lower-case letters count as capitals.
    ///
    /// Errors: the drive's refusal, which is 01 if there is no such command or parameter, and else 02. The manual only
    /// says that there is an error.
    pub fn parse(bytes: &[u8]) -> Result<Self, ErrorNumber> {
        let (&letter, rest) = bytes.split_first().ok_or(ErrorNumber::PARAMETER_NUMBER)?;
        let letter = letter.to_ascii_uppercase();
        let len = length(letter).ok_or(ErrorNumber::PARAMETER_NUMBER)?;
        if bytes.len() != len {
            return Err(ErrorNumber::VALUE_RANGE);
        }
        match letter {
            b'A' => one_of(rest, Identity::from_number).map(Command::Identity),
            b'E' => one_of(rest, Long::from_number).map(Command::ReadLong),
            b'F' => {
                let (address, number) = rest.split_at_checked(1).ok_or(ErrorNumber::VALUE_RANGE)?;
                let which = one_of(address, Long::from_number)?;
                telegram::signed(number).map(|number| Command::WriteLong(which, number)).ok_or(ErrorNumber::VALUE_RANGE)
            }
            b'G' => one_of(rest, Short::from_number).map(Command::ReadShort),
            b'H' => {
                let (address, number) = rest.split_at_checked(2).ok_or(ErrorNumber::VALUE_RANGE)?;
                let which = one_of(address, Short::from_number)?;
                telegram::decimal(number)
                    .map(|number| Command::WriteShort(which, number))
                    .ok_or(ErrorNumber::VALUE_RANGE)
            }
            b'J' if rest == b"0" => Ok(Command::FaultCount),
            b'J' if rest == b"1" => Ok(Command::Faults),
            b'L' => value_of(rest, PosType::from_number).map(Command::SetPosType),
            b'S' => value_of(rest, Setting::from_number).map(Command::Set),
            b'T' => value_of(rest, Turning::from_number).map(Command::SetTurning),
            b'X' => value_of(rest, Mode::from_number).map(Command::SetMode),
            _ => plain(letter).ok_or(ErrorNumber::PARAMETER_NUMBER),
        }
    }

    /// The form of the answer if the drive carries the command out.
    #[must_use]
    pub const fn reply(self) -> Reply {
        match self {
            Command::Identity(_) => Reply::Text,
            Command::ReadLong(_) | Command::Position => Reply::Long,
            Command::ReadShort(_) => Reply::Short,
            Command::FaultCount => Reply::Count,
            Command::Faults => Reply::Letters,
            Command::Flags => Reply::Flags,
            Command::Status => Reply::Status,
            Command::Velocity => Reply::Velocity,
            Command::BinaryPosition => Reply::Binary,
            Command::Restart | Command::Inch(_) => Reply::None,
            _ => Reply::Done,
        }
    }

    /// Whether the command only reads, so that the drive takes it even while the bus has control authority.
    #[must_use]
    pub const fn is_read(self) -> bool {
        !matches!(self.reply(), Reply::None | Reply::Done)
    }

    /// Whether repeating the command makes no difference, as for those that read, set or stop. It does for those that
    /// start something, and for calibrating, since the shaft may turn in between.
    #[must_use]
    pub const fn may_be_repeated(self) -> bool {
        !matches!(
            self,
            Command::Start | Command::Step | Command::Inch(_) | Command::Restart | Command::Set(Setting::Calibrate)
        )
    }
}

/// The length of a command with this letter, in bytes (table 3, column "Länge").
fn length(letter: u8) -> Option<usize> {
    match letter {
        b'A' | b'E' | b'J' | b'L' | b'T' | b'X' => Some(2),
        b'G' => Some(3),
        b'S' => Some(6),
        b'H' => Some(8),
        b'F' => Some(10),
        _ => plain(letter).map(|_| 1),
    }
}

fn plain(letter: u8) -> Option<Command> {
    PLAIN.iter().find(|(known, _)| *known == letter).map(|(_, command)| *command)
}

fn one_of<T>(digits: &[u8], from: fn(u32) -> Option<T>) -> Result<T, ErrorNumber> {
    telegram::decimal(digits).and_then(from).ok_or(ErrorNumber::PARAMETER_NUMBER)
}

fn value_of<T>(digits: &[u8], from: fn(u32) -> Option<T>) -> Result<T, ErrorNumber> {
    telegram::decimal(digits).and_then(from).ok_or(ErrorNumber::VALUE_RANGE)
}

/// The drive's side of a line: makes commands of bytes.
///
/// A command has no end mark; its letter determines its length. The manual does not say what happens if the rest is
/// missing or wrong. Here the decoder waits without a limit, and the first impossible byte ends the command with an
/// error; the next byte begins another command. Between commands, line ends and spaces are skipped.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    begun: Telegram,
}

impl Decoder {
    /// Takes a byte; returns the command that it completes, or the error that answers it.
    pub fn take(&mut self, byte: u8) -> Option<Result<Command, ErrorNumber>> {
        let at = self.begun.as_bytes().len();
        if at == 0 && matches!(byte, b'\r' | b'\n' | b' ') {
            return None;
        }
        self.begun = self.begun.push(&[byte]);
        let bytes = self.begun.as_bytes();
        let letter = bytes.first()?.to_ascii_uppercase();
        let is_sign = letter == b'F' && at == 2;
        let fits = match byte {
            _ if at == 0 => true,
            b'+' | b'-' => is_sign,
            _ => byte.is_ascii_digit() && !is_sign,
        };
        let complete = length(letter).is_none_or(|len| bytes.len() >= len);
        if fits && !complete {
            return None;
        }
        let command = if fits { Command::parse(bytes) } else { Err(ErrorNumber::VALUE_RANGE) };
        self.begun.clear();
        Some(command)
    }

    /// Drops an incomplete command.
    pub fn reset(&mut self) {
        self.begun.clear();
    }
}
