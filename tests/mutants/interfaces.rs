//! Each mutant of the drives' other interfaces is found, except in the files of [`NOT_YET`]: by their own tests, or by
//! the verification against the manual.

use std::path::Path;

use lexican_verify::{DRIVES, Inputs, finds};
use runner::Mutants;

#[path = "../../profibus/tests/all/any_bytes.rs"]
mod profibus_any_bytes;
#[path = "../../profibus/tests/all/master.rs"]
mod profibus_master;
#[path = "../../profibus/tests/all/slave.rs"]
mod profibus_slave;
#[path = "../../profibus/tests/all/station.rs"]
mod profibus_station;
#[path = "../../profibus/tests/all/trouble.rs"]
mod profibus_trouble;
#[path = "../../drives/siko/tests/all/gateway/mod.rs"]
mod siko_gateway;
#[path = "../../drives/siko-profibus/tests/all/carrier.rs"]
mod siko_profibus_carrier;
#[path = "../../drives/siko-profibus/tests/all/flow.rs"]
mod siko_profibus_flow;
#[path = "../../drives/siko-profibus/tests/all/parameters.rs"]
mod siko_profibus_parameters;
#[path = "../../drives/siko-profibus/tests/all/scripted/mod.rs"]
mod siko_profibus_scripted;
#[path = "../../drives/siko-serial/tests/all/authority.rs"]
mod siko_serial_authority;
#[path = "../../drives/siko-serial/tests/all/codec.rs"]
mod siko_serial_codec;
#[path = "../../drives/siko-serial/tests/all/door.rs"]
mod siko_serial_door;
#[path = "../../drives/siko-serial/tests/all/flow_charts.rs"]
mod siko_serial_flow_charts;
#[path = "../../drives/siko-serial/tests/all/trouble.rs"]
mod siko_serial_trouble;

// Support code of these tests.
#[path = "../../profibus/tests/all/random.rs"]
mod random;
#[path = "../../drives/siko-profibus/tests/all/rig.rs"]
mod rig;
#[path = "../../drives/siko-serial/tests/all/serial_rig.rs"]
mod serial_rig;
#[path = "../../profibus/tests/all/support.rs"]
mod support;

mod runner;
#[path = "interfaces_unfound.rs"]
mod unfound;

/// The names of tests in this file that a mutant is tried by, one after the other until one fails; the quicker ones
/// first.
const OF_SERIAL: &[&[&str]] = &[
    &["siko_serial_door::"],
    &[
        "siko_serial_authority::",
        "siko_serial_codec::a_command",
        "siko_serial_codec::every",
        "siko_serial_codec::an",
        "siko_serial_codec::the",
        "siko_serial_codec::what",
        "siko_serial_flow_charts::",
        "siko_serial_trouble::",
    ],
    &["it_agrees_with_its_manual"],
];
const OF_PROFIBUS: &[&[&str]] = &[
    &["unit_tests_of_profibus", "profibus_slave::", "profibus_station::", "profibus_master::"],
    &["profibus_trouble::", "siko_profibus_parameters::", "profibus_any_bytes::"],
];

const OF_GATEWAY: &[&[&str]] = &[&["siko_gateway::"]];
const OF_SIKO_PROFIBUS: &[&[&str]] = &[
    &["siko_profibus_scripted::"],
    &["siko_profibus_parameters::", "siko_profibus_carrier::"],
    &["siko_profibus_flow::"],
];

macro_rules! mutants_of {
    ($($test:ident: $package:ident, $name:ident;)*) => {
        $(#[test]
        fn $test() {
            use $package::mutant::{MUTANTS, PACKAGE, VARIABLE};
            let mutants = Mutants {
                package: PACKAGE,
                variable: VARIABLE,
                names: MUTANTS,
                are_tried: |name| is_tried(PACKAGE, name),
                unfound: unfound::$name,
                trials: $name,
                samples: 3,
            };
            println!("{}", mutants.find());
        })*
    };
}

/// Files of which some mutants are not found, or not tried, by crate.
const NOT_YET: &[(&str, &[&str])] =
    &[("lexican-mutated-profibus", &["virtual_bus"]), ("lexican-mutated-siko-serial", &["sim", "sim/line"])];

/// Of `lexican-siko`, only the gateway; `mutants.rs` tries the rest.
fn is_tried(package: &str, name: &str) -> bool {
    let file = name.split(' ').next().unwrap();
    let is_left_out = NOT_YET.iter().any(|(left, files)| *left == package && files.contains(&file));
    !is_left_out && (package != "lexican-mutated-siko" || file.starts_with("gateway"))
}

mutants_of! {
    every_mutant_of_the_serial_port_is_found: siko_serial, OF_SERIAL;
    every_mutant_of_the_gateway_is_found: siko, OF_GATEWAY;
    every_mutant_of_profibus_is_found: lexican_profibus, OF_PROFIBUS;
    every_mutant_of_the_drives_on_profibus_is_found: siko_profibus, OF_SIKO_PROFIBUS;
}

/// The tests beside the sources.
#[test]
fn unit_tests_of_profibus() {
    lexican_profibus::mutant::TESTS.iter().for_each(|(_, test)| test());
}

/// The drive at its serial port, or the mutant that the environment names.
#[test]
fn it_agrees_with_its_manual() {
    let drive = DRIVES.iter().find(|drive| drive.name == "siko/ag02-serial").unwrap();
    let inputs = Inputs::read(drive, &Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
    assert!(!finds(drive, &inputs));
}
