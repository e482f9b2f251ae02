//! What differs between SIKO's drives, on a drive that is like the AG03/1 in everything else.

use std::sync::LazyLock;

use lexican_driver::Code;
use lexican_driver::description::{EmergencySwitch, Number};
use lexican_runtime::device::Behaviour;
use lexican_runtime::object::{Address, DataType, Dictionary, Row, Table};
use lexican_runtime::service::sdo_server::SizesIndicated;
use lexican_runtime::{Instant, NodeId};
use siko_ag03_1::fault::{self, Fault};
use siko_ag03_1::od;
use siko_ag03_1::sim::inputs::{BusState, Inputs, Key};
use siko_ag03_1::sim::{Addressing, DipSwitches, MODEL, Model, Setup, SimulatedDrive};
use siko_ag03_1::state::State;
use siko_ag03_1::words::{status, system};

use super::support::{NODE, Rig};

const NODE_ID: Address = Address::new(0x2101, 0x00);
const SWITCH: EmergencySwitch =
    EmergencySwitch { object: Number::new(0x1014, 0x00, DataType::Unsigned32), bit: 1 << 30, on_when_set: true };
/// Without H.
const FEWER_FAULTS: &[Fault] = &[fault::SHAFT_BLOCKED, fault::OVERCURRENT, fault::SENSOR, fault::BUS_OFF];

/// And nothing to say of recovery from bus off.
const PASSIVE: Code = Code { number: 0x8120, label: "", text: "error passive" };

/// The objects that only the AG03/1 has.
const ABSENT: [u16; 12] =
    [0x1008, 0x2416, 0x2417, 0x2418, 0x241B, 0x241C, 0x241E, 0x2420, 0x2421, 0x2422, 0x2423, 0x2450];

/// The dictionary of the AG03/1 without them.
static FEWER: LazyLock<Table> = LazyLock::new(|| {
    let is_there = |address: Address| !ABSENT.contains(&address.index()) && address != Address::new(0x2410, 0x0A);
    let rows = od::TABLE.entries().filter(|entry| is_there(entry.address)).map(|entry| {
        let row = Row::new(entry.address.index(), entry.address.sub(), entry.data_type, entry.access, entry.mapping);
        let row = row.at(entry.offset, entry.capacity);
        let row = if entry.limit > 0 { row.limited(entry.limit - 1) } else { row };
        if entry.plus_node { row.plus_node() } else { row }
    });
    Table { rows: rows.collect::<Vec<_>>().leak(), ..od::TABLE }
});

static VARIANT: Model = Model {
    name: "variant",
    storage: |node| Box::new(Dictionary::<{ od::TABLE.image.len() }>::new(&FEWER, node)),
    persistent: &[NODE_ID],
    faults: FEWER_FAULTS,
    notices: &[PASSIVE],
    emergencies: Some(SWITCH),
    control_by_sdo: false,
    addressing: Addressing::Object,
    writes_four_bytes: true,
    enable_input: true,
    switches: true,
    keys: false,
    behaviour: Behaviour {
        sdo_sizes_indicated: SizesIndicated { expedited: [false; 4], longer: false },
        ..MODEL.behaviour
    },
    loop_length: 800,
    ..MODEL
};

fn variant() -> Rig {
    Rig::with(Setup::new(&VARIANT, NODE))
}

#[test]
fn a_drive_without_operator_keys_obeys_none() {
    let mut rig = variant();
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.key = Some(Key::Clockwise)));
    rig.pass(1000);
    assert_eq!(rig.see(|drive, now| drive.shaft(now).position), 0.0);
}

#[test]
fn a_parameter_without_an_object_has_its_usual_value() {
    let mut rig = variant();
    for index in ABSENT {
        assert_eq!(rig.read(index, 0), Err(0x0602_0000), "{index:04X}");
    }
    let parameters = rig.see(|drive, _| drive.parameters());
    assert_eq!((parameters.loop_length, parameters.in_position_mode, parameters.inching_stop), (800, 0, 0));
    assert_eq!((parameters.d_pos, parameters.torque_deactivation, parameters.inching_2_offset), (101, 125, 100));
    assert_eq!(parameters.window, 10, "what has an object comes from there");
}

#[test]
fn a_node_id_in_an_object_is_taken_over_after_a_reset_and_kept_without_power() {
    let mut rig = variant();
    let node = |drive: &mut SimulatedDrive, now: Instant, node: u8| {
        drive.with_dictionary(now, |od| {
            let entry = od.entry(NODE_ID).unwrap();
            od.write(&entry, 0, &[node], true).unwrap();
        });
    };
    rig.see(|drive, now| node(drive, now, 7));
    assert_eq!(rig.read(0x2101, 0), Ok(7), "the drive still answers as node 5");
    assert_eq!(rig.ask("000#8105"), ["707#00"]);
    rig.see(|drive, now| node(drive, now, 9));
    rig.see(|drive, _| drive.set_switches(DipSwitches::for_node(NodeId::literal(3))));
    rig.see(SimulatedDrive::power_cycle);
    assert_eq!(rig.pass(0), ["709#00"], "there are no switches");
}

