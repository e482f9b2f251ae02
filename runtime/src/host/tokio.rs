//! The tokio shell: one task owns the link and the manager; everybody else has a handle.
//!
//! - Handles are cheap to clone, `Send`, and need no lock.
//! - Every node has its own SDO channel, so that a silent node holds up nobody but those who ask it.
//!   Transfers with one node wait for each other in the order in which they were asked for.
//! - A call that is dropped before it is over is safe: a transfer that waits is forgotten, one that is
//!   under way runs to its end and its result is thrown away.
//! - Back-pressure: calls wait while 64 others wait for the task; what the task holds is bounded by the
//!   number of callers, since each waits for its own answer. Events are kept for each listener, the last
//!   1024 of them; a slower one is told how many it has missed.

use std::boxed::Box;
use std::collections::{BTreeMap, VecDeque};
use std::vec::Vec;

use tokio::sync::{broadcast, mpsc, oneshot};

use super::access::{AccessError, LONGEST};
use super::bytes::Bytes;
use super::readiness::Readiness;
use super::{BusState, Incoming, Link, LinkError};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::manager::{self, Manager, Payloads, Remote};
use crate::object::{Address, Object, Pdo, Readable, Value, Writable};
use crate::service::sdo_client::{self, Payload};
use crate::time::Instant;
use crate::wire::nmt::{NmtCommand, NmtMessage};

/// A handle of a network whose task runs in the background. When the last one is dropped, the task ends.
#[derive(Clone, Debug)]
pub struct Network {
    commands: mpsc::Sender<Command>,
    events: broadcast::Sender<Event>,
}

/// What happens on a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The manager learned something.
    Manager(manager::Event),
    /// The bus is in another state.
    Bus(BusState),
}

/// How many frames the task takes before it looks at deadlines and commands again.
const MOST_AT_ONCE: usize = 256;

enum Command {
    Transfer(Transfer),
    Send(Frame, oneshot::Sender<Result<(), LinkError>>),
    Tell(Tell),
}

type Tell = Box<dyn FnOnce(&mut Manager<127>, Instant) + Send>;

struct Transfer {
    node: NodeId,
    address: Address,
    /// The number of bytes to write; `None` to read.
    write: Option<u32>,
    payload: Bytes,
    begun: bool,
    reply: oneshot::Sender<Result<Vec<u8>, AccessError>>,
}

