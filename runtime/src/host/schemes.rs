//! The URL schemes of this crate's links.

use core::str::FromStr;
use std::borrow::ToOwned;
use std::boxed::Box;
use std::string::ToString;

use super::url::{INTERFACE, OpenError, PACE, Parameter, Scheme, Takes};
use super::{BusUrl, BusUrlError, Link, Replay};

type Opened = Result<Box<dyn Link + Send>, OpenError>;

/// All schemes of this crate.
pub const SCHEMES: &[&Scheme] = &[&SOCKETCAN, &SLCAN, &LOG];

/// A CAN interface of the kernel.
pub const SOCKETCAN: Scheme = Scheme {
    name: INTERFACE,
    example: "can0",
    what: "an interface of a Linux kernel",
    parameters: &[],
    check: is_interface,
    open: open_socketcan,
};

/// A serial adapter.
pub const SLCAN: Scheme = Scheme {
    name: "slcan",
    example: "slcan:/dev/ttyACM0?bitrate=500000",
    what: "a serial adapter",
    parameters: &[
        Parameter {
            key: "bitrate",
            what: "the bit rate of the bus; by default that of the adapter",
            takes: Takes::Rate,
        },
        Parameter { key: "baud", what: "the speed of the line to the adapter, 115200 by default", takes: Takes::Rate },
    ],
    check: anything,
    open: open_slcan,
};

/// A log of `candump -L`.
pub const LOG: Scheme = Scheme {
    name: "log",
    example: "log:FILE",
    what: "a log",
    parameters: &[Parameter { key: "interface", what: "only the frames of this interface", takes: Takes::Text }, PACE],
    check: anything,
    open: |url| Ok(Box::new(Replay::open(url.place().as_ref(), url.get("interface"), url.pace().unwrap_or_default())?)),
};

/// Parses URLs with the schemes of this crate.
impl FromStr for BusUrl {
    type Err = BusUrlError;

    fn from_str(text: &str) -> Result<Self, BusUrlError> {
        BusUrl::among(SCHEMES, text)
    }
}

/// For a [`Scheme`] whose places need no check.
pub const fn anything(_: &str) -> Result<(), BusUrlError> {
    Ok(())
}

/// For a [`Scheme`] whose buses are more than a link, which the program itself opens.
pub fn elsewhere(url: &BusUrl) -> Opened {
    Err(OpenError::Elsewhere { bus: url.to_string() })
}

/// An interface of the kernel: at most 15 bytes, without `/` and white space.
fn is_interface(name: &str) -> Result<(), BusUrlError> {
    let is_port = name.contains('/') || name.strip_prefix("COM").is_some_and(|n| n.parse::<u16>().is_ok());
    if is_port {
        return Err(BusUrlError::Port { name: name.to_owned() });
    }
    if name.len() > 15 || name.contains(|c: char| c.is_whitespace() || c.is_control()) {
        return Err(BusUrlError::Interface { name: name.to_owned() });
    }
    Ok(())
}

#[cfg(all(feature = "socketcan", target_os = "linux"))]
fn open_socketcan(url: &BusUrl) -> Opened {
    Ok(Box::new(super::socketcan::SocketCan::open(url.place())?))
}

#[cfg(not(all(feature = "socketcan", target_os = "linux")))]
fn open_socketcan(url: &BusUrl) -> Opened {
    let bus = url.place().to_owned();
    Err(if cfg!(target_os = "linux") {
        OpenError::NotBuilt { bus, feature: "socketcan" }
    } else {
        OpenError::NotLinux { bus }
    })
}

#[cfg(feature = "slcan")]
fn open_slcan(url: &BusUrl) -> Opened {
    use super::slcan::{BAUD, Settings, Slcan};
    let settings = Settings { bit_rate: url.rate("bitrate"), baud: url.rate("baud").unwrap_or(BAUD) };
    Ok(Box::new(Slcan::open(url.place(), settings)?))
}

#[cfg(not(feature = "slcan"))]
fn open_slcan(url: &BusUrl) -> Opened {
    Err(OpenError::NotBuilt { bus: url.place().to_owned(), feature: "slcan" })
}
