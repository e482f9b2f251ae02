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

use super::support::{Bench, NODE};

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

fn variant() -> Bench {
    Bench::with(Setup::new(&VARIANT, NODE))
}

#[test]
fn a_drive_without_operator_keys_obeys_none() {
    let mut bench = variant();
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.key = Some(Key::Clockwise)));
    bench.pass(1000);
    assert_eq!(bench.see(|drive, now| drive.shaft(now).position), 0.0);
}

#[test]
fn a_parameter_without_an_object_has_its_usual_value() {
    let mut bench = variant();
    for index in ABSENT {
        assert_eq!(bench.read(index, 0), Err(0x0602_0000), "{index:04X}");
    }
    let parameters = bench.see(|drive, _| drive.parameters());
    assert_eq!((parameters.loop_length, parameters.in_position_mode, parameters.inching_stop), (800, 0, 0));
    assert_eq!((parameters.d_pos, parameters.torque_deactivation, parameters.inching_2_offset), (101, 125, 100));
    assert_eq!(parameters.window, 10, "what has an object comes from there");
}

#[test]
fn a_node_id_in_an_object_is_taken_over_after_a_reset_and_kept_without_power() {
    let mut bench = variant();
    let node = |drive: &mut SimulatedDrive, now: Instant, node: u8| {
        drive.with_dictionary(now, |od| {
            let entry = od.entry(NODE_ID).unwrap();
            od.write(&entry, 0, &[node], true).unwrap();
        });
    };
    bench.see(|drive, now| node(drive, now, 7));
    assert_eq!(bench.read(0x2101, 0), Ok(7), "the drive still answers as node 5");
    assert_eq!(bench.ask("000#8105"), ["707#00"]);
    bench.see(|drive, now| node(drive, now, 9));
    bench.see(|drive, _| drive.set_switches(DipSwitches::for_node(NodeId::literal(3))));
    bench.see(SimulatedDrive::power_cycle);
    assert_eq!(bench.pass(0), ["709#00"], "there are no switches");
}

#[test]
fn without_its_enable_input_the_motor_has_no_torque() {
    let mut bench = variant();
    bench.enable();
    bench.send("405#1F0088130000");
    bench.pass(1000);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.enable = false));
    let status = |bench: &Bench| bench.see(|drive, now| drive.controller().system_status(now));
    assert_eq!(status(&bench) & system::NO_SUPPLY, system::NO_SUPPLY);
    bench.pass(5000);
    let at = bench.see(|drive, now| drive.position(now));
    assert!(at < 4000, "it has run out: {at}");
    bench.ask("205#0F00");
    bench.ask("405#1F0088130000");
    bench.pass(5000);
    assert_eq!(bench.see(|drive, now| drive.position(now)), at, "nothing starts");
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.enable = true));
    assert_eq!(status(&bench) & system::NO_SUPPLY, 0);
    bench.ask("205#0F00");
    bench.ask("405#1F0088130000");
    bench.pass(10_000);
    assert_eq!(bench.see(|drive, now| drive.position(now)), 5000);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.output_stage_supply_100mv = 0));
    assert_eq!(status(&bench) & system::NO_SUPPLY, 0, "the bit is that of the input");
    let mut other = Bench::new();
    other.see(|drive, now| drive.set_inputs(now, |inputs| inputs.enable = false));
    other.enable();
    assert_eq!(status(&other) & system::NO_SUPPLY, 0, "the AG03/1 has no such input");
}

#[test]
fn a_fault_or_a_code_that_the_drive_does_not_have_does_not_come() {
    for (model, faults) in [(&VARIANT, 0), (&MODEL, 1)] {
        let mut bench = Bench::with(Setup::new(model, NODE));
        bench.enable();
        bench.send("405#1F0088130000");
        bench.pass(1000);
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Passive));
        assert_eq!(bench.see(|drive, _| drive.controller().faults().len()), faults, "{}", model.name);
    }
    for (model, recovered) in [(&VARIANT, [""; 0].as_slice()), (&MODEL, &["085#4081110000000000"])] {
        let mut bench = Bench::with(Setup::new(model, NODE));
        if model.emergencies.is_some() {
            bench.write(0x1014, 0, &0x4000_0085_u32.to_le_bytes());
        }
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Off));
        bench.pass(100);
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.bus = BusState::Active));
        let heard: Vec<String> = bench.pass(0).into_iter().filter(|frame| frame.contains("#40")).collect();
        assert_eq!(heard, recovered, "{}", model.name);
    }
}

