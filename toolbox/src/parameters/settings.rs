//! Settings in a file (TOML): objects of nodes by name, values with their units.
//!
//! ```toml
//! [node.5]
//! "Modes of Operation" = "profile velocity"
//! "Motor Parameter Set/v-Pos" = 40
//! 2412 = "2.5 mm"
//! ```

use std::collections::BTreeMap;

use lexican_eds::model::Device;
use lexican_eds::standard::{Role, role};
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use serde::Deserialize;

use super::restore::Settings;
use crate::text::toml_text::{self, TomlError};
use crate::values::DeviceValues;
use crate::values::lookup::resolve;
use crate::values::permission::WriteRefusal;
use crate::values::wire;

/// The sections of a file, by the text that names their nodes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    node: BTreeMap<String, BTreeMap<String, toml::Value>>,
}

/// What a file says of some nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// The node-IDs as they are written: `5`, `3,5-9`.
    pub nodes: String,
    /// Objects and values as people write them.
    pub settings: Vec<(String, String)>,
}

/// Why a file has no settings.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// It is no TOML, or has other keys.
    #[error(transparent)]
    Syntax(#[from] TomlError),
    /// A value is a table, a list or a date.
    #[error("node.{nodes}: {object:?} has no value: write a number, a text or a boolean")]
    NoValue {
        /// The section.
        nodes: String,
        /// The key.
        object: String,
    },
    /// There is no section.
    #[error("it has no [node.ID]")]
    Empty,
}

/// The sections of a file.
pub fn parse(text: &str) -> Result<Vec<Section>, FileError> {
    let file: File = toml_text::parse(text)?;
    if file.node.is_empty() {
        return Err(FileError::Empty);
    }
    let section = |(nodes, table): (String, BTreeMap<String, toml::Value>)| {
        let setting = |(object, value): (String, toml::Value)| match value {
            toml::Value::String(text) => Ok((object, text)),
            toml::Value::Integer(_) | toml::Value::Float(_) | toml::Value::Boolean(_) => {
                Ok((object, value.to_string()))
            }
            _ => Err(FileError::NoValue { nodes: nodes.clone(), object }),
        };
        let settings = table.into_iter().map(setting).collect::<Result<_, _>>()?;
        Ok(Section { nodes, settings })
    };
    file.node.into_iter().map(section).collect()
}

/// The entries that decide over units and limits of others, and are to be read of the device before [`Section::encode`].
#[must_use]
pub fn conditions(device: &Device) -> Vec<Address> {
    let values = DeviceValues::new(device);
    let mut conditions: Vec<_> = device.entries().flat_map(|entry| values.conditions(entry)).collect();
    conditions.sort();
    conditions.dedup();
    conditions
}

impl Section {
    /// The settings in wire form, when the data sheet allows all of them. `values` has what is known of the device; what the
    /// section sets counts before it.
    pub fn encode(&self, values: &mut DeviceValues<'_>, node: NodeId) -> Result<Settings, Vec<String>> {
        let given: Vec<_> = self.settings.iter().map(|(object, value)| (object.as_str(), value.as_str())).collect();
        let (settings, wrong) = encode(&given, values, Some(node));
        let words = |wrong: Wrong| match wrong.advice {
            Some(advice) => format!("{}; {advice}", wrong.text),
            None => format!("{}: {}", given[wrong.at].0, wrong.text),
        };
        if wrong.is_empty() { Ok(settings) } else { Err(wrong.into_iter().map(words).collect()) }
    }
}

/// A setting that cannot be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wrong {
    /// Which of those that were given.
    pub at: usize,
    /// Whether the object is wrong; else it is the value.
    pub is_of_object: bool,
    /// What is wrong.
    pub text: String,
    /// What to do about it.
    pub advice: Option<String>,
}

/// Objects and values as people write them, in wire form; and which of them the data sheet does not allow. `values` has what is
/// known of the device; what is set counts before it. `None` for a node that is simulated, and may be given what nobody can
/// write.
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
    // Units and limits of the others depend on these.
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

    fn encoded(settings: &str) -> Result<Vec<String>, Vec<String>> {
        let device = samples::drive();
        let section = parse(&format!("[node.5]\n{settings}")).unwrap().remove(0);
        let settings = section.encode(&mut DeviceValues::new(&device), NODE)?;
        Ok(settings.iter().map(|(address, data)| format!("{address} {data:02X?}")).collect())
    }

    #[test]
    fn settings_are_named_and_have_units() {
        let text =
            "\"Modes of Operation\" = \"profile velocity\"\n\"Motor Parameter Set/v-Pos\" = 7\n2412 = \"2.5 mm\"";
        assert_eq!(encoded(text).unwrap(), ["2410:05 [07]", "2412:00 [FA, 00]", "6060:00 [02]"]);
        // Positions are in mm as soon as there is a spindle pitch.
        let pitch = encoded("2412 = \"1.00 mm\"\n607A = \"12.5 mm\"").unwrap();
        assert_eq!(pitch[1], "607A:00 [E2, 04, 00, 00]");
        assert!(encoded("607A = \"12.5 mm\"").is_err());
    }

    #[test]
    fn everything_that_is_wrong_is_reported() {
        let wrong =
            encoded("6060 = 9\n6064 = 1\nnonsense = 1\n2412 = 250\n\"2410/5\" = 1\n\"2410:05\" = 1").unwrap_err();
        for words in ["allows profile position", "says ro", "names no object \"nonsense\"", "raw:250", "set twice"] {
            assert!(wrong.iter().any(|wrong| wrong.contains(words)), "{words}: {wrong:#?}");
        }
        assert_eq!(wrong.len(), 5);
    }

    /// A drive would be enabled, or forget what it has, by a file of parameters.
    #[test]
    fn commands_are_no_settings() {
        for command in ["6040 = 15", "6040 = \"enable operation\"", "\"1011:01\" = \"raw:0x64616F6C\""] {
            let wrong = encoded(&format!("6060 = 1\n{command}")).unwrap_err();
            assert!(wrong.len() == 1 && wrong[0].contains("`lexican write` gives it"), "{command}: {wrong:?}");
        }
    }

    #[test]
    fn a_file_without_settings_is_refused() {
        for (text, words) in [
            ("", "no [node.ID]"),
            ("[node.5", "line 1: "),
            ("[node.5]\n6060 = [1]", "node.5: \"6060\" has no value"),
            ("\n[knot.5]\n6060 = 1", "line 2: unknown field `knot`"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
