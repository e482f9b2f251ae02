//! SIKO's drives on PROFIBUS-DP: chapter 9 of the AG02's German manual, and chapter 7 of the AG03/1's English one.

use siko_profibus::Model;

use crate::drive::{Drive, Interface};
use crate::siko::profibus::{self, Checks, Dp};

const INTERFACE: Interface = Interface::Other {
    section: "profibus",
    code: "codec and tables of `lexican-profibus` and `lexican-siko-profibus`",
    over: "behind a master on a virtual line",
};

enum Ag02 {}

impl Dp for Ag02 {
    const MODEL: &'static Model = &siko_profibus::AG02;
    const FORMATS: [&'static str; 4] = ["Wort", "Wort*", "Doppelwort", "Array [10] Wort"];
    const RESERVED: &'static str = "reserviert";
    const SWITCHES: usize = 0;
    const BOXES: &'static [(&'static str, usize)] = &[("13", 15), ("14", 9)];
}

pub(super) const AG02: Drive = Drive {
    name: "siko/ag02-profibus",
    title: "AG02 on PROFIBUS-DP",
    folder: "tests/manual/ag02-profibus",
    report: "drives/siko-profibus/VERIFICATION-AG02.md",
    tables: profibus::TABLES,
    exempt: profibus::EXEMPT,
    checks: Checks::<Ag02>::ALL,
    interface: INTERFACE,
    ..super::siko_ag02::DRIVE
};

enum Ag031 {}

impl Dp for Ag031 {
    const MODEL: &'static Model = &siko_profibus::AG03_1;
    const FORMATS: [&'static str; 4] = ["word", "word*", "double word", "Array [10] word"];
    const RESERVED: &'static str = "reserved";
    const SWITCHES: usize = 7;
    // The figures of this manual are lost.
    const BOXES: &'static [(&'static str, usize)] = &[];
}

pub(super) const AG03_1: Drive = Drive {
    name: "siko/ag03-1-profibus",
    title: "AG03/1 on PROFIBUS-DP",
    folder: "tests/manual/ag03-1-profibus",
    report: "drives/siko-profibus/VERIFICATION-AG03-1.md",
    tables: profibus::TABLES,
    exempt: profibus::EXEMPT,
    checks: Checks::<Ag031>::ALL,
    interface: INTERFACE,
    ..super::siko_ag03_1::DRIVE
};
