//! The blocking driver over a link of its own, one operation at a time.

use std::fmt;
use std::future::Future;
use std::io::Write;
use std::marker::PhantomData;
use std::pin::pin;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::Poll;

use lexican_runtime::host::{Link, LinkError, Pump, Turn};
use lexican_runtime::object::{Mapping, Object, Readable, Rpdo, Tpdo, Value, Values, Writable};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, Instant, NodeId};

use crate::cancel::CancelHandle;
use crate::context::DriveContext;
use crate::cyclic::{Axis, AxisSettings};
use crate::description::{Approach, Description, Reaction, Trigger};
use crate::direction::Direction;
use crate::error::Error;
use crate::fault::Cause;
use crate::kind::{Any, Kind};
use crate::mode::Mode;
use crate::operations::operations;
use crate::outcome::{HomingOutcome, Outcome, VelocityOutcome};
use crate::parameter::ParameterSet;
use crate::protection::{Protection, Supervision, report};
use crate::sequence::{self, Difference, Progress, Recovered, Recovery, Setting, UnpacedPdo};
use crate::session::Session;
use crate::set_point::SetPoint;
use crate::units::Units;

/// How often a waiting operation checks for cancellation.
const LOOK: Duration = Duration::from_millis(50);

/// How long the keep-alive thread sleeps when it has nothing to send.
const IDLE: Duration = Duration::from_millis(100);

/// A drive of the kind `K`, a [`Kind`] or [`Any`], at the other end of a link. Every method blocks until its operation is
/// over; a [`CancelHandle`] ends it from another thread.
///
/// A drive that is dropped while it may be moving is stopped, and standard error says so. A process that is
/// killed drops nothing: see [the crate](crate#how-a-program-ends-and-what-the-drive-does-then).
pub struct Drive<L: Link, K> {
    shared: Arc<Shared<L>>,
    node: NodeId,
    context: DriveContext,
    supervision: Option<Supervision>,
    has_thread: bool,
    cancel: CancelHandle,
    kind: PhantomData<fn() -> K>,
}

impl<L: Link, K: Kind> Drive<L, K> {
    /// Connects as [`Drive::connect`] does, but arms no protection: for a program that only looks, or whose drive is
    /// protected by something else.
    ///
    /// **The drive does not notice if this program dies**: killed, aborted, or without power. It then goes on with its
    /// last order: a travel to its target, inching and velocity mode without end.
    pub fn connect_unprotected(link: L, node: NodeId) -> Result<Self, Error> {
        Self::connect_as(link, node, K::DESCRIPTION).inspect(Self::report_unprotected)
    }
}

impl<L: Link + Send + 'static, K: Kind> Drive<L, K> {
    /// Connects to the drive at `node`, and checks that it is of this kind and has the COB-IDs that the driver uses. If
    /// the drive can notice that this program is gone, that protection is armed, as by [`Drive::connect_protected`]
    /// with [`Supervision::default`]; [`Drive::protection`] says which one it is, and the feature `tracing` logs it.
    /// Nothing else is changed in the drive.
    ///
    /// Errors: [`Error::NotThisDrive`], [`Error::OtherCobId`], [`Error::OtherMapping`]; [`Error::Sdo`] if the node does
    /// not answer; [`Error::Link`] if no thread can be started.
    pub fn connect(link: L, node: NodeId) -> Result<Self, Error> {
        Self::connect_as(link, node, K::DESCRIPTION)?.protected_if_possible()
    }

    /// Connects to a drive that may still be without power, or hung up: as [`Drive::recover`], which stops the drive.
    /// It is protected as by [`Drive::connect`].
    pub fn connect_and_recover(link: L, node: NodeId, recovery: &Recovery) -> Result<(Self, Recovered), Error> {
        Self::recover_as(link, node, K::DESCRIPTION, recovery)
    }

    /// Connects as [`Drive::connect`] does, but fails if the drive cannot notice within this time that this program is
    /// gone: arms its heartbeat consumer (1016h), or else its life guarding (100Ch, 100Dh). How the drive reacts is in
    /// its manual. Signs of life are sent during operations, and between them by a thread; after a restart of the
    /// drive, the next operation arms it again. A `Drive` that is released, or dropped with the drive at rest, disarms
    /// it.
    ///
    /// A program that hangs is not noticed. None of this replaces an emergency stop.
    ///
    /// Errors: [`Error::Unsupported`] if the drive has neither; [`Error::Link`] if no thread can be started.
    pub fn connect_protected(link: L, node: NodeId, supervision: Supervision) -> Result<Self, Error> {
        Self::connect_as(link, node, K::DESCRIPTION)?.protected(supervision)
    }
}

