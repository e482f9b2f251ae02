//! A manager and devices on one bus: NMT, error control, emergencies, SDO, PDO and procedures.

use crate::common::testing::TestOd;
use crate::common::{self, FULL};
use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::manager::{BeginError, Event, Manager, Remote};
use lexican_runtime::object::{Address, Direction, Mapped, Object, Pdo, Rw, place, take};
use lexican_runtime::procedure::{self, ConciseDcf, PdoSettings, Runner, Step, StepError, configure_pdo};
use lexican_runtime::profile::cia402::{Cause, Command, State, Steering, Transitions};
use lexican_runtime::service::sdo_client::{self, Scalar, SdoClient, SdoError};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency, ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);

/// A device, a manager, and perhaps a procedure's runner, on a bus without delay.
struct Network {
    manager: Manager<4>,
    device: Device<3, 3, 2, 3>,
    od: TestOd,
    value: Scalar,
    now: Instant,
    events: Vec<Event>,
    /// Whether the device is on the bus.
    connected: bool,
    /// The state machine of a drive, with 6040h and 6041h.
    drive: Option<State>,
}

impl Network {
    fn new(remote: Remote) -> Self {
        let mut network = Network {
            manager: Manager::new(),
            device: Device::new(NODE, Behaviour::CIA_301),
            od: TestOd::new(FULL),
            value: Scalar::room_for::<u64>(),
            now: Instant::ZERO,
            events: Vec::new(),
            connected: true,
            drive: None,
        };
        network.manager.add(network.now, remote).unwrap();
        network.device.restart(network.now, &mut network.od);
        network
    }

    fn started() -> Self {
        let mut network = Network::new(Remote::new(NODE));
        network.pass_ms(0);
        network.manager.command(NmtCommand::Start, Some(NODE)).unwrap();
        network.pass_ms(0);
        network.events.clear();
        network
    }

    /// Lets all participants send until none has a frame.
    fn settle<'a>(&mut self, runner: &mut Runner<'a, impl Iterator<Item = Step<'a>>>) -> Option<procedure::Event<'a>> {
        let mut end = None;
        loop {
            let from_manager = self.manager.poll_transmit(self.now, &mut self.value);
            let from_runner = runner.poll_transmit(self.now);
            let from_device = self.device.poll_transmit(self.now, &mut self.od);
            if from_manager.is_none() && from_device.is_none() && from_runner.is_none() {
                return end;
            }
            if self.connected {
                for frame in [from_manager, from_runner].into_iter().flatten() {
                    self.deliver(&frame);
                }
                if let Some(frame) = from_device {
                    self.events.extend(self.manager.handle_frame(self.now, &frame, &mut self.value));
                    end = end.or(runner.handle_frame(self.now, &frame));
                }
            }
        }
    }

    fn deliver(&mut self, frame: &Frame) {
        use lexican_runtime::device::Event;
        let before = self.od.get(0x6040, 0) as u16;
        match self.device.handle_frame(self.now, frame, &mut self.od) {
            Some(Event::Reset(_)) => {
                self.od = TestOd::new(FULL);
                self.device.restart(self.now, &mut self.od);
            }
            Some(Event::Written(address)) if address.index() == 0x6040 => self.drive(before),
            _ => {}
        }
    }

    /// Follows the control word.
    fn drive(&mut self, before: u16) {
        let Some(state) = self.drive else { return };
        let command = Command::parse(before, self.od.get(0x6040, 0) as u16);
        let state = Transitions::CIA_402.follow(state, command).map_or(state, |step| step.to);
        self.drive = Some(state);
        self.od.set(0x6041, 0, state.status_bits().into());
    }

    fn pass_ms(&mut self, ms: u64) {
        self.pass(ms, &mut Runner::new(NODE, SdoClient::of_node(NODE), std::iter::empty()));
    }

    /// Lets time pass, and returns how the procedure has ended.
    fn pass<'a>(
        &mut self,
        ms: u64,
        runner: &mut Runner<'a, impl Iterator<Item = Step<'a>>>,
    ) -> Option<procedure::Event<'a>> {
        let (until, mut end) = (self.now + Duration::from_millis(ms), None);
        loop {
            end = end.or(self.settle(runner));
            let due = [self.manager.poll_timeout(), self.device.poll_timeout(), runner.poll_timeout()];
            let Some(due) = due.into_iter().flatten().min().filter(|&due| due <= until) else { break };
            self.now = due.max(self.now);
            if self.manager.poll_timeout().is_some_and(|due| due <= self.now) {
                self.events.extend(self.manager.handle_timeout(self.now));
            }
            if self.device.poll_timeout().is_some_and(|due| due <= self.now) {
                self.device.handle_timeout(self.now, &mut self.od);
            }
            if runner.poll_timeout().is_some_and(|due| due <= self.now) {
                end = end.or(runner.handle_timeout(self.now));
            }
        }
        self.now = until;
        end
    }

    /// Runs a procedure to its end.
    fn run<'a>(&mut self, steps: impl Iterator<Item = Step<'a>>) -> procedure::Event<'a> {
        let mut runner = Runner::new(NODE, SdoClient::of_node(NODE), steps);
        let end = (0..100).find_map(|_| self.pass(100, &mut runner));
        end.unwrap_or_else(|| panic!("the procedure does not end: {:?}", runner.step()))
    }

    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

