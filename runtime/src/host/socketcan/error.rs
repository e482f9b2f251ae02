//! Why an interface cannot be opened.

use std::borrow::ToOwned;
use std::io;
use std::string::String;
use std::vec::Vec;

use nix::errno::Errno;

use super::presence::interfaces;

/// Why an interface cannot be opened, with a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum SocketCanError {
    /// The kernel was built without CAN, or its module is missing.
    #[error("this kernel has no CAN; load it with `modprobe can-raw`, or use a serial adapter: slcan:/dev/ttyACM0")]
    NoCan,
    /// There is no interface with this name.
    #[error("there is no interface {interface}; {}{}", create(interface), list(present))]
    Missing {
        interface: String,
        /// The CAN interfaces of this machine.
        present: Vec<String>,
    },
    /// The interface is not a CAN interface.
    #[error("{interface} is not a CAN interface{}", list(present))]
    NotCan {
        interface: String,
        /// The CAN interfaces of this machine.
        present: Vec<String>,
    },
    /// The interface is down.
    #[error("{interface} is down; set it up with `{}`", set_up(interface))]
    Down { interface: String },
    /// This process may not use CAN.
    #[error(
        "permission to use {interface} is denied; in a container, run it in the host's network \
         (`--network host`) with CAP_NET_RAW"
    )]
    Denied { interface: String },
    /// Something else.
    #[error("cannot open {interface}: {error}")]
    Io {
        interface: String,
        /// The error of the operating system.
        error: io::Error,
    },
}

impl SocketCanError {
    pub(super) fn refusal(interface: &str, error: io::Error) -> Self {
        let interface = interface.to_owned();
        match errno(&error) {
            Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT => SocketCanError::NoCan,
            Errno::EPERM | Errno::EACCES => SocketCanError::Denied { interface },
            Errno::ENETDOWN => SocketCanError::Down { interface },
            Errno::ENODEV | Errno::ENXIO => SocketCanError::Missing { interface, present: interfaces() },
            _ => SocketCanError::Io { interface, error },
        }
    }
}

pub(super) fn errno(error: &io::Error) -> Errno {
    error.raw_os_error().map_or(Errno::UnknownErrno, Errno::from_raw)
}

fn create(interface: &str) -> String {
    match interface.strip_prefix("vcan") {
        Some(_) => {
            std::format!("create it with `ip link add dev {interface} type vcan`, then `ip link set {interface} up`")
        }
        None => String::from("is the adapter plugged in, and its driver loaded?"),
    }
}

fn set_up(interface: &str) -> String {
    match interface.strip_prefix("vcan") {
        Some(_) => std::format!("ip link set {interface} up"),
        None => std::format!("ip link set {interface} up type can bitrate 500000"),
    }
}

fn list(present: &[String]) -> String {
    if present.is_empty() { String::new() } else { std::format!(" (there is {})", present.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn errors_name_the_interface_and_the_remedy() {
        let denied = SocketCanError::refusal("can0", Errno::EPERM.into());
        assert!(denied.to_string().starts_with("permission to use can0 is denied; in a container"));
        let down = SocketCanError::Down { interface: "can0".to_owned() };
        assert_eq!(down.to_string(), "can0 is down; set it up with `ip link set can0 up type can bitrate 500000`");
        let missing = |interface: &str, present: &[&str]| {
            let present = present.iter().map(|name| (*name).to_owned()).collect();
            SocketCanError::Missing { interface: interface.to_owned(), present }.to_string()
        };
        assert_eq!(
            missing("vcan0", &[]),
            "there is no interface vcan0; create it with `ip link add dev vcan0 type vcan`, then `ip link set vcan0 up`"
        );
        assert_eq!(
            missing("can0", &["can1", "vcan0"]),
            "there is no interface can0; is the adapter plugged in, and its driver loaded? (there is can1, vcan0)"
        );
    }
}
