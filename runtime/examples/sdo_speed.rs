//! How fast SDO transfers are, client and server in one thread: `cargo run --release --example sdo_speed`.

use std::hint::black_box;

use lexican_runtime::object::{Access, Address, DataType, Dictionary, Entry, ObjectDictionary, PdoMapping, Table};
use lexican_runtime::service::sdo_client::{Event, Scalar, SdoClient};
use lexican_runtime::service::sdo_server::SdoServer;
use lexican_runtime::{CobId, Frame, Instant, NodeId};

const NODE: NodeId = NodeId::literal(5);
const LONG: Address = Address::new(0x5FFF, 0);
const LONG_LEN: usize = 1200;
const VALUES: usize = 1000;
const IMAGE: usize = 4 * VALUES + 2 + LONG_LEN;

const fn entry(address: Address, data_type: DataType, offset: usize, capacity: usize) -> Entry {
    let (offset, capacity) = (offset as u32, capacity as u16);
    Entry { address, data_type, access: Access::Rw, mapping: PdoMapping::None, offset, capacity, limit: 0 }
}

const fn entries<const N: usize>() -> [Entry; N] {
    let mut entries = [entry(LONG, DataType::OctetString, 4 * VALUES + 2, LONG_LEN); N];
    let mut i = 0;
    while i + 1 < N {
        entries[i] = entry(Address::new(0x2000 + i as u16, 0), DataType::Unsigned32, 4 * i, 4);
        i += 1;
    }
    entries
}

static FEW: [Entry; 11] = entries();
static MANY: [Entry; VALUES + 1] = entries();
static TEN: Table = table(&FEW);
static THOUSAND: Table = table(&MANY);

const fn table(entries: &'static [Entry]) -> Table {
    Table { entries, limits: &[], image: &[0x5A; IMAGE], node_relative: &[] }
}

fn main() {
    let mut ten = Dictionary::<IMAGE>::new(&TEN, NODE);
    let mut thousand = Dictionary::<IMAGE>::new(&THOUSAND, NODE);
    let long = thousand.entry(LONG).expect("it is in the table");
    thousand.write(&long, 0, &[0x5A; LONG_LEN], true).expect("it has room");
    value("u32 read, 10 objects", 10, &mut ten, false);
    value("u32 read, 1000 objects", VALUES, &mut thousand, false);
    value("u32 write, 1000 objects", VALUES, &mut thousand, true);
    let segments = SdoClient::of_node(NODE);
    let blocks = segments.clone().with_block_writes_from(0);
    bytes("1200 B segmented read", &mut thousand, segments.clone(), |client| client.read(Instant::ZERO, LONG));
    bytes("1200 B segmented write", &mut thousand, segments, |client| {
        client.write(Instant::ZERO, LONG, LONG_LEN as u32)
    });
    bytes("1200 B block read", &mut thousand, blocks.clone(), |client| client.read_block(Instant::ZERO, LONG));
    bytes("1200 B block write", &mut thousand, blocks, |client| client.write(Instant::ZERO, LONG, LONG_LEN as u32));
    foreign(&mut thousand);
}

/// Expedited transfers of all values in turn.
fn value(name: &str, objects: usize, od: &mut dyn ObjectDictionary, writes: bool) {
    let mut client = SdoClient::of_node(NODE);
    let mut server = SdoServer::of_node(NODE);
    let mut i = 0;
    let ns = measure(|| {
        i = (i + 7) % objects;
        let address = Address::new(0x2000 + i as u16, 0);
        let mut value = if writes { Scalar::of(i as u32) } else { Scalar::room_for::<u32>() };
        let begun = if writes { client.write(Instant::ZERO, address, 4) } else { client.read(Instant::ZERO, address) };
        begun.expect("the client is idle");
        let request = client.poll_transmit(Instant::ZERO, &mut value).expect("a request");
        server.handle_frame(Instant::ZERO, &request, od);
        let response = server.poll_transmit(Instant::ZERO, od).expect("a response");
        let event = client.handle_frame(Instant::ZERO, &response, &mut value);
        assert!(matches!(event, Some(Event::Done { .. })));
        black_box(value);
    });
    println!("{name:<26}{ns:>8.1} ns");
}

fn bytes(
    name: &str,
    od: &mut dyn ObjectDictionary,
    mut client: SdoClient,
    begin: impl Fn(&mut SdoClient) -> Result<(), lexican_runtime::service::sdo_client::Busy>,
) {
    let mut server = SdoServer::of_node(NODE);
    let mut buffer = [0x5A; LONG_LEN];
    let ns = measure(|| {
        begin(&mut client).expect("the client is idle");
        let mut ended = None;
        while ended.is_none() {
            while let Some(frame) = client.poll_transmit(Instant::ZERO, &mut buffer) {
                server.handle_frame(Instant::ZERO, &frame, od);
            }
            while let Some(frame) = server.poll_transmit(Instant::ZERO, od) {
                if let Some(event) = client.handle_frame(Instant::ZERO, &frame, &mut buffer) {
                    ended = Some(event);
                }
            }
        }
        assert!(matches!(ended, Some(Event::Done { len: 1200, .. })), "{ended:?}");
    });
    assert_eq!(buffer, [0x5A; LONG_LEN]);
    println!("{name:<26}{ns:>8.1} ns  {:>6.0} MB/s", LONG_LEN as f64 / ns * 1000.0);
}

/// A frame that is not for this server or client.
fn foreign(od: &mut dyn ObjectDictionary) {
    let frame = Frame::from_array(CobId::of_node(0x180, NODE), [0; 8]);
    let mut client = SdoClient::of_node(NODE);
    let mut server = SdoServer::of_node(NODE);
    let ns = measure(|| {
        let frame = black_box(&frame);
        black_box(server.handle_frame(Instant::ZERO, frame, od));
        black_box(client.handle_frame(Instant::ZERO, frame, &mut [0_u8; 0]));
    });
    println!("{:<26}{ns:>8.1} ns", "foreign frame, both sides");
}

/// The best of many short batches, in nanoseconds per run: whatever else the machine does makes the others worse.
fn measure(mut run: impl FnMut()) -> f64 {
    #[expect(clippy::disallowed_methods, reason = "it is the clock that this is about")]
    let mut batch = |runs: u32| {
        let start = std::time::Instant::now();
        (0..runs).for_each(|_| run());
        start.elapsed().as_nanos() as f64 / f64::from(runs)
    };
    let estimate = (0..20).map(|_| batch(20)).fold(f64::MAX, f64::min);
    let runs = (100_000.0 / estimate.max(1.0)).clamp(10.0, 100_000.0) as u32;
    (0..2_000).map(|_| batch(runs)).fold(f64::MAX, f64::min)
}
