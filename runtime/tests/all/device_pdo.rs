//! PDOs of a device: every transmission type in both directions, and what may be configured when.

use crate::common::testing::TestOd;
use crate::common::{self, FULL, NOTHING, Rig};
use lexican_runtime::AbortCode;
use lexican_runtime::device::{Behaviour, ChangeRule, Event};
use lexican_runtime::object::Address;
use lexican_runtime::service::rpdo;
use lexican_runtime::service::tpdo::Triggers;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};

/// A device in OPERATIONAL with changed entries in its dictionary.
fn operational(changes: &str) -> Rig {
    Rig::with(changes).operational()
}

#[test]
fn type_0_is_sent_with_the_sync_after_an_event() {
    let mut rig = operational("1800:02 u8 rw - 0");
    assert_eq!(rig.send("080#"), ["185#3412"], "entering OPERATIONAL is an event");
    assert_eq!(rig.send("080#"), NOTHING);
    rig.od.set(0x6041, 0, 0x5678);
    rig.device.changed(Address::new(0x6041, 0));
    assert_eq!(rig.sent(), NOTHING);
    assert_eq!(rig.send("080#"), ["185#7856"]);
    assert_eq!(rig.send("080#"), NOTHING);
    rig.device.request_tpdo(1);
    assert_eq!(rig.send("080#"), ["185#7856"]);
}

#[test]
fn type_0_is_sent_at_every_sync_by_devices_that_do_so() {
    let behaviour = Behaviour { type_0_at_every_sync: true, ..Behaviour::CIA_301 };
    let mut rig = Rig::new(TestOd::new(FULL).with("1800:02 u8 rw - 0"), behaviour).operational();
    for _ in 0..3 {
        assert_eq!(rig.send("080#"), ["185#3412"]);
    }
}

#[test]
fn type_n_is_sent_with_every_nth_sync_and_sampled_there() {
    let mut rig = operational("1800:02 u8 rw - 3");
    for _ in 0..2 {
        assert_eq!(rig.send("080#"), NOTHING);
        assert_eq!(rig.send("080#"), NOTHING);
        assert_eq!(rig.send("080#"), ["185#3412"]);
    }
    // The value is the one at SYNC, not the one at transmission.
    let mut rig = operational("1800:02 u8 rw - 1");
    rig.device.handle_frame(rig.now, &common::frame("080#"), &mut rig.od);
    rig.od.set(0x6041, 0, 0xFFFF);
    assert_eq!(rig.sent(), ["185#3412"]);
}

#[test]
fn a_sync_start_value_means_nothing_to_a_sync_without_counter() {
    let mut rig = Rig::full();
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    rig.write(0x1800, 2, 1, 2).unwrap();
    rig.write(0x1800, 6, 1, 5).unwrap();
    rig.write(0x1800, 1, 4, 0x185).unwrap();
    let mut rig = rig.operational();
    assert_eq!([(); 4].map(|()| rig.send("080#").len()), [1, 0, 1, 0]);
}

#[test]
fn the_sync_start_value_is_waited_for() {
    let mut rig = operational("1800:02 u8 rw - 2\n1800:06 u8 rw - 3\n1019:00 u8 rw - 10");
    let sent: Vec<bool> = (1..=8).map(|counter| !rig.send(&format!("080#{counter:02X}")).is_empty()).collect();
    assert_eq!(sent, [false, false, true, false, true, false, true, false]);
}

#[test]
fn type_252_is_sampled_at_sync_and_sent_on_request() {
    let mut rig = operational("1802:02 u8 rw - 252");
    assert_eq!(rig.send("385#R6"), NOTHING, "nothing was sampled yet");
    assert_eq!(rig.send("080#"), NOTHING);
    rig.od.set(0x6041, 0, 0xFFFF);
    assert_eq!(rig.send("385#R6"), ["385#3412FEFFFFFF"]);
    rig.send("080#");
    assert_eq!(rig.send("385#R6"), ["385#FFFFFEFFFFFF"]);
}

