//! Errors of opening or simulating a bus, with advice.

use lexican_runtime::host::slcan;
use lexican_runtime::host::url::OpenError;

use lexican_simulation::{PlantError, SimulationError};

use crate::output::{Failure, reason};

#[cfg(target_os = "linux")]
const WITHOUT_CAN: &str = "to try lexican without CAN, run `lexican simulate siko/ag03-1 --node 5` in another terminal";

pub(crate) fn open_failure(error: &OpenError) -> Failure {
    match error {
        OpenError::Slcan(slcan::SlcanError::Io { path, error }) if is_no_terminal(error) => {
            Failure::new(format_args!("{path} is not a serial port")).help("a log is named as log:FILE")
        }
        OpenError::Slcan(slcan::SlcanError::Io { path, error }) => {
            Failure::new(format_args!("cannot open {path}: {}", reason(error)))
        }
        OpenError::Slcan(slcan::SlcanError::Missing { path, .. }) if path.starts_with("/dev/pts/") => {
            Failure::new(format_args!("there is no terminal {path}"))
                .help("is `lexican simulate` still running? It prints the terminals that it makes")
        }
        OpenError::Slcan(slcan::SlcanError::Busy { path }) if path.starts_with("/dev/pts/") => {
            Failure::new(error).help("`lexican simulate` has printed another one; --bus pty:4 makes four of them")
        }
        #[cfg(target_os = "linux")]
        OpenError::SocketCan(lexican_runtime::host::socketcan::SocketCanError::NoCan) => {
            Failure::new(error).help(WITHOUT_CAN)
        }
        _ => Failure::new(error),
    }
}

/// Whether the error is that of a file that is not a terminal.
fn is_no_terminal(error: &std::io::Error) -> bool {
    let text = reason(error);
    text.contains("typewriter") || text.contains("inappropriate ioctl")
}

impl From<PlantError> for Failure {
    fn from(error: PlantError) -> Self {
        match error {
            PlantError::Wrong { file, findings } => {
                Failure::new(format_args!("{file} cannot be simulated")).after(findings)
            }
            PlantError::Device(SimulationError::NoLss) => Failure::new(error).help("--node 5"),
            other => Failure::new(other),
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use lexican_runtime::host::socketcan::SocketCanError;
    use lexican_runtime::host::{AccessError, BusState, LinkError};
    use lexican_runtime::object::Address;
    use lexican_runtime::service::sdo_client::SdoError;
    use lexican_runtime::{AbortCode, NodeId};
    use lexican_toolbox::log::LogError;
    use std::io;

    #[track_caller]
    fn check(failure: Failure, message: &str, help: Option<&str>) {
        let (said, advice) = failure.words();
        assert!(said.contains(message), "{said}");
        match (advice, help) {
            (None, None) => {}
            (Some(advice), Some(help)) => assert!(advice.contains(help), "{advice}"),
            (advice, _) => panic!("{said}: {advice:?}"),
        }
    }

    #[test]
    fn a_bus_that_cannot_be_opened_has_advice() {
        let log =
            |code| Failure::from(LogError::Io { name: "bus.log".into(), error: io::Error::from_raw_os_error(code) });
        check(log(2), "cannot read the log bus.log: no such file or directory", Some("lexican record"));
        check(log(13), "cannot read the log bus.log: permission denied", None);
        let can = |error| open_failure(&OpenError::SocketCan(error));
        let interface = || "can0".to_owned();
        check(can(SocketCanError::NoCan), "this kernel has no CAN", Some("lexican simulate"));
        check(can(SocketCanError::Down { interface: interface() }), "can0 is down; set it up with `ip link", None);
        let missing = SocketCanError::Missing { interface: interface(), present: vec!["can1".to_owned()] };
        check(can(missing), "there is no interface can0; is the adapter plugged in", None);
        check(can(SocketCanError::Denied { interface: interface() }), "permission to use can0 is denied", None);
        let serial = |error| open_failure(&OpenError::Slcan(error));
        let path = || "/dev/ttyACM0".to_owned();
        check(serial(slcan::SlcanError::Missing { path: path(), present: vec![] }), "is the adapter plugged in?", None);
        check(serial(slcan::SlcanError::Denied { path: path() }), "usermod -aG dialout", None);
        check(serial(slcan::SlcanError::Busy { path: path() }), "in use by another program", None);
        let gone = slcan::SlcanError::Missing { path: "/dev/pts/3".to_owned(), present: vec![] };
        check(serial(gone), "there is no terminal /dev/pts/3", Some("lexican simulate"));
        let busy = slcan::SlcanError::Busy { path: "/dev/pts/3".to_owned() };
        check(serial(busy), "in use by another program", Some("pty:4"));
        let io = |text: &str| slcan::SlcanError::Io { path: path(), error: io::Error::other(text.to_owned()) };
        check(serial(io("Not a typewriter")), "/dev/ttyACM0 is not a serial port", Some("log:FILE"));
        check(serial(io("Odd")), "cannot open /dev/ttyACM0: odd", None);
    }

    #[test]
    fn a_bus_that_fails_has_advice() {
        let no_bus = |state| Failure::from(LinkError::NoBus(state));
        check(no_bus(BusState::Down), "it is down", Some("ip link set"));
        check(no_bus(BusState::Removed), "it is removed", Some("plug the adapter in"));
        check(no_bus(BusState::Off), "it is bus-off", Some("restart-ms"));
        check(Failure::from(LinkError::Full), "the transmit buffer stays full", Some("another node"));
        check(Failure::from(LinkError::ReadOnly), "a log takes no frames", Some("lexican monitor"));
        check(Failure::from(LinkError::Closed), "the bus is gone", None);
    }

    #[test]
    fn a_node_that_fails_has_advice() {
        let address = Address::new(0x6064, 0);
        let sdo = |error| Failure::from(AccessError::Sdo { node: NodeId::literal(5), error });
        check(sdo(SdoError::TimedOut { address }), "node 5: 6064:00: no answer", Some("lexican scan"));
        check(
            sdo(SdoError::Violation { address, code: AbortCode::TOGGLE_BIT }),
            "breaks the protocol",
            Some("two nodes"),
        );
        check(Failure::from(AccessError::from(LinkError::NoBus(BusState::Down))), "it is down", Some("ip link set"));
    }
}
