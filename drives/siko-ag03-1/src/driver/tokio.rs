//! The driver over the runtime's tokio shell: the same sequences, many drives at once on one network.

use std::future::Future;
use std::pin::pin;
use std::task::Poll;
use std::time::Duration as Wall;

use lexican_runtime::host::AccessError;
use lexican_runtime::host::LinkError;
use lexican_runtime::host::tokio::{Event, Network};
use lexican_runtime::manager::{self, Manager};
use lexican_runtime::object::{Object, Readable, Value, Writable};
use lexican_runtime::service::sdo_client::{Payload, Scalar, SdoError};
use lexican_runtime::{Duration, Instant, NodeId};
use tokio::sync::{broadcast, oneshot};

use super::Mode;
use super::description::{AG03_1, Description};
use super::desk::{Access, Desk};
use super::error::{Error, Outcome, VelocityOutcome};
use super::sequence::{self, Progress};
use crate::Direction;
use crate::fault::Cause;
use crate::state::State;

/// How long to wait for an event before the time is looked at: the time is the link's, which need not be that
/// of tokio.
const LOOK: Wall = Wall::from_millis(1);

/// A drive on a network. It does one thing at a time; a call that is dropped leaves the drive doing it.
///
/// A drive that is dropped while it may be moving is told to stop, and standard error says so. A process that is
/// killed drops nothing: see [the module](super) for what to arm.
#[derive(Debug)]
pub struct Drive {
    network: Network,
    events: broadcast::Receiver<Event>,
    node: NodeId,
    desk: Desk,
    patience: Duration,
}

impl Drive {
    /// Connects to the AG03/1 at `node`, and makes sure that it is one. Nothing is changed in the drive.
    ///
    /// # Errors
    ///
    /// [`Error::NotThisDrive`]; [`Error::Sdo`] when nobody answers.
    pub async fn connect(network: Network, node: NodeId) -> Result<Self, Error> {
        Drive::connect_as(network, node, &AG03_1).await
    }

    /// The same for a drive with another description.
    ///
    /// # Errors
    ///
    /// As [`Drive::connect`].
    pub async fn connect_as(network: Network, node: NodeId, description: &'static Description) -> Result<Self, Error> {
        let (events, desk) = (network.events(), Desk::new(node, description));
        let mut drive = Drive { network, events, node, desk, patience: Duration::from_secs(600) };
        match drive.run(async |desk: Desk| sequence::identify(&desk).await).await {
            // Its power has only just come on: now it is there.
            Err(Error::Restarted) => drive.run(async |desk: Desk| sequence::identify(&desk).await).await?,
            identified => identified?,
        }
        Ok(drive)
    }

    /// How long travels may take until they count as timed out; ten minutes unless told otherwise.
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// Leaves the drive as it is, moving or not.
    pub fn release(self) {
        self.desk.lock().moving = false;
    }

    /// See [`sequence::state`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn state(&mut self) -> Result<State, Error> {
        self.run(async |desk: Desk| sequence::state(&desk).await).await
    }

    /// See [`sequence::enable`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn enable(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::enable(&desk).await).await
    }

    /// See [`sequence::disable`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn disable(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::disable(&desk).await).await
    }

    /// See [`sequence::quick_stop`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn quick_stop(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::quick_stop(&desk).await).await
    }

    /// See [`sequence::reset_fault`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn reset_fault(&mut self) -> Result<Option<Cause>, Error> {
        self.run(async |desk: Desk| sequence::reset_fault(&desk).await).await
    }

    /// See [`sequence::set_mode`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn set_mode(&mut self, mode: Mode) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::set_mode(&desk, mode).await).await
    }

    /// Travels to `target`, in units of positions, and waits for the end.
    ///
    /// # Errors
    ///
    /// Those of [`sequence::start_travel`] and [`sequence::finish`].
    pub async fn move_to(&mut self, target: i32) -> Result<Outcome, Error> {
        self.start_moving_to(target).await?;
        self.finish(|_| {}).await
    }

    /// See [`sequence::start_travel`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn start_moving_to(&mut self, target: i32) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::start_travel(&desk, target).await).await
    }

    /// Waits until the travel under way is over, and tells how far it has come meanwhile.
    ///
    /// # Errors
    ///
    /// Those of [`sequence::finish`].
    pub async fn finish(&mut self, mut watch: impl FnMut(Progress) + Send) -> Result<Outcome, Error> {
        let patience = self.patience;
        self.run(async |desk: Desk| sequence::finish(&desk, patience, &mut watch).await).await
    }

    /// See [`sequence::interrupt`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn interrupt(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::interrupt(&desk).await).await
    }

    /// See [`sequence::resume`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn resume(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::resume(&desk).await).await
    }

    /// See [`sequence::step`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn step(&mut self) -> Result<Outcome, Error> {
        let patience = self.patience;
        self.run(async |desk: Desk| sequence::step(&desk, patience).await).await
    }

    /// See [`sequence::inch`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn inch(&mut self, direction: Direction) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::inch(&desk, direction).await).await
    }

    /// See [`sequence::stop_inching`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn stop_inching(&mut self) -> Result<i32, Error> {
        self.run(async |desk: Desk| sequence::stop_inching(&desk).await).await
    }

    /// See [`sequence::run_at`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn run_at(&mut self, velocity: i32) -> Result<VelocityOutcome, Error> {
        let patience = self.patience;
        self.run(async |desk: Desk| sequence::run_at(&desk, velocity, patience).await).await
    }

    /// See [`sequence::stop`].
    ///
    /// # Errors
    ///
    /// Those of the sequence.
    pub async fn stop(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::stop(&desk).await).await
    }

    /// Reads an object.
    ///
    /// # Errors
    ///
    /// [`Error::Sdo`].
    pub async fn read<T: Value, A: Readable, M>(&mut self, object: Object<T, A, M>) -> Result<T, Error> {
        self.run(async |desk: Desk| desk.read(object).await).await
    }

    /// Writes an object.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] before anything is sent; [`Error::Sdo`].
    pub async fn write<T: Value, A: Writable, M>(&mut self, object: Object<T, A, M>, value: T) -> Result<(), Error> {
        self.run(async |desk: Desk| desk.write(object, value).await).await
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

/// The stop is handed over without waiting, since the runtime may be shutting down: a task that was spawned here
/// would then never run.
impl Drop for Drive {
    fn drop(&mut self) {
        let Some(stop) = self.desk.let_go() else { return };
        let what = match self.network.post(stop) {
            Ok(()) => "the stop has been handed to its network",
            Err(_) => "it could not be told to stop",
        };
        eprintln!("the drive at node {} was let go while it may be moving: {what}", self.node);
    }
}
