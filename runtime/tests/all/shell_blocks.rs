//! Every shell transfers long objects by block, where that is quicker.
#![cfg(feature = "tokio")]

use crate::common::NODE;
use crate::rig::{Recorder, TEXT};
use crate::shell_support::observed;
use lexican_runtime::host::{VirtualBus, blocking, tokio as shell};
use lexican_runtime::manager::Remote;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoClient;
use lexican_runtime::{Duration, Instant};

/// The time to read and to write an object of `len` bytes at 125 kbit/s, and the number of frames for each.
fn measure(len: usize, remote: Remote) -> [(Duration, usize); 2] {
    let bus = VirtualBus::with_bit_rate(125);
    let frames = observed(&bus);
    let counted = || std::mem::take(&mut *frames.lock().unwrap()).len();
    bus.attach(Recorder::named(NODE, len));
    let mut network = blocking::Network::new(bus.link());
    let now = network.now();
    network.manager().add(now, remote).unwrap();
    network.read_bytes(NODE, Address::new(0x1000, 0)).unwrap();
    let mut began = bus.now();
    counted();
    assert_eq!(network.read_bytes(NODE, TEXT).unwrap(), vec![b'n'; len]);
    let read = (bus.now().since(began), counted());
    began = bus.now();
    network.write_bytes(NODE, TEXT, &vec![b'x'; len]).unwrap();
    let written = (bus.now().since(began), counted());
    assert_eq!(network.read_bytes(NODE, TEXT).unwrap(), vec![b'x'; len]);
    [read, written]
}

#[test]
fn long_objects_take_half_the_time_and_short_ones_none_more() {
    let in_segments = Remote::new(NODE).with_sdo(SdoClient::of_node(NODE));
    for len in [1, 4, 5, 20, 63, 64, 65, 100, 1000, 65_000] {
        let (segments, blocks) = (measure(len, in_segments.clone()), measure(len, Remote::new(NODE)));
        for (segments, blocks) in segments.into_iter().zip(blocks) {
            println!("{len} bytes: {} in {} frames, {} in {}", segments.0, segments.1, blocks.0, blocks.1);
            assert_eq!(segments == blocks, len < 64, "{len} bytes");
            assert!(blocks.0 <= segments.0, "{len} bytes");
            assert!(len < 1000 || blocks.1 * 100 < segments.1 * 60, "{len} bytes");
        }
    }
}

#[tokio::test]
async fn the_tokio_shell_transfers_by_block() {
    let bus = VirtualBus::with_bit_rate(125);
    bus.attach(Recorder::named(NODE, 65_000));
    let network = shell::Network::spawn(bus.link()).unwrap();
    assert_eq!(network.read_bytes(NODE, TEXT).await.unwrap(), vec![b'n'; 65_000]);
    network.write_bytes(NODE, TEXT, &vec![b'x'; 65_000]).await.unwrap();
    // In segments, each transfer would take 16.5 s.
    assert!(bus.now() < Instant::ZERO + Duration::from_secs(18), "{}", bus.now());
}
