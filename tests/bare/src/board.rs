//! A board as C sees it. `tests/size` has the same.

use lexican_runtime::{CobId, Frame};

/// The functions of the board: a clock, a CAN controller, and the supply.
#[repr(C)]
pub struct Board {
    /// Microseconds since power-on.
    pub now_us: extern "C" fn() -> u64,
    /// Takes a frame from the controller; false if there is none.
    pub receive: extern "C" fn(&mut CanFrame) -> bool,
    /// Hands the controller a frame, which it copies.
    pub send: extern "C" fn(&CanFrame),
    /// False ends the main loop.
    pub is_powered: extern "C" fn() -> bool,
}

/// A frame of the controller, in base format: the drive uses no other.
#[repr(C)]
pub struct CanFrame {
    /// The identifier, 0 to 7FFh.
    pub id: u16,
    /// A remote frame has a length and no data.
    pub is_remote: bool,
    /// 0 to 8.
    pub len: u8,
    /// Only the first `len` bytes are valid.
    pub data: [u8; 8],
}

impl CanFrame {
    pub(crate) fn to_frame(&self) -> Option<Frame> {
        let id = CobId::standard(self.id)?;
        match self.is_remote {
            true => Frame::remote(id, self.len),
            false => Frame::new(id, self.data.get(..usize::from(self.len))?),
        }
    }

    pub(crate) fn from_frame(frame: &Frame) -> Self {
        let mut data = [0; 8];
        data.iter_mut().zip(frame.data()).for_each(|(to, from)| *to = *from);
        CanFrame { id: frame.id().raw() as u16, is_remote: frame.is_remote(), len: frame.dlc(), data }
    }
}
