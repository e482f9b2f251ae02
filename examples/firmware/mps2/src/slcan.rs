//! A CAN controller at a serial port: the Lawicel protocol of serial adapters.

use lexican_runtime::{CobId, Frame};

use crate::hardware::Uart;

/// The longest line: an extended frame with eight bytes.
const LONGEST: usize = 26;

/// The adapter and its bus.
pub struct Slcan {
    uart: Uart,
    line: [u8; LONGEST],
    /// Greater than the buffer if the line is too long to be a frame.
    len: usize,
}

impl Slcan {
    pub fn new(uart: Uart) -> Self {
        Slcan { uart, line: [0; LONGEST], len: 0 }
    }

    /// The next frame, once its line is complete.
    pub fn receive(&mut self) -> Option<Frame> {
        while let Some(byte) = self.uart.receive() {
            if byte != b'\r' {
                if let Some(place) = self.line.get_mut(self.len) {
                    *place = byte;
                }
                self.len = self.len.saturating_add(1);
                continue;
            }
            let line = self.line.get(..core::mem::take(&mut self.len)).unwrap_or(&[]);
            match line.first() {
                Some(b't' | b'T' | b'r' | b'R') => {
                    let frame = frame(line);
                    if frame.is_some() {
                        return frame;
                    }
                }
                // Open, close, bit rate: there is one bus, and it is always on.
                _ => self.uart.send(b'\r'),
            }
        }
        None
    }

    pub fn send(&mut self, frame: &Frame) {
        let id = frame.id();
        let (letter, digits) = match (frame.is_remote(), id.is_extended()) {
            (false, false) => (b't', 3),
            (false, true) => (b'T', 8),
            (true, false) => (b'r', 3),
            (true, true) => (b'R', 8),
        };
        self.uart.send(letter);
        self.hexadecimal(id.raw(), digits);
        self.hexadecimal(frame.dlc().into(), 1);
        for byte in frame.data() {
            self.hexadecimal(u32::from(*byte), 2);
        }
        self.uart.send(b'\r');
    }

    fn hexadecimal(&mut self, number: u32, digits: u32) {
        for digit in (0..digits).rev() {
            let digit = char::from_digit(number >> (4 * digit) & 0xF, 16).unwrap_or('0');
            self.uart.send(digit.to_ascii_uppercase() as u8);
        }
    }
}

/// The frame of a line such as `t12320A0B`.
fn frame(line: &[u8]) -> Option<Frame> {
    let (letter, rest) = line.split_first()?;
    let (id, rest) = rest.split_at_checked(if letter.is_ascii_uppercase() { 8 } else { 3 })?;
    let id = match id.len() {
        3 => CobId::standard(number(id)? as u16)?,
        _ => CobId::extended(number(id)?)?,
    };
    let (len, data) = rest.split_first()?;
    let len = len.checked_sub(b'0').filter(|len| *len <= 8)?;
    if letter.eq_ignore_ascii_case(&b'r') {
        return Frame::remote(id, len);
    }
    let mut bytes = [0; 8];
    let bytes = bytes.get_mut(..data.len() / 2)?;
    for (byte, digits) in bytes.iter_mut().zip(data.chunks(2)) {
        *byte = number(digits)? as u8;
    }
    (bytes.len() == usize::from(len)).then(|| Frame::new(id, bytes))?
}

/// Parses hexadecimal digits.
fn number(digits: &[u8]) -> Option<u32> {
    digits.iter().try_fold(0, |number, digit| Some(number << 4 | char::from(*digit).to_digit(16)?))
}
