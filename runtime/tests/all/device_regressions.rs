//! What other CANopen stacks were seen to do wrong on the device side, one test each.

use crate::common::{self, Bench, NOTHING};
use lexican_runtime::AbortCode;
use lexican_runtime::device::Event;
use lexican_runtime::wire::nmt::NmtState;

#[test]
fn an_empty_segmented_download_to_a_mapping_is_aborted_and_no_panic() {
    let mut bench = Bench::full();
    assert_eq!(bench.send("605#20001A0000000000"), ["585#60001A0000000000"]);
    let answer = bench.send("605#0F00000000000000").concat();
    assert!(answer.starts_with("585#80001A00"), "{answer}");
    assert_eq!(bench.read(0x1A00, 0), Ok(1));
}

#[test]
fn a_missing_sub_index_is_not_called_a_missing_object() {
    let mut bench = Bench::full();
    assert_eq!(bench.read(0x1018, 9), Err(AbortCode::NO_SUCH_SUB_INDEX.0));
    assert_eq!(bench.read(0x1009, 0), Err(AbortCode::NO_SUCH_OBJECT.0));
}

#[test]
fn an_sdo_request_of_less_than_eight_bytes_is_ignored() {
    let mut bench = Bench::full();
    for request in ["605#", "605#40", "605#40001000", "605#40001000000000", "605#R8"] {
        assert_eq!(bench.send(request), NOTHING, "{request}");
    }
}

#[test]
fn an_unknown_command_is_aborted_and_not_ignored() {
    let mut bench = Bench::full();
    assert_eq!(bench.send("605#E000100000000000"), ["585#8000100001000405"]);
}

#[test]
fn a_segmented_download_without_size_is_taken() {
    let mut bench = Bench::full();
    assert_eq!(bench.send("605#2017100000000000"), ["585#6017100000000000"]);
    assert_eq!(bench.send("605#0B64000000000000")[0], "585#2000000000000000");
    assert_eq!(bench.read(0x1017, 0), Ok(100));
}

#[test]
fn sync_and_an_sdo_answer_at_the_same_time_do_not_lose_each_other() {
    let mut bench = Bench::with("1800:02 u8 rw - 1").operational();
    bench.device.handle_frame(bench.now, &common::frame("605#4000100000000000"), &mut bench.od);
    bench.device.handle_frame(bench.now, &common::frame("080#"), &mut bench.od);
    assert_eq!(bench.sent(), ["185#3412", "585#4300100092010000"], "and the more important one goes first");
}

#[test]
fn bit_30_of_a_pdo_is_kept_as_it_is_written() {
    let mut bench = Bench::full();
    bench.write(0x1800, 1, 4, 0xC000_0185).unwrap();
    assert_eq!(bench.read(0x1800, 1), Ok(0xC000_0185));
    bench.write(0x1800, 1, 4, 0x4000_0185).unwrap();
    assert_eq!(bench.read(0x1800, 1), Ok(0x4000_0185));
}

#[test]
fn a_node_lost_by_the_consumer_is_noticed_once_and_again_when_it_is_lost_again() {
    let mut bench = Bench::full();
    bench.write(0x1016, 1, 4, 0x0010_0064).unwrap();
    for _ in 0..2 {
        bench.send("710#05");
        bench.take_events();
        bench.pass_ms(1000);
        assert_eq!(bench.take_events().len(), 1);
    }
}

#[test]
fn guarding_goes_on_after_a_reset_with_a_toggle_bit_of_0() {
    let mut bench = Bench::full();
    assert_eq!(bench.send("705#R1"), ["705#7F"]);
    bench.send("000#8205");
    bench.restart();
    bench.sent();
    assert_eq!(bench.send("705#R1"), ["705#7F"]);
}

#[test]
fn leaving_stopped_does_not_bring_back_what_was_due_in_it() {
    let mut bench = Bench::with("1800:02 u8 rw - 254\n1800:05 u16 rw - 10").operational();
    bench.send("000#0205");
    assert_eq!(bench.pass_ms(100), NOTHING);
    bench.take_events();
    assert_eq!(bench.send("000#8005"), NOTHING);
    assert_eq!(bench.take_events(), [Event::StateChanged(NmtState::PreOperational)]);
}
