//! Random orders: nothing panics, nothing moves without torque, and the position never jumps.

use lexican_runtime::profile::cia402::State;
use proptest::prelude::*;

use crate::support::Rig;

#[derive(Clone, Debug)]
enum Order {
    Control(u16),
    Mode(i8),
    Target(i32),
    Velocity(i32),
    Torque(i16),
    Method(i8),
    SetPoint(i32),
    Option(u16, i16),
    Parameter(u16, u32),
    Blocked(bool),
    Supply(bool),
    Enable(bool),
    Fault(Option<u16>),
    Limits(i32, i32),
    Sync,
    Lost,
    Restart,
    Pass(u64),
}

fn orders() -> impl Strategy<Value = Order> {
    let words = prop_oneof![
        5 => Just(0x0F), 3 => Just(0x1F), 2 => Just(0x3F), 1 => Just(0x23F), 1 => Just(0x5F), 1 => Just(0x06), 1 => Just(0x07),
        1 => Just(0x02), 1 => Just(0x00), 1 => Just(0x80), 1 => Just(0x10F), 1 => any::<u16>(),
    ];
    prop_oneof![
        8 => words.prop_map(Order::Control),
        2 => prop::sample::select(vec![1_i8, 3, 4, 6, 7, 8, 9, 10, 0, -3]).prop_map(Order::Mode),
        2 => (-3000..3000).prop_map(Order::Target),
        1 => (-2000..2000).prop_map(Order::Velocity),
        1 => (-200_i16..200).prop_map(Order::Torque),
        1 => (0_i8..38).prop_map(Order::Method),
        1 => (-50..50).prop_map(Order::SetPoint),
        1 => (0x605A_u16..0x605F, 0_i16..9).prop_map(|(index, option)| Order::Option(index, option)),
        1 => (prop::sample::select(vec![0x6081_u16, 0x6083, 0x6084, 0x6085, 0x609A]), 0_u32..20_000)
            .prop_map(|(index, value)| Order::Parameter(index, value)),
        1 => any::<bool>().prop_map(Order::Blocked),
        1 => any::<bool>().prop_map(Order::Supply),
        1 => any::<bool>().prop_map(Order::Enable),
        1 => prop::option::of(Just(0x4310)).prop_map(Order::Fault),
        1 => (-2000..0, 0..2000).prop_map(|(low, high)| Order::Limits(low, high)),
        2 => Just(Order::Sync),
        1 => Just(Order::Lost),
        1 => Just(Order::Restart),
        8 => (1_u64..400).prop_map(Order::Pass),
    ]
}

fn apply(rig: &mut Rig, order: &Order) {
    match *order {
        Order::Control(word) => drop_of(rig.control(word)),
        Order::Mode(mode) => drop_of(rig.set(0x6060, 0, mode.into())),
        Order::Target(target) => drop_of(rig.set(0x607A, 0, target.into())),
        Order::Velocity(target) => drop_of(rig.set(0x60FF, 0, target.into())),
        Order::Torque(target) => drop_of(rig.set(0x6071, 0, target.into())),
        Order::Method(method) => drop_of(rig.set(0x6098, 0, method.into())),
        Order::SetPoint(target) => drop_of(rig.set(0x60C1, 1, target.into())),
        Order::Option(index, option) => drop_of(rig.set(index, 0, option.into())),
        Order::Parameter(index, value) => drop_of(rig.set(index, 0, value.into())),
        Order::Blocked(blocked) => drop_of(rig.inputs(|inputs| inputs.blocked = blocked)),
        Order::Supply(supply) => drop_of(rig.inputs(|inputs| inputs.supply = supply)),
        Order::Enable(enable) => drop_of(rig.inputs(|inputs| inputs.enable = enable)),
        Order::Fault(fault) => drop_of(rig.inputs(|inputs| inputs.faults = fault.into())),
        Order::Limits(low, high) => drop_of(rig.inputs(|inputs| {
            inputs.machine.negative_limit = Some(low.into());
            inputs.machine.positive_limit = Some(high.into());
            inputs.machine.home_switch = Some((f64::from(low) / 2.0, f64::from(high) / 2.0));
        })),
        Order::Sync => drop_of(rig.sync()),
        Order::Lost => rig.servo.lose_connection(rig.now, &mut rig.od),
        Order::Restart => {
            rig.servo.restart(rig.now);
            rig.pass(0);
        }
        Order::Pass(ms) => drop_of(rig.pass(ms)),
    }
}

fn drop_of(_: &mut Rig) {}

/// Faster than any order makes the axis: a window of 100 units in a cycle of 2 ms, and 20 % more torque than 200.
const FASTEST: f64 = 60_000.0;

proptest! {
    #[test]
    fn any_orders(orders in prop::collection::vec(orders(), 1..80)) {
        let mut rig = Rig::new();
        for order in &orders {
            let (before, since, state) = (rig.servo.shaft(rig.now), rig.now, rig.servo.state());
            apply(&mut rig, order);
            let after = rig.servo.shaft(rig.now);
            let moved = (after.position - before.position).abs();
            let seconds = rig.now.since(since).as_secs_f64();
            prop_assert!(moved <= FASTEST * seconds + 1e-6, "{order:?}: {before:?} to {after:?}");
            // Without torque, it only coasts.
            let powerless = |state| !matches!(
                state, State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive
            );
            if powerless(state) && powerless(rig.servo.state()) {
                prop_assert!(after.velocity.abs() <= before.velocity.abs() + 1e-6, "{order:?}: {before:?} to {after:?}");
            }
            prop_assert!(after.position.is_finite() && after.velocity.is_finite());
        }
    }
}
