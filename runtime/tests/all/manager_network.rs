//! Booting a network: identity, configuration, mandatory and optional nodes, and lost nodes.

use crate::common::testing::TestOd;
use crate::common::{self, FULL};
use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::manager::{Assignment, Guarding, Network, NetworkEvent, OnLoss, Startup};
use lexican_runtime::procedure::{BootError, BootPlan};
use lexican_runtime::service::sdo_client::{SdoClient, SdoError};
use lexican_runtime::wire::lss::Part;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Duration, Frame, Instant, NodeId};

const FIVE: NodeId = NodeId::literal(5);
const SIX: NodeId = NodeId::literal(6);

/// 1017h = 100 ms, as a concise DCF.
const HEARTBEAT: &[u8] = &[1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 100, 0];

struct Node {
    device: Device<3, 3, 1, 1>,
    od: TestOd,
    connected: bool,
}

struct Bus<'a> {
    network: Network<&'a [u8], 4>,
    nodes: Vec<Node>,
    now: Instant,
    events: Vec<NetworkEvent>,
    log: Vec<String>,
    /// The number of the frame to lose, and the number of frames so far.
    lose: Option<usize>,
    frames: usize,
    /// Frames to the nodes that begin like this are lost.
    lose_all: &'static str,
}

fn dictionary(node: NodeId) -> TestOd {
    let od = TestOd::new(FULL).with("1020:01 u32 rw - 0\n1020:02 u32 rw - 0\n1018:02 u32 ro - 7\n1018:03 u32 ro - 3");
    if node == FIVE { od } else { od.without(0x1200).without(0x1800).without(0x1802) }
}

fn assignment(node: NodeId, mandatory: bool, plan: BootPlan<&[u8]>) -> Assignment<&[u8]> {
    Assignment {
        client: SdoClient::of_node(node),
        mandatory,
        boots_again: true,
        heartbeat: Duration::from_millis(250),
        guarding: None,
        plan,
    }
}

fn started<'a>() -> BootPlan<&'a [u8]> {
    BootPlan { device_type: Some(0x192), configuration: HEARTBEAT, start: true, ..BootPlan::default() }
}

