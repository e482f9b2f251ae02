//! What the simulated AKD does: state changes, modes, NMT, homing, errors.

use kollmorgen_akd::fault;
use lexican_runtime::profile::cia402::{Mode, State};
use simulator::servo::{Causes, Machine};

use super::simulated::{Akd, Simulated};
use crate::bench::Bench as OnBus;
use crate::kinds::cia402::{bring_to, distinguishes_states};
use crate::kinds::prose::Clauses;
use crate::servo::OfModel;

type Bench = OnBus<Simulated>;

pub(super) const STATUS: u16 = 0x6041;
pub(super) const SYSTEM: u16 = 0x1002;

pub(super) fn bit(bench: &Bench, index: u16, bit: u8) -> bool {
    bench.number(index, 0) >> bit & 1 == 1
}

/// Whether the power stage is enabled: 1002h says so, and nobody can turn the shaft, or it says not, and somebody can. One
/// that moves cannot be turned anyway.
pub(super) fn is_powered(bench: &Bench) -> bool {
    let turns = bench.see(|drive, now| drive.with_servo(now, |servo, od| servo.turn(now, od, 0.0)));
    bit(bench, SYSTEM, 14) && !turns
}

/// Whether it is disabled; not the opposite where 1002h and the shaft do not agree.
fn is_unpowered(bench: &Bench) -> bool {
    let turns = bench.see(|drive, now| drive.with_servo(now, |servo, od| servo.turn(now, od, 0.0)));
    !bit(bench, SYSTEM, 14) && (turns || bench.is_moving())
}

fn code(label: &str) -> Option<u16> {
    fault::find(label).map(|code| code.number)
}

/// A bit before and after what it shows has come about.
type Change = fn() -> [bool; 2];

/// Bits of 1002h and 6041h that states of the state machine do not explain.
const SHOWN: &[(u16, u8, Change)] = &[
    (SYSTEM, 0, || {
        let mut bench = Bench::enabled_in(Mode::ProfilePosition);
        bench.travel(5000);
        let moving = bit(&bench, SYSTEM, 0);
        bench.rest();
        [bit(&bench, SYSTEM, 0), moving]
    }),
    (SYSTEM, 2, || input(2, |bench| bench.world(|inputs| inputs.machine.home_switch = Some((-1.0, 1.0))))),
    (SYSTEM, 3, || {
        let mut bench = Bench::enabled_in(Mode::ProfilePosition);
        bench.travel(5000);
        let moving = bit(&bench, SYSTEM, 3);
        bench.rest();
        [moving, bit(&bench, SYSTEM, 3)]
    }),
    (SYSTEM, 8, || input(8, |bench| bench.world(|inputs| inputs.warnings = code("n301").into()))),
    (SYSTEM, 9, || {
        let mut bench = Bench::enabled_in(Mode::ProfileVelocity);
        let _ = bench.put(0x60FF, 0, 1000);
        let before = bit(&bench, SYSTEM, 9);
        bench.hear(1000);
        [before, bit(&bench, SYSTEM, 9)]
    }),
    (SYSTEM, 11, || {
        let mut bench = Bench::enabled_in(Mode::Homing);
        let before = bit(&bench, SYSTEM, 11);
        // There is no such switch.
        let _ = bench.put(0x6098, 0, 17);
        bench.control(0x1F);
        [before, bit(&bench, SYSTEM, 11)]
    }),
    (SYSTEM, 13, || input(13, |bench| bench.world(|inputs| inputs.faults = code("F602").into()))),
    (SYSTEM, 16, || {
        let mut bench = homing(17);
        let before = bit(&bench, SYSTEM, 16);
        bench.control(0x1F);
        [before, bit(&bench, SYSTEM, 16)]
    }),
    (SYSTEM, 23, || {
        let mut bench = homing(35);
        let before = bit(&bench, SYSTEM, 23);
        bench.control(0x1F);
        [before, bit(&bench, SYSTEM, 23)]
    }),
    (SYSTEM, 25, || input(25, |bench| bench.world(|inputs| inputs.probes[0] = true))),
    (SYSTEM, 26, || input(26, |bench| bench.world(|inputs| inputs.probes[1] = true))),
    (SYSTEM, 27, || input(27, |bench| bench.world(|inputs| inputs.digital = 1 << 18))),
    (SYSTEM, 28, || input(28, |bench| bench.world(|inputs| inputs.digital = 1 << 19))),
    (SYSTEM, 29, || input(29, |bench| bench.world(|inputs| inputs.enable = false)).map(|set| !set)),
    (STATUS, 4, || {
        let mut bench = Bench::operational();
        let with = bit(&bench, STATUS, 4);
        bench.world(|inputs| inputs.supply = false);
        [bit(&bench, STATUS, 4), with]
    }),
    (STATUS, 7, || {
        let mut bench = Bench::operational();
        let before = bit(&bench, STATUS, 7);
        bench.world(|inputs| inputs.warnings = code("n301").into());
        [before, bit(&bench, STATUS, 7)]
    }),
    (STATUS, 10, || {
        let mut bench = Bench::enabled_in(Mode::ProfilePosition);
        bench.travel(5000);
        let moving = bit(&bench, STATUS, 10);
        bench.rest();
        [moving, bit(&bench, STATUS, 10)]
    }),
    (STATUS, 11, || {
        let mut bench = limited(true);
        bench.travel(500);
        bench.rest();
        let within = bit(&bench, STATUS, 11);
        bench.travel(5000);
        let stopped = bench.rest() == 1000;
        [within, bit(&bench, STATUS, 11) && stopped]
    }),
];