impl<L: Link> Drive<L, Any> {
    /// Connects as [`Drive::connect_unprotected`] does, to a drive with this description.
    pub fn connect_described_unprotected(
        link: L,
        node: NodeId,
        description: &'static Description,
    ) -> Result<Self, Error> {
        Self::connect_as(link, node, description).inspect(Self::report_unprotected)
    }
}

impl<L: Link + Send + 'static> Drive<L, Any> {
    /// Connects as [`Drive::connect`] does, to a drive with this description.
    pub fn connect_described(link: L, node: NodeId, description: &'static Description) -> Result<Self, Error> {
        Self::connect_as(link, node, description)?.protected_if_possible()
    }

    /// Connects as [`Drive::connect_and_recover`] does, to a drive with this description.
    pub fn connect_described_and_recover(
        link: L,
        node: NodeId,
        description: &'static Description,
        recovery: &Recovery,
    ) -> Result<(Self, Recovered), Error> {
        Self::recover_as(link, node, description, recovery)
    }

    /// Connects as [`Drive::connect_protected`] does, to a drive with this description.
    pub fn connect_described_protected(
        link: L,
        node: NodeId,
        description: &'static Description,
        supervision: Supervision,
    ) -> Result<Self, Error> {
        Self::connect_as(link, node, description)?.protected(supervision)
    }
}

impl<L: Link, K> Drive<L, K> {
    fn new(link: L, node: NodeId, description: &'static Description) -> Self {
        let session = Session::new(node, description).with_latency(link.latency());
        let context = session.context();
        let machine = Machine { link, session, pump: Pump::new(), idle_since: None };
        let shared = Arc::new(Shared { machine: Mutex::new(Some(machine)), changed: Condvar::new() });
        let (supervision, has_thread, cancel) = (None, false, CancelHandle::default());
        Drive { shared, node, context, supervision, has_thread, cancel, kind: PhantomData }
    }

    fn connect_as(link: L, node: NodeId, description: &'static Description) -> Result<Self, Error> {
        let mut drive = Self::new(link, node, description);
        match drive.identify() {
            // The drive has just been powered up: it is there now.
            Err(Error::Restarted) => drive.identify()?,
            identified => identified?,
        }
        Ok(drive)
    }

    fn recover_as(
        link: L,
        node: NodeId,
        description: &'static Description,
        recovery: &Recovery,
    ) -> Result<(Self, Recovered), Error>
    where
        L: Send + 'static,
    {
        let mut drive = Self::new(link, node, description);
        let recovered = drive.recover(recovery)?;
        Ok((drive.protected_if_possible()?, recovered))
    }

    fn protected(mut self, supervision: Supervision) -> Result<Self, Error>
    where
        L: Send + 'static,
    {
        let armed = self.protect(supervision)?;
        report(self.node, armed, None);
        Ok(self)
    }

    fn protected_if_possible(mut self) -> Result<Self, Error>
    where
        L: Send + 'static,
    {
        let armed = self.protect(Supervision::default());
        Protection::or_none(self.node, armed)?;
        Ok(self)
    }

    fn report_unprotected(&self) {
        report(self.node, Protection::None, None);
    }