impl<'a> Bus<'a> {
    fn new(on_loss: OnLoss, members: &[(NodeId, bool, BootPlan<&'a [u8]>)]) -> Self {
        let mut bus = Bus {
            network: Network::new(on_loss),
            nodes: Vec::new(),
            now: Instant::ZERO,
            events: Vec::new(),
            log: Vec::new(),
            lose: None,
            frames: 0,
            lose_all: "nothing",
        };
        for &(node, mandatory, plan) in members {
            bus.assign(assignment(node, mandatory, plan), node);
        }
        bus.pass_ms(0);
        bus
    }

    /// A network that has started, with two mandatory nodes.
    fn up(on_loss: OnLoss) -> Self {
        let mut bus = Bus::new(on_loss, &[(FIVE, true, started()), (SIX, true, started())]);
        bus.start();
        bus.pass_ms(1000);
        (bus.events, bus.log) = (Vec::new(), Vec::new());
        bus
    }

    fn assign(&mut self, assignment: Assignment<&'a [u8]>, node: NodeId) {
        self.network.assign(node, assignment).unwrap();
        self.nodes.push(Node { device: Device::new(node, Behaviour::CIA_301), od: TestOd::default(), connected: true });
        self.reboot(self.nodes.len() - 1);
    }

    /// Switches a node off and on.
    fn reboot(&mut self, at: usize) {
        let node = &mut self.nodes[at];
        node.od = dictionary(node.device.node());
        node.device.restart(self.now, &mut node.od);
    }

    fn start(&mut self) {
        self.network.start(self.now, Duration::from_secs(5));
    }

    fn deliver(&mut self, frame: &Frame) {
        let text = frame.to_string();
        let is_lost = text.starts_with(self.lose_all);
        self.log.push(text);
        if self.is_lost() || is_lost {
            return;
        }
        for node in self.nodes.iter_mut().filter(|node| node.connected) {
            if let Some(Event::Reset(_)) = node.device.handle_frame(self.now, frame, &mut node.od) {
                node.od = dictionary(node.device.node());
                node.device.restart(self.now, &mut node.od);
            }
        }
    }

    fn is_lost(&mut self) -> bool {
        self.frames += 1;
        self.lose == Some(self.frames - 1)
    }

    fn settle(&mut self) {
        loop {
            let mut quiet = true;
            while let Some(frame) = self.network.poll_transmit(self.now) {
                quiet = false;
                self.deliver(&frame);
            }
            for at in 0..self.nodes.len() {
                let node = &mut self.nodes[at];
                while let Some(frame) = node.device.poll_transmit(self.now, &mut node.od) {
                    quiet = false;
                    self.frames += 1;
                    if node.connected && self.lose != Some(self.frames - 1) {
                        self.events.extend(self.network.handle_frame(self.now, &frame));
                    }
                }
            }
            if quiet {
                return;
            }
        }
    }

    fn pass_ms(&mut self, ms: u64) {
        let end = self.now + Duration::from_millis(ms);
        loop {
            self.settle();
            let devices = self.nodes.iter().filter_map(|node| node.device.poll_timeout());
            let due = devices.chain(self.network.poll_timeout()).min();
            let Some(due) = due.filter(|&due| due <= end) else { break };
            self.now = due.max(self.now);
            if self.network.poll_timeout().is_some_and(|due| due <= self.now) {
                self.events.extend(self.network.handle_timeout(self.now));
            }
            for node in &mut self.nodes {
                if node.device.poll_timeout().is_some_and(|due| due <= self.now) {
                    node.device.handle_timeout(self.now, &mut node.od);
                }
            }
        }
        self.now = end;
    }

    fn take_events(&mut self) -> Vec<NetworkEvent> {
        std::mem::take(&mut self.events)
    }

    fn states(&self) -> Vec<NmtState> {
        self.nodes.iter().map(|node| node.device.nmt_state()).collect()
    }
}

#[test]
fn a_network_boots_is_configured_and_started() {
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, started()), (SIX, false, started())]);
    bus.start();
    bus.pass_ms(200);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Booted(SIX), NetworkEvent::Ready]);
    assert_eq!(bus.states(), [NmtState::Operational; 2]);
    assert_eq!(bus.nodes[1].od.get(0x1017, 0), 100);
    assert_eq!(bus.log[0], "000#8200");
}

#[test]
fn a_node_that_is_not_the_expected_one_is_not_started() {
    let with = |change: fn(&mut BootPlan<&'static [u8]>)| {
        let mut plan = started();
        change(&mut plan);
        plan
    };
    let cases: [(BootPlan<&[u8]>, BootError); 4] = [
        (with(|plan| plan.device_type = Some(0x191)), BootError::DeviceType { expected: 0x191, got: 0x192 }),
        (with(|plan| plan.vendor = Some(1)), BootError::Identity { part: Part::Vendor, expected: 1, got: 0x195 }),
        (with(|plan| plan.product = Some(8)), BootError::Identity { part: Part::Product, expected: 8, got: 7 }),
        (
            with(|plan| plan.serial = Some(1)),
            BootError::NoIdentity(SdoError::Aborted {
                address: lexican_runtime::object::Address::new(0x1018, 4),
                code: AbortCode::NO_SUCH_SUB_INDEX,
            }),
        ),
    ];
    for (plan, error) in cases {
        let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan)]);
        bus.start();
        bus.pass_ms(10);
        assert_eq!(bus.take_events(), [NetworkEvent::Failed { node: FIVE, mandatory: true, error }]);
        assert_eq!(bus.states(), [NmtState::PreOperational]);
        bus.pass_ms(10_000);
        assert_eq!(bus.take_events(), [NetworkEvent::BootTimeElapsed]);
    }
}

#[test]
fn a_configuration_that_fails_names_its_entry() {
    let dcf = [&[2, 0, 0, 0], &HEARTBEAT[4..], &[0x00, 0x10, 0, 1, 0, 0, 0, 1]].concat();
    let plan = BootPlan { configuration: &dcf[..], ..started() };
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan)]);
    bus.start();
    bus.pass_ms(10);
    let [NetworkEvent::Failed { error, .. }] = bus.take_events()[..] else { panic!() };
    assert_eq!(
        error.to_string(),
        "entry 2 of the configuration failed: 1000:00: the device aborts: 0601 0002: attempt to write a read only object"
    );
    let cut = BootPlan { configuration: &dcf[..20], ..started() };
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, cut)]);
    bus.start();
    bus.pass_ms(10);
    let [NetworkEvent::Failed { error, .. }] = bus.take_events()[..] else { panic!() };
    assert!(matches!(error, BootError::BadConfiguration(_)));
    assert_eq!(bus.nodes[0].od.get(0x1017, 0), 0, "nothing of it was written");
}