#[test]
fn a_manager_starts_a_node_and_follows_its_state() {
    let mut network = Network::new(Remote::new(NODE).with_heartbeat(Duration::from_millis(150)));
    network.od.set(0x1017, 0, 100);
    network.device.restart(network.now, &mut network.od);
    network.pass_ms(100);
    assert_eq!(
        network.take_events(),
        [Event::BootedUp { node: NODE }, Event::Appeared { node: NODE, state: NmtState::PreOperational }]
    );
    network.manager.command(NmtCommand::Start, None).unwrap();
    network.pass_ms(100);
    let events = network.take_events();
    assert!(events.contains(&Event::StateChanged { node: NODE, state: NmtState::Operational }), "{events:?}");
    assert_eq!(network.manager.remote(NODE).unwrap().state(), Some(NmtState::Operational));

    network.connected = false;
    network.pass_ms(1000);
    assert_eq!(network.take_events(), [Event::Lost { node: NODE }]);
    assert_eq!(network.manager.remote(NODE).unwrap().state(), None);
    network.connected = true;
    network.pass_ms(100);
    assert_eq!(network.take_events(), [Event::Appeared { node: NODE, state: NmtState::Operational }]);
}

#[test]
fn a_manager_guards_a_node() {
    let mut network = Network::new(Remote::new(NODE).with_guarding(Duration::from_millis(100), 3));
    network.pass_ms(1000);
    let events = network.take_events();
    assert_eq!(
        events,
        [Event::BootedUp { node: NODE }, Event::Appeared { node: NODE, state: NmtState::PreOperational }]
    );
    network.connected = false;
    network.pass_ms(1000);
    assert_eq!(network.take_events(), [Event::Lost { node: NODE }]);
}

#[test]
fn an_emergency_reaches_the_manager() {
    let order = CodeOrder::LowByteFirst;
    let mut network = Network::new(Remote::new(NODE).with_emergencies(Emergency::cob_id(NODE), order));
    network.pass_ms(0);
    network.take_events();
    network.device.emergency(ErrorCode(0x3120), ErrorRegister::VOLTAGE, [0; 5], &mut network.od);
    network.pass_ms(0);
    let emergency = Emergency { code: ErrorCode(0x3120), register: ErrorRegister(5), vendor: [0; 5] };
    assert_eq!(network.take_events(), [Event::Emergency { node: NODE, emergency }]);
    assert_eq!(network.manager.remote(NODE).unwrap().error_register(), ErrorRegister(5));
    // The device boots without errors.
    network.device.restart(network.now, &mut network.od);
    network.pass_ms(0);
    assert_eq!(network.manager.remote(NODE).unwrap().error_register(), ErrorRegister::NONE);
}

#[test]
fn entries_are_read_and_written() {
    let mut network = Network::started();
    let address = Address::new(0x1000, 0);
    network.value = Scalar::room_for::<u32>();
    network.manager.read(network.now, NODE, address).unwrap();
    assert!(matches!(network.manager.read(network.now, NODE, address), Err(BeginError::Busy(_))));
    network.pass_ms(0);
    let done = sdo_client::Event::Done { address, len: 4 };
    assert_eq!(network.take_events(), [Event::Sdo { node: NODE, event: done }]);
    assert_eq!(network.value.get(), Ok(0x192_u32));

    network.value = Scalar::of(1000_u16);
    network.manager.write(network.now, NODE, Address::new(0x1017, 0), 2).unwrap();
    network.pass_ms(0);
    assert_eq!(network.od.get(0x1017, 0), 1000);
    let unknown = NodeId::literal(6);
    assert_eq!(network.manager.read(network.now, unknown, address), Err(BeginError::UnknownNode(unknown)));
}

