//! The manual's two worked examples, tables 25 and 26, as data: node 5, frame by frame.
//!
//! The tables say what to send, and twice to wait for a target. They do not say how long to travel before the
//! intermediate stop, and send the next command without waiting for +30 rev/min or for standstill. A replay has to show
//! that these things happen, so it has additional rows that wait, whose [`Row::in_table`] is false. The frames are
//! exactly those of the manual, in its order.

use lexican_runtime::{CobId, Duration, Frame, NodeId};

/// The node of the examples.
pub const NODE: NodeId = NodeId::literal(5);

/// A worked example of the manual.
#[derive(Debug)]
pub struct Example {
    /// The number of its table.
    pub table: u8,
    /// What it shows.
    pub title: &'static str,
    /// 6060h, which must be set in advance: 1 positioning, 2 velocity.
    pub operating_mode: u8,
    /// The rows, in order.
    pub rows: &'static [Row],
}

/// A row of an example.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// What to do.
    pub action: Action,
    /// What it means.
    pub meaning: &'static str,
    /// Whether the manual's table has this row.
    pub in_table: bool,
}

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Send this frame.
    Send(Frame),
    /// Wait for this.
    Wait(Until),
}

/// What to wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// The drive rests at this position and reports the target as reached.
    Position(i32),
    /// The drive runs at this many revolutions per minute and reports the target as reached.
    Velocity(i32),
    /// The drive stands still.
    Standstill,
    /// Time has passed.
    Elapsed(Duration),
}

impl Row {
    const fn send<const N: usize>(id: u16, data: [u8; N], meaning: &'static str) -> Row {
        let id = match CobId::standard(id) {
            Some(id) => id,
            None => panic!("the tables have 11-bit identifiers"),
        };
        Row { action: Action::Send(Frame::from_array(id, data)), meaning, in_table: true }
    }

    const fn wait(until: Until, meaning: &'static str) -> Row {
        Row { action: Action::Wait(until), meaning, in_table: true }
    }

    const fn wait_too(until: Until, meaning: &'static str) -> Row {
        Row { in_table: false, ..Row::wait(until, meaning) }
    }
}

/// Table 25: positioning with an intermediate stop.
pub const POSITIONING: Example = Example {
    table: 25,
    title: "Profile Position Mode",
    operating_mode: 1,
    rows: &[
        Row::send(0x000, [0x01, 0x05], "NMT: enter OPERATIONAL"),
        Row::send(0x205, [0x06, 0x01], "RPDO1: Shutdown"),
        Row::send(0x205, [0x07, 0x01], "RPDO1: Switch On"),
        Row::send(0x205, [0x0F, 0x01], "RPDO1: Enable Operation"),
        Row::send(0x405, [0x1F, 0x00, 0x88, 0x13, 0x00, 0x00], "RPDO3: travel to +5000"),
        Row::wait(Until::Position(5000), "target position reached"),
        Row::send(0x205, [0x0F, 0x01], "RPDO1: clear New Setpoint"),
        Row::send(0x405, [0x1F, 0x00, 0x78, 0xEC, 0xFF, 0xFF], "RPDO3: travel to -5000"),
        Row::wait_too(Until::Elapsed(Duration::from_millis(4_000)), "under way"),
        Row::send(0x205, [0x1F, 0x01], "RPDO1: intermediate stop"),
        Row::wait_too(Until::Standstill, "stopped"),
        Row::wait_too(Until::Elapsed(Duration::from_millis(1_000)), "still stopped"),
        Row::send(0x205, [0x1F, 0x00], "RPDO1: resume the positioning"),
        Row::wait(Until::Position(-5000), "target position reached"),
        Row::send(0x205, [0x0F, 0x01], "RPDO1: clear New Setpoint"),
        Row::send(0x205, [0x07, 0x01], "RPDO1: Disable Operation"),
        Row::send(0x205, [0x06, 0x01], "RPDO1: Shutdown"),
        Row::send(0x205, [0x00, 0x01], "RPDO1: Disable Voltage"),
        Row::send(0x000, [0x80, 0x05], "NMT: enter PRE-OPERATIONAL"),
    ],
};

/// Table 26: three velocities.
pub const VELOCITY: Example = Example {
    table: 26,
    title: "Profile Velocity Mode",
    operating_mode: 2,
    rows: &[
        Row::send(0x000, [0x01, 0x05], "NMT: enter OPERATIONAL"),
        Row::send(0x205, [0x06, 0x01], "RPDO1: Shutdown"),
        Row::send(0x205, [0x07, 0x01], "RPDO1: Switch On"),
        Row::send(0x205, [0x0F, 0x01], "RPDO1: Enable Operation"),
        Row::send(0x505, [0x0F, 0x00, 0x44, 0x00, 0x00, 0x00], "RPDO4: run at +68 rev/min"),
        Row::wait(Until::Velocity(68), "target velocity reached"),
        Row::wait_too(Until::Elapsed(Duration::from_millis(1_000)), "running"),
        Row::send(0x505, [0x0F, 0x00, 0x1E, 0x00, 0x00, 0x00], "RPDO4: change to +30 rev/min"),
        Row::wait_too(Until::Velocity(30), "target velocity reached"),
        Row::wait_too(Until::Elapsed(Duration::from_millis(1_000)), "running"),
        Row::send(0x205, [0x0F, 0x01], "RPDO1: stop"),
        Row::wait_too(Until::Standstill, "stopped"),
        Row::send(0x505, [0x0F, 0x00, 0xB8, 0xFF, 0xFF, 0xFF], "RPDO4: run at -72 rev/min"),
        Row::wait(Until::Velocity(-72), "target velocity reached"),
        Row::wait_too(Until::Elapsed(Duration::from_millis(1_000)), "running"),
        Row::send(0x205, [0x0F, 0x01], "RPDO1: stop"),
        Row::wait_too(Until::Standstill, "stopped"),
        Row::send(0x205, [0x07, 0x01], "RPDO1: Disable Operation"),
        Row::send(0x205, [0x06, 0x01], "RPDO1: Shutdown"),
        Row::send(0x205, [0x00, 0x01], "RPDO1: Disable Voltage"),
        Row::send(0x000, [0x80, 0x05], "NMT: enter PRE-OPERATIONAL"),
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_have_fourteen_and_thirteen_frames_and_four_waits() {
        let count = |example: &Example, frames: bool| {
            let rows = example.rows.iter().filter(|row| row.in_table);
            rows.filter(|row| matches!(row.action, Action::Send(_)) == frames).count()
        };
        assert_eq!((count(&POSITIONING, true), count(&POSITIONING, false)), (14, 2));
        assert_eq!((count(&VELOCITY, true), count(&VELOCITY, false)), (13, 2));
    }
}