#[test]
fn a_node_that_has_its_configuration_already_is_not_configured_again() {
    // The configuration has its own date and time.
    let date = [0x20, 0x10, 1, 4, 0, 0, 0, 9, 0, 0, 0];
    let time = [0x20, 0x10, 2, 4, 0, 0, 0, 8, 0, 0, 0];
    let dcf = [&[3, 0, 0, 0], &HEARTBEAT[4..], &date[..], &time[..]].concat();
    let plan = BootPlan { configured: Some((9, 8)), configuration: &dcf[..], ..started() };
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan)]);
    let writes = |bus: &mut Bus<'_>| {
        bus.log.clear();
        bus.network.start(bus.now, Duration::ZERO);
        // The device has stored its values, so they survive the reset.
        let kept = bus.nodes[0].od.clone();
        let reset = bus.network.poll_transmit(bus.now).unwrap();
        bus.deliver(&reset);
        let node = &mut bus.nodes[0];
        (node.od, _) = (kept.clone(), node.device.restart(bus.now, &mut kept.clone()));
        bus.pass_ms(200);
        bus.log.iter().filter(|frame| frame.contains("#2")).count()
    };
    assert_eq!(writes(&mut bus), 3);
    assert_eq!(writes(&mut bus), 0);
    assert!(bus.network.has_booted(FIVE));
}

#[test]
fn error_control_must_start_before_the_node_does() {
    let plan = BootPlan { error_control: Duration::from_millis(500), ..started() };
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan)]);
    bus.start();
    bus.pass_ms(200);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);

    let silent = BootPlan { configuration: &[][..], ..plan };
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, silent)]);
    bus.start();
    bus.pass_ms(1000);
    let error = BootError::NoErrorControl(Duration::from_millis(500));
    assert_eq!(bus.take_events(), [NetworkEvent::Failed { node: FIVE, mandatory: true, error }]);
}

#[test]
fn an_optional_node_may_be_missing_and_come_later() {
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, started()), (SIX, false, started())]);
    bus.nodes[1].connected = false;
    bus.start();
    bus.pass_ms(4500);
    let events = bus.take_events();
    assert_eq!(events[..2], [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
    assert!(
        matches!(events[2], NetworkEvent::Failed { node: SIX, mandatory: false, error: BootError::NoDeviceType(_) }),
        "{events:?}"
    );
    bus.nodes[1].connected = true;
    bus.reboot(1);
    bus.pass_ms(200);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(SIX)]);
    assert_eq!(bus.states(), [NmtState::Operational; 2]);
}

/// Node 5 is unplugged while the network runs.
fn unplugged(on_loss: OnLoss) -> Bus<'static> {
    let mut bus = Bus::up(on_loss);
    bus.nodes[0].connected = false;
    bus.pass_ms(500);
    assert_eq!(bus.take_events()[0], NetworkEvent::Lost { node: FIVE, mandatory: true });
    bus
}

#[test]
fn a_lost_node_is_reset_and_booted_again_when_it_is_back() {
    let mut bus = unplugged(OnLoss::ResetNode);
    assert_eq!(bus.log[0], "000#8105");
    assert_eq!(bus.states()[1], NmtState::Operational);
    bus.pass_ms(3000);
    bus.take_events();
    // The node did not notice it, and still sends its heartbeat.
    bus.nodes[0].connected = true;
    bus.pass_ms(1000);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
    assert_eq!(bus.states(), [NmtState::Operational; 2]);
}

#[test]
fn the_loss_of_a_mandatory_node_resets_or_stops_all_when_it_shall() {
    let bus = unplugged(OnLoss::ResetAll);
    assert_eq!(bus.log[0], "000#8200");
    let bus = unplugged(OnLoss::StopAll);
    assert_eq!(bus.log[0], "000#0200");
    assert_eq!(bus.states()[1], NmtState::Stopped);
}

