//! Which services a device has.

use core::fmt::Debug;

use super::behaviour::{Behaves, Behaviour};
use crate::service::choice::{Choice, With};

/// The services of CiA 301 that a [`Device`](super::Device) may have or leave out. All devices have NMT, SDO, PDO and a
/// heartbeat; how many servers, PDOs and heartbeats of others there are, its numbers say, and 0 leaves the code out, too.
///
/// A write that asks for a service which is left out is refused with
/// [`AbortCode::DEVICE_INCOMPATIBLE`](crate::AbortCode::DEVICE_INCOMPATIBLE): a guard time or life time factor other than
/// 0, and TIME that exists. Defaults that ask for it are among
/// [`Device::misconfigured`](super::Device::misconfigured). A data sheet of such firmware has none of these objects.
///
/// Firmware that has no room for all of them says which it wants. What each one costs is in `tests/size/README.md`.
///
/// ```
/// use lexican_runtime::device::{Cia301, Device, Selection, With, Without};
///
/// /// A sensor that answers in segments, and is watched by its heartbeat.
/// #[derive(Clone, Copy, Debug)]
/// struct Sensor;
///
/// impl Selection for Sensor {
///     type Blocks = Without;
///     type Guarding = Without;
///     type Time = Without;
///     type Behaviour = Cia301;
/// }
///
/// type Firmware = Device<0, 4, 1, 0, 8, Sensor>;
/// assert!(size_of::<Firmware>() < size_of::<Device<0, 4, 1, 0, 8>>());
/// ```
pub trait Selection: Copy + Debug + Send + Sync + 'static {
    /// SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.15). Without it, its requests are answered with
    /// [`AbortCode::UNKNOWN_COMMAND`](crate::AbortCode::UNKNOWN_COMMAND).
    type Blocks: Choice;
    /// Node and life guarding (100Ch, 100Dh).
    type Guarding: Choice;
    /// TIME (1012h).
    type Time: Choice;
    /// What the device does where CiA 301 leaves it open: a [`Behaviour`], or a constant.
    type Behaviour: Behaves;
}

/// All services: the default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Everything;

impl Selection for Everything {
    type Blocks = With;
    type Guarding = With;
    type Time = With;
    type Behaviour = Behaviour;
}
