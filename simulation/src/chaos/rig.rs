//! The devices of a trial, the wire to them, and what is observed of both.

use std::collections::{BTreeMap, VecDeque};

use lexican_runtime::host::Node;
use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::bus::transfers::Transfers;
use lexican_toolbox::decode::Decoder;

use super::plan::Moment;
use crate::{Plant, PlantError, Power, Segment, SimulatedDevice};

/// The time within which a drive of an unknown model has to stand: a second to notice, and a second to brake.
const OTHERS_STAND_WITHIN: Duration = Duration::from_millis(2000);

/// The velocity of an axis is averaged over this time. If the computer that sends set-points by SYNC is busy, an axis
/// that follows them is too fast at one moment and too slow at the next.
pub(super) const WINDOW: Duration = Duration::from_millis(100);

/// The number of frames kept of a trial: the last ones.
const FRAMES: usize = 4096;

/// A frame of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// When it was on the bus.
    pub at: Instant,
    /// The frame.
    pub frame: Frame,
    /// Whether the program sent it, not a device.
    pub sent: bool,
}

/// What has been observed of an axis.
#[derive(Clone, Debug, Default)]
pub(super) struct Axis {
    /// Its name in findings.
    pub(super) who: String,
    /// The time within which it has to stand once nothing commands it.
    pub(super) limit: Duration,
    /// Position of the shaft, in units of the simulator; the velocity is in these units per second.
    pub(super) position: f64,
    pub(super) velocity: f64,
    /// The highest velocity since [`Axis::forget`], averaged over [`WINDOW`].
    pub(super) peak: f64,
    /// The positions within the window, and the last one before it.
    recent: VecDeque<(Instant, f64)>,
    /// Whether it was within its limits at the start.
    is_inside: bool,
    /// The first position outside of the limits (607Dh), with the lower and the upper limit.
    pub(super) outside: Option<(i64, i64, i64)>,
}

impl Axis {
    /// Records position and velocity.
    fn note(&mut self, now: Instant, position: f64, velocity: f64) {
        (self.position, self.velocity) = (position, velocity);
        self.recent.push_back((now, position));
        while self.recent.get(1).is_some_and(|(at, _)| now.since(*at) >= WINDOW) {
            self.recent.pop_front();
        }
        if let Some((at, from)) = self.recent.front()
            && now.since(*at) >= WINDOW
        {
            self.peak = self.peak.max((position - from).abs() / now.since(*at).as_secs_f64());
        }
    }

    /// Resets the peak velocity.
    pub(super) fn forget(&mut self) {
        self.peak = 0.0;
        self.recent.clear();
    }
}

/// The devices of a plant with the wire to them.
pub(super) struct Rig<'a> {
    segment: Segment<SimulatedDevice>,
    /// By the index of the device in the plant.
    pub(super) axes: BTreeMap<usize, Axis>,
    servers: Vec<NodeId>,
    decoder: Decoder<'a>,
    pub(super) transfers: Transfers,
    pub(super) record: VecDeque<Record>,
    /// The moment that is waited for; `None` once it has come.
    trigger: Option<Moment>,
    /// Whether the moment has come: frames are held until the disturbance has happened.
    pub(super) is_due: bool,
    held: VecDeque<Frame>,
    pub(super) is_cut: bool,
    frames: u32,
    requests: u32,
    set_off: Option<Instant>,
}

impl<'a> Rig<'a> {
    pub(super) fn new(
        now: Instant,
        plant: &'a Plant,
        others: Option<Duration>,
        trigger: Option<Moment>,
    ) -> Result<Self, PlantError> {
        let segment = plant.segment(now)?;
        let mut decoder = Decoder::new();
        let mut axes = BTreeMap::new();
        for (at, (device, simulated)) in plant.devices.iter().zip(segment.nodes()).enumerate() {
            if let Some(node) = device.node {
                decoder.introduce(node, &device.sheet.device);
            }
            if let Some(shaft) = simulated.shaft(now) {
                let known = device.sheet.library.and_then(lexican_registry::find);
                let usual = known.map_or(OTHERS_STAND_WITHIN, |drive| drive.stands_within);
                let limit = others.unwrap_or(usual);
                let who = match (&device.name, device.node) {
                    (Some(name), _) => name.clone(),
                    (None, Some(node)) => format!("node {node}"),
                    (None, None) => device.device.clone(),
                };
                axes.insert(at, Axis { who, limit, position: shaft.position, ..Axis::default() });
            }
        }
        let servers = plant.devices.iter().filter_map(|device| device.node).collect();
        let mut rig = Rig {
            segment,
            axes,
            servers,
            decoder,
            transfers: Transfers::default(),
            record: VecDeque::new(),
            trigger,
            is_due: false,
            held: VecDeque::new(),
            is_cut: false,
            frames: 0,
            requests: 0,
            set_off: None,
        };
        rig.look(now);
        rig.axes.values_mut().for_each(|axis| axis.is_inside = axis.outside.take().is_none());
        Ok(rig)
    }