#[test]
fn a_node_that_resets_itself_is_booted_again() {
    let mut bus = Bus::up(OnLoss::ResetNode);
    bus.reboot(0);
    bus.pass_ms(100);
    assert_eq!(
        bus.take_events(),
        [NetworkEvent::Lost { node: FIVE, mandatory: true }, NetworkEvent::Booted(FIVE), NetworkEvent::Ready]
    );
}

#[test]
fn whichever_frame_gets_lost_the_network_boots_in_the_end() {
    let identity = BootPlan { vendor: Some(0x195), product: Some(7), ..started() };
    let plan = BootPlan { configured: Some((1, 1)), error_control: Duration::from_secs(1), ..identity };
    for lost in 0..40 {
        let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan), (SIX, true, plan)]);
        (bus.frames, bus.lose) = (0, Some(lost));
        bus.network.start(bus.now, Duration::ZERO);
        bus.pass_ms(20_000);
        assert!(bus.frames > 40, "there is a frame {lost}");
        assert!(bus.network.is_ready(), "{lost}: {:?}", bus.take_events());
        assert_eq!(bus.states(), [NmtState::Operational; 2], "{lost}");
        assert!(bus.take_events().contains(&NetworkEvent::Ready));
    }
}

#[test]
fn a_later_revision_boots_where_it_is_as_good() {
    for (revision, or_later, boots) in [(2, false, false), (2, true, true), (3, false, true), (4, true, false)] {
        let plan = BootPlan { revision: Some(revision), or_later, ..started() };
        let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan)]);
        bus.network.start(bus.now, Duration::ZERO);
        bus.pass_ms(1_000);
        assert_eq!(bus.network.is_ready(), boots, "{revision} {or_later}: {:?}", bus.take_events());
    }
}

#[test]
fn the_network_is_what_the_manager_s_dictionary_says() {
    let mut od = TestOd::new(
        "1016:00 u8  const - 1
         1016:01 u32 rw - 0x000500FA
         1F26:05 u32 rw - 9
         1F27:05 u32 rw - 8
         1F80:00 u32 rw - 0x11
         1F81:05 u32 rw - 0x1D
         1F81:06 u32 rw - 0x01
         1F81:07 u32 rw - 0x08
         1F84:05 u32 rw - 0x192
         1F84:06 u32 rw - 0
         1F85:05 u32 rw - 0x195",
    );
    let mut load = |node| Assignment::load(node, SdoClient::of_node(node), HEARTBEAT, &mut od);
    let five = load(FIVE).unwrap();
    assert_eq!((five.boots_again, five.plan.keep_alive), (true, true));
    assert_eq!((five.mandatory, five.heartbeat), (true, Duration::from_millis(250)));
    assert_eq!((five.plan.device_type, five.plan.vendor, five.plan.product), (Some(0x192), Some(0x195), None));
    assert_eq!((five.plan.configured, five.plan.start), (Some((9, 8)), true));
    let six = load(SIX).unwrap();
    assert_eq!((six.boots_again, six.plan.keep_alive), (false, false));
    assert_eq!((six.mandatory, six.heartbeat, six.plan.device_type), (false, Duration::ZERO, None));
    assert!(load(NodeId::literal(7)).is_none(), "it is not a member");
    assert_eq!(OnLoss::from_startup(od.get(0x1F80, 0) as u32), OnLoss::ResetAll);
}

/// A network that has started, whose node 5 reboots by itself.
fn rebooted(on_loss: OnLoss) -> Bus<'static> {
    let mut bus = Bus::up(on_loss);
    bus.reboot(0);
    bus.pass_ms(500);
    assert_eq!(bus.take_events()[0], NetworkEvent::Lost { node: FIVE, mandatory: true });
    bus
}

#[test]
fn a_mandatory_node_that_boots_by_itself_resets_or_stops_all_when_it_shall() {
    let bus = rebooted(OnLoss::ResetAll);
    assert_eq!(bus.log[0], "000#8200");
    assert_eq!(bus.log.iter().filter(|frame| *frame == "000#8200").count(), 1, "the boot-up that follows is no loss");
    assert_eq!(bus.states(), [NmtState::Operational; 2]);
    let bus = rebooted(OnLoss::StopAll);
    assert_eq!(bus.log, ["000#0200"]);
    assert_eq!(bus.states(), [NmtState::Stopped; 2]);
    let bus = rebooted(OnLoss::ResetNode);
    assert!(!bus.log.contains(&"000#8105".into()), "it was reset already");
}

