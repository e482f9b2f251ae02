//! Mutants of the simulated drive that are not found because they behave the same.

/// Their names, and why they behave the same.
pub(crate) const UNFOUND: &[(&str, &str)] = &[
    ("drive power_on: false => true", "the same parameters once more"),
    ("drive power_on: false => true #2", "a frame sets it anew before there are commands"),
    ("drive set_inputs: self.power == Power::Off => false", WAKES_ANEW),
    ("drive set_inputs: ! inputs.control_is_supplied () => false", WAKES_ANEW),
    ("drive set_inputs: self.power == Power::Off || ! inputs.control_is_supplied () => false", WAKES_ANEW),
    ("drive set_inputs: was_reported => true", "what was not reported leaves nothing to clear"),
    ("drive set_inputs: self.is_running () => true", "a drive that is off has reported nothing"),
    ("drive set_inputs: 0xFF => 0xFF - 1", GENERIC),
    ("drive set_inputs: 0xFF => 0xFF - 1 #2", GENERIC),
    ("drive settle_running: 0xFF => 0xFF - 1", GENERIC),
    ("drive settle_running: std::mem::take (& mut self.parameters_written) => true", "the same parameters once more"),
    ("drive settle_running: parameters != self.controller.parameters => true", "the same parameters once more"),
    ("drive turn_shaft: self.settle (now) ; => ", "the bus asks the drive at the same time, which settles it"),
    ("leds flashes: at < code => at <= code", "where the code ends, a gap begins: it is dark by the other condition"),
    ("motion lags: TINY => another number", ROUNDING),
    (
        "motion lags: state.velocity.abs () >= self.ceiling - TINY => state.velocity.abs () > self.ceiling - TINY",
        ROUNDING,
    ),
    ("node changes_only_when_called: true => false", "it is asked more often, and says the same"),
    ("node handle_frame: self.run_script (now) ; => ", "the deadline of the step is the same time"),
    ("node next_change: 4 => 4 + 1", "there is no fifth TPDO"),
    ("node next_change: ! tpdo.is_active () => false", "it looks once more, and sends nothing"),
    (
        "node next_change: readings.into_iter ().any (| address | tpdo.mapping ().maps (address)) => true",
        "it looks more often, and sends nothing more",
    ),
    (
        "node with_code_of_table_19: frame.id () != CobId::of_node (SDO_ANSWER, self.node ()) => false",
        "no other frame of eight bytes begins with 80h",
    ),
    ("objects check_state: NmtState::PreOperational => no arm", "every object that has a rule can be written there"),
    (
        "objects fit: storage.number (range.address) > high => storage.number (range.address) >= high",
        "the same value once more",
    ),
    ("power initialise: self.parameters_written = true ; => ", STARTS),
    ("power initialise: true => false", STARTS),
    ("status observe: ROUNDING => another number", ROUNDING),
    (
        "status observe: velocity >= target - f64::from (window) - ROUNDING => velocity > target - f64::from (window) - ROUNDING",
        ROUNDING,
    ),
    ("status observe: ROUNDING => another number #2", ROUNDING),
    (
        "status observe: velocity > target + f64::from (window) + ROUNDING => velocity >= target + f64::from (window) + ROUNDING",
        ROUNDING,
    ),
    ("switches from_str: 10 => 10 + 1", "eleven digits are refused by their count"),
    ("switches from_str: count < 10 => count <= 10", "eleven digits are refused by their count"),
    ("switches new: TERMINATION => another number", "the other number has its bits, too"),
];

const WAKES_ANEW: &str = "what is switched on looks at the world anew, and has no faults";
const STARTS: &str = "a device that starts writes objects, which says it, too";
const GENERIC: &str = "the generic bit goes with the last of the others";

/// A velocity changes by this much in far less than a microsecond, the resolution of time.
const ROUNDING: &str = "far below what can be read";
