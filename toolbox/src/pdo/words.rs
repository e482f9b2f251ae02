//! PDOs as text and JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use lexican_eds::model::Device;
use lexican_eds::types::DataType;
use lexican_runtime::object::{Address, Direction, Mapped};
use lexican_runtime::wire::pdo::TransmissionType;
use serde_json::{Map, Value as Json, json};

use super::{PdoState, transmission};
use crate::text::json::fields;
use crate::values::name;
use crate::values::report::ValueReport;

/// The configuration of a PDO, with a picture of its bytes and the values that are known.
///
/// ```text
/// TPDO1  185h, at events of the profile (255), event timer 10 ms
///        0        1        2        3        4        5
///     aaaaaaaa aaaaaaaa bbbbbbbb bbbbbbbb bbbbbbbb bbbbbbbb
///     a  bits 0-15   6041:00 Statusword
///     b  bits 16-47  6064:00 Position Actual Value
/// ```
///
/// The highest bit of each byte is on the left. `-` is a gap, `.` an unused bit.
#[must_use]
pub fn in_words(state: &PdoState, device: Option<&Device>, values: &BTreeMap<Address, ValueReport>) -> String {
    // Writing to a string cannot fail, so its results are ignored.
    let mut text = format!("{}  {}\n", state.name, summary(state));
    let (mut letters, mut rows, mut low) = (Vec::new(), Vec::new(), 0);
    for (mapped, letter) in state.mapping.iter().zip(('a'..='z').cycle()) {
        let is_gap = data_type(mapped).is_some();
        letters.extend(std::iter::repeat_n(if is_gap { '-' } else { letter }, mapped.bits.into()));
        let bits = match mapped.bits {
            1 => format!("bit {low}"),
            bits => format!("bits {low}-{}", low + u32::from(bits).max(1) - 1),
        };
        let value = values.get(&mapped.address).map_or_else(String::new, |value| format!(" = {}", value.text()));
        rows.push((if is_gap { '-' } else { letter }, bits, format!("{}{value}", title(mapped, device))));
        low += u32::from(mapped.bits);
    }
    letters.resize(letters.len().next_multiple_of(8), '.');
    let bytes: Vec<String> = letters.chunks(8).map(|byte| byte.iter().rev().collect()).collect();
    if !bytes.is_empty() {
        let numbers: Vec<String> = (0..bytes.len()).map(|number| format!("{number:^8}")).collect();
        let _ = writeln!(text, "    {}\n    {}", numbers.join(" ").trim_end(), bytes.join(" "));
    }
    let width = rows.iter().map(|(_, bits, _)| bits.len()).max().unwrap_or(0);
    for (letter, bits, title) in rows {
        let _ = writeln!(text, "    {letter}  {bits:<width$}  {title}");
    }
    if state.mapping.is_empty() {
        text += "    maps nothing\n";
    }
    text
}

/// `185h, at events of the profile (255), inhibit time 0.5 ms, event timer 10 ms`.
#[must_use]
pub fn summary(state: &PdoState) -> String {
    let id = format!("{}h", state.cob_id.id());
    std::iter::once(id).chain(manner(state)).collect::<Vec<_>>().join(", ")
}

/// The parts of [`summary`] without the COB-ID.
pub(crate) fn manner(state: &PdoState) -> Vec<String> {
    let mut parts = Vec::new();
    parts.extend((!state.cob_id.is_valid()).then(|| "switched off".to_owned()));
    parts.extend(state.transmission.map(|it| transmission(state.name.direction, it)));
    let inhibit = state.inhibit_100us.filter(|time| *time > 0);
    parts.extend(inhibit.map(|time| format!("inhibit time {} ms", f64::from(time) / 10.0)));
    let timer = match state.name.direction {
        Direction::Receive => "deadline",
        Direction::Transmit => "event timer",
    };
    parts.extend(state.event_timer_ms.filter(|time| *time > 0).map(|time| format!("{timer} {time} ms")));
    let remote = state.name.direction == Direction::Transmit && !state.cob_id.allows_remote();
    parts.extend(remote.then(|| "no remote frames".to_owned()));
    parts
}

/// The data type that fills a gap; `None` for an object.
fn data_type(mapped: &Mapped) -> Option<DataType> {
    let data_type = DataType::from_code(mapped.address.index());
    (mapped.address.index() < 0x20 && data_type.bits().is_some()).then_some(data_type)
}

/// `6041:00 Statusword`.
#[must_use]
pub fn title(mapped: &Mapped, device: Option<&Device>) -> String {
    let address = mapped.address;
    match (data_type(mapped), entry_name(mapped, device)) {
        (Some(data_type), _) => format!("gap of {data_type}"),
        (None, Some(name)) => format!("{address} {name}"),
        (None, None) => address.to_string(),
    }
}

fn entry_name(mapped: &Mapped, device: Option<&Device>) -> Option<String> {
    let device = device?;
    Some(name(device, device.entry(mapped.address.index(), mapped.address.sub())?))
}

impl PdoState {
    /// The JSON fields, with the values that are known.
    #[must_use]
    pub fn json(&self, device: Option<&Device>, values: &BTreeMap<Address, ValueReport>) -> Map<String, Json> {
        let mut low = 0;
        let mapping: Vec<Json> = self
            .mapping
            .iter()
            .map(|mapped| {
                let first_bit = low;
                low += u32::from(mapped.bits);
                json!({
                    "address": mapped.address.to_string(),
                    "name": entry_name(mapped, device),
                    "first_bit": first_bit,
                    "bits": mapped.bits,
                    "value": values.get(&mapped.address).map(|value| value.json().remove("value")),
                    "text": values.get(&mapped.address).map(ValueReport::text),
                })
            })
            .collect();
        fields(json!({
            "pdo": self.name.to_string(),
            "cob_id": self.cob_id.id().to_string(),
            "on": self.cob_id.is_valid(),
            "remote_frames": self.cob_id.allows_remote(),
            "transmission_type": self.transmission.map(TransmissionType::code),
            "transmission": self.transmission.map(|it| transmission(self.name.direction, it)),
            "inhibit_time_ms": self.inhibit_100us.map(|time| f64::from(time) / 10.0),
            "event_timer_ms": self.event_timer_ms,
            "bits": self.bits(),
            "mapping": mapping,
        }))
    }
}