#[test]
fn a_device_that_does_not_answer_is_a_time_out_and_the_next_transfer_works() {
    let mut network = Network::started();
    let address = Address::new(0x1000, 0);
    network.connected = false;
    network.manager.read(network.now, NODE, address).unwrap();
    network.pass_ms(2000);
    let failed = sdo_client::Event::Failed(SdoError::TimedOut { address });
    assert_eq!(network.take_events(), [Event::Sdo { node: NODE, event: failed }]);
    network.connected = true;
    network.value = Scalar::room_for::<u32>();
    network.manager.read(network.now, NODE, address).unwrap();
    network.pass_ms(0);
    assert_eq!(network.value.get(), Ok(0x192_u32));
}

#[derive(Clone, Copy)]
struct Target {
    control_word: u16,
    position: i32,
}

impl Pdo for Target {
    const DIRECTION: Direction = Direction::Receive;
    const NUMBER: u16 = 3;
    const MAPPING: &'static [Mapped] = &[Mapped::new(0x6040, 0, 16), Mapped::new(0x607A, 0, 32)];
    fn to_raw(self) -> u64 {
        place(self.control_word.into(), 0, 16) | place(self.position as u32 as u64, 16, 32)
    }
    fn from_raw(raw: u64) -> Self {
        Target { control_word: take(raw, 0, 16) as u16, position: take(raw, 16, 32) as u32 as i32 }
    }
}

#[test]
fn pdos_go_both_ways() {
    let mut network = Network::started();
    network.manager.send_pdo(CobId::of_node(0x400, NODE), Target { control_word: 0x1F, position: -5000 }).unwrap();
    network.pass_ms(0);
    assert_eq!((network.od.get(0x6040, 0), network.od.get(0x607A, 0) as u32 as i32), (0x1F, -5000));

    network.manager.request_pdo(CobId::of_node(0x380, NODE), 6).unwrap();
    network.pass_ms(0);
    let frame = common::frame("385#3412FEFFFFFF");
    assert_eq!(network.take_events(), [Event::Pdo { node: Some(NODE), frame }]);
}

#[test]
fn sync_makes_devices_send() {
    let mut network = Network::started();
    network.od.set(0x1800, 2, 1);
    network.device.restart(network.now, &mut network.od);
    network.pass_ms(0);
    network.manager.command(NmtCommand::Start, None).unwrap();
    network.pass_ms(0);
    network.take_events();
    network.manager.produce_sync(network.now, CobId::SYNC, Duration::from_millis(10), 0);
    network.pass_ms(30);
    let pdo = Event::Pdo { node: Some(NODE), frame: common::frame("185#3412") };
    assert_eq!(network.take_events(), [pdo; 3]);
}

#[test]
fn the_sync_of_another_node_is_heard_by_its_identifier() {
    let mut network = Network::started();
    let sync = |id: &str| Some(Event::Sync(common::frame(id)));
    let hear = |network: &mut Network, frame: &str| {
        network.manager.handle_frame(network.now, &common::frame(frame), &mut network.value)
    };
    assert_eq!(hear(&mut network, "080#05"), sync("080#05"));
    let other = CobId::standard(0x101).unwrap();
    network.manager.produce_sync(network.now, other, Duration::ZERO, 0);
    assert_eq!((hear(&mut network, "101#"), hear(&mut network, "080#")), (sync("101#"), None));
}

#[test]
fn nodes_that_were_not_added_are_noticed() {
    let mut network = Network::started();
    let node = NodeId::literal(9);
    let mut hear = |frame: &str| network.manager.handle_frame(network.now, &common::frame(frame), &mut network.value);
    assert_eq!(hear("709#00"), Some(Event::BootedUp { node }));
    assert_eq!(hear("709#7F"), Some(Event::Stranger { node, state: NmtState::PreOperational }));
    let emergency = Emergency { code: ErrorCode::GENERIC, register: ErrorRegister::GENERIC, vendor: [0; 5] };
    assert_eq!(hear("089#0010010000000000"), Some(Event::Emergency { node, emergency }));
    let frame = common::frame("189#00");
    assert_eq!(hear("189#00"), Some(Event::Pdo { node: None, frame }));
}

#[test]
fn a_manager_has_room_for_as_many_nodes_as_it_says() {
    let mut manager = Manager::<2>::new();
    let add = |manager: &mut Manager<2>, id| manager.add(Instant::ZERO, Remote::new(NodeId::literal(id)));
    add(&mut manager, 1).unwrap();
    add(&mut manager, 2).unwrap();
    add(&mut manager, 2).unwrap();
    assert_eq!(add(&mut manager, 3).unwrap_err().to_string(), "node 3 does not fit: the manager has room for 2 nodes");
    assert!(manager.remove(NodeId::literal(1)).is_some());
    add(&mut manager, 3).unwrap();
}

