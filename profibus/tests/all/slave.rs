//! The simulated slave, telegram by telegram.

use super::support::{self, ADDRESS, Answer, IDENTITY, Rig, data, parameters, refused};
use lexican_profibus::dp::{GlobalControl, Parameters, sap};
use lexican_profibus::fdl::{FrameCount, Service, Status};
use lexican_profibus::{Application, BitRate, Identity, Slave, State};
use lexican_runtime::Duration;

const NONE: FrameCount = FrameCount { bit: false, valid: false };

#[test]
fn it_is_there_from_power_on() {
    let mut rig = Rig::new();
    let status = rig.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    assert_eq!(rig.send(&status), Answer::Data(Status::Ok, Vec::new()));
    let other = rig.telegram(ADDRESS + 1, Service::FdlStatus, NONE, None, &[]);
    assert_eq!(rig.send(&other), Answer::Nothing);
    assert_eq!(
        rig.diagnosis(),
        "ident 1234, no master: not ready for data exchange; parameters and configuration are needed"
    );
    assert_eq!(rig.service(sap::GET_CONFIGURATION, &[]), data(&[0xF1]));
}

#[test]
fn what_it_does_not_have_is_refused() {
    let mut rig = Rig::new();
    for service in [Service::SdaLow, Service::SdaHigh, Service::Ident, Service::LsapStatus] {
        let request = rig.telegram(ADDRESS, service, NONE, None, &[]);
        assert_eq!(rig.send(&request), refused(), "{service:?}");
    }
    for sap in [sap::SET_SLAVE_ADDRESS, sap::CHECK_CONFIGURATION, sap::READ_INPUTS, sap::READ_OUTPUTS, 10] {
        assert_eq!(rig.service(sap, &[1, 2, 3, 4]), refused(), "{sap}");
    }
    assert_eq!(rig.exchange(&[1, 2, 3, 4]), refused());
    assert_eq!(rig.slave.state(), State::WaitParameters);
}

#[test]
fn data_is_exchanged_after_parameters_and_configuration() {
    let mut rig = Rig::in_data_exchange();
    assert_eq!(rig.exchange(&[1, 2, 3, 4]), data(&[0xFE, 0xFD, 0xFC, 0xFB]));
    assert_eq!(rig.service(sap::READ_INPUTS, &[]), data(&[0xFE, 0xFD, 0xFC, 0xFB]));
    assert_eq!(rig.service(sap::READ_OUTPUTS, &[]), data(&[1, 2, 3, 4]));
    assert_eq!(rig.diagnosis(), "ident 1234, master 2: the watchdog is on");
    assert_eq!(rig.slave.application().states, [State::WaitConfiguration, State::DataExchange]);
    // The same configuration once more changes nothing.
    assert_eq!(rig.service(sap::CHECK_CONFIGURATION, &[0xF1]), Answer::Acknowledgement);
    assert_eq!(rig.slave.state(), State::DataExchange);
}

#[test]
fn a_repeated_request_gets_its_answer_again_and_acts_once() {
    let mut rig = Rig::in_data_exchange();
    let answer = rig.exchange(&[1, 2, 3, 4]);
    let repeated = rig.request(None, &[9, 9, 9, 9]);
    for _ in 0..3 {
        assert_eq!(rig.send(&repeated), answer);
    }
    assert_eq!(rig.slave.application().outputs, [vec![1, 2, 3, 4]]);
    rig.exchange(&[5, 6, 7, 8]);
    assert_eq!(rig.slave.application().last(), [5, 6, 7, 8]);
    // What asks for something else is none.
    let other = rig.request(Some(sap::READ_OUTPUTS), &[]);
    assert_eq!(rig.send(&other), data(&[5, 6, 7, 8]));
    // A count that begins anew is no repetition.
    let first = rig.telegram(ADDRESS, Service::SrdHigh, FrameCount { bit: true, valid: false }, None, &[1, 1, 1, 1]);
    rig.send(&first);
    rig.send(&first);
    assert_eq!(rig.slave.application().outputs.len(), 4);
}