    /// Arms the protection of [`Drive::connect_protected`] in a drive that is already connected, or with another time.
    ///
    /// Errors: those of [`Protection::is_lacking`] if the drive cannot notice.
    pub fn protect(&mut self, supervision: Supervision) -> Result<Protection, Error>
    where
        L: Send + 'static,
    {
        if self.supervision.is_some_and(|armed| armed != supervision) {
            self.unprotect()?;
        }
        self.shared.with(|machine| machine.protect(supervision))?;
        self.supervision = Some(supervision);
        if !std::mem::replace(&mut self.has_thread, true) {
            let shared = Arc::clone(&self.shared);
            std::thread::Builder::new().spawn(move || shared.keep_alive()).map_err(LinkError::from)?;
        }
        Ok(self.protection())
    }

    /// Disarms the protection: the drive goes on with its last order if this program dies.
    pub fn unprotect(&mut self) -> Result<(), Error> {
        self.supervision = None;
        self.shared.with(Machine::disarm)?;
        self.report_unprotected();
        Ok(())
    }

    fn identify(&mut self) -> Result<(), Error> {
        self.run(async |context: DriveContext| sequence::identify(&context).await)
    }

    /// How the drive notices that this program is gone.
    #[must_use]
    pub fn protection(&self) -> Protection {
        self.shared.with(|machine| machine.session.protection())
    }

    /// A handle by which another thread ends the operation under way and stops the drive.
    #[must_use]
    pub fn cancel_handle(&self) -> CancelHandle {
        self.cancel.clone()
    }

    /// How long a travel may take before it counts as timed out; ten minutes by default.
    pub fn set_patience(&mut self, patience: Duration) {
        self.context.lock().patience = patience;
    }

    /// Brings the drive back after a power cut, an emergency stop, a fault, bus-off or a reset: waits until it answers,
    /// checks that it is of this kind, writes the settings of `recovery` and the operating mode again, and arms its
    /// protection. It may also be called when the drive was only silent and went on with its order: the drive is then
    /// stopped.
    ///
    /// Afterwards the drive is not enabled, and nothing moves until it is ordered again: [`Recovered`] has the state
    /// before and the state now. A fault that is not to be reset stays as it is.
    ///
    /// Errors: [`Error::Sdo`] or [`Error::Link`] if the drive does not answer in time; [`Error::Fault`] if a fault
    /// cannot be reset.
    pub fn recover(&mut self, recovery: &Recovery) -> Result<Recovered, Error> {
        self.shared.with(|machine| {
            let recovered = machine.recover(&self.cancel, recovery);
            let recovered = machine.session.conclude(recovered)?;
            if let Some(supervision) = self.supervision {
                machine.session.protected(Protection::None);
                machine.protect(supervision)?;
            }
            Ok(recovered)
        })
    }

    /// Leaves the drive as it is, moving or not, and gives the link back. Its protection is disarmed; if that fails,
    /// the drive notices that the signs of life stop.
    #[must_use]
    pub fn release(self) -> L {
        let mut machine = self.shared.take().expect(HAS_LINK);
        // A drive that cannot be disarmed does what its protection says.
        let _ = machine.disarm();
        machine.link
    }

    /// Runs a sequence to its end: all methods for operations do only this.
    ///
    /// Errors: those of the sequence, [`Error::Cancelled`] and [`Error::MayBeMoving`].
    pub fn run<T, F>(&mut self, sequence: impl FnOnce(DriveContext) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        self.shared.with(|machine| {
            if let Some(supervision) = self.supervision {
                machine.protect(supervision)?;
            }
            let result = machine.run(Some(&self.cancel), sequence);
            machine.session.conclude(result)
        })
    }
}

/// What the caller's operation and the keep-alive thread share.
struct Shared<L> {
    /// `None` once the drive is dropped or released.
    machine: Mutex<Option<Machine<L>>>,
    changed: Condvar,
}

const HAS_LINK: &str = "a drive has its link until it is dropped or released";

