//! The driver over the runtime's tokio shell: the same sequences, many drives at once on one network.

use std::fmt;
use std::future::Future;
use std::marker::PhantomData;
use std::pin::pin;
use std::task::Poll;

use lexican_runtime::host::AccessError;
use lexican_runtime::host::LinkError;
use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::manager::{self, Manager, Remote};
use lexican_runtime::object::{Mapping, Object, Readable, Rpdo, Tpdo, Value, Values, Writable};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::service::sdo_client::{Payload, SdoError};
use lexican_runtime::{Duration, Instant, NodeId};
use tokio::sync::broadcast;

use crate::context::{Access, Bytes, DriveContext};
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

/// How long to wait before the next attempt to reach a drive.
const LOOK: Duration = Duration::from_millis(50);

/// A drive of the kind `K`, a [`Kind`] or [`Any`], on a network. It runs one operation at a time; a call that is
/// dropped leaves the drive at it.
///
/// A drive that is dropped while it may be moving is sent a stop, and standard error says so. A process that is
/// killed drops nothing: see [the crate](crate#how-a-program-ends-and-what-the-drive-does-then).
pub struct Drive<K> {
    network: Network,
    events: broadcast::Receiver<Event>,
    node: NodeId,
    session: Session,
    supervision: Option<Supervision>,
    kind: PhantomData<fn() -> K>,
}

impl<K: Kind> Drive<K> {
    /// Connects to the drive at `node`, and checks that it is of this kind and has the COB-IDs that the driver uses. If
    /// the drive can notice that this program is gone, that protection is armed, as by [`Drive::connect_protected`]
    /// with [`Supervision::default`]; [`Drive::protection`] says which one it is, and the feature `tracing` logs it.
    /// Nothing else is changed in the drive.
    ///
    /// Errors: [`Error::NotThisDrive`], [`Error::OtherCobId`], [`Error::OtherMapping`]; [`Error::Sdo`] if the node does
    /// not answer.
    pub async fn connect(network: Network, node: NodeId) -> Result<Self, Error> {
        Self::connect_as(network, node, K::DESCRIPTION).await?.protected_if_possible().await
    }

    /// Connects as [`Drive::connect`] does, but arms no protection: for a program that only looks, or whose drive is
    /// protected by something else.
    ///
    /// **The drive does not notice if this program dies**: killed, aborted, or without power. It then goes on with its
    /// last order: a travel to its target, inching and velocity mode without end.
    pub async fn connect_unprotected(network: Network, node: NodeId) -> Result<Self, Error> {
        Self::connect_as(network, node, K::DESCRIPTION).await.inspect(Self::report_unprotected)
    }

    /// Connects to a drive that may still be without power, or hung up: as [`Drive::recover`], which stops the drive.
    /// It is protected as by [`Drive::connect`].
    pub async fn connect_and_recover(
        network: Network,
        node: NodeId,
        recovery: &Recovery,
    ) -> Result<(Self, Recovered), Error> {
        Self::recover_as(network, node, K::DESCRIPTION, recovery).await
    }

    /// Connects as [`Drive::connect`] does, but fails if the drive cannot notice within this time that this program is
    /// gone: arms its heartbeat consumer (1016h), or else its life guarding (100Ch, 100Dh). How the drive reacts is in
    /// its manual. The network's task sends the signs of life: a program that blocks the only thread of its runtime for
    /// longer than that is gone for the drive. After a restart of the drive, the next operation arms it again.
    /// [`Drive::unprotect`] disarms it; so does dropping the `Drive` with the drive at rest, if the network still runs.
    /// All drives on a network share its heartbeat, and so the node-ID of its sender.
    ///
    /// A program that hangs elsewhere than in that task is not noticed. None of this replaces an emergency stop.
    ///
    /// Errors: [`Error::Unsupported`] if the drive has neither.
    pub async fn connect_protected(network: Network, node: NodeId, supervision: Supervision) -> Result<Self, Error> {
        Self::connect_as(network, node, K::DESCRIPTION).await?.protected(supervision).await
    }
}

impl Drive<Any> {
    /// Connects as [`Drive::connect`] does, to a drive with this description.
    pub async fn connect_described(
        network: Network,
        node: NodeId,
        description: &'static Description,
    ) -> Result<Self, Error> {
        Self::connect_as(network, node, description).await?.protected_if_possible().await
    }

