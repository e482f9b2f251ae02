//! SocketCAN: the CAN interfaces of a Linux kernel.
//!
//! Each link has one raw socket, bound to one interface. The kernel reports the controller's state in error frames, and
//! an interface that is down or gone as an error of a read. While there is no bus, the link looks for it ten times a
//! second.
//!
//! Sending a frame takes one system call. So does receiving one, together with up to seven more that have come after
//! it.

mod error;
mod presence;

use std::borrow::ToOwned;
use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::io::IoSliceMut;
use std::os::fd::{AsFd, AsRawFd};
use std::string::String;
use std::sync::Arc;
use std::vec;
use std::vec::Vec;

use nix::errno::Errno;
use nix::libc;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::socket::sockopt::{GetStruct, RcvBuf, RcvBufForce, RxqOvfl};
use nix::sys::socket::{ControlMessageOwned, MsgFlags, MultiHeaders, getsockopt, recvmmsg, send, setsockopt};
use socketcan::errors::{CAN_ERR_BUSOFF, CAN_ERR_CRTL, CAN_ERR_RESTARTED};
use socketcan::{CanFilter, CanSocket, Socket, SocketOptions};

pub use self::error::SocketCanError;
use self::error::errno;
use self::presence::{Presence, interfaces};
use super::clock::{Clock, pause};
use super::link::{Descriptor, PATIENCE};
use super::{BusState, Incoming, Link, LinkError};
use crate::{CobId, Duration, Frame, Instant};

/// How often a link without a bus checks whether it is back.
const LOOK: Duration = Duration::from_millis(100);

/// The size of the receive buffer to request, in bytes. Without CAP_NET_ADMIN the kernel grants up to
/// `net.core.rmem_max`, whose default is enough for some 270 frames: 30 ms of a full bus at 1 Mbit/s. This one is
/// enough for 10,000 frames.
const RECEIVE_BUFFER: usize = 4 << 20;

/// How long the kernel waits for a frame at most. It counts in jiffies, so the end of a wait is left to a timer. A wait counts
/// as long from twice this time on, so that the 500 ms of a block upload's next segment are a long wait.
const NAP: Duration = Duration::from_millis(200);

/// How many frames one system call takes at most.
const BATCH: usize = 8;

/// How many filters a socket accepts: `CAN_RAW_FILTER_MAX` of Linux's `can/raw.h`.
const MOST_FILTERS: usize = 512;

/// A [`Link`] to a CAN interface of this machine.
#[derive(Debug)]
pub struct SocketCan {
    interface: String,
    socket: Arc<CanSocket>,
    /// The filters of the socket; empty for all frames.
    filters: Vec<CanFilter>,
    clock: Clock,
    state: BusState,
    /// The state that [`Link::receive`] last reported.
    reported: BusState,
    /// How many frames the kernel has dropped since the socket was opened.
    dropped: u32,
    /// Frames that were read and not yet returned.
    batch: VecDeque<Received>,
    /// Whether the last read took all that had come.
    is_drained: bool,
    /// Whether a read has filled a batch, as with a full receive buffer, since the kernel was last asked for `dropped`.
    was_crowded: bool,
    /// How many frames had been dropped at the end of the batch, if the kernel was asked.
    dropped_behind: Option<u32>,
}