/// Enabled in profile position mode with limits of -1000 and 1000; after a restart that has them stored, or without.
pub(super) fn limited(restarts: bool) -> Bench {
    let mut bench = Bench::operational();
    let _ = [bench.put(0x607D, 1, -1000), bench.put(0x607D, 2, 1000)];
    if restarts {
        let _ = bench.put(0x1010, 1, 0x6576_6173);
        bench.nmt(0x81);
        bench.hear(0);
        bench.nmt(0x01);
    }
    let _ = bench.put(0x6060, 0, 1);
    bench.controls(&[0x06, 0x07, 0x0F]);
    bench
}

/// A bit of 1002h before and after the world has changed.
fn input(of: u8, change: fn(&mut Bench)) -> [bool; 2] {
    let mut bench = Bench::operational();
    let before = bit(&bench, SYSTEM, of);
    change(&mut bench);
    [before, bit(&bench, SYSTEM, of)]
}

/// Whether a bit is set when, and only when, what it shows is so.
pub(super) fn shown(index: u16, of: u8) -> Option<bool> {
    let in_states = |holds: fn(State) -> bool| {
        let states = [State::SwitchOnDisabled, State::SwitchedOn, State::QuickStopActive, State::Fault];
        let brought = states.into_iter().filter_map(|state| Some((holds(state), bring_to::<Simulated>(state)?)));
        brought.into_iter().all(|(holds, bench)| bit(&bench, index, of) == holds)
    };
    match (index, of) {
        (SYSTEM, 14) => {
            let states = [State::SwitchOnDisabled, State::SwitchedOn, State::QuickStopActive, State::Fault];
            let agree =
                |state| bring_to::<Simulated>(state).is_some_and(|bench| is_powered(&bench) != is_unpowered(&bench));
            Some(
                in_states(|state| matches!(state, State::SwitchedOn | State::QuickStopActive))
                    && states.into_iter().all(agree),
            )
        }
        (SYSTEM, 15) => Some(in_states(|state| state == State::Fault)),
        (SYSTEM, 19) => Some(in_states(|state| state == State::QuickStopActive)),
        (STATUS, 9) => Some(in_states(|_| true)),
        (STATUS, 0..=3 | 5 | 6) => Some(distinguishes_states::<Simulated>(of.into())),
        _ => {
            let row = SHOWN.iter().find(|(at, bit, _)| (*at, *bit) == (index, of));
            row.map(|(_, _, change)| crate::bench::once::<Simulated, _>((index, of), change) == [false, true])
        }
    }
}

/// Enabled in the homing mode, on a machine with all switches.
pub(super) fn homing(method: i8) -> Bench {
    let mut bench = Bench::enabled_in(Mode::Homing);
    bench.world(|inputs| {
        inputs.machine = Machine {
            negative_limit: Some(-1000.0),
            positive_limit: Some(1000.0),
            home_switch: Some((-200.0, 200.0)),
            index: Some((50.0, 100.0)),
        };
    });
    let _ = bench.put(0x6098, 0, method.into());
    bench
}

/// Whether it homes by a method.
pub(super) fn homes(method: i8) -> bool {
    let mut bench = homing(method);
    bench.control(0x1F);
    bench.rest();
    bit(&bench, STATUS, 12) && !bit(&bench, STATUS, 13)
}

