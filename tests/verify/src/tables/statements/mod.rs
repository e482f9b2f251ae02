//! What chapters 2 to 7 say in running text, clause by clause: each clause is there only when the drive, asked for it,
//! does what it says.

mod network;
mod parameter;
mod travelling;
mod trouble;

use std::collections::BTreeMap;

use super::claims::{Clauses, said};
use super::sheet::Sheet;
use crate::bench::{Memory, once};
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