impl SocketCan {
    /// Opens an interface that exists and is up, such as `can0`.
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
                    reported: BusState::Active,
                    dropped: 0,
                    batch: VecDeque::new(),
                    is_drained: false,
                    was_crowded: false,
                    dropped_behind: None,
                })
            }
        }
    }

    /// Checks whether this kernel has CAN at all.
    pub fn is_supported() -> Result<(), SocketCanError> {
        // Interface 0 stands for all of them, so none has to exist.
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

    /// Reads frames; waits up to `span` for the first one. Returns whether there is something to report.
    fn read(&mut self, span: Duration) -> Result<bool, LinkError> {
        // For a long wait, the reading call itself waits.
        let read = if span >= NAP.times(2) {
            read_batch(&self.socket, MsgFlags::MSG_WAITFORONE, &mut self.batch)
        } else if span.is_zero() || self.wait(span)? {
            read_batch(&self.socket, MsgFlags::MSG_WAITFORONE | MsgFlags::MSG_DONTWAIT, &mut self.batch)
        } else {
            Err(Errno::EAGAIN)
        };
        self.is_drained = self.batch.len() < BATCH;
        if !self.is_drained {
            self.was_crowded = true;
        } else if core::mem::take(&mut self.was_crowded) {
            // A received frame has the count of dropped ones, but none may follow the drop, so the kernel is asked.
            self.dropped_behind = getsockopt(&self.socket, MemInfo).ok().map(|info| info[MemInfo::DROPS]);
        }
        if let Err(error) = read {
            self.learn_from(error.into())?;
        }
        Ok(!self.batch.is_empty() || self.dropped_behind.is_some())
    }

    /// How many frames were dropped since the last call; `all` is the count since the socket was opened.
    fn gap(&mut self, all: u32) -> Option<Incoming> {
        // The counter wraps around, and a frame that has waited carries an old value.
        let gap = all.wrapping_sub(self.dropped);
        if gap == 0 || gap > u32::MAX / 2 {
            return None;
        }
        self.dropped = all;
        Some(Incoming::Gap(gap))
    }

    /// Takes the state of the bus from an error of a read or write; other errors end the link.
    fn learn_from(&mut self, error: io::Error) -> Result<(), LinkError> {
        match errno(&error) {
            Errno::EAGAIN | Errno::EINTR => {}
            Errno::ENETDOWN => self.state = BusState::Down,
            Errno::ENODEV | Errno::ENXIO => self.state = BusState::Removed,
            _ => return Err(LinkError::Io(error)),
        }
        Ok(())
    }

    /// Checks whether a lost bus is back.
    fn look(&mut self) {
        match (Presence::of(&self.interface), self.state) {
            (Presence::Absent | Presence::NotCan, _) => self.state = BusState::Removed,
            (Presence::Down, BusState::Removed) => self.reconnect(BusState::Down),
            (Presence::Down, _) => self.state = BusState::Down,
            (Presence::Up, BusState::Removed) => self.reconnect(BusState::Active),
            (Presence::Up, _) => self.state = BusState::Active,
            // A bus-off controller has no carrier.
            (Presence::NoCarrier, _) => {}
        }
    }

    /// Opens a new socket, since that of a removed interface stays unbound, even if another interface gets its name.
    fn reconnect(&mut self, state: BusState) {
        if let Ok(socket) = connect(&self.interface) {
            self.socket = Arc::new(socket);
            (self.dropped, self.dropped_behind, self.was_crowded) = (0, None, false);
            // A new socket receives all frames, and goes on to do so if the filters are refused.
            let _ = self.filter();
            self.state = state;
        }
    }

    /// Decodes a frame of the kernel, which may report a state of the bus.
    fn decode(&mut self, frame: &[u8; FRAME]) -> Option<Frame> {
        let [a, b, c, d, _, _, _, _, data @ ..] = frame;
        let id = u32::from_ne_bytes([*a, *b, *c, *d]);
        if id & ERROR != 0 {
            self.state = state_after(id & !ERROR, data).unwrap_or(self.state);
            return None;
        }
        // Traffic shows that the bus is back, and may leave no pause for a check.
        if !self.state.carries_frames() {
            self.look();
        }
        from_kernel(frame)
    }

    /// The next frame or state to report, from what was read.
    fn next(&mut self) -> Option<Incoming> {
        while self.state == self.reported {
            let Some(Received { frame, dropped }) = self.batch.front_mut() else {
                let all = self.dropped_behind.take()?;
                return self.gap(all);
            };
            let (frame, dropped) = (*frame, dropped.take());
            if let Some(gap) = dropped.and_then(|all| self.gap(all)) {
                return Some(gap);
            }
            self.batch.pop_front();
            if let Some(frame) = self.decode(&frame) {
                return Some(Incoming::Frame(frame));
            }
        }
        self.reported = self.state;
        Some(Incoming::State(self.state))
    }

    /// Sets the filters; receives all frames if there are too many.
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
        let first = self.try_send(frame);
        if !matches!(first, Err(LinkError::Full)) {
            return first;
        }
        let deadline = self.now() + PATIENCE;
        let mut nap = Duration::from_micros(100);
        loop {
            // Neither the queue of the interface nor the buffer of the socket reports when it has room for one frame
            // again, so the only way is to wait.
            pause(nap);
            match self.try_send(frame) {
                Err(LinkError::Full) if self.now() < deadline => nap = nap.times(2).min(Duration::from_millis(5)),
                outcome => return outcome,
            }
        }
    }

    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let frame = to_kernel(frame);
        while self.state.carries_frames() {
            match send(self.socket.as_raw_fd(), &frame, MsgFlags::MSG_DONTWAIT) {
                Ok(_) => return Ok(()),
                Err(Errno::ENOBUFS | Errno::EAGAIN) => return Err(LinkError::Full),
                Err(error) => self.learn_from(error.into())?,
            }
        }
        Err(LinkError::NoBus(self.state))
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        // What has been read already is returned without reading the clock.
        if let Some(incoming) = self.next() {
            return Ok(Some(incoming));
        }
        self.receive_at(self.now(), until)
    }

    fn receive_at(&mut self, now: Instant, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let mut remaining = until.since(now);
        loop {
            if let Some(incoming) = self.next() {
                return Ok(Some(incoming));
            }
            let carries_frames = self.state.carries_frames();
            if self.read(if carries_frames { remaining } else { remaining.min(LOOK) })? {
                continue;
            }
            if !carries_frames {
                self.look();
            }
            if self.state == self.reported {
                if !remaining.is_zero() {
                    remaining = until.since(self.now());
                }
                if remaining.is_zero() {
                    return Ok(None);
                }
            }
        }
    }

    fn is_drained(&self) -> bool {
        self.is_drained && self.batch.is_empty() && self.dropped_behind.is_none() && self.state == self.reported
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
    socket.set_read_timeout(core::time::Duration::from(NAP))?;
    socket.set_error_filter(CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED)?;
    // The kernel may grant a smaller buffer than requested, which is not an error.
    if setsockopt(&socket, RcvBufForce, &RECEIVE_BUFFER).is_err() {
        let _ = setsockopt(&socket, RcvBuf, &RECEIVE_BUFFER);
    }
    setsockopt(&socket, RxqOvfl, &1)?;
    Ok(socket)
}

