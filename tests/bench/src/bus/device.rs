//! Our devices: one or several in one process, with nothing but the objects that each must have.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_runtime::host::{BusUrl, Link, Participant, Station};
use lexican_runtime::object::{Access, DataType, Dictionary, PdoMapping, Row, Table};
use lexican_runtime::{Duration, NodeId};

use super::player::Outcome;

/// 1000h, 1001h and 1017h.
static TABLE: Table = Table {
    rows: &[
        Row::new(0x1000, 0, DataType::Unsigned32, Access::Ro, PdoMapping::None).at(0, 4),
        Row::new(0x1001, 0, DataType::Unsigned8, Access::Ro, PdoMapping::Tpdo).at(4, 1),
        Row::new(0x1017, 0, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(5, 2),
    ],
    limits: &[],
    image: &[0x92, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00],
};

/// Serves `count` nodes from `first` on until standard input ends; prints a line when they are there.
pub(super) fn run(url: &str, first: &str, count: &str) -> Outcome<()> {
    let link = url.parse::<BusUrl>()?.open()?;
    let (first, count) = (first.parse::<u8>()?, count.parse::<u8>()?);
    let nodes: Result<Vec<NodeId>, _> = (first..first + count).map(NodeId::try_from).collect();
    let station = |node| Station::new(link.now(), node, Dictionary::new(&TABLE, node));
    let stations: Vec<Station<7>> = nodes?.into_iter().map(station).collect();
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
    let at_end = Arc::clone(&ended);
    std::thread::spawn(move || {
        // Input is ignored; its end, or an error, ends the device.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        at_end.store(true, Ordering::Relaxed);
    });
    ended
}
