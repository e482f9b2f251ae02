//! Set-points of positioning mode that follow one another.

/// Where to travel next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SetPoint {
    /// In units of position; a distance if `relative`.
    pub target: i32,
    /// Whether `target` is a distance. The drive decides from where it counts, mostly from the previous target.
    pub relative: bool,
    /// How it follows the previous set-point.
    pub succession: Succession,
}

/// How a set-point follows the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Succession {
    /// The drive stops at the previous target.
    Stopped,
    /// The drive passes the previous target without stopping.
    Blended,
    /// The travel under way is replaced.
    AtOnce,
}

impl SetPoint {
    /// To a position, after a stop at the previous target.
    #[must_use]
    pub const fn to(target: i32) -> Self {
        SetPoint { target, relative: false, succession: Succession::Stopped }
    }

    /// By a distance, after a stop at the previous target.
    #[must_use]
    pub const fn by(distance: i32) -> Self {
        SetPoint { relative: true, ..SetPoint::to(distance) }
    }

    /// The same, without a stop at the previous target.
    #[must_use]
    pub const fn blended(self) -> Self {
        SetPoint { succession: Succession::Blended, ..self }
    }

    /// The same, replacing the travel under way.
    #[must_use]
    pub const fn at_once(self) -> Self {
        SetPoint { succession: Succession::AtOnce, ..self }
    }
}