/// The socket option `SO_MEMINFO`: `SK_MEMINFO_VARS` numbers of Linux's `sock_diag.h`.
#[derive(Clone, Copy, Debug)]
struct MemInfo;

impl MemInfo {
    /// How many frames were dropped since the socket was opened: `SK_MEMINFO_DROPS`.
    const DROPS: usize = 8;
}

nix::getsockopt_impl!(MemInfo, libc::SOL_SOCKET, libc::SO_MEMINFO, [u32; 9], GetStruct<[u32; 9]>);

/// The flags of an identifier and the size of a frame: `CAN_EFF_FLAG`, `CAN_RTR_FLAG`, `CAN_ERR_FLAG` and
/// `struct can_frame` of Linux's `can.h`.
const EXTENDED: u32 = 1 << 31;
const REMOTE: u32 = 1 << 30;
const ERROR: u32 = 1 << 29;
const FRAME: usize = 16;

/// A frame in the kernel's format.
#[derive(Clone, Copy, Debug)]
struct Received {
    frame: [u8; FRAME],
    /// How many frames had been dropped before it since the socket was opened, if any.
    dropped: Option<u32>,
}

/// Reads up to [`BATCH`] frames. Without `MSG_DONTWAIT` it waits up to [`NAP`] for the first one.
fn read_batch(socket: &CanSocket, flags: MsgFlags, batch: &mut VecDeque<Received>) -> Result<(), Errno> {
    let mut frames = [[0; FRAME]; BATCH];
    let mut parts = frames.each_mut().map(|frame| [IoSliceMut::new(frame)]);
    let mut headers = MultiHeaders::<()>::preallocate(BATCH, Some(nix::cmsg_space!(u32)));
    for message in recvmmsg(socket.as_raw_fd(), &mut headers, &mut parts, flags, None)? {
        let dropped = message.cmsgs()?.find_map(|control| match control {
            ControlMessageOwned::RxqOvfl(dropped) => Some(dropped),
            _ => None,
        });
        batch.push_back(Received { frame: [0; FRAME], dropped });
    }
    for (received, frame) in batch.iter_mut().zip(frames) {
        received.frame = frame;
    }
    Ok(())
}

/// The state in an error frame, if it has one (Linux's `can/error.h`).
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

fn to_kernel(frame: &Frame) -> [u8; FRAME] {
    let id = frame.id();
    let format = if id.is_extended() { EXTENDED } else { 0 } | if frame.is_remote() { REMOTE } else { 0 };
    let mut kernel = [0; FRAME];
    let parts = (id.raw() | format).to_ne_bytes().into_iter().chain([frame.dlc(), 0, 0, 0]);
    let bytes = parts.chain(frame.data().iter().copied());
    kernel.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
    kernel
}

fn from_kernel(kernel: &[u8; FRAME]) -> Option<Frame> {
    let [a, b, c, d, len, _, _, _, data @ ..] = kernel;
    let id = u32::from_ne_bytes([*a, *b, *c, *d]);
    let len = *len;
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
    fn error_frames_report_states() {
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
            assert_eq!(from_kernel(&to_kernel(&frame)), Some(frame));
        }
    }
}
