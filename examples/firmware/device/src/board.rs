//! What differs from board to board.

/// The voltages and levels of a device, in or out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Channels {
    /// A bit per channel, eight to a port.
    pub digital: [u8; 2],
    /// The full range of 16 bits.
    pub analogue: [i16; 8],
}

/// What a board brings.
pub trait Board {
    /// What is at the inputs.
    fn inputs(&mut self) -> Channels;

    /// Sets the outputs.
    fn set_outputs(&mut self, outputs: &Channels);

    /// How many bytes of the stack have never been used, for 2001h.
    fn unused_stack(&mut self) -> u32;
}
