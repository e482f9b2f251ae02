//! SocketCAN: the CAN interfaces of a Linux kernel.
//!
//! One raw socket per link, bound to one interface. The kernel tells the controller's state in error
//! frames, and that the interface went down or away in the error of a read. While there is no bus the
//! link looks for it ten times a second, so nothing spins and nothing has to be restarted.

mod error;
mod presence;

use std::borrow::ToOwned;
use std::collections::BTreeSet;
use std::io;
use std::io::IoSliceMut;
use std::os::fd::{AsFd, AsRawFd};
use std::string::String;
use std::sync::Arc;
use std::vec::Vec;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::socket::sockopt::{RcvBuf, RcvBufForce, RxqOvfl};
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg, setsockopt};
use socketcan::errors::{CAN_ERR_BUSOFF, CAN_ERR_CRTL, CAN_ERR_RESTARTED};
use socketcan::{CanFilter, CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, Socket, SocketOptions, StandardId};

pub use self::error::SocketCanError;
use self::error::errno;
use self::presence::{Presence, interfaces};
use super::clock::{Clock, pause};
use super::link::{Descriptor, PATIENCE};
use super::{BusState, Incoming, Link, LinkError};
use crate::{CobId, Duration, Frame, Instant};

/// How often a link without a bus looks whether it is back.
const LOOK: Duration = Duration::from_millis(100);

/// The receive buffer that is asked for, in bytes; without CAP_NET_ADMIN the kernel grants up to
/// `net.core.rmem_max`. Its default holds some 270 frames: at 1 Mbit/s, 30 ms of a full bus. This one holds 10,000.
const RECEIVE_BUFFER: usize = 4 << 20;

/// How many filters a socket takes: `CAN_RAW_FILTER_MAX` of Linux's `can/raw.h`.
const MOST_FILTERS: usize = 512;

/// A [`Link`] to a CAN interface of this machine.
#[derive(Debug)]
pub struct SocketCan {
    interface: String,
    socket: Arc<CanSocket>,
    /// What the kernel passes on; empty for everything.
    filters: Vec<CanFilter>,
    clock: Clock,
    state: BusState,
    /// The state that [`Link::receive`] last told.
    told: BusState,
    /// How many frames the kernel has dropped since the socket was opened.
    dropped: u32,
    /// A frame that came behind a gap.
    behind: Option<Frame>,
}

impl SocketCan {
    /// Opens an interface that exists and is up, such as `can0`.
    ///
    /// # Errors
    ///
    /// [`SocketCanError`], which says what to do.
    pub fn open(interface: &str) -> Result<Self, SocketCanError> {
        SocketCan::is_supported()?;
        match Presence::of(interface) {
            Presence::Absent => Err(SocketCanError::Missing { interface: interface.to_owned(), present: interfaces() }),
            Presence::NotCan => Err(SocketCanError::NotCan { interface: interface.to_owned(), present: interfaces() }),
            Presence::Down => Err(SocketCanError::Down { interface: interface.to_owned() }),
            Presence::Up | Presence::NoCarrier => {
                let socket = connect(interface).map_err(|error| SocketCanError::refusal(interface, error))?;
                Ok(SocketCan {
                    interface: interface.to_owned(),
                    socket: Arc::new(socket),
                    filters: Vec::new(),
                    clock: Clock::new(),
                    state: BusState::Active,
                    told: BusState::Active,
                    dropped: 0,
                    behind: None,
                })
            }
        }
    }

    /// Whether this kernel has CAN at all.
    ///
    /// # Errors
    ///
    /// [`SocketCanError::NoCan`] when it has none.
    pub fn is_supported() -> Result<(), SocketCanError> {
        // Interface 0 stands for all of them, so this needs none.
        CanSocket::open_iface(0).map(drop).map_err(|error| SocketCanError::refusal("any interface", error))
    }

    /// The interface's name.
    #[must_use]
    pub fn interface(&self) -> &str {
        &self.interface
    }

