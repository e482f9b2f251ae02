//! zencan: an async client on tokio's timer, and a whole node whose generated statics are guarded by critical
//! sections. The node only runs when the client awaits an answer and none is there, which is the least that works.
//! Access rights, lengths and identifiers are checked, and there are timeouts, as with ours. Its client takes
//! answers about other objects, and does not notice lost segments of a block.

use std::cell::{Cell, RefCell};
use std::future::pending;
use std::hint::black_box;
use std::thread::LocalKey;

use tokio::runtime::Runtime;
use zencan_client::SdoClient;
use zencan_common::messages::CanMessage;
use zencan_common::traits::{AsyncCanReceiver, AsyncCanSender, CanSendError};
use zencan_node::{Callbacks, Node, NodeMbox};

use super::transfer::{Case, Direction, Indices, Kind, Transfer, bytes_index, check, pattern};
use crate::measure::Contender;

const NODE: u8 = 5;

/// The generated code of three devices: build.rs.
#[allow(missing_debug_implementations, unused, clippy::all, reason = "not ours")]
pub(super) mod generated {
    pub(crate) mod small {
        zencan_node::include_modules!(SMALL);
    }
    pub(crate) mod large {
        zencan_node::include_modules!(LARGE);
    }
    pub(crate) mod pdos {
        zencan_node::include_modules!(PDOS);
    }
}

use generated::{large, small};

macro_rules! node {
    ($device:ident) => {
        RefCell::new(Node::new(
            zencan_common::NodeId::new(NODE).expect("1 to 127"),
            Callbacks::new(),
            &$device::NODE_MBOX,
            &$device::NODE_STATE,
            &$device::OD_TABLE,
        ))
    };
}

thread_local! {
    static SMALL: RefCell<Node<'static>> = node!(small);
    static LARGE: RefCell<Node<'static>> = node!(large);
    static FRAMES: Cell<u64> = const { Cell::new(0) };
    static NOW_US: Cell<u64> = const { Cell::new(0) };
}

pub(super) fn contender(case: Case) -> Contender {
    let mut channel = Channel::new(case.kind);
    let frames = check(case, &mut channel);
    let name = "zencan 0.0.5";
    let contender = match (case.kind, case.direction) {
        (Kind::Expedited { objects }, direction) => {
            let mut indices = Indices::new(objects);
            let mut value = 0_u32;
            Contender::in_batches(name, move |times| channel.numbers(direction, times, &mut indices, &mut value))
        }
        (Kind::Segmented { len } | Kind::Block { len }, direction) => {
            let buffer = pattern(len, 0);
            Contender::in_batches(name, move |times| channel.bytes(direction, times, black_box(&buffer)))
        }
    };
    contender.with_frames(frames)
}

struct Channel {
    runtime: Runtime,
    client: SdoClient<Wire, Wire>,
    wire: Wire,
    by_block: bool,
}

impl Channel {
    fn new(kind: Kind) -> Self {
        let wire = match kind {
            Kind::Expedited { objects: 1000 } => Wire { mbox: &large::NODE_MBOX, node: &LARGE },
            _ => Wire { mbox: &small::NODE_MBOX, node: &SMALL },
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build();
        let runtime = runtime.expect("a runtime without I/O");
        let channel = Channel {
            runtime,
            client: SdoClient::new_std(NODE, wire, wire),
            wire,
            by_block: matches!(kind, Kind::Block { .. }),
        };
        channel.wire.settle();
        channel
    }

    fn numbers(&mut self, direction: Direction, times: u64, indices: &mut Indices, value: &mut u32) {
        let client = &mut self.client;
        self.runtime.block_on(async {
            for _ in 0..times {
                *value = value.wrapping_add(1);
                match direction {
                    Direction::Read => {
                        black_box(client.read_u32(indices.next(), 0).await.expect("a read"));
                    }
                    Direction::Write => client.write_u32(indices.next(), 0, black_box(*value)).await.expect("a write"),
                }
            }
        });
    }

    fn bytes(&mut self, direction: Direction, times: u64, data: &[u8]) {
        for _ in 0..times {
            match direction {
                Direction::Read => drop(black_box(Transfer::read(self, bytes_index(data.len()), data.len()))),
                Direction::Write => Transfer::write(self, bytes_index(data.len()), data),
            }
        }
    }
}

impl Transfer for Channel {
    fn read(&mut self, index: u16, _len: usize) -> Vec<u8> {
        if !self.by_block {
            return self.runtime.block_on(self.client.upload(index, 0)).expect("a read");
        }
        let data = self.runtime.block_on(self.client.block_upload(index, 0)).expect("a read");
        // The node answers the end of a block upload with an abort, which would fail the next transfer.
        self.wire.settle();
        data
    }

    fn write(&mut self, index: u16, data: &[u8]) {
        let written = if self.by_block {
            self.runtime.block_on(self.client.block_download(index, 0, data))
        } else {
            self.runtime.block_on(self.client.download(index, 0, data))
        };
        written.expect("a write");
    }

    fn frames(&self) -> u64 {
        FRAMES.get()
    }
}

/// Both ends of the client's bus.
#[derive(Clone, Copy)]
struct Wire {
    mbox: &'static NodeMbox,
    node: &'static LocalKey<RefCell<Node<'static>>>,
}

impl Wire {
    fn process(self) {
        NOW_US.set(NOW_US.get() + 1);
        self.node.with_borrow_mut(|node| node.process(NOW_US.get()));
    }

    /// Throws away what the node still has to say.
    fn settle(self) {
        self.process();
        while self.mbox.next_transmit_message().is_some() {}
    }
}

#[derive(Debug)]
struct Lost(CanMessage);

impl CanSendError for Lost {
    fn into_can_message(self) -> CanMessage {
        self.0
    }

    fn message(&self) -> String {
        format!("the node does not take {:?}", self.0)
    }
}

impl AsyncCanSender for Wire {
    type Error = Lost;

    async fn send(&mut self, message: CanMessage) -> Result<(), Lost> {
        FRAMES.set(FRAMES.get() + 1);
        self.mbox.store_message(*black_box(&message)).map_err(Lost)
    }
}

impl AsyncCanReceiver for Wire {
    type Error = Lost;

    fn try_recv(&mut self) -> Option<CanMessage> {
        let message = self.mbox.next_transmit_message().or_else(|| {
            self.process();
            self.mbox.next_transmit_message()
        })?;
        FRAMES.set(FRAMES.get() + 1);
        Some(*black_box(&message))
    }

    async fn recv(&mut self) -> Result<CanMessage, Lost> {
        match self.try_recv() {
            Some(message) => Ok(message),
            // Nothing comes any more; the client gives up after its timeout.
            None => pending().await,
        }
    }
}
