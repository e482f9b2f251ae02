//! Axes on a virtual bus, and a path for them.

use std::sync::{Arc, Mutex, MutexGuard};

use lexican_driver::cyclic::{self, AxisSettings, Follower, Path, Report, Settings, Supply, follow};
use lexican_driver::{ByteOrder, CancelHandle, Code, Codes, Description, Mode};
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};

use crate::axis::Axis;

pub(crate) const PERIOD: Duration = Duration::from_millis(1);

/// The largest step of an axis in a cycle.
pub(crate) const MOST: u32 = 40;

pub(crate) static DESCRIPTION: Description = Description {
    codes: Codes {
        faults: &[Code { number: 0x8700, label: "", text: "SYNC" }],
        notices: &[],
        order: ByteOrder::LowFirst,
    },
    ..Description::CIA_402
};

pub(crate) struct Rig {
    pub(crate) bus: VirtualBus,
    pub(crate) link: VirtualLink,
    pub(crate) axes: Vec<Arc<Mutex<Axis>>>,
}

impl Rig {
    /// Axes 1 to `count`, at rest at a thousand times their node-ID.
    pub(crate) fn new(count: u8) -> Self {
        let bus = VirtualBus::new();
        let axes = (1..=count).map(NodeId::literal).map(|node| Arc::new(Mutex::new(Axis::new(node, start(node)))));
        let axes: Vec<_> = axes.collect();
        for axis in &axes {
            bus.attach(Arc::clone(axis));
        }
        Rig { link: bus.link(), bus, axes }
    }

    pub(crate) fn axis(&self, number: usize) -> MutexGuard<'_, Axis> {
        self.axes[number].lock().unwrap()
    }

    pub(crate) fn settings() -> AxisSettings {
        AxisSettings { following_error: 150, ..AxisSettings::new(Mode::CyclicPosition, PERIOD, MOST) }
    }

    pub(crate) fn follower<P: Path>(&self, path: P, settings: Settings) -> Follower<P> {
        let nodes = (1..).map(NodeId::literal).take(self.axes.len());
        let axes = nodes.map(|node| cyclic::Axis::new(node, &DESCRIPTION, Rig::settings(), start(node)));
        Follower::new(axes.collect(), path, settings).unwrap()
    }

    pub(crate) fn follow(&mut self, path: impl Path, settings: Settings) -> Report {
        let mut follower = self.follower(path, settings);
        follow(&mut self.link, &mut follower, &CancelHandle::default()).unwrap()
    }

    /// Checks that all axes are at rest and stay so, and that none was ordered more than it can do.
    #[track_caller]
    pub(crate) fn check_at_rest(&self, what: &str) {
        let positions = || (0..self.axes.len()).map(|number| self.axis(number).position).collect::<Vec<_>>();
        let before = positions();
        self.bus.advance(Duration::from_millis(100));
        assert_eq!(before, positions(), "{what}");
        for number in 0..self.axes.len() {
            let axis = self.axis(number);
            assert_ne!(axis.state, State::OperationEnabled, "{what}: axis {number}");
            assert!(axis.largest_step <= MOST, "{what}: axis {number} has stepped by {}", axis.largest_step);
        }
    }
}

pub(crate) fn start(node: NodeId) -> i32 {
    i32::from(node.get()) * 1000
}

/// A figure of `cycles` cycles for all axes, each in its own phase, from rest to rest. Its largest step is 19.
pub(crate) fn figure(cycles: u64) -> impl FnMut(u64, &mut [i32]) -> Supply {
    move |cycle, set_points| {
        let turn = std::f64::consts::TAU * cycle as f64 / cycles as f64;
        // Begins and ends at rest.
        let phase = turn - turn.sin();
        for (node, set_point) in (1_u8..).zip(set_points) {
            let amplitude = f64::from(node) * 250.0;
            *set_point = start(NodeId::literal(node)) + (amplitude * (1.0 - phase.cos())) as i32;
        }
        if cycle < cycles { Supply::Ready } else { Supply::End }
    }
}