#[test]
fn wrong_parameters_are_a_fault() {
    let wrong = |change: fn(&mut Parameters<'static>)| {
        let mut parameters = parameters();
        change(&mut parameters);
        parameters
    };
    let fault = "the parameters, or the ident number, are not those of the slave";
    let unknown = "a function is asked for that the slave does not have";
    for (parameters, text) in [
        (wrong(|parameters| parameters.ident = 0x1235), fault),
        (wrong(|parameters| parameters.watchdog = Some((0, 5))), fault),
        (wrong(|parameters| parameters.sync = true), unknown),
        (wrong(|parameters| parameters.freeze = true), unknown),
    ] {
        let mut rig = Rig::in_data_exchange();
        rig.exchange(&[1, 2, 3, 4]);
        let identity = Identity { sync: false, freeze: false, ..IDENTITY };
        if text == unknown {
            rig.slave = Slave::new(ADDRESS, identity, BitRate(500_000), rig.slave.application().clone());
        }
        assert_eq!(rig.parameterise(parameters), Answer::Acknowledgement);
        let diagnosis = rig.diagnosis();
        assert!(diagnosis.contains(text) && diagnosis.contains("no master"), "{diagnosis}");
        assert_eq!(rig.exchange(&[1, 2, 3, 4]), refused());
        assert_eq!(rig.service(sap::CHECK_CONFIGURATION, &[0xF1]), refused());
        // Right ones make up for it.
        assert_eq!(rig.parameterise(support::parameters()), Answer::Acknowledgement);
        assert_eq!(rig.diagnosis(), "ident 1234, master 2: not ready for data exchange; the watchdog is on");
    }
    let mut rig = Rig::new();
    assert_eq!(rig.service(sap::SET_PARAMETERS, &[0x80, 0, 0]), Answer::Acknowledgement);
    assert!(rig.diagnosis().contains(fault));
}

#[test]
fn another_configuration_is_a_fault_and_outputs_become_zero() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1, 2, 3, 4]);
    assert_eq!(rig.service(sap::CHECK_CONFIGURATION, &[0xF2]), Answer::Acknowledgement);
    let diagnosis = rig.diagnosis();
    assert!(diagnosis.contains("the configuration is not that of the slave"), "{diagnosis}");
    assert_eq!(rig.slave.application().last(), [0; 4]);
    let mut rig = Rig::in_data_exchange();
    assert_eq!(rig.exchange(&[1, 2, 3]), refused());
    assert_eq!(rig.slave.state(), State::WaitParameters);
}

#[test]
fn the_watchdog_takes_the_outputs_back() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1, 2, 3, 4]);
    // 5 times 2 times 10 ms; the rig takes 1 ms before each request and after it.
    rig.pass(Duration::from_millis(97));
    rig.exchange(&[1, 2, 3, 4]);
    rig.pass(Duration::from_millis(98));
    assert_eq!(rig.slave.application().last(), [1, 2, 3, 4]);
    rig.pass(Duration::from_millis(3));
    assert_eq!((rig.slave.state(), rig.slave.application().last()), (State::WaitParameters, &[0; 4][..]));
    assert_eq!(rig.slave.poll_timeout(), None);
}

#[test]
fn it_belongs_to_one_master() {
    let mut rig = Rig::in_data_exchange();
    rig.from = 3;
    assert_eq!(rig.exchange(&[9; 4]), refused());
    assert_eq!(rig.parameterise(parameters()), refused());
    assert_eq!(rig.service(sap::CHECK_CONFIGURATION, &[0xF1]), refused());
    assert_eq!(rig.diagnosis(), "ident 1234, master 2: the watchdog is on");
    rig.control(GlobalControl { clear: true, ..GlobalControl::default() });
    assert!(rig.slave.application().outputs.is_empty());
    rig.from = 2;
    assert_eq!(rig.parameterise(Parameters { unlock: true, ..parameters() }), Answer::Acknowledgement);
    rig.from = 3;
    assert_eq!(rig.parameterise(parameters()), Answer::Acknowledgement);
    assert!(rig.diagnosis().contains("master 3"));
}

