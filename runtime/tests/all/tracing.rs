//! What the shells report to `tracing`.
#![cfg(feature = "tracing")]

#[allow(dead_code, reason = "several tests share it")]
use std::fmt;
use std::sync::{Arc, Mutex};

use crate::shell_support::{DEVICE_TYPE, station};
use lexican_runtime::host::{BusState, Participant, VirtualBus, blocking};
use lexican_runtime::{Duration, NodeId};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

const NODE: NodeId = NodeId::literal(5);

/// Collects events as lines of text, without their times.
#[derive(Clone, Default)]
struct Collector(Arc<Mutex<Vec<String>>>);

impl Collector {
    /// The lines of a level and target.
    fn lines(&self, head: &str) -> Vec<String> {
        let lines = self.0.lock().unwrap();
        lines.iter().filter_map(|line| line.strip_prefix(head)).map(str::to_owned).collect()
    }
}

struct Line(String);

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() != "now" {
            self.0 += &format!(" {}={value:?}", field.name());
        }
    }
}

impl Subscriber for Collector {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }
    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }
    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn event(&self, event: &Event<'_>) {
        let mut line = Line(format!("{} {}:", event.metadata().level(), event.metadata().target()));
        event.record(&mut line);
        self.0.lock().unwrap().push(line.0);
    }
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
}

#[test]
fn frames_trouble_and_events_are_reported() {
    let collector = Collector::default();
    let _guard = tracing::subscriber::set_default(collector.clone());
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    let mut network = blocking::Network::new(bus.link());
    network.read(NODE, DEVICE_TYPE).unwrap();
    bus.set_state(BusState::Off);
    network.read(NODE, DEVICE_TYPE).unwrap_err();
    let until = network.now() + Duration::from_millis(1);
    while !matches!(network.next_event(until), Ok(None)) {}

    let frames = collector.lines("TRACE lexican::frames:");
    let sent = " message=sent frame=605#4000100000000000";
    assert_eq!(frames, [sent, " message=received frame=705#00", " message=received frame=585#4300100092010200"]);
    let trouble = collector.lines("WARN lexican::link:");
    assert!(trouble[0].starts_with(" message=not sent frame=605#40"), "{trouble:?}");
    assert!(trouble.iter().any(|line| line == " message=bus state state=bus-off"), "{trouble:?}");
    let events = collector.lines("INFO lexican::nodes:");
    assert_eq!(events, [" message=event event=BootedUp { node: NodeId(5) }"]);
    let transfers = collector.lines("DEBUG lexican::nodes:");
    assert!(transfers[0].starts_with(" message=SDO node=5 event=Done"), "{transfers:?}");
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn the_tokio_shell_reports_the_same() {
    let collector = Collector::default();
    let _guard = tracing::subscriber::set_default(collector.clone());
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(station(NODE));
    let network = lexican_runtime::host::tokio::Network::spawn(bus.link()).unwrap();
    network.read(NODE, DEVICE_TYPE).await.unwrap();
    let frames = collector.lines("TRACE lexican::frames:");
    assert!(frames.contains(&" message=sent frame=605#4000100000000000".to_owned()), "{frames:?}");
    assert!(frames.contains(&" message=received frame=585#4300100092010200".to_owned()), "{frames:?}");
    assert_eq!(collector.lines("INFO lexican::nodes:").len(), 1);
    assert!(collector.lines("DEBUG lexican::nodes:")[0].starts_with(" message=SDO node=5 event=Done"));
}

#[test]
fn a_device_reports_its_frames() {
    let collector = Collector::default();
    let _guard = tracing::subscriber::set_default(collector.clone());
    let bus = VirtualBus::with_bit_rate(500);
    let mut participant = Participant::new(bus.link(), station(NODE));
    let until = participant.now() + Duration::from_millis(1);
    assert!(participant.run(until).unwrap().is_none());
    assert_eq!(collector.lines("TRACE lexican::frames:"), [" message=sent frame=705#00"]);
}
