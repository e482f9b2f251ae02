//! The SocketCAN link against a real kernel. Where the kernel has no CAN:
//! `cargo xtask vcan -- cargo test -p lexican-tests --test link_socketcan`.
#![cfg(target_os = "linux")]
#![expect(clippy::disallowed_methods, reason = "a real kernel takes real time")]

mod link_support;

use std::process::{Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant as WallClock;

use lexican_runtime::host::socketcan::{SocketCan, SocketCanError};
use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::host::{BusState, Incoming, Link, LinkError, blocking};
use lexican_runtime::manager;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use link_support::{DEVICE_TYPE, RPDO_COB_ID, SETPOINT, Serving, processor_ticks};
use socketcan::{CanErrorFrame, CanSocket, Socket};

const SHORT: Duration = Duration::from_millis(50);
const LONG: Duration = Duration::from_secs(5);

/// An interface for one test, so that tests do not receive each other's frames.
struct Interface(&'static str);

impl Interface {
    /// `None` if this machine cannot have one; prints the reason.
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

/// Skips the test, but panics if CAN is required.
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
fn more_filters_than_the_kernel_takes_let_everything_through() {
    let Some(interface) = Interface::new("lxmany") else { return };
    let (mut a, mut b) = (interface.link(), interface.link());
    let many: Vec<CobId> = (0x100..0x100 + 513).filter_map(CobId::standard).collect();
    b.listen_to(&many[..512]).unwrap();
    a.send(&frame(0x605, &[])).unwrap();
    hears_nothing(&mut b);
    b.listen_to(&many).unwrap();
    a.send(&frame(0x605, &[])).unwrap();
    hears(&mut b, Incoming::Frame(frame(0x605, &[])));
}

#[test]
fn a_device_behind_filters_hears_its_pdo_under_the_identifier_that_sdo_has_just_given_it() {
    let Some(interface) = Interface::new("lxpdo") else { return };
    let node = NodeId::literal(5);
    let serving = Serving::nodes(&[node], interface.link());
    let mut network = blocking::Network::new(interface.link());
    assert_eq!(network.read(node, SETPOINT).unwrap(), 0);
    let before = serving.heard();
    network.command(NmtCommand::Start, Some(node)).unwrap();
    for (cob_id, value) in [(0x334_u16, 1_u32), (0x223, 2), (0x334, 3)] {
        for parameter in [0x8000_0000 | u32::from(cob_id), u32::from(cob_id)] {
            network.write_bytes(node, RPDO_COB_ID, &parameter.to_le_bytes()).unwrap();
        }
        // Identifiers that no longer or never concern the device, followed at once by the one that does.
        for id in [0x205, 0x334, 0x223, 0x606, 0x181, 0x7E5].into_iter().filter(|id| *id != cob_id) {
            network.send(&frame(id, &[0xFF; 4])).unwrap();
        }
        network.send(&frame(cob_id, &value.to_le_bytes())).unwrap();
        assert_eq!(network.read(node, SETPOINT).unwrap(), value);
    }
    // Per pass two downloads, the PDO and an upload: no other frame came through.
    assert_eq!(serving.heard() - before, 1 + 3 * 4, "the NMT command first");
}

#[test]
fn a_shell_that_listens_to_its_own_nodes_hears_no_others() {
    let Some(interface) = Interface::new("lxown") else { return };
    let (own, other) = (NodeId::literal(5), NodeId::literal(6));
    let _serving = Serving::nodes(&[own, other], interface.link());
    let mut stranger = interface.link();
    let mut network = blocking::Network::new(interface.link());
    network.listen_to_own(&[CobId::standard(0x2A7).unwrap()]).unwrap();
    network.read(own, DEVICE_TYPE).unwrap();
    for id in [0x706, 0x186, 0x2A8, 0x2A7, 0x185] {
        stranger.send(&frame(id, &[5])).unwrap();
    }
    let mut heard = Vec::new();
    let until = network.now() + SHORT;
    while let Some(event) = network.next_event(until).unwrap() {
        if let manager::Event::Pdo { frame, .. } = event {
            heard.push(frame.id().raw());
        } else {
            // Frames that came before the filters were set are received.
            assert!(matches!(event, manager::Event::BootedUp { .. }), "{event:?}");
        }
    }
    assert_eq!(heard, [0x2A7, 0x185]);
    // The filter admits a node before it is asked, so that its answer is heard.
    network.read(other, DEVICE_TYPE).unwrap();
}

#[test]
fn a_silent_node_holds_up_nobody_on_the_tokio_shell() {
    let Some(interface) = Interface::new("lxeight") else { return };
    link_support::a_silent_node_holds_up_nobody(interface.link(), interface.link());
}

#[test]
fn a_tokio_shell_goes_on_when_its_interface_is_up_again_and_when_it_is_plugged_in_again() {
    let Some(interface) = Interface::new("lxshell") else { return };
    let node = NodeId::literal(5);
    let _serving = Serving::nodes(&[node], interface.link());
    link_support::run(async {
        let network = Network::spawn(interface.link()).unwrap();
        let mut events = network.events();
        assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
        let down = ["link", "set", interface.0, "down"];
        let delete = ["link", "delete", interface.0];
        for (lose, state) in [(&down[..], BusState::Down), (&delete[..], BusState::Removed)] {
            assert!(ip(lose));
            while events.recv().await.unwrap() != Event::Bus(state) {}
            let error = network.command(NmtCommand::Start, None).await.unwrap_err();
            assert!(matches!(error, LinkError::NoBus(found) if found == state), "{error}");
            assert!(network.read(node, DEVICE_TYPE).await.is_err());
            if state == BusState::Removed {
                std::mem::forget(Interface::new(interface.0).unwrap());
            } else {
                assert!(ip(&["link", "set", interface.0, "up"]));
            }
            while events.recv().await.unwrap() != Event::Bus(BusState::Active) {}
            // The device's own link reconnects at a time of its own; frames before that are lost.
            let mut answer = network.read(node, DEVICE_TYPE).await;
            for _ in 0..5 {
                if answer.is_ok() {
                    break;
                }
                answer = network.read(node, DEVICE_TYPE).await;
            }
            assert_eq!(answer.unwrap(), 0x0002_0192, "after it was {state}");
        }
    });
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
    // The other link notices it when it sends.
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
    let refused = (0..100_000).find_map(|_| link.send(&frame(0x123, &[0; 8])).err()).expect("the line is not read");
    assert!(matches!(refused, LinkError::Full), "{refused}");
    let again = WallClock::now();
    assert!(matches!(link.send(&frame(0x123, &[])), Err(LinkError::Full)));
    assert!(again.elapsed().as_millis() >= 100, "it did not wait");
    assert!(again.elapsed().as_millis() < 1_000 && started.elapsed().as_secs() < 30, "it waited for long");
    hears_nothing(&mut link);
}

#[test]
fn a_queue_that_stays_full_does_not_hold_up_a_tokio_shell() {
    let Some(interface) = SerialInterface::new() else { return };
    let link = SocketCan::open(&interface.name).unwrap();
    link_support::run(async {
        let network = Network::spawn(link).unwrap();
        // The sender gets an error; others may send meanwhile.
        let flood = tokio::spawn({
            let network = network.clone();
            async move {
                loop {
                    if let Err(error) = network.send(frame(0x123, &[0; 8])).await {
                        return error;
                    }
                }
            }
        });
        let mut turns = 0_u32;
        while !flood.is_finished() {
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
            turns += 1;
        }
        let error = flood.await.unwrap();
        assert!(matches!(error, LinkError::Full), "{error}");
        // Only one or two if the frame blocked them; otherwise, the number depends on the kernel's ticks and on the
        // load.
        assert!(turns >= 5, "while the frame waited for 100 ms, others had {turns} turns");
    });
}

/// An interface of the kernel's slcan driver, on a pseudo-terminal that nobody reads: the only interface with a queue
/// that needs no hardware.
struct SerialInterface {
    name: String,
    driver: std::process::Child,
    _terminals: (serialport::TTYPort, serialport::TTYPort),
    /// The kernel assigns the name, so only one test at a time may look for it.
    _alone: MutexGuard<'static, ()>,
}

impl SerialInterface {
    fn new() -> Option<Self> {
        use serialport::SerialPort;
        const N_SLCAN: &str = "17";
        if SocketCan::is_supported().is_err() {
            return skip("no CAN in this kernel");
        }
        static ALONE: Mutex<()> = Mutex::new(());
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let before: Vec<String> = interfaces().into_iter().map(|(_, index)| index).collect();
        let terminals = serialport::TTYPort::pair().unwrap();
        let path = terminals.1.name().unwrap();
        let driver = Command::new("ldattach").args(["--debug", N_SLCAN, &path]).stderr(Stdio::null()).spawn();
        let Ok(driver) = driver else { return skip("no ldattach here") };
        let deadline = WallClock::now() + std::time::Duration::from_secs(5);
        while WallClock::now() < deadline {
            // By index, which the kernel never reuses; the name may be that of an earlier interface.
            let new = |(name, index): &(String, String)| name.starts_with("can") && !before.contains(index);
            if let Some((name, _)) = interfaces().into_iter().find(new) {
                assert!(ip(&["link", "set", &name, "up"]));
                return Some(SerialInterface { name, driver, _terminals: terminals, _alone: alone });
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

/// Name and index of each interface, except for those that disappear meanwhile.
fn interfaces() -> Vec<(String, String)> {
    let entries = std::fs::read_dir("/sys/class/net").unwrap().flatten();
    let index = |path: std::path::PathBuf| std::fs::read_to_string(path.join("ifindex")).ok();
    entries.filter_map(|entry| Some((entry.file_name().into_string().ok()?, index(entry.path())?))).collect()
}

#[test]
fn frames_that_are_not_taken_in_time_are_counted_where_they_are_missing() {
    let Some(interface) = Interface::new("vgap") else { return };
    let (mut sender, mut reader) = (interface.link(), interface.link());
    let mut sent = 0_u32;
    let number = |frame: &Frame| u32::from_le_bytes(frame.data().try_into().unwrap());
    let mut send = |count| {
        for _ in 0..count {
            sender.send(&frame(0x123, &sent.to_le_bytes())).unwrap();
            sent += 1;
        }
    };
    // More than the requested buffers hold.
    send(30_000);
    let (mut heard, mut missing, mut next) = (0, 0, 0);
    let mut drain = |reader: &mut SocketCan| {
        let now = reader.now();
        while let Some(incoming) = reader.receive(now).unwrap() {
            match incoming {
                Incoming::Frame(frame) => {
                    assert_eq!(number(&frame), next, "{missing} are missing");
                    (heard, next) = (heard + 1, next + 1);
                }
                Incoming::Gap(frames) => (missing, next) = (missing + frames, next + frames),
                Incoming::State(state) => panic!("{state}"),
            }
        }
        (heard, missing)
    };
    // Reported although no frame follows the missing ones.
    let (heard, missing) = drain(&mut reader);
    assert_eq!(heard + missing, 30_000);
    assert!(missing > 0, "nothing was dropped");
    send(1);
    assert_eq!(drain(&mut reader), (heard + 1, missing));
}