#[test]
fn type_253_is_sampled_and_sent_on_request_unless_bit_30_forbids() {
    let mut rig = operational("");
    assert_eq!(rig.send("080#"), NOTHING);
    rig.device.changed(Address::new(0x6064, 0));
    assert_eq!(rig.sent(), NOTHING);
    assert_eq!(rig.send("385#R6"), ["385#3412FEFFFFFF"]);
    rig.write(0x1802, 1, 4, 0xC000_0385).unwrap();
    rig.write(0x1802, 1, 4, 0x4000_0385).unwrap();
    assert_eq!(rig.send("385#R6"), NOTHING);
    let behaviour = Behaviour { pdo_bit_30: false, ..Behaviour::CIA_301 };
    let od = TestOd::new(FULL).with("1802:01 u32 rw - 0x40000385");
    assert_eq!(Rig::new(od, behaviour).operational().send("385#R6"), ["385#3412FEFFFFFF"]);
}

#[test]
fn events_and_the_event_timer_send_types_254_and_255_not_within_the_inhibit_time() {
    for code in [254, 255] {
        let mut rig = operational(&format!("1800:02 u8 rw - {code}\n1800:03 u16 rw - 100\n1800:05 u16 rw - 50"));
        // The inhibit time of 10 ms began with entering OPERATIONAL.
        rig.device.changed(Address::new(0x6041, 0));
        assert_eq!(rig.sent(), NOTHING);
        assert_eq!(rig.pass_ms(120), ["10000 185#3412", "60000 185#3412", "110000 185#3412"]);
        rig.device.changed(Address::new(0x6064, 0));
        assert_eq!(rig.sent(), NOTHING, "the object is not mapped");
        assert_eq!(rig.send("080#"), NOTHING);
    }
}

#[test]
fn what_counts_as_an_event_is_data_of_the_device() {
    let behaviour = Behaviour { triggers_255: Triggers { timer: true, ..Triggers::NONE }, ..Behaviour::CIA_301 };
    let od = TestOd::new(FULL).with("1800:05 u16 rw - 50\n1800:03 u16 rw - 1000");
    let mut rig = Rig::new(od, behaviour);
    assert_eq!(rig.send("000#0105"), NOTHING);
    rig.device.changed(Address::new(0x6041, 0));
    assert_eq!(rig.pass_ms(100), ["50000 185#3412", "100000 185#3412"]);
}

#[test]
fn compare_finds_what_changed() {
    let mut rig = operational("");
    rig.device.compare(&mut rig.od);
    assert_eq!(rig.sent(), NOTHING);
    rig.od.set(0x6041, 0, 0x5678);
    rig.device.compare(&mut rig.od);
    assert_eq!(rig.sent(), ["185#7856"]);
}

#[test]
fn asynchronous_rpdos_take_effect_at_once() {
    let mut rig = operational("");
    rig.send("405#1F0088130000");
    assert_eq!((rig.od.get(0x6040, 0), rig.od.get(0x607A, 0)), (0x1F, 5000));
    assert_eq!(rig.take_events(), [Event::RpdoReceived { number: 3 }]);
}

#[test]
fn synchronous_rpdos_take_effect_with_sync_and_only_the_last_one() {
    for code in [0, 1, 240] {
        let mut rig = operational(&format!("1402:02 u8 rw - {code}"));
        rig.send("405#1F0001000000");
        rig.send("405#1F0088130000");
        assert_eq!((rig.od.get(0x607A, 0), rig.take_events()), (0, vec![]));
        rig.send("080#");
        assert_eq!(rig.od.get(0x607A, 0), 5000);
        assert_eq!(rig.take_events(), [Event::Sync { counter: None }]);
        assert_eq!(rig.device.applied().collect::<Vec<_>>(), [(3, rpdo::Event::Received)]);
        rig.od.set(0x607A, 0, 7);
        rig.send("080#");
        assert_eq!(rig.od.get(0x607A, 0), 7, "it is applied once");
    }
}

#[test]
fn a_waiting_rpdo_is_forgotten_when_the_device_leaves_operational() {
    let mut rig = operational("1402:02 u8 rw - 1");
    rig.send("405#1F0088130000");
    rig.send("000#8005");
    rig.send("000#0105");
    rig.send("080#");
    assert_eq!(rig.od.get(0x607A, 0), 0);
}

