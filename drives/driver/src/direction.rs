//! Which way the drive turns.

/// A sense of travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Towards greater positions.
    Positive,
    /// Towards smaller positions.
    Negative,
}

impl Direction {
    /// 1 or -1.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Direction::Positive => 1.0,
            Direction::Negative => -1.0,
        }
    }

    /// The direction of a distance or a velocity; positive for 0.
    #[must_use]
    pub fn of(way: f64) -> Self {
        if way < 0.0 { Direction::Negative } else { Direction::Positive }
    }
}
