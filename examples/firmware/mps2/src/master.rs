//! A manager on Arm's MPS2 board: it boots the machine in `machine.toml` and enables its drive by PDOs. The plan is a
//! constant in flash; no file is read and nothing is allocated.
#![no_std]
#![no_main]

mod hardware;
mod machine;
mod slcan;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use lexican_runtime::manager::{Event, MachinePdo as _, Manager, Network, NetworkEvent};
use lexican_runtime::profile::cia402::{Cause, State, Transitions};
use panic_semihosting as _;

use hardware::{Clock, Uart};
use machine::{PLAN, feeder};
use slcan::Slcan;

const NODES: usize = PLAN.nodes.len();

#[entry]
fn main() -> ! {
    // Interrupts only end the wait below; they have no handlers.
    cortex_m::interrupt::disable();
    let mut clock = Clock::start();
    let mut adapter = Slcan::new(Uart::start());
    // Wait until a node is heard: before that, there is no bus.
    while adapter.receive().is_none() {
        hardware::wait();
    }
    let mut manager = Manager::<NODES>::new();
    PLAN.prepare(clock.now(), &mut manager).expect("there is room for all nodes");
    let mut network: Network<&[u8], NODES> = PLAN.network().expect("there is room for all nodes");
    network.start(clock.now(), PLAN.boot_time);
    loop {
        let now = clock.now();
        while let Some(frame) = network.poll_transmit(now).or_else(|| manager.poll_transmit(now, &mut [0; 0])) {
            adapter.send(&frame);
        }
        if let Some(frame) = adapter.receive() {
            report(network.handle_frame(now, &frame));
            if let Some(Event::Pdo { frame, .. }) = manager.handle_frame(now, &frame, &mut [0; 0])
                && let Some(pdo) = feeder::Tpdo1::received(&frame)
                && network.is_ready()
            {
                enable(&mut manager, pdo.statusword);
            }
        } else if network.poll_timeout().is_some_and(|deadline| deadline <= now) {
            report(network.handle_timeout(now));
        } else if manager.poll_timeout().is_some_and(|deadline| deadline <= now) {
            manager.handle_timeout(now);
        } else {
            hardware::wait();
        }
    }
}

/// Commands the next step towards OPERATION ENABLED; ends the program there.
fn enable(manager: &mut Manager<NODES>, statusword: feeder::Statusword) {
    let Some(state) = State::from_status_word(statusword.0) else { return };
    if state == State::OperationEnabled {
        hprintln!("feeder is enabled, {} bytes of stack unused", hardware::unused_stack());
        debug::exit(debug::EXIT_SUCCESS);
    }
    let step = Transitions::CIA_402.next(state, State::OperationEnabled);
    if let Some(Cause::Command(command)) = step.map(|step| step.cause) {
        let pdo = feeder::Rpdo1 { controlword: feeder::Controlword(command.apply(0)) };
        // If there is no room now, the next statusword repeats the command.
        let _ = manager.send(pdo.to_frame());
    }
}

fn report(event: Option<NetworkEvent>) {
    match event {
        Some(NetworkEvent::Booted(node)) => hprintln!("node {} has booted", node),
        Some(NetworkEvent::Failed { node, error, .. }) => hprintln!("node {} has not booted: {}", node, error),
        _ => {}
    }
}