#[test]
fn a_waiting_rpdo_takes_effect_also_after_its_parameters_were_written() {
    let mut rig = operational("1402:02 u8 rw - 1");
    rig.send("405#1F0088130000");
    rig.write(0x1402, 5, 2, 100).unwrap();
    rig.write(0x1402, 2, 1, 2).unwrap();
    rig.send("080#");
    assert_eq!(rig.od.get(0x607A, 0), 5000);
    // Data of a PDO that no longer waits for SYNC, or has become another PDO, are discarded.
    for (sub, size, value) in [(2, 1, 255), (1, 4, 0x8000_0405)] {
        rig.send("405#1F0089130000");
        rig.write(0x1402, sub, size, value).unwrap();
        rig.write(0x1402, 2, 1, 1).unwrap();
        rig.write(0x1402, 1, 4, 0x405).unwrap();
        rig.send("080#");
        assert_eq!(rig.od.get(0x607A, 0), 5000, "1402:{sub:02X}");
    }
}

#[test]
fn a_short_rpdo_is_ignored_and_a_long_one_is_processed_both_with_an_emergency() {
    let mut rig = operational("");
    assert_eq!(rig.send("405#1F00881300"), ["085#1082110000000000"]);
    assert_eq!(rig.take_events(), [Event::RpdoTooShort { number: 3, expected: 6, got: 5 }]);
    assert_eq!(rig.od.get(0x607A, 0), 0);
    assert_eq!(rig.send("405#"), NOTHING, "an error that stays is reported once");
    assert_eq!(rig.send("405#1F0088130000AA"), ["085#2082110000000000"]);
    assert_eq!(rig.od.get(0x607A, 0), 5000);
    assert_eq!(rig.send("405#1F0089130000"), ["085#0000000000000000"], "a good one ends it");
    assert_eq!(rig.od.get(0x1001, 0), 0);
}

#[test]
fn an_rpdo_deadline_is_armed_by_the_first_one() {
    let mut rig = operational("1402:05 u16 rw - 20");
    assert_eq!(rig.pass_ms(100), NOTHING);
    rig.send("405#1F0088130000");
    rig.pass_ms(10);
    rig.send("405#1F0088130000");
    rig.take_events();
    assert_eq!(rig.pass_ms(25), ["20000 085#5082110000000000"]);
    assert_eq!(rig.take_events(), [Event::RpdoTimedOut { number: 3 }]);
    assert_eq!(rig.send("405#1F0088130000"), ["085#0000000000000000"]);
}

#[test]
fn sub_byte_and_dummy_entries_are_mapped() {
    let mut rig = operational(
        "1600:00 u8 rw - 4
         1600:01 u32 rw - 0x20000101
         1600:02 u32 rw - 0x00010001
         1600:03 u32 rw - 0x00050008
         1600:04 u32 rw - 0x20000208
         1A00:00 u8 rw - 2
         1A00:01 u32 rw - 0x20000101
         1A00:02 u32 rw - 0x20000208",
    );
    // Bit 0 is 2000:01, bits 1 to 9 are dummies, bits 10 to 17 are 2000:02.
    rig.send("205#010402");
    assert_eq!((rig.od.get(0x2000, 1), rig.od.get(0x2000, 2)), (1, 0x81));
    rig.device.request_tpdo(1);
    assert_eq!(rig.sent(), ["185#0301"]);
}

#[test]
fn sixty_four_bits_fill_a_pdo() {
    let mut rig = operational("1600:00 u8 rw - 1\n1600:01 u32 rw - 0x20000340");
    rig.send("205#0102030405060708");
    assert_eq!(rig.od.get(0x2000, 3), 0x0807_0605_0403_0201);
}

#[test]
fn bit_31_switches_a_pdo_off_and_bit_29_makes_its_identifier_long() {
    let mut rig = Rig::full();
    rig.write(0x1400, 1, 4, 0x8000_0205).unwrap();
    rig.write(0x1400, 1, 4, 0x2001_2345).unwrap();
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    assert_eq!(rig.send("000#0105"), NOTHING);
    rig.send("205#0F00");
    assert_eq!(rig.od.get(0x6040, 0), 0);
    rig.send("00012345#0F00");
    assert_eq!(rig.od.get(0x6040, 0), 0x0F);
}

