//! The sequence that carries out an order.

use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::task::Poll;

use lexican_driver::sequence;
use lexican_driver::{Capability, DriveContext, Error, Mode};
use lexican_runtime::object::{Address, OutOfRange};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, Instant};

use super::ending::Ending;
use super::look::Look;
use super::verb::Order;

/// The time limits of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// Until the order counts as timed out.
    pub within: Duration,
    /// How long to run or to watch; `None` for no limit.
    pub lasting: Option<Duration>,
}

/// The interval of polling a drive that reports nothing by itself.
const LOOK: Duration = Duration::from_millis(100);

/// A drive that has an order and does not move for this long counts as stalled. No ramp is that slow.
const STALL: Duration = Duration::from_secs(3);

impl Order {
    /// Whether the drive moves, and so has to be enabled.
    #[must_use]
    pub const fn moves(&self) -> bool {
        self.mode().is_some() || matches!(self, Order::Home(_) | Order::Resume)
    }

    /// Whether a standstill means that the order is not carried out. Steps by inching are excepted.
    const fn may_stall(&self) -> bool {
        self.moves() && !matches!(self, Order::Step(None) | Order::Run(0))
    }

    /// The mode of operation that it needs; homing sets its mode itself.
    const fn mode(&self) -> Option<Mode> {
        match self {
            Order::MoveTo(_) | Order::Step(_) => Some(Mode::Positioning),
            Order::Run(_) => Some(Mode::Velocity),
            _ => None,
        }
    }
}

/// Whether the drive answers after this error and is not moving by the order. After any other error it has to be
/// brought back with `Drive::recover`.
#[must_use]
pub const fn has_ended(error: &Error) -> bool {
    matches!(
        error,
        Error::Cancelled { .. }
            | Error::Restarted
            | Error::Refused(_)
            | Error::Unsupported { .. }
            | Error::OutOfRange(_)
            | Error::Fault(_)
            | Error::NotTaken { .. }
            | Error::NoReaction { .. }
            | Error::NoWay { .. }
            | Error::ModeNotTaken { .. }
    )
}

/// Sets the mode of operation that an order needs, before the drive is enabled. Nothing moves.
pub async fn prepare(drive: &DriveContext, order: Order) -> Result<(), Error> {
    match order.mode() {
        Some(mode) => sequence::set_mode(drive, mode).await,
        None => Ok(()),
    }
}

/// Carries out an order, and calls `look` whenever a value has changed. Between its own transfers, `wanted` may name an
/// entry to read, for observers of the bus.
///
/// Before an order that moves the drive is sent, the mode, the state, and the limits of the data sheet and the drive
/// are checked. Afterwards a motion that timed out, a drive that ran for its time, and one that has
/// [stalled](Ending::Stalled) are stopped.
///
/// Errors: with [`Error::Refused`], [`Error::Unsupported`] and [`Error::OutOfRange`] nothing has moved.
pub async fn carry_out(
    drive: &DriveContext,
    order: Order,
    times: Times,
    look: &mut (dyn FnMut(Look) + Send),
    wanted: &mut (dyn FnMut(Instant) -> Option<Address> + Send),
) -> Result<Ending, Error> {
    let ending = watched(drive, run(drive, order, times), order.may_stall(), look, wanted).await?;
    if ending == Ending::Stalled {
        sequence::stop(drive).await?;
    }
    Ok(ending)
}

