//! The drives that lexican knows beyond their data sheets, one row each.

use lexican_driver::Description;
use lexican_runtime::Duration;
use siko_ag03_1::sim::Model;
use simulator::servo::ServoModel;

pub use {kollmorgen_akd, siko_ag02, siko_ag03_1};

/// A drive of the library.
#[derive(Clone, Copy)]
pub struct KnownDrive {
    /// The name in the library, such as "siko/ag02".
    pub library: &'static str,
    /// For the driver.
    pub description: &'static Description,
    /// For the simulator.
    pub model: DriveModel,
    /// How long it may take to stand after its program dies in the middle of a travel, with the protection of
    /// `Drive::connect`. `drives/README.md` shows it; `simulation/tests/all/dead_man.rs` measures it.
    pub stands_within: Duration,
}

/// The model of a simulated drive.
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

/// The README, so that its examples are compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
