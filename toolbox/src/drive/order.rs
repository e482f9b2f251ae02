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

/// How long an order may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// How long until it counts as timed out.
    pub within: Duration,
    /// How long to run or to watch; `None` for until something ends it.
    pub lasting: Option<Duration>,
}

/// How often a drive is looked at that says nothing.
const LOOK: Duration = Duration::from_millis(100);

/// After how long a drive counts as stalled that has an order and stands. No ramp is so slow.
const STALL: Duration = Duration::from_secs(3);

impl Order {
    /// Whether the drive moves by it, and has to be enabled for it.
    #[must_use]
    pub const fn moves(&self) -> bool {
        self.mode().is_some() || matches!(self, Order::Home(_) | Order::Resume)
    }

    /// Whether a drive that stands has not done it. A step by inching is not watched so closely.
    const fn may_stall(&self) -> bool {
        self.moves() && !matches!(self, Order::Step(None) | Order::Run(0))
    }

    /// The operating mode that it needs; homing chooses its mode by itself.
    const fn mode(&self) -> Option<Mode> {
        match self {
            Order::MoveTo(_) | Order::Step(_) => Some(Mode::Positioning),
            Order::Run(_) => Some(Mode::Velocity),
            _ => None,
        }
    }
}

/// Whether an order has ended with a drive that answers, and does not move by it. After any other error it has to be brought back
/// (`Drive::recover`).
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

/// Chooses the operating mode that an order needs, before the drive is enabled; nothing moves.
///
/// # Errors
///
/// As [`sequence::set_mode`].
pub async fn prepare(drive: &DriveContext, order: Order) -> Result<(), Error> {
    match order.mode() {
        Some(mode) => sequence::set_mode(drive, mode).await,
        None => Ok(()),
    }
}

/// Carries an order out, and calls `look` whenever something is seen to have changed. Whenever the order waits for no answer of
/// the drive, `wanted` may name an entry, which is read for those who follow the bus.
///
/// Whatever starts something is checked before it is sent: the mode, the state, the limits of the data sheet and those that the
/// drive is set to. A travel that is timed out, a drive that has run and one that has [stalled](Ending::Stalled) are stopped.
///
/// # Errors
///
/// [`Error::Refused`], [`Error::Unsupported`] and [`Error::OutOfRange`] before anything moves, and those of the sequence.
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

/// Looks at state, position and velocity; the status word.
///
/// # Errors
///
/// When the drive cannot be read.
pub async fn see(drive: &DriveContext) -> Result<u16, Error> {
    let status_word = drive.status().await?;
    // A drive that only runs need not have one.
    known(drive.position().await.map(i64::from))?;
    drive.velocity().await?;
    Ok(status_word)
}

/// A travel, in which the velocity is looked at as well.
async fn travel(drive: &DriveContext, target: i32, within: Duration) -> Result<Ending, Error> {
    sequence::start_travel(drive, target).await?;
    finish(drive, within).await
}

/// Waits until the travel is over.
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

/// Runs at a velocity until its time is over, or something ends it.
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

/// What has ended running at a velocity; `None` while the drive runs.
async fn end_of_running(drive: &DriveContext, ordered: i32) -> Result<Option<Ending>, Error> {
    let description = drive.description();
    let status_word = see(drive).await?;
    match State::from_status_word(status_word) {
        Some(State::OperationEnabled) => {}
        // The next look finds it in FAULT.
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

/// A quick stop, or a stop where that is refused: the drive is not enabled, and may only coast.
async fn quick_stop(drive: &DriveContext) -> Result<(), Error> {
    match sequence::quick_stop(drive).await {
        Err(Error::Refused(_)) => sequence::stop(drive).await,
        stopped => stopped,
    }
}

/// The homing method of an order, or the one that the drive is set to.
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

/// A value, if the drive lets it be read.
fn known(read: Result<i64, Error>) -> Result<Option<i64>, Error> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(Error::Sdo(SdoError::Aborted { .. })) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Runs a sequence, and looks at what the driver has seen after each step of it; between its transfers, reads what is wanted
/// besides. A sequence whose drive stalls is dropped.
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
            // Whether the entry is there does not matter to the order; whether the drive is, it finds out by itself.
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
