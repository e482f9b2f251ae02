//! The words of PROFIDRIVE version 2 (PNO 3.071): control word, status word, and the telegrams (PPO) they lie in.
//!
//! Names are those of the profile; the crate of a drive says what its bits mean, and which ones it lacks. Words and
//! values are big-endian.

use crate::dp::Lengths;
use crate::pkw::Pkw;

/// Bits of the control word (STW). Bits 4 to 6 and 8 to 15 depend on the operating mode.
#[allow(missing_docs, reason = "the names say what it is")]
pub mod control {
    /// ON; cleared is OFF 1.
    pub const ON: u16 = 1 << 0;
    /// Cleared is OFF 2: no torque at once.
    pub const NO_OFF_2: u16 = 1 << 1;
    /// Cleared is OFF 3: quick stop.
    pub const NO_OFF_3: u16 = 1 << 2;
    pub const ENABLE_OPERATION: u16 = 1 << 3;
    /// Positioning: cleared stops and drops the travel order.
    pub const NO_STOP: u16 = 1 << 4;
    /// Velocity: enables the ramp generator.
    pub const ENABLE_RAMP: u16 = 1 << 4;
    /// Positioning: cleared is an intermediate stop.
    pub const NO_INTERMEDIATE_STOP: u16 = 1 << 5;
    /// Velocity: cleared freezes the ramp generator.
    pub const UNFREEZE_RAMP: u16 = 1 << 5;
    /// Positioning: each edge starts a travel.
    pub const START: u16 = 1 << 6;
    /// Velocity: enables the setpoint.
    pub const ENABLE_SETPOINT: u16 = 1 << 6;
    /// Acknowledges a fault.
    pub const ACKNOWLEDGE: u16 = 1 << 7;
    pub const INCHING_1: u16 = 1 << 8;
    pub const INCHING_2: u16 = 1 << 9;
}

/// Bits of the status word (ZSW). Bits 8, 10 and 12 to 15 depend on the operating mode.
#[allow(missing_docs, reason = "the names say what it is")]
pub mod status {
    pub const READY_TO_SWITCH_ON: u16 = 1 << 0;
    /// Ready for operation.
    pub const READY: u16 = 1 << 1;
    pub const OPERATION_ENABLED: u16 = 1 << 2;
    /// A fault is present.
    pub const FAULT: u16 = 1 << 3;
    pub const NO_OFF_2: u16 = 1 << 4;
    pub const NO_OFF_3: u16 = 1 << 5;
    /// Switching on is inhibited until OFF 1 has been given.
    pub const SWITCH_ON_INHIBITED: u16 = 1 << 6;
    /// A warning is present.
    pub const WARNING: u16 = 1 << 7;
    /// Positioning: no lag error.
    pub const NO_LAG: u16 = 1 << 8;
    /// Velocity: the velocity is within its window.
    pub const VELOCITY_IN_WINDOW: u16 = 1 << 8;
    /// Control by the master is requested.
    pub const CONTROL_REQUESTED: u16 = 1 << 9;
    /// Positioning: the target is reached.
    pub const TARGET_REACHED: u16 = 1 << 10;
    /// Positioning: the reference is set.
    pub const REFERENCED: u16 = 1 << 11;
    /// Positioning: each edge acknowledges a travel order.
    pub const ORDER_ACKNOWLEDGED: u16 = 1 << 12;
    /// The drive stands still.
    pub const STANDSTILL: u16 = 1 << 13;
}

/// A telegram type: whether parameters (PKW, four words) come first, and how many words of process data (PZD) follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ppo {
    /// Whether the first four words are a PKW.
    pub parameters: bool,
    /// Words of process data.
    pub process_words: u8,
}

impl Ppo {
    /// The five types of the profile.
    pub const TYPES: [Ppo; 5] = [ppo(true, 2), ppo(true, 6), ppo(false, 2), ppo(false, 6), ppo(true, 10)];

    /// The length in each direction, in bytes.
    #[must_use]
    pub const fn len(self) -> usize {
        (if self.parameters { Pkw::LEN } else { 0 }) + 2 * self.process_words as usize
    }

