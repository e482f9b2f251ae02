//! A firmware without an operating system: the communication of an AG03/1, all of it on the stack.
//!
//! It has its own panic handler. If any crate needed std, which has a panic handler of its own, this one would be
//! refused: so the build proves that none does.
#![no_std]

use core::panic::PanicInfo;

use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::{Instant, NodeId};

use self::board::{Board, CanFrame};

mod board;

mod od {
    lexican_runtime::include_od!("drive");
}

/// The main loop; false if `node` is no node-ID.
// The symbol is where the linker starts. The attribute is unsafe because no other item may have this name; it is the
// only unsafe thing here.
#[unsafe(no_mangle)]
pub extern "C" fn bare_run(board: &Board, node: u8) -> bool {
    let Some(node) = NodeId::new(node) else { return false };
    let mut drive = Drive { device: Device::new(node, Behaviour::CIA_301), od: od::storage(node) };
    drive.device.restart(now(board), &mut drive.od);
    while (board.is_powered)() {
        drive.step(board);
    }
    true
}

struct Drive {
    device: Device<4, 4, 1, 0>,
    od: od::Storage,
}

impl Drive {
    fn step(&mut self, board: &Board) {
        // The boot-up message goes first: the device receives nothing before it is sent.
        while let Some(frame) = self.device.poll_transmit(now(board), &mut self.od) {
            (board.send)(&CanFrame::from_frame(&frame));
        }
        let mut received = CanFrame { id: 0, is_remote: false, len: 0, data: [0; 8] };
        if (board.receive)(&mut received)
            && let Some(frame) = received.to_frame()
        {
            let event = self.device.handle_frame(now(board), &frame, &mut self.od);
            self.follow(board, event);
        }
        if self.device.poll_timeout().is_some_and(|due| due <= now(board)) {
            let event = self.device.handle_timeout(now(board), &mut self.od);
            self.follow(board, event);
        }
    }

    fn follow(&mut self, board: &Board, event: Option<Event>) {
        match event {
            Some(Event::Reset(reset)) => {
                let values = if reset == Reset::Node { 0..=0xFFFF } else { 0x1000..=0x1FFF };
                self.od.reset(self.device.node(), values);
                self.device.restart(now(board), &mut self.od);
            }
            // The drive is always at its target, because its mechanics are not the subject here.
            Some(Event::RpdoReceived { .. } | Event::Written(_)) => {
                let target = self.od.get(od::TARGET_POSITION);
                self.od.set(od::POSITION_ACTUAL_VALUE, target);
                self.device.changed(od::POSITION_ACTUAL_VALUE.address());
            }
            _ => {}
        }
    }
}

fn now(board: &Board) -> Instant {
    Instant::from_micros((board.now_us)())
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
