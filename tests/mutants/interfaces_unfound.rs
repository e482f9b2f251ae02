//! Mutants of the drives' other interfaces that are not found because they behave the same: their names, and why.

pub(crate) const OF_SERIAL: &[(&str, &str)] = &[
    ("answer fits: false => true", "an answer without content has no other bytes than those at its end"),
    ("client new: false => true #2", "each command sets it before it is read"),
];

pub(crate) const OF_PROFIBUS: &[(&str, &str)] = &[
    ("bus poll: true => false", "what polls, polls again a little later"),
    ("bus poll: true => false #5", "what polls, polls again a little later"),
    ("bus wait: TURN => another number", "no test measures the time of the machine"),
    ("bus wait: until.since (now).min (TURN) => max", "no test measures the time of the machine"),
    ("slave new: false => true #3", "Set_Prm clears it"),
    ("virtual_bus new: 300 => 300 + 1", "any slot time does that is long enough for an answer"),
    ("virtual_bus new: 100 => 100 + 1", "the watchdog counts in steps of ten milliseconds"),
    ("virtual_bus new: 3 => 3 + 1", "no other master is at this address either"),
];

pub(crate) const OF_GATEWAY: &[(&str, &str)] = &[
    (
        "gateway/face new: false => true",
        "the drive is taken for disabled when it answers for the first time, which clears it",
    ),
    ("gateway/face new: false => true #2", "the order that enables the drive clears it"),
];

pub(crate) const OF_SIKO_PROFIBUS: &[(&str, &str)] = &[
    ("bus options: 100 => 100 + 1", "the simulated slave answers earlier"),
    ("drive take_target: held == Ok (target) => false", "what the drive holds may be written again"),
    ("drive write_object: true => false", "the objects of a drive take their values whole"),
    ("master new: true => false", "the first exchange carries the first word"),
];
