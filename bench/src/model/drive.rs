//! What is known of a drive.

use lexican_driver::{Description, Mode};
use lexican_eds::model::Value;
use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::State;
use lexican_toolbox::drive::Look;
use lexican_toolbox::series;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use super::node::Node;
use crate::command::Order;
use crate::view;

/// A drive, and the order that it carries out.
#[derive(Default)]
pub(crate) struct Drive {
    /// The order under way, in words.
    pub(crate) order: Option<String>,
    /// Where its travel goes.
    pub(crate) target: Option<i32>,
    /// How the last one ended.
    pub(crate) ending: Option<view::Ending>,
    /// Why it would not move now; `None` while nobody has looked.
    pub(crate) obstacles: Option<Vec<String>>,
    /// What the order's sequence has seen last.
    pub(crate) look: Option<Look>,
}

/// The entries from which state, mode, position and velocity are read; a drive without velocity has its position twice.
pub(crate) fn watched(description: &Description) -> [Address; 4] {
    let objects = &description.objects;
    let mode = description.modes.shown.unwrap_or(description.modes.chosen);
    let velocity = objects.actual_velocity.unwrap_or(objects.actual_position);
    [objects.status_word, mode, objects.actual_position, velocity].map(|number| number.address())
}

impl Drive {
    /// What a face shows of it.
    pub(crate) fn view(
        &self,
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
        // While an order is carried out, its sequence reads, and what it has seen is newer.
        let look = self.look.filter(|_| self.order.is_some());
        let number = |address: Address, look: Option<i32>| match look.map(|number| (number, report(address, number))) {
            Some((number, None)) => Some(number.into()),
            Some((_, Some(report))) => series::number(&report),
            None => seen(address).and_then(|value| value.number),
        };
        let unit = |address: Address| Some(values.unit(values.entry(address)?)?.symbol.clone());
        let state = look.and_then(|look| look.state);
        let state = state.or_else(|| State::from_status_word(word(&seen(status)?.raw)?));
        let target = description.objects.target_position.address();
        view::Drive {
            node: id.get(),
            name: node.name(),
            state: state.map(|state| state.to_string()),
            allowed: state.map(allowed).unwrap_or_default().iter().map(State::to_string).collect(),
            mode: seen(mode).map(|value| value.text.clone()),
            position: number(position, look.and_then(|look| look.position)),
            position_unit: unit(position),
            velocity: description
                .objects
                .actual_velocity
                .and_then(|_| number(velocity, look.and_then(|look| look.velocity))),
            velocity_unit: unit(velocity),
            target: self.target.and_then(|number| report(target, number)).and_then(|report| series::number(&report)),
            // It may be moving.
            obstacles: self.obstacles.clone().filter(|_| self.order.is_none()),
            order: self.order.clone(),
            ending: self.ending.clone(),
            orders: orders(description),
            homing_methods: description.homing.map(|homing| homing.methods.to_vec()).unwrap_or_default(),
        }
    }
}

fn word(raw: &str) -> Option<u16> {
    let mut bytes = raw.split(' ').map(|byte| u8::from_str_radix(byte, 16).ok());
    Some(u16::from_le_bytes([bytes.next()??, bytes.next()??]))
}

/// The states that a drive may be ordered to (CiA 402-2, 6.2, figure 2).
fn allowed(state: State) -> &'static [State] {
    match state {
        State::SwitchOnDisabled => &[State::ReadyToSwitchOn],
        State::ReadyToSwitchOn => &[State::SwitchedOn, State::SwitchOnDisabled],
        State::SwitchedOn => &[State::OperationEnabled, State::ReadyToSwitchOn, State::SwitchOnDisabled],
        State::OperationEnabled => {
            &[State::SwitchedOn, State::ReadyToSwitchOn, State::SwitchOnDisabled, State::QuickStopActive]
        }
        State::QuickStopActive => &[State::SwitchOnDisabled, State::OperationEnabled],
        State::Fault => &[State::SwitchOnDisabled],
        _ => &[],
    }
}

/// The orders that a drive knows.
fn orders(description: &Description) -> Vec<Order> {
    let has = |mode| description.code_of(mode).is_some();
    let mut orders = vec![Order::Enable, Order::Disable, Order::ResetFault, Order::Stop, Order::QuickStop];
    if has(Mode::Positioning) {
        orders.extend([Order::MoveTo, Order::Step]);
    }
    if has(Mode::Velocity) {
        orders.push(Order::Run);
    }
    if description.homing.is_some() {
        orders.push(Order::Home);
    }
    orders
}