#[test]
fn what_the_application_does_with_an_sdo_client_counts_at_once() {
    let mut network = Network::started();
    let second = NodeId::literal(6);
    network.manager.add(network.now, Remote::new(second)).unwrap();
    let (address, second_ms) = (Address::new(0x1000, 0), network.now + Duration::from_secs(1));
    assert_eq!(network.manager.poll_timeout(), None);
    network.manager.sdo(NODE).unwrap().read(network.now, address).unwrap();
    assert_eq!(network.manager.poll_timeout(), Some(second_ms), "before any other call");
    network.manager.read(network.now, second, address).unwrap();
    network.manager.sdo(NODE).unwrap().abort(AbortCode::GENERAL);
    network.manager.sdo(second).unwrap().abort(AbortCode::GENERAL);
    assert_eq!((network.manager.poll_timeout(), network.manager.handle_timeout(second_ms)), (None, None));
    assert_eq!(network.manager.poll_transmit(network.now, &mut network.value), None, "neither was begun on the bus");
}

#[test]
fn nodes_are_heard_under_the_identifiers_of_now() {
    let mut network = Network::started();
    let address = Address::new(0x1000, 0);
    let [request, response, emergencies] = [0x6E5, 0x6E6, 0x6E7].map(|id| CobId::standard(id).unwrap());
    *network.manager.sdo(NODE).unwrap() = SdoClient::new(request, response);
    network.manager.read(network.now, NODE, address).unwrap();
    assert_eq!(network.manager.poll_transmit(network.now, &mut network.value).map(|frame| frame.id()), Some(request));
    let answer = |id| Frame::from_array(id, [0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0, 0]);
    let mut take = |frame: Frame| network.manager.handle_frame(network.now, &frame, &mut network.value);
    let before = take(answer(CobId::of_node(0x580, NODE)));
    assert!(!matches!(before, Some(Event::Sdo { .. })), "{before:?}");
    let after = take(answer(response));
    let expected = sdo_client::Event::Done { address, len: 4 };
    assert_eq!(after, Some(Event::Sdo { node: NODE, event: expected }));

    let again = Remote::new(NODE).with_emergencies(emergencies, CodeOrder::LowByteFirst);
    network.manager.add(network.now, again).unwrap();
    let emergency = |manager: &mut Manager<4>, id| {
        let frame = Frame::from_array(id, [0x10, 0x42, 0x08, 0, 0, 0, 0, 0]);
        matches!(manager.handle_frame(Instant::ZERO, &frame, &mut [0; 0]), Some(Event::Emergency { node: NODE, .. }))
    };
    assert!(emergency(&mut network.manager, emergencies));
    assert!(network.manager.remote(NODE).unwrap().error_register() == ErrorRegister::TEMPERATURE);
    assert!(network.manager.remove(NODE).is_some() && network.manager.remote(NODE).is_none());
    assert!(!emergency(&mut network.manager, emergencies));
    assert_eq!(network.manager.remotes().map(Remote::node).collect::<Vec<_>>(), []);
}

#[test]
fn a_procedure_does_its_steps_in_order() {
    let heartbeat = Object::<u16, Rw>::new(0x1017, 0);
    let mut network = Network::started();
    let steps = [
        Step::Nmt(NmtCommand::ResetNode),
        Step::AwaitBootUp { timeout: Duration::from_secs(1) },
        Step::expect(Address::new(0x1000, 0), 0x192),
        Step::write(heartbeat, 500),
        Step::Wait(Duration::from_millis(10)),
        Step::expect(Address::new(0x1017, 0), 500),
        Step::Nmt(NmtCommand::Start),
    ];
    let end = network.run(steps.into_iter());
    assert!(matches!(end, procedure::Event::Finished { steps: 7 }), "{end:?}");
    assert_eq!(network.device.nmt_state(), NmtState::Operational);
}

