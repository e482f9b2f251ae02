//! The handle of a node on the bus.

use std::sync::{Arc, Mutex};

use super::controller::Controller;
use super::fate::{Fate, Judge};
use super::state::State;
use crate::host::node::lock;
use crate::{Duration, Frame, Instant};

/// A node's place on a [`VirtualBus`](super::VirtualBus), to disturb this node and to see how it copes. Clones are
/// handles of the same place; the node stays attached when they are dropped.
///
/// Not to be used while the bus calls the node, because each method waits for the bus.
///
/// ```
/// use lexican_runtime::host::VirtualBus;
/// use lexican_runtime::Duration;
/// # fn sensor() -> impl lexican_runtime::host::Node + Send { std::vec::Vec::<Box<dyn lexican_runtime::host::Node + Send>>::new() }
///
/// let bus = VirtualBus::with_bit_rate(125);
/// let sensor = bus.attach(sensor());
/// sensor.set_response_time(Duration::from_millis(20));
/// sensor.detach();
/// bus.advance(Duration::from_secs(1));
/// sensor.attach();
/// ```
#[derive(Clone)]
pub struct Attachment {
    state: Arc<Mutex<State>>,
    pub(super) place: usize,
}

impl Attachment {
    pub(super) const fn new(state: Arc<Mutex<State>>, place: usize) -> Self {
        Attachment { state, place }
    }

    /// Pulls the plug: the node receives nothing, and what it sends waits. A frame on the wire from this node is cut
    /// off, and sent again when it is [attached](Attachment::attach).
    pub fn detach(&self) {
        let mut state = lock(&self.state);
        if let Some(frame) = state.cut_off(self.place) {
            state.controllers[self.place].hold(frame);
        }
        state.controllers[self.place].set_attached(false);
    }

    /// Connects the node again.
    pub fn attach(&self) {
        self.with_controller(|controller, _| controller.set_attached(true));
    }

    /// Cuts the power of the node; its controller loses all frames. See
    /// [`Node::set_power`](crate::host::Node::set_power).
    pub fn power_off(&self) {
        lock(&self.state).cut_off(self.place);
        self.with_controller(|controller, now| controller.set_power(now, false));
    }

    /// Restores the power of the node.
    pub fn power_on(&self) {
        self.with_controller(|controller, now| controller.set_power(now, true));
    }

    /// Sets how long the node takes for each frame that [concerns](crate::host::Node::concerns) it. It handles one
    /// after the other; frames that come meanwhile wait in the mailbox.
    ///
    /// The default is zero for a link, and for a node on a bus without a bit rate; it is 100 us for other nodes, as for
    /// a microcontroller.
    pub fn set_response_time(&self, response_time: Duration) {
        self.with_controller(|controller, _| controller.response_time = response_time);
    }

    /// Sets the size of the mailbox in frames, including the one that is being handled; unlimited by default. A frame
    /// for which there is no room is lost. The mailbox of a link holds what its application has not received; the link
    /// reports the loss ([`Incoming::Gap`](crate::host::Incoming::Gap)).
    ///
    /// # Panics
    ///
    /// When it is 0.
    pub fn set_mailbox(&self, frames: usize) {
        assert!(frames > 0, "a mailbox has room for a frame");
        self.with_controller(|controller, _| controller.set_capacity(frames));
    }

    /// How many frames were lost because the mailbox was full.
    #[must_use]
    pub fn overruns(&self) -> u64 {
        self.with_controller(|controller, _| controller.overruns())
    }

    /// Calls `fate` for each frame that the node sends, with its number from 0, to decide what happens to it. For
    /// [`Fate::Deliver`], the fate of the [bus](super::VirtualBus::set_fate) decides.
    pub fn set_fate(&self, fate: impl FnMut(u64, &Frame) -> Fate + Send + 'static) {
        self.with_controller(|controller, _| controller.judge = Judge::new(fate));
    }

    fn with_controller<R>(&self, what: impl FnOnce(&mut Controller, Instant) -> R) -> R {
        lock(&self.state).call(self.place, what)
    }
}