#[test]
fn without_lock_only_the_time_before_answers_changes() {
    let mut rig = Rig::in_data_exchange();
    let slow = Parameters { lock: false, min_tsdr_bits: 200, ident: 0, ..parameters() };
    assert_eq!(rig.parameterise(slow), Answer::Acknowledgement);
    assert_eq!(rig.slave.state(), State::DataExchange);
    let request = rig.request(None, &[0; 4]);
    rig.now += Duration::from_millis(1);
    rig.slave.handle_bytes(rig.now, &request);
    // 200 bits at 500 kbit/s.
    let due = rig.slave.poll_timeout().map(|due| due.since(rig.now));
    assert_eq!(due, Some(Duration::from_micros(400)));
}

#[test]
fn sync_holds_the_outputs_and_freeze_the_inputs() {
    let mut rig = Rig::in_data_exchange();
    let command = GlobalControl::default();
    rig.exchange(&[1; 4]);
    rig.control(GlobalControl { sync: true, freeze: true, ..command });
    assert!(rig.diagnosis().ends_with("inputs are frozen; outputs are synchronised"));
    // The next ones wait, and the inputs are those of then.
    assert_eq!(rig.exchange(&[2; 4]), data(&[0xFE; 4]));
    assert_eq!(rig.slave.application().last(), [1; 4]);
    rig.control(GlobalControl { sync: true, ..command });
    assert_eq!(rig.slave.application().last(), [2; 4]);
    assert_eq!(rig.exchange(&[3; 4]), data(&[0xFE; 4]));
    rig.control(GlobalControl { freeze: true, ..command });
    assert_eq!(rig.exchange(&[3; 4]), data(&[0xFD; 4]));
    rig.control(GlobalControl { unsync: true, ..command });
    assert_eq!(rig.slave.application().last(), [3; 4]);
    rig.control(GlobalControl { unfreeze: true, ..command });
    assert_eq!(rig.exchange(&[4; 4]), data(&[0xFB; 4]));
    rig.control(GlobalControl { clear: true, ..command });
    assert_eq!(rig.slave.application().last(), [0; 4]);
}

#[test]
fn a_command_that_takes_back_goes_before_the_one_that_gives() {
    let mut rig = Rig::in_data_exchange();
    rig.control(GlobalControl { sync: true, unsync: true, freeze: true, unfreeze: true, ..GlobalControl::default() });
    assert_eq!(rig.diagnosis(), "ident 1234, master 2: the watchdog is on");
}

#[test]
fn a_slave_without_sync_and_freeze_does_neither() {
    let mut rig = Rig::new();
    let identity = Identity { sync: false, freeze: false, ..IDENTITY };
    rig.slave = Slave::new(ADDRESS, identity, BitRate(500_000), rig.slave.application().clone());
    assert_eq!(rig.parameterise(parameters()), Answer::Acknowledgement);
    assert_eq!(rig.service(sap::CHECK_CONFIGURATION, &[0xF1]), Answer::Acknowledgement);
    rig.control(GlobalControl { sync: true, freeze: true, ..GlobalControl::default() });
    assert_eq!(rig.diagnosis(), "ident 1234, master 2: the watchdog is on");
    assert_eq!(rig.exchange(&[1; 4]), data(&[0xFE; 4]));
}

#[test]
fn new_parameters_end_sync_freeze_and_an_announcement() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1; 4]);
    rig.control(GlobalControl { sync: true, freeze: true, ..GlobalControl::default() });
    rig.slave.announce_diagnosis();
    assert_eq!(rig.parameterise(parameters()), Answer::Acknowledgement);
    assert_eq!(rig.service(sap::CHECK_CONFIGURATION, &[0xF1]), Answer::Acknowledgement);
    assert_eq!(rig.exchange(&[2; 4]), data(&[0xFD; 4]));
    assert_eq!(rig.slave.application().last(), [2; 4]);
}

#[test]
fn another_master_does_not_keep_the_watchdog_quiet() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1; 4]);
    rig.from = 3;
    for _ in 0..3 {
        rig.pass(Duration::from_millis(40));
        rig.diagnosis();
    }
    assert_eq!((rig.slave.state(), rig.slave.application().last()), (State::WaitParameters, &[0; 4][..]));
}

