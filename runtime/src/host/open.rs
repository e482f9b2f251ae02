//! Opening links by URL.

use std::boxed::Box;
use std::string::String;

use super::{BusUrl, Link, Replay, ReplayError};

impl BusUrl {
    /// Opens the bus.
    ///
    /// Errors: A simulation cannot be opened here: this crate has no simulators, and no serial protocols of devices.
    pub fn open(&self) -> Result<Box<dyn Link + Send>, OpenError> {
        match self {
            BusUrl::SocketCan { interface } => open_socketcan(interface),
            BusUrl::Slcan { port, bit_rate, baud } => open_slcan(port, *bit_rate, *baud),
            BusUrl::Serial { port, .. } | BusUrl::Profibus { port, .. } => {
                Err(OpenError::Serial { port: port.clone() })
            }
            BusUrl::Simulation { device, .. } => Err(OpenError::Simulation { device: device.clone() }),
            BusUrl::Log { file, interface, pace } => Ok(Box::new(Replay::open(file, interface.as_deref(), *pace)?)),
        }
    }
}

#[cfg(all(feature = "socketcan", target_os = "linux"))]
fn open_socketcan(interface: &str) -> Result<Box<dyn Link + Send>, OpenError> {
    Ok(Box::new(super::socketcan::SocketCan::open(interface)?))
}

#[cfg(not(all(feature = "socketcan", target_os = "linux")))]
fn open_socketcan(interface: &str) -> Result<Box<dyn Link + Send>, OpenError> {
    let bus = String::from(interface);
    Err(if cfg!(target_os = "linux") {
        OpenError::NotBuilt { bus, feature: "socketcan" }
    } else {
        OpenError::NotLinux { bus }
    })
}

#[cfg(feature = "slcan")]
fn open_slcan(port: &str, bit_rate: Option<u32>, baud: u32) -> Result<Box<dyn Link + Send>, OpenError> {
    Ok(Box::new(super::slcan::Slcan::open(port, super::slcan::Settings { bit_rate, baud })?))
}

#[cfg(not(feature = "slcan"))]
fn open_slcan(port: &str, _: Option<u32>, _: u32) -> Result<Box<dyn Link + Send>, OpenError> {
    Err(OpenError::NotBuilt { bus: String::from(port), feature: "slcan" })
}

/// Why a bus cannot be opened, with a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum OpenError {
    /// A CAN interface.
    #[cfg(all(feature = "socketcan", target_os = "linux"))]
    #[error(transparent)]
    SocketCan(#[from] super::socketcan::SocketCanError),
    /// A serial adapter.
    #[cfg(feature = "slcan")]
    #[error(transparent)]
    Slcan(#[from] super::slcan::SlcanError),
    #[error(transparent)]
    Log(#[from] ReplayError),
    /// The feature for it is off.
    #[error("{bus} cannot be opened: this program was built without the feature `{feature}` of lexican-runtime")]
    NotBuilt { bus: String, feature: &'static str },
    /// Only Linux has SocketCAN.
    #[error("{bus} cannot be opened: only Linux has SocketCAN; use a serial adapter: slcan:COM3?bitrate=500000")]
    NotLinux { bus: String },
    /// The serial protocols of devices, and PROFIBUS, are not part of this crate.
    #[error(
        "{port} cannot be opened as a link: a device's other interface is opened by the program that has its protocol"
    )]
    Serial { port: String },
    /// Simulators are not part of this crate.
    #[error("{device} cannot be opened as a link: a simulation is started by the program that has the simulators")]
    Simulation { device: String },
}