impl Network {
    /// Starts the task on the current runtime, with a network over `link`. Nothing is sent.
    ///
    /// # Errors
    ///
    /// When the runtime cannot wait for the link.
    ///
    /// # Panics
    ///
    /// Outside a tokio runtime.
    pub fn spawn<L: Link + Send + 'static>(link: L) -> std::io::Result<Network> {
        let (commands, inbox) = mpsc::channel(64);
        let (events, _) = broadcast::channel(1024);
        let owner = Owner {
            readiness: Readiness::of(&link)?,
            link,
            manager: Box::default(),
            transfers: Transfers::default(),
            events: events.clone(),
            inbox,
            more: false,
        };
        tokio::spawn(owner.run());
        Ok(Network { commands, events })
    }

    /// Reads an object.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    pub async fn read<T, A, M>(&self, node: NodeId, object: Object<T, A, M>) -> Result<T, AccessError>
    where
        T: Value,
        A: Readable,
    {
        let address = object.address();
        let bytes = self.transfer(node, address, None, Bytes::room_for(T::SIZE)).await?;
        T::from_bytes(&bytes).map_err(|error| AccessError::DataSheet { node, address, error })
    }

    /// Writes an object, when the data sheet allows the value.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    pub async fn write<T, A, M>(&self, node: NodeId, object: Object<T, A, M>, value: T) -> Result<(), AccessError>
    where
        T: Value,
        A: Writable,
    {
        object.check(value)?;
        let bytes = value.to_bytes();
        self.write_bytes(node, object.address(), bytes.get(..T::SIZE).unwrap_or(&bytes)).await
    }

    /// Reads whatever an entry holds, up to 64 MiB.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    pub async fn read_bytes(&self, node: NodeId, address: Address) -> Result<Vec<u8>, AccessError> {
        self.transfer(node, address, None, Bytes::room_for(LONGEST)).await
    }

    /// Writes bytes into an entry, whatever its type.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    ///
    /// # Panics
    ///
    /// When `data` is 4 GiB or longer: SDO cannot say that.
    pub async fn write_bytes(&self, node: NodeId, address: Address, data: &[u8]) -> Result<(), AccessError> {
        let len = u32::try_from(data.len()).expect("SDO transfers less than 4 GiB");
        self.transfer(node, address, Some(len), Bytes::of(data)).await.map(drop)
    }

    /// Commands a node, or all of them.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub async fn command(&self, command: NmtCommand, node: Option<NodeId>) -> Result<(), LinkError> {
        self.send(NmtMessage { command, node }.frame()).await
    }

    /// Sends a PDO that a device receives under `id`.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub async fn send_pdo<P: Pdo>(&self, id: CobId, pdo: P) -> Result<(), LinkError> {
        let bytes = pdo.to_raw().to_le_bytes();
        self.send(Frame::new(id, bytes.get(..P::LENGTH).unwrap_or(&bytes)).expect("a PDO has at most eight bytes"))
            .await
    }

    /// Sends a frame as it is; it is on its way to the bus when this returns.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub async fn send(&self, frame: Frame) -> Result<(), LinkError> {
        let (reply, answer) = oneshot::channel();
        self.commands.send(Command::Send(frame, reply)).await.map_err(|_| LinkError::Closed)?;
        answer.await.map_err(|_| LinkError::Closed)?
    }

    /// Hands over a frame without waiting, for those who cannot wait, such as a destructor. Once taken it
    /// reaches the link even when the runtime shuts down before the task runs again.
    ///
    /// # Errors
    ///
    /// The frame, when the task is gone or has 64 commands before it.
    pub fn post(&self, frame: Frame) -> Result<(), Frame> {
        let (reply, _) = oneshot::channel();
        self.commands.try_send(Command::Send(frame, reply)).map_err(|_| frame)
    }

    /// Tells the manager something, such as whose heartbeat it is to watch.
    ///
    /// # Errors
    ///
    /// [`LinkError::Closed`].
    pub async fn tell(&self, what: impl FnOnce(&mut Manager<127>, Instant) + Send + 'static) -> Result<(), LinkError> {
        self.commands.send(Command::Tell(Box::new(what))).await.map_err(|_| LinkError::Closed)
    }

    /// What happens from now on.
    #[must_use]
    pub fn events(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    async fn transfer(
        &self,
        node: NodeId,
        address: Address,
        write: Option<u32>,
        payload: Bytes,
    ) -> Result<Vec<u8>, AccessError> {
        let (reply, answer) = oneshot::channel();
        let transfer = Transfer { node, address, write, payload, begun: false, reply };
        self.commands.send(Command::Transfer(transfer)).await.map_err(|_| LinkError::Closed)?;
        answer.await.map_err(|_| LinkError::Closed)?
    }
}

/// Whoever runs the task.
struct Owner<L: Link> {
    link: L,
    readiness: Readiness,
    manager: Box<Manager<127>>,
    transfers: Transfers,
    events: broadcast::Sender<Event>,
    inbox: mpsc::Receiver<Command>,
    /// The link may have more than was taken at once.
    more: bool,
}

/// What was taken is sent, however the task ends: it may be what stops a machine.
impl<L: Link> Drop for Owner<L> {
    fn drop(&mut self) {
        while let Ok(command) = self.inbox.try_recv() {
            if let Command::Send(frame, reply) = command {
                drop(reply.send(self.link.send(&frame)));
            }
        }
    }
}

/// The transfers of each node: the first is under way, the others wait.
#[derive(Default)]
struct Transfers {
    of: BTreeMap<NodeId, VecDeque<Transfer>>,
    /// What a node without a transfer gets.
    nothing: [u8; 0],
}

impl Payloads for Transfers {
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload {
        match self.of.get_mut(&node).and_then(VecDeque::front_mut) {
            Some(transfer) => &mut transfer.payload,
            None => &mut self.nothing,
        }
    }
}

