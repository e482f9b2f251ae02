//! An operation is cancelled from elsewhere: the drive then stands, and the operation reports it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lexican_runtime::Duration;
use lexican_runtime::host::VirtualLink;
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{CancelHandle, Drive, Error, Mode};
use siko_ag03_1::sim::inputs::BusState;
use siko_ag03_1::state::State;

use super::rig::{NODE, Rig};

type Operation = fn(&mut Drive<VirtualLink>) -> Result<(), Error>;

/// Cancels after this many frames.
fn cancel_after(rig: &Rig, handle: CancelHandle, frames: u64) {
    let left = AtomicU64::new(frames);
    rig.bus.observe(move |_, _| {
        if left.fetch_sub(1, Ordering::Relaxed) == 1 {
            handle.cancel();
        }
    });
}

fn frames(mode: Mode, operation: Operation) -> u64 {
    let mut rig = enabled(mode);
    let count = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&count);
    rig.bus.observe(move |_, _| {
        counter.fetch_add(1, Ordering::Relaxed);
    });
    operation(&mut rig.drive).unwrap();
    count.load(Ordering::Relaxed)
}

fn enabled(mode: Mode) -> Rig {
    let mut rig = Rig::new();
    rig.drive.set_mode(mode).unwrap();
    rig.drive.enable().unwrap();
    rig
}

#[test]
fn an_operation_that_is_cancelled_at_any_frame_leaves_the_drive_standing() {
    let operations: [(Mode, Operation); 4] = [
        (Mode::Positioning, |drive| drive.move_to(300).map(drop)),
        (Mode::Positioning, |drive| drive.step().map(drop)),
        (Mode::Positioning, |drive| {
            drive.inch(Direction::Negative)?;
            drive.pass(Duration::from_millis(500))
        }),
        (Mode::Velocity, |drive| {
            drive.run_at(60)?;
            drive.pass(Duration::from_millis(500))
        }),
    ];
    for (mode, operation) in operations {
        for at in 1..frames(mode, operation) {
            let mut rig = enabled(mode);
            cancel_after(&rig, rig.drive.cancel_handle(), at);
            let ended = operation(&mut rig.drive);
            assert!(matches!(ended, Err(Error::Cancelled { node: NODE, .. })), "{mode} at frame {at}: {ended:?}");
            assert_eq!(rig.velocity(), 0, "{mode} at frame {at}");
            // Only the operation has ended, not the driver.
            let state = rig.drive.state().unwrap();
            assert!(
                [State::OperationEnabled, State::QuickStopActive].contains(&state),
                "{mode} at frame {at}: {state}"
            );
            rig.pass_ms(1000);
            assert_eq!(rig.velocity(), 0, "{mode} after frame {at}");
        }
    }
}

#[test]
fn what_is_cancelled_says_what_the_drive_does() {
    let mut rig = Rig::enabled();
    let handle = rig.drive.cancel_handle();
    handle.cancel();
    let error = rig.drive.move_to(5000).unwrap_err();
    assert_eq!(error.to_string(), "cancelled: the drive at node 5 was not moving");
    rig.drive.start_moving_to(5000).unwrap();
    rig.pass_ms(500);
    handle.clone().cancel();
    let error = rig.drive.finish().unwrap_err();
    assert_eq!(error.to_string(), "cancelled: the drive at node 5 has been stopped");
    assert_eq!(rig.velocity(), 0);
}

#[test]
fn a_drive_that_cannot_be_stopped_is_not_called_stopped() {
    let mut rig = Rig::running();
    rig.drive.run_at(60).unwrap();
    rig.world(|inputs| inputs.bus = BusState::Passive);
    rig.drive.cancel_handle().cancel();
    let error = rig.drive.pass(Duration::from_secs(1)).unwrap_err();
    assert!(error.to_string().ends_with("; the drive at node 5 may still be moving"), "{error}");
}