#[test]
fn a_node_that_returns_to_a_stopped_network_is_stopped_too() {
    for reboots in [false, true] {
        let mut bus = unplugged(OnLoss::StopAll);
        bus.log.clear();
        bus.nodes[0].connected = true;
        if reboots {
            bus.reboot(0);
        }
        bus.pass_ms(2000);
        assert_eq!((&bus.log[..], bus.states()), (&["000#0205".into()][..], vec![NmtState::Stopped; 2]));
        assert_eq!(bus.take_events(), [], "no other node is lost meanwhile");
        bus.start();
        bus.pass_ms(500);
        assert_eq!(bus.states(), [NmtState::Operational; 2], "until the next start");
    }
}

#[test]
fn nodes_may_boot_more_slowly_than_their_heartbeat_when_all_are_reset() {
    let at = |ms| Instant::ZERO + Duration::from_millis(ms);
    let mut network: Network<&[u8], 4> = Network::new(OnLoss::ResetAll);
    for node in [FIVE, SIX] {
        network.assign(node, assignment(node, true, started())).unwrap();
    }
    network.start(at(0), Duration::ZERO);
    assert_eq!(network.poll_transmit(at(0)).unwrap().to_string(), "000#8200");
    network.handle_frame(at(10), &common::frame("705#7F"));
    network.handle_frame(at(200), &common::frame("706#7F"));
    let (mut resets, mut lost) = (Vec::new(), Vec::new());
    for ms in 200..1200 {
        while network.poll_timeout().is_some_and(|due| due <= at(ms)) {
            if let Some(NetworkEvent::Lost { node, .. }) = network.handle_timeout(at(ms)) {
                lost.push((ms, node));
                // It comes before the reset is sent.
                network.handle_frame(at(ms), &common::frame("706#7F"));
            }
        }
        while let Some(frame) = network.poll_transmit(at(ms)) {
            if frame.to_string() == "000#8200" {
                resets.push(ms);
            }
        }
    }
    assert_eq!((resets, lost), (vec![260], vec![(260, FIVE)]));
}

#[test]
fn the_network_starts_as_1f80h_says() {
    let startup = Startup::from_parameter(0b0100_0011);
    assert!(startup.is_manager && startup.start_all && startup.enters_operational);
    assert_eq!(startup.on_loss, OnLoss::StopAll);
    assert_eq!(Startup::from_parameter(0b0001_0100), Startup { on_loss: OnLoss::ResetAll, ..Startup::default() });
}

/// Node 5 is kept alive, node 6 is not; both are in `state` when the network starts.
fn kept_alive(state: NmtState, heartbeat_ms: u16, error_control: Duration) -> Bus<'static> {
    let plan = BootPlan { error_control, ..started() };
    let mut bus = Bus::new(
        OnLoss::ResetNode,
        &[
            (FIVE, true, BootPlan { keep_alive: true, ..plan }),
            (SIX, true, BootPlan { error_control: Duration::ZERO, ..plan }),
        ],
    );
    for node in &mut bus.nodes {
        node.od.set(0x1017, 0, heartbeat_ms.into());
        node.device.restart(bus.now, &mut node.od);
    }
    bus.pass_ms(0);
    for node in &mut bus.nodes {
        node.device.enter(bus.now, state);
    }
    if heartbeat_ms == 0 {
        // No heartbeat is expected, so the node is asked for its state.
        let plan = BootPlan { keep_alive: true, error_control, ..started() };
        let silent = Assignment { heartbeat: Duration::ZERO, ..assignment(FIVE, true, plan) };
        bus.network.assign(FIVE, silent).unwrap();
    }
    (bus.events, bus.log) = (Vec::new(), Vec::new());
    bus.start();
    bus.pass_ms(1000);
    bus
}

