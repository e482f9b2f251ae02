//! The model of a drive.

use lexican_driver::Description;
use lexican_eds::model::Value;
use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::{Cause, State};
use lexican_runtime::{Duration, Instant, Measured, NodeId};
use lexican_toolbox::drive::Look;
use lexican_toolbox::trace::series;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use super::age::shown;
use super::node::Node;
use super::standstill::Standstill;
use crate::orders::ORDERS;
use crate::view;

/// A drive with its current order.
#[derive(Default)]
pub(crate) struct Drive {
    /// The current order, as text.
    pub(crate) order: Option<String>,
    /// The target of the current motion.
    pub(crate) target: Option<i32>,
    /// How the last order ended.
    pub(crate) ending: Option<view::Ending>,
    /// Whether a standstill is wanted and not confirmed.
    pub(crate) standstill: Standstill,
    /// What would prevent it from moving now; `None` if not checked yet.
    pub(crate) obstacles: Option<Vec<String>>,
    /// Settings that affect moving it; empty if not checked yet.
    pub(crate) lacks: Vec<view::Lack>,
    /// What the current order has seen last.
    pub(crate) look: Option<Measured<Look>>,
}

/// The entries for state, mode, position and velocity; a drive without velocity has its position twice.
pub(crate) fn watched(description: &Description) -> [Address; 4] {
    let objects = &description.objects;
    let mode = description.modes.shown.unwrap_or(description.modes.chosen);
    let velocity = objects.actual_velocity.unwrap_or(objects.actual_position);
    [objects.status_word, mode, objects.actual_position, velocity].map(|number| number.address())
}

impl Drive {
    /// The drive in the view. State, position and velocity are old after `limit`.
    pub(crate) fn view(
        &self,
        now: Instant,
        limit: Duration,
        id: NodeId,
        node: &Node,
        values: &DeviceValues<'_>,
        description: &Description,
    ) -> view::Drive {
        let [status, mode, position, velocity] = watched(description);
        let seen = |address: Address| node.values.get(&address);
        let report = |address: Address, number: i32| {
            let entry = values.entry(address)?;
            Some(ValueReport::of_value(values, entry, Value::Integer(number.into())))
        };
        // During an order, the order reads them as well.
        let look = self.look.filter(|_| self.order.is_some());
        let number = |address: Address, looked: Option<i32>| {
            let known = seen(address).and_then(|seen| Some(Measured::new(seen.value.number?, seen.at)));
            let looked = look.zip(looked).and_then(|(look, number)| {
                let number = report(address, number).map_or(Some(number.into()), |report| series::number(&report));
                Some(Measured::new(number?, look.at))
            });
            newer(known, looked).map(|number| number.map(tidy))
        };
        let unit = |address: Address| Some(values.unit(values.entry(address)?)?.symbol.clone());
        let known = seen(status)
            .and_then(|seen| Some(Measured::new(State::from_status_word(word(&seen.value.raw)?)?, seen.at)));
        let state = newer(known, look.and_then(|look| Some(Measured::new(look.value.state?, look.at))));
        let at = number(position, look.and_then(|look| look.value.position));
        let speed = number(velocity, look.and_then(|look| look.value.velocity));
        let times = [state.map(|it| it.at), at.map(|it| it.at), speed.map(|it| it.at)];
        let oldest = times.into_iter().flatten().min().map(|at| Measured::new((), at));
        let state = state.map(|state| state.value);
        let target = description.objects.target_position.address();
        view::Drive {
            node: id.get(),
            name: node.name(),
            state: state.map(|state| state.to_string()),
            allowed: state.map(|state| allowed(description, state)).unwrap_or_default(),
            seen: oldest.map(|seen| shown(&seen, now, limit)),
            mode: seen(mode).map(|seen| seen.value.text.clone()),
            position: at.map(|at| at.value),
            position_unit: unit(position),
            velocity: description.objects.actual_velocity.and(speed).map(|speed| speed.value),
            velocity_unit: unit(velocity),
            target: self
                .target
                .and_then(|number| report(target, number))
                .and_then(|report| series::number(&report))
                .map(tidy),
            // During an order, the drive may be moving, and obstacles mean nothing.
            obstacles: self.obstacles.clone().filter(|_| self.order.is_none()),
            order: self.order.clone(),
            ending: self.ending.clone(),
            unconfirmed: None,
            orders: ORDERS.iter().filter(|row| row.is_for(description)).map(|row| row.verb).collect(),
            homing_methods: description.homing.map(|homing| homing.methods.to_vec()).unwrap_or_default(),
        }
    }
}

/// Removes rounding noise of the scaling: 471.1 instead of 471.1000000000001.
fn tidy(number: f64) -> f64 {
    format!("{number:.9}").parse().unwrap_or(number)
}

/// The later measurement.
fn newer<T>(one: Option<Measured<T>>, other: Option<Measured<T>>) -> Option<Measured<T>> {
    match (one, other) {
        (Some(one), Some(other)) => Some(if other.at >= one.at { other } else { one }),
        (one, other) => one.or(other),
    }
}

fn word(raw: &str) -> Option<u16> {
    let mut bytes = raw.split(' ').map(|byte| u8::from_str_radix(byte, 16).ok());
    Some(u16::from_le_bytes([bytes.next()??, bytes.next()??]))
}

/// The states to which the drive may be ordered.
fn allowed(description: &Description, from: State) -> Vec<String> {
    let arrows = description.transitions.0.iter().filter(|arrow| arrow.from == from && arrow.cause != Cause::Internal);
    let mut states: Vec<_> = arrows.map(|arrow| arrow.to.to_string()).collect();
    // Several commands may lead to the same state.
    states.dedup();
    states
}
