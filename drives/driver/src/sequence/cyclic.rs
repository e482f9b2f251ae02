//! Setting up a drive for a cyclic mode.

use lexican_runtime::object::{DataType, Direction, Mapped, OutOfRange};
use lexican_runtime::procedure::{PdoSettings, configure_pdo};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, Duration};

use super::identify::pdo_parameter;
use super::observe::known;
use super::power::{disable, start};
use super::process_data::{is_in_use, write};
use super::protect::protect;
use super::refusal::{limits, require};
use super::setup::set_mode;
use super::standstill::hold_still;
use crate::context::DriveContext;
use crate::cyclic::{Axis, AxisSettings};
use crate::description::{Number, Orders};
use crate::error::{Capability, Error};
use crate::mode::Mode;
use crate::protection::Protection;

const PERIOD: Number = Number::new(0x60C2, 0x01, DataType::Unsigned8);
const PERIOD_INDEX: Number = Number::new(0x60C2, 0x02, DataType::Integer8);
const COMMUNICATION_CYCLE: Number = Number::new(0x1006, 0x00, DataType::Unsigned32);

/// Sets a drive up for a cyclic mode without moving it. Stops and disables the drive; maps control word and set-point
/// into one PDO, status word and position into another, both synchronous; disables the other PDOs of the description
/// that the drive would send. Then it writes the period (60C2h, and 1006h if the drive has it), the set-point at which
/// the drive stands, and the mode. If the drive can be protected, arms the protection, for which the follower then
/// sends the signs of life. Afterwards the drive is in NMT OPERATIONAL, and waits for SYNC.
///
/// It may be repeated, also after a restart of the drive.
///
/// Errors: [`Error::Unsupported`], [`Error::OutOfRange`] or [`Error::PdoInUse`] before anything is sent;
/// [`Error::Refused`], such as without supply; [`Error::Sdo`] if the mapping of the drive is fixed.
pub async fn prepare_cyclic(drive: &DriveContext, settings: AxisSettings) -> Result<Axis, Error> {
    let description = drive.description();
    let set_point = match settings.mode {
        Mode::CyclicPosition | Mode::InterpolatedPosition | Mode::CyclicVelocity => {
            description.obeyed_unasked(settings.mode).map(|(set_point, _)| set_point)
        }
        _ => None,
    };
    let set_point = drive.need(set_point.filter(|it| it.size() == 4), Capability::Path(settings.mode))?;
    let (period, index) = period_of(settings.period)?;
    let numbers = [(0x1400, settings.rpdo), (0x1800, settings.tpdo)];
    for (parameter, number) in numbers {
        let address = Number::new(parameter, 0x01, DataType::Unsigned32).address();
        check_number(number).map_err(|above| OutOfRange { address, above })?;
    }
    // A later travel would send its target in a PDO that the drive takes for a set-point of the path.
    let (direction, number) = (Direction::Receive, settings.rpdo.into());
    if is_in_use(drive, direction, number) {
        return Err(Error::PdoInUse { direction, number });
    }

    start(drive);
    disable(drive).await?;
    let status_word = drive.status().await?;
    require(drive, Orders::ENABLE, status_word).await?;

    drive.command(NmtCommand::EnterPreOperational);
    let mapping =
        |number: Number| Mapped::new(number.address().index(), number.address().sub(), 8 * number.size() as u8);
    let objects = description.objects;
    let axis = Axis::new(drive.node(), description, settings, 0);
    for pdo in description.inputs.iter().filter(|pdo| pdo.cob_id(drive.node()) != axis.tpdo()) {
        let parameter = pdo_parameter(0x1800, 0x180, pdo.base, 0x01, DataType::Unsigned32);
        let off = PdoCobId::valid(pdo.cob_id(drive.node())).switched_off();
        known(drive.set(parameter, off.0.into()).await)?;
    }
    let pdo = |direction, number: u8, id: CobId, mapping| PdoSettings {
        direction,
        number: number.into(),
        cob_id: PdoCobId::valid(id),
        transmission: TransmissionType::SynchronousCyclic(1),
        inhibit_100us: None,
        event_timer_ms: None,
        mapping: Some(mapping),
    };
    let set_points = [mapping(objects.control_word), mapping(set_point)];
    let reports = [mapping(objects.status_word), mapping(objects.actual_position)];
    let receive = pdo(Direction::Receive, settings.rpdo, axis.rpdo(), &set_points);
    let transmit = pdo(Direction::Transmit, settings.tpdo, axis.tpdo(), &reports);
    for step in configure_pdo(receive).chain(configure_pdo(transmit)) {
        write(drive, step).await?;
    }
    drive.set(PERIOD, period).await?;
    drive.set(PERIOD_INDEX, index).await?;
    known(drive.set(COMMUNICATION_CYCLE, settings.period.as_micros() as i64).await)?;

    hold_still(drive, settings.mode).await?;
    set_mode(drive, settings.mode).await?;
    let position = drive.position().await?;
    let limits = known(limits(drive).await)?.flatten();
    drive.command(NmtCommand::Start);
    let mut axis = Axis::new(drive.node(), description, settings, position);
    if let Some(supervision) = settings.protection {
        axis = axis.protected_in(drive, Protection::or_none(drive.node(), protect(drive, supervision).await)?);
        drive.lock().is_handed_over = axis.protection() != Protection::None;
    }
    Ok(limits.map_or(axis, |(low, high)| axis.within(low, high)))
}

fn check_number(number: u8) -> Result<(), bool> {
    match number {
        1..=4 => Ok(()),
        _ => Err(number > 4),
    }
}

/// The period for 60C2h: a mantissa and a power of ten, in seconds.
fn period_of(period: Duration) -> Result<(i64, i64), Error> {
    let us = period.as_micros() as i64;
    // In milliseconds if possible, as in drives' manuals.
    let found = [-3, -4, -5, -6, -2].into_iter().find_map(|index: i64| {
        let unit = 10_i64.pow((6 + index) as u32);
        let is_whole = us % unit == 0 && (1..=255).contains(&(us / unit));
        is_whole.then_some((us / unit, index))
    });
    found.ok_or_else(|| OutOfRange { address: PERIOD.address(), above: us > 0 }.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_written_in_the_unit_that_fits() {
        for (us, expected) in
            [(1000, Some((1, -3))), (10_000, Some((10, -3))), (1500, Some((15, -4))), (250, Some((25, -5))), (0, None)]
        {
            assert_eq!(period_of(Duration::from_micros(us)).ok(), expected, "{us}");
        }
        assert_eq!(period_of(Duration::from_secs(1)).ok(), Some((100, -2)));
        assert!(period_of(Duration::from_micros(1_000_001)).is_err());
    }
}
