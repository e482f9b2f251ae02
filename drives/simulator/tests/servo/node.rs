//! A simulated servo on a bus: orders by SDO and PDO, SYNC, EMCY, NMT, the loss of power.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::kept::KeptFormat;
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::object::DataType::{Unsigned8 as U8, Unsigned16 as U16, Unsigned32 as U32};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};
use simulator::SimulatedServo;
use simulator::script::{Condition, Trigger};
use simulator::servo::ServoModel;
use simulator::servo::script::{Change, Script, Setting};

use crate::support::{Row, SERVO, dictionary};

const NODE: NodeId = NodeId::literal(5);

/// RPDO1: control word and 607Ah with SYNC. TPDO1: status word, when it changes; TPDO2: position.
const COMMUNICATION: &[Row] = &[
    (0x1000, 0, U32, 0x0002_0192),
    (0x1001, 0, U8, 0),
    (0x1005, 0, U32, 0x80),
    (0x1010, 0, U8, 1),
    (0x1010, 1, U32, 1),
    (0x1014, 0, U32, 0x85),
    (0x1017, 0, U16, 0),
    (0x1400, 0, U8, 2),
    (0x1400, 1, U32, 0x205),
    (0x1400, 2, U8, 1),
    (0x1600, 0, U8, 2),
    (0x1600, 1, U32, 0x6040_0010),
    (0x1600, 2, U32, 0x607A_0020),
    (0x1800, 0, U8, 2),
    (0x1800, 1, U32, 0x185),
    (0x1800, 2, U8, 255),
    (0x1A00, 0, U8, 1),
    (0x1A00, 1, U32, 0x6041_0010),
    (0x1801, 0, U8, 2),
    (0x1801, 1, U32, 0x285),
    (0x1801, 2, U8, 255),
    (0x1A01, 0, U8, 1),
    (0x1A01, 1, U32, 0x6064_0020),
];

static MODEL: ServoModel = ServoModel {
    storage: |_| Box::new(dictionary(&[COMMUNICATION, SERVO].concat())),
    persistent: &[Address::new(0x607C, 0)],
    check: |servo, _, address, value| match (address.index(), value) {
        (0x6098, 99) if servo.state() != State::OperationEnabled => Err(AbortCode::DEVICE_STATE),
        _ => Ok(()),
    },
    written: |servo, now, od, address| {
        if address.index() == 0x6071 {
            servo.set_position(now, od, 1234.0);
        }
    },
    ..ServoModel::CIA_402
};

pub(crate) struct Bus {
    bus: VirtualBus,
    servo: Arc<Mutex<SimulatedServo>>,
    network: Network<VirtualLink>,
    watch: VirtualLink,
}

impl Bus {
    pub(crate) fn new() -> Self {
        Bus::of(SimulatedServo::new(Instant::ZERO, &MODEL, NODE))
    }

