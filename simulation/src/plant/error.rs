//! What is wrong with a plant, where, and what to do about it.

use std::fmt::{self, Display};

use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, NodeId};
use lexican_toolbox::data_sheet::DataSheetError;
use lexican_toolbox::text::files::ReadError;
use lexican_toolbox::values::lookup::ObjectError;
use simulator::script::ScriptError;

use crate::command::Refusal;
use crate::device::SimulationError;

/// What is wrong with a plant.
#[derive(Debug)]
pub struct PlantError {
    /// Where in its file, if that could be read.
    pub place: Option<Place>,
    /// What is wrong there.
    pub problem: Box<Problem>,
}

/// A place in a file: `plant.toml:7: node 5`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: String,
    /// From 1.
    pub line: Option<usize>,
    /// Which device it is about.
    pub who: Option<String>,
}

/// What is wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// A file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It is no TOML, or has other keys or values than it may.
    #[error("{0}")]
    Syntax(String),
    /// There is no `[[node]]`.
    #[error("it has no devices")]
    NoDevices,
    /// A node-ID is given twice.
    #[error("there are two devices with node-ID {0}")]
    TwoNodes(NodeId),
    /// A name is given twice.
    #[error("there are two devices with the name {0:?}")]
    TwoNames(String),
    /// A name could not begin a line of stdin.
    #[error("this cannot be the name of a device")]
    NoName,
    /// The data sheet of a device.
    #[error(transparent)]
    DataSheet(#[from] DataSheetError),
    /// A device has both `script` and `[[node.step]]`.
    #[error("it has either a script or steps")]
    ScriptAndSteps,
    /// A setting without its `=`.
    #[error("{0:?} is no OBJECT = VALUE")]
    NoSetting(String),
    /// The object of a setting.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The value of a setting.
    #[error("{0}")]
    Value(String),
    /// The device refuses a setting.
    #[error("{setting:?}: {address}: {code}")]
    Refused {
        /// The line.
        setting: String,
        /// The object.
        address: Address,
        /// The reason.
        code: AbortCode,
    },
    /// An input of a device.
    #[error(transparent)]
    Input(Refusal),
    /// A step of a script.
    #[error("{}", .0.problem)]
    Step(ScriptError),
    /// The device cannot be simulated.
    #[error(transparent)]
    Device(#[from] SimulationError),
    /// The sender of a fault.
    #[error("{0} is none of the devices")]
    NoSender(String),
    /// The identifier of a fault.
    #[error("{0:X}h is no COB-ID")]
    NoCobId(u32),
    /// A delay without its time.
    #[error("a delay needs its time in ms: delay = 20")]
    NoDelay,
    /// The time of a delay with another action.
    #[error("the time of a delay belongs to action = \"delay\"")]
    OnlyDelay,
    /// More frames in a row than there are.
    #[error("there cannot be more in a row than there are frames: in-a-row is at most every")]
    TooManyInARow,
}

impl PlantError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> Option<String> {
        match &*self.problem {
            Problem::NoDevices => Some("each one is a table [[node]] with id and device".to_owned()),
            Problem::NoName => Some("a name begins the lines on stdin: it is a word, and no number".to_owned()),
            Problem::DataSheet(error) => error.remedy(),
            Problem::Object(error) => Some(error.advice()),
            Problem::Step(error) => Some(error.remedy.clone()),
            _ => None,
        }
    }
}

impl std::error::Error for PlantError {}

impl Display for PlantError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Some(place) => write!(f, "{place}: {}", self.problem),
            None => write!(f, "{}", self.problem),
        }
    }
}

impl Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(who) = &self.who {
            write!(f, ": {who}")?;
        }
        Ok(())
    }
}