    /// Waits for the socket to become readable; a signal or an error ends the wait, too.
    fn wait(&self, span: Duration) -> Result<bool, LinkError> {
        let mut sockets = [PollFd::new(self.socket.as_fd(), PollFlags::POLLIN)];
        match ppoll(&mut sockets, Some(core::time::Duration::from(span).into()), None) {
            Ok(ready) => Ok(ready > 0),
            Err(Errno::EINTR) => Ok(false),
            Err(error) => Err(LinkError::Io(error.into())),
        }
    }

    /// Waits for a frame no longer than `span`, if it must wait at all.
    fn read(&mut self, span: Duration) -> Result<Option<Received>, LinkError> {
        if !span.is_zero() && !self.wait(span)? {
            return Ok(None);
        }
        match receive(&self.socket) {
            Ok(received) => Ok(Some(received)),
            Err(error) => self.learn_from(error.into()).map(|()| None),
        }
    }

    /// What a failed read or write says about the bus; an error that says nothing about it ends the link.
    fn learn_from(&mut self, error: io::Error) -> Result<(), LinkError> {
        match errno(&error) {
            Errno::EAGAIN | Errno::EINTR => {}
            Errno::ENETDOWN => self.state = BusState::Down,
            Errno::ENODEV | Errno::ENXIO => self.state = BusState::Removed,
            _ => return Err(LinkError::Io(error)),
        }
        Ok(())
    }

    /// Looks whether a lost bus is back.
    fn look(&mut self) {
        match (Presence::of(&self.interface), self.state) {
            (Presence::Absent | Presence::NotCan, _) => self.state = BusState::Removed,
            (Presence::Down, BusState::Removed) => self.reconnect(BusState::Down),
            (Presence::Down, _) => self.state = BusState::Down,
            (Presence::Up, BusState::Removed) => self.reconnect(BusState::Active),
            (Presence::Up, _) => self.state = BusState::Active,
            // A controller that is bus-off takes the carrier with it.
            (Presence::NoCarrier, _) => {}
        }
    }

    /// The socket of an interface that was removed stays unbound, whatever comes under the same name.
    fn reconnect(&mut self, state: BusState) {
        if let Ok(socket) = connect(&self.interface) {
            self.socket = Arc::new(socket);
            self.dropped = 0;
            // A new socket hears everything: a refusal leaves it so.
            let _ = self.filter();
            self.state = state;
        }
    }

    /// What a frame of the kernel says: a frame of the bus, or how the bus is.
    fn take(&mut self, frame: &[u8; FRAME]) -> Option<Frame> {
        let [a, b, c, d, len, _, _, _, data @ ..] = frame;
        let id = u32::from_ne_bytes([*a, *b, *c, *d]);
        if id & ERROR != 0 {
            self.state = state_after(id & !ERROR, data).unwrap_or(self.state);
            return None;
        }
        // Traffic proves that the bus is back, and may leave no pause in which to look.
        if !self.state.carries_frames() {
            self.look();
        }
        from_kernel(id, *len, data)
    }

    /// Whatever cannot be filtered is heard: too much is no harm, too little is.
    fn filter(&self) -> io::Result<()> {
        let is_possible = !self.filters.is_empty() && self.filters.len() <= MOST_FILTERS;
        if is_possible && self.socket.set_filters(&self.filters).is_ok() {
            return Ok(());
        }
        self.socket.set_filter_accept_all()
    }
}

impl Link for SocketCan {
    fn is_real_time(&self) -> bool {
        true
    }

