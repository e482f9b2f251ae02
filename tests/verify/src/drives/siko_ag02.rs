//! The SIKO AG02, firmware 2.00 or higher, German manual.

use lexican_driver::Codes;
use lexican_runtime::NodeId;
use siko_ag02::sim::inputs::Inputs;
use siko_ag02::sim::{MODEL, Model};
use siko_ag02::{fault, od};

use crate::code::{Code, Identity};
use crate::drive::{Drive, Interface};
use crate::siko::checks::Checks;
use crate::siko::rig::{EMCY, NODE, Siko, V_INCH, V_POS, Write, one};
use crate::siko::statements::LEFT_OPEN;
use crate::siko::tables;

/// The drive.
enum Ag02 {}

impl Siko for Ag02 {
    const MODEL: &'static Model = &MODEL;
    const CODES: &'static Codes = &fault::CODES;
    const PREPARED: &'static [Write] = &[(0x1014, 0, 1 << 30 | EMCY, 4), one(V_POS, 30), one(V_INCH, 30)];
    const GEARS: &'static [(u8, &'static str)] = &[(1, "55:1"), (2, "62:1"), (3, "135:1")];
    const FILES: &'static str = r#"names = ["SIKOAG02.EDS"]"#;
    const LASTING: &'static [(u8, u16)] = &[(22, 0x2101), (23, 0x2100)];
    const CHAPTERS: [&'static str; 2] = ["8", "10"];
    const RESERVED: &'static str = "reserviert";
    const IS_TRANSLATED: bool = true;
    const NAMES: &'static [(u8, &'static str)] = &[
        (11, "ue-Zaehler"),
        (12, "ue-Nenner"),
        (17, "Delta Tipp"),
        (19, "Pos-Art"),
        (22, "Adresse"),
        (25, "Stoppmode Tipp 2"),
    ];

    fn hinder(inputs: &mut Inputs) {
        inputs.enable = false;
    }

    fn bit_rate(value: u8) -> Option<&'static str> {
        od::CanBitRate(value).name()
    }
}

pub(super) fn left_open() -> Vec<String> {
    LEFT_OPEN.failures::<Ag02>()
}

pub(super) const DRIVE: Drive = Drive {
    name: "siko/ag02",
    vendor: "SIKO GmbH",
    title: "AG02",
    data_sheet: "eds/devices/siko/ag02/SIKOAG02.EDS",
    overlay: "eds/devices/siko/ag02/SIKOAG02.toml",
    folder: "tests/manual/ag02",
    report: "drives/siko-ag02/VERIFICATION.md",
    tables: tables::TABLES,
    exempt: tables::exempt(
        &[
            ("facts.csv", "10.2:communication profile", tables::DOCUMENT),
            ("facts.csv", "10.2:device profile", tables::PROFILE),
        ],
        &[
            tables::BATTERY,
            (
                "acknowledge by S11103",
                "a command of the serial protocol: by an edge of bit 7 of 6040h, the drive does it",
            ),
        ],
    ),
    code: generated,
    node: NODE,
    arrays: &[0x1003, 0x1011, 0x607D, 0x6091],
    checks: Checks::<Ag02>::ALL,
    interface: Interface::CanOpen,
};

include!(concat!(env!("OUT_DIR"), "/siko_ag02.rs"));
