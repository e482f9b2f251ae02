//! LSS sessions with devices on a virtual bus.

use lexican_toolbox::lss::{Selected, Session, Target, Times, Trouble};
use simulator::Memory;

use crate::device::samples;
use crate::output::Failure;
use lexican_runtime::host::Link;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss::LssRequest;
use lexican_runtime::wire::lss::{self, Identity, LssResponse, LssState, Part};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage, NmtState};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use crate::bus::testing::Flood;
use lexican_runtime::host::{Fate, Node, VirtualBus, VirtualLink};
use lexican_runtime::service::lss_device::{LssDevice, LssHost, StoreError};
use lexican_simulation::VirtualDevice;

const TIMES: Times = Times { response: Duration::from_millis(500), step: Duration::from_millis(25) };

fn identity(serial: u32) -> Identity {
    Identity { vendor: 0x195, product: 3, revision: 0x1_0000, serial }
}

/// A device with nothing but LSS, for 250 and 500 kbit/s.
struct Bare {
    lss: LssDevice,
    host: Host,
    knows_fastscan: bool,
    /// The delay of its responses.
    slowness: Duration,
    /// Its responses, with the time at which each is due.
    responses: VecDeque<(Instant, Frame)>,
    ready: VecDeque<Frame>,
}

#[derive(Default)]
struct Host {
    stored: Option<Option<NodeId>>,
    cannot_store: bool,
}

impl LssHost for Host {
    fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool {
        table == 0 && (2..=3).contains(&index)
    }
    fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError> {
        self.stored = Some(node);
        if self.cannot_store { Err(StoreError::Failed) } else { Ok(()) }
    }
}

impl Node for Bare {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.knows_fastscan || frame.data().first() != Some(&0x51) {
            self.lss.handle_frame(now, frame, &mut self.host);
            self.responses.extend(self.lss.poll_transmit(now).map(|response| (now + self.slowness, response)));
        }
    }
    fn handle_timeout(&mut self, now: Instant) {
        let due = self.responses.iter().take_while(|(at, _)| *at <= now).count();
        self.ready.extend(self.responses.drain(..due).map(|(_, response)| response));
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.handle_timeout(now);
        self.ready.pop_front()
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.responses.front().map(|(at, _)| *at)
    }
}

/// A bus with devices of these serial numbers and node-IDs; 0 for none.
fn bus(devices: &[(u32, u8)]) -> (VirtualBus, Vec<Arc<Mutex<Bare>>>) {
    let bus = VirtualBus::with_bit_rate(500);
    let bare = |&(serial, node): &(u32, u8)| {
        let lss = LssDevice::new(identity(serial), NodeId::new(node));
        let (host, slowness) = (Host::default(), Duration::ZERO);
        let (responses, ready) = (VecDeque::new(), VecDeque::new());
        Arc::new(Mutex::new(Bare { lss, host, knows_fastscan: true, slowness, responses, ready }))
    };
    let devices: Vec<_> = devices.iter().map(bare).collect();
    for device in &devices {
        bus.attach(Arc::clone(device));
    }
    (bus, devices)
}

fn work<T>(bus: &VirtualBus, work: impl FnOnce(&mut Session<VirtualLink>) -> Result<T, Trouble>) -> Result<T, Failure> {
    Ok(Session::run(bus.link(), TIMES, work)?)
}

#[track_caller]
fn fails<T: std::fmt::Debug>(result: Result<T, Failure>, words: &str, advice: &str) {
    let failure = result.unwrap_err();
    let (said, help) = failure.words();
    assert!(said.contains(words), "{said}");
    assert!(help.unwrap_or_default().contains(advice), "{help:?}");
}

#[test]
fn all_devices_without_node_id_are_found_again_and_again() {
    let (bus, _) = bus(&[(0x8000_0001, 0), (7, 5), (42, 0), (0, 0)]);
    for _ in 0..2 {
        let found = work(&bus, |session| {
            let mut found = Vec::new();
            while let Some(identity) = session.fastscan()? {
                found.push(identity.serial);
            }
            Ok(found)
        });
        assert_eq!(found.unwrap(), [0, 42, 0x8000_0001]);
    }
}

/// A device that still takes part in searches after it was selected.
struct Stubborn {
    identity: Identity,
    /// After that it confirms any number, as CANopenNode does.
    confirms_anything: bool,
    part: Part,
    is_selected: bool,
    answer: Option<LssResponse>,
}

