//! One conversation at a time with a node: a thread that carries out what is asked of it, one after the other.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};

use lexican_driver::CancelHandle;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, Instant, NodeId};

use super::hub::{Port, Ports};
use super::lock;
use crate::command::Refused;
use crate::model::Model;

/// Something to do with a node.
pub(super) type Task = Box<dyn FnOnce(&Station) + Send>;

/// How often a node is looked at that has nothing to do, so that the end of the bench is noticed.
const LOOK: Duration = Duration::from_millis(100);

/// A node, and what is to be done with it.
pub(super) struct Station {
    pub(super) node: NodeId,
    pub(super) ports: Ports,
    pub(super) model: Arc<Mutex<Model>>,
    queue: Mutex<Queue>,
    changed: Condvar,
    /// What is under way is to end as soon as it can.
    is_interrupted: AtomicBool,
    order: Mutex<Option<Order>>,
}

/// An order that a drive carries out.
struct Order {
    face: u32,
    cancel: CancelHandle,
}

#[derive(Default)]
struct Queue {
    tasks: VecDeque<Task>,
    polls: BTreeMap<Address, Poll>,
}

/// An entry that is read again and again.
struct Poll {
    every: Duration,
    next: Instant,
    /// For how many.
    users: u32,
}

/// What is next.
enum Next {
    Task(Task),
    Poll(Address),
    End,
}

impl Station {
    /// Begins to talk to a node.
    pub(super) fn begin(node: NodeId, ports: Ports, model: Arc<Mutex<Model>>) -> std::io::Result<Arc<Self>> {
        let station = Arc::new(Station {
            node,
            ports,
            model,
            queue: Mutex::default(),
            changed: Condvar::new(),
            is_interrupted: AtomicBool::new(false),
            order: Mutex::default(),
        });
        let worker = Arc::clone(&station);
        std::thread::Builder::new().name(format!("node {node}")).spawn(move || worker.run())?;
        Ok(station)
    }

    /// Does something when what was asked before is done.
    pub(super) fn ask(&self, task: impl FnOnce(&Station) + Send + 'static) {
        lock(&self.queue).tasks.push_back(Box::new(task));
        self.changed.notify_all();
    }

    /// Does something at once: ends what is under way, drops what waits, and cancels the order that the drive carries out.
    pub(super) fn interrupt(&self, task: impl FnOnce(&Station) + Send + 'static) {
        let mut queue = lock(&self.queue);
        self.is_interrupted.store(true, Ordering::Release);
        queue.tasks.clear();
        queue.tasks.push_back(Box::new(task));
        drop(queue);
        self.cancel(None);
        self.changed.notify_all();
    }

    /// Whether nothing waits.
    pub(super) fn is_idle(&self) -> bool {
        lock(&self.queue).tasks.is_empty() && lock(&self.order).is_none()
    }

    /// Whether what is under way is to end.
    pub(super) fn is_interrupted(&self) -> bool {
        self.is_interrupted.load(Ordering::Acquire)
    }

    /// Cancels the order that the drive carries out, if this face has given it; whoever has, without one.
    pub(super) fn cancel(&self, face: Option<u32>) {
        if let Some(order) = lock(&self.order).as_ref().filter(|order| face.is_none_or(|face| face == order.face)) {
            order.cancel.cancel();
        }
    }

    /// An order begins; [`Station::cancel`] ends it.
    pub(super) fn begin_order(&self, face: u32, cancel: CancelHandle) {
        if self.is_interrupted() {
            cancel.cancel();
        }
        *lock(&self.order) = Some(Order { face, cancel });
    }

    /// It is over.
    pub(super) fn end_order(&self) {
        *lock(&self.order) = None;
    }

    /// Reads an entry every so often, for one more user.
    pub(super) fn poll(&self, address: Address, every: Duration) {
        let now = self.ports.now();
        let mut queue = lock(&self.queue);
        let poll = queue.polls.entry(address).or_insert(Poll { every, next: now, users: 0 });
        poll.every = poll.every.min(every);
        poll.users += 1;
        drop(queue);
        self.changed.notify_all();
    }

    /// A user of it has gone.
    pub(super) fn unpoll(&self, address: Address) {
        let mut queue = lock(&self.queue);
        if let Some(poll) = queue.polls.get_mut(&address) {
            poll.users -= 1;
            if poll.users == 0 {
                queue.polls.remove(&address);
            }
        }
    }

    /// A network of this node alone.
    pub(super) fn network(&self) -> Result<Network<Port>, Refused> {
        let mut network = Network::new(self.ports.link());
        network.listen_to_own(&[]).map_err(Refused::new)?;
        Ok(network)
    }

    fn run(&self) {
        loop {
            match self.next() {
                Next::Task(task) => task(self),
                Next::Poll(address) => {
                    // The model hears the answer; a node that is gone shows by its silence.
                    if let Ok(mut network) = self.network() {
                        let _ = network.read_bytes(self.node, address);
                    }
                }
                Next::End => return,
            }
        }
    }

    fn next(&self) -> Next {
        let mut queue = lock(&self.queue);
        loop {
            if self.ports.is_over() {
                // Whoever waits for an answer gets none.
                queue.tasks.clear();
                return Next::End;
            }
            if let Some(task) = queue.tasks.pop_front() {
                self.is_interrupted.store(false, Ordering::Release);
                return Next::Task(task);
            }
            let now = self.ports.now();
            let due = queue.polls.iter_mut().min_by_key(|(_, poll)| poll.next);
            let mut wait = LOOK;
            if let Some((address, poll)) = due {
                if poll.next <= now {
                    // A node that is slower than that is read without a pause, but for what else is asked of it.
                    poll.next = now + poll.every;
                    return Next::Poll(*address);
                }
                wait = wait.min(poll.next.since(now));
            }
            queue = self.changed.wait_timeout(queue, wait.into()).unwrap_or_else(std::sync::PoisonError::into_inner).0;
        }
    }
}