#[test]
fn an_identifier_changes_only_while_the_pdo_is_switched_off() {
    let mut rig = Rig::full();
    assert_eq!(rig.write(0x1800, 1, 4, 0x1A5), Err(AbortCode::INVALID_VALUE.0));
    rig.write(0x1800, 1, 4, 0x4000_0185).unwrap();
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    rig.write(0x1800, 3, 2, 100).unwrap();
    rig.write(0x1800, 1, 4, 0x1A5).unwrap();
    assert_eq!(rig.write(0x1800, 3, 2, 200), Err(AbortCode::INVALID_VALUE.0));
    assert_eq!(rig.send("000#0105"), ["1A5#3412"]);
}

#[test]
fn a_restricted_or_taken_identifier_is_refused() {
    let mut rig = Rig::full();
    rig.write(0x1400, 1, 4, 0x8000_0205).unwrap();
    for restricted in [0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x701, 0x780, 0x7FF] {
        assert_eq!(rig.write(0x1400, 1, 4, restricted), Err(AbortCode::INVALID_VALUE.0), "{restricted:03X}");
    }
    assert_eq!(rig.write(0x1400, 1, 4, 0x405), Err(AbortCode::PARAMETER_INCOMPATIBLE.0));
    rig.write(0x1400, 1, 4, 0x206).unwrap();
}

#[test]
fn an_identifier_of_more_than_11_bits_needs_the_bit_that_says_so() {
    let mut rig = Rig::full();
    let refused = Err(AbortCode::INVALID_VALUE.0);
    for (index, sub) in [(0x1800, 1), (0x1400, 1), (0x1014, 0), (0x1005, 0), (0x1012, 0), (0x1201, 1)] {
        assert_eq!(rig.write(index, sub, 4, 0x8000_1186), refused, "{index:04X}");
        let before = rig.read(index, sub).unwrap();
        assert_eq!(rig.write(index, sub, 4, before | 0x1000_0000), refused, "{index:04X}");
    }
    rig.write(0x1800, 1, 4, 0xA000_1186).unwrap();
    rig.write(0x1800, 1, 4, 0x2000_1186).unwrap();
}

#[test]
fn reserved_transmission_types_are_refused() {
    let mut rig = Rig::full();
    for (index, refused) in [(0x1400, 241..=253_u8), (0x1800, 241..=251)] {
        for code in 0..=255 {
            let expected = if refused.contains(&code) { Err(AbortCode::INVALID_VALUE.0) } else { Ok(()) };
            assert_eq!(rig.write(index, 2, 1, code.into()), expected, "{index:04X} {code}");
        }
    }
}

#[test]
fn a_mapping_changes_in_the_order_of_the_standard() {
    let mut rig = Rig::full();
    let refused = Err(AbortCode::UNSUPPORTED_ACCESS.0);
    assert_eq!(rig.write(0x1A00, 0, 1, 0), refused, "the PDO exists");
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    assert_eq!(rig.write(0x1A00, 1, 4, 0x6064_0020), refused, "the entry counts");
    rig.write(0x1A00, 0, 1, 0).unwrap();
    rig.write(0x1A00, 1, 4, 0x6064_0020).unwrap();
    rig.write(0x1A00, 2, 4, 0x6041_0010).unwrap();
    rig.write(0x1A00, 0, 1, 2).unwrap();
    rig.write(0x1800, 1, 4, 0x185).unwrap();
    assert_eq!(rig.send("000#0105"), ["185#FEFFFFFF3412"]);
}

