//! SocketCAN: the CAN interfaces of a Linux kernel.
//!
//! One raw socket per link, bound to one interface. The kernel tells the controller's state in error
//! frames, and that the interface went down or away in the error of a read. While there is no bus the
//! link looks for it ten times a second, so nothing spins and nothing has to be restarted.

use std::borrow::ToOwned;
use std::os::fd::{AsFd, BorrowedFd};
use std::path::Path;
use std::string::String;
use std::vec::Vec;
use std::{fs, io};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use socketcan::errors::{CAN_ERR_BUSOFF, CAN_ERR_CRTL, CAN_ERR_RESTARTED};
use socketcan::{CanFilter, CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, Socket, SocketOptions, StandardId};

use super::clock::{Clock, pause};
use super::{BusState, Incoming, Link, LinkError};
use crate::{CobId, Duration, Frame, Instant};

/// How often a link without a bus looks whether it is back.
const LOOK: Duration = Duration::from_millis(100);

/// How long a frame may wait for room in the interface's queue. A frame lasts 11 ms at the slowest
/// bit rate of CANopen, 10 kbit/s, so a bus that works frees a place several times in this span.
const PATIENCE: Duration = Duration::from_millis(100);

/// The receive buffer that is asked for, in bytes; the kernel grants up to `net.core.rmem_max`. Its
/// default holds some 270 frames: at 1 Mbit/s, 30 ms of a full bus.
const RECEIVE_BUFFER: usize = 1 << 20;

/// A [`Link`] to a CAN interface of this machine.
#[derive(Debug)]
pub struct SocketCan {
    interface: String,
    socket: CanSocket,
    /// What the kernel passes on; empty for everything.
    filters: Vec<CanFilter>,
    clock: Clock,
    state: BusState,
    /// The state that [`Link::receive`] last told.
    told: BusState,
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
                    socket,
                    filters: Vec::new(),
                    clock: Clock::new(),
                    state: BusState::Active,
                    told: BusState::Active,
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
            self.socket = socket;
            // Hearing too much is no harm, so that a refusal is none either.
            let _ = self.filter();
            self.state = state;
        }
    }

    fn filter(&self) -> io::Result<()> {
        if self.filters.is_empty() {
            self.socket.set_filter_accept_all()
        } else {
            self.socket.set_filters(&self.filters)
        }
    }
}

impl Link for SocketCan {
    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        Some(self.socket.as_fd())
    }

    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let frame = to_kernel(frame);
        let deadline = self.now() + PATIENCE;
        let mut nap = Duration::from_micros(100);
        while self.state.carries_frames() {
            let Err(error) = self.socket.write_frame(&frame) else { return Ok(()) };
            match errno(&error) {
                // Neither the queue of the interface nor the buffer of the socket tells when it has
                // room for one frame again, so there is nothing to wait on but time.
                Errno::ENOBUFS | Errno::EAGAIN => {
                    if self.now() >= deadline {
                        return Err(LinkError::Full);
                    }
                    pause(nap);
                    nap = nap.times(2).min(Duration::from_millis(5));
                }
                _ => self.learn_from(error)?,
            }
        }
        Err(LinkError::NoBus(self.state))
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            if self.state != self.told {
                self.told = self.state;
                return Ok(Some(Incoming::State(self.state)));
            }
            let now = self.now();
            let remaining = until.since(now);
            let span = if self.state.carries_frames() { remaining } else { remaining.min(LOOK) };
            if self.wait(span)? {
                match self.socket.read_frame() {
                    Ok(CanFrame::Error(error)) => {
                        self.state = state_after(error.error_bits(), error.data()).unwrap_or(self.state);
                    }
                    Ok(frame) => {
                        // Traffic proves that the bus is back, and may leave no pause in which to look.
                        if !self.state.carries_frames() {
                            self.look();
                        }
                        if let Some(frame) = from_kernel(&frame) {
                            return Ok(Some(Incoming::Frame(frame)));
                        }
                    }
                    Err(error) => self.learn_from(error)?,
                }
            } else {
                if !self.state.carries_frames() {
                    self.look();
                }
                if self.now() >= until && self.state == self.told {
                    return Ok(None);
                }
            }
        }
    }

    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        self.filters = ids.iter().map(|id| filter_of(*id)).collect();
        Ok(self.filter()?)
    }
}

/// Passes frames of exactly this identifier and format, data and remote.
fn filter_of(id: CobId) -> CanFilter {
    // `CAN_EFF_FLAG` of Linux's `can.h`.
    const EXTENDED: u32 = 1 << 31;
    let (format, mask) = if id.is_extended() { (EXTENDED, 0x1FFF_FFFF) } else { (0, 0x7FF) };
    CanFilter::new(format | id.raw(), EXTENDED | mask)
}

/// Why an interface cannot be opened, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SocketCanError {
    /// The kernel was built without CAN, or its module is not there.
    #[error("this kernel has no CAN; load it with `modprobe can-raw`, or use a serial adapter: slcan:/dev/ttyACM0")]
    NoCan,
    /// There is no interface of that name.
    #[error("there is no interface {interface}; {}{}", create(interface), list(present))]
    Missing {
        /// The name.
        interface: String,
        /// The CAN interfaces that there are.
        present: Vec<String>,
    },
    /// The interface is not one of CAN.
    #[error("{interface} is not a CAN interface{}", list(present))]
    NotCan {
        /// The name.
        interface: String,
        /// The CAN interfaces that there are.
        present: Vec<String>,
    },
    /// The interface is down.
    #[error("{interface} is down; set it up with `{}`", set_up(interface))]
    Down {
        /// The name.
        interface: String,
    },
    /// This process may not use CAN.
    #[error(
        "permission to use {interface} is denied; in a container, run it in the host's network \
         (`--network host`) with CAP_NET_RAW"
    )]
    Denied {
        /// The name.
        interface: String,
    },
    /// Something else.
    #[error("cannot open {interface}: {error}")]
    Io {
        /// The name.
        interface: String,
        /// What the operating system said.
        error: io::Error,
    },
}