#[test]
fn without_its_enable_input_the_motor_has_no_torque() {
    let mut rig = variant();
    rig.enable();
    rig.send("405#1F0088130000");
    rig.pass(1000);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.enable = false));
    let status = |rig: &Rig| rig.see(|drive, now| drive.controller().system_status(now));
    assert_eq!(status(&rig) & system::NO_SUPPLY, system::NO_SUPPLY);
    rig.pass(5000);
    let at = rig.see(|drive, now| drive.position(now));
    assert!(at < 4000, "it has run out: {at}");
    rig.ask("205#0F00");
    rig.ask("405#1F0088130000");
    rig.pass(5000);
    assert_eq!(rig.see(|drive, now| drive.position(now)), at, "nothing starts");
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.enable = true));
    assert_eq!(status(&rig) & system::NO_SUPPLY, 0);
    rig.ask("205#0F00");
    rig.ask("405#1F0088130000");
    rig.pass(10_000);
    assert_eq!(rig.see(|drive, now| drive.position(now)), 5000);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.output_stage_supply_100mv = 0));
    assert_eq!(status(&rig) & system::NO_SUPPLY, 0, "the bit is that of the input");
    let mut other = Rig::new();
    other.see(|drive, now| drive.set_inputs(now, |inputs| inputs.enable = false));
    other.enable();
    assert_eq!(status(&other) & system::NO_SUPPLY, 0, "the AG03/1 has no such input");
}

#[test]
fn a_fault_or_a_code_that_the_drive_does_not_have_does_not_come() {
    for (model, faults) in [(&VARIANT, 0), (&MODEL, 1)] {
        let mut rig = Rig::with(Setup::new(model, NODE));
        rig.enable();
        rig.send("405#1F0088130000");
        rig.pass(1000);
        rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Passive));
        assert_eq!(rig.see(|drive, _| drive.controller().faults().len()), faults, "{}", model.name);
    }
    for (model, recovered) in [(&VARIANT, [""; 0].as_slice()), (&MODEL, &["085#4081110000000000"])] {
        let mut rig = Rig::with(Setup::new(model, NODE));
        if model.emergencies.is_some() {
            rig.write(0x1014, 0, &0x4000_0085_u32.to_le_bytes());
        }
        rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Off));
        rig.pass(100);
        rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Active));
        let heard: Vec<String> = rig.pass(0).into_iter().filter(|frame| frame.contains("#40")).collect();
        assert_eq!(heard, recovered, "{}", model.name);
    }
}

#[test]
fn a_limit_switch_lets_the_drive_inch_away_only() {
    for (switch, bit, there, back) in
        [(0, system::LIMIT_SWITCH_1, 0x4000, 0x8000), (1, system::LIMIT_SWITCH_2, 0x8000, 0x4000)]
    {
        let mut rig = variant();
        let order = |word: u16| format!("205#{:04X}", u16::swap_bytes(word));
        let word = |rig: &Rig| rig.see(|drive, now| drive.controller().system_status(now));
        let set = |rig: &Rig, active: bool| {
            rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.limit_switches[switch] = active));
        };
        rig.enable();
        rig.send(&order(0x000F));
        rig.send(if switch == 0 { "405#1F0088130000" } else { "405#1F0078ECFFFF" });
        rig.pass(2000);
        assert_eq!(word(&rig) & (bit | system::POSITIONING), system::POSITIONING);
        let shaft = |rig: &Rig| rig.see(|drive, now| drive.shaft(now).position);
        let before = shaft(&rig);
        set(&rig, true);
        assert_eq!(word(&rig) & (bit | system::POSITIONING), bit, "the travel is over");
        rig.pass(1000);
        let way = (shaft(&rig) - before).abs();
        assert!((way - 50.0).abs() < 0.001, "full deceleration from 30 rev/min: {way}");
        let at = rig.see(|drive, now| drive.position(now));
        assert_ne!(at, 0);
        assert_eq!(word(&rig) & (system::NOT_READY | system::MOVING), system::NOT_READY);
        let ready = rig.see(|drive, now| drive.status_word(now)) & status::READY;
        assert_eq!((ready, rig.state()), (0, State::OperationEnabled));
        // Neither a travel, whichever way, nor inching towards the switch.
        rig.send(&order(0x000F));
        for refused in ["405#1F0000000000".to_owned(), order(0x000F), order(0x000F | there)] {
            rig.send(&refused);
            rig.pass(500);
            assert_eq!(rig.see(|drive, now| drive.position(now)), at, "{refused}");
        }
        rig.ask("405#1F0000000000");
        assert_eq!(rig.see(|drive, now| drive.status_word(now)) & status::ACKNOWLEDGED, 0);
        rig.send(&order(0x000F));
        rig.send(&order(0x000F | back));
        rig.pass(1000);
        rig.send(&order(0x000F));
        rig.pass(1000);
        let away = rig.see(|drive, now| drive.position(now));
        assert!(if switch == 0 { away < at } else { away > at }, "{away}");
        // Inching onto the switch stops, too.
        set(&rig, false);
        rig.send(&order(0x000F | there));
        rig.pass(300);
        assert_eq!(word(&rig) & system::MOVING, system::MOVING);
        set(&rig, true);
        rig.pass(1000);
        assert_eq!(word(&rig) & system::MOVING, 0);
    }
}

