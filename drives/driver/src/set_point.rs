//! Set-points of positioning mode that follow one another.

/// Where to travel next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SetPoint {
    /// The position, or the distance.
    pub target: i32,
    /// Whether `target` is a distance. From where it counts, the drive decides: mostly from the target before.
    pub relative: bool,
    /// How it follows the one before.
    pub succession: Succession,
}

/// How a set-point follows the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Succession {
    /// The drive stops at the target before.
    Stopped,
    /// The drive passes the target before without stopping.
    Blended,
    /// The travel under way is replaced.
    AtOnce,
}

impl SetPoint {
    /// To a position, after a stop at the target before.
    #[must_use]
    pub const fn to(target: i32) -> Self {
        SetPoint { target, relative: false, succession: Succession::Stopped }
    }

    /// By a distance, after a stop at the target before.
    #[must_use]
    pub const fn by(distance: i32) -> Self {
        SetPoint { relative: true, ..SetPoint::to(distance) }
    }

    /// The same, without a stop at the target before.
    #[must_use]
    pub const fn blended(self) -> Self {
        SetPoint { succession: Succession::Blended, ..self }
    }

    /// The same, instead of the travel under way.
    #[must_use]
    pub const fn at_once(self) -> Self {
        SetPoint { succession: Succession::AtOnce, ..self }
    }
}
