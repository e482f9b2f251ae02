//! The Kollmorgen AKD, manual "AKD CANopen Communication" of October 2011.

mod behaviour;
mod examples;
mod simulated;
mod words;

use kollmorgen_akd::fault;
use kollmorgen_akd::sim::MODEL;
use lexican_runtime::NodeId;

use self::examples::Drives;
use self::simulated::{Akd, Simulated};
use crate::code::{Code, Identity};
use crate::drive::{Drive, Interface};
use crate::exempt::Exempt;
use crate::kinds::terms::Place;
use crate::kinds::{
    cia402, descriptions, emcy, formats, frames, homing, network, pdo, prose, sheet, simulation, terms, values,
};
use crate::manual::Keys;
use crate::rig::once;
use crate::servo::{self, OfModel};

const TABLES: Keys = &[
    ("baud_rates.csv", &["value"]),
    ("commands.csv", &["command"]),
    ("descriptions.csv", &["index", "subindex"]),
    ("emergency.csv", &["code"]),
    ("encodings.csv", &["data_type", "value"]),
    ("errata.csv", &["id"]),
    ("formats.csv", &["address", "bits", "value"]),
    ("frames.csv", &["frame"]),
    ("homing_methods.csv", &["method"]),
    ("identifiers.csv", &["object"]),
    ("mode_bits.csv", &["object", "bit", "mode"]),
    ("names.csv", &["index", "subindex"]),
    ("nmt.csv", &["command"]),
    ("objects.csv", &["index", "subindex"]),
    ("pdo_mappings.csv", &["index", "position"]),
    ("sdo_aborts.csv", &["code"]),
    ("sdo_commands.csv", &["hex", "command"]),
    ("sections.csv", &["chapter", "index"]),
    ("statements.csv", &["chapter", "subject"]),
    ("states.csv", &["state"]),
    ("terms.csv", &["type", "value"]),
    ("transitions.csv", &["number"]),
    ("values.csv", &["address", "value"]),
];

/// Types whose names are in other tables.
const PLACES: &[(&str, Place)] = &[("EmergencyCode", Place::Elsewhere), ("HomingMethod", Place::Elsewhere)];

pub(super) fn left_open() -> Vec<String> {
    behaviour::LEFT_OPEN.failures::<Simulated>()
}

pub(super) const DRIVE: Drive = Drive {
    name: "kollmorgen/akd",
    vendor: "Kollmorgen",
    title: "AKD",
    data_sheet: "eds/devices/kollmorgen/akd/AKD.EDS",
    overlay: "eds/devices/kollmorgen/akd/AKD.toml",
    folder: "tests/manual/akd",
    report: "drives/kollmorgen-akd/VERIFICATION.md",
    tables: TABLES,
    exempt: Exempt { columns: words::COLUMNS, rows: words::ROWS, clauses: words::CLAUSES },
    code: generated,
    node: Akd::NODE,
    // 7.1 has object codes.
    arrays: &[],
    checks: &[
        sheet::check::<Simulated>,
        |checker, case| terms::check(checker, case, PLACES),
        values::check::<Simulated>,
        |checker, case| formats::check(checker, case, words::part, behaviour::shown, &["60FD:00"]),
        |checker, case| {
            let tables = &["objects.csv", "descriptions.csv"];
            descriptions::check::<Simulated>(checker, case, tables, &[0x2014, 0x2015, 0x2016, 0x2017]);
        },
        |checker, case| {
            let names = [("objects.csv", "description"), ("objects.csv", "ascii"), ("descriptions.csv", "name")];
            descriptions::names(checker, case, &names);
        },
        |checker, case| descriptions::sections(checker, case),
        words::bit_rates,
        |checker, case| frames::sent::<Simulated>(checker, case, examples::CHAPTERS, examples::made),
        |checker, case| frames::answered::<Simulated, _>(checker, case, examples::made, Drives::of_chapter),
        |checker, case| network::sdo_specifiers(checker, case),
        |checker, case| network::encodings(checker, case),
        |checker, case| network::sdo_aborts::<Simulated>(checker, case, behaviour::refused, words::NEVER_SENT),
        |checker, _| network::effects::<Simulated>(checker, behaviour::effect),
        network::connection_set::<Simulated>,
        pdo::mappings::<Simulated>,
        |checker, _| cia402::states::<Simulated>(checker, |_, _, _, _| {}),
        |checker, _| cia402::commands::<Simulated>(checker),
        |checker, _| cia402::events::<Simulated>(checker, behaviour::action),
        |checker, case| cia402::mode_bits::<Simulated>(checker, case, MODEL.modes, behaviour::mode_bit),
        |checker, case| {
            let used = once::<Simulated, _>((), servo::used::<Akd>);
            simulation::entries(checker, case, |address| used.contains(&address));
            simulation::bits(checker, case, |index, bit| behaviour::shown(index, bit).is_some());
        },
        |checker, case| prose::statements::<Simulated>(checker, case, &behaviour::SCRIPT, str::to_owned),
        |checker, _| prose::left_open::<Simulated>(checker, &behaviour::LEFT_OPEN),
        |checker, case| homing::check::<Simulated>(checker, case, behaviour::homes),
        |checker, case| emcy::numbers::<Simulated>(checker, case, &fault::CODES, behaviour::raised),
    ],
    interface: Interface::CanOpen,
};

include!(concat!(env!("OUT_DIR"), "/kollmorgen_akd.rs"));