impl SocketCanError {
    fn refusal(interface: &str, error: io::Error) -> Self {
        let interface = interface.to_owned();
        match errno(&error) {
            Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT => SocketCanError::NoCan,
            Errno::EPERM | Errno::EACCES => SocketCanError::Denied { interface },
            Errno::ENETDOWN => SocketCanError::Down { interface },
            Errno::ENODEV | Errno::ENXIO => SocketCanError::Missing { interface, present: interfaces() },
            _ => SocketCanError::Io { interface, error },
        }
    }
}

fn create(interface: &str) -> String {
    match interface.strip_prefix("vcan") {
        Some(_) => {
            std::format!("create it with `ip link add dev {interface} type vcan`, then `ip link set {interface} up`")
        }
        None => String::from("is the adapter plugged in, and its driver loaded?"),
    }
}

fn set_up(interface: &str) -> String {
    match interface.strip_prefix("vcan") {
        Some(_) => std::format!("ip link set {interface} up"),
        None => std::format!("ip link set {interface} up type can bitrate 500000"),
    }
}

fn list(present: &[String]) -> String {
    if present.is_empty() { String::new() } else { std::format!(" (there is {})", present.join(", ")) }
}

/// A socket for all frames of an interface, and its error frames.
fn connect(interface: &str) -> io::Result<CanSocket> {
    let socket = CanSocket::open(interface)?;
    socket.set_nonblocking(true)?;
    socket.set_error_filter(CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED)?;
    // A smaller buffer than asked for is what the kernel grants; none of it is an error.
    let _ = socket.as_raw_socket().set_recv_buffer_size(RECEIVE_BUFFER);
    Ok(socket)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
    Absent,
    NotCan,
    Down,
    NoCarrier,
    Up,
}

/// Where Linux tells what interfaces there are.
const INTERFACES: &str = "/sys/class/net";

impl Presence {
    fn of(interface: &str) -> Presence {
        const UP: u32 = 1;
        let folder = Path::new(INTERFACES).join(interface);
        if !folder.exists() {
            // Where nothing is told, opening the interface is the way to find out.
            return if Path::new(INTERFACES).exists() { Presence::Absent } else { Presence::Up };
        }
        let tells = |file: &str| fs::read_to_string(folder.join(file)).unwrap_or_default();
        let flags = u32::from_str_radix(tells("flags").trim().trim_start_matches("0x"), 16).unwrap_or(UP);
        if !is_can(&folder) {
            Presence::NotCan
        } else if flags & UP == 0 {
            Presence::Down
        } else if tells("carrier").trim() == "0" {
            Presence::NoCarrier
        } else {
            Presence::Up
        }
    }
}

/// The CAN interfaces of this machine, by name.
fn interfaces() -> Vec<String> {
    let Ok(entries) = fs::read_dir(INTERFACES) else { return Vec::new() };
    let found = entries.filter_map(Result::ok).filter(|entry| is_can(&entry.path()));
    let mut names: Vec<String> = found.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
}

fn is_can(folder: &Path) -> bool {
    // `ARPHRD_CAN` of Linux's `if_arp.h`.
    fs::read_to_string(folder.join("type")).is_ok_and(|kind| kind.trim() == "280")
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

fn from_kernel(frame: &CanFrame) -> Option<Frame> {
    let id = match frame.id() {
        Id::Standard(id) => CobId::standard(id.as_raw())?,
        Id::Extended(id) => CobId::extended(id.as_raw())?,
    };
    if frame.is_remote_frame() {
        Frame::remote(id, u8::try_from(frame.dlc()).ok()?)
    } else {
        Frame::new(id, frame.data())
    }
}

fn errno(error: &io::Error) -> Errno {
    error.raw_os_error().map_or(Errno::UnknownErrno, Errno::from_raw)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

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
            assert_eq!(from_kernel(&to_kernel(&frame)), Some(frame));
        }
    }

    #[test]
    fn errors_name_the_interface_and_the_remedy() {
        let denied = SocketCanError::refusal("can0", Errno::EPERM.into());
        assert!(denied.to_string().starts_with("permission to use can0 is denied; in a container"));
        let down = SocketCanError::Down { interface: "can0".to_owned() };
        assert_eq!(down.to_string(), "can0 is down; set it up with `ip link set can0 up type can bitrate 500000`");
        let missing = |interface: &str, present: &[&str]| {
            let present = present.iter().map(|name| (*name).to_owned()).collect();
            SocketCanError::Missing { interface: interface.to_owned(), present }.to_string()
        };
        assert_eq!(
            missing("vcan0", &[]),
            "there is no interface vcan0; create it with `ip link add dev vcan0 type vcan`, then `ip link set vcan0 up`"
        );
        assert_eq!(
            missing("can0", &["can1", "vcan0"]),
            "there is no interface can0; is the adapter plugged in, and its driver loaded? (there is can1, vcan0)"
        );
    }
}
