//! The serial port of the SIKO AG02: chapter 6 of the German manual, and what other chapters say about this port.

use crate::drive::{Drive, Interface};
use crate::siko::serial;

pub(super) const DRIVE: Drive = Drive {
    name: "siko/ag02-serial",
    title: "serial port of the AG02",
    folder: "tests/manual/ag02-serial",
    report: "drives/siko-serial/VERIFICATION.md",
    tables: serial::TABLES,
    exempt: serial::EXEMPT,
    checks: serial::CHECKS,
    interface: Interface::Other {
        section: "serial",
        code: "codec and tables of `lexican-siko-serial`",
        over: "at the end of a line",
    },
    ..super::siko_ag02::DRIVE
};
