//! A drive that answers slowly, through the whole stack: the time-outs come from its door.

use lexican_runtime::Duration;
use lexican_runtime::host::{Link, VirtualBus};
use siko_ag02::driver::{Drive, Error, Outcome};
use siko_ag02::od;
use siko_serial::Settings;
use siko_serial::gateway::{self, NODE, SerialLink};
use siko_serial::sim::{SerialDrive, VirtualLine};

/// A link to a drive at 9600 baud that begins to answer after this many milliseconds.
fn link(reaction: u64, echo: bool) -> SerialLink<VirtualLine> {
    let settings = Settings { echo, ..Settings::default() };
    let line = VirtualLine::with_settings(SerialDrive::default(), settings);
    gateway::link(line.with_reaction(Duration::from_millis(reaction)), settings, NODE)
}

fn travels(link: SerialLink<VirtualLine>) -> Result<(), Error> {
    let mut drive = Drive::connect_unprotected(link, NODE)?;
    drive.enable()?;
    assert_eq!(drive.move_to(2000)?, Outcome::Reached { position: 2000 });
    drive.start_moving_to(20_000)?;
    drive.interrupt()?;
    drive.resume()?;
    drive.stop()?;
    drive.write(od::MOTOR_PARAMETER_SET.a_pos(), od::Acceleration(75))?;
    assert_eq!(drive.read(od::MOTOR_PARAMETER_SET.a_pos())?, od::Acceleration(75));
    drive.disable()
}

/// Whatever wraps the link reports the same latency; a bus adds nothing.
#[test]
fn a_link_has_the_latency_of_its_door() {
    let link = link(0, false);
    let latency = link.gateway().answers_within();
    assert!(latency > Duration::from_secs(5), "{latency:?}");
    let boxed: Box<dyn Link> = Box::new(link);
    assert_eq!(boxed.latency(), latency);
    assert_eq!(VirtualBus::with_bit_rate(500).link().latency(), Duration::ZERO);
}

#[test]
fn a_drive_as_slow_as_its_settings_allow_is_driven() {
    for reaction in [0, 50, 100, 150, 190] {
        for echo in [false, true] {
            travels(link(reaction, echo)).unwrap_or_else(|error| panic!("{reaction} ms, echo {echo}: {error}"));
        }
    }
}

#[tokio::test]
async fn the_tokio_driver_drives_it_too() {
    use lexican_runtime::host::tokio::Network;
    use siko_ag02::driver::tokio::Drive;
    let network = Network::spawn(link(190, true)).unwrap();
    let mut drive = Drive::connect_unprotected(network.clone(), NODE).await.unwrap();
    drive.enable().await.unwrap();
    assert_eq!(drive.move_to(2000).await.unwrap(), Outcome::Reached { position: 2000 });
    // The network's own read waits as long.
    assert_eq!(network.read(NODE, od::MOTOR_PARAMETER_SET.a_pos()).await.unwrap(), od::Acceleration(50));
}
