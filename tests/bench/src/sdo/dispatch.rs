//! A frame that is not for this device: most frames of a bus are not. The device is OPERATIONAL, with four RPDOs
//! and four TPDOs; the frames are PDOs, SDOs, heartbeats and EMCYs of other nodes.

use std::hint::black_box;

use canopen_rs::pdo::{MappingEntry, PdoMapping as PeerMapping};
use lexican_runtime::device::{Behaviour, Device};
use lexican_runtime::object::{Access, DataType, Dictionary, PdoMapping, Row, Table};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Frame, Instant, NodeId};
use zencan_common::messages::{CanId, CanMessage};
use zencan_node::Callbacks;

use super::transfer::ROUNDS;
use super::zencan::generated::pdos;
use crate::measure::{self, Contender};
use crate::report::{self, Goals};

const NODE: u8 = 5;
/// The function codes of what other nodes say.
const FUNCTIONS: [u16; 8] = [0x080, 0x180, 0x200, 0x280, 0x380, 0x580, 0x600, 0x700];
const FRAMES: usize = 64;

pub(super) fn run(goals: &mut Goals) {
    let figures = measure::race(vec![vec![ours(), canopen_rs(), zencan()]], ROUNDS);
    report::head("Dispatch");
    report::rows("frame of another node", 0, &figures);
    if let Some(ours) = report::ours(&figures) {
        goals.at_most("dispatch of a frame of another node", ours.best_ns, 5.0, " ns");
    }
}

/// Identifiers of nodes 6 to 13, all functions in turn.
fn identifiers() -> impl Iterator<Item = u16> {
    (0..FRAMES).map(|at| FUNCTIONS[at % FUNCTIONS.len()] + 6 + (at / FUNCTIONS.len()) as u16)
}

/// Takes the frames in turn, and leaves it open which one is next.
fn in_turn<F: Copy + 'static>(name: &'static str, frames: Vec<F>, mut take: impl FnMut(&F) + 'static) -> Contender {
    let mut at = 0;
    Contender::new(name, move || {
        at = (at + 1) % FRAMES;
        take(black_box(&frames[at]));
    })
    .with_frames(1)
}

fn ours() -> Contender {
    let mut od = dictionary::<{ image_len(1) }>(1, 255);
    let mut device = Device::<4, 4, 1, 4>::new(NodeId::literal(NODE), Behaviour::CIA_301);
    device.restart(Instant::ZERO, &mut od);
    while device.poll_transmit(Instant::ZERO, &mut od).is_some() {}
    device.enter(Instant::ZERO, NmtState::Operational);
    while device.poll_transmit(Instant::ZERO, &mut od).is_some() {}
    assert!((1..=4).all(|number| device.rpdo(number).is_some() && device.tpdo(number).is_some()));
    assert_eq!(device.nmt_state(), NmtState::Operational);
    let frame = |id| Frame::from_array(CobId::standard(id).expect("11 bits"), [1, 2, 3, 4, 5, 6, 7, 8]);
    in_turn(report::OURS, identifiers().map(frame).collect(), move |frame| {
        assert!(black_box(device.handle_frame(black_box(Instant::ZERO), frame, &mut od).is_none()));
    })
}

/// The whole node, without SYNC that can be moved, time, heartbeat consumers, or remote frames.
fn canopen_rs() -> Contender {
    let node = canopen_rs::NodeId::new(NODE).expect("1 to 127");
    let mut od = canopen_rs::ObjectDictionary::<16>::new();
    let address = canopen_rs::Address::new(0x2000, 0);
    od.insert(address, canopen_rs::Entry::rw(canopen_rs::Value::Unsigned32(0))).expect("16 entries");
    let mut node = canopen_rs::node::Node::new(node, od);
    for number in 0..4 {
        let mut mapping = PeerMapping::new();
        mapping.push(MappingEntry::new(0x2000, 0, 32)).expect("eight entries");
        node.add_rpdo(0x200 + 0x100 * number + u16::from(NODE), mapping).expect("four RPDOs");
    }
    node.boot();
    node.on_frame(0, &[1, NODE]);
    in_turn("canopen-rs 0.6.1", identifiers().collect(), move |id| {
        assert!(black_box(node.on_frame(*id, black_box(&[1, 2, 3, 4, 5, 6, 7, 8])).is_none()));
    })
}

/// Only the mailbox: it finds no receiver for the frame, which never reaches the node.
fn zencan() -> Contender {
    let id = zencan_common::NodeId::new(NODE).expect("1 to 127");
    let (mbox, state) = (&pdos::NODE_MBOX, &pdos::NODE_STATE);
    let mut node = zencan_node::Node::new(id, Callbacks::new(), mbox, state, &pdos::OD_TABLE);
    node.process(0);
    mbox.store_message(CanMessage::new(CanId::Std(0), &[1, NODE])).expect("NMT is for every node");
    node.process(1);
    let message = |id| CanMessage::new(CanId::Std(id), &[1, 2, 3, 4, 5, 6, 7, 8]);
    in_turn("zencan 0.0.5", identifiers().map(message).collect(), move |message| {
        assert!(black_box(mbox.store_message(*message).is_err()));
    })
}

/// `objects` numbers from 2000h on, four RPDOs, and four TPDOs of the transmission type `tpdo_type`. All map the first
/// and the last of the objects. `N` is [`image_len`] of them.
pub(crate) fn dictionary<const N: usize>(objects: u16, tpdo_type: u32) -> Dictionary<N> {
    let mut rows: Vec<(u16, u8, DataType, u32)> = Vec::new();
    let mut row = |index, sub, data_type, value| rows.push((index, sub, data_type, value));
    row(0x1001, 0, DataType::Unsigned8, 0);
    row(0x1005, 0, DataType::Unsigned32, 0x80);
    row(0x1017, 0, DataType::Unsigned16, 1000);
    for (parameter, mapping, cob_id, transmission) in [(0x1400, 0x1600, 0x200, 255), (0x1800, 0x1A00, 0x180, tpdo_type)]
    {
        for pdo in 0..4 {
            row(parameter + pdo, 0, DataType::Unsigned8, 2);
            row(parameter + pdo, 1, DataType::Unsigned32, cob_id + 0x100 * u32::from(pdo) + u32::from(NODE));
            row(parameter + pdo, 2, DataType::Unsigned8, transmission);
            row(mapping + pdo, 0, DataType::Unsigned8, 2);
            row(mapping + pdo, 1, DataType::Unsigned32, 0x2000_0020);
            row(mapping + pdo, 2, DataType::Unsigned32, 0x2000_0020 + (u32::from(objects - 1) << 16));
        }
    }
    (0..objects).for_each(|object| row(0x2000 + object, 0, DataType::Unsigned32, 0));
    rows.sort_by_key(|(index, sub, ..)| (*index, *sub));
    let (mut entries, mut image) = (Vec::new(), Vec::new());
    for (index, sub, data_type, value) in rows {
        let size = data_type.size().expect("a number");
        let row = Row::new(index, sub, data_type, Access::Rw, PdoMapping::Both);
        entries.push(row.at(image.len() as u32, size as u16));
        image.extend_from_slice(&value.to_le_bytes()[..size]);
    }
    let table = Table { rows: entries.leak(), limits: &[], image: image.leak() };
    Dictionary::new(Box::leak(Box::new(table)), NodeId::literal(NODE))
}

/// 1001h, 1005h, 1017h, eight times parameters and mapping, and the objects.
pub(crate) const fn image_len(objects: u16) -> usize {
    1 + 4 + 2 + 8 * (1 + 4 + 1 + 1 + 4 + 4) + 4 * objects as usize
}