#[test]
fn a_limit_switch_lets_the_drive_inch_away_only() {
    for (switch, bit, there, back) in
        [(0, system::LIMIT_SWITCH_1, 0x4000, 0x8000), (1, system::LIMIT_SWITCH_2, 0x8000, 0x4000)]
    {
        let mut bench = variant();
        let order = |word: u16| format!("205#{:04X}", u16::swap_bytes(word));
        let word = |bench: &Bench| bench.see(|drive, now| drive.controller().system_status(now));
        let set = |bench: &Bench, active: bool| {
            bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.limit_switches[switch] = active));
        };
        bench.enable();
        bench.send(&order(0x000F));
        bench.send(if switch == 0 { "405#1F0088130000" } else { "405#1F0078ECFFFF" });
        bench.pass(2000);
        assert_eq!(word(&bench) & (bit | system::POSITIONING), system::POSITIONING);
        let shaft = |bench: &Bench| bench.see(|drive, now| drive.shaft(now).position);
        let before = shaft(&bench);
        set(&bench, true);
        assert_eq!(word(&bench) & (bit | system::POSITIONING), bit, "the travel is over");
        bench.pass(1000);
        let way = (shaft(&bench) - before).abs();
        assert!((way - 50.0).abs() < 0.001, "full deceleration from 30 rev/min: {way}");
        let at = bench.see(|drive, now| drive.position(now));
        assert_ne!(at, 0);
        assert_eq!(word(&bench) & (system::NOT_READY | system::MOVING), system::NOT_READY);
        let ready = bench.see(|drive, now| drive.status_word(now)) & status::READY;
        assert_eq!((ready, bench.state()), (0, State::OperationEnabled));
        // Neither a travel, whichever way, nor inching towards the switch.
        bench.send(&order(0x000F));
        for refused in ["405#1F0000000000".to_owned(), order(0x000F), order(0x000F | there)] {
            bench.send(&refused);
            bench.pass(500);
            assert_eq!(bench.see(|drive, now| drive.position(now)), at, "{refused}");
        }
        bench.ask("405#1F0000000000");
        assert_eq!(bench.see(|drive, now| drive.status_word(now)) & status::ACKNOWLEDGED, 0);
        bench.send(&order(0x000F));
        bench.send(&order(0x000F | back));
        bench.pass(1000);
        bench.send(&order(0x000F));
        bench.pass(1000);
        let away = bench.see(|drive, now| drive.position(now));
        assert!(if switch == 0 { away < at } else { away > at }, "{away}");
        // Inching onto the switch stops, too.
        set(&bench, false);
        bench.send(&order(0x000F | there));
        bench.pass(300);
        assert_eq!(word(&bench) & system::MOVING, system::MOVING);
        set(&bench, true);
        bench.pass(1000);
        assert_eq!(word(&bench) & system::MOVING, 0);
    }
}

#[test]
fn a_step_stops_on_the_limit_switch_that_it_leads_to() {
    for (width, switch, stops) in [(1600, 0, true), (1600, 1, false), (-1600, 0, false), (-1600, 1, true)] {
        let mut bench = variant();
        assert_eq!(bench.write(0x2415, 0, &i32::to_le_bytes(width)), None);
        bench.see(|drive, now| drive.turn_shaft(now, 4000));
        bench.enable();
        bench.send("205#0F00");
        bench.send("205#0F20");
        bench.pass(500);
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.limit_switches[switch] = true));
        bench.pass(5000);
        let way = bench.see(|drive, now| drive.position(now)) - 4000;
        assert_eq!(way.abs() < 1600, stops, "{way} with switch {}", switch + 1);
    }
}

#[test]
fn a_limit_switch_at_the_target_leaves_it_reached() {
    let mut bench = variant();
    bench.enable();
    bench.send("405#1F00E8030000");
    bench.pass(5000);
    bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.limit_switches[0] = true));
    let reached = bench.see(|drive, now| drive.status_word(now)) & status::TARGET_REACHED;
    assert_eq!(reached, status::TARGET_REACHED);
}

#[test]
fn switches_mean_nothing_in_velocity_mode_and_to_drives_that_have_none() {
    let active = |inputs: &mut Inputs| (inputs.limit_switches, inputs.calibration_switch) = ([true; 2], true);
    let bits = system::LIMIT_SWITCH_1 | system::LIMIT_SWITCH_2 | system::CALIBRATION_SWITCH;
    for (model, write) in [(&VARIANT, &[2, 0, 0, 0][..]), (&MODEL, &[2])] {
        let mut bench = Bench::with(Setup::new(model, NODE));
        bench.see(|drive, now| drive.turn_shaft(now, 100));
        bench.see(|drive, now| drive.set_inputs(now, active));
        let position = bench.see(|drive, now| drive.position(now));
        assert_eq!(position, if model.switches { 0 } else { 100 }, "calibrated, or not");
        let shown = |bench: &Bench| bench.see(|drive, now| drive.controller().system_status(now) & bits);
        assert_eq!(shown(&bench), if model.switches { bits } else { 0 });
        assert_eq!(bench.write(0x6060, 0, write), None);
        assert_eq!(shown(&bench), if model.switches { system::CALIBRATION_SWITCH } else { 0 });
        bench.enable();
        bench.send("505#0F001E000000");
        bench.pass(3000);
        assert_eq!(bench.see(|drive, now| drive.velocity(now)), 30, "{}", model.name);
    }
}

#[test]
fn the_calibration_switch_calibrates_when_no_job_is_active() {
    let mut bench = variant();
    let press = |bench: &Bench, active: bool| {
        bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.calibration_switch = active));
        bench.see(|drive, now| drive.position(now))
    };
    assert_eq!(bench.write(0x607C, 0, &2500_u32.to_le_bytes()), None);
    bench.see(|drive, now| drive.turn_shaft(now, 100));
    let shown = |bench: &Bench| bench.see(|drive, now| drive.controller().system_status(now));
    let warm = |bench: &Bench| bench.see(|drive, now| drive.set_inputs(now, |inputs| inputs.temperature_100mdegc += 1));
    warm(&bench);
    assert_eq!(bench.see(|drive, now| drive.position(now)), 2600);
    assert_eq!(shown(&bench) & system::CALIBRATION_SWITCH, 0);
    assert_eq!(press(&bench, true), 2500);
    assert_eq!(shown(&bench) & system::CALIBRATION_SWITCH, system::CALIBRATION_SWITCH);
    bench.see(|drive, now| drive.turn_shaft(now, 100));
    warm(&bench);
    assert_eq!(press(&bench, false), 2600);
    bench.enable();
    bench.send("405#1F0088130000");
    bench.pass(1000);
    let on_the_way = bench.see(|drive, now| drive.position(now));
    assert_eq!(press(&bench, true), on_the_way);
}
