//! The tokio shell: one task owns the link and the manager; handles send it requests.
//!
//! - Handles are cheap to clone, `Send`, and need no lock.
//! - Every node has its own SDO channel, so that a silent node delays only calls to that node.
//!   Transfers with one node run in the order of the calls; when the node does not
//!   answer, all calls fail that were made before the failed transfer began.
//! - A call may be dropped at any point: a transfer that waits is removed, one that is
//!   under way runs to its end and its result is dropped.
//! - Back-pressure: calls wait while 64 others wait for the task; what the task stores is bounded by the
//!   number of callers, since each waits for its own answer. Each listener has a queue of the last
//!   1024 events; a slower one gets an error with the number of events it has missed.
//! - On a link in real time a call that waits in `block_on` runs the network itself, which saves a look at the
//!   descriptors for each answer. The task goes on with it when the call is dropped, or no longer polled.
//! - A frame that the interface has no room for waits up to 100 ms, and everything that is to be sent
//!   after it waits behind it, in order. Meanwhile frames are received and deadlines kept. Then it is lost, as
//!   on a bad bus: a call that sends gets [`LinkError::Full`], a transfer times out.
//!
//! ```no_run
//! use lexican_runtime::NodeId;
//! use lexican_runtime::host::BusUrl;
//! use lexican_runtime::host::tokio::Network;
//! use lexican_runtime::object::{Object, Ro};
//!
//! // Generated from the data sheet: `od::DEVICE_TYPE`.
//! const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);
//!
//! # async fn run() -> Result<(), Box<dyn std::error::Error>> {
//! let network = Network::spawn("can0".parse::<BusUrl>()?.open()?)?;
//! let [one, other] = [5, 6].map(NodeId::literal);
//! // A node that does not answer does not delay the other one.
//! let types = tokio::join!(network.read(one, DEVICE_TYPE), network.read(other, DEVICE_TYPE));
//! println!("{types:?}");
//! # Ok(())
//! # }
//! ```

mod drive;
mod node;
mod outgoing;
mod owner;
mod runner;
mod transfers;
mod wait;

use std::boxed::Box;
use std::sync::{Arc, OnceLock};
use std::vec::Vec;

use tokio::sync::{broadcast, mpsc, oneshot};

use self::drive::Drive;
pub use self::node::{Named, RemoteNode};
pub use self::owner::Event;
use self::owner::{Owner, Request};
pub use self::runner::Runner;
use self::transfers::Transfer;
use super::access::{AccessError, LONGEST};
use super::boot::{BootNetworkError, Plan};
use super::bytes::Bytes;
use super::{Link, LinkError};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::manager::{self, MachinePlan, Manager, NetworkEvent};
use crate::object::{Address, Object, Pdo, Readable, Value, Writable};
use crate::time::{Duration, Instant};
use crate::wire::nmt::{NmtCommand, NmtMessage};

/// The patience of a handle without a limit.
const UNLIMITED: Duration = Duration::from_micros(u64::MAX);

/// A handle of a network whose task runs in the background. When the last one is dropped, the task ends.
#[derive(Clone, Debug)]
pub struct Network {
    drive: Arc<Drive>,
    requests: mpsc::Sender<Request>,
    posts: mpsc::Sender<Frame>,
    events: broadcast::WeakSender<Event>,
    patience: Duration,
    latency: Duration,
    /// Why the task has ended, if it was the link.
    failure: Arc<OnceLock<LinkError>>,
}