    /// Connects as [`Drive::connect_unprotected`] does, to a drive with this description.
    pub async fn connect_described_unprotected(
        network: Network,
        node: NodeId,
        description: &'static Description,
    ) -> Result<Self, Error> {
        Self::connect_as(network, node, description).await.inspect(Self::report_unprotected)
    }

    /// Connects as [`Drive::connect_and_recover`] does, to a drive with this description.
    pub async fn connect_described_and_recover(
        network: Network,
        node: NodeId,
        description: &'static Description,
        recovery: &Recovery,
    ) -> Result<(Self, Recovered), Error> {
        Self::recover_as(network, node, description, recovery).await
    }

    /// Connects as [`Drive::connect_protected`] does, to a drive with this description.
    pub async fn connect_described_protected(
        network: Network,
        node: NodeId,
        description: &'static Description,
        supervision: Supervision,
    ) -> Result<Self, Error> {
        Self::connect_as(network, node, description).await?.protected(supervision).await
    }
}

impl<K> Drive<K> {
    fn new(network: Network, node: NodeId, description: &'static Description) -> Self {
        let session = Session::new(node, description).with_latency(network.latency());
        let events = network.events();
        Drive { network, events, node, session, supervision: None, kind: PhantomData }
    }

    async fn connect_as(network: Network, node: NodeId, description: &'static Description) -> Result<Self, Error> {
        let mut drive = Self::new(network, node, description);
        match drive.identify().await {
            // The drive has just been powered up: it is there now.
            Err(Error::Restarted) => drive.identify().await?,
            identified => identified?,
        }
        Ok(drive)
    }

    async fn recover_as(
        network: Network,
        node: NodeId,
        description: &'static Description,
        recovery: &Recovery,
    ) -> Result<(Self, Recovered), Error> {
        let mut drive = Self::new(network, node, description);
        let recovered = drive.recover(recovery).await?;
        Ok((drive.protected_if_possible().await?, recovered))
    }

    async fn protected(mut self, supervision: Supervision) -> Result<Self, Error> {
        let armed = self.protect(supervision).await?;
        report(self.node, armed, None);
        Ok(self)
    }

    async fn protected_if_possible(mut self) -> Result<Self, Error> {
        let armed = self.protect(Supervision::default()).await;
        Protection::or_none(self.node, armed)?;
        Ok(self)
    }

    fn report_unprotected(&self) {
        report(self.node, Protection::None, None);
    }

    /// Arms the protection of [`Drive::connect_protected`] in a drive that is already connected, or with another time.
    ///
    /// Errors: those of [`Protection::is_lacking`] if the drive cannot notice.
    pub async fn protect(&mut self, supervision: Supervision) -> Result<Protection, Error> {
        if self.supervision.is_some_and(|armed| armed != supervision) {
            self.unprotect().await?;
        }
        self.arm(supervision).await?;
        self.supervision = Some(supervision);
        Ok(self.protection())
    }

    /// Disarms the protection: the drive goes on with its last order if this program dies. A program calls this before
    /// it ends, while its network runs: a drive that stays armed notices the end, and releases its motor or is in fault
    /// at the next start.
    pub async fn unprotect(&mut self) -> Result<(), Error> {
        let protection = self.protection();
        self.supervision = None;
        self.run_to_its_end(async |context: DriveContext| sequence::unprotect(&context, protection).await).await?;
        self.session.protected(Protection::None);
        self.report_unprotected();
        Ok(())
    }

    async fn identify(&mut self) -> Result<(), Error> {
        self.run(async |context: DriveContext| sequence::identify(&context).await).await
    }

    /// How the drive notices that this program is gone.
    #[must_use]
    pub fn protection(&self) -> Protection {
        self.session.protection()
    }