#[track_caller]
fn fails(network: &mut Network, steps: &[Step<'_>], number: usize, error: StepError, text: &str) {
    match network.run(steps.iter().copied()) {
        procedure::Event::Failed(failure) => {
            assert_eq!((failure.number, failure.error), (number, error));
            assert_eq!(failure.to_string(), text);
        }
        end => panic!("{end:?}"),
    }
}

#[test]
fn a_procedure_says_which_step_failed() {
    let mut network = Network::started();
    let address = Address::new(0x1000, 0);
    fails(
        &mut network,
        &[Step::expect(address, 0x192), Step::expect(address, 0x191)],
        2,
        StepError::Mismatch { address, got: 0x192 },
        "step 2 (expect 191h in 1000:00): 1000:00 is 192h",
    );
    fails(
        &mut network,
        &[Step::value(address, 1_u32)],
        1,
        StepError::Sdo(SdoError::Aborted { address, code: AbortCode::READ_ONLY }),
        "step 1 (write 1000:00): 1000:00: the device aborts: 0601 0002: attempt to write a read only object",
    );
    let timeout = Duration::from_millis(50);
    let waiting = Step::Await { address, mask: 0xFF, value: 0, poll: Duration::from_millis(10), timeout };
    let text = "step 1 (wait for 0h in 1000:00): it did not happen within 50 ms";
    fails(&mut network, &[waiting], 1, StepError::TimedOut { within: timeout }, text);
    let text = "step 1 (wait for the boot-up message): it did not happen within 50 ms";
    fails(&mut network, &[Step::AwaitBootUp { timeout }], 1, StepError::TimedOut { within: timeout }, text);
}

#[test]
fn a_pdo_is_reconfigured_as_the_device_demands() {
    let mut network = Network::new(Remote::new(NODE));
    network.pass_ms(0);
    let settings = PdoSettings {
        direction: Direction::Transmit,
        number: 1,
        cob_id: PdoCobId(0x1A5),
        transmission: TransmissionType::EventManufacturer,
        inhibit_100us: Some(10),
        event_timer_ms: Some(0),
        mapping: Some(&[Mapped::new(0x6064, 0, 32), Mapped::new(0x6041, 0, 16)]),
    };
    let end = network.run(configure_pdo(settings));
    assert!(matches!(end, procedure::Event::Finished { steps: 9 }), "{end:?}");
    network.take_events();
    network.manager.command(NmtCommand::Start, None).unwrap();
    network.pass_ms(0);
    let frame = common::frame("1A5#FEFFFFFF3412");
    assert_eq!(network.take_events(), [Event::Pdo { node: None, frame }]);
}

#[test]
fn a_concise_dcf_is_downloaded() {
    let dcf = [2, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 0xE8, 0x03, 0x16, 0x10, 1, 4, 0, 0, 0, 0x64, 0, 0x10, 0];
    let mut network = Network::started();
    let end = network.run(ConciseDcf::new(&dcf));
    assert!(matches!(end, procedure::Event::Finished { steps: 2 }), "{end:?}");
    assert_eq!((network.od.get(0x1017, 0), network.od.get(0x1016, 1)), (1000, 0x0010_0064));
}

fn steer<'a>(steering: &'a Steering) -> Step<'a> {
    Step::Steer {
        observed: Address::new(0x6041, 0),
        acted: Address::new(0x6040, 0),
        steer: steering,
        poll: Duration::from_millis(10),
        timeout: Duration::from_secs(1),
    }
}

/// Steers a drive from one state to another. Returns the end, the drive's state and its control word.
fn steered(from: State, control_word: u16, steering: &Steering) -> (procedure::Event<'_>, Option<State>, u64) {
    let mut network = Network::started();
    network.drive = Some(from);
    network.od.set(0x6041, 0, from.status_bits().into());
    network.od.set(0x6040, 0, control_word.into());
    let end = network.run([steer(steering)].into_iter());
    (end, network.drive, network.od.get(0x6040, 0))
}

#[test]
fn a_drive_is_steered_to_a_state_if_a_way_leads_there() {
    let transitions = Transitions::CIA_402;
    let steering = Steering { target: State::OperationEnabled, transitions, control_word: 0x0100 };
    let (end, drive, control_word) = steered(State::Fault, 0, &steering);
    assert!(matches!(end, procedure::Event::Finished { steps: 1 }), "{end:?}");
    assert_eq!((drive, control_word), (Some(State::OperationEnabled), 0x010F));
    // A fault is reset even if the reset bit of the control word is already set.
    let steering = Steering { target: State::SwitchOnDisabled, transitions, control_word: 0 };
    let (end, drive, _) = steered(State::Fault, 0x0080, &steering);
    assert!(matches!(end, procedure::Event::Finished { steps: 1 }), "{end:?}");
    assert_eq!(drive, Some(State::SwitchOnDisabled));
    // No command leads into a fault.
    let steering = Steering { target: State::Fault, transitions, control_word: 0 };
    let (end, ..) = steered(State::SwitchOnDisabled, 0, &steering);
    assert!(
        matches!(end, procedure::Event::Failed(failure) if failure.error == StepError::Impossible { observed: 0x60 }),
        "{end:?}"
    );
    assert_eq!(transitions.0.iter().filter(|step| step.cause == Cause::Internal).count(), 7);
}
