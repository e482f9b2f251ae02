//! The two diagnosis LEDs (7.14), as functions of the drive's state and the time.
//!
//! The manual gives 2.5 Hz and a duty cycle of 1:5 for the bus LED, which are "blinking" and "single flash" of CiA
//! 303-3: 200 ms on and 200 ms off, and 200 ms on and 1000 ms off. For the blink codes of table 2 it only gives the
//! number of blinks; they are assumed to be the flashes of CiA 303-3: each 200 ms on, with 200 ms between them and a
//! pause of 1000 ms.

use lexican_runtime::Duration;
use lexican_runtime::wire::nmt::NmtState;

/// The green status LED.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StatusLed {
    /// A supply is missing.
    Off,
    /// Both supplies are present.
    On,
    /// There is a fault, shown by the number of blinks (table 2).
    Blinks(u8),
    /// Factory settings have been restored by DIP switches: lit when the bus LED is not (2.4).
    Alternates,
}

/// The orange bus LED.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusLed {
    /// No supply.
    Off,
    /// OPERATIONAL.
    On,
    /// PRE-OPERATIONAL: 2.5 Hz.
    Blinks,
    /// STOPPED: on for one sixth of the time.
    Flashes,
    /// Factory settings have been restored by DIP switches: lit when the status LED is not (2.4).
    Alternates,
}

/// Which LEDs are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lights {
    /// The green status LED.
    pub status: bool,
    /// The orange bus LED.
    pub bus: bool,
}

/// A flash, and the gap between two flashes (CiA 303-3).
pub const FLASH: Duration = Duration::from_millis(200);
/// The pause after the last flash (CiA 303-3).
pub const PAUSE: Duration = Duration::from_millis(1000);

impl StatusLed {
    /// Whether it is lit after it has shown this for `shown_for`.
    #[must_use]
    pub const fn is_lit(self, shown_for: Duration) -> bool {
        match self {
            StatusLed::Off => false,
            StatusLed::On => true,
            StatusLed::Blinks(count) => flashes(count, shown_for),
            StatusLed::Alternates => blinks(shown_for),
        }
    }
}

impl BusLed {
    /// The signal for an NMT state.
    #[must_use]
    pub const fn of(state: NmtState) -> Self {
        match state {
            NmtState::Operational => BusLed::On,
            NmtState::PreOperational => BusLed::Blinks,
            NmtState::Stopped => BusLed::Flashes,
            NmtState::Initialising => BusLed::Off,
        }
    }

    /// Whether it is lit after it has shown this for `shown_for`.
    #[must_use]
    pub const fn is_lit(self, shown_for: Duration) -> bool {
        match self {
            BusLed::Off => false,
            BusLed::On => true,
            BusLed::Blinks => blinks(shown_for),
            BusLed::Flashes => flashes(1, shown_for),
            BusLed::Alternates => !blinks(shown_for),
        }
    }
}

/// Blinks: on and off, equally long.
const fn blinks(shown_for: Duration) -> bool {
    (shown_for.as_micros() / FLASH.as_micros()).is_multiple_of(2)
}

/// Flashes: each one after a gap, then the rest of the pause. It begins dark, to set the first flash off from what was
/// lit before.
const fn flashes(count: u8, shown_for: Duration) -> bool {
    let code = 2 * count as u64 * FLASH.as_micros();
    let at = shown_for.as_micros() % (code + PAUSE.as_micros() - FLASH.as_micros());
    at < code && !(at / FLASH.as_micros()).is_multiple_of(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is lit in each 100 ms: `#` or `.`.
    #[track_caller]
    fn check(is_lit: impl Fn(Duration) -> bool, expected: &str) {
        let seen = (0..expected.len() as u64).map(|at| is_lit(Duration::from_millis(at * 100)));
        let seen: String = seen.map(|lit| if lit { '#' } else { '.' }).collect();
        assert_eq!(seen, expected);
    }

    #[test]
    fn the_bus_led_tells_the_state() {
        let of = |state| move |at| BusLed::of(state).is_lit(at);
        check(of(NmtState::PreOperational), "##..##..##..##..");
        check(of(NmtState::Operational), "################");
        check(of(NmtState::Stopped), "..##..........##..........##");
        check(of(NmtState::Initialising), "........");
    }

    #[test]
    fn the_status_led_counts_a_fault() {
        check(|at| StatusLed::Blinks(1).is_lit(at), "..##..........##........");
        check(|at| StatusLed::Blinks(3).is_lit(at), "..##..##..##..........##..##..##........");
        check(|at| StatusLed::Blinks(0).is_lit(at), "............");
        check(|at| StatusLed::On.is_lit(at), "####");
        check(|at| StatusLed::Off.is_lit(at), "....");
    }

    #[test]
    fn two_that_alternate_are_never_lit_together() {
        check(|at| StatusLed::Alternates.is_lit(at), "##..##..");
        check(|at| BusLed::Alternates.is_lit(at), "..##..##");
    }
}