impl Node for Stubborn {
    fn handle_frame(&mut self, _: Instant, frame: &Frame) {
        if frame.id() != lss::REQUEST {
            return;
        }
        match LssRequest::parse(frame.data()) {
            Some(LssRequest::SwitchGlobal(state)) => self.is_selected = state == LssState::Configuration,
            Some(LssRequest::Inquire(part)) if self.is_selected => {
                self.answer = Some(LssResponse::Inquired(part, self.identity.part(part)));
            }
            Some(LssRequest::Fastscan { .. }) if self.is_selected && self.confirms_anything => {
                self.answer = Some(LssResponse::Identified);
            }
            Some(LssRequest::Fastscan { bits_left: 0x80, .. }) => {
                (self.part, self.answer) = (Part::Vendor, Some(LssResponse::Identified));
            }
            Some(LssRequest::Fastscan { value, bits_left, part, next })
                if part == self.part && (value ^ self.identity.part(part)) >> bits_left == 0 =>
            {
                self.answer = Some(LssResponse::Identified);
                if bits_left == 0 {
                    self.part = next;
                    self.is_selected |= next < part;
                }
            }
            _ => {}
        }
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        Some(self.answer.take()?.frame())
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

#[test]
fn devices_that_respond_to_every_search_do_not_hide_others() {
    for (confirms_anything, stubborn_ones, others) in [
        (false, &[5][..], &[][..]),
        (false, &[5], &[0, 7, 0x8000_0000]),
        (false, &[0x1234, 0x1235, u32::MAX], &[0x1236, 0, 9]),
        (false, &[u32::MAX], &[u32::MAX - 1]),
        (true, &[5], &[]),
        (true, &[5], &[0, 7, 0x8000_0000]),
        (true, &[0x1234, 0x1235, u32::MAX], &[0x1236, 0, 9]),
        (true, &[u32::MAX], &[u32::MAX - 1]),
    ] {
        let (bus, _) = bus(&others.iter().map(|serial| (*serial, 0)).collect::<Vec<_>>());
        let another_vendor = Identity { vendor: 7, ..identity(5) };
        let identities = stubborn_ones.iter().map(|serial| identity(*serial)).chain([another_vendor]);
        for identity in identities.clone() {
            let (part, is_selected, answer) = (Part::Vendor, false, None);
            bus.attach(Stubborn { identity, confirms_anything, part, is_selected, answer });
        }
        let mut printed = Vec::new();
        let mut found = work(&bus, |session| {
            let print = |identity| {
                printed.push(identity);
                Ok(true)
            };
            session.find_all(print, |_| {})
        })
        .unwrap();
        assert_eq!(printed, found);
        found.sort_by_key(|identity| (identity.vendor, identity.serial));
        let mut all: Vec<_> = identities.chain(others.iter().map(|serial| identity(*serial))).collect();
        all.sort_by_key(|identity| (identity.vendor, identity.serial));
        assert_eq!(found, all);
    }
}

#[test]
fn a_node_id_is_activated_by_a_reset() {
    let sheet = samples::sensor();
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(VirtualDevice::power_on(bus.now(), NodeId::literal(9), &sheet));
    bus.advance(Duration::from_millis(10));
    let booted = work(&bus, |session| {
        let selected = session.select(Target::Only)?;
        assert_eq!(session.configure_node(NodeId::new(10))?, Ok(()));
        session.activate_node(selected.node.unwrap(), NodeId::new(10))
    });
    assert!(booted.unwrap());
    assert!(work(&bus, |session| session.is_taken(NodeId::literal(10))).unwrap());
    assert!(!work(&bus, |session| session.is_taken(NodeId::literal(9))).unwrap());
}

#[test]
fn a_device_that_was_left_selected_is_found() {
    let (bus, devices) = bus(&[(42, 0)]);
    let switch = LssRequest::SwitchGlobal(LssState::Configuration).frame();
    bus.link().send(&switch).unwrap();
    bus.advance(Duration::from_millis(1));
    assert_eq!(devices[0].lock().unwrap().lss.state(), LssState::Configuration);
    assert_eq!(work(&bus, Session::fastscan).unwrap(), Some(identity(42)));
}

#[test]
fn a_lost_response_of_a_scan_has_advice() {
    let (bus, _) = bus(&[(42, 0)]);
    let mut answers = 0;
    bus.set_fate(move |_, frame| {
        answers += u32::from(frame.id() == lss::RESPONSE);
        if frame.id() == lss::RESPONSE && answers == 20 { Fate::Lose } else { Fate::Deliver }
    });
    fails(work(&bus, Session::fastscan), "which no device confirms", "--step 100ms");
}

#[test]
fn a_device_is_found_though_it_responds_later_than_a_step_lasts() {
    for known in [&[][..], &[identity(5)]] {
        let (bus, devices) = bus(&[(42, 0)]);
        devices[0].lock().unwrap().slowness = Duration::from_millis(260);
        let found = work(&bus, |session| match known {
            [] => session.fastscan(),
            known => session.fastscan_beside(known),
        });
        assert_eq!(found.unwrap(), Some(identity(42)));
    }
}

#[test]
fn a_device_without_fastscan_is_noticed() {
    let (bus, devices) = bus(&[(42, 0)]);
    assert!(!work(&self::bus(&[(7, 5)]).0, Session::has_unconfigured).unwrap());
    devices[0].lock().unwrap().knows_fastscan = false;
    assert!(work(&bus, Session::has_unconfigured).unwrap());
    fails(work(&bus, |session| session.select(Target::Unconfigured)), "searched for", "--vendor");
    let (bus, _) = self::bus(&[(7, 5)]);
    fails(work(&bus, |session| session.select(Target::Unconfigured)), "without node-ID", "lexican scan");
}

#[test]
fn the_only_device_needs_no_identity() {
    let select = |devices: &[(u32, u8)]| work(&bus(devices).0, |session| session.select(Target::Only));
    assert_eq!(select(&[(42, 5)]).unwrap(), Selected { identity: identity(42), node: NodeId::new(5) });
    assert_eq!(select(&[(42, 0)]).unwrap().node, None);
    fails(select(&[]), "no device answers to LSS", "lexican nmt stop --all");
    fails(select(&[(42, 5), (43, 0)]), "more than one device", "--vendor");
    fails(select(&[(42, 5), (42, 5)]), "more than one device", "--vendor");
}

#[test]
fn a_device_is_selected_by_its_identity() {
    let (bus, devices) = bus(&[(42, 5), (43, 6), (44, 0)]);
    let by_serial = |serial| work(&bus, |session| session.select(Target::Identity(identity(serial))));
    assert_eq!(by_serial(43).unwrap(), Selected { identity: identity(43), node: NodeId::new(6) });
    assert_eq!(devices[1].lock().unwrap().lss.state(), LssState::Waiting, "at the end");
    fails(by_serial(45), "no device with this identity", "1018h");
    let given_up = work(&bus, |session| {
        session.select(Target::Identity(identity(43)))?;
        Err::<(), _>(Trouble::Several)
    });
    fails(given_up, "more than one device", "--vendor");
    bus.advance(Duration::from_millis(1));
    assert_eq!(devices[1].lock().unwrap().lss.state(), LssState::Waiting, "also after a failure");
}

#[test]
fn a_device_boots_with_its_node_id() {
    let sheet = samples::sensor();
    let bus = VirtualBus::with_bit_rate(500);
    let (now, memory) = (bus.now(), Memory::default());
    bus.attach(VirtualDevice::power_on(now, NodeId::literal(9), &sheet));
    bus.attach(VirtualDevice::with_memory(now, None, Arc::new(sheet), memory));
    let taken_and_booted = work(&bus, |session| {
        session.select(Target::Unconfigured)?;
        let taken = [session.is_taken(NodeId::literal(9))?, session.is_taken(NodeId::literal(10))?];
        assert_eq!(session.configure_node(NodeId::new(10))?, Ok(()));
        Ok((taken, session.boot(NodeId::literal(10))?))
    });
    assert_eq!(taken_and_booted.unwrap(), ([true, false], true));
    assert!(work(&bus, |session| session.is_taken(NodeId::literal(10))).unwrap());
}

#[test]
fn a_node_id_is_given_and_stored() {
    let (bus, devices) = bus(&[(42, 0), (43, 6)]);
    let boots = work(&bus, |session| {
        session.select(Target::Unconfigured)?;
        assert_eq!(session.configure_node(NodeId::new(9))?, Ok(()));
        assert_eq!(session.store()?, Ok(()));
        session.boot(NodeId::literal(9))
    });
    // This device sends no boot-up message.
    assert!(!boots.unwrap());
    assert_eq!(devices[0].lock().unwrap().host.stored, Some(NodeId::new(9)));
    assert_eq!(devices[1].lock().unwrap().host.stored, None);
}

#[test]
fn a_device_that_waits_for_a_reset_gets_it() {
    /// A device that uses its new node-ID, 9, only after its communication is reset.
    struct Waiting(Arc<Mutex<Bare>>, Option<Frame>);
    impl Node for Waiting {
        fn handle_frame(&mut self, _: Instant, frame: &Frame) {
            let lss = &mut self.0.lock().unwrap().lss;
            let (command, node) = (NmtCommand::ResetCommunication, NodeId::literal(9));
            let is_reset = *frame == NmtMessage { command, node: Some(node) }.frame();
            if is_reset && lss.state() == LssState::Waiting && lss.reset() == Some(node) {
                self.1 = Some(ErrorControl::heartbeat(NmtState::Initialising).frame(node));
            }
        }
        fn handle_timeout(&mut self, _: Instant) {}
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            self.1.take()
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }
    for activate in [false, true] {
        let (bus, devices) = bus(&[(42, 0)]);
        bus.attach(Waiting(Arc::clone(&devices[0]), None));
        let booted = work(&bus, |session| {
            let selected = session.select(Target::Unconfigured)?;
            assert_eq!(session.configure_node(NodeId::new(9))?, Ok(()));
            session.take(selected.node, NodeId::new(9), activate)
        });
        assert_eq!(booted.unwrap(), activate);
    }
}

#[test]
fn a_heartbeat_is_no_boot_up_message() {
    /// Another node that already has the node-ID.
    struct Alive(bool);
    impl Node for Alive {
        fn handle_frame(&mut self, _: Instant, _: &Frame) {
            self.0 = true;
        }
        fn handle_timeout(&mut self, _: Instant) {}
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            let beat = ErrorControl::heartbeat(NmtState::Operational).frame(NodeId::literal(9));
            std::mem::take(&mut self.0).then_some(beat)
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }
    let (bus, _) = bus(&[(42, 0)]);
    bus.attach(Alive(false));
    assert!(!work(&bus, |session| session.boot(NodeId::literal(9))).unwrap());
}

#[test]
fn storing_may_take_longer() {
    let (bus, devices) = bus(&[(42, 5)]);
    let stored = work(&bus, |session| {
        session.select(Target::Only)?;
        devices[0].lock().unwrap().slowness = Duration::from_secs(2);
        session.store()
    });
    assert_eq!(stored.unwrap(), Ok(()));
    fails(work(&bus, |session| session.select(Target::Only)), "no device answers", "");
}

#[test]
fn a_refusal_is_returned() {
    let (bus, devices) = bus(&[(42, 5)]);
    devices[0].lock().unwrap().host.cannot_store = true;
    let (rate, stored) = work(&bus, |session| {
        session.select(Target::Only)?;
        Ok((session.configure_bit_rate(0)?, session.store()?))
    })
    .unwrap();
    assert_eq!(rate, Err(LssResponse::ConfigureBitTiming { error: 1, specific: 0 }));
    assert_eq!(stored, Err(LssResponse::Store { error: 2, specific: 0 }));
}

#[test]
fn one_device_that_refuses_counts_for_all() {
    let (bus, devices) = bus(&[(42, 5), (43, 6), (44, 7)]);
    let all = || {
        work(&bus, |session| {
            session.select_all()?;
            Ok((session.configure_bit_rate(3)?, session.store()?))
        })
    };
    assert_eq!(all().unwrap(), (Ok(()), Ok(())));
    devices[1].lock().unwrap().host.cannot_store = true;
    assert_eq!(all().unwrap(), (Ok(()), Err(LssResponse::Store { error: 2, specific: 0 })));
}

#[test]
fn a_bus_at_another_bit_rate_is_left_alone() {
    let (bus, _) = bus(&[(42, 5)]);
    let heard = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&heard);
    bus.observe(move |at, frame| log.lock().unwrap().push((at, *frame)));
    work(&bus, |session| {
        session.select_all()?;
        session.activate(1000)
    })
    .unwrap();
    let heard = heard.lock().unwrap();
    let (at, last) = heard.last().unwrap();
    assert_eq!(last.to_string(), "7E5#15E8030000000000");
    assert!(bus.now().since(*at) >= Duration::from_secs(2));
}

#[test]
fn other_frames_do_not_hold_up_time_outs() {
    let flooded = Session::run(Flood::of_heartbeats(), TIMES, |session| -> Result<_, Failure> {
        assert_eq!(session.fastscan()?, None);
        Ok(session.select(Target::Only)?)
    });
    fails(flooded, "no device answers", "power");
}