/// What the drive does at a state change (6.4.1.2).
pub(super) fn action(number: u8) -> Clauses {
    let disabled = is_unpowered;
    let after = |from: State, word: u16| {
        let mut bench = bring_to::<Simulated>(from).unwrap_or_else(Bench::new);
        bench.controls(&[word & !0x80, word]);
        bench
    };
    match number {
        0 => vec![("initialisation", Bench::as_delivered().hear_from(Bench::own(0x700), 0) == [[0]])],
        1 => vec![("none", disabled(&Bench::new()))],
        2 => vec![("none", disabled(&after(State::SwitchOnDisabled, 0x06)))],
        3 => {
            let powered = is_powered(&after(State::ReadyToSwitchOn, 0x07));
            let mut without = bring_to::<Simulated>(State::ReadyToSwitchOn).unwrap_or_else(Bench::new);
            without.world(|inputs| inputs.enable = false);
            without.control(0x07);
            vec![
                ("output stage enabled with hardware enable", powered && disabled(&without)),
                ("torque", powered && is_unpowered(&without)),
            ]
        }
        4 => vec![("motion enabled", moves(&mut Bench::enabled_in(Mode::ProfilePosition)))],
        5 => {
            let (mut bench, from) = cruising();
            bench.control(0x07);
            let way = bench.rest() - from;
            vec![
                ("stop with the ramp of the mode", bench.state() == State::SwitchedOn && (way - 50).abs() <= 1),
                ("position kept", is_powered(&bench)),
            ]
        }
        6 => without_torque(&after(State::SwitchedOn, 0x06)),
        7 => vec![(
            "none",
            [0x02, 0x00].into_iter().all(|word| {
                let bench = after(State::ReadyToSwitchOn, word);
                bench.state() == State::SwitchOnDisabled && disabled(&bench)
            }),
        )],
        8 | 9 => {
            let (mut bench, _) = cruising();
            bench.control(if number == 8 { 0x06 } else { 0x00 });
            bench.rest();
            without_torque(&bench)
        }
        10 => without_torque(&after(State::SwitchedOn, 0x02)),
        11 => {
            let (mut bench, from) = cruising();
            bench.control(0x02);
            let way = bench.rest() - from;
            let at = bench.position();
            let powered = is_powered(&bench) && bench.state() == State::QuickStopActive;
            bench.control(0x0F);
            vec![
                ("stop with the emergency ramp", way < 50),
                ("output stage enabled", powered),
                ("set-points cancelled", bench.rest() == at),
            ]
        }
        12 => without_torque(&after(State::QuickStopActive, 0x00)),
        13 => {
            let (mut bench, _) = cruising();
            bench.world(|inputs| inputs.faults = Akd::FAULT.into());
            bench.rest();
            vec![("fault reaction", bench.state() == State::Fault && !bench.is_moving())]
        }
        14 => vec![("drive function disabled", bring_to::<Simulated>(State::Fault).as_ref().is_some_and(disabled))],
        15 => {
            let mut bench = Bench::operational();
            bench.world(|inputs| inputs.faults = Akd::FAULT.into());
            bench.controls(&[0x00, 0x80, 0x00]);
            let stays = bench.state() == State::Fault;
            bench.world(|inputs| inputs.faults = Causes::NONE);
            bench.controls(&[0x80]);
            vec![("fault reset if it is gone", stays && bench.state() == State::SwitchOnDisabled)]
        }
        16 => {
            let mut bench = Bench::enabled_in(Mode::ProfilePosition);
            bench.controls(&[0x02, 0x0F]);
            vec![("motion enabled", bench.state() == State::OperationEnabled && moves(&mut bench))]
        }
        _ => Vec::new(),
    }
}

fn without_torque(bench: &Bench) -> Clauses {
    vec![("output stage disabled", !bit(bench, SYSTEM, 14)), ("no torque", is_unpowered(bench))]
}

fn moves(bench: &mut Bench) -> bool {
    bench.travel(500);
    bench.rest() == 500
}

/// At 1000 units/s, with a ramp of 10,000 units/s2, and where it is.
fn cruising() -> (Bench, i64) {
    let mut bench = Bench::enabled_in(Mode::ProfilePosition);
    let _ = [bench.put(0x6081, 0, 1000), bench.put(0x6083, 0, 10_000), bench.put(0x6084, 0, 10_000)];
    bench.travel(100_000);
    bench.hear(1000);
    let at = bench.position();
    (bench, at)
}

