//! Table 4: why the drive refuses a command.

use core::fmt;

use lexican_driver::Direction;
use siko::order::Refused;

/// The number of a refusal: two decimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorNumber(u8);

macro_rules! errors {
    ($($name:ident = $number:literal, $text:literal;)*) => {
        impl ErrorNumber {
            $(#[doc = concat!(stringify!($number), ": ", $text, ".")] pub const $name: ErrorNumber = ErrorNumber($number);)*

            /// All errors of table 4.
            pub const ALL: &[ErrorNumber] = &[$(ErrorNumber::$name),*];

            /// The text of table 4; `None` for a number that it does not have.
            #[must_use]
            pub const fn text(self) -> Option<&'static str> {
                match self.0 {
                    $($number => Some($text),)*
                    _ => None,
                }
            }
        }
    };
}

errors! {
    PARAMETER_NUMBER = 1, "there is no such parameter or command";
    VALUE_RANGE = 2, "the value is out of range";
    NO_AUTHORITY = 3, "the bus has control authority";
    OPERATING_STATE = 4, "not possible in this operating state";
    LIMIT_SWITCH_1 = 5, "limit switch 1 is active: only inching towards limit switch 2 is possible";
    LIMIT_SWITCH_2 = 6, "limit switch 2 is active: only inching towards limit switch 1 is possible";
    UPPER_LIMIT = 7, "above the upper limit: only inching in negative direction is possible";
    LOWER_LIMIT = 8, "below the lower limit: only inching in positive direction is possible";
    SETPOINT_BEYOND_LIMIT = 9, "the setpoint is beyond a limit";
    FAULT = 10, "the drive is in a fault, to be reset by S11103 when its cause is gone";
    NOT_ENABLED = 11, "the enable input is not active";
}

impl ErrorNumber {
    /// A refusal; `None` if the number has more than two digits.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if number < 100 { Some(ErrorNumber(number)) } else { None }
    }

    /// The number.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl fmt::Display for ErrorNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error {:02}: {}", self.0, self.text().unwrap_or("not in table 4 of the manual"))
    }
}

/// Why the simulated drive refuses an order.
impl From<Refused> for ErrorNumber {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Fault => ErrorNumber::FAULT,
            Refused::NoPower => ErrorNumber::NOT_ENABLED,
            Refused::NotEnabled | Refused::Busy | Refused::Mode => ErrorNumber::OPERATING_STATE,
            Refused::Switch(Direction::Positive) => ErrorNumber::LIMIT_SWITCH_1,
            Refused::Switch(Direction::Negative) => ErrorNumber::LIMIT_SWITCH_2,
            Refused::Limit(Direction::Positive) => ErrorNumber::UPPER_LIMIT,
            Refused::Limit(Direction::Negative) => ErrorNumber::LOWER_LIMIT,
            Refused::Target => ErrorNumber::SETPOINT_BEYOND_LIMIT,
        }
    }
}