#[test]
fn an_identity_has_as_many_bytes_as_its_configuration() {
    for (inputs, outputs, is_consistent) in [(4, 4, true), (3, 4, false), (4, 3, false)] {
        assert_eq!(Identity { inputs, outputs, ..IDENTITY }.is_consistent(), is_consistent);
    }
}

#[test]
fn a_command_is_for_its_groups() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1; 4]);
    for (groups, outputs) in [(0x02, [1; 4]), (0x01, [0; 4])] {
        rig.control(GlobalControl { clear: true, groups, ..GlobalControl::default() });
        assert_eq!(rig.slave.application().last(), outputs);
    }
}

#[test]
fn diagnosis_that_waits_is_announced_until_it_is_fetched() {
    let mut rig = Rig::in_data_exchange();
    rig.slave.announce_diagnosis();
    for _ in 0..2 {
        assert_eq!(rig.exchange(&[0; 4]), Answer::Data(Status::DataHigh, vec![0xFF; 4]));
    }
    rig.diagnosis();
    assert_eq!(rig.exchange(&[0; 4]), data(&[0xFF; 4]));
}

#[test]
fn a_slave_without_inputs_acknowledges_its_outputs() {
    struct Deaf;
    impl Application for Deaf {
        fn take_outputs(&mut self, _: lexican_runtime::Instant, _: &[u8]) {}
        fn write_inputs(&mut self, _: lexican_runtime::Instant, inputs: &mut [u8]) {
            assert!(inputs.is_empty());
        }
    }
    let identity = Identity { configuration: &[0x20], inputs: 0, outputs: 1, ..IDENTITY };
    assert!(identity.is_consistent() && IDENTITY.is_consistent());
    let mut slave = Slave::new(ADDRESS, identity, BitRate(500_000), Deaf);
    let rig = Rig::new();
    let mut now = rig.now;
    for (sap, payload) in
        [(Some(sap::SET_PARAMETERS), &parameters().head()[..]), (Some(sap::CHECK_CONFIGURATION), &[0x20]), (None, &[1])]
    {
        now += Duration::from_millis(1);
        let first = FrameCount { bit: true, valid: false };
        slave.handle_bytes(now, &rig.telegram(ADDRESS, Service::SrdLow, first, sap, payload));
        now += Duration::from_millis(1);
        assert_eq!(slave.poll_transmit(now), Some(&[0xE5][..]));
    }
}

#[test]
fn a_restart_takes_another_address() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1; 4]);
    rig.slave.restart(rig.now, 99);
    assert_eq!((rig.slave.address(), rig.slave.application().last()), (99, &[0; 4][..]));
    assert_eq!(rig.exchange(&[1; 4]), Answer::Nothing);
}

#[test]
fn it_answers_after_11_bits_or_as_its_parameters_say() {
    let mut rig = Rig::new();
    let status = rig.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    let waits = |rig: &mut Rig| {
        rig.pass(Duration::from_millis(1));
        rig.slave.handle_bytes(rig.now, &status);
        // That of the watchdog is later.
        let due = rig.slave.poll_timeout().unwrap();
        assert!(rig.slave.poll_transmit(due).is_some());
        due.since(rig.now).as_micros()
    };
    assert_eq!(waits(&mut rig), 22);
    for (min_tsdr_bits, micros) in [(5, 22), (200, 400), (0, 400)] {
        rig.parameterise(Parameters { min_tsdr_bits, ..parameters() });
        assert_eq!(waits(&mut rig), micros);
    }
}

#[test]
fn a_silence_of_33_bits_begins_a_telegram() {
    // 66 and 68 microseconds.
    for (micros, is_answered) in [(66, true), (67, false)] {
        let mut rig = Rig::new();
        let status = rig.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
        rig.pass(Duration::from_millis(1));
        rig.slave.handle_bytes(rig.now, &status[..3]);
        rig.now += Duration::from_micros(micros);
        rig.slave.handle_bytes(rig.now, &status[3..]);
        assert_eq!(rig.slave.poll_timeout().is_some(), is_answered);
    }
}

