//! The SIKO AG03/1, firmware 4.01 or higher, English manual.

use lexican_driver::Codes;
use lexican_runtime::NodeId;
use siko_ag03_1::sim::inputs::Inputs;
use siko_ag03_1::sim::{MODEL, Model};
use siko_ag03_1::{fault, od};

use crate::code::{Code, Identity};
use crate::drive::{Drive, Interface};
use crate::siko::checks::Checks;
use crate::siko::rig::{NODE, Siko, Write};
use crate::siko::statements::LEFT_OPEN;
use crate::siko::tables;

/// The drive.
enum Ag031 {}

impl Siko for Ag031 {
    const MODEL: &'static Model = &MODEL;
    const CODES: &'static Codes = &fault::CODES;
    const PREPARED: &'static [Write] = &[];
    const GEARS: &'static [(u8, &'static str)] = &[(2, "24:1"), (3, "48:1")];
    const FILES: &'static str = r#"names = ["SIKOAG03/1.EDS", "SIKOAG03.EDS"]"#;
    const LASTING: &'static [(u8, u16)] = &[];
    const CHAPTERS: [&'static str; 2] = ["6", "7"];
    const RESERVED: &'static str = "reserved";
    const IS_TRANSLATED: bool = false;
    const NAMES: &'static [(u8, &'static str)] = &[
        (11, "Numerator"),
        (12, "Denominator"),
        (17, "Delta Inch"),
        (19, "Pos Type"),
        (25, "Stop mode Inching mode 2"),
        (30, "Offset Inching 2"),
    ];

    fn hinder(inputs: &mut Inputs) {
        inputs.output_stage_supply_100mv = 0;
    }

    fn bit_rate(value: u8) -> Option<&'static str> {
        od::CanBitRate(value).name()
    }
}

pub(super) fn left_open() -> Vec<String> {
    LEFT_OPEN.failures::<Ag031>()
}

pub(super) const DRIVE: Drive = Drive {
    name: "siko/ag03-1",
    vendor: "SIKO GmbH",
    title: "AG03/1",
    data_sheet: "eds/devices/siko/ag03-1/SIKOAG03.EDS",
    overlay: "eds/devices/siko/ag03-1/SIKOAG03.toml",
    folder: "tests/manual/ag03-1",
    report: "drives/siko-ag03-1/VERIFICATION.md",
    tables: tables::TABLES,
    exempt: tables::exempt(
        &[
            ("facts.csv", "7.2:communication profile", tables::DOCUMENT),
            ("facts.csv", "7.2:device profile", tables::PROFILE),
        ],
        &[tables::BATTERY],
    ),
    code: generated,
    node: NODE,
    arrays: &[0x1003, 0x1011, 0x607D, 0x6091],
    checks: Checks::<Ag031>::ALL,
    interface: Interface::CanOpen,
};

include!(concat!(env!("OUT_DIR"), "/siko_ag03_1.rs"));
