//! The tabs of the bench.

use super::text::{Language, Text};
use crate::orders::ORDERS;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Tab {
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

impl Tab {
    pub(super) const ALL: [Tab; 8] =
        [Tab::Nodes, Tab::Objects, Tab::Pdos, Tab::Trace, Tab::Plots, Tab::Drives, Tab::Bus, Tab::Devices];

    /// The tab `by` positions to the right.
    pub(super) const fn further(self, by: usize) -> Self {
        Tab::ALL[(self as usize + by) % Tab::ALL.len()]
    }

    pub(super) const fn title(self) -> Text {
        match self {
            Tab::Nodes => Text::Nodes,
            Tab::Objects => Text::Objects,
            Tab::Pdos => Text::Pdos,
            Tab::Trace => Text::Trace,
            Tab::Plots => Text::Plots,
            Tab::Drives => Text::Drives,
            Tab::Bus => Text::Bus,
            Tab::Devices => Text::Devices,
        }
    }

    /// Help on the keys of the tab.
    pub(super) fn help(self, language: Language) -> String {
        let text = match self {
            Tab::Nodes => Text::HelpNodes,
            Tab::Objects => Text::HelpObjects,
            Tab::Pdos => Text::HelpPdos,
            Tab::Trace => Text::HelpTrace,
            Tab::Plots => Text::HelpPlots,
            Tab::Drives => {
                let keys = ORDERS.iter().map(|row| format!("{} {}", row.key, row.titles[language as usize]));
                return keys.collect::<Vec<_>>().join("  ");
            }
            Tab::Bus => Text::HelpBus,
            Tab::Devices => Text::HelpDevices,
        };
        text.of(language).to_owned()
    }
}
