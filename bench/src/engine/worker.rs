//! Conversations with a node: a thread that carries out the tasks for it, one after the other.

use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use lexican_driver::CancelHandle;
use lexican_runtime::cia301::connection;
use lexican_runtime::host::Link as _;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::{Abort, ClientRequest};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

use super::hub::{Port, Ports};
use super::lock::lock;
use super::reply::Waiter;
use crate::model::{Braking, Model};
use crate::request::{Answer, Refused, Verb};

/// A task for a node.
pub(super) type Task = Box<dyn FnOnce(&Worker) + Send>;

/// How often an idle thread checks whether the bench has ended.
const LOOK: Duration = Duration::from_millis(100);

/// The client number of the bench itself.
pub(super) const NOBODY: u32 = 0;

/// Carries out an order to a drive.
pub(super) type Carry = fn(&Worker, Verb, Option<&str>) -> Result<Answer, Refused>;

/// A node with its tasks.
pub(super) struct Worker {
    pub(super) node: NodeId,
    pub(super) ports: Ports,
    pub(super) model: Arc<Mutex<Model>>,
    queue: Mutex<Queue>,
    changed: Condvar,
    stop_by: Carry,
}

#[derive(Default)]
struct Queue {
    /// Those who wait for the end of the next attempt to stop the drive.
    waiters: Vec<Waiter>,
    tasks: VecDeque<(u32, Task)>,
    polls: BTreeMap<Address, Poll>,
    /// Whether the thread has ended because the bus is lost.
    is_over: bool,
    under_way: Option<UnderWay>,
}

/// The task being carried out.
struct UnderWay {
    client: u32,
    kind: Kind,
    /// Whether it is to end as soon as possible.
    is_interrupted: bool,
    /// The links to cut to end it at once.
    ports: Vec<u64>,
    /// Ends an order by cancelling it, so that the order stops its drive.
    cancel: Option<CancelHandle>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Stop,
    Task,
    Poll,
}

/// An entry that is read repeatedly.
struct Poll {
    next: Instant,
    /// The interval that each of its users wants.
    users: Vec<Duration>,
}

enum Next {
    Stop(Braking),
    Task(Task),
    Poll(Address),
    End,
}

impl Worker {
    /// Starts the thread of a node; `stop_by` stops its drive.
    pub(super) fn begin(
        node: NodeId,
        ports: Ports,
        model: Arc<Mutex<Model>>,
        stop_by: Carry,
    ) -> std::io::Result<Arc<Self>> {
        let worker = Arc::new(Worker { node, ports, model, queue: Mutex::default(), changed: Condvar::new(), stop_by });
        let runs = Arc::clone(&worker);
        std::thread::Builder::new().name(format!("node {node}")).spawn(move || runs.run())?;
        Ok(worker)
    }

    /// Carries out a task for a client after all earlier ones.
    pub(super) fn ask(&self, client: u32, task: impl FnOnce(&Worker) + Send + 'static) {
        let mut queue = lock(&self.queue);
        if queue.is_over {
            return;
        }
        queue.tasks.push_back((client, Box::new(task)));
        drop(queue);
        self.changed.notify_all();
    }

    /// Stops the drive: ends the current task and drops waiting ones. Stopping precedes everything else, and is
    /// repeated until the drive has confirmed its standstill. `waiter` gets the result of the current or next attempt.
    pub(super) fn stop(&self, braking: Braking, waiter: impl FnOnce(Result<Answer, Refused>) + Send + 'static) {
        lock(&self.model).drive(self.node).standstill.want(self.ports.now(), braking);
        let mut queue = lock(&self.queue);
        if queue.is_over {
            return;
        }
        let dropped = std::mem::take(&mut queue.tasks);
        queue.waiters.push(Box::new(waiter));
        self.interrupt(&mut queue);
        drop(queue);
        // Drop them after unlocking: their clients get answers, and may lock this worker.
        drop(dropped);
        self.changed.notify_all();
    }

    /// Ends the current task if another attempt to stop the drive is due.
    pub(super) fn hurry(&self) {
        let due = lock(&self.model).drive_if_known(self.node).and_then(|drive| drive.standstill.poll_timeout());
        if due.is_some_and(|due| due <= self.ports.now()) {
            self.interrupt(&mut lock(&self.queue));
        }
    }

