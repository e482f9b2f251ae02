//! Settings as users write them: objects by name, values with units.

use lexican_eds::model::Device;
use lexican_eds::standard::{Role, role};
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;

use super::restore::Settings;
use crate::values::DeviceValues;
use crate::values::lookup::resolve;
use crate::values::permission::WriteRefusal;
use crate::values::wire;

/// The entries on which units and limits of others depend.
fn conditions(device: &Device) -> Vec<Address> {
    let values = DeviceValues::new(device);
    let mut conditions: Vec<_> = device.entries().flat_map(|entry| values.conditions(entry)).collect();
    conditions.sort();
    conditions.dedup();
    conditions
}

/// An invalid setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wrong {
    /// The position of the setting in the list.
    pub at: usize,
    /// Whether the object is invalid; otherwise the value is.
    pub is_of_object: bool,
    /// What is wrong.
    pub text: String,
    /// What to do about it.
    pub advice: Option<String>,
}

/// Converts objects and values as users write them to wire form, and lists those that the data sheet does not allow.
/// `values` is what is known of the device; values being set take precedence. `node` is `None` for a simulated node, to
/// which read-only entries may be given as well.
pub fn encode(given: &[(&str, &str)], values: &mut DeviceValues<'_>, node: Option<NodeId>) -> (Settings, Vec<Wrong>) {
    let (mut settings, mut wrong) = (Settings::new(), Vec::new());
    let mut resolved = Vec::new();
    for (at, (object, value)) in given.iter().enumerate() {
        match resolve(Some(values.device), object) {
            Ok(address) => resolved.push((address, at, value)),
            Err(error) => {
                let advice = Some(error.advice());
                wrong.push(Wrong { at, is_of_object: true, text: error.to_string(), advice });
            }
        }
    }
    // First those on which units and limits of the others depend.
    let conditions = conditions(values.device);
    resolved.sort_by_key(|(address, ..)| !conditions.contains(address));
    for (address, at, text) in resolved {
        match one(values, address, text, node) {
            Ok(data) => {
                if settings.insert(address, data).is_some() {
                    let text = format!("{address} is set twice");
                    wrong.push(Wrong { at, is_of_object: true, text, advice: None });
                }
            }
            Err(text) => wrong.push(Wrong { at, is_of_object: false, text, advice: None }),
        }
    }
    (settings, wrong)
}

fn one(values: &mut DeviceValues<'_>, address: Address, text: &str, node: Option<NodeId>) -> Result<Vec<u8>, String> {
    let entry = values.entry(address).ok_or_else(|| format!("the data sheet has no {address}"))?;
    if node.is_some() && !entry.access.writable() {
        return Err(WriteRefusal::Access(entry.access).to_string());
    }
    if node.is_some() && role(values.device, entry.index, entry.sub) == Some(Role::Command) {
        return Err("it is a command and no parameter; `lexican write` gives it".to_owned());
    }
    let value = values.parse(entry, text)?;
    if let Some(node) = node {
        values.check_write(entry, &value, node).map_err(|refusal| refusal.to_string())?;
    }
    values.set(address, &value);
    wire::encode(entry.data_type, &value).ok_or_else(|| format!("the value is no {}", entry.data_type))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    const NODE: NodeId = NodeId::literal(5);

    fn encoded(given: &[(&str, &str)]) -> Result<Vec<String>, Vec<String>> {
        let device = samples::drive();
        let (settings, wrong) = encode(given, &mut DeviceValues::new(&device), Some(NODE));
        match wrong.is_empty() {
            true => Ok(settings.iter().map(|(address, data)| format!("{address} {data:02X?}")).collect()),
            false => Err(wrong.into_iter().map(|wrong| wrong.text).collect()),
        }
    }

    #[test]
    fn settings_are_named_and_have_units() {
        let given =
            [("Modes of Operation", "profile velocity"), ("Motor Parameter Set/v-Pos", "7"), ("2412", "2.5 mm")];
        assert_eq!(encoded(&given).unwrap(), ["2410:05 [07]", "2412:00 [FA, 00]", "6060:00 [02]"]);
        // With a spindle pitch, positions are in mm.
        let pitch = encoded(&[("607A", "12.5 mm"), ("2412", "1.00 mm")]).unwrap();
        assert_eq!(pitch[1], "607A:00 [E2, 04, 00, 00]");
        assert!(encoded(&[("607A", "12.5 mm")]).is_err());
    }

    #[test]
    fn everything_that_is_wrong_is_reported() {
        let given =
            [("6060", "9"), ("6064", "1"), ("nonsense", "1"), ("2412", "250"), ("2410/5", "1"), ("2410:05", "1")];
        let wrong = encoded(&given).unwrap_err();
        for words in ["allows profile position", "says ro", "names no object \"nonsense\"", "raw:250", "set twice"] {
            assert!(wrong.iter().any(|wrong| wrong.contains(words)), "{words}: {wrong:#?}");
        }
        assert_eq!(wrong.len(), 5);
    }

    /// Commands in a parameter file would enable a drive or restore its defaults.
    #[test]
    fn commands_are_no_settings() {
        for command in [("6040", "15"), ("6040", "enable operation"), ("1011:01", "raw:0x64616F6C")] {
            let wrong = encoded(&[("6060", "1"), command]).unwrap_err();
            assert!(wrong.len() == 1 && wrong[0].contains("`lexican write` gives it"), "{command:?}: {wrong:?}");
        }
    }
}
