//! The SocketCAN link against a real kernel. Where the kernel has no CAN:
//! `cargo xtask vcan -- cargo test -p lexican-tests --test link_socketcan`.
#![cfg(target_os = "linux")]
#![expect(clippy::disallowed_methods, reason = "a real kernel takes real time")]

use std::process::{Command, Stdio};
use std::time::Instant as WallClock;

use lexican_runtime::host::socketcan::{SocketCan, SocketCanError};
use lexican_runtime::host::{BusState, Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame};
use socketcan::{CanErrorFrame, CanSocket, Socket};

const SHORT: Duration = Duration::from_millis(50);
const LONG: Duration = Duration::from_secs(5);

/// An interface of the test's own, so that tests do not hear each other.
struct Interface(&'static str);

impl Interface {
    /// `None`, with the reason on the screen, where this machine cannot have one.
    fn new(name: &'static str) -> Option<Self> {
        let missing = if SocketCan::is_supported().is_err() {
            "no CAN in this kernel"
        } else if !(ip(&["link", "add", "dev", name, "type", "vcan"]) && ip(&["link", "set", name, "up"])) {
            "no right to create interfaces"
        } else {
            return Some(Interface(name));
        };
        skip(missing)
    }

    fn link(&self) -> SocketCan {
        SocketCan::open(self.0).unwrap()
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        ip(&["link", "delete", self.0]);
    }
}

/// Not on the machine where this is what is tested.
fn skip<T>(reason: &str) -> Option<T> {
    assert!(std::env::var_os("LEXICAN_REQUIRE_CAN").is_none(), "skipped although CAN is required: {reason}");
    println!("skipped: {reason}");
    None
}

fn ip(arguments: &[&str]) -> bool {
    Command::new("ip").args(arguments).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(CobId::standard(id).unwrap(), data).unwrap()
}

#[track_caller]
fn hears(link: &mut SocketCan, expected: Incoming) {
    let until = link.now() + LONG;
    assert_eq!(link.receive(until).unwrap(), Some(expected));
}

#[track_caller]
fn hears_nothing(link: &mut SocketCan) {
    let until = link.now() + SHORT;
    assert_eq!(link.receive(until).unwrap(), None);
    assert!(link.now() >= until, "it did not wait to the end");
}

#[test]
fn frames_of_every_kind_reach_the_others_and_not_their_sender() {
    let Some(interface) = Interface::new("lxframes") else { return };
    let (mut a, mut b) = (interface.link(), interface.link());
    for frame in [
        frame(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]),
        frame(0x080, &[]),
        Frame::new(CobId::extended(0x123).unwrap(), &[1, 2, 3]).unwrap(),
        Frame::remote(CobId::standard(0x705).unwrap(), 1).unwrap(),
    ] {
        a.send(&frame).unwrap();
        hears(&mut b, Incoming::Frame(frame));
    }
    hears_nothing(&mut a);
}

#[test]
fn a_link_hears_only_what_it_listens_to() {
    let Some(interface) = Interface::new("lxfilter") else { return };
    let (mut a, mut b) = (interface.link(), interface.link());
    let extended = Frame::new(CobId::extended(0x605).unwrap(), &[]).unwrap();
    let guarding = Frame::remote(CobId::standard(0x705).unwrap(), 1).unwrap();
    b.listen_to(&[CobId::standard(0x605).unwrap(), guarding.id()]).unwrap();
    for frame in [frame(0x604, &[]), extended, frame(0x605, &[1]), guarding] {
        a.send(&frame).unwrap();
    }
    hears(&mut b, Incoming::Frame(frame(0x605, &[1])));
    hears(&mut b, Incoming::Frame(guarding));
    b.listen_to(&[]).unwrap();
    a.send(&extended).unwrap();
    hears(&mut b, Incoming::Frame(extended));
}

#[test]
fn a_link_waits_to_the_microsecond_of_its_deadline() {
    let Some(interface) = Interface::new("lxwait") else { return };
    let mut link = interface.link();
    for us in [0, 1, 300, 1_500] {
        let until = link.now() + Duration::from_micros(us);
        assert_eq!(link.receive(until).unwrap(), None);
        assert!(link.now() >= until);
    }
}

#[test]
fn error_frames_are_states() {
    const CONTROLLER: u32 = 0x004;
    const BUS_OFF: u32 = 0x040;
    const RESTARTED: u32 = 0x100;
    let Some(interface) = Interface::new("lxerrors") else { return };
    let mut link = interface.link();
    let kernel = CanSocket::open(interface.0).unwrap();
    for (class, controller, state) in [
        (CONTROLLER, 0x08, BusState::Warning),
        (CONTROLLER, 0x20, BusState::Passive),
        (BUS_OFF, 0, BusState::Off),
        (RESTARTED, 0, BusState::Active),
    ] {
        kernel.write_frame(&CanErrorFrame::new_error(class, &[0, controller]).unwrap()).unwrap();
        hears(&mut link, Incoming::State(state));
        let sent = link.send(&frame(1, &[]));
        assert_eq!(matches!(sent, Err(LinkError::NoBus(BusState::Off))), state == BusState::Off, "{sent:?}");
    }
    hears_nothing(&mut link);
}