#[test]
fn what_cannot_be_mapped_is_refused() {
    let mut rig = Rig::full();
    for (parameter, mapping) in [(0x1400, 0x1600), (0x1800, 0x1A00)] {
        let cob_id = rig.read(parameter, 1).unwrap();
        rig.write(parameter, 1, 4, cob_id | 0x8000_0000).unwrap();
        rig.write(mapping, 0, 1, 0).unwrap();
    }
    let not_mappable = Err(AbortCode::NOT_MAPPABLE.0);
    // An object for transmission cannot be received, and the other way round.
    assert_eq!(rig.write(0x1600, 1, 4, 0x6064_0020), not_mappable);
    assert_eq!(rig.write(0x1A00, 1, 4, 0x607A_0020), not_mappable);
    for index in [0x1600, 0x1A00] {
        assert_eq!(rig.write(index, 1, 4, 0x2001_0020), not_mappable, "PDOMapping=0");
        assert_eq!(rig.write(index, 1, 4, 0x2000_0210), not_mappable, "another length");
        assert_eq!(rig.write(index, 1, 4, 0x2FFF_0008), Err(AbortCode::NO_SUCH_OBJECT.0));
        assert_eq!(rig.write(index, 1, 4, 0x2000_0908), Err(AbortCode::NO_SUCH_SUB_INDEX.0));
        rig.write(index, 1, 4, 0x2000_0340).unwrap();
        assert_eq!(rig.write(index, 0, 1, 9), Err(AbortCode::PDO_LENGTH_EXCEEDED.0), "also with entries that fit");
        rig.write(index, 2, 4, 0x2000_0208).unwrap();
        assert_eq!(rig.write(index, 0, 1, 2), Err(AbortCode::PDO_LENGTH_EXCEEDED.0), "72 bits");
        assert_eq!(rig.write(index, 0, 1, 9), Err(AbortCode::PDO_LENGTH_EXCEEDED.0), "more than there are");
        rig.write(index, 0, 1, 1).unwrap();
    }
}

#[test]
fn dummies_fill_space_in_rpdos_only_and_as_the_device_says() {
    let behaviour = Behaviour { dummies: 1 << 5, ..Behaviour::CIA_301 };
    let mut rig = Rig::deviating(behaviour);
    for (parameter, mapping, cob_id) in [(0x1400, 0x1600, 0x8000_0205), (0x1800, 0x1A00, 0x8000_0185)] {
        rig.write(parameter, 1, 4, cob_id).unwrap();
        rig.write(mapping, 0, 1, 0).unwrap();
    }
    rig.write(0x1600, 1, 4, 0x0005_0008).unwrap();
    assert_eq!(rig.write(0x1600, 1, 4, 0x0006_0010), Err(AbortCode::NOT_MAPPABLE.0));
    assert_eq!(rig.write(0x1A00, 1, 4, 0x0005_0008), Err(AbortCode::NOT_MAPPABLE.0));
}

#[test]
fn where_pre_operational_is_the_rule_it_is_the_only_one() {
    let behaviour = Behaviour { changes: ChangeRule::InPreOperational, ..Behaviour::CIA_301 };
    let mut rig = Rig::deviating(behaviour);
    rig.write(0x1800, 1, 4, 0x1A5).unwrap();
    rig.write(0x1800, 3, 2, 100).unwrap();
    let mut rig = rig.operational();
    for (index, sub, size, value) in
        [(0x1800, 1, 4, 0x185), (0x1800, 2, 1, 254), (0x1400, 2, 1, 0), (0x1014, 0, 4, 0x86), (0x1005, 0, 4, 0x81)]
    {
        assert_eq!(rig.write(index, sub, size, value), Err(AbortCode::DEVICE_STATE.0), "{index:04X}:{sub:02X}");
    }
}

#[test]
fn a_static_mapping_is_read_only_and_works() {
    let mut rig = Rig::with("1A00:00 u8 ro - 1\n1A00:01 u32 ro - 0x60410010");
    assert_eq!(rig.write(0x1A00, 0, 1, 0), Err(AbortCode::READ_ONLY.0));
    assert_eq!(rig.send("000#0105"), ["185#3412"]);
}

#[test]
fn pdo_numbers_have_gaps_and_compatibility_entries_are_no_pdos() {
    let rig = operational("");
    let exists = |number| (rig.device.rpdo(number).is_some(), rig.device.tpdo(number).is_some());
    assert_eq!(
        [0, 1, 2, 3, 4].map(exists),
        [(false, false), (true, true), (false, false), (true, true), (false, false)]
    );
}

