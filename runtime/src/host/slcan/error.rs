//! Why an adapter cannot be opened.

use std::borrow::ToOwned;
use std::io;
use std::string::String;
use std::vec::Vec;

use serialport::ErrorKind;

use super::codec::BIT_RATES;

/// Why an adapter cannot be opened, with a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum SlcanError {
    /// There is no such serial port.
    #[error("there is no serial port {path}; is the adapter plugged in?{}", list(present))]
    Missing {
        path: String,
        /// The serial ports of this machine.
        present: Vec<String>,
    },
    /// This user may not use the port.
    #[error(
        "permission to use {path} is denied; on Linux, become a member of the group that owns it: \
         `sudo usermod -aG dialout $USER`, then log in again"
    )]
    Denied { path: String },
    /// Another process uses the port.
    #[error("{path} is in use by another program; close that first")]
    Busy { path: String },
    /// The protocol has no such bit rate.
    #[error("the slcan protocol has no bit rate of {0} bit/s; it has {rates}", rates = rates())]
    BitRate(
        /// The bit rate that was asked for, in bit/s.
        u32,
    ),
    /// The adapter refused a command.
    #[error(
        "the adapter at {path} refuses the command {command}; is it an slcan adapter, and its firmware up to date?"
    )]
    Refused { path: String, command: String },
    /// Something else.
    #[error("cannot open {path}: {error}")]
    Io {
        path: String,
        /// The error of the operating system.
        error: io::Error,
    },
}

impl SlcanError {
    pub(super) fn refusal(path: &str, error: serialport::Error) -> Self {
        let path = path.to_owned();
        match error.kind() {
            ErrorKind::Io(io::ErrorKind::NotFound) => SlcanError::Missing { path, present: ports() },
            ErrorKind::Io(io::ErrorKind::PermissionDenied) => SlcanError::Denied { path },
            // The crate returns it for EBUSY and for a lock of another process; on Windows for a
            // missing port, too.
            ErrorKind::NoDevice if cfg!(unix) => SlcanError::Busy { path },
            ErrorKind::NoDevice => SlcanError::Missing { path, present: ports() },
            _ => SlcanError::Io { path, error: error.into() },
        }
    }
}

/// The serial ports of this machine.
fn ports() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().map(|port| port.port_name).collect()
}

fn list(present: &[String]) -> String {
    if present.is_empty() { String::new() } else { std::format!(" (there is {})", present.join(", ")) }
}

fn rates() -> String {
    let rates: Vec<String> = BIT_RATES.iter().map(|rate| std::format!("{rate}")).collect();
    rates.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn refusals_name_the_port_and_the_remedy() {
        let refusal = |kind| {
            let error = serialport::Error::new(ErrorKind::Io(kind), "refused");
            SlcanError::refusal("/dev/ttyACM0", error).to_string()
        };
        let denied = refusal(io::ErrorKind::PermissionDenied);
        assert!(denied.starts_with("permission to use /dev/ttyACM0 is denied; on Linux, become a member"), "{denied}");
        let missing = refusal(io::ErrorKind::NotFound);
        assert!(missing.starts_with("there is no serial port /dev/ttyACM0; is the adapter plugged in?"), "{missing}");
        assert!(refusal(io::ErrorKind::TimedOut).starts_with("cannot open /dev/ttyACM0: "));
    }
}