/// What a bit of the control word or status word does in a mode, or that it is reserved.
pub(super) fn mode_bit(object: u16, of: u8, mode: Mode) -> &'static str {
    let mut bench = Bench::enabled_in(mode);
    match (object, of, mode) {
        (STATUS, 12, Mode::ProfilePosition) => {
            bench.travel(500);
            let taken = bit(&bench, STATUS, 12);
            bench.control(0x0F);
            if taken && !bit(&bench, STATUS, 12) { "setpoint acknowledge" } else { "" }
        }
        (STATUS, 13, Mode::ProfilePosition) => {
            let _ = bench.put(0x6065, 0, 100);
            bench.world(|inputs| inputs.blocked = true);
            let before = bit(&bench, STATUS, 13);
            bench.travel(5000);
            let lags = (0..100).any(|_| {
                bench.hear(10);
                bit(&bench, STATUS, 13) || bench.see(|drive, _| drive.servo().faults() == [Akd::FAULT])
            });
            if !before && lags { "lag/following error" } else { "" }
        }
        (STATUS, 12, Mode::Homing) => {
            let before = bit(&bench, STATUS, 12);
            if !before && homes(35) { "reference point set" } else { "" }
        }
        (STATUS, 13, Mode::Homing) => {
            let _ = bench.put(0x6098, 0, 17);
            bench.control(0x1F);
            if bit(&bench, STATUS, 13) { "homing not concluded" } else { "" }
        }
        (0x6040, 4, Mode::Homing) if homes(35) => "homing_operation_start",
        (0x6040, 4, Mode::InterpolatedPosition) => {
            bench.control(0x1F);
            if bit(&bench, STATUS, 12) { "Enable Interpolation" } else { "" }
        }
        (0x6040, 4, Mode::ProfilePosition) if moves(&mut bench) => "new_setpoint",
        (0x6040, 5, Mode::ProfilePosition) if blends() => "change_set_immediately",
        (0x6040, 6, Mode::ProfilePosition) => {
            let ends = [0x1F, 0x5F].map(|word| {
                let mut bench = Bench::enabled_in(Mode::ProfilePosition);
                bench.travel(500);
                bench.rest();
                bench.controls(&[0x0F, word]);
                bench.rest()
            });
            if ends == [500, 1000] { "absolute/relative" } else { "" }
        }
        (0x6040, ..) => {
            // It runs in the same way, and shows the same.
            let of_bits = [0x0F, 0x0F | 1 << of].map(|word| {
                let mut bench = Bench::enabled_in(mode);
                let _ = [bench.put(0x60FF, 0, 1000), bench.put(0x6071, 0, 100), bench.put(0x607A, 0, 500)];
                bench.control(word);
                bench.hear(1000);
                (bench.position(), bench.status())
            });
            if of_bits[0] == of_bits[1] { "reserved" } else { "" }
        }
        _ => "",
    }
}

/// With bit 5, the set-point before is passed without a stop.
fn blends() -> bool {
    let stops = [0x1F, 0x3F].map(|word| {
        let mut bench = Bench::enabled_in(Mode::ProfilePosition);
        let _ = [bench.put(0x6081, 0, 1000), bench.put(0x6083, 0, 10_000), bench.put(0x6084, 0, 10_000)];
        bench.travel(1000);
        let _ = bench.put(0x607A, 0, 2000);
        bench.controls(&[0x0F, word]);
        // Over the first target, where it is slow only if it stops there.
        let slow = (0..400).any(|_| {
            bench.hear(5);
            let speed = bench.see(|drive, now| drive.servo().shaft(now).velocity.abs());
            (990..1010).contains(&bench.position()) && speed < 500.0
        });
        bench.rest();
        slow
    });
    // It is passed even on the way back.
    let mut bench = Bench::enabled_in(Mode::ProfilePosition);
    bench.travel(1000);
    let _ = bench.put(0x607A, 0, -1000);
    bench.controls(&[0x0F, 0x3F]);
    let passed = (0..400).any(|_| {
        bench.hear(5);
        bench.position() >= 990
    });
    stops == [true, false] && passed && bench.rest() == -1000
}

