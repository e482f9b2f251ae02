//! What motion the driver has ordered, and what is known of its end.

/// The motion that was ordered last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Motion {
    /// No motion was ordered, or the drive was seen standing after the last one.
    #[default]
    Resting,
    /// A travel to a position.
    Travelling(Travel),
    /// A step of inching operation to this position. It is ordered by an edge, so clearing the bit does not stop it.
    Stepping {
        target: i32,
    },
    /// Inching while a control bit is set.
    Inching,
    Homing,
    /// Velocity or torque mode.
    Running,
    /// Some motion: frames that told how it went on are lost.
    Unknown,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Travel {
    /// `None` if another manager has ordered it.
    pub(crate) target: Option<i32>,
    pub(crate) pause: Pause,
    /// Other set-points may come before it: the drive clears the acknowledgement only when it has room for the next
    /// one.
    pub(crate) queued: bool,
}

impl Travel {
    /// A travel that has just been ordered.
    pub(crate) const fn to(target: Option<i32>) -> Self {
        Travel { target, pause: Pause::None, queued: false }
    }
}

/// Whether a travel is interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pause {
    /// The travel goes on.
    None,
    Interrupted,
    /// The driver has ordered the travel to resume, and has not seen it do so.
    Unheeded,
    /// The driver has stopped the travel, and has seen the drive stand.
    Stopped,
}

impl Motion {
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

    /// How the ordered travel is interrupted; `None` if the motion is not a travel.
    pub(crate) const fn pause(self) -> Option<Pause> {
        match self {
            Motion::Travelling(travel) => Some(travel.pause),
            _ => None,
        }
    }

    /// The same travel, or another manager's, with another pause.
    pub(crate) const fn with_pause(self, pause: Pause) -> Self {
        let travel = match self {
            Motion::Travelling(travel) => travel,
            _ => Travel::to(None),
        };
        Motion::Travelling(Travel { pause, ..travel })
    }
}