impl Network {
    /// Starts the task on the current runtime, with a network over `link`. Nothing is sent.
    ///
    /// # Panics
    ///
    /// Outside a tokio runtime.
    pub fn spawn<L: Link + Send + 'static>(link: L) -> std::io::Result<Network> {
        let (requests, asked) = mpsc::channel(64);
        let (posts, posted) = mpsc::channel(64);
        let (events, _) = broadcast::channel(1024);
        let (weak, failure, latency) = (events.downgrade(), Arc::default(), link.latency());
        let is_real_time = link.is_real_time();
        let owner = Owner::new(link, asked, posted, events)?;
        let drive = Drive::spawn(owner.run(Arc::clone(&failure)), is_real_time);
        Ok(Network { drive, requests, posts, events: weak, patience: UNLIMITED, latency, failure })
    }

    /// Limits how long each call to read or to write by this handle may take in all, including the wait for other calls.
    /// Then it fails with [`SdoError::TimedOut`](crate::service::sdo_client::SdoError::TimedOut). Without
    /// a limit, only a transfer that makes no progress fails.
    #[must_use]
    pub fn with_patience(self, patience: Duration) -> Self {
        Network { patience, ..self }
    }

    /// Boots a network, and keeps it up from now on, in place of the one before, as
    /// [the blocking shell](super::blocking::Network::boot) does: the task boots lost nodes again, which is reported by
    /// [`manager::Event::Network`]. `report` gets those events until the network is ready.
    pub async fn boot(
        &self,
        plan: Plan,
        boot_time: Duration,
        mut report: impl FnMut(&NetworkEvent),
    ) -> Result<(), BootNetworkError> {
        let mut events = self.events();
        let mut handle = |event| {
            if let Event::Manager(manager::Event::Network(event)) = event {
                report(&event);
            }
        };
        let (reply, mut answer) = oneshot::channel();
        let request = Request::Boot(Box::new(plan), boot_time, reply);
        self.ask(request).await?;
        let end = loop {
            tokio::select! {
                end = &mut answer => break end,
                // An error is the number of events that were missed.
                event = events.recv() => event.into_iter().for_each(&mut handle),
            }
        };
        while let Ok(event) = events.try_recv() {
            handle(event);
        }
        Ok(end.map_err(|_| self.closed())??)
    }

    /// Boots a machine, and keeps it up from now on as [`Network::boot`] does, with its SYNC and its heartbeat.
    ///
    /// # Panics
    ///
    /// If the machine has more than 127 nodes, which no bus has.
    pub async fn boot_machine<const NODES: usize>(
        &self,
        machine: &'static MachinePlan<NODES>,
        report: impl FnMut(&NetworkEvent),
    ) -> Result<(), BootNetworkError> {
        self.with_manager(|manager, now| machine.prepare(now, manager).expect("there is room for all nodes")).await?;
        self.boot(machine.network().expect("there is room for all nodes"), machine.boot_time, report).await
    }

    /// Reads an object.
    pub async fn read<T, A, M, D>(&self, node: NodeId, object: Object<T, A, M, D>) -> Result<T, AccessError>
    where
        T: Value,
        A: Readable,
    {
        let address = object.address();
        let bytes = self.transfer(node, address, None, Bytes::room_for(T::SIZE)).await?;
        T::from_bytes(&bytes).map_err(|error| AccessError::DataSheet { node, address, error })
    }

    /// Writes an object, when the data sheet allows the value.
    pub async fn write<T, A, M, D>(&self, node: NodeId, object: Object<T, A, M, D>, value: T) -> Result<(), AccessError>
    where
        T: Value,
        A: Writable,
    {
        object.check(value)?;
        let bytes = value.to_bytes();
        self.write_bytes(node, object.address(), bytes.get(..T::SIZE).unwrap_or(&bytes)).await
    }

    /// Reads the bytes of an entry of any type, up to 64 MiB.
    pub async fn read_bytes(&self, node: NodeId, address: Address) -> Result<Vec<u8>, AccessError> {
        self.transfer(node, address, None, Bytes::room_for(LONGEST)).await
    }

    /// Writes bytes into an entry of any type.
    ///
    /// # Panics
    ///
    /// When `data` is 4 GiB or longer, which SDO cannot transfer.
    pub async fn write_bytes(&self, node: NodeId, address: Address, data: &[u8]) -> Result<(), AccessError> {
        let len = u32::try_from(data.len()).expect("SDO transfers less than 4 GiB");
        self.transfer(node, address, Some(len), Bytes::of(data)).await.map(drop)
    }

    /// Commands a node, or all of them.
    pub async fn command(&self, command: NmtCommand, node: Option<NodeId>) -> Result<(), LinkError> {
        self.send(NmtMessage { command, node }.frame()).await
    }

    /// Sends a PDO that a device receives under `id`.
    pub async fn send_pdo<P: Pdo>(&self, id: CobId, pdo: P) -> Result<(), LinkError> {
        self.send(pdo.frame(id)).await
    }

    /// Sends a frame as it is; it is on its way to the bus when this returns.
    pub async fn send(&self, frame: Frame) -> Result<(), LinkError> {
        let (reply, answer) = oneshot::channel();
        self.answer(Request::Send(frame, reply), answer).await?
    }

    /// Posts a frame without waiting, for callers that cannot wait, such as a destructor. It is sent before the frames of
    /// all other calls, and after those posted before. Once accepted it reaches the link even when the runtime
    /// shuts down before the task runs again.
    ///
    /// Errors: the frame, when the task has ended or 64 posted frames wait.
    pub fn post(&self, frame: Frame) -> Result<(), Frame> {
        self.posts.try_send(frame).map_err(|_| frame)
    }

    /// Runs `what` with the manager, for example to watch a heartbeat.
    pub async fn with_manager(
        &self,
        what: impl FnOnce(&mut Manager<127>, Instant) + Send + 'static,
    ) -> Result<(), LinkError> {
        self.ask(Request::WithManager(Box::new(what))).await
    }

    /// Receives only frames of the manager's nodes, now and later, and those with `others`: PDOs
    /// whose identifiers are not those of the predefined connection set. A link that can leaves out the rest,
    /// so that a crowded bus costs nothing. Other nodes are no longer noticed. A node that is read or written
    /// becomes one of the manager's.
    pub async fn listen_to_own(&self, others: &[CobId]) -> Result<(), LinkError> {
        self.ask(Request::Listen(Some(others.to_vec()))).await
    }

    /// Receives all frames, as in the beginning.
    pub async fn listen_to_all(&self) -> Result<(), LinkError> {
        self.ask(Request::Listen(None)).await
    }

    /// As [`Link::latency`].
    #[must_use]
    pub fn latency(&self) -> Duration {
        self.latency
    }

    /// The link's time.
    pub async fn now(&self) -> Result<Instant, LinkError> {
        self.sleep_until(Instant::ZERO).await
    }

    /// Waits until `until` by the link's time, and returns that time.
    pub async fn sleep_until(&self, until: Instant) -> Result<Instant, LinkError> {
        let (reply, answer) = oneshot::channel();
        self.answer(Request::Alarm(until, reply), answer).await
    }

    /// The events from now on, until the link fails.
    #[must_use]
    pub fn events(&self) -> broadcast::Receiver<Event> {
        // If the task has ended there are none.
        let events = self.events.upgrade().unwrap_or_else(|| broadcast::channel(1).0);
        events.subscribe()
    }

    async fn transfer(
        &self,
        node: NodeId,
        address: Address,
        write: Option<u32>,
        payload: Bytes,
    ) -> Result<Vec<u8>, AccessError> {
        let (reply, answer) = oneshot::channel();
        let transfer = Transfer { address, write, payload, patience: self.patience, reply };
        self.answer(Request::Transfer(node, transfer), answer).await?
    }

    async fn ask(&self, request: Request) -> Result<(), LinkError> {
        self.requests.send(request).await.map_err(|_| self.closed())
    }

    /// Asks the network, and runs it in `block_on` until its answer is there.
    async fn answer<T>(&self, request: Request, answer: oneshot::Receiver<T>) -> Result<T, LinkError> {
        let answered = async {
            self.ask(request).await?;
            answer.await.map_err(|_| self.closed())
        };
        self.drive.attend(answered).await
    }

    /// Why the task has ended.
    fn closed(&self) -> LinkError {
        self.failure.get().map_or(LinkError::Closed, LinkError::again)
    }
}
