//! The SIKO AG03/1, firmware 4.01 or higher, English manual.

use lexican_runtime::NodeId;
use siko_ag03_1::sim::{BIT_RATES, SimulatedDrive};

use crate::checker::Checker;
use crate::code::{Code, Identity};
use crate::drive::{Case, Drive};
use crate::kinds::{cia402, network, objects, pdo, prose, sheet, transmission};
use crate::siko;

type S = SimulatedDrive;

pub(super) const DRIVE: Drive = Drive {
    name: "siko/ag03-1",
    vendor: "SIKO GmbH",
    title: "AG03/1",
    data_sheet: "eds/devices/siko/ag03-1/SIKOAG03.EDS",
    overlay: "eds/devices/siko/ag03-1/SIKOAG03.toml",
    folder: "tests/manual/ag03-1",
    report: "drives/siko-ag03-1/VERIFICATION.md",
    tables: siko::tables::TABLES,
    exempt: siko::tables::EXEMPT,
    code: generated,
    node: siko::bench::NODE,
    arrays: &[0x1003, 0x1011, 0x607D, 0x6091],
    checks: &[
        sheet::check::<S>,
        file,
        siko::values::check,
        siko::formats::check,
        objects::check::<S>,
        siko::objects::check,
        siko::parameters::check,
        |checker, _| network::commands::<S>(checker, siko::network::starts_cold),
        |checker, _| network::states::<S>(checker, siko::network::in_nmt_state),
        |checker, _| network::sdo_commands::<S>(checker, WRITABLE, READABLE),
        |checker, case| network::sdo_aborts(checker, case, siko::network::refused),
        siko::network::sdo_examples,
        siko::network::node_address,
        |checker, _| siko::network::bus_termination(checker),
        |checker, _| siko::leds::check(checker),
        siko::examples::check,
        |checker, _| cia402::states::<S>(checker, siko::states::beyond),
        |checker, _| cia402::commands::<S>(checker),
        cia402::transitions::<S>,
        siko::faults::check,
        siko::facts::check,
        |checker, case| siko::statements::STATEMENTS.iter().for_each(|all| prose::statements(checker, case, all)),
        pdo::mappings::<S>,
        |checker, case| pdo::layouts::<S>(checker, case, siko::network::prepare_layouts, siko::network::sample),
        network::identifiers::<S>,
        |checker, case| transmission::check::<S>(checker, case, PDOS),
        siko::bits::check,
    ],
};

include!(concat!(env!("OUT_DIR"), "/siko_ag03_1.rs"));

/// Objects of four, two and one byte: a command to write fits one of them only.
const WRITABLE: [(u8, u16); 3] = [(4, 0x607C), (2, 0x1017), (1, 0x100D)];
const READABLE: [(u8, u16); 3] = [(4, 0x1000), (2, 0x6041), (1, 0x1001)];

/// Parameters of the PDOs that map something.
const PDOS: &[u16] = &[0x1400, 0x1402, 0x1403, 0x1800, 0x1802, 0x1803];

/// The file's names and the bit rates of `[DeviceInfo]`.
fn file(checker: &mut Checker<'_>, case: &Case<'_>) {
    // Chapter 7.11 has two names for the file; both find it.
    let names = case.sheet.overlay.lines().find(|line| line.starts_with("names = "));
    let both = names == Some(r#"names = ["SIKOAG03/1.EDS", "SIKOAG03.EDS"]"#);
    checker.require(both, || format!("the overlay answers to {names:?}"));
    // The bit rates that have a key, of those that the drive can be set to.
    let keys = |rate: &u16| siko::values::BIT_RATE_KEYS.contains(rate);
    let rates: Vec<u16> = BIT_RATES.iter().map(|rate| (rate / 1000) as u16).filter(keys).collect();
    let listed = &case.sheet.device.info.bit_rates_kbit;
    checker.require(*listed == rates, || format!("BaudRate: {listed:?} in the data sheet, {rates:?} in the drive"));
}
