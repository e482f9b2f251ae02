//! Orders to drives.

use serde::{Deserialize, Serialize};

/// An order to a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// To OPERATION ENABLED.
    Enable,
    /// To SWITCH ON DISABLED.
    Disable,
    /// Leave FAULT.
    ResetFault,
    /// Travel to a position.
    MoveTo,
    /// Travel by a distance.
    Step,
    /// Run at a velocity until it is stopped.
    Run,
    /// Home.
    Home,
    /// Stop with the programmed deceleration.
    Stop,
    /// Stop with full deceleration.
    QuickStop,
    /// Go on with an interrupted travel.
    Resume,
    /// Drop the rest of an interrupted travel, and disable the drive.
    Drop,
}