#[test]
fn an_object_that_refuses_its_value_does_not_hold_up_the_others() {
    let mut rig = operational("1602:01 u32 rw - 0x2FFF0010");
    rig.send("405#1F0088130000");
    assert_eq!(rig.od.get(0x607A, 0), 5000);
    assert_eq!(
        rig.take_events(),
        [Event::RpdoRefused { number: 3, address: Address::new(0x2FFF, 0), reason: AbortCode::NO_SUCH_OBJECT }]
    );
}

#[test]
fn a_tpdo_that_comes_to_exist_is_sent_and_one_that_changes_is_not() {
    let mut rig = operational("1800:02 u8 rw - 254");
    assert_eq!(rig.send("605#2B00180532000000"), ["585#6000180500000000"]);
    assert_eq!(rig.pass_ms(50), ["50000 185#3412"], "the timer begins anew");
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    assert_eq!(rig.pass_ms(200), NOTHING);
    assert_eq!(rig.send("605#23001801A5010000"), ["1A5#3412", "585#6000180100000000"]);
}

#[test]
fn what_an_rpdo_writes_is_a_change_for_the_tpdos_that_map_it() {
    let both = "2000:02 u8 rw both 0\n1600:01 u32 rw - 0x20000208\n1A00:01 u32 rw - 0x20000208";
    let mut rig = operational(both);
    assert_eq!(rig.send("205#07"), ["185#07"]);
    assert_eq!(rig.send("205#07"), NOTHING, "the same value is no change");
    assert_eq!(rig.send("205#08"), ["185#08"]);
    assert_eq!(rig.send("405#1F0088130000"), NOTHING, "no TPDO maps it");
    // A synchronous RPDO takes effect at SYNC, and is an event then: a TPDO of type 0 is sent at the next SYNC.
    let mut rig = operational(&format!("{both}\n1400:02 u8 rw - 1"));
    assert_eq!((rig.send("205#07"), rig.send("080#")), (vec![], vec!["185#07".to_string()]));
    let mut rig = operational(&format!("{both}\n1400:02 u8 rw - 1\n1800:02 u8 rw - 0"));
    assert_eq!(rig.send("080#"), ["185#00"], "that of entering OPERATIONAL");
    rig.send("205#07");
    assert_eq!([rig.send("080#"), rig.send("080#"), rig.send("080#")].concat(), ["185#07"]);
    // If changes are no events, this one is not either.
    let behaviour = Behaviour { triggers_255: Triggers { change: false, ..Triggers::ALL }, ..Behaviour::CIA_301 };
    let mut rig = Rig::new(TestOd::new(FULL).with(both), behaviour).operational();
    assert_eq!(rig.send("205#07"), NOTHING);
}

#[test]
fn a_tpdo_that_is_switched_off_is_never_sent() {
    let mut rig = operational("1800:01 u32 rw - 0x80000185");
    rig.device.changed(Address::new(0x6041, 0));
    rig.device.request_tpdo(1);
    assert_eq!(rig.sent(), NOTHING);
    // Nor is one that is switched off while it waits.
    let mut rig = operational("1800:03 u16 rw - 100");
    rig.device.changed(Address::new(0x6041, 0));
    assert_eq!(rig.sent(), NOTHING, "it is inhibited");
    rig.write(0x1800, 1, 4, 0x8000_0185).unwrap();
    assert_eq!(rig.pass_ms(100), NOTHING);
    let sent = rig.send("605#2300180185010000");
    assert_eq!(sent, ["185#3412", "585#6000180100000000"], "that of coming to exist");
}

#[test]
fn the_error_register_is_an_object_that_changes() {
    let mut rig = operational("1A00:01 u32 rw - 0x10010008");
    rig.device.emergency(ErrorCode(0x3120), ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#2031050000000000", "185#05"]);
    rig.device.emergency(ErrorCode(0x3130), ErrorRegister::VOLTAGE, [0; 5], &mut rig.od);
    assert_eq!(rig.sent(), ["085#3031050000000000"], "it is what it was");
    rig.device.clear(ErrorRegister(0xFF), &mut rig.od);
    assert_eq!(rig.sent(), ["085#0000000000000000", "185#00"]);
    assert_eq!(rig.send("080#05"), ["085#4082110000000000", "185#11"]);
    assert_eq!(rig.send("080#"), ["085#0000000000000000", "185#00"]);
}
