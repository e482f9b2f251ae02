//! The keys of a table. Each is taken once; those that are left are reported.

use std::cell::RefCell;
use std::collections::BTreeSet;

use lexican_eds::Severity;

use super::tree::Yaml;
use crate::at::At;
use crate::read::{Out, similar};

/// Keys that ros2_canopen reads at run time, which are not about the network.
const OF_ROS: &str = "dcf_path driver package namespace remappings enable_lazy_load polling period non_transmit_timeout \
    sdo_timeout_ms boot_timeout boot_timeout_ms diagnostics scale_pos_to_dev scale_pos_from_dev scale_vel_to_dev \
    scale_vel_from_dev scale_eff_from_dev offset_pos_to_dev offset_pos_from_dev switching_state homing_timeout_seconds \
    num_channels channel_names channels position_mode velocity_mode effort_mode";

pub(super) struct Keys {
    entries: Vec<(At<String>, Yaml)>,
    asked: RefCell<BTreeSet<&'static str>>,
}

impl Keys {
    pub(super) fn new(entries: Vec<(At<String>, Yaml)>) -> Self {
        Keys { entries, asked: RefCell::default() }
    }

    pub(super) fn of(yaml: &Yaml, out: &mut Out) -> Self {
        if yaml.map().is_none() && yaml.text().is_none_or(|text| !matches!(text, "" | "~" | "null")) {
            out.wrong("bus-yml::value", &yaml.at, "expected a table", None);
        }
        Keys::new(yaml.map().unwrap_or_default().to_vec())
    }

    pub(super) fn get(&self, key: &'static str) -> Option<&Yaml> {
        self.asked.borrow_mut().insert(key);
        self.entries.iter().find(|(name, _)| name.value == key).map(|(_, value)| value)
    }

    /// Takes a number; `None` if it is absent or invalid.
    pub(super) fn number<T: TryFrom<i64>>(&self, key: &'static str, out: &mut Out) -> Option<T> {
        let value = self.get(key)?;
        let number = value.integer().and_then(|number| T::try_from(number).ok());
        if number.is_none() {
            let words = value.text().map_or_else(|| "this".to_owned(), |text| format!("{text:?}"));
            out.wrong("bus-yml::value", &value.at, format!("{words} is no number that `{key}` can be"), None);
        }
        number
    }

    pub(super) fn flag(&self, key: &'static str, otherwise: bool, out: &mut Out) -> bool {
        let Some(value) = self.get(key) else { return otherwise };
        value.boolean().unwrap_or_else(|| {
            out.wrong("bus-yml::value", &value.at, format!("`{key}` is true or false"), None);
            otherwise
        })
    }

    pub(super) fn each(&self) -> impl Iterator<Item = &(At<String>, Yaml)> {
        self.entries.iter()
    }

    /// Takes keys without meaning for a machine, and reports each one that is there.
    pub(super) fn leave_out(&self, keys: &[(&'static str, &str)], out: &mut Out) {
        for (key, what) in keys {
            if let Some(value) = self.get(key).filter(|value| value.integer() != Some(0)) {
                let what = format!("`{key}` is left out: {what}");
                out.push(Severity::Warning, "bus-yml::left-out", &value.at, what, None);
            }
        }
    }

    /// Reports unknown keys; collects those that only ros2_canopen reads.
    pub(super) fn end(&self, tool: &str, of_ros: &mut BTreeSet<String>, out: &mut Out) {
        let asked = self.asked.borrow();
        let ros = || OF_ROS.split_whitespace();
        for (key, _) in &self.entries {
            if ros().any(|known| known == key.value) {
                of_ros.insert(key.value.clone());
            } else if !asked.contains(key.as_str()) {
                let known = asked.iter().copied().chain(ros());
                let what = format!("unknown key `{}`, which {tool} ignores without a word", key.value);
                out.push(Severity::Warning, "bus-yml::key", &key.span, what, similar(key, known));
            }
        }
    }
}