    fn descriptor(&self) -> Option<Descriptor> {
        Some(Arc::clone(&self.socket) as Descriptor)
    }

    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let deadline = self.now() + PATIENCE;
        let mut nap = Duration::from_micros(100);
        loop {
            match self.try_send(frame) {
                // Neither the queue of the interface nor the buffer of the socket tells when it has
                // room for one frame again, so there is nothing to wait on but time.
                Err(LinkError::Full) if self.now() < deadline => pause(nap),
                outcome => return outcome,
            }
            nap = nap.times(2).min(Duration::from_millis(5));
        }
    }

    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let frame = to_kernel(frame);
        while self.state.carries_frames() {
            let Err(error) = self.socket.write_frame(&frame) else { return Ok(()) };
            match errno(&error) {
                Errno::ENOBUFS | Errno::EAGAIN => return Err(LinkError::Full),
                _ => self.learn_from(error)?,
            }
        }
        Err(LinkError::NoBus(self.state))
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        if let Some(frame) = self.behind.take() {
            return Ok(Some(Incoming::Frame(frame)));
        }
        loop {
            if self.state != self.told {
                self.told = self.state;
                return Ok(Some(Incoming::State(self.state)));
            }
            let remaining = self.clock.until(until);
            let span = if self.state.carries_frames() { remaining } else { remaining.min(LOOK) };
            match self.read(span)? {
                Some(Received { frame, dropped }) => {
                    let incoming = self.take(&frame);
                    // The counter of the kernel wraps.
                    let gap = dropped.map_or(0, |all| all.wrapping_sub(core::mem::replace(&mut self.dropped, all)));
                    if gap > 0 {
                        self.behind = incoming;
                        return Ok(Some(Incoming::Gap(gap)));
                    }
                    if let Some(frame) = incoming {
                        return Ok(Some(Incoming::Frame(frame)));
                    }
                }
                None if self.state != self.told => {}
                None => {
                    if !self.state.carries_frames() {
                        self.look();
                    }
                    if self.state == self.told && (remaining.is_zero() || self.now() >= until) {
                        return Ok(None);
                    }
                }
            }
        }
    }

    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        let ids: BTreeSet<CobId> = ids.iter().copied().collect();
        self.filters = ids.into_iter().map(filter_of).collect();
        Ok(self.filter()?)
    }
}

/// Passes frames of exactly this identifier and format, data and remote.
fn filter_of(id: CobId) -> CanFilter {
    let (format, mask) = if id.is_extended() { (EXTENDED, 0x1FFF_FFFF) } else { (0, 0x7FF) };
    CanFilter::new(format | id.raw(), EXTENDED | mask)
}

/// A socket for all frames of an interface, and its error frames.
fn connect(interface: &str) -> io::Result<CanSocket> {
    let socket = CanSocket::open(interface)?;
    socket.set_nonblocking(true)?;
    socket.set_error_filter(CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED)?;
    // A smaller buffer than asked for is what the kernel grants; none of it is an error.
    if setsockopt(&socket, RcvBufForce, &RECEIVE_BUFFER).is_err() {
        let _ = setsockopt(&socket, RcvBuf, &RECEIVE_BUFFER);
    }
    setsockopt(&socket, RxqOvfl, &1)?;
    Ok(socket)
}

/// The flags of an identifier, and the size of a frame: `CAN_EFF_FLAG`, `CAN_RTR_FLAG`, `CAN_ERR_FLAG` and
/// `struct can_frame` of Linux's `can.h`.
const EXTENDED: u32 = 1 << 31;
const REMOTE: u32 = 1 << 30;
const ERROR: u32 = 1 << 29;
const FRAME: usize = 16;

/// A frame as the kernel gives it.
struct Received {
    frame: [u8; FRAME],
    /// How many frames were dropped before it since the socket was opened, if any were.
    dropped: Option<u32>,
}

/// Reads a frame that is there.
fn receive(socket: &CanSocket) -> Result<Received, Errno> {
    let mut frame = [0; FRAME];
    // Room for more than one control message of four bytes.
    let mut control = [0; 64];
    let mut parts = [IoSliceMut::new(&mut frame)];
    let message = recvmsg::<()>(socket.as_raw_fd(), &mut parts, Some(&mut control), MsgFlags::empty())?;
    let dropped = message.cmsgs()?.find_map(|control| match control {
        ControlMessageOwned::RxqOvfl(dropped) => Some(dropped),
        _ => None,
    });
    Ok(Received { frame, dropped })
}