#[test]
fn a_node_that_is_operational_and_kept_alive_is_not_reset() {
    for (heartbeat_ms, error_control) in [(100, Duration::from_millis(250)), (0, Duration::ZERO)] {
        let mut bus = kept_alive(NmtState::Operational, heartbeat_ms, error_control);
        let commands: Vec<&String> = bus.log.iter().filter(|frame| frame.starts_with("000#")).collect();
        assert_eq!(commands, ["000#8206", "000#0106"], "neither reset nor started");
        assert_eq!(bus.nodes[0].od.get(0x1017, 0), u64::from(heartbeat_ms), "nor configured");
        assert!(bus.take_events().contains(&NetworkEvent::Ready));
        assert_eq!(bus.states(), [NmtState::Operational; 2]);
    }
}

#[test]
fn a_node_that_is_kept_alive_but_not_operational_is_reset_and_booted() {
    for heartbeat_ms in [100, 0] {
        let mut bus = kept_alive(NmtState::Stopped, heartbeat_ms, Duration::from_millis(250));
        // In STOPPED, a node does not answer SDO, so its boot fails like that of any silent node.
        assert!(!bus.take_events().contains(&NetworkEvent::Ready));
        let mut bus = kept_alive(NmtState::PreOperational, heartbeat_ms, Duration::from_millis(250));
        assert_eq!(bus.log.iter().filter(|frame| *frame == "000#8205").count(), 1);
        assert!(bus.take_events().contains(&NetworkEvent::Ready));
        assert_eq!((bus.states(), bus.nodes[0].od.get(0x1017, 0)), (vec![NmtState::Operational; 2], 100));
    }
}

#[test]
fn all_nodes_are_started_at_once_when_that_is_wanted_and_later_ones_then() {
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, started()), (SIX, true, started())]);
    bus.network = bus.network.with_start_of_all(true);
    bus.start();
    bus.pass_ms(500);
    let starts =
        |bus: &Bus<'_>| bus.log.iter().filter(|frame| frame.starts_with("000#01")).cloned().collect::<Vec<_>>();
    assert_eq!((starts(&bus), bus.states()), (vec!["000#0100".into()], vec![NmtState::Operational; 2]));
    // An optional node is still missing: the others are started one by one, and this one when it comes.
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, started()), (SIX, false, started())]);
    bus.network = bus.network.with_start_of_all(true);
    bus.nodes[1].connected = false;
    bus.start();
    bus.pass_ms(5000);
    assert_eq!(starts(&bus), ["000#0105"]);
    bus.nodes[1].connected = true;
    bus.reboot(1);
    bus.pass_ms(100);
    assert_eq!(
        (starts(&bus), bus.states()),
        (vec!["000#0105".into(), "000#0106".into()], vec![NmtState::Operational; 2])
    );
}

#[test]
fn a_node_that_is_not_to_be_booted_without_asking_waits() {
    let mut bus = Bus::new(OnLoss::ResetNode, &[]);
    let asked = Assignment { boots_again: false, ..assignment(FIVE, true, started()) };
    bus.assign(asked, FIVE);
    bus.take_events();
    bus.start();
    bus.pass_ms(1000);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
    bus.log.clear();
    // The node is lost, and comes back without having noticed.
    bus.nodes[0].connected = false;
    bus.pass_ms(500);
    bus.nodes[0].connected = true;
    bus.pass_ms(500);
    assert_eq!((bus.take_events(), bus.log.len()), (vec![NetworkEvent::Lost { node: FIVE, mandatory: true }], 0));
    bus.reboot(0);
    bus.pass_ms(500);
    assert_eq!((bus.take_events(), bus.log.len()), (vec![NetworkEvent::BootedUp(FIVE)], 0));
    bus.network.boot(FIVE);
    bus.pass_ms(500);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
    assert_eq!(bus.states(), [NmtState::Operational]);
}

const STARTED_IN_VAIN: BootError = BootError::NotStarted { state: NmtState::PreOperational, starts: 3 };

fn starts(bus: &Bus<'_>) -> usize {
    bus.log.iter().filter(|frame| frame.starts_with("000#01")).count()
}

/// Node 5 is mandatory, and receives no frames that begin with `to`; node 6 is optional. They have 10 s.
fn deaf(to: &'static str, plan: BootPlan<&'static [u8]>, start_all: bool) -> Bus<'static> {
    let heard = BootPlan { configuration: HEARTBEAT, ..plan };
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, plan), (SIX, false, heard)]);
    bus.network = bus.network.with_start_of_all(start_all);
    bus.lose_all = to;
    bus.start();
    bus.pass_ms(10_000);
    bus
}