    /// Observes the axes: positions, limits, and whether one has set off.
    pub(super) fn look(&mut self, now: Instant) {
        for (at, device) in self.segment.nodes_mut().enumerate() {
            let Some(axis) = self.axes.get_mut(&at) else { continue };
            if let Some(shaft) = device.shaft(now) {
                axis.note(now, shaft.position, shaft.velocity);
            }
            let mut number = |index, sub| number(device, now, index, sub);
            if let (Some(low), Some(high), Some(at)) = (number(0x607D, 1), number(0x607D, 2), number(0x6064, 0))
                && low < high
                && !(low..=high).contains(&at)
            {
                axis.outside.get_or_insert((at, low, high));
            }
        }
        if self.axes.values().any(|axis| axis.velocity != 0.0) {
            self.set_off.get_or_insert(now);
        }
        if let (Some(Moment::Moving(after)), Some(begun)) = (self.trigger, self.set_off)
            && now.since(begun) >= after
        {
            (self.trigger, self.is_due) = (None, true);
        }
    }

    /// Lets frames pass again, after the disturbance.
    pub(super) fn go_on(&mut self, now: Instant) {
        self.is_due = false;
        for frame in std::mem::take(&mut self.held) {
            self.handle_frame(now, &frame);
        }
    }

    /// Whether an axis has set off.
    pub(super) fn has_moved(&self) -> bool {
        self.set_off.is_some()
    }

    /// The axes that left the limits within which they began: position, lower and upper limit.
    pub(super) fn outside(&self) -> impl Iterator<Item = (&Axis, (i64, i64, i64))> {
        self.axes.values().filter(|axis| axis.is_inside).filter_map(|axis| Some((axis, axis.outside?)))
    }

    pub(super) fn set_supply(&mut self, now: Instant, power: Power) {
        self.segment.nodes_mut().for_each(|device| device.set_power(now, power));
    }

    /// The values of all entries that can be both written and read.
    pub(super) fn objects(&mut self, now: Instant) -> BTreeMap<(usize, Address), Vec<u8>> {
        let mut objects = BTreeMap::new();
        for (at, device) in self.segment.nodes_mut().enumerate() {
            let sheet = device.sheet().clone();
            for entry in sheet.entries().filter(|entry| entry.access.writable() && entry.access.readable()) {
                let address = Address::new(entry.index, entry.sub);
                // The error history and the time change by themselves.
                if ![0x1003, 0x1012, 0x1013].contains(&entry.index)
                    && let Ok(value) = device.value(now, address)
                {
                    objects.insert((at, address), value);
                }
            }
        }
        objects
    }

    /// Whether the mode of an axis (6061h) is one of positions, so that it ends where it was told to.
    pub(super) fn is_positioning(&mut self, now: Instant, at: usize) -> bool {
        let device = self.segment.nodes_mut().nth(at);
        device.and_then(|device| number(device, now, 0x6061, 0)).is_some_and(|mode| [1, 7, 8].contains(&mode))
    }

    fn note(&mut self, at: Instant, frame: Frame, sent: bool) {
        if self.record.len() == FRAMES {
            self.record.pop_front();
        }
        self.record.push_back(Record { at, frame, sent });
        let is_sdo = |node: &NodeId| [0x580, 0x600].iter().any(|base| frame.id() == CobId::of_node(*base, *node));
        if self.servers.iter().any(is_sdo) {
            self.transfers.observe(at, &self.decoder.decode(&frame));
        }
    }

    fn count(&mut self, frame: &Frame) {
        self.frames += 1;
        if self.servers.iter().any(|node| frame.id() == CobId::of_node(0x600, *node)) {
            self.requests += 1;
        }
        self.is_due = match self.trigger {
            Some(Moment::Frame(number)) => self.frames >= number,
            Some(Moment::Request(number)) => self.requests >= number,
            Some(Moment::Moving(_)) | None => false,
        };
        if self.is_due {
            self.trigger = None;
        }
    }
}

/// The value of an integer entry of 1, 2 or 4 bytes.
fn number(device: &mut SimulatedDevice, now: Instant, index: u16, sub: u8) -> Option<i64> {
    let bytes = device.value(now, Address::new(index, sub)).ok()?;
    Some(match *bytes.as_slice() {
        [a] => i64::from(a as i8),
        [a, b] => i64::from(i16::from_le_bytes([a, b])),
        [a, b, c, d] => i64::from(i32::from_le_bytes([a, b, c, d])),
        _ => return None,
    })
}

impl Node for Rig<'_> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.is_cut {
            return;
        }
        if self.is_due {
            self.held.push_back(*frame);
            return;
        }
        self.note(now, *frame, true);
        self.segment.handle_frame(now, frame);
        self.count(frame);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.segment.handle_timeout(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        loop {
            if self.is_due {
                return None;
            }
            let frame = self.segment.poll_transmit(now)?;
            if !self.is_cut {
                self.note(now, frame, false);
                return Some(frame);
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.segment.poll_timeout()
    }
}
