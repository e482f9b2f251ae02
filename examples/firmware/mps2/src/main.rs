//! The I/O device on Arm's MPS2 board with AN386, as emulated by QEMU: UART 0 is a serial CAN adapter (slcan), a timer
//! is the clock, and a file on the host is the flash. Outputs are wired to inputs.
#![no_std]
#![no_main]

mod flash;
mod hardware;
mod slcan;

use cortex_m_rt::entry;
use io_device::{Board, Channels, IoDevice, NOTEBOOK};
use panic_semihosting as _;

use flash::HostFile;
use hardware::{Clock, Uart};
use slcan::Slcan;

#[entry]
fn main() -> ! {
    // Interrupts only end the wait below; they have no handlers.
    cortex_m::interrupt::disable();
    let mut clock = Clock::start();
    let mut adapter = Slcan::new(Uart::start());
    let notebook = cortex_m::singleton!(: [u8; NOTEBOOK] = [0; NOTEBOOK]).expect("main runs once");
    let mut device = IoDevice::new(clock.now(), Wires::default(), HostFile::open(), notebook);
    loop {
        while let Some(frame) = device.poll_transmit(clock.now()) {
            adapter.send(&frame);
        }
        if let Some(frame) = adapter.receive() {
            device.handle_frame(clock.now(), &frame);
        } else if device.poll_timeout() <= clock.now() {
            device.handle_timeout(clock.now());
        } else {
            hardware::wait();
        }
    }
}

/// Connects each output to the input of the same number.
#[derive(Default)]
struct Wires(Channels);

impl Board for Wires {
    fn inputs(&mut self) -> Channels {
        self.0
    }

    fn set_outputs(&mut self, outputs: &Channels) {
        self.0 = *outputs;
    }

    fn unused_stack(&mut self) -> u32 {
        hardware::unused_stack()
    }
}
