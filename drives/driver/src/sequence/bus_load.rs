//! Whether a drive may fill the bus.

use std::fmt;

use lexican_runtime::Duration;
use lexican_runtime::object::{Address, DataType, Mapped};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};

use super::observe::known;
use crate::context::DriveContext;
use crate::description::Number;
use crate::error::Error;

/// From this inhibit time on, a PDO counts as paced: at 500 kbit/s, a frame of 8 bytes then takes a quarter of the bus.
const PACED: Duration = Duration::from_millis(1);

/// Objects that change continuously while an axis of CiA 402 moves: demand and actual values of position, velocity and
/// torque, and the following error.
const MOVING: [u16; 12] =
    [0x6062, 0x6063, 0x6064, 0x6069, 0x606B, 0x606C, 0x6074, 0x6077, 0x6078, 0x60F4, 0x60FA, 0x60FC];

/// A transmit PDO that is sent whenever its contents change (transmission type 254 or 255), without an inhibit time,
/// and whose contents change continuously while the axis moves.
///
/// Such PDOs may fill the bus. PDOs of all nodes then come late, and SDOs, which have the lowest priority, time out. The remedy is
/// an inhibit time, or a synchronous transmission type: [`configure_pdos`](super::configure_pdos).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnpacedPdo {
    /// 1 to 4.
    pub number: u16,
    /// The first object in it that changes.
    pub object: Address,
    /// Its inhibit time (1800h:03), less than 1 ms.
    pub inhibit: Duration,
}

impl fmt::Display for UnpacedPdo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let UnpacedPdo { number, object, inhibit } = self;
        write!(
            f,
            "TPDO {number} may fill the bus while the axis moves: it is sent whenever {object} changes, \
             with an inhibit time of {inhibit}"
        )
    }
}

/// Which of the transmit PDOs 1 to 4 may fill the bus while the drive moves. Manufacturer objects count as not
/// changing. Nothing is changed in the drive.
///
pub async fn unpaced_pdos(drive: &DriveContext) -> Result<Vec<UnpacedPdo>, Error> {
    let objects = drive.description().objects;
    let own = [Some(objects.actual_position), objects.actual_velocity].map(|number| number.map(|it| it.address()));
    let changes = |object: &Address| own.contains(&Some(*object)) || MOVING.contains(&object.index());
    let mut unpaced = Vec::new();
    for number in 1..=4 {
        let ask = |index: u16, sub, data_type| drive.get(Number::new(index + number - 1, sub, data_type));
        let Some(cob_id) = known(ask(0x1800, 0x01, DataType::Unsigned32).await)? else { continue };
        let Some(transmission) = known(ask(0x1800, 0x02, DataType::Unsigned8).await)? else { continue };
        if !PdoCobId(cob_id as u32).is_valid() || !TransmissionType::from_code(transmission as u8).is_event_driven() {
            continue;
        }
        let hundreds_of_us = known(ask(0x1800, 0x03, DataType::Unsigned16).await)?.unwrap_or(0);
        let inhibit = Duration::from_micros(100 * hundreds_of_us.unsigned_abs());
        if inhibit >= PACED {
            continue;
        }
        let count = known(ask(0x1A00, 0x00, DataType::Unsigned8).await)?.unwrap_or(0);
        // Higher values are not counts: 254 and 255 mean multiplexed PDOs (CiA 301, 7.5.2.38).
        for sub in 1..=u8::try_from(count).ok().filter(|count| *count <= 64).unwrap_or(0) {
            let object = Mapped::from_parameter(ask(0x1A00, sub, DataType::Unsigned32).await? as u32).address;
            if changes(&object) {
                unpaced.push(UnpacedPdo { number, object, inhibit });
                break;
            }
        }
    }
    Ok(unpaced)
}
