//! Random bytes on the line stop neither a slave nor a codec, and the next request is answered.

use super::random::Random;
use super::support::{self, Answer, Rig, data};
use lexican_profibus::State;
use lexican_profibus::dp::{Diagnosis, GlobalControl, Parameters, lengths};
use lexican_profibus::fdl::{Data, Decoded, FrameCount, Function, MAX_PAYLOAD, Service, Status, Telegram, decode};
use lexican_profibus::pkw::{Pkw, Reply, Task};
use lexican_runtime::Duration;
use proptest::prelude::*;

/// After a silence, the slave is there, whatever state it is in.
#[track_caller]
fn answers(rig: &mut Rig) {
    rig.pass(Duration::from_millis(200));
    let status = rig.telegram(support::ADDRESS, Service::FdlStatus, FrameCount { bit: false, valid: false }, None, &[]);
    assert_eq!(rig.send(&status), Answer::Data(Status::Ok, Vec::new()));
}

#[test]
fn a_million_random_bytes_leave_a_slave_that_answers() {
    let mut random = Random(0x5EED_1234_5678_9ABC);
    let mut rig = Rig::in_data_exchange();
    for burst in 0..1000 {
        let bytes = random.line(1000);
        rig.slave.handle_bytes(rig.now, &bytes);
        rig.pass(Duration::from_micros(random.next() >> 54));
        if burst % 100 == 99 {
            answers(&mut rig);
        }
    }
}

#[test]
fn a_hundred_thousand_altered_telegrams_leave_a_slave_that_answers() {
    let mut random = Random(0xF00D_1234_5678_9ABC);
    let mut rig = Rig::in_data_exchange();
    let telegrams = [
        rig.request(None, &[1, 2, 3, 4]),
        rig.request(Some(60), &[]),
        rig.request(Some(61), &support::parameters().head()),
        rig.request(Some(62), &[0xF1]),
        rig.request(Some(59), &[]),
        rig.telegram(127, Service::SdnHigh, FrameCount { bit: false, valid: false }, Some(58), &[0x2A, 0]),
    ];
    for number in 0..100_000 {
        let mut telegram = telegrams[random.below(telegrams.len())].clone();
        random.alter(&mut telegram);
        rig.slave.handle_bytes(rig.now, &telegram);
        rig.pass(Duration::from_micros(random.next() >> 56));
        if number % 10_000 == 9_999 {
            answers(&mut rig);
        }
    }
    rig.slave.restart(rig.now, support::ADDRESS);
    assert_eq!(rig.parameterise(support::parameters()), Answer::Acknowledgement);
    assert_eq!(rig.service(62, &[0xF1]), Answer::Acknowledgement);
    assert_eq!((rig.exchange(&[0; 4]), rig.slave.state()), (data(&[0xFF; 4]), State::DataExchange));
}

/// An altered byte is noticed: the sum or the form is wrong.
#[test]
fn one_altered_byte_is_no_request() {
    let rig = Rig::new();
    let telegram = rig.request(Some(61), &support::parameters().head());
    for at in 0..telegram.len() {
        for bit in 0..8 {
            let mut altered = telegram.clone();
            altered[at] ^= 1 << bit;
            let whole = matches!(decode(&altered), Decoded::Complete(Telegram::Data(_), len) if len == altered.len());
            assert!(!whole, "{altered:02X?}");
        }
    }
}

proptest! {
    #[test]
    fn what_is_decoded_is_encoded_the_same(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Decoded::Complete(telegram, len) = decode(&bytes) {
            let wire = telegram.encode().expect("it has come in a telegram");
            // Eight bytes of data have two forms, no data has two: the shorter one is sent.
            prop_assert!(matches!(decode(&wire), Decoded::Complete(again, _) if again == telegram));
            prop_assert!(wire.len() <= len);
        }
    }

    #[test]
    fn what_is_encoded_is_decoded_the_same(
        to in 0..=127_u8,
        from in 0..=126_u8,
        saps in any::<(Option<u8>, Option<u8>)>(),
        payload in prop::collection::vec(any::<u8>(), 0..=MAX_PAYLOAD - 2),
        code in 0..Service::ALL.len(),
    ) {
        let function = Function::Request { service: Service::ALL[code], count: FrameCount { bit: true, valid: true } };
        let data = Data { to, from, to_sap: saps.0, from_sap: saps.1, function, payload: &payload };
        let wire = Telegram::Data(data).encode().expect("it fits");
        prop_assert_eq!(decode(&wire), Decoded::Complete(Telegram::Data(data), wire.len()));
    }

    #[test]
    fn tasks_and_replies_survive(bytes in any::<[u8; 8]>()) {
        let pkw = Pkw::parse(&bytes).expect("eight bytes");
        let [high, rest @ ..] = bytes;
        prop_assert_eq!(pkw.bytes(), {
            let mut expected = [high, rest[0], rest[1], rest[2], rest[3], rest[4], rest[5], rest[6]];
            expected[0] &= !0x08;
            expected
        });
        if let Ok(Some(task)) = Task::parse(pkw) {
            prop_assert_eq!(Task::parse(task.pkw()), Ok(Some(task)));
        }
        if let Ok(Some(reply)) = Reply::parse(pkw) {
            prop_assert_eq!(Reply::parse(reply.pkw(pkw)), Ok(Some(reply)));
        }
    }

    #[test]
    fn services_are_total(bytes in prop::collection::vec(any::<u8>(), 0..20)) {
        let _ = (GlobalControl::parse(&bytes), lengths(&bytes));
        if let Some(parameters) = Parameters::parse(&bytes) {
            let again = [&parameters.head()[..], parameters.user].concat();
            let read = Parameters::parse(&again).expect("seven bytes");
            prop_assert_eq!(Parameters { watchdog: parameters.watchdog, ..read }, parameters);
        }
        if let Some(diagnosis) = Diagnosis::parse(&bytes) {
            prop_assert_eq!(Diagnosis::parse(&diagnosis.bytes()), Some(diagnosis));
            let _ = diagnosis.to_string();
        }
    }
}