async fn run(drive: &DriveContext, order: Order, times: Times) -> Result<Ending, Error> {
    prepare(drive, order).await?;
    let ending = match order {
        Order::Enable => sequence::enable(drive).await.map(|()| Ending::Reached)?,
        Order::Disable => sequence::disable(drive).await.map(|()| Ending::Reached)?,
        Order::ResetFault => sequence::reset_fault(drive).await?.map_or(Ending::Reached, Ending::Reset),
        Order::MoveTo(target) => travel(drive, target, times.within).await?,
        Order::Step(None) => sequence::step(drive, times.within).await?.into(),
        Order::Step(Some(width)) => {
            let from = drive.position().await?;
            let object = drive.description().objects.target_position.address();
            let target = from.checked_add(width).ok_or(OutOfRange { address: object, above: width > 0 })?;
            travel(drive, target, times.within).await?
        }
        Order::Run(velocity) => turn(drive, velocity, times).await?,
        Order::Home(method) => sequence::home(drive, method_of(drive, method).await?, times.within).await?.into(),
        Order::Stop => sequence::stop(drive).await.map(|()| Ending::Reached)?,
        Order::QuickStop => quick_stop(drive).await.map(|()| Ending::Reached)?,
        Order::Resume => {
            sequence::resume(drive).await?;
            finish(drive, times.within).await?
        }
        Order::Drop => sequence::drop_travel(drive).await.map(|()| Ending::Reached)?,
        Order::Watch => watch(drive, times.lasting).await?,
    };
    if drive.may_move() && order.moves() {
        sequence::stop(drive).await?;
    }
    see(drive).await?;
    Ok(ending)
}

/// Reads state, position and velocity; returns the status word.
pub async fn see(drive: &DriveContext) -> Result<u16, Error> {
    let status_word = drive.status().await?;
    // A drive without profile position mode may lack a position.
    known(drive.position().await.map(i64::from))?;
    drive.velocity().await?;
    Ok(status_word)
}

/// A motion to a target, with velocity observed.
async fn travel(drive: &DriveContext, target: i32, within: Duration) -> Result<Ending, Error> {
    sequence::start_travel(drive, target).await?;
    finish(drive, within).await
}

/// Waits until the motion has ended.
async fn finish(drive: &DriveContext, within: Duration) -> Result<Ending, Error> {
    let until = drive.now() + within;
    loop {
        let outcome = sequence::finish(drive, LOOK.min(until.since(drive.now())), &mut |_| {}).await?;
        drive.velocity().await?;
        match Ending::from(outcome) {
            Ending::TimedOut if drive.now() < until => {}
            ending => return Ok(ending),
        }
    }
}

/// Runs at a velocity until its time is up or something ends it.
async fn turn(drive: &DriveContext, velocity: i32, times: Times) -> Result<Ending, Error> {
    let until = times.lasting.map(|span| drive.now() + span);
    let within = times.lasting.map_or(times.within, |span| span.min(times.within));
    match Ending::from(sequence::run_at(drive, velocity, within).await?) {
        Ending::Reached => {}
        Ending::TimedOut if is_over(drive, until) => return Ok(Ending::Reached),
        ending => return Ok(ending),
    }
    while !is_over(drive, until) {
        let rest = until.map_or(LOOK, |until| until.since(drive.now()));
        match sequence::pass(drive, LOOK.min(rest)).await {
            Err(Error::Fault(cause)) => return Ok(Ending::Fault(cause)),
            passed => passed?,
        }
        if let Some(ending) = end_of_running(drive, velocity).await? {
            return Ok(ending);
        }
    }
    Ok(Ending::Reached)
}