    /// How long a travel may take before it counts as timed out; ten minutes by default.
    pub fn set_patience(&mut self, patience: Duration) {
        self.session.context().lock().patience = patience;
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
    pub async fn recover(&mut self, recovery: &Recovery) -> Result<Recovered, Error> {
        let until = self.network.now().await? + recovery.within;
        let before = self.session.context().seen();
        let recovered = loop {
            let attempt = async |context: DriveContext| sequence::recover(&context, recovery, before).await;
            let now = match self.run_to_its_end(attempt).await {
                Err(error) if error.is_passing() => self.network.sleep_until(self.network.now().await? + LOOK).await?,
                recovered => break recovered,
            };
            if now >= until {
                break self.run_to_its_end(attempt).await;
            }
        };
        let recovered = self.session.conclude(recovered)?;
        self.session.protected(Protection::None);
        self.rearm().await?;
        Ok(recovered)
    }

    /// Stops the drive if it may be moving, after a call was dropped; returns the error of that call.
    pub(crate) async fn cancel(&mut self) -> Error {
        let (node, stopped) = (self.node, self.session.context().may_move());
        let ended = if stopped { self.stop().await } else { Ok(()) };
        ended.err().unwrap_or(Error::Cancelled { node, stopped })
    }

    /// Leaves the drive as it is, moving or not. The network goes on keeping a protected drive alive.
    pub fn release(self) {
        self.session.context().lock().rest();
    }

    /// Runs a sequence to its end: all methods for operations do only this. It also runs sequences that have no method.
    ///
    /// Errors: those of the sequence, and [`Error::MayBeMoving`].
    pub async fn run<T, F>(&mut self, sequence: impl FnOnce(DriveContext) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        self.rearm().await?;
        let result = self.run_to_its_end(sequence).await;
        self.session.conclude(result)
    }

    async fn run_to_its_end<T, F>(&mut self, sequence: impl FnOnce(DriveContext) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        let mut now = self.network.now().await?;
        self.catch_up();
        self.session.begin(now);
        let mut sequence = pin!(sequence(self.session.context()));
        loop {
            // What came before this poll must not look new to the sequence afterwards.
            self.catch_up();
            let polled = self.session.poll(now, sequence.as_mut());
            while let Some(frame) = self.session.poll_order() {
                self.network.send(frame).await?;
            }
            if let Poll::Ready(result) = polled {
                return result;
            }
            now = match self.session.poll_access() {
                Some(access) => {
                    let answer = self.transfer(access).await?;
                    self.session.handle_answer(answer);
                    self.network.now().await?
                }
                None => self.wait().await?,
            };
        }
    }

    async fn rearm(&mut self) -> Result<(), Error> {
        match self.supervision {
            Some(supervision) => self.arm(supervision).await,
            None => Ok(()),
        }
    }

    /// Arms the protection if it is not armed.
    async fn arm(&mut self, supervision: Supervision) -> Result<(), Error> {
        if self.protection() != Protection::None {
            return Ok(());
        }
        let node = self.node;
        let protection =
            self.run_to_its_end(async |context: DriveContext| sequence::protect(&context, supervision).await).await?;
        let keep_alive = move |manager: &mut Manager<127>, now| match protection {
            Protection::LifeGuarding { guard_time, life_time_factor } => {
                let remote = manager.remove(node).unwrap_or_else(|| Remote::new(node));
                // The place is free.
                let _ = manager.add(now, remote.with_guarding(guard_time, life_time_factor));
            }
            Protection::Heartbeat { manager: own, period, .. } => {
                let shortest = manager.heartbeat_period().map_or(period, |other| other.min(period));
                manager.produce_heartbeat(now, own, shortest);
            }
            Protection::None => {}
        };
        self.network.with_manager(keep_alive).await?;
        self.session.protected(protection);
        Ok(())
    }

    /// Waits for an event of this drive, or for the time at which the sequence wants to go on; returns the time then.
    async fn wait(&mut self) -> Result<Instant, Error> {
        let until = self.session.poll_timeout().unwrap_or(Instant::from_micros(u64::MAX));
        let network = self.network.clone();
        let mut alarm = pin!(network.sleep_until(until));
        loop {
            // `biased` keeps the order, so that runs in virtual time are repeatable.
            let event = tokio::select! {
                biased;
                now = &mut alarm => return Ok(now?),
                event = self.events.recv() => event,
            };
            match event {
                Ok(event) => {
                    if self.hear(event) {
                        return Ok(self.network.now().await?);
                    }
                }
                Err(broadcast::error::RecvError::Lagged(_)) => {
                    self.lose();
                    return Ok(self.network.now().await?);
                }
                // The network has ended: the call reports why.
                Err(broadcast::error::RecvError::Closed) => return Ok(self.network.now().await?),
            }
        }
    }

    async fn transfer(&self, access: Access) -> Result<Result<Bytes, SdoError>, Error> {
        let Access { address, mut payload, writes } = access;
        let done = if writes {
            self.network.write_bytes(self.node, address, payload.bytes()).await
        } else {
            self.network.read_bytes(self.node, address).await.map(|bytes| {
                // The payload is as long as the object: an answer without a length (42h) then counts as four bytes.
                payload.store(0, &bytes);
            })
        };
        match done {
            Ok(()) => Ok(Ok(payload)),
            Err(AccessError::Sdo { error, .. }) => Ok(Err(error)),
            Err(AccessError::OutOfRange(error)) => Err(Error::OutOfRange(error)),
            Err(AccessError::DataSheet { address, error, .. }) => Err(Error::DataSheet { address, error }),
            Err(AccessError::Link(error)) => Err(Error::Link(error)),
            // `AccessError` may get more variants; each means that the network has not done the access.
            Err(_) => Err(Error::Link(LinkError::Closed)),
        }
    }

    /// Handles all events that have come by now.
    fn catch_up(&mut self) {
        loop {
            match self.events.try_recv() {
                Ok(event) => drop(self.hear(event)),
                Err(broadcast::error::TryRecvError::Lagged(_)) => self.lose(),
                // All calls on a network that is gone fail.
                Err(_) => break,
            }
        }
    }

    /// Events were missed, and those in the channel are the oldest: drops them all.
    fn lose(&mut self) {
        self.events = self.events.resubscribe();
        self.session.context().missed();
    }

    /// Handles an event; returns whether it concerns this drive.
    fn hear(&mut self, event: Event) -> bool {
        match event {
            Event::Manager(manager::Event::Pdo { frame, .. }) => self.session.context().hear(&frame),
            Event::Manager(manager::Event::Emergency { node, emergency }) if node == self.node => {
                self.session.context().heard_emergency(emergency);
                true
            }
            Event::Manager(manager::Event::BootedUp { node }) if node == self.node => {
                self.session.context().heard_boot_up();
                // A restart has disarmed it.
                self.session.protected(Protection::None);
                true
            }
            Event::Gap(_) => {
                self.session.context().missed();
                true
            }
            _ => false,
        }
    }
}

macro_rules! asynchronous {
    ($(
        $(#[$doc:meta])*
        fn $name:ident $([$($generics:tt)*])? ($context:ident $(, $argument:ident: $type:ty)*) -> $result:ty = $call:expr;
    )*) => {
        impl<K> Drive<K> {
            $(
                $(#[$doc])*
                pub async fn $name $(<$($generics)*>)? (&mut self $(, $argument: $type)*) -> Result<$result, Error> {
                    self.run(async |context: DriveContext| {
                        let $context = &context;
                        $call.await
                    })
                    .await
                }
            )*
        }
    };
}

operations!(asynchronous);

impl<K> fmt::Debug for Drive<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive")
            .field("kind", &self.session.context().description().name)
            .field("node", &self.node)
            .field("protection", &self.protection())
            .finish_non_exhaustive()
    }
}

/// Posts the stop without waiting: the runtime may be shutting down, and would then never run a task spawned here.
impl<K> Drop for Drive<K> {
    fn drop(&mut self) {
        // The drive may have said meanwhile that it is disabled.
        self.catch_up();
        let stop: Vec<_> = self.session.context().let_go().collect();
        if stop.is_empty() {
            // The drive need not react to a program that ends in order.
            let armed = self.session.lets_disarm().unwrap_or_default();
            let context = self.session.context();
            for (object, value) in context.disarming(armed) {
                let _ = self.network.post(context.setting_frame(object, value));
            }
            return;
        }
        let what = match stop.into_iter().try_for_each(|frame| self.network.post(frame)) {
            Ok(()) => "a stop has been handed to its network",
            Err(_) => "no stop could be sent",
        };
        eprintln!("the drive at node {} was let go while it may be moving: {what}", self.node);
    }
}
