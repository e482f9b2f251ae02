//! Simulated servos of CiA 402 with a made-up data sheet: freely mappable PDOs, and all objects of the cyclic modes.

use std::sync::{Arc, Mutex};

use lexican_driver::cyclic::{self, AxisSettings};
use lexican_driver::description::{Homing, Identity, Outputs};
use lexican_driver::{Description, Drive, Kind};
use lexican_runtime::host::{Node, VirtualBus};
use lexican_runtime::object::{Access, DataType, Dictionary, PdoMapping, Row, Table};
use lexican_runtime::{Duration, Frame, Instant, NodeId};
use simulator::servo::{Machine, Scales, ServoModel};
use simulator::{SimulatedServo, Storage};

use DataType::{
    Integer8 as I8, Integer16 as I16, Integer32 as I32, Unsigned8 as U8, Unsigned16 as U16, Unsigned32 as U32,
};

pub(crate) enum Servo {}

impl Kind for Servo {
    const DESCRIPTION: &'static Description = &Description {
        name: "servo",
        identity: Identity { vendor_ids: &[0x99], ..Description::CIA_402.identity },
        outputs: Outputs::BY_SDO,
        inputs: &[],
        homing: Some(Homing::CIA_402),
        ..Description::CIA_402
    };
}

static MODEL: ServoModel = ServoModel {
    storage,
    // The shaft stands as soon as it has no torque: any later movement was ordered.
    coasting: 1e9,
    absolute_encoder: true,
    scales: |_| Scales { velocity: 1.0, acceleration: 1.0 },
    ..ServoModel::CIA_402
};

/// The switches for homing: a limit switch, a home switch and index pulses, all less than a second away.
pub(crate) const MACHINE: Machine = Machine {
    negative_limit: Some(-100.0),
    positive_limit: None,
    home_switch: Some((150.0, 250.0)),
    index: Some((50.0, 100.0)),
};

/// Index, sub-index, type, default.
const OBJECTS: &[(u16, u8, DataType, i64)] = &[
    (0x1000, 0, U32, 0x2_0192),
    (0x1001, 0, U8, 0),
    (0x1005, 0, U32, 0x80),
    (0x1006, 0, U32, 0),
    (0x1017, 0, U16, 0),
    (0x1018, 0, U8, 1),
    (0x1018, 1, U32, 0x99),
    (0x6040, 0, U16, 0),
    (0x6041, 0, U16, 0),
    (0x605A, 0, I16, 2),
    (0x605E, 0, I16, 2),
    (0x6060, 0, I8, 1),
    (0x6061, 0, I8, 0),
    (0x6064, 0, I32, 0),
    (0x6065, 0, U32, 200),
    (0x6066, 0, U16, 10),
    (0x6067, 0, U32, 2),
    (0x606C, 0, I32, 0),
    (0x607A, 0, I32, 0),
    (0x607C, 0, I32, 0),
    (0x607D, 1, I32, 0),
    (0x607D, 2, I32, 0),
    (0x6081, 0, U32, 5000),
    (0x6083, 0, U32, 100_000),
    (0x6084, 0, U32, 100_000),
    (0x6085, 0, U32, 1_000_000),
    (0x6098, 0, I8, 0),
    (0x6099, 1, U32, 2000),
    (0x6099, 2, U32, 500),
    (0x609A, 0, U32, 100_000),
    (0x60C1, 1, I32, 0),
    (0x60C2, 1, U8, 2),
    (0x60C2, 2, I8, -3),
    (0x60FD, 0, U32, 0),
    (0x60FF, 0, I32, 0),
];

fn storage(node: NodeId) -> Box<dyn Storage> {
    let mut rows = OBJECTS.to_vec();
    for pdo in 0..4 {
        let base = i64::from(0x100 * pdo) + i64::from(node.get());
        for (parameter, first) in [(0x1400, 0x200), (0x1800, 0x180)] {
            // Switched off.
            let cob_id = 0x8000_0000 | (first + base);
            rows.extend([
                (parameter + pdo, 0, U8, 2),
                (parameter + pdo, 1, U32, cob_id),
                (parameter + pdo, 2, U8, 255),
            ]);
        }
        for mapping in [0x1600, 0x1A00] {
            rows.extend([(mapping + pdo, 0, U8, 0), (mapping + pdo, 1, U32, 0), (mapping + pdo, 2, U32, 0)]);
        }
    }
    rows.sort_by_key(|row| (row.0, row.1));
    let (mut entries, mut image) = (Vec::new(), Vec::new());
    for (index, sub, data_type, default) in rows {
        let size = data_type.size().expect("a number");
        let offset = u32::try_from(image.len()).expect("a small dictionary");
        let row = Row::new(index, sub, data_type, Access::Rw, PdoMapping::Both);
        entries.push(row.at(offset, size as u16));
        image.extend(&default.to_le_bytes()[..size]);
    }
    image.resize(512, 0);
    let table = Table { rows: entries.leak(), limits: &[], image: image.leak() };
    Box::new(Dictionary::<512>::new(Box::leak(Box::new(table)), node))
}

/// A servo whose power fails after a number of frames, and comes back later.
pub(crate) struct Supplied {
    pub(crate) servo: SimulatedServo,
    /// The number of frames until the power fails; `None` if it does not.
    pub(crate) left: Option<u64>,
    /// For how long the power is off.
    pub(crate) off: Duration,
    back: Option<Instant>,
    /// The position of the shaft when the power failed.
    pub(crate) cut_at: Option<f64>,
}

impl Supplied {
    pub(crate) fn new(node: NodeId) -> Self {
        let servo = SimulatedServo::new(Instant::ZERO, &MODEL, node);
        Supplied { servo, left: None, off: Duration::from_millis(300), back: None, cut_at: None }
    }

    /// The true position of the shaft.
    pub(crate) fn shaft(&self, now: Instant) -> f64 {
        self.servo.servo().shaft(now).position
    }

    fn count(&mut self, now: Instant) {
        self.left = match self.left {
            Some(0) => {
                self.servo.set_power(now, false);
                self.back = Some(now + self.off);
                self.cut_at = Some(self.shaft(now));
                None
            }
            left => left.map(|left| left - 1),
        };
    }
}

impl Node for Supplied {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.count(now);
        self.servo.handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        if self.back.take_if(|back| *back <= now).is_some() {
            self.servo.set_power(now, true);
        }
        if self.servo.poll_timeout().is_some_and(|due| due <= now) {
            self.servo.handle_timeout(now);
        }
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let frame = self.servo.poll_transmit(now)?;
        self.count(now);
        Some(frame)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.back.into_iter().chain(self.servo.poll_timeout()).min()
    }
}

/// A bus with servos at nodes 1 to `count`.
pub(crate) fn bus(count: u8) -> (VirtualBus, Vec<Arc<Mutex<Supplied>>>) {
    let bus = VirtualBus::new();
    let servos = (1..=count).map(NodeId::literal).map(|node| Arc::new(Mutex::new(Supplied::new(node))));
    let servos: Vec<_> = servos.collect();
    for servo in &servos {
        bus.attach(Arc::clone(servo));
    }
    (bus, servos)
}

/// The servos, set up as axes.
pub(crate) fn axes(bus: &VirtualBus, count: u8, settings: AxisSettings) -> Vec<cyclic::Axis> {
    let mut link = bus.link();
    let prepare = |node| Drive::<_, Servo>::connect_unprotected(&mut link, node)?.prepare_cyclic(settings);
    (1..=count).map(NodeId::literal).map(prepare).collect::<Result<_, _>>().expect("the servos can be set up")
}