/// What has ended running at a velocity; `None` if the drive is still running.
async fn end_of_running(drive: &DriveContext, ordered: i32) -> Result<Option<Ending>, Error> {
    let description = drive.description();
    let status_word = see(drive).await?;
    match State::from_status_word(status_word) {
        Some(State::OperationEnabled) => {}
        // The next poll finds it in FAULT.
        Some(State::FaultReactionActive) => return Ok(None),
        Some(State::Fault) => return Ok(Some(Ending::Fault(sequence::cause(drive).await?))),
        Some(state) => return Ok(Some(Ending::Interrupted(state))),
        None => return Err(Error::UnknownState(status_word)),
    }
    if let Some(velocities) = description.velocity
        && known(drive.get(velocities.target).await)?.is_some_and(|target| target != i64::from(ordered))
    {
        return Ok(Some(Ending::ForeignOrder));
    }
    if ordered == 0 || drive.seen().velocity.is_none_or(|velocity| velocity.value != 0) {
        return Ok(None);
    }
    if let Some(torque) = description.torque_deactivation
        && drive.get(torque.state).await? as u32 & torque.active != 0
    {
        return Ok(Some(Ending::Blocked));
    }
    let stop = i64::from(description.control.stop);
    if known(drive.get(description.objects.control_word).await)?.is_some_and(|word| word & stop != 0) {
        return Ok(Some(Ending::ForeignOrder));
    }
    Ok((status_word & description.status.internal_limit != 0).then_some(Ending::Limit))
}

async fn watch(drive: &DriveContext, lasting: Option<Duration>) -> Result<Ending, Error> {
    let until = lasting.map(|span| drive.now() + span);
    loop {
        see(drive).await?;
        if is_over(drive, until) {
            return Ok(Ending::Reached);
        }
        drive.pass(LOOK.min(until.map_or(LOOK, |until| until.since(drive.now())))).await?;
    }
}

/// A quick stop, or, if the drive refuses that, a stop: it is not enabled, and at most coasts.
async fn quick_stop(drive: &DriveContext) -> Result<(), Error> {
    match sequence::quick_stop(drive).await {
        Err(Error::Refused(_)) => sequence::stop(drive).await,
        stopped => stopped,
    }
}

/// The homing method of the order, or else the one that is set in the drive.
async fn method_of(drive: &DriveContext, method: Option<i8>) -> Result<i8, Error> {
    let homing = drive.need(drive.description().homing, Capability::Mode(Mode::Homing))?;
    match method {
        Some(method) => Ok(method),
        None => Ok(drive.get(homing.method).await? as i8),
    }
}

fn is_over(drive: &DriveContext, until: Option<Instant>) -> bool {
    until.is_some_and(|until| drive.now() >= until)
}

/// The value; `None` if the drive does not have or allow it.
fn known(read: Result<i64, Error>) -> Result<Option<i64>, Error> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(Error::Sdo(SdoError::Aborted { .. })) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Runs a sequence, looks at the values that the driver has seen after each step, and reads wanted entries between its
/// transfers. If the drive stalls, the sequence is dropped.
async fn watched(
    drive: &DriveContext,
    sequence: impl Future<Output = Result<Ending, Error>>,
    may_stall: bool,
    look: &mut (dyn FnMut(Look) + Send),
    wanted: &mut (dyn FnMut(Instant) -> Option<Address> + Send),
) -> Result<Ending, Error> {
    let mut sequence = pin!(sequence);
    let mut beside: Option<Pin<Box<dyn Future<Output = _> + Send>>> = None;
    let (mut last, mut changed) = (None, drive.now());
    poll_fn(|context| {
        loop {
            // Ignore the result: the order does not depend on the entry, and it finds out by itself whether the drive
            // still answers.
            if beside.as_mut().is_some_and(|read| read.as_mut().poll(context).is_pending()) {
                return Poll::Pending;
            }
            beside = None;
            let polled = sequence.as_mut().poll(context);
            let seen = Look::at(drive);
            if !last.replace(seen).is_some_and(|last: Look| last.shows_the_same(&seen)) {
                changed = drive.now();
                look(seen);
            }
            let stalls = may_stall && drive.may_move() && seen.velocity == Some(0) && drive.now() >= changed + STALL;
            if polled.is_ready() {
                return polled;
            }
            if stalls {
                return Poll::Ready(Ok(Ending::Stalled));
            }
            if drive.is_transferring() {
                return Poll::Pending;
            }
            let Some(address) = wanted(drive.now()) else { return Poll::Pending };
            beside = Some(Box::pin(drive.read_bytes(address)));
        }
    })
    .await
}
