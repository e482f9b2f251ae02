//! What a cycle of a path costs: the follower, the pump and the virtual bus, with axes that only echo.
//!
//! `cargo bench -p lexican-driver --bench cycle` prints microseconds of processor time per cycle. Bus and axes are part of
//! it, so that it is more than a program on a real bus has to spend, but for the system calls.

use lexican_driver::cyclic::{Axis, AxisSettings, Follower, Settings, Supply, follow};
use lexican_driver::{CancelHandle, Description, Mode};
use lexican_runtime::host::{Node, VirtualBus};
use lexican_runtime::profile::cia402::{Command, State, Transitions};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

const CYCLES: u64 = 20_000;

/// An axis that is where it was sent, one SYNC later.
struct Echo {
    node: NodeId,
    state: State,
    received: [u8; 6],
    due: bool,
}

impl Node for Echo {
    fn handle_frame(&mut self, _: Instant, frame: &Frame) {
        if frame.id() == CobId::SYNC {
            self.due = true;
        } else if frame.id() == CobId::of_node(0x300, self.node) {
            self.received.copy_from_slice(frame.data());
        }
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        if !std::mem::take(&mut self.due) {
            return None;
        }
        let [low, high, a, b, c, d] = self.received;
        let command = Command::parse(0, u16::from_le_bytes([low, high]));
        self.state = Transitions::CIA_402.follow(self.state, command).map_or(self.state, |arrow| arrow.to);
        let [low, high] = (self.state.status_bits() | 1 << 12).to_le_bytes();
        Some(Frame::from_array(CobId::of_node(0x380, self.node), [low, high, a, b, c, d]))
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

#[expect(clippy::disallowed_methods, reason = "it measures")]
fn main() {
    let settings = AxisSettings::new(Mode::CyclicPosition, Duration::from_millis(1), 100);
    for count in [1, 6, 32] {
        let bus = VirtualBus::new();
        let nodes: Vec<NodeId> = (1..=count).map(NodeId::literal).collect();
        for &node in &nodes {
            bus.attach(Echo { node, state: State::SwitchOnDisabled, received: [0; 6], due: false });
        }
        let axes = nodes.iter().map(|&node| Axis::new(node, &Description::CIA_402, settings, 0)).collect();
        let path = |cycle: u64, set_points: &mut [i32]| {
            set_points.fill((cycle % 1000).min(1000 - cycle % 1000) as i32);
            if cycle < CYCLES { Supply::Ready } else { Supply::End }
        };
        let mut follower = Follower::new(axes, path, Settings::default()).expect("the axes go together");
        let began = std::time::Instant::now();
        let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).expect("the bus stays");
        let us = began.elapsed().as_secs_f64() * 1e6 / CYCLES as f64;
        assert_eq!(report.reason, None, "{report}");
        println!("{count:2} axes: {us:6.1} us per cycle, {:4.2} us per frame", us / f64::from(2 * count + 1));
    }
}
