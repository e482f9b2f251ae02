//! A link that always has a frame.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Incoming, Link, LinkError, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// A link on which others send without end: each read returns a frame, which takes 100 µs.
pub(crate) struct Flooded {
    link: VirtualLink,
    sent: Arc<Mutex<Vec<String>>>,
}

impl Link for Flooded {
    fn now(&self) -> Instant {
        self.link.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.sent.lock().unwrap().push(frame.to_string());
        self.link.send(frame)
    }

    fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
        let until = self.now() + Duration::from_micros(100);
        let foreign = Frame::from_array(CobId::of_node(0x180, NodeId::literal(9)), [0x37, 0x02]);
        Ok(Some(self.link.receive(until)?.unwrap_or(Incoming::Frame(foreign))))
    }
}

pub(crate) fn flooded(bus: &VirtualBus) -> (Flooded, Arc<Mutex<Vec<String>>>) {
    let sent = Arc::default();
    (Flooded { link: bus.link(), sent: Arc::clone(&sent) }, sent)
}
