//! The interface to the board.

/// The states of inputs or outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Channels {
    /// One bit per channel, eight channels per port.
    pub digital: [u8; 2],
    /// The full range of 16 bits.
    pub analogue: [i16; 8],
}

/// What the device needs of a board.
pub trait Board {
    /// Reads the inputs.
    fn inputs(&mut self) -> Channels;

    /// Sets the outputs.
    fn set_outputs(&mut self, outputs: &Channels);

    /// The number of stack bytes never used, for 2001h.
    fn unused_stack(&mut self) -> u32;
}