impl<L: Link> Shared<L> {
    fn lock(&self) -> MutexGuard<'_, Option<Machine<L>>> {
        self.machine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<T>(&self, call: impl FnOnce(&mut Machine<L>) -> T) -> T {
        call(self.lock().as_mut().expect(HAS_LINK))
    }

    fn take(&self) -> Option<Machine<L>> {
        let machine = self.lock().take();
        self.changed.notify_all();
        machine
    }

    /// Sends signs of life to a protected drive between operations, until it is dropped or released.
    fn keep_alive(&self) {
        let mut machine = self.lock();
        while let Some(it) = machine.as_mut() {
            let patience = it.keep_alive();
            machine = self.changed.wait_timeout(machine, patience.into()).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// A link, and the session that runs over it.
struct Machine<L> {
    link: L,
    session: Session,
    pump: Pump,
    /// When the last operation ended.
    idle_since: Option<Instant>,
}

impl<L: Link> Machine<L> {
    fn run<T, F>(&mut self, cancel: Option<&CancelHandle>, sequence: impl FnOnce(DriveContext) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        // Frames that have come by now may be older than the order that is sent next.
        if self.pump.catch_up(&mut self.link, &mut self.session)? > 0 {
            self.session.context().missed();
        }
        self.session.begin(self.link.now());
        let result = self.run_unless_cancelled(cancel, sequence).unwrap_or_else(|| Err(self.cancelled()));
        self.idle_since = Some(self.link.now());
        result
    }

    fn run_unless_cancelled<T, F>(
        &mut self,
        cancel: Option<&CancelHandle>,
        sequence: impl FnOnce(DriveContext) -> F,
    ) -> Option<Result<T, Error>>
    where
        F: Future<Output = Result<T, Error>>,
    {
        let mut sequence = pin!(sequence(self.session.context()));
        loop {
            if cancel.is_some_and(CancelHandle::take) {
                return None;
            }
            let polled = self.session.poll(self.link.now(), sequence.as_mut());
            let pumped = self.transmit().and_then(|()| match polled {
                Poll::Ready(_) => Ok(()),
                Poll::Pending => self.wait(),
            });
            match (polled, pumped) {
                (_, Err(error)) => return Some(Err(error.into())),
                (Poll::Ready(result), _) => return Some(result),
                (Poll::Pending, _) => {}
            }
        }
    }

    fn transmit(&mut self) -> Result<(), LinkError> {
        while !self.pump.transmit(&mut self.link, &mut self.session)? {}
        Ok(())
    }

    fn wait(&mut self) -> Result<(), LinkError> {
        let until = self.link.now() + LOOK;
        if let Turn::Gap(_) = self.pump.turn(&mut self.link, &mut self.session, until)? {
            self.session.context().missed();
        }
        Ok(())
    }

    fn recover(&mut self, cancel: &CancelHandle, recovery: &Recovery) -> Result<Recovered, Error> {
        let until = self.link.now() + recovery.within;
        let before = self.session.context().seen();
        loop {
            let recovered = self
                .run(Some(cancel), async |context: DriveContext| sequence::recover(&context, recovery, before).await);
            match recovered {
                Err(error) if error.is_passing() && self.link.now() < until => self.pause()?,
                recovered => return recovered,
            }
        }
    }

    /// Waits a moment, in which the bus may come back.
    fn pause(&mut self) -> Result<(), LinkError> {
        let until = self.link.now() + LOOK;
        while self.link.now() < until {
            match self.pump.turn(&mut self.link, &mut self.session, until) {
                Err(error) if error.is_final() => return Err(error),
                Ok(Turn::Over) => break,
                Ok(_) | Err(_) => {}
            }
        }
        Ok(())
    }

    fn cancelled(&mut self) -> Error {
        let (node, stopped) = (self.session.node(), self.session.context().may_move());
        match self
            .run(None, async |context: DriveContext| if stopped { sequence::stop(&context).await } else { Ok(()) })
        {
            Ok(()) => Error::Cancelled { node, stopped },
            Err(error) => error,
        }
    }

    /// Arms the protection if it is not armed.
    fn protect(&mut self, supervision: Supervision) -> Result<(), Error> {
        if self.session.protection() == Protection::None {
            let protection =
                self.run(None, async |context: DriveContext| sequence::protect(&context, supervision).await)?;
            self.session.keep_alive(self.link.now(), protection);
        }
        Ok(())
    }

    /// A drive that has been handed over to a follower stays armed, since the follower keeps it alive.
    fn disarm(&mut self) -> Result<(), Error> {
        let is_handed_over = self.session.context().lock().is_handed_over;
        let protection = Some(self.session.protection()).filter(|_| !is_handed_over).unwrap_or_default();
        self.run(None, async |context: DriveContext| sequence::unprotect(&context, protection).await)?;
        self.session.keep_alive(self.link.now(), Protection::None);
        Ok(())
    }

    /// Handles what has come and sends the signs of life that are due; returns how long to wait until the next.
    fn keep_alive(&mut self) -> Duration {
        if self.idle_since == Some(self.link.now()) {
            // In virtual time the next operation begins when the last one ends, whether or not this thread runs in between.
            return IDLE;
        }
        // Errors of the link are reported by the next operation.
        let _ = self.pump.catch_up(&mut self.link, &mut self.session);
        let now = self.link.now();
        while let Some(frame) = self.session.poll_keep_alive(now) {
            let _ = self.link.send(&frame);
        }
        let next = self.session.poll_keep_alive_timeout();
        next.map_or(IDLE, |next| next.since(now)).max(Duration::from_millis(1))
    }

    /// Stops a drive that may be moving, and checks whether it obeys; returns what to report.
    fn let_go(&mut self) -> Option<String> {
        // The drive may have said meanwhile that it is disabled. A link that fails here fails again below.
        let _ = self.pump.catch_up(&mut self.link, &mut self.session);
        let stop: Vec<_> = self.session.context().let_go().collect();
        if stop.is_empty() {
            // The drive need not react to a program that ends in order.
            if self.session.lets_disarm().is_some() {
                let _ = self.disarm();
            }
            return None;
        }
        if let Err(error) = stop.iter().try_for_each(|frame| self.link.send(frame)) {
            return Some(format!("no stop could be sent: {error}"));
        }
        Some(match self.run(None, async |context: DriveContext| sequence::look_for_standstill(&context).await) {
            Ok(None) => "it has been stopped".to_owned(),
            Ok(Some(velocity)) => {
                let unit = self.session.context().description().status.velocity_unit;
                format!("a stop has been sent, and it still runs at {velocity} {unit}")
            }
            Err(error) => format!("a stop has been sent, and nothing shows that it has arrived: {error}"),
        })
    }
}

macro_rules! blocking {
    ($(
        $(#[$doc:meta])*
        fn $name:ident $([$($generics:tt)*])? ($context:ident $(, $argument:ident: $type:ty)*) -> $result:ty = $call:expr;
    )*) => {
        impl<L: Link, K> Drive<L, K> {
            $(
                $(#[$doc])*
                pub fn $name $(<$($generics)*>)? (&mut self $(, $argument: $type)*) -> Result<$result, Error> {
                    self.run(async |context: DriveContext| {
                        let $context = &context;
                        $call.await
                    })
                }
            )*
        }
    };
}

operations!(blocking);

impl<L: Link, K> fmt::Debug for Drive<L, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive")
            .field("kind", &self.context.description().name)
            .field("node", &self.node)
            .field("protection", &self.protection())
            .finish_non_exhaustive()
    }
}

impl<L: Link, K> Drop for Drive<L, K> {
    fn drop(&mut self) {
        if let Some(what) = self.shared.take().as_mut().and_then(Machine::let_go) {
            // A program ends normally even if its standard error is closed.
            let text = format_args!("the drive at node {} was let go while it may be moving: {what}", self.node);
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    }
}
