//! What the driver has ordered that moves, and what is known of its end.

/// What has been ordered last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Motion {
    /// No motion was ordered, or the drive was seen standing after the last one.
    #[default]
    Resting,
    /// A travel to a position.
    Travelling(Travel),
    /// A step of inching operation to this position: an edge, which no bit takes back.
    Stepping {
        target: i32,
    },
    /// Inching while a bit is set.
    Inching,
    Homing,
    /// Velocity or torque mode.
    Running,
    /// Something, and the frames that said how it went on are lost.
    Unknown,
}

/// A travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Travel {
    /// `None` if another manager has ordered it.
    pub(crate) target: Option<i32>,
    pub(crate) pause: Pause,
    /// Other set-points may have been before it: the drive acknowledges until it has room for the next one.
    pub(crate) queued: bool,
}

impl Travel {
    /// A travel that begins.
    pub(crate) const fn to(target: Option<i32>) -> Self {
        Travel { target, pause: Pause::None, queued: false }
    }
}

/// Whether a travel is interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pause {
    /// It goes on.
    None,
    Interrupted,
    /// The driver has ordered it to go on, and has not seen it do so.
    Unheeded,
    /// The driver has stopped it, and has seen the drive stand.
    Stopped,
}

impl Motion {
    /// A travel that begins.
    pub(crate) const fn travel(target: Option<i32>) -> Self {
        Motion::Travelling(Travel::to(target))
    }

    /// Whether the drive may be moving.
    pub(crate) fn may_move(self) -> bool {
        !matches!(self, Motion::Resting | Motion::Travelling(Travel { pause: Pause::Stopped, .. }))
    }

    /// Whether the driver has interrupted the travel that it has ordered.
    pub(crate) fn is_paused(self) -> bool {
        self.pause().is_some_and(|pause| pause != Pause::None)
    }

    /// How the travel that has been ordered goes on.
    pub(crate) const fn pause(self) -> Option<Pause> {
        match self {
            Motion::Travelling(travel) => Some(travel.pause),
            _ => None,
        }
    }

    /// The same travel, or another manager's, in another state.
    pub(crate) const fn with_pause(self, pause: Pause) -> Self {
        let travel = match self {
            Motion::Travelling(travel) => travel,
            _ => Travel::to(None),
        };
        Motion::Travelling(Travel { pause, ..travel })
    }
}
