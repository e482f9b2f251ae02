//! Connecting a servo to its device.

use lexican_runtime::device::{Device, Event};
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::profile::cia402::Mode;
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::{guarding, heartbeat_consumer};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{Duration, Instant};

use super::model::Servo;
use super::objects::*;
use super::power::register_of;
use crate::storage::Storage;

/// How often TPDOs that are sent on change are checked while the axis moves.
const SAMPLING: Duration = Duration::from_millis(10);

/// Makes the servo follow what happened to its device; to be called after each frame and deadline. Before a frame or
/// deadline is handled, [`Servo::measure`] writes the measured values into the dictionary.
///
/// A reset is not followed here: the application calls [`Servo::restart`].
pub fn follow<const R: usize, const T: usize, const S: usize, const M: usize, const N: usize>(
    servo: &mut Servo,
    now: Instant,
    device: &Device<R, T, S, M, N>,
    od: &mut dyn Storage,
    event: Option<Event>,
) {
    match event {
        Some(Event::Sync { .. }) => {
            if device.applied().any(|(number, _)| has_set_point(servo, device, number)) {
                servo.set_point();
            }
            return servo.sync(now, od);
        }
        Some(Event::RpdoReceived { number }) if has_set_point(servo, device, number) => servo.set_point(),
        Some(Event::Written(address)) => {
            servo.note_cycle_entry(address);
            let written = servo.model().written;
            written(servo, now, od, address);
        }
        Some(
            Event::Heartbeat { event: heartbeat_consumer::Event::Lost, .. }
            | Event::LifeGuarding(guarding::Event::Lost),
        ) => servo.lose_manager(now, od),
        Some(Event::StateChanged(NmtState::Stopped) | Event::Reset(Reset::Communication)) => {
            servo.lose_connection(now, od);
        }
        _ => {}
    }
    servo.update(now, od);
}

/// Sends the servo's emergencies, and TPDOs whose contents have changed. `od` is the dictionary that the device works
/// with.
pub fn report<const R: usize, const T: usize, const S: usize, const M: usize, const N: usize>(
    servo: &mut Servo,
    now: Instant,
    device: &mut Device<R, T, S, M, N>,
    od: &mut dyn ObjectDictionary,
) {
    while let Some(emergency) = servo.next_emergency() {
        let (code, register) = (ErrorCode(emergency.code), register_of(emergency.code));
        match emergency.code {
            0 if emergency.remaining.is_empty() => device.clear(ErrorRegister(0xFF), od),
            0 => device.end_error(emergency.remaining, od),
            _ if emergency.recorded => device.emergency(code, register, [0; 5], od),
            _ => device.emergency_unrecorded(code, register, [0; 5], od),
        }
    }
    device.compare(od);
    if servo.sampled.0 != Some(device.generation()) {
        servo.sampled = (Some(device.generation()), sends_measured(device));
    }
    let samples = servo.sampled.1 && device.nmt_state() == NmtState::Operational && servo.is_moving(now);
    let next = (now.as_micros() / SAMPLING.as_micros() + 1) * SAMPLING.as_micros();
    servo.sample = samples.then_some(Instant::from_micros(next));
}

/// Whether an RPDO carries the set-point of the cyclic mode.
fn has_set_point<const R: usize, const T: usize, const S: usize, const M: usize, const N: usize>(
    servo: &Servo,
    device: &Device<R, T, S, M, N>,
    number: u16,
) -> bool {
    let object = match servo.mode() {
        Some(Mode::InterpolatedPosition) => SET_POINT_1,
        Some(mode) if mode.is_cyclic() => Address::new(mode.object(), 0),
        _ => return false,
    };
    device.rpdo(number).is_some_and(|rpdo| rpdo.mapping().maps(object))
}

/// Whether a TPDO with measured values is sent on change.
fn sends_measured<const R: usize, const T: usize, const S: usize, const M: usize, const N: usize>(
    device: &Device<R, T, S, M, N>,
) -> bool {
    use TransmissionType::{EventManufacturer, EventProfile};
    (1..=512).filter_map(|number| device.tpdo(number)).any(|tpdo| {
        let on_change = matches!(tpdo.parameters().transmission, EventManufacturer | EventProfile);
        tpdo.is_active() && on_change && MEASURED[FIRST_MOVING..].iter().any(|object| tpdo.mapping().maps(*object))
    })
}