    fn of(servo: SimulatedServo) -> Self {
        let (bus, servo) = (VirtualBus::new(), Arc::new(Mutex::new(servo)));
        bus.attach(Arc::clone(&servo));
        let (network, watch) = (Network::new(bus.link()), bus.link());
        bus.advance(Duration::from_millis(1));
        Bus { bus, servo, network, watch }
    }

    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64) {
        self.try_write(index, sub, value).unwrap();
    }

    fn try_write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), lexican_runtime::host::AccessError> {
        let address = Address::new(index, sub);
        let size = SERVO.iter().chain(COMMUNICATION).find(|row| (row.0, row.1) == (index, sub)).unwrap().2.size();
        self.network.write_bytes(NODE, address, &value.to_le_bytes()[..size.unwrap()])
    }

    pub(crate) fn read(&mut self, index: u16, sub: u8) -> i64 {
        let data = self.network.read_bytes(NODE, Address::new(index, sub)).unwrap();
        let mut bytes =
            if data.last().is_some_and(|byte| byte & 0x80 != 0) && data.len() == 4 { [0xFF; 8] } else { [0; 8] };
        bytes[..data.len()].copy_from_slice(&data);
        i64::from_le_bytes(bytes)
    }

    pub(crate) fn pass(&mut self, ms: u64) {
        self.bus.advance(Duration::from_millis(ms));
    }

    pub(crate) fn enable(&mut self, mode: i64) {
        self.write(0x6060, 0, mode);
        [0x06, 0x07, 0x0F].into_iter().for_each(|word| self.write(0x6040, 0, word));
    }

    pub(crate) fn command(&mut self, command: NmtCommand) {
        self.network.command(command, Some(NODE)).unwrap();
        self.pass(1);
    }

    pub(crate) fn power(&mut self, on: bool) {
        let now = self.bus.now();
        self.servo.lock().unwrap().set_power(now, on);
        self.pass(10);
    }

    pub(crate) fn follow(&mut self, script: Script) {
        let now = self.bus.now();
        self.with(|servo| servo.follow(now, script));
    }

    pub(crate) fn steps_left(&self) -> usize {
        self.with(|servo| servo.steps_left())
    }

    pub(crate) fn with<T>(&self, call: impl FnOnce(&mut SimulatedServo) -> T) -> T {
        call(&mut self.servo.lock().unwrap())
    }

    pub(crate) fn state(&self) -> State {
        self.servo.lock().unwrap().servo().state()
    }

    pub(crate) fn shaft(&self) -> f64 {
        self.servo.lock().unwrap().servo().shaft(self.bus.now()).position
    }

    /// The received frames with an identifier.
    fn frames(&mut self, id: u16) -> Vec<Frame> {
        let until = self.bus.now();
        std::iter::from_fn(|| self.watch.receive_frame(until).unwrap())
            .filter(|frame| frame.id() == CobId::standard(id).unwrap())
            .collect()
    }
}

#[test]
fn it_moves_by_sdo_and_reports_by_pdo() {
    let mut bus = Bus::new();
    bus.command(NmtCommand::Start);
    bus.enable(1);
    bus.write(0x607A, 0, 1000);
    bus.frames(0x185);
    bus.write(0x6040, 0, 0x1F);
    bus.pass(2000);
    let words: Vec<u16> =
        bus.frames(0x185).iter().map(|frame| u16::from_le_bytes(frame.data().try_into().unwrap())).collect();
    assert_eq!(words, [0x1237, 0x1637], "acknowledged, then reached");
    assert_eq!(bus.read(0x6064, 0), 1000);
}

#[test]
fn it_is_a_servo_although_its_data_sheet_does_not_say_so() {
    static MODEL: ServoModel =
        ServoModel { storage: |_| Box::new(dictionary(&[(0x1000, 0, U32, 0)])), ..ServoModel::CIA_402 };
    let bus = VirtualBus::new();
    bus.attach(SimulatedServo::new(bus.now(), &MODEL, NODE));
    let device_type = Network::new(bus.link()).read_bytes(NODE, Address::new(0x1000, 0)).unwrap();
    assert_eq!(device_type, 0x0002_0192_u32.to_le_bytes());
}

#[test]
fn a_moving_axis_reports_its_position_every_10_ms() {
    let mut bus = Bus::new();
    bus.command(NmtCommand::Start);
    bus.enable(3);
    bus.write(0x60FF, 0, 1000);
    bus.frames(0x285);
    bus.pass(1000);
    let positions = bus.frames(0x285);
    assert_eq!(positions.len(), 100);
    bus.write(0x60FF, 0, 0);
    bus.pass(200);
    bus.frames(0x285);
    bus.pass(1000);
    assert!(bus.frames(0x285).is_empty(), "it stands");
}

/// One cycle: the PDO, then SYNC.
fn cycle(bus: &mut Bus, target: Option<i32>) {
    if let Some(target) = target {
        let [a, b, c, d] = target.to_le_bytes();
        bus.watch.send(&Frame::from_array(CobId::standard(0x205).unwrap(), [0x0F, 0, a, b, c, d])).unwrap();
    }
    bus.watch.send(&Frame::from_array(CobId::SYNC, [])).unwrap();
    bus.pass(2);
}