impl<L: Link> Owner<L> {
    async fn run(mut self) {
        loop {
            self.transmit();
            let deadline = self.manager.poll_timeout();
            tokio::select! {
                command = self.inbox.recv() => match command {
                    Some(command) => self.obey(command),
                    None => return,
                },
                () = self.readiness.wait(self.link.now(), deadline), if !self.more => {}
                () = tokio::task::yield_now(), if self.more => {}
            }
            if self.listen().and_then(|()| Ok(self.readiness.follow(&self.link)?)).is_err() {
                return;
            }
        }
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Tell(what) => {
                what(&mut self.manager, self.link.now());
                self.restart_lost_transfers();
            }
            Command::Send(frame, reply) => drop(reply.send(self.link.send(&frame))),
            Command::Transfer(transfer) => {
                let node = transfer.node;
                let waiting = self.transfers.of.entry(node).or_default();
                waiting.push_back(transfer);
                if waiting.len() == 1 {
                    self.begin(node);
                }
            }
        }
    }

    /// Begins the first transfer with a node that somebody still wants.
    fn begin(&mut self, node: NodeId) {
        let Some(waiting) = self.transfers.of.get_mut(&node) else { return };
        while waiting.front().is_some_and(|transfer| transfer.reply.is_closed()) {
            waiting.pop_front();
        }
        let Some(&Transfer { address, write, .. }) = waiting.front() else { return };
        let now = self.link.now();
        if self.manager.remote(node).is_none() {
            self.manager.add(now, Remote::new(node)).expect("there is room for all 127 nodes");
        }
        let begun = match write {
            Some(len) => self.manager.write(now, node, address, len),
            None => self.manager.read(now, node, address),
        };
        // When the application has a transfer of its own under way, its end brings the next attempt.
        if let Some(transfer) = self.transfers.of.get_mut(&node).and_then(VecDeque::front_mut) {
            transfer.begun = begun.is_ok();
        }
    }

    /// Begins transfers anew whose SDO client the application has replaced under them.
    fn restart_lost_transfers(&mut self) {
        for node in NodeId::all() {
            let begun = self.transfers.of.get(&node).and_then(VecDeque::front).is_some_and(|transfer| transfer.begun);
            if begun && self.manager.sdo(node).is_ok_and(|sdo| sdo.is_busy()) {
                continue;
            }
            self.begin(node);
        }
    }

    /// A transfer ended: whoever asked for it is told, and the next one begins.
    fn end(&mut self, node: NodeId, event: sdo_client::Event) {
        let ended =
            self.transfers.of.get_mut(&node).and_then(|all| if all.front()?.begun { all.pop_front() } else { None });
        let Some(transfer) = ended else { return self.begin(node) };
        let result = match event {
            sdo_client::Event::Done { len, .. } => Ok(transfer.payload.into_vec(len)),
            sdo_client::Event::Failed(error) => Err(AccessError::Sdo { node, error }),
        };
        // Nobody may be waiting any more.
        drop(transfer.reply.send(result));
        self.begin(node);
    }

    /// A frame that the link refuses is lost, as one on a bad bus is: whoever waits for an answer to it
    /// is told that none came.
    fn transmit(&mut self) {
        while let Some(frame) = self.manager.poll_transmit(self.link.now(), &mut self.transfers) {
            let _ = self.link.send(&frame);
        }
    }

    /// Takes what has come by now, but not so much that a flood holds up the rest; and what is due.
    fn listen(&mut self) -> Result<(), LinkError> {
        let until = self.link.now() + self.readiness.patience();
        self.more = true;
        for _ in 0..MOST_AT_ONCE {
            match self.link.receive(until)? {
                Some(Incoming::Frame(frame)) => {
                    let event = self.manager.handle_frame(self.link.now(), &frame, &mut self.transfers);
                    self.tell(event);
                    self.transmit();
                }
                // Nobody may be listening.
                Some(Incoming::State(state)) => drop(self.events.send(Event::Bus(state))),
                None => {
                    self.more = false;
                    break;
                }
            }
        }
        while self.manager.poll_timeout().is_some_and(|deadline| deadline <= self.link.now()) {
            let event = self.manager.handle_timeout(self.link.now());
            self.tell(event);
        }
        Ok(())
    }

    fn tell(&mut self, event: Option<manager::Event>) {
        match event {
            Some(manager::Event::Sdo { node, event }) => self.end(node, event),
            Some(event) => drop(self.events.send(Event::Manager(event))),
            None => {}
        }
    }
}
