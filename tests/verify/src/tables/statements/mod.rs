//! What chapters 2 to 7 say in running text, clause by clause: each clause is there only when the drive, asked for it,
//! does what it says.

mod network;
mod travelling;
mod trouble;

use std::collections::BTreeMap;

use super::claims::{Clauses, said};
use super::sheet::Sheet;
use crate::bench::{Bench, Memory, once};
use crate::checker::{Against, Checker};
use crate::manual::Manual;

pub(crate) fn check(checker: &mut Checker<'_>, _: &Manual, _: &Sheet) {
    static ANSWERS: Memory<&str, String> = Memory::new(BTreeMap::new());
    for &(key, clauses) in STATEMENTS {
        let Some(row) = checker.row("statements.csv", key) else { continue };
        let found = once(&ANSWERS, key, || said(clauses(), "; "));
        checker.cell(row, "statement", Against::Drive, found);
    }
}

/// Chapter and subject of a statement, and what it says.
type Statement = (&'static str, fn() -> Clauses);

const STATEMENTS: &[Statement] = &[
    ("2.2.1:ramp", travelling::ramp),
    ("2.2.1:deceleration", travelling::deceleration),
    ("2.2.1:changed parameters", travelling::changed_parameters),
    ("2.2.1:target", travelling::target),
    ("2.2.1.1:loop+", || travelling::loops(1)),
    ("2.2.1.1:loop-", || travelling::loops(2)),
    ("2.2.1.1:loop length", travelling::loop_length),
    ("2.2.1.2:mode", travelling::inching_mode),
    ("2.2.1.2:ramp", travelling::inching_ramp),
    ("2.2.1.2:loop", travelling::inching_loop),
    ("2.2.1.2:inching 1", travelling::inching_1),
    ("2.2.1.2:inching 2", travelling::inching_2),
    ("2.2.1.2:keys", travelling::keys),
    ("2.2.1.2:keys and conditions", travelling::key_conditions),
    ("2.2.1.2:outside limits", travelling::outside_limits),
    ("2.2.2:ramp", travelling::velocity_ramp),
    ("2.2.2:new target", travelling::new_velocity),
    ("2.2.2:limits", travelling::velocity_limits),
    ("2.3:threshold", trouble::torque_threshold),
    ("2.3:deactivation", trouble::torque_deactivation),
    ("2.3:state", trouble::torque_state),
    ("2.3:mode", trouble::torque_mode),
    ("2.4:restore", trouble::restore_by_switches),
    ("2.4:acknowledgement", trouble::restore_acknowledged),
    ("2.5:power failure", trouble::power_failure),
    ("3:calibration", trouble::calibration),
    ("5.1:warnings", trouble::warnings),
    ("5.2:stop", trouble::fault_stop),
    ("5.2:buffer", trouble::fault_buffer),
    ("5.2:reset", trouble::fault_reset),
    ("6:window", trouble::window),
    ("6:spindle pitch", trouble::spindle_pitch),
    ("6:limits", trouble::limits),
    ("6:calibration value", trouble::calibration_value),
    ("6:setpoint", trouble::setpoint),
    ("6:offset inching 2", trouble::inching_offset),
    ("6:velocity mode", trouble::without_meaning),
    ("7.2.2:NMT", network::nmt),
    ("7.2.2.2:boot-up", network::boot_up),
    ("7.2.2.3:PDO parameters", network::pdo_parameters),
    ("7.2.3:SYNC", network::sync),
    ("7.2.4:PDOs", network::pdos),
    ("7.2.5:default types", network::default_types),
    ("7.2.6:default types", network::receive_types),
    ("7.2.6.2:target", network::absolute_target),
    ("7.2.6.2:synchronous start", network::synchronous_start),
    ("7.2.7:SDO", network::sdo),
    ("7.2.7:states", network::sdo_states),
    ("7.2.7.1:error response", network::error_response),
    ("7.2.9:emergency", network::emergency),
    ("7.2.9:no error", network::no_error),
    ("7.2.9:identifier", network::emergency_identifier),
    ("7.2.9:states", network::emergency_states),
    ("7.2.10:heartbeat", network::heartbeat),
    ("7.2.10:and guarding", network::exclusive),
    ("7.2.11:guarding", network::guarding),
    ("7.2.11:life time", network::life_time),
    ("7.3:network", network::state_machine_network),
    ("7.3:quick stop", network::quick_stop),
    ("7.3:fault", network::fault_state),
    ("7.10:bit rate", network::bit_rate),
    ("7.12.2.4:latest", network::latest_fault),
    ("7.12.2.10:restore", network::restored),
    ("7.13:switches", network::switches),
];

fn position(bench: &Bench) -> i32 {
    bench.see(|drive, now| drive.position(now))
}

fn velocity(bench: &Bench) -> i32 {
    bench.see(|drive, now| drive.velocity(now))
}

/// In increments/s, without rounding.
fn speed(bench: &Bench) -> f64 {
    bench.see(|drive, now| drive.shaft(now).velocity)
}

fn is_fault(bench: &Bench) -> bool {
    bench.status() & 0x4F == 0x08
}

/// 1002h, bit 7.
fn is_released(bench: &Bench) -> bool {
    bench.system() >> 7 & 1 == 1
}

/// Enabled, with what `set` has written before.
pub(super) fn enabled_with(set: &[(u16, u8, i64, u8)]) -> Bench {
    let mut bench = Bench::new();
    bench.set(set);
    bench.nmt(0x01);
    bench.enable();
    bench.control(0x000F);
    bench
}

/// Velocities after each of these times, in milliseconds from the start.
pub(super) fn velocities(bench: &mut Bench, times: &[u64]) -> Vec<i32> {
    let mut passed = 0;
    let mut at = |time: &u64| {
        bench.hear(time - passed);
        passed = *time;
        velocity(bench)
    };
    times.iter().map(&mut at).collect()
}

/// How far the shaft turns until it stands, in increments.
pub(super) fn way_to_rest(bench: &mut Bench) -> i32 {
    let before = position(bench);
    bench.hear(30_000);
    if speed(bench) == 0.0 { position(bench) - before } else { i32::MAX }
}

/// The positions that the drive passes, every 20 ms.
fn way(bench: &mut Bench, ms: u64) -> Vec<i32> {
    let mut look = || {
        bench.hear(20);
        position(bench)
    };
    (0..ms / 20).map(|_| look()).collect()
}

/// Faster by so many rev/min each 100 ms.
const A_POS: (u16, u8) = (0x2410, 0x04);
const V_POS: (u16, u8) = (0x2410, 0x05);
const A_ROT: (u16, u8) = (0x2410, 0x06);
const A_INCH: (u16, u8) = (0x2410, 0x08);
const V_INCH: (u16, u8) = (0x2410, 0x09);
const D_POS: (u16, u8) = (0x2410, 0x0A);

const fn one((index, sub): (u16, u8), value: i64) -> (u16, u8, i64, u8) {
    (index, sub, value, 1)
}
