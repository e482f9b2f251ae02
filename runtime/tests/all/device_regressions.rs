//! Mistakes that other CANopen stacks were seen to make on the device side, one test each.

use crate::common::{self, NOTHING, Rig};
use lexican_runtime::device::Event;
use lexican_runtime::wire::nmt::NmtState;

#[test]
fn an_empty_segmented_download_to_a_mapping_is_aborted_and_no_panic() {
    let mut rig = Rig::full();
    assert_eq!(rig.send("605#20001A0000000000"), ["585#60001A0000000000"]);
    let answer = rig.send("605#0F00000000000000").concat();
    assert!(answer.starts_with("585#80001A00"), "{answer}");
    assert_eq!(rig.read(0x1A00, 0), Ok(1));
}

#[test]
fn sync_and_an_sdo_answer_at_the_same_time_do_not_lose_each_other() {
    let mut rig = Rig::with("1800:02 u8 rw - 1").operational();
    rig.device.handle_frame(rig.now, &common::frame("605#4000100000000000"), &mut rig.od);
    rig.device.handle_frame(rig.now, &common::frame("080#"), &mut rig.od);
    assert_eq!(rig.sent(), ["185#3412", "585#4300100092010000"], "and the more important one goes first");
}

#[test]
fn bit_30_of_a_pdo_is_kept_as_it_is_written() {
    let mut rig = Rig::full();
    rig.write(0x1800, 1, 4, 0xC000_0185).unwrap();
    assert_eq!(rig.read(0x1800, 1), Ok(0xC000_0185));
    rig.write(0x1800, 1, 4, 0x4000_0185).unwrap();
    assert_eq!(rig.read(0x1800, 1), Ok(0x4000_0185));
}

#[test]
fn a_node_lost_by_the_consumer_is_noticed_once_and_again_when_it_is_lost_again() {
    let mut rig = Rig::full();
    rig.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    for _ in 0..2 {
        rig.send("710#05");
        rig.take_events();
        rig.pass_ms(1000);
        assert_eq!(rig.take_events().len(), 1);
    }
}

#[test]
fn guarding_goes_on_after_a_reset_with_a_toggle_bit_of_0() {
    let mut rig = Rig::full();
    assert_eq!(rig.send("705#R1"), ["705#7F"]);
    rig.send("000#8205");
    rig.restart();
    rig.sent();
    assert_eq!(rig.send("705#R1"), ["705#7F"]);
}

#[test]
fn leaving_stopped_does_not_bring_back_what_was_due_in_it() {
    let mut rig = Rig::with("1800:02 u8 rw - 254\n1800:05 u16 rw - 10").operational();
    rig.send("000#0205");
    assert_eq!(rig.pass_ms(100), NOTHING);
    rig.take_events();
    assert_eq!(rig.send("000#8005"), NOTHING);
    assert_eq!(rig.take_events(), [Event::StateChanged(NmtState::PreOperational)]);
}
