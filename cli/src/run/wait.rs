//! The line `wait` of a sequence: waits for a time, or for an object to have a value.

use std::cmp::Ordering;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use lexican_eds::model::Value;
use lexican_machine::{Machine, Setting};
use lexican_runtime::host::Pace;
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::duration::time;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::resolve;
use lexican_toolbox::values::report::ValueReport;
use lexican_toolbox::values::wire::parse_padded;
use serde_json::json;

use crate::bus::{BusArgs, network};
use crate::output::{Failure, Outcome, print_result, warn};

/// The interval of reading an object.
const LOOK: Duration = Duration::from_millis(20);
const USAGE: &str = "write `wait 500 ms`, or `wait NODE.OBJECT = VALUE within 2 s`, with =, !=, <, <=, > or >=";

/// A condition to wait for.
pub(crate) struct Wait {
    within: Duration,
    pub(super) until: Option<Until>,
}

pub(super) struct Until {
    pub(super) node: NodeId,
    sheet: Arc<DataSheet>,
    /// The settings in the machine, on which meanings of other entries depend.
    settings: Vec<(Address, Value)>,
    address: Address,
    /// Whether an ordering of the object's value and the wanted one fulfils the condition.
    is: fn(Ordering) -> bool,
    value: Value,
    /// As written in the sequence.
    text: String,
}

impl Wait {
    pub(super) fn parse(words: &[String], machine: Option<&Machine>) -> Result<Self, String> {
        let within = words.iter().position(|word| word == "within");
        let Some(at) = within else {
            return Ok(Wait {
                within: time(&words.concat()).map_err(|error| format!("{error}; {USAGE}"))?,
                until: None,
            });
        };
        let (condition, span) = (&words[..at], time(&words[at + 1..].concat())?);
        let operator = condition.iter().position(|word| order(word).is_some());
        let (Some(place), Some(machine)) = (operator, machine) else {
            return Err(match operator {
                None => USAGE.to_owned(),
                Some(_) => "objects are those of a machine, and there is none here".to_owned(),
            });
        };
        let (what, value) = (condition[..place].join(" "), condition[place + 1..].join(" "));
        let (name, object) = what.split_once('.').ok_or(USAGE)?;
        let node = machine.node(name).ok_or_else(|| format!("there is no node {name:?}"))?;
        let (Some(id), Some(sheet)) = (node.id, &node.sheet) else {
            return Err(format!("{name} has no node-ID, or no data sheet"));
        };
        // Accept an element of an array in the notation of wires.
        let object = object.replace('[', "/").replace(']', "");
        let address = resolve(Some(&sheet.device), &object).map_err(|error| format!("{error}; {}", error.advice()))?;
        let entry = |address: Address| sheet.device.entry(address.index(), address.sub());
        let set = |setting: &Setting| {
            Some((setting.address, parse_padded(entry(setting.address)?.data_type, &setting.data)?))
        };
        let settings = node.settings.iter().filter_map(set).collect();
        let (is, text) = (order(&condition[place]).expect("it was found"), condition.join(" "));
        let entry = entry(address).ok_or_else(|| format!("the data sheet has no {address}"))?;
        let until = Until { node: id, sheet: Arc::clone(sheet), settings, address, is, value: Value::Integer(0), text };
        let value = until.values().parse(entry, &value)?;
        Ok(Wait { within: span, until: Some(Until { value, ..until }) })
    }

    pub(super) fn run(&self, bus: &BusArgs, as_json: bool, interrupted: &AtomicBool) -> Result<Outcome, Failure> {
        let mut network = network(bus.open(Pace::Virtual)?.link)?;
        let end = network.now() + self.within;
        loop {
            let seen = match &self.until {
                None => None,
                Some(until) => {
                    let data = network.read_bytes(until.node, until.address)?;
                    let (values, address) = (until.values(), until.address);
                    let value = values.entry(address).and_then(|entry| parse_padded(entry.data_type, &data));
                    let report = ValueReport::of_bytes(Some(&values), address, &data);
                    if value.and_then(|value| compare(&value, &until.value)).is_some_and(until.is) {
                        let object = json!({ "event": "wait", "value": report.text() });
                        print_result(as_json, object, report.equation())?;
                        return Ok(Outcome::Clean);
                    }
                    Some((until, report))
                }
            };
            let now = network.now();
            if now >= end || interrupted.load(Relaxed) {
                return Ok(match seen {
                    Some((until, report)) => {
                        warn(format_args!("not within {}: {}; {}", self.within, until.text, report.equation()));
                        Outcome::Found
                    }
                    None => Outcome::Clean,
                });
            }
            network.wait_for(LOOK.min(end.since(now)), |_| None::<()>)?;
        }
    }
}

impl Until {
    fn values(&self) -> DeviceValues<'_> {
        let mut values = DeviceValues::new(&self.sheet.device);
        self.settings.iter().for_each(|(address, value)| values.set(*address, value));
        values
    }
}

/// The condition that a comparison operator stands for.
fn order(word: &str) -> Option<fn(Ordering) -> bool> {
    Some(match word {
        "=" => Ordering::is_eq,
        "!=" => Ordering::is_ne,
        "<" => Ordering::is_lt,
        "<=" => Ordering::is_le,
        ">" => Ordering::is_gt,
        ">=" => Ordering::is_ge,
        _ => return None,
    })
}

fn compare(one: &Value, other: &Value) -> Option<Ordering> {
    match (one, other) {
        (Value::Integer(one), Value::Integer(other)) => Some(one.cmp(other)),
        (Value::Real(one), Value::Real(other)) => one.partial_cmp(other),
        (Value::Text(one), Value::Text(other)) => Some(one.cmp(other)),
        (Value::Bytes(one), Value::Bytes(other)) => Some(one.cmp(other)),
        _ => None,
    }
}
