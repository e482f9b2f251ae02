//! A simulated drive of SIKO behind one of its interfaces besides CAN.

use lexican_profibus::{BitRate, Slave};
use lexican_runtime::{Duration, Instant};
use siko_ag03_1::sim::SimulatedDrive;
use siko_profibus::{Model, ProfibusDrive};
use siko_serial::sim::SerialDrive;

/// The bit rate of the slave, from which its silence before an answer follows. A terminal has no bit rate.
const BIT_RATE: BitRate = BitRate(500_000);

/// The pause that ends a telegram: longer than the gaps within one that an operating system delivers in pieces.
const IDLE: Duration = Duration::from_millis(2);

/// The interface besides CAN. While the drive is on CAN, nothing is connected to it.
pub(super) enum Interface {
    Serial(Box<SerialDrive>),
    Profibus(Box<Slave<ProfibusDrive>>),
}

impl Interface {
    pub(super) fn drive(&self) -> &SimulatedDrive {
        match self {
            Interface::Serial(serial) => serial.drive(),
            Interface::Profibus(slave) => slave.application().drive(),
        }
    }

    pub(super) fn drive_mut(&mut self) -> &mut SimulatedDrive {
        match self {
            Interface::Serial(serial) => serial.drive_mut(),
            Interface::Profibus(slave) => slave.application_mut().drive_mut(),
        }
    }

    /// Makes the drive a PROFIBUS slave whose address is its node-ID.
    pub(super) fn into_profibus(self, now: Instant, model: &'static Model) -> Self {
        let drive = match self {
            Interface::Serial(serial) => serial.into_drive(),
            Interface::Profibus(_) => return self,
        };
        let node = drive.node().get();
        let drive = ProfibusDrive::of(now, model, drive, node);
        let slave = Slave::new(drive.address(), model.identity, BIT_RATE, drive);
        Interface::Profibus(Box::new(slave.with_idle(IDLE)))
    }

    /// Restarts the slave with the supply of its drive: it forgets what its master has told it.
    pub(super) fn follow_supply(&mut self, now: Instant) {
        if let Interface::Profibus(slave) = self {
            let address = slave.address();
            slave.restart(now, address);
        }
    }

    /// Takes bytes from the interface, and returns the answer.
    pub(super) fn answer(&mut self, now: Instant, bytes: &[u8]) -> Vec<u8> {
        match self {
            Interface::Serial(serial) => {
                if serial.poll_timeout().is_some_and(|deadline| deadline <= now) {
                    serial.handle_timeout(now);
                }
                serial.handle_bytes(now, bytes);
                std::iter::from_fn(|| serial.poll_transmit()).flat_map(|it| it.as_bytes().to_vec()).collect()
            }
            Interface::Profibus(slave) if slave.application().drive().is_on() => {
                slave.handle_bytes(now, bytes);
                slave.handle_timeout(now);
                slave.poll_transmit(now).map(<[u8]>::to_vec).unwrap_or_default()
            }
            Interface::Profibus(_) => Vec::new(),
        }
    }
}
