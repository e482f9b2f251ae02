//! Inputs and outputs by CiA 401: polarity, interrupts of analogue inputs, error values.

use lexican_runtime::object::{Array, Value};
use lexican_runtime::{Duration, Instant};

use crate::board::{Board, Channels};
use crate::od;

/// The last states of inputs and outputs.
#[derive(Default)]
pub(crate) struct Process {
    /// The last analogue values that were reported.
    reported: [i16; 8],
    driven: Option<Channels>,
    /// The level of the test signal, and the time of its next edge.
    signal: bool,
    next_edge: Option<Instant>,
}

impl Process {
    /// Reads the inputs, and reports changes.
    pub(crate) fn sample(
        &mut self,
        now: Instant,
        board: &mut impl Board,
        od: &mut od::Storage,
        mut device: Option<&mut od::Services>,
    ) {
        let mut inputs = board.inputs();
        if self.test_signal(now, od)
            && let Some(port) = inputs.digital.last_mut()
        {
            *port ^= 0x80;
        }
        let polarity: [u8; 2] = all(od, od::POLARITY_INPUT_8_BIT);
        let levels = [0, 1].map(|port: usize| inputs.digital[port] ^ polarity[port]);
        for (object, level) in od::READ_INPUT_8_BIT.iter().zip(levels) {
            od.set(object, level);
        }
        let reports = od.get(od::ANALOGUE_INPUT_GLOBAL_INTERRUPT_ENABLE);
        let deltas: [u32; 8] = all(od, od::ANALOGUE_INPUT_INTERRUPT_DELTA_UNSIGNED);
        let objects = od::READ_ANALOGUE_INPUT_16_BIT.iter().zip(inputs.analogue);
        for ((object, value), (reported, delta)) in objects.zip(self.reported.iter_mut().zip(deltas)) {
            od.set_quietly(object, value);
            let change = u32::from(reported.abs_diff(value));
            if reports && change > 0 && change >= delta {
                *reported = value;
                device.iter_mut().for_each(|device| device.changed(object.address()));
            }
        }
    }

    /// The level of the test signal (2003h): a square wave, for tests that need a changing input.
    fn test_signal(&mut self, now: Instant, od: &od::Storage) -> bool {
        let period = Duration::from_millis(od.get(od::PERIOD_OF_THE_TEST_SIGNAL).into());
        if period.is_zero() {
            // Keep the level, so that switching the signal off does not change the input.
            self.next_edge = None;
        } else if self.next_edge.is_none_or(|edge| edge <= now) {
            self.signal = !self.signal;
            self.next_edge = Some(now + period);
        }
        self.signal
    }

    /// Sets the outputs to the values in the dictionary, if those have changed.
    pub(crate) fn drive(&mut self, board: &mut impl Board, od: &od::Storage) {
        let polarity: [u8; 2] = all(od, od::CHANGE_POLARITY_OUTPUT_8_BIT);
        let digital: [u8; 2] = all(od, od::WRITE_OUTPUT_8_BIT);
        let outputs = Channels {
            digital: [0, 1].map(|port: usize| digital[port] ^ polarity[port]),
            analogue: all(od, od::WRITE_ANALOGUE_OUTPUT_16_BIT),
        };
        if self.driven != Some(outputs) {
            self.driven = Some(outputs);
            board.set_outputs(&outputs);
        }
    }
}

/// When the manager is lost or stops the device, outputs take their error values, if their error mode says so.
pub(crate) fn take_error_values(od: &mut od::Storage) {
    let (modes, values) = (od::ERROR_MODE_OUTPUT_8_BIT, od::ERROR_VALUE_OUTPUT_8_BIT);
    for (output, (mode, value)) in od::WRITE_OUTPUT_8_BIT.iter().zip(modes.iter().zip(values.iter())) {
        let mode = od.get(mode);
        od.set(output, od.get(output) & !mode | od.get(value) & mode);
    }
    let (modes, values) = (od::ANALOGUE_OUTPUT_ERROR_MODE, od::ANALOGUE_OUTPUT_ERROR_VALUE_INTEGER);
    for (output, (mode, value)) in od::WRITE_ANALOGUE_OUTPUT_16_BIT.iter().zip(modes.iter().zip(values.iter())) {
        if od.get(mode) != 0 {
            // The value is left-aligned in 32 bits (CiA 401); the output takes the upper 16.
            od.set(output, (od.get(value) >> 16) as i16);
        }
    }
}

/// All elements of an array.
fn all<T: Value + Copy + Default, A, M, L, D, const N: usize>(od: &od::Storage, array: Array<T, A, M, L, D>) -> [T; N] {
    let mut values = [T::default(); N];
    values.iter_mut().zip(array.iter()).for_each(|(value, object)| *value = od.get(object));
    values
}
