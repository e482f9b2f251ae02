//! The blocking shell: a [`Manager`] over a [`Link`], one operation after the other.
//!
//! Waiting for an answer does not make the shell deaf. What else the manager learns meanwhile, it
//! keeps for [`Network::next_event`]: the last 1024 events, the oldest dropped first and counted.

use std::boxed::Box;
use std::collections::VecDeque;
use std::vec::Vec;

use super::access::{AccessError, LONGEST};
use super::bytes::Bytes;
use super::{Incoming, Link, LinkError};
use crate::abort::AbortCode;
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::manager::{BeginError, Event, Manager, Payloads, Remote};
use crate::object::{Address, Object, Pdo, Readable, Value, Writable};
use crate::service::sdo_client::{self, Payload, Scalar};
use crate::time::{Duration, Instant};
use crate::wire::nmt::NmtCommand;

/// All nodes of a bus, as a manager sees them through a link.
pub struct Network<L> {
    link: L,
    manager: Box<Manager<127>>,
    events: VecDeque<Event>,
    missed: u64,
}

/// How long frames that have come already are taken before a deadline that has passed.
const GRACE: Duration = Duration::from_millis(20);

/// How many events are kept until somebody asks for them.
const KEPT: usize = 1024;

impl<L: Link> Network<L> {
    /// A network over `link`. Nothing is sent.
    #[must_use]
    pub fn new(link: L) -> Self {
        Network { link, manager: Box::default(), events: VecDeque::new(), missed: 0 }
    }

    /// The manager, to be told what it is to look after, and asked what it knows.
    pub fn manager(&mut self) -> &mut Manager<127> {
        &mut self.manager
    }