#[test]
fn a_request_is_found_behind_noise() {
    let status = Rig::new().telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    // The beginning of a telegram, and a whole header whose length the request happens to have.
    for noise in [&[0x68][..], &[0x68, 4, 4, 0x68]] {
        assert_eq!(Rig::new().send(&[noise, &status].concat()), Answer::Data(Status::Ok, Vec::new()));
    }
}

#[test]
fn what_was_to_be_answered_is_forgotten_with_the_next_telegram_and_by_a_restart() {
    let mut rig = Rig::new();
    let status = rig.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    let other = rig.telegram(ADDRESS + 1, Service::FdlStatus, NONE, None, &[]);
    rig.pass(Duration::from_millis(1));
    rig.slave.handle_bytes(rig.now, &[&status[..], &other].concat());
    assert_eq!(rig.slave.poll_timeout(), None);
    rig.slave.handle_bytes(rig.now, &status);
    rig.slave.restart(rig.now, ADDRESS);
    assert_eq!(rig.slave.poll_timeout(), None);
}

#[test]
fn a_request_that_does_not_count_leaves_nothing_to_repeat() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1, 2, 3, 4]);
    let status = rig.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    rig.send(&status);
    let repeated = rig.request(None, &[1, 2, 3, 4]);
    assert_eq!(rig.send(&repeated), data(&[0xFE, 0xFD, 0xFC, 0xFB]));
}

#[test]
fn repeated_requests_and_commands_keep_the_watchdog_quiet() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1, 2, 3, 4]);
    let repeated = rig.request(None, &[1, 2, 3, 4]);
    for _ in 0..3 {
        rig.pass(Duration::from_millis(90));
        rig.send(&repeated);
    }
    for _ in 0..3 {
        rig.pass(Duration::from_millis(90));
        rig.control(GlobalControl { groups: 0x02, ..GlobalControl::default() });
    }
    assert_eq!(rig.slave.state(), State::DataExchange);
}

#[test]
fn a_command_is_for_the_slave_or_for_all_and_for_its_sap() {
    let clear = GlobalControl { clear: true, ..GlobalControl::default() }.bytes();
    for (to, to_sap, outputs) in [
        (127, sap::GLOBAL_CONTROL, [0; 4]),
        (ADDRESS, sap::GLOBAL_CONTROL, [0; 4]),
        (ADDRESS + 1, sap::GLOBAL_CONTROL, [1; 4]),
        (127, sap::DIAGNOSIS, [1; 4]),
    ] {
        let mut rig = Rig::in_data_exchange();
        rig.exchange(&[1; 4]);
        let telegram = rig.telegram(to, Service::SdnHigh, NONE, Some(to_sap), &clear);
        assert_eq!((rig.send(&telegram), rig.slave.application().last()), (Answer::Nothing, &outputs[..]));
    }
}

#[test]
fn before_data_exchange_no_data_and_no_commands_are_taken() {
    let mut rig = Rig::new();
    let all = Parameters { sync: true, freeze: true, ..parameters() };
    assert_eq!(rig.parameterise(all), Answer::Acknowledgement);
    rig.control(GlobalControl { sync: true, freeze: true, clear: true, ..GlobalControl::default() });
    assert_eq!(rig.diagnosis(), "ident 1234, master 2: not ready for data exchange; the watchdog is on");
    assert_eq!(rig.exchange(&[1; 4]), refused());
    assert!(rig.slave.application().outputs.is_empty());
}

#[test]
fn inputs_are_read_as_they_are_now() {
    let mut rig = Rig::in_data_exchange();
    rig.exchange(&[1; 4]);
    rig.slave.application_mut().outputs.push(vec![2; 4]);
    assert_eq!(rig.service(sap::READ_INPUTS, &[]), data(&[0xFD; 4]));
}

#[test]
fn bits_take_time() {
    assert_eq!(BitRate(500_000).bits(33), Duration::from_micros(66));
    assert_eq!(BitRate(45_450).bits(1), Duration::from_micros(23));
    assert_eq!(BitRate(0).bits(1), Duration::from_secs(1));
}