    /// Makes an attempt to stop the drive, and answers those who wait for it.
    fn bring_to_a_stand(&self, braking: Braking) {
        let order = match braking {
            Braking::Programmed => Verb::Stop,
            Braking::Full => Verb::QuickStop,
        };
        // A cancelled order has stopped its drive already, but somebody else may be moving it.
        let result = (self.stop_by)(self, order, None);
        let outcome = result.as_ref().map(drop).map_err(|refused| refused.why.clone());
        let result = result.map_err(|refused| Refused {
            why: format!(
                "drive {} has not confirmed that it stands, and is sent the stop again: {}",
                self.node, refused.why
            ),
            ..refused
        });
        let mut queue = lock(&self.queue);
        let mut model = lock(&self.model);
        let standstill = &mut model.drive(self.node).standstill;
        // If the end of the bench cuts off an attempt, its failure says less than that of the one before.
        if outcome.is_ok() || !self.ports.is_over() {
            standstill.handle_outcome(self.ports.now(), outcome);
        }
        // Those who want a stronger stop keep waiting.
        let is_answered = result.is_err() || standstill.unconfirmed().is_none();
        drop(model);
        let waiters = if is_answered { std::mem::take(&mut queue.waiters) } else { Vec::new() };
        drop(queue);
        waiters.into_iter().for_each(|waiter| waiter(result.clone()));
    }

    /// Ends all tasks of a client, waiting or current.
    pub(super) fn leave(&self, client: u32) {
        let mut queue = lock(&self.queue);
        let (dropped, kept) = std::mem::take(&mut queue.tasks).into_iter().partition(|(asker, _)| *asker == client);
        queue.tasks = kept;
        if queue.under_way.as_ref().is_some_and(|under_way| under_way.client == client) {
            self.interrupt(&mut queue);
        }
        drop(queue);
        let dropped: VecDeque<(u32, Task)> = dropped;
        drop(dropped);
    }

    fn interrupt(&self, queue: &mut Queue) {
        // A stop must not be cancelled by another one, or the drive might move on.
        let Some(under_way) = queue.under_way.as_mut().filter(|under_way| under_way.kind != Kind::Stop) else { return };
        under_way.is_interrupted = true;
        match &under_way.cancel {
            Some(cancel) => cancel.cancel(),
            None => under_way.ports.iter().for_each(|port| self.ports.cut(*port)),
        }
    }

    /// Whether there is no task.
    pub(super) fn is_idle(&self) -> bool {
        let queue = lock(&self.queue);
        let is_asked = queue.under_way.as_ref().is_some_and(|under_way| under_way.kind != Kind::Poll);
        let is_stopping =
            lock(&self.model).drive_if_known(self.node).is_some_and(|drive| drive.standstill.unconfirmed().is_some());
        queue.tasks.is_empty() && !is_asked && !is_stopping
    }

    /// Whether the current task is to end.
    pub(super) fn is_interrupted(&self) -> bool {
        lock(&self.queue).under_way.as_ref().is_some_and(|under_way| under_way.is_interrupted)
    }

    /// Notes that the current task is an order, which is ended by cancelling it.
    pub(super) fn begin_order(&self, cancel: CancelHandle) {
        if let Some(under_way) = &mut lock(&self.queue).under_way {
            if under_way.is_interrupted {
                cancel.cancel();
            }
            under_way.cancel = Some(cancel);
        }
    }

    /// Reads an entry at intervals, for one more user.
    pub(super) fn poll(&self, address: Address, every: Duration) {
        let now = self.ports.now();
        let mut queue = lock(&self.queue);
        let poll = queue.polls.entry(address).or_insert(Poll { next: now, users: Vec::new() });
        poll.users.push(every);
        poll.next = now;
        drop(queue);
        self.changed.notify_all();
    }

    /// Removes a user of an entry with this interval.
    pub(super) fn unpoll(&self, address: Address, every: Duration) {
        let mut queue = lock(&self.queue);
        let Some(poll) = queue.polls.get_mut(&address) else { return };
        if let Some(user) = poll.users.iter().position(|user| *user == every) {
            poll.users.swap_remove(user);
        }
        if poll.users.is_empty() {
            queue.polls.remove(&address);
        }
    }

    /// The entry that is due, for the current task to read; it counts as read from then on.
    pub(super) fn due(&self, now: Instant) -> Option<Address> {
        lock(&self.queue).due(now).ok()
    }

    /// A link that is cut to end the current task.
    pub(super) fn link(&self) -> Result<Port, Refused> {
        let port = self.ports.link();
        match &mut lock(&self.queue).under_way {
            Some(under_way) if under_way.is_interrupted => Err(Refused::interrupted()),
            Some(under_way) => {
                under_way.ports.push(port.number());
                Ok(port)
            }
            None => Ok(port),
        }
    }

    /// A network of this node alone, over such a link.
    pub(super) fn network(&self) -> Result<Network<Port>, Refused> {
        let mut network = Network::new(self.link()?);
        network.listen_to_own(&[]).map_err(Refused::new)?;
        Ok(network)
    }

    fn run(&self) {
        loop {
            let next = self.next();
            if matches!(next, Next::End) {
                return;
            }
            let is_stop = matches!(next, Next::Stop(_));
            // The node has no other thread: after a panic it continues, and stops the drive.
            if catch_unwind(AssertUnwindSafe(|| self.carry_out(next))).is_err() {
                self.handle_panic(is_stop);
            }
            let ended = lock(&self.queue).under_way.take();
            if ended.is_some_and(|ended| ended.is_interrupted && ended.cancel.is_none()) {
                self.abort();
            }
        }
    }

