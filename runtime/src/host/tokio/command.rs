//! What handles and the task say to each other.

use std::boxed::Box;
use std::vec::Vec;

use tokio::sync::oneshot;

use super::transfers::Transfer;
use crate::frame::Frame;
use crate::host::boot::{NotReady, Plan};
use crate::host::{BusState, LinkError};
use crate::id::{CobId, NodeId};
use crate::manager::{self, Manager};
use crate::time::{Duration, Instant};

/// What happens on a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The manager learned something.
    Manager(manager::Event),
    /// The bus is in another state.
    Bus(BusState),
    /// So many frames are missing here: see [`Incoming::Gap`](crate::host::Incoming::Gap).
    Gap(u32),
}

/// What a handle asks the task for.
pub(super) enum Command {
    Transfer(NodeId, Transfer),
    Send(Frame, Reply),
    Tell(Tell),
    Boot(Box<Plan>, Duration, oneshot::Sender<Result<(), NotReady>>),
    Listen(Option<Vec<CobId>>),
    /// Reply at this time.
    Alarm(Instant, oneshot::Sender<Instant>),
}

pub(super) type Reply = oneshot::Sender<Result<(), LinkError>>;

pub(super) type Tell = Box<dyn FnOnce(&mut Manager<127>, Instant) + Send>;
