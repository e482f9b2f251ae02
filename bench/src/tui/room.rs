//! The rooms of the bench.

use super::text::Text;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Room {
    #[default]
    Nodes,
    Objects,
    Pdos,
    Trace,
    Plots,
    Drives,
    Bus,
    Devices,
}

impl Room {
    pub(super) const ALL: [Room; 8] =
        [Room::Nodes, Room::Objects, Room::Pdos, Room::Trace, Room::Plots, Room::Drives, Room::Bus, Room::Devices];

    /// The room `by` places further on.
    pub(super) const fn further(self, by: usize) -> Self {
        Room::ALL[(self as usize + by) % Room::ALL.len()]
    }

    pub(super) const fn title(self) -> Text {
        match self {
            Room::Nodes => Text::Nodes,
            Room::Objects => Text::Objects,
            Room::Pdos => Text::Pdos,
            Room::Trace => Text::Trace,
            Room::Plots => Text::Plots,
            Room::Drives => Text::Drives,
            Room::Bus => Text::Bus,
            Room::Devices => Text::Devices,
        }
    }

    pub(super) const fn help(self) -> Text {
        match self {
            Room::Nodes => Text::HelpNodes,
            Room::Objects => Text::HelpObjects,
            Room::Pdos => Text::HelpPdos,
            Room::Trace => Text::HelpTrace,
            Room::Plots => Text::HelpPlots,
            Room::Drives => Text::HelpDrives,
            Room::Bus => Text::HelpBus,
            Room::Devices => Text::HelpDevices,
        }
    }
}