#[test]
fn a_step_stops_on_the_limit_switch_that_it_leads_to() {
    for (width, switch, stops) in [(1600, 0, true), (1600, 1, false), (-1600, 0, false), (-1600, 1, true)] {
        let mut rig = variant();
        assert_eq!(rig.write(0x2415, 0, &i32::to_le_bytes(width)), None);
        rig.see(|drive, now| drive.turn_shaft(now, 4000));
        rig.enable();
        rig.send("205#0F00");
        rig.send("205#0F20");
        rig.pass(500);
        rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.limit_switches[switch] = true));
        rig.pass(5000);
        let way = rig.see(|drive, now| drive.position(now)) - 4000;
        assert_eq!(way.abs() < 1600, stops, "{way} with switch {}", switch + 1);
    }
}

#[test]
fn a_limit_switch_at_the_target_leaves_it_reached() {
    let mut rig = variant();
    rig.enable();
    rig.send("405#1F00E8030000");
    rig.pass(5000);
    rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.limit_switches[0] = true));
    let reached = rig.see(|drive, now| drive.status_word(now)) & status::TARGET_REACHED;
    assert_eq!(reached, status::TARGET_REACHED);
}

#[test]
fn switches_mean_nothing_in_velocity_mode_and_to_drives_that_have_none() {
    let active = |inputs: &mut Inputs| (inputs.limit_switches, inputs.calibration_switch) = ([true; 2], true);
    let bits = system::LIMIT_SWITCH_1 | system::LIMIT_SWITCH_2 | system::CALIBRATION_SWITCH;
    for (model, write) in [(&VARIANT, &[2, 0, 0, 0][..]), (&MODEL, &[2])] {
        let mut rig = Rig::with(Setup::new(model, NODE));
        rig.see(|drive, now| drive.turn_shaft(now, 100));
        rig.see(|drive, now| drive.set_inputs(now, active));
        let position = rig.see(|drive, now| drive.position(now));
        assert_eq!(position, if model.switches { 0 } else { 100 }, "calibrated, or not");
        let shown = |rig: &Rig| rig.see(|drive, now| drive.controller().system_status(now) & bits);
        assert_eq!(shown(&rig), if model.switches { bits } else { 0 });
        assert_eq!(rig.write(0x6060, 0, write), None);
        assert_eq!(shown(&rig), if model.switches { system::CALIBRATION_SWITCH } else { 0 });
        rig.enable();
        rig.send("505#0F001E000000");
        rig.pass(3000);
        assert_eq!(rig.see(|drive, now| drive.velocity(now)), 30, "{}", model.name);
    }
}

#[test]
fn the_calibration_switch_calibrates_when_no_job_is_active() {
    let mut rig = variant();
    let press = |rig: &Rig, active: bool| {
        rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.calibration_switch = active));
        rig.see(|drive, now| drive.position(now))
    };
    assert_eq!(rig.write(0x607C, 0, &2500_u32.to_le_bytes()), None);
    rig.see(|drive, now| drive.turn_shaft(now, 100));
    let shown = |rig: &Rig| rig.see(|drive, now| drive.controller().system_status(now));
    let warm = |rig: &Rig| rig.see(|drive, now| drive.set_inputs(now, |inputs| inputs.temperature_100mdegc += 1));
    warm(&rig);
    assert_eq!(rig.see(|drive, now| drive.position(now)), 2600);
    assert_eq!(shown(&rig) & system::CALIBRATION_SWITCH, 0);
    assert_eq!(press(&rig, true), 2500);
    assert_eq!(shown(&rig) & system::CALIBRATION_SWITCH, system::CALIBRATION_SWITCH);
    rig.see(|drive, now| drive.turn_shaft(now, 100));
    warm(&rig);
    assert_eq!(press(&rig, false), 2600);
    rig.enable();
    rig.send("405#1F0088130000");
    rig.pass(1000);
    let on_the_way = rig.see(|drive, now| drive.position(now));
    assert_eq!(press(&rig, true), on_the_way);
}