    /// The link's time.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.link.now()
    }

    /// Gives the link back.
    #[must_use]
    pub fn into_link(self) -> L {
        self.link
    }

    /// Commands a node, or all of them.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub fn command(&mut self, command: NmtCommand, node: Option<NodeId>) -> Result<(), LinkError> {
        self.transmit(&mut Scalar::default())?;
        self.manager.command(command, node).expect("the frame before has just left");
        self.transmit(&mut Scalar::default())
    }

    /// Sends a PDO that a device receives under `id`.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub fn send_pdo<P: Pdo>(&mut self, id: CobId, pdo: P) -> Result<(), LinkError> {
        self.transmit(&mut Scalar::default())?;
        self.manager.send_pdo(id, pdo).expect("the frame before has just left");
        self.transmit(&mut Scalar::default())
    }

    /// Sends a frame as it is.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)
    }

    /// Reads an object.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    pub fn read<T: Value, A: Readable, M>(&mut self, node: NodeId, object: Object<T, A, M>) -> Result<T, AccessError> {
        let address = object.address();
        let mut value = Scalar::room_for::<T>();
        self.transfer(node, &mut value, |manager, now| manager.read(now, node, address))?;
        value.get().map_err(|error| AccessError::DataSheet { node, address, error })
    }

    /// Writes an object, when the data sheet allows the value.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    pub fn write<T: Value, A: Writable, M>(
        &mut self,
        node: NodeId,
        object: Object<T, A, M>,
        value: T,
    ) -> Result<(), AccessError> {
        object.check(value)?;
        let (address, mut value) = (object.address(), Scalar::of(value));
        let len = value.len();
        self.transfer(node, &mut value, |manager, now| manager.write(now, node, address, len)).map(drop)
    }

    /// Reads whatever an entry holds, up to 64 MiB.
    ///
    /// # Errors
    ///
    /// [`AccessError`].
    pub fn read_bytes(&mut self, node: NodeId, address: Address) -> Result<Vec<u8>, AccessError> {
        let mut data = Bytes::room_for(LONGEST);
        let len = self.transfer(node, &mut data, |manager, now| manager.read(now, node, address))?;
        Ok(data.into_vec(len))
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
    pub fn write_bytes(&mut self, node: NodeId, address: Address, data: &[u8]) -> Result<(), AccessError> {
        let len = u32::try_from(data.len()).expect("SDO transfers less than 4 GiB");
        self.transfer(node, &mut Bytes::of(data), |manager, now| manager.write(now, node, address, len)).map(drop)
    }

    /// What the manager learned, waiting for it no longer than `until`.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub fn next_event(&mut self, until: Instant) -> Result<Option<Event>, LinkError> {
        loop {
            if let Some(event) = self.events.pop_front() {
                return Ok(Some(event));
            }
            if self.step(until, &mut Scalar::default())? == Step::Over {
                return Ok(None);
            }
        }
    }

    /// Waits no longer than `span` for an event of which `pick` makes something. Events before it are gone.
    ///
    /// # Errors
    ///
    /// [`LinkError`].
    pub fn wait_for<R>(
        &mut self,
        span: Duration,
        mut pick: impl FnMut(&Event) -> Option<R>,
    ) -> Result<Option<R>, LinkError> {
        let until = self.now() + span;
        while let Some(event) = self.next_event(until)? {
            if let Some(picked) = pick(&event) {
                return Ok(Some(picked));
            }
        }
        Ok(None)
    }

    /// How many events were dropped because nobody asked for them.
    #[must_use]
    pub const fn missed_events(&self) -> u64 {
        self.missed
    }

    /// Runs one SDO transfer to its end, and returns the number of bytes.
    fn transfer(
        &mut self,
        node: NodeId,
        payload: &mut impl Payload,
        begin: impl FnOnce(&mut Manager<127>, Instant) -> Result<(), BeginError>,
    ) -> Result<u32, AccessError> {
        let now = self.now();
        if self.manager.remote(node).is_none() {
            self.manager.add(now, Remote::new(node)).expect("there is room for all 127 nodes");
        }
        begin(&mut self.manager, now).expect("the shell runs one transfer at a time");
        match self.finish(payload) {
            Ok(sdo_client::Event::Done { len, .. }) => Ok(len),
            Ok(sdo_client::Event::Failed(error)) => Err(AccessError::Sdo { node, error }),
            Err(error) => {
                let sdo = self.manager.sdo(node).expect("the node was added above");
                sdo.abort(AbortCode::GENERAL);
                Err(error.into())
            }
        }
    }

    fn finish(&mut self, payload: &mut impl Payload) -> Result<sdo_client::Event, LinkError> {
        loop {
            let until = self.manager.poll_timeout().expect("a transfer has a deadline");
            let Step::Sdo(event) = self.step(until, payload)? else { continue };
            // The node may have to be told that the transfer is over. It need not hear it.
            let _ = self.transmit(payload);
            return Ok(event);
        }
    }

    /// Sends what is to be sent, then takes one frame, deadline or change of the bus, not after `until`.
    fn step(&mut self, until: Instant, payload: &mut impl Payload) -> Result<Step, LinkError> {
        self.transmit(payload)?;
        let deadline = self.manager.poll_timeout().filter(|deadline| *deadline <= until);
        let event = match self.link.receive(deadline.unwrap_or(until))? {
            Some(Incoming::Frame(frame)) => self.manager.handle_frame(self.link.now(), &frame, payload),
            Some(Incoming::State(_)) => None,
            None if deadline.is_some() => self.manager.handle_timeout(self.link.now()),
            None => return Ok(Step::Over),
        };
        // A flood of frames must not hold up what is overdue; the frames that have come may be the answer.
        let now = self.link.now();
        let overdue = self.manager.poll_timeout().is_some_and(|deadline| deadline + GRACE <= now);
        let event = match event {
            None if overdue => self.manager.handle_timeout(now),
            event => event,
        };
        if event.is_none() && now >= until + GRACE {
            return Ok(Step::Over);
        }
        Ok(match event {
            Some(Event::Sdo { event, .. }) => Step::Sdo(event),
            Some(event) => {
                self.keep(event);
                Step::On
            }
            None => Step::On,
        })
    }

    fn transmit(&mut self, payload: &mut dyn Payloads) -> Result<(), LinkError> {
        while let Some(frame) = self.manager.poll_transmit(self.link.now(), payload) {
            self.link.send(&frame)?;
        }
        Ok(())
    }

    fn keep(&mut self, event: Event) {
        if self.events.len() == KEPT {
            self.events.pop_front();
            self.missed += 1;
        }
        self.events.push_back(event);
    }
}

#[derive(PartialEq, Eq)]
enum Step {
    /// Something happened that ends nothing.
    On,
    /// The transfer under way ended.
    Sdo(sdo_client::Event),
    /// The time is over.
    Over,
}
