//! Our devices: one or several in one process, with nothing but the objects that each must have.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::host::{BusUrl, Node, Participant};
use lexican_runtime::object::{Access, DataType, Dictionary, Entry, PdoMapping, Table};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::Outcome;

/// 1000h, 1001h and 1017h.
static TABLE: Table = Table {
    entries: &[
        Entry::new(0x1000, 0, DataType::Unsigned32, Access::Ro, PdoMapping::None).at(0, 4),
        Entry::new(0x1001, 0, DataType::Unsigned8, Access::Ro, PdoMapping::Tpdo).at(4, 1),
        Entry::new(0x1017, 0, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(5, 2),
    ],
    limits: &[],
    image: &[0x92, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00],
    node_relative: &[],
};

/// Serves `count` nodes from `first` on until standard input ends; prints a line when they are there.
pub(super) fn run(url: &str, first: &str, count: &str) -> Outcome<()> {
    let link = url.parse::<BusUrl>()?.open()?;
    let (first, count) = (first.parse::<u8>()?, count.parse::<u8>()?);
    let nodes: Result<Vec<NodeId>, _> = (first..first + count).map(NodeId::try_from).collect();
    let stations = Stations(nodes?.into_iter().map(Station::new).collect());
    let mut participant = Participant::new(link, stations);
    let ended = end_of_input();
    println!("ready");
    while !ended.load(Ordering::Relaxed) {
        let look = participant.now() + Duration::from_millis(100);
        participant.run(look)?;
    }
    Ok(())
}

fn end_of_input() -> Arc<AtomicBool> {
    let ended = Arc::new(AtomicBool::new(false));
    let tell = Arc::clone(&ended);
    std::thread::spawn(move || {
        // Whatever comes, or an error: the end is what counts.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        tell.store(true, Ordering::Relaxed);
    });
    ended
}

struct Station(Device, Dictionary<7>);

impl Station {
    fn new(node: NodeId) -> Self {
        let mut station = Station(Device::new(node, Behaviour::CIA_301), Dictionary::new(&TABLE, node));
        station.0.restart(Instant::ZERO, &mut station.1);
        station
    }
}

struct Stations(Vec<Station>);

impl Node for Stations {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        for Station(device, od) in &mut self.0 {
            device.handle_frame(now, frame, od);
        }
    }
    fn handle_timeout(&mut self, now: Instant) {
        for Station(device, od) in &mut self.0 {
            device.handle_timeout(now, od);
        }
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.0.iter_mut().find_map(|Station(device, od)| device.poll_transmit(now, od))
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.0.iter().filter_map(|Station(device, _)| device.poll_timeout()).min()
    }
    fn concerns(&self) -> Vec<CobId> {
        self.0.iter().flat_map(|Station(device, _)| device.cob_ids()).collect()
    }
    fn generation(&self) -> u32 {
        self.0.iter().fold(0, |sum, Station(device, _)| sum.wrapping_add(device.generation()))
    }
}
