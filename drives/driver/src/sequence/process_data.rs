//! PDOs whose mapping the application chooses.

use lexican_runtime::CobId;
use lexican_runtime::object::{Direction, Mapping, Rpdo, Tpdo, Values};
use lexican_runtime::procedure::{Data, PdoSettings, Step, configure_pdo};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::nmt::NmtCommand;

use super::observe::state;
use crate::context::DriveContext;
use crate::description::Pdo;
use crate::error::{Error, Missing, Refusal};

/// Configures PDOs in NMT PRE-OPERATIONAL: each is disabled, mapped and enabled. Afterwards the node is in OPERATIONAL.
///
/// Errors: [`Error::PdoInUse`] for a PDO that the driver itself uses, before anything is sent; [`Error::Refused`] while
/// the drive is enabled; [`Error::Sdo`] if the drive does not allow it.
pub async fn configure_pdos(drive: &DriveContext, pdos: &[PdoSettings<'_>]) -> Result<(), Error> {
    for &PdoSettings { direction, number, .. } in pdos {
        if is_in_use(drive, direction, number) {
            return Err(Error::PdoInUse { direction, number });
        }
    }
    enter_pre_operational(drive).await?;
    let mut written = Ok(());
    for step in pdos.iter().flat_map(|pdo| configure_pdo(*pdo)) {
        written = write(drive, step).await;
        if written.is_err() {
            break;
        }
    }
    drive.command(NmtCommand::Start);
    written
}

/// Sends a PDO that the application has mapped.
///
/// Errors: [`Error::PdoInUse`] for one that the driver itself uses.
pub async fn send_pdo<V: Values, N>(
    drive: &DriveContext,
    number: u16,
    mapping: &Mapping<Rpdo, V, N>,
    values: V,
) -> Result<(), Error> {
    let direction = Direction::Receive;
    let base = base(direction, number).filter(|_| !is_in_use(drive, direction, number));
    let base = base.ok_or(Error::PdoInUse { direction, number })?;
    drive.send(mapping.frame(CobId::of_node(base, drive.node()), values));
    Ok(())
}

/// The values of a PDO that the application has mapped: the last one since the previous call, or the next one if the
/// drive has sent none.
///
/// Errors: [`Error::NoPdo`] if none comes within a reaction time.
pub async fn receive_pdo<V: Values, N>(
    drive: &DriveContext,
    number: u16,
    mapping: &Mapping<Tpdo, V, N>,
) -> Result<V, Error> {
    let frame = drive.next_pdo(number).await?.ok_or(Error::NoPdo { number })?;
    mapping.values(frame.data()).map_err(|error| Error::ShortPdo { number, error })
}

/// Enters NMT PRE-OPERATIONAL, in which PDOs are configured.
///
/// Errors: [`Error::Refused`] while the drive is enabled.
pub(super) async fn enter_pre_operational(drive: &DriveContext) -> Result<(), Error> {
    match state(drive).await? {
        State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive => {
            Err(Error::Refused(Refusal(vec![Missing::Disabled])))
        }
        _ => {
            drive.command(NmtCommand::EnterPreOperational);
            Ok(())
        }
    }
}

pub(super) async fn write(drive: &DriveContext, step: Step<'_>) -> Result<(), Error> {
    match step {
        Step::Write { address, data: Data::Value(value) } => drive.download(address, value).await,
        // `PdoSettings` are values, so other errors cannot occur.
        _ => Ok(()),
    }
}

/// The COB-ID of a PDO in the predefined connection set (CiA 301, 7.3.5), without the node-ID.
fn base(direction: Direction, number: u16) -> Option<u16> {
    let first = match direction {
        Direction::Receive => 0x200,
        Direction::Transmit => 0x180,
    };
    (1..=4).contains(&number).then(|| first + 0x100 * (number - 1))
}

/// Whether the driver itself uses this PDO.
pub(super) fn is_in_use(drive: &DriveContext, direction: Direction, number: u16) -> bool {
    let Some(base) = base(direction, number) else { return false };
    let description = drive.description();
    let outputs = [description.outputs.control, description.outputs.position, description.outputs.velocity];
    let is = |pdo: &Pdo| pdo.base == base;
    match direction {
        Direction::Receive => outputs.iter().flatten().any(is),
        Direction::Transmit => description.inputs.iter().any(is),
    }
}
