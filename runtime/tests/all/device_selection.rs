//! A device whose type leaves services out: it behaves like a device that never had them.

use crate::common::testing::TestOd;
use crate::common::{FULL, NODE, NOTHING};
use lexican_runtime::device::{Behaves, Behaviour, Cia301, Device, Event, Everything, Selection, With, Without};
use lexican_runtime::{AbortCode, CobId, Frame, Instant};

#[derive(Clone, Copy, Debug)]
struct Least;

impl Selection for Least {
    type Blocks = Without;
    type Guarding = Without;
    type Time = Without;
    type Behaviour = Cia301;
}

/// A device with all services, and a behaviour that is a constant.
#[derive(Clone, Copy, Debug, Default)]
struct Lenient;

impl Selection for Lenient {
    type Blocks = With;
    type Guarding = With;
    type Time = With;
    type Behaviour = Lenient;
}

impl Behaves for Lenient {
    fn behaviour(&self) -> &Behaviour {
        const { &Behaviour { empty_history_is_zero: true, ..Behaviour::CIA_301 } }
    }
}

/// A device whose dictionary asks for every service.
fn device<S: Selection>() -> (Device<3, 3, 1, 3, 8, S>, TestOd) {
    let mut od = TestOd::new(FULL).with("100C:00 u16 rw - 100\n100D:00 u8 rw - 3");
    let mut device = Device::new(NODE, S::Behaviour::default());
    device.restart(Instant::ZERO, &mut od);
    (device, od)
}

/// The entries that ask for services which the device does not have.
fn misconfigured<S: Selection>() -> Vec<String> {
    let (device, mut od) = device::<S>();
    device.misconfigured(&mut od).map(|fault| fault.to_string()).collect()
}

/// The device's answers to a frame, and the event that it reports.
fn answers<S: Selection>(frame: &Frame) -> (Vec<String>, Option<Event>) {
    let (mut device, mut od) = device::<S>();
    let now = Instant::ZERO;
    assert_eq!(device.poll_transmit(now, &mut od).map(|frame| frame.to_string()).as_deref(), Some("705#00"));
    let event = device.handle_frame(now, frame, &mut od);
    let sent = core::iter::from_fn(|| device.poll_transmit(now, &mut od)).map(|frame| frame.to_string());
    (sent.collect(), event)
}

#[track_caller]
fn check(id: u16, data: Option<[u8; 8]>, with: &[&str], without: &[&str]) {
    let id = CobId::standard(id).unwrap();
    let frame = data.map_or_else(|| Frame::remote(id, 1).unwrap(), |data| Frame::from_array(id, data));
    assert_eq!(answers::<Everything>(&frame).0, with, "with");
    assert_eq!(answers::<Least>(&frame).0, without, "without");
}

#[test]
fn a_service_that_is_left_out_does_not_answer() {
    // A block read of 1008h, and a block write of 1017h.
    let refused = "585#8008100001000405";
    check(0x605, Some([0xA4, 0x08, 0x10, 0, 127, 0, 0, 0]), &["585#C60810000B000000"], &[refused]);
    let refused = "585#8017100001000405";
    check(0x605, Some([0xC6, 0x17, 0x10, 0, 2, 0, 0, 0]), &["585#A41710007F000000"], &[refused]);
    // Guarding.
    check(0x705, None, &["705#7F"], &NOTHING);
    // The other services stay the same.
    let read = Some([0x40, 0x17, 0x10, 0, 0, 0, 0, 0]);
    check(0x605, read, &["585#4B17100000000000"], &["585#4B17100000000000"]);
}

#[test]
fn what_asks_for_a_service_that_is_left_out_is_refused() {
    // Guard time and life time factor: switched on, and switched off.
    for (index, [on, off]) in [
        (0x0C, [[0x2B, 0x0C, 0x10, 0, 50, 0, 0, 0], [0x2B, 0x0C, 0x10, 0, 0, 0, 0, 0]]),
        (0x0D, [[0x2F, 0x0D, 0x10, 0, 2, 0, 0, 0], [0x2F, 0x0D, 0x10, 0, 0, 0, 0, 0]]),
    ] {
        let [taken, refused] = ["60", "80"].map(|command| format!("585#{command}{index:02X}1000"));
        let [taken, refused] = [taken + "00000000", refused + "47000406"];
        check(0x605, Some(on), &[&taken], &[&refused]);
        check(0x605, Some(off), &[&taken], &[&taken]);
    }
    // TIME: the present value can be written back, and TIME can be switched off; nothing else is accepted.
    let taken = "585#6012100000000000";
    for off_or_present in [0x00, 0x80] {
        check(0x605, Some([0x23, 0x12, 0x10, 0, 0, 1, 0, off_or_present]), &[taken], &[taken]);
    }
    let other = [0x23, 0x12, 0x10, 0, 1, 1, 0, 0x80];
    check(0x605, Some(other), &["585#8012100030000906"], &["585#8012100047000406"]);
    assert_eq!(misconfigured::<Everything>(), NOTHING);
    let reason = AbortCode::DEVICE_INCOMPATIBLE;
    assert_eq!(misconfigured::<Least>(), ["100C:00", "100D:00", "1012:00"].map(|at| format!("{at}: {reason}")));
}

#[test]
fn time_that_is_left_out_is_no_event() {
    let time = Frame::from_array(CobId::TIME, [1, 0, 0, 0, 2, 0]);
    assert!(matches!(answers::<Everything>(&time).1, Some(Event::Time(_))));
    assert_eq!(answers::<Least>(&time).1, None);
}

#[test]
fn a_behaviour_may_be_a_constant() {
    let history = Frame::from_array(CobId::standard(0x605).unwrap(), [0x40, 0x03, 0x10, 1, 0, 0, 0, 0]);
    assert_eq!(answers::<Everything>(&history).0, ["585#8003100124000008"]);
    assert_eq!(answers::<Lenient>(&history).0, ["585#4303100100000000"]);
    let (device, _) = device::<Lenient>();
    assert!(device.behaviour().empty_history_is_zero);
    assert!(size_of::<Device<3, 3, 1, 3, 8, Lenient>>() < size_of::<Device<3, 3, 1, 3, 8>>());
}

#[test]
fn what_is_left_out_takes_no_room() {
    let [all, least] = [size_of::<Device<3, 3, 1, 3, 8>>(), size_of::<Device<3, 3, 1, 3, 8, Least>>()];
    assert!(least + 50 <= all, "{least} of {all} bytes");
}