/// What an NMT command does (5.4.1).
pub(super) fn effect(command: u8) -> Clauses {
    let mut bench = Bench::operational();
    let stored = bench.put(0x1010, 1, 0x6576_6173).is_ok();
    let _ = [bench.put(0x6081, 0, 777), bench.put(0x1017, 0, 500)];
    let running = !bench.requested_change().is_empty();
    bench.hear(0);
    bench.nmt(command);
    let boot_up = bench.hear_from(Bench::own(0x700), 0) == [[0]];
    let sends = !bench.requested_change().is_empty();
    bench.control(0x06);
    let receives = bench.state() == State::ReadyToSwitchOn;
    let [profile, heartbeat] = [bench.number(0x6081, 0), bench.number(0x1017, 0)];
    match command {
        0x81 => {
            vec![("cold start", stored && boot_up && heartbeat == 0), ("stored parameters loaded", profile == 20_000)]
        }
        0x82 => vec![
            ("PDOs stop", running && !sends && !receives),
            ("boot-up message", boot_up && heartbeat == 0 && profile == 777),
        ],
        0x01 => vec![("PDOs enabled", sends && receives && !boot_up)],
        0x02 => vec![("no PDO received or sent", running && !sends && !receives && !boot_up)],
        _ => Vec::new(),
    }
}

impl Bench {
    /// The TPDO1 that a warning brings, which changes the status word.
    fn requested_change(&mut self) -> Vec<Vec<u8>> {
        self.world(|inputs| inputs.warnings = Causes::NONE);
        self.see(|drive, now| drive.set_inputs(now, |inputs| inputs.warnings = code("n301").into()));
        self.hear_from(Self::own(0x180), 0)
    }
}

/// The EMCY of an error, and whether it leads to FAULT.
pub(super) fn raised(code: u16) -> (Vec<u8>, bool) {
    let mut bench = Bench::operational();
    let is_fault = fault::FAULTS.iter().any(|known| known.number == code);
    bench.see(|drive, now| {
        drive.set_inputs(now, |inputs| {
            let cause = if is_fault { &mut inputs.faults } else { &mut inputs.warnings };
            *cause = code.into();
        });
    });
    let heard = bench.hear_from(Bench::own(0x80), 0).pop().unwrap_or_default();
    (heard, bench.state() == State::Fault)
}

/// The code with which the drive refuses what a row describes (5.4.5.6).
pub(super) fn refused(meaning: &str) -> Option<u32> {
    let mut bench = Bench::new();
    match meaning {
        "Command specifier invalid" => {
            let answer = bench.sdo(&[0xE0, 0, 0x10, 0, 0, 0, 0, 0])?;
            (answer[0] == 0x80).then(|| u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]))
        }
        "Attempted read access to a write-only object" => bench.read(0x2026, 1).err(),
        "Attempted write access to a read-only object" => bench.put(0x1000, 0, 0).err(),
        "Object does not exist in Object Dictionary" => bench.read(0x5FFF, 0).err(),
        "Object cannot be mapped to a PDO" => {
            bench.put(0x1600, 0, 0).ok().and_then(|()| bench.put(0x1600, 1, 0x1017_0010).err())
        }
        "Size and number of mapped objects exceed permissible PDO length" => {
            let entries = [0x607A_0020, 0x60FF_0020, 0x6081_0020];
            let taken = bench.put(0x1600, 0, 0).is_ok();
            let written = (1..).zip(entries).map(|(sub, mapped)| bench.put(0x1600, sub, mapped)).collect::<Vec<_>>();
            let count = bench.put(0x1600, 0, 3);
            written.into_iter().chain([count]).find_map(Result::err).filter(|_| taken)
        }
        "Data type incompatible, length of service parameter is incompatible" => bench.write(0x6081, 0, 0, 2).err(),
        "Subindex does not exist" => bench.read(0x6099, 3).err(),
        "Outside value range for the parameter (only for write access)" => {
            // Half a millisecond.
            let units = bench.put(0x60C2, 1, 5).is_ok();
            bench.put(0x60C2, 2, -4).err().filter(|_| units)
        }
        "Parameter value too high" => bench.put(0x6060, 0, 9).err(),
        "Parameter value too low" => bench.put(0x6060, 0, 0).err(),
        "Data cannot be transmitted or saved" => bench.put(0x1010, 1, 1).err(),
        "Data cannot be transmitted or saved because of device status" => {
            bench.nmt(0x01);
            bench.put(0x1600, 0, 0).err()
        }
        _ => None,
    }
}