#[test]
fn a_node_has_booted_when_it_reports_operational_and_not_before() {
    let watched = BootPlan { error_control: Duration::from_millis(250), ..started() };
    let quiet = BootPlan { configuration: &[][..], ..started() };
    for plan in [started(), watched, quiet] {
        let mut bus = deaf("000#0105", plan, false);
        let failed = NetworkEvent::Failed { node: FIVE, mandatory: true, error: STARTED_IN_VAIN };
        assert_eq!(bus.take_events(), [NetworkEvent::Booted(SIX), failed, NetworkEvent::BootTimeElapsed]);
        assert_eq!((starts(&bus), bus.network.is_ready()), (4, false), "one for node 6, three for node 5");
        assert_eq!(bus.states(), [NmtState::PreOperational, NmtState::Operational]);
        // The node is tried again when it reboots.
        bus.lose_all = "nothing";
        bus.reboot(0);
        bus.pass_ms(500);
        assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
    }
    assert_eq!(STARTED_IN_VAIN.to_string(), "the node is PRE-OPERATIONAL after 3 commands to start");
}

#[test]
fn a_node_that_does_not_report_its_state_has_not_booted() {
    // The node has no heartbeat, and the request for its state does not reach it.
    let mut bus = deaf("705#R", BootPlan { configuration: &[][..], ..started() }, false);
    let failed = NetworkEvent::Failed { node: FIVE, mandatory: true, error: BootError::NoState };
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(SIX), failed, NetworkEvent::BootTimeElapsed]);
}

#[test]
fn nodes_that_are_started_at_once_have_booted_when_they_report_it() {
    // The first command to all nodes is lost: each is then commanded by itself.
    let mut bus = deaf("000#0100", started(), true);
    let ready = [NetworkEvent::Booted(FIVE), NetworkEvent::Booted(SIX), NetworkEvent::Ready];
    assert_eq!((bus.take_events(), starts(&bus)), (ready.to_vec(), 3));
    let mut bus = deaf("000#01", started(), true);
    let failed = |node, mandatory| NetworkEvent::Failed { node, mandatory, error: STARTED_IN_VAIN };
    assert_eq!(bus.take_events(), [failed(FIVE, true), failed(SIX, false), NetworkEvent::BootTimeElapsed]);
}

#[test]
fn a_node_that_leaves_operational_is_reported() {
    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, started())]);
    bus.start();
    bus.pass_ms(500);
    bus.take_events();
    bus.nodes[0].device.enter(bus.now, NmtState::PreOperational);
    bus.pass_ms(500);
    let state = NmtState::PreOperational;
    assert_eq!(bus.take_events(), [NetworkEvent::StateChanged { node: FIVE, state }]);
    assert_eq!(starts(&bus), 1, "it is not started again");
}

#[test]
fn a_guarded_node_is_asked_and_lost_when_it_does_not_answer() {
    let mut od = TestOd::new("1F81:05 u32 rw - 0x0064030D\n1016:00 u8 const - 0");
    let five = Assignment::load(FIVE, SdoClient::of_node(FIVE), &[][..], &mut od).unwrap();
    let guarding = Guarding { guard_time: Duration::from_millis(100), retry_factor: 3 };
    assert_eq!((five.guarding, five.plan.error_control), (Some(guarding), Duration::from_millis(300)));

    let mut bus = Bus::new(OnLoss::ResetNode, &[(FIVE, true, started())]);
    bus.network.assign(FIVE, five).unwrap();
    bus.start();
    bus.pass_ms(1_000);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
    let asked = bus.log.iter().filter(|frame| *frame == "705#R1").count();
    assert_eq!(asked, 11, "at the end of its configuration, and every 100 ms");
    bus.nodes[0].connected = false;
    bus.pass_ms(500);
    assert_eq!(bus.take_events(), [NetworkEvent::Lost { node: FIVE, mandatory: true }]);
    bus.pass_ms(5_000);
    bus.take_events();
    bus.nodes[0].connected = true;
    bus.reboot(0);
    bus.pass_ms(1_000);
    assert_eq!(bus.take_events(), [NetworkEvent::Booted(FIVE), NetworkEvent::Ready]);
}