/// The state that an error frame tells, if it tells one (Linux's `can/error.h`).
fn state_after(class: u32, data: &[u8]) -> Option<BusState> {
    const WARNING: u8 = 0x04 | 0x08;
    const PASSIVE: u8 = 0x10 | 0x20;
    const ACTIVE: u8 = 0x40;
    if class & CAN_ERR_BUSOFF != 0 {
        return Some(BusState::Off);
    }
    if class & CAN_ERR_RESTARTED != 0 {
        return Some(BusState::Active);
    }
    let controller = if class & CAN_ERR_CRTL != 0 { *data.get(1)? } else { 0 };
    match controller {
        bits if bits & PASSIVE != 0 => Some(BusState::Passive),
        bits if bits & WARNING != 0 => Some(BusState::Warning),
        bits if bits & ACTIVE != 0 => Some(BusState::Active),
        _ => None,
    }
}

fn to_kernel(frame: &Frame) -> CanFrame {
    let raw = frame.id().raw();
    let id: Option<Id> = if frame.id().is_extended() {
        ExtendedId::new(raw).map(Id::from)
    } else {
        u16::try_from(raw).ok().and_then(StandardId::new).map(Id::from)
    };
    let id = id.expect("a CobId is within its format");
    let kernel = if frame.is_remote() {
        CanFrame::new_remote(id, usize::from(frame.dlc()))
    } else {
        CanFrame::new(id, frame.data())
    };
    kernel.expect("a Frame carries at most eight bytes")
}

fn from_kernel(id: u32, len: u8, data: &[u8]) -> Option<Frame> {
    let cob_id = if id & EXTENDED != 0 {
        CobId::extended(id & !(EXTENDED | REMOTE))?
    } else {
        CobId::standard(u16::try_from(id & !REMOTE).ok()?)?
    };
    if id & REMOTE != 0 { Frame::remote(cob_id, len) } else { Frame::new(cob_id, data.get(..len.into())?) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_frames_tell_states() {
        for (class, controller, state) in [
            (CAN_ERR_BUSOFF, 0, Some(BusState::Off)),
            (CAN_ERR_RESTARTED, 0, Some(BusState::Active)),
            (CAN_ERR_CRTL, 0x08, Some(BusState::Warning)),
            (CAN_ERR_CRTL, 0x0C, Some(BusState::Warning)),
            (CAN_ERR_CRTL, 0x10, Some(BusState::Passive)),
            (CAN_ERR_CRTL, 0x24, Some(BusState::Passive)),
            (CAN_ERR_CRTL, 0x40, Some(BusState::Active)),
            // A lost frame is not another state, nor is a bit that only means something in a CRTL frame.
            (CAN_ERR_CRTL, 0x01, None),
            (0x80, 0x40, None),
        ] {
            assert_eq!(state_after(class, &[0, controller, 0, 0, 0, 0, 0, 0]), state, "{class:X} {controller:X}");
        }
        assert_eq!(state_after(CAN_ERR_CRTL, &[]), None);
    }

    #[test]
    fn frames_survive_the_kernels_form() {
        for frame in [
            Frame::new(CobId::standard(0x7FF).unwrap(), &[1, 2, 3]).unwrap(),
            Frame::new(CobId::extended(0x5).unwrap(), &[0; 8]).unwrap(),
            Frame::remote(CobId::standard(0x705).unwrap(), 1).unwrap(),
            Frame::remote(CobId::extended(0x1FFF_FFFF).unwrap(), 0).unwrap(),
        ] {
            let kernel = to_kernel(&frame);
            let raw = kernel.as_ref();
            assert_eq!(from_kernel(raw.can_id, raw.can_dlc, &raw.data), Some(frame));
        }
    }
}
