//! The driver over the runtime's tokio shell: the same sequences, many drives at once on one network.

use std::fmt;
use std::future::Future;
use std::marker::PhantomData;
use std::pin::pin;
use std::task::Poll;
use std::time::Duration as Wall;

use lexican_runtime::host::AccessError;
use lexican_runtime::host::LinkError;
use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::manager::{self, Manager};
use lexican_runtime::object::{Object, Readable, Value, Writable};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::service::sdo_client::{Payload, Scalar, SdoError};
use lexican_runtime::{Duration, Instant, NodeId};
use tokio::sync::{broadcast, oneshot};

use crate::description::Approach;
use crate::desk::{Access, Desk};
use crate::direction::Direction;
use crate::error::{Error, Outcome, VelocityOutcome};
use crate::fault::Cause;
use crate::kind::Kind;
use crate::mode::Mode;
use crate::operations::operations;
use crate::parameter::ParameterSet;
use crate::sequence::{self, Difference, Progress, Setting};
use crate::units::Units;

/// How long to wait for an event before the time is looked at: the time is the link's, which need not be that
/// of tokio.
const LOOK: Wall = Wall::from_millis(1);

/// A drive of the kind `K` on a network. It does one thing at a time; a call that is dropped leaves the drive doing it.
///
/// A drive that is dropped while it may be moving is told to stop, and standard error says so. A process that is
/// killed drops nothing: see [the crate](crate#what-stops-the-drive-when-the-application-does-not).
pub struct Drive<K: Kind> {
    network: Network,
    events: broadcast::Receiver<Event>,
    node: NodeId,
    desk: Desk,
    kind: PhantomData<fn() -> K>,
}

impl<K: Kind> Drive<K> {
    /// Connects to the drive at `node`, and makes sure that it is of this kind, and has the COB-IDs that the driver
    /// goes by. Nothing is changed in the drive.
    ///
    /// # Errors
    ///
    /// [`Error::NotThisDrive`], [`Error::OtherCobId`]; [`Error::Sdo`] when nobody answers.
    pub async fn connect(network: Network, node: NodeId) -> Result<Self, Error> {
        let (events, desk) = (network.events(), Desk::new(node, K::DESCRIPTION));
        let mut drive = Drive { network, events, node, desk, kind: PhantomData };
        match drive.identify().await {
            // Its power has only just come on: now it is there.
            Err(Error::Restarted) => drive.identify().await?,
            identified => identified?,
        }
        Ok(drive)
    }