impl Bus<'_> {
    /// Node 5 sends this frame every millisecond, whatever it is asked.
    fn storm(&mut self, ms: u64, frame: &str) {
        self.nodes[0].connected = false;
        for _ in 0..ms {
            self.events.extend(self.network.handle_frame(self.now, &common::frame(frame)));
            self.pass_ms(1);
        }
    }

    fn sent(&self, frame: &str) -> usize {
        self.log.iter().filter(|sent| sent.starts_with(frame)).count()
    }
}

const LOST: NetworkEvent = NetworkEvent::Lost { node: FIVE, mandatory: true };
const BOOTED: [NetworkEvent; 2] = [NetworkEvent::Booted(FIVE), NetworkEvent::Ready];

#[test]
fn a_node_that_sends_boot_ups_only_is_booted_ever_more_rarely() {
    let mut bus = Bus::up(OnLoss::ResetNode);
    bus.storm(10_000, "705#00");
    assert_eq!(bus.log, ["605#4000100000000000"; 4], "at 0, 1, 3 and 7 s");
    assert_eq!(bus.take_events(), [LOST, NetworkEvent::BootLoop(FIVE)]);
    bus.log.clear();
    bus.storm(100_000, "705#00");
    assert_eq!((bus.log.len(), bus.take_events()), (4, vec![]), "at 15, 31, 63 and 95 s");
    // The node works again: the next attempt succeeds.
    bus.nodes[0].connected = true;
    bus.reboot(0);
    bus.pass_ms(32_000);
    assert_eq!((bus.take_events(), bus.states()), (BOOTED.to_vec(), vec![NmtState::Operational; 2]));
    // After a quiet time, the node is booted at once.
    bus.pass_ms(64_000);
    bus.reboot(0);
    bus.pass_ms(100);
    assert_eq!(bus.take_events(), [&[LOST][..], &BOOTED].concat());
}

#[test]
fn what_a_node_has_sent_before_its_reset_does_not_reset_it_again() {
    let mut bus = unplugged(OnLoss::ResetNode);
    bus.pass_ms(4_000);
    (bus.events, bus.log) = (Vec::new(), Vec::new());
    // The node was frozen: its heartbeats come all at once; then it follows the reset, and takes its time.
    for _ in 0..41 {
        bus.storm(1, "705#05");
    }
    assert_eq!(bus.sent("000#8105"), 1, "{:?}", bus.log);
    bus.pass_ms(8_000);
    assert_eq!(bus.sent("000#81"), 1, "a slow node is not reset while it boots");
    bus.nodes[0].connected = true;
    bus.reboot(0);
    bus.pass_ms(100);
    assert!(bus.take_events().ends_with(&BOOTED));
}

#[test]
fn a_node_that_does_not_obey_its_resets_is_reset_ever_more_rarely() {
    let mut bus = unplugged(OnLoss::ResetNode);
    bus.pass_ms(4_000);
    (bus.events, bus.log) = (Vec::new(), Vec::new());
    for _ in 0..300 {
        bus.storm(1, "705#05");
        bus.pass_ms(99);
    }
    // The reset at the loss was the first; the others follow after 2, 4, 8 and 16 s.
    assert_eq!(bus.sent("000#8105"), 4);
    assert!(bus.take_events().contains(&NetworkEvent::BootLoop(FIVE)));
    assert!(bus.log.len() < 200, "{}", bus.log.len());
}

#[test]
fn a_node_that_boots_well_but_again_and_again_resets_the_others_ever_more_rarely() {
    for (on_loss, resets, stops) in [(OnLoss::ResetNode, 0, 0), (OnLoss::ResetAll, 9, 0), (OnLoss::StopAll, 0, 1)] {
        let mut bus = Bus::up(on_loss);
        for _ in 0..1_000 {
            bus.reboot(0);
            bus.pass_ms(100);
        }
        // The node is booted at 0, 1, 3, 7, 15, 31, 63 and 95 s, and is lost again each time.
        assert_eq!((bus.sent("000#8200"), bus.sent("000#0200")), (resets, stops));
        assert!(bus.log.len() < 200, "{}", bus.log.len());
        assert_eq!(bus.events.iter().filter(|&&event| event == NetworkEvent::BootLoop(FIVE)).count(), 1);
    }
}