#[test]
fn an_interface_that_goes_down_is_told_and_comes_back() {
    let Some(interface) = Interface::new("lxdown") else { return };
    let (mut a, mut b) = (interface.link(), interface.link());
    assert!(ip(&["link", "set", interface.0, "down"]));
    hears(&mut a, Incoming::State(BusState::Down));
    assert!(matches!(a.send(&frame(1, &[])), Err(error @ LinkError::NoBus(BusState::Down)) if !error.is_final()));
    // The other link learns it when it sends.
    assert!(matches!(b.send(&frame(1, &[])), Err(LinkError::NoBus(BusState::Down))));
    hears(&mut b, Incoming::State(BusState::Down));
    assert!(ip(&["link", "set", interface.0, "up"]));
    hears(&mut a, Incoming::State(BusState::Active));
    hears(&mut b, Incoming::State(BusState::Active));
    a.send(&frame(2, &[])).unwrap();
    hears(&mut b, Incoming::Frame(frame(2, &[])));
}

#[test]
fn an_interface_that_is_unplugged_is_told_and_comes_back() {
    let Some(interface) = Interface::new("lxunplug") else { return };
    let mut link = interface.link();
    assert!(ip(&["link", "delete", interface.0]));
    hears(&mut link, Incoming::State(BusState::Removed));
    assert!(matches!(link.send(&frame(1, &[])), Err(LinkError::NoBus(BusState::Removed))));
    let interface = Interface::new("lxunplug").unwrap();
    hears(&mut link, Incoming::State(BusState::Active));
    let mut other = interface.link();
    other.send(&frame(2, &[])).unwrap();
    hears(&mut link, Incoming::Frame(frame(2, &[])));
}

#[test]
fn waiting_for_a_lost_bus_costs_no_time_of_the_processor() {
    let Some(interface) = Interface::new("lxidle") else { return };
    let mut link = interface.link();
    assert!(ip(&["link", "set", interface.0, "down"]));
    hears(&mut link, Incoming::State(BusState::Down));
    let before = processor_ticks();
    let until = link.now() + Duration::from_secs(1);
    assert_eq!(link.receive(until).unwrap(), None);
    let used = processor_ticks() - before;
    assert!(used <= 20, "{used} of 100 ticks");
}

/// What this thread has used, in ticks of 10 ms.
fn processor_ticks() -> u64 {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
    let fields = stat.rsplit(')').next().unwrap().split_ascii_whitespace();
    fields.skip(11).take(2).map(|ticks| ticks.parse::<u64>().unwrap()).sum()
}

#[test]
fn what_cannot_be_opened_says_why() {
    let error = |interface: &str| SocketCan::open(interface).unwrap_err();
    if SocketCan::is_supported().is_err() {
        assert!(matches!(error("can0"), SocketCanError::NoCan));
        let _: Option<()> = skip("no CAN in this kernel");
        return;
    }
    assert!(matches!(error("lxnone"), SocketCanError::Missing { .. }));
    assert!(matches!(error("lo"), SocketCanError::NotCan { .. }));
    let Some(interface) = Interface::new("lxclosed") else { return };
    assert!(ip(&["link", "set", interface.0, "down"]));
    assert!(matches!(error(interface.0), SocketCanError::Down { .. }));
    assert!(error("lxnone").to_string().contains("lxclosed"), "what there is, is named");
}

#[test]
fn a_queue_that_stays_full_is_told_within_its_time() {
    let Some(interface) = SerialInterface::new() else { return };
    let mut link = SocketCan::open(&interface.name).unwrap();
    let started = WallClock::now();
    let refused = (0..100_000).find_map(|_| link.send(&frame(0x123, &[0; 8])).err()).expect("nobody reads the line");
    assert!(matches!(refused, LinkError::Full), "{refused}");
    let again = WallClock::now();
    assert!(matches!(link.send(&frame(0x123, &[])), Err(LinkError::Full)));
    assert!(again.elapsed().as_millis() >= 100, "it did not wait");
    assert!(again.elapsed().as_millis() < 1_000 && started.elapsed().as_secs() < 30, "it waited for long");
    hears_nothing(&mut link);
}

/// An interface of the kernel's slcan driver, on a pseudo-terminal that nobody reads: the one kind of
/// interface with a queue that needs no hardware.
struct SerialInterface {
    name: String,
    driver: std::process::Child,
    _terminals: (serialport::TTYPort, serialport::TTYPort),
}

impl SerialInterface {
    fn new() -> Option<Self> {
        use serialport::SerialPort;
        const N_SLCAN: &str = "17";
        if SocketCan::is_supported().is_err() {
            return skip("no CAN in this kernel");
        }
        let before = can_interfaces();
        let terminals = serialport::TTYPort::pair().unwrap();
        let path = terminals.1.name().unwrap();
        let driver = Command::new("ldattach").args(["--debug", N_SLCAN, &path]).stderr(Stdio::null()).spawn();
        let Ok(driver) = driver else { return skip("no ldattach here") };
        let deadline = WallClock::now() + std::time::Duration::from_secs(5);
        while WallClock::now() < deadline {
            if let Some(name) =
                can_interfaces().into_iter().find(|name| !before.contains(name) && name.starts_with("can"))
            {
                assert!(ip(&["link", "set", &name, "up"]));
                return Some(SerialInterface { name, driver, _terminals: terminals });
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        skip("no slcan driver in this kernel")
    }
}

impl Drop for SerialInterface {
    fn drop(&mut self) {
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn can_interfaces() -> Vec<String> {
    let entries = std::fs::read_dir("/sys/class/net").unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}