    async fn identify(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::identify(&desk).await).await
    }

    /// How long travels may take until they count as timed out; ten minutes unless told otherwise.
    pub fn set_patience(&mut self, patience: Duration) {
        self.desk.lock().patience = patience;
    }

    /// Leaves the drive as it is, moving or not.
    pub fn release(self) {
        self.desk.lock().moving = false;
    }

    /// Runs a sequence to its end: this is all that the shell does. Any other than those above can be run too.
    ///
    /// # Errors
    ///
    /// Those of the sequence, and [`Error::Link`].
    pub async fn run<T, F>(&mut self, sequence: impl FnOnce(Desk) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        let now = self.now().await?;
        self.catch_up();
        self.desk.begin(now);
        let mut sequence = pin!(sequence(self.desk.clone()));
        loop {
            let now = self.now().await?;
            // What came before the sequence goes on must not look new to it afterwards.
            self.catch_up();
            let polled = self.desk.poll(now, sequence.as_mut());
            loop {
                let frame = self.desk.lock().outbox.pop_front();
                let Some(frame) = frame else { break };
                self.network.send(frame).await?;
            }
            if let Poll::Ready(result) = polled {
                return result;
            }
            let access = self.desk.lock().access.take();
            match access {
                Some(access) => {
                    let answer = self.transfer(access).await?;
                    self.desk.lock().answer = Some(answer);
                }
                None => self.listen().await?,
            }
        }
    }

    /// The time of the link, by which sequences wait.
    async fn now(&self) -> Result<Instant, Error> {
        let (reply, answer) = oneshot::channel();
        // Nobody waits for the answer any more when the call has been dropped.
        let tell = |_: &mut Manager<127>, now| {
            let _ = reply.send(now);
        };
        self.network.tell(tell).await?;
        Ok(answer.await.map_err(|_| LinkError::Closed)?)
    }

    async fn transfer(&self, access: Access) -> Result<Result<Scalar, SdoError>, Error> {
        let Access { address, mut payload, writes } = access;
        let done = if writes {
            self.network.write_bytes(self.node, address, payload.bytes()).await
        } else {
            self.network.read_bytes(self.node, address).await.map(|bytes| {
                // The payload has room for what the object has: an answer that does not tell its length (42h) is
                // one of four bytes.
                payload.store(0, &bytes);
            })
        };
        match done {
            Ok(()) => Ok(Ok(payload)),
            Err(AccessError::Sdo { error, .. }) => Ok(Err(error)),
            Err(AccessError::OutOfRange(error)) => Err(Error::OutOfRange(error)),
            Err(AccessError::DataSheet { address, error, .. }) => Err(Error::DataSheet { address, error }),
            Err(AccessError::Link(error)) => Err(Error::Link(error)),
            // The enum may grow: whatever it is, the network did not do what it was asked.
            Err(_) => Err(Error::Link(LinkError::Closed)),
        }
    }

    /// Waits for an event, but not long.
    async fn listen(&mut self) -> Result<(), Error> {
        match tokio::time::timeout(LOOK, self.events.recv()).await {
            Ok(Ok(event)) => self.hear(event),
            Ok(Err(broadcast::error::RecvError::Lagged(_))) => self.lose(),
            Err(_) => {}
            Ok(Err(broadcast::error::RecvError::Closed)) => return Err(Error::Link(LinkError::Closed)),
        }
        Ok(())
    }

    /// Hears all that has come by now.
    fn catch_up(&mut self) {
        loop {
            match self.events.try_recv() {
                Ok(event) => self.hear(event),
                Err(broadcast::error::TryRecvError::Lagged(_)) => self.lose(),
                // A network that is gone is told of by whoever asks it for something.
                Err(_) => break,
            }
        }
    }

    /// Events were missed. Those that are left are the oldest: better to have none of them.
    fn lose(&mut self) {
        self.events = self.events.resubscribe();
        self.desk.missed();
    }

    fn hear(&self, event: Event) {
        match event {
            Event::Manager(manager::Event::Pdo { frame, .. }) => drop(self.desk.hear(&frame)),
            Event::Manager(manager::Event::Emergency { node, emergency }) if node == self.node => {
                self.desk.heard_emergency(emergency);
            }
            Event::Manager(manager::Event::BootedUp { node }) if node == self.node => self.desk.heard_boot_up(),
            _ => {}
        }
    }
}

macro_rules! asynchronous {
    ($(
        $(#[$doc:meta])*
        fn $name:ident $([$($generics:tt)*])? ($desk:ident $(, $argument:ident: $type:ty)*) -> $result:ty = $call:expr;
    )*) => {
        impl<K: Kind> Drive<K> {
            $(
                $(#[$doc])*
                pub async fn $name $(<$($generics)*>)? (&mut self $(, $argument: $type)*) -> Result<$result, Error> {
                    self.run(async |desk: Desk| {
                        let $desk = &desk;
                        $call.await
                    })
                    .await
                }
            )*
        }
    };
}

operations!(asynchronous);

impl<K: Kind> fmt::Debug for Drive<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive").field("kind", &K::DESCRIPTION.name).field("node", &self.node).finish_non_exhaustive()
    }
}

/// The stop is handed over without waiting, since the runtime may be shutting down: a task that was spawned here
/// would then never run.
impl<K: Kind> Drop for Drive<K> {
    fn drop(&mut self) {
        // The drive may have said that it is not enabled any more.
        self.catch_up();
        let Some(stop) = self.desk.let_go() else { return };
        let what = match self.network.post(stop) {
            Ok(()) => "the stop has been handed to its network",
            Err(_) => "it could not be told to stop",
        };
        eprintln!("the drive at node {} was let go while it may be moving: {what}", self.node);
    }
}
