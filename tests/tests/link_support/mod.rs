//! Devices behind real links, and a test of a tokio shell with eight of them.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;

use lexican_runtime::host::tokio::Network;
use lexican_runtime::host::{AccessError, Link, Node, Participant, Station};
use lexican_runtime::manager::Remote;
use lexican_runtime::object::{Access, Address, DataType, Dictionary, Object, PdoMapping, Ro, Row, Rw, Table};
use lexican_runtime::service::sdo_client::{SdoClient, SdoError};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

pub(crate) const DEVICE_TYPE: Object<u32, Ro> = Object::new(0x1000, 0);
pub(crate) const SETPOINT: Object<u32, Rw> = Object::new(0x2000, 0);
/// The RPDO's COB-ID (1400h:01).
pub(crate) const RPDO_COB_ID: Address = Address::new(0x1400, 1);

const fn row(index: u16, sub: u8, data_type: DataType, access: Access) -> Row {
    Row::new(index, sub, data_type, access, PdoMapping::None)
}

static TABLE: Table = Table {
    rows: &[
        row(0x1000, 0, DataType::Unsigned32, Access::Ro).at(0, 4),
        row(0x1001, 0, DataType::Unsigned8, Access::Ro).at(4, 1),
        row(0x1017, 0, DataType::Unsigned16, Access::Rw).at(5, 2),
        row(0x1400, 0, DataType::Unsigned8, Access::Const).at(7, 1),
        row(0x1400, 1, DataType::Unsigned32, Access::Rw).at(8, 4).plus_node(),
        row(0x1400, 2, DataType::Unsigned8, Access::Rw).at(12, 1),
        row(0x1600, 0, DataType::Unsigned8, Access::Rw).at(13, 1),
        row(0x1600, 1, DataType::Unsigned32, Access::Rw).at(14, 4),
        Row::new(0x2000, 0, DataType::Unsigned32, Access::Rw, PdoMapping::Both).at(18, 4),
    ],
    limits: &[],
    // 1400h: 80000200h plus the node-ID, a PDO that is off; 1600h maps 2000h.
    image: &[0x92, 1, 2, 0, 0, 0, 0, 2, 0, 2, 0, 0x80, 255, 1, 0x20, 0, 0, 0x20, 0, 0, 0, 0],
};

/// Some devices with an RPDO that count the frames they receive.
struct Stations {
    all: Vec<Station<22>>,
    heard: Arc<AtomicUsize>,
}

impl Stations {
    fn new(now: Instant, nodes: &[NodeId], heard: Arc<AtomicUsize>) -> Self {
        let station = |node: &NodeId| Station::new(now, *node, Dictionary::new(&TABLE, *node));
        Stations { all: nodes.iter().map(station).collect(), heard }
    }
}

impl Node for Stations {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.heard.fetch_add(1, Ordering::Relaxed);
        self.all.handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.all.handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.all.poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.all.poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        self.all.concerns()
    }
    fn generation(&self) -> u32 {
        self.all.generation()
    }
}

/// Devices in a thread, until this is dropped.
pub(crate) struct Serving {
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    heard: Arc<AtomicUsize>,
}

impl Serving {
    /// Switches on devices behind a link.
    pub(crate) fn nodes(nodes: &[NodeId], link: impl Link + Send + 'static) -> Self {
        let (ended, heard) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let stations = Stations::new(link.now(), nodes, Arc::clone(&heard));
        let end = Arc::clone(&ended);
        let thread = std::thread::spawn(move || {
            let mut participant = Participant::new(link, stations);
            while !end.load(Ordering::Relaxed) {
                let look = participant.now() + Duration::from_millis(20);
                // In some tests the bus is down, or refuses frames.
                participant.run(look).expect("the link outlives its bus");
            }
        });
        Serving { ended, thread: Some(thread), heard }
    }

    /// The number of frames that the devices have received.
    pub(crate) fn heard(&self) -> usize {
        self.heard.load(Ordering::Relaxed)
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        let outcome = self.thread.take().map(JoinHandle::join);
        if !std::thread::panicking() {
            outcome.expect("it is joined once").expect("the devices serve to the end");
        }
    }
}

/// Runs a test of the tokio shell.
pub(crate) fn run<T>(test: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(test)
}

/// Eight nodes on one shell; node 8 is silent. The others get every answer while the shell waits for it.
pub(crate) fn a_silent_node_holds_up_nobody(devices: impl Link + Send + 'static, link: impl Link + Send + 'static) {
    const READS: usize = 200;
    let nodes: Vec<NodeId> = NodeId::all().take(8).collect();
    let (silent, alive) = nodes.split_last().unwrap();
    let _serving = Serving::nodes(alive, devices);
    run(async {
        let network = Network::spawn(link).unwrap();
        let silent = *silent;
        // It waits in vain, and far longer than the others could wait with it.
        let patient = SdoClient::of_node(silent).with_timeout(Duration::from_secs(600));
        network
            .with_manager(move |manager, now| manager.add(now, Remote::new(silent).with_sdo(patient)).unwrap())
            .await
            .unwrap();
        let waiting = tokio::spawn({
            let network = network.clone();
            async move { network.read(silent, DEVICE_TYPE).await }
        });
        let readers: Vec<_> = alive
            .iter()
            .map(|&node| {
                let network = network.clone();
                tokio::spawn(async move {
                    for _ in 0..READS {
                        assert_eq!(network.read(node, DEVICE_TYPE).await.unwrap(), 0x0002_0192);
                    }
                })
            })
            .collect();
        for reader in readers {
            reader.await.unwrap();
        }
        assert!(!waiting.is_finished(), "the silent node is still waited for");
        waiting.abort();
        // The transfer of the dropped call is still in progress; another SDO client starts a new one.
        let hasty = SdoClient::of_node(silent).with_timeout(Duration::from_millis(20));
        network
            .with_manager(move |manager, now| manager.add(now, Remote::new(silent).with_sdo(hasty)).unwrap())
            .await
            .unwrap();
        let error = network.read(silent, DEVICE_TYPE).await.unwrap_err();
        assert!(matches!(error, AccessError::Sdo { error: SdoError::TimedOut { .. }, .. }), "{error}");
    });
}

/// The processor time of this thread, in ticks of 10 ms.
pub(crate) fn processor_ticks() -> u64 {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
    let fields = stat.rsplit(')').next().unwrap().split_ascii_whitespace();
    fields.skip(11).take(2).map(|ticks| ticks.parse::<u64>().unwrap()).sum()
}