#[test]
fn a_lost_pdo_is_bridged_and_four_are_a_fault_with_its_emcy() {
    let mut bus = Bus::new();
    bus.command(NmtCommand::Start);
    bus.enable(8);
    for step in 1..20 {
        cycle(&mut bus, (step != 7 && step != 12).then_some(step * 4));
        assert!((bus.shaft() - f64::from(step * 4)).abs() < 0.1, "{step}: {}", bus.shaft());
    }
    bus.frames(0x85);
    (0..5).for_each(|_| cycle(&mut bus, None));
    bus.pass(100);
    assert_eq!(bus.state(), State::Fault);
    let emergencies: Vec<_> = bus.frames(0x85).iter().map(|frame| frame.data()[..3].to_vec()).collect();
    assert_eq!(emergencies, [[0x00, 0x87, 0x21]]);
    assert_eq!(bus.read(0x603F, 0), 0x8700);
}

/// The steps of enabling, travelling and homing.
const STEPS: &[(u16, i64)] = &[
    (0x6060, 1),
    (0x6040, 0x06),
    (0x6040, 0x07),
    (0x6040, 0x0F),
    (0x607A, 1000),
    (0x6040, 0x1F),
    (0x6040, 0x0F),
    (0x6060, 6),
    (0x6098, 34),
    (0x6040, 0x1F),
];

#[test]
fn after_a_power_cut_at_any_step_nothing_moves_unasked() {
    for cut in 0..=STEPS.len() {
        for reset in [false, true] {
            let mut bus = Bus::new();
            for &(index, value) in &STEPS[..cut] {
                bus.write(index, 0, value);
                bus.pass(100);
            }
            if reset {
                bus.command(NmtCommand::ResetNode);
            } else {
                bus.power(false);
                assert!(bus.network.read_bytes(NODE, Address::new(0x6041, 0)).is_err(), "it is off");
                bus.power(true);
            }
            // What moved coasts to a standstill.
            bus.pass(1000);
            let stands = bus.shaft();
            bus.pass(10_000);
            assert_eq!((bus.state(), bus.shaft()), (State::SwitchOnDisabled, stands), "cut after {cut} steps");
            bus.enable(1);
            bus.pass(10_000);
            assert_eq!((bus.state(), bus.shaft()), (State::OperationEnabled, stands), "cut after {cut} steps");
        }
    }
}

#[test]
fn what_is_stored_or_persistent_survives_a_power_cut() {
    let mut bus = Bus::new();
    bus.write(0x6081, 0, 500);
    bus.write(0x1010, 1, i64::from(u32::from_le_bytes(*b"save")));
    bus.write(0x6083, 0, 77);
    bus.write(0x607C, 0, 11);
    bus.power(false);
    bus.power(true);
    assert_eq!([bus.read(0x6081, 0), bus.read(0x6083, 0), bus.read(0x607C, 0)], [500, 10_000, 11]);
}

/// A file in the temporary folder, deleted after the test.
struct File(std::path::PathBuf);

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn what_is_stored_or_persistent_survives_in_a_file() {
    let file = File(std::env::temp_dir().join(format!("lexican-servo-{}", std::process::id())));
    let open = || SimulatedServo::with_eeprom(Instant::ZERO, &MODEL, NODE, &file.0);
    let mut bus = Bus::of(open().unwrap());
    bus.write(0x6081, 0, 500);
    bus.write(0x1010, 1, i64::from(u32::from_le_bytes(*b"save")));
    bus.write(0x6083, 0, 77);
    bus.write(0x607C, 0, 11);
    assert!(bus.with(|servo| servo.eeprom_trouble().is_none()));
    let mut bus = Bus::of(open().unwrap());
    assert_eq!([bus.read(0x6081, 0), bus.read(0x6083, 0), bus.read(0x607C, 0)], [500, 10_000, 11]);
    let text = std::fs::read_to_string(&file.0).unwrap();
    let other = text.replace("6081:00 F4 01 00 00", "6041:00 F4 01");
    assert_ne!(other, text);
    for (text, words) in [(other, "cut off or changed"), ("x\n".to_owned(), "not the EEPROM of a simulated device")] {
        std::fs::write(&file.0, text).unwrap();
        let wrong = open().unwrap_err().to_string();
        assert!(wrong.starts_with(&format!("{}: {words}", file.0.display())), "{wrong}");
    }
    let format = KeptFormat { name: "lexican parameters", version: 2 };
    for line in ["1010:01 01 00 00 00", "6081:00 F4", "7000:00 F4"] {
        std::fs::write(&file.0, format.seal(&[line.to_owned()])).unwrap();
        let wrong = open().unwrap_err().to_string();
        assert!(wrong.contains(&format!(": line 2: `{line}` is neither")), "{wrong}");
    }
}

