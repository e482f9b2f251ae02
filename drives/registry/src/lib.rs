//! The drives that lexican knows better than their data sheets, one row each.

use lexican_driver::Description;
use lexican_runtime::Duration;
use siko_ag03_1::sim::Model;
use simulator::servo::ServoModel;

pub use {kollmorgen_akd, siko_ag02, siko_ag03_1};

/// A drive of the library.
#[derive(Clone, Copy)]
pub struct KnownDrive {
    /// Its name there.
    pub library: &'static str,
    /// How it is moved.
    pub description: &'static Description,
    /// How it is simulated.
    pub model: DriveModel,
    /// Within which time it stands when its program is gone: protected as `Drive::connect` has it, in the middle of a travel.
    /// `drives/README.md` shows it; `simulation/tests/all/dead_man.rs` measures it.
    pub stands_within: Duration,
}

/// What a simulated drive is made of.
#[derive(Clone, Copy)]
pub enum DriveModel {
    /// A positioning drive of SIKO.
    Siko(&'static Model),
    /// A servo of CiA 402.
    Servo(&'static ServoModel),
}

/// All of them.
pub const DRIVES: &[KnownDrive] = &[
    KnownDrive {
        library: "kollmorgen/akd",
        description: &kollmorgen_akd::driver::AKD,
        model: DriveModel::Servo(&kollmorgen_akd::sim::MODEL),
        stands_within: Duration::from_millis(1300),
    },
    KnownDrive {
        library: "siko/ag02",
        description: &siko_ag02::driver::AG02,
        model: DriveModel::Siko(&siko_ag02::sim::MODEL),
        stands_within: Duration::from_millis(1500),
    },
    KnownDrive {
        library: "siko/ag03-1",
        description: &siko_ag03_1::driver::AG03_1,
        model: DriveModel::Siko(&siko_ag03_1::sim::MODEL),
        stands_within: Duration::from_millis(1300),
    },
];

/// The drive of this name in the library.
#[must_use]
pub fn find(library: &str) -> Option<&'static KnownDrive> {
    DRIVES.iter().find(|drive| drive.library == library)
}

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