    /// Whether there is nothing in it.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The length in both directions.
    #[must_use]
    pub const fn lengths(self) -> Lengths {
        Lengths { inputs: self.len(), outputs: self.len() }
    }

    /// The PKW, if the type has one.
    #[must_use]
    pub fn pkw(self, data: &[u8]) -> Option<Pkw> {
        if self.parameters { Pkw::parse(data) } else { None }
    }

    /// A word of the process data, counted from 0 (PZD1).
    #[must_use]
    pub fn word(self, data: &[u8], number: usize) -> Option<u16> {
        Some(u16::from_be_bytes(*self.process(data)?.get(2 * number..)?.first_chunk()?))
    }

    /// Two words of the process data as one number.
    #[must_use]
    pub fn double_word(self, data: &[u8], number: usize) -> Option<i32> {
        Some(i32::from_be_bytes(*self.process(data)?.get(2 * number..)?.first_chunk()?))
    }

    /// Sets the PKW, if the type has one.
    pub fn set_pkw(self, data: &mut [u8], pkw: Pkw) {
        if let Some(place) = data.first_chunk_mut().filter(|_| self.parameters) {
            *place = pkw.bytes();
        }
    }

    /// Sets a word of the process data; does nothing if it does not exist.
    pub fn set_word(self, data: &mut [u8], number: usize, word: u16) {
        if let Some(place) = self.process_mut(data, 2 * number).and_then(<[u8]>::first_chunk_mut) {
            *place = word.to_be_bytes();
        }
    }

    /// Sets two words of the process data; does nothing if they do not exist.
    pub fn set_double_word(self, data: &mut [u8], number: usize, value: i32) {
        if let Some(place) = self.process_mut(data, 2 * number).and_then(<[u8]>::first_chunk_mut) {
            *place = value.to_be_bytes();
        }
    }

    fn process(self, data: &[u8]) -> Option<&[u8]> {
        data.get(self.begin()..self.len())
    }

    fn process_mut(self, data: &mut [u8], offset: usize) -> Option<&mut [u8]> {
        data.get_mut(self.begin() + offset..self.len())
    }

    const fn begin(self) -> usize {
        if self.parameters { Pkw::LEN } else { 0 }
    }
}

const fn ppo(parameters: bool, process_words: u8) -> Ppo {
    Ppo { parameters, process_words }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_types_have_the_lengths_of_the_profile() {
        assert_eq!(Ppo::TYPES.map(Ppo::len), [12, 20, 4, 12, 28]);
        assert_eq!(Ppo::TYPES.map(Ppo::is_empty), [false; 5]);
        assert!(Ppo { parameters: false, process_words: 0 }.is_empty());
    }

    #[test]
    fn words_lie_behind_the_parameters() {
        let ppo = Ppo { parameters: true, process_words: 3 };
        let mut data = [0; 14];
        ppo.set_word(&mut data, 0, 0x003B);
        ppo.set_double_word(&mut data, 1, -2);
        ppo.set_word(&mut data, 3, 0xAAAA);
        assert_eq!(data, [0, 0, 0, 0, 0, 0, 0, 0, 0x00, 0x3B, 0xFF, 0xFF, 0xFF, 0xFE]);
        assert_eq!((ppo.word(&data, 0), ppo.double_word(&data, 1)), (Some(0x3B), Some(-2)));
        ppo.set_word(&mut data, 2, 0x1234);
        assert_eq!((ppo.word(&data, 1), ppo.word(&data, 2)), (Some(0xFFFF), Some(0x1234)));
        assert_eq!((ppo.word(&data, 3), ppo.double_word(&data, 2), ppo.word(&data[..13], 0)), (None, None, None));
    }

    #[test]
    fn without_parameters_the_words_come_first() {
        let ppo = Ppo { parameters: false, process_words: 6 };
        let mut data = [0; 12];
        ppo.set_pkw(&mut data, Pkw { identifier: 1, number: 1018, index: 0, value: 0 });
        ppo.set_double_word(&mut data, 4, 0x0102_0304);
        assert_eq!(data, [0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4]);
        assert_eq!((ppo.pkw(&data), ppo.double_word(&data, 4)), (None, Some(0x0102_0304)));
    }
}