#[test]
fn a_reset_of_the_communication_keeps_the_parameters() {
    let mut bus = Bus::new();
    bus.write(0x1017, 0, 1000);
    bus.write(0x6081, 0, 500);
    bus.command(NmtCommand::ResetCommunication);
    assert_eq!([bus.read(0x1017, 0), bus.read(0x6081, 0)], [0, 500]);
}

#[test]
fn stopping_the_node_stops_the_axis() {
    let mut bus = Bus::new();
    bus.command(NmtCommand::Start);
    bus.enable(3);
    bus.write(0x60FF, 0, 1000);
    bus.pass(500);
    bus.command(NmtCommand::Stop);
    bus.pass(500);
    let stands = bus.shaft();
    bus.pass(500);
    assert_eq!((bus.state(), bus.shaft()), (State::Fault, stands));
    assert_eq!(bus.servo.lock().unwrap().nmt_state(), NmtState::Stopped);
}

#[test]
fn what_is_written_beside_the_bus_is_as_if_a_client_wrote_it() {
    let mut bus = Bus::new();
    let write =
        |bus: &Bus, index, data: &[u8]| bus.with(|servo| servo.write(bus.bus.now(), Address::new(index, 0), data));
    assert_eq!(write(&bus, 0x1017, &100_u16.to_le_bytes()), Ok(()));
    bus.pass(1000);
    assert!(bus.frames(0x705).len() >= 9);
    // A persistent value, a value that the model refuses, and one that has an effect.
    assert_eq!(write(&bus, 0x607C, &77_i32.to_le_bytes()), Ok(()));
    assert_eq!(write(&bus, 0x6098, &[99]), Err(AbortCode::DEVICE_STATE));
    assert_eq!(write(&bus, 0x6071, &[0, 0]), Ok(()));
    assert_eq!(bus.read(0x6064, 0), 1234);
    bus.power(false);
    bus.power(true);
    assert_eq!(bus.read(0x607C, 0), 77);
}

#[test]
fn the_model_refuses_and_follows_writes() {
    let mut bus = Bus::new();
    let refused = bus.try_write(0x6098, 0, 99).unwrap_err().to_string();
    assert!(refused.contains("08000022") || refused.contains("0800 0022"), "{refused}");
    bus.enable(1);
    bus.write(0x6098, 0, 99);
    bus.write(0x6071, 0, 0);
    assert_eq!(bus.read(0x6064, 0), 1234);
}

/// A condition that was true when the power was lost, and is not any more.
#[test]
fn a_script_that_begins_while_the_drive_is_off_waits() {
    let mut bus = Bus::new();
    bus.enable(3);
    bus.write(0x60FF, 0, 1000);
    bus.pass(500);
    bus.power(false);
    bus.pass(5000);
    let moving = Trigger::When { condition: Condition::Moving, and_then: Duration::ZERO };
    let blocked = Setting::new("blocked", "true").unwrap();
    bus.follow(Script::default().then(moving, [Change::Input(blocked)]));
    bus.pass(5000);
    assert_eq!(bus.steps_left(), 1);
}