    fn carry_out(&self, next: Next) {
        match next {
            Next::Stop(braking) => self.bring_to_a_stand(braking),
            Next::Task(task) => task(self),
            Next::Poll(address) => {
                // The model takes the value from the bus, and notices a silent node itself.
                if let Ok(mut network) = self.network() {
                    let _ = network.read_bytes(self.node, address);
                }
            }
            Next::End => {}
        }
    }

    /// After a panic in a task, it is unknown whether the drive stands still.
    fn handle_panic(&self, was_stop: bool) {
        const WHY: &str = "the program has failed (a panic)";
        let mut model = lock(&self.model);
        let Some(drive) = model.drive_if_known(self.node) else { return };
        let now = self.ports.now();
        if was_stop {
            drive.standstill.handle_outcome(now, Err(WHY.to_owned()));
        } else if drive.order.take().is_some() {
            drive.standstill.want(now, Braking::Programmed);
        }
        drop(model);
        drop(std::mem::take(&mut lock(&self.queue).waiters));
    }

    /// Aborts the SDO transfer that was interrupted, because the node waits for its next frame.
    fn abort(&self) {
        let abort = Abort { address: Address::new(0, 0), code: AbortCode::GENERAL };
        let id = CobId::of_node(connection::SDO_REQUEST, self.node);
        // If the node misses it, the next request ends the transfer.
        let _ = self.ports.link().send(&Frame::from_array(id, ClientRequest::Abort(abort).to_bytes()));
    }

    fn next(&self) -> Next {
        let mut queue = lock(&self.queue);
        loop {
            if self.ports.is_over() {
                // Waiting clients are answered that the bench has ended.
                queue.is_over = true;
                let (waiters, tasks) = (std::mem::take(&mut queue.waiters), std::mem::take(&mut queue.tasks));
                drop(queue);
                drop((waiters, tasks));
                return Next::End;
            }
            let now = self.ports.now();
            let stop =
                lock(&self.model).drive_if_known(self.node).and_then(|drive| drive.standstill.poll_transmit(now));
            if let Some(braking) = stop {
                queue.under_way = Some(UnderWay::new(NOBODY, Kind::Stop));
                return Next::Stop(braking);
            }
            if let Some((client, task)) = queue.tasks.pop_front() {
                queue.under_way = Some(UnderWay::new(client, Kind::Task));
                return Next::Task(task);
            }
            let wait = match queue.due(now) {
                Ok(address) => {
                    queue.under_way = Some(UnderWay::new(NOBODY, Kind::Poll));
                    return Next::Poll(address);
                }
                Err(wait) => wait.min(LOOK),
            };
            queue = self.changed.wait_timeout(queue, wait.into()).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Queue {
    /// The entry to read now, or the time until the next one is due.
    fn due(&mut self, now: Instant) -> Result<Address, Duration> {
        let (address, poll) = self.polls.iter_mut().min_by_key(|(_, poll)| poll.next).ok_or(LOOK)?;
        if poll.next > now {
            return Err(poll.next.since(now));
        }
        // If the node is slower than the interval, reads follow without a pause, but other tasks come first.
        poll.next = now + poll.users.iter().copied().min().unwrap_or(LOOK);
        Ok(*address)
    }
}

impl UnderWay {
    fn new(client: u32, kind: Kind) -> Self {
        UnderWay { client, kind, is_interrupted: false, ports: Vec::new(), cancel: None }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::engine::hub;
    use crate::model::BusInfo;

    static ATTEMPTS: AtomicU32 = AtomicU32::new(0);

    fn stop(_: &Worker, _: Verb, _: Option<&str>) -> Result<Answer, Refused> {
        assert!(ATTEMPTS.fetch_add(1, Ordering::Relaxed) > 0, "the first attempt fails");
        Ok(Answer::Done)
    }

    #[test]
    fn a_panic_in_an_order_leaves_a_thread_that_stops_the_drive() {
        let model = Arc::new(Mutex::new(Model::new(Instant::ZERO, BusInfo::default())));
        let ports = hub::nowhere(Instant::ZERO);
        let worker = Worker::begin(NodeId::literal(5), ports, Arc::clone(&model), stop).unwrap();
        worker.ask(NOBODY, |worker| {
            lock(&worker.model).drive(worker.node).order = Some("travels".to_owned());
            panic!("in an order");
        });
        let stands = || {
            let mut model = lock(&model);
            let drive = model.drive(worker.node);
            drive.order.is_none() && drive.standstill.unconfirmed().is_none()
        };
        while ATTEMPTS.load(Ordering::Relaxed) < 2 || !stands() {
            std::thread::yield_now();
        }
        worker.ports.end();
    }
}
