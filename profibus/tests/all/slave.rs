//! The simulated slave, telegram by telegram.

use super::support::{self, ADDRESS, Answer, Bench, IDENTITY, data, parameters, refused};
use lexican_profibus::dp::{GlobalControl, Parameters, sap};
use lexican_profibus::fdl::{FrameCount, Service, Status};
use lexican_profibus::{Application, BitRate, Identity, Slave, State};
use lexican_runtime::Duration;

const NONE: FrameCount = FrameCount { bit: false, valid: false };

#[test]
fn it_is_there_from_power_on() {
    let mut bench = Bench::new();
    let status = bench.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    assert_eq!(bench.send(&status), Answer::Data(Status::Ok, Vec::new()));
    let other = bench.telegram(ADDRESS + 1, Service::FdlStatus, NONE, None, &[]);
    assert_eq!(bench.send(&other), Answer::Nothing);
    assert_eq!(
        bench.diagnosis(),
        "ident 1234, no master: not ready for data exchange; parameters and configuration are needed"
    );
    assert_eq!(bench.service(sap::GET_CONFIGURATION, &[]), data(&[0xF1]));
}

#[test]
fn what_it_does_not_have_is_refused() {
    let mut bench = Bench::new();
    for service in [Service::SdaLow, Service::SdaHigh, Service::Ident, Service::LsapStatus] {
        let request = bench.telegram(ADDRESS, service, NONE, None, &[]);
        assert_eq!(bench.send(&request), refused(), "{service:?}");
    }
    for sap in [sap::SET_SLAVE_ADDRESS, sap::CHECK_CONFIGURATION, sap::READ_INPUTS, sap::READ_OUTPUTS, 10] {
        assert_eq!(bench.service(sap, &[1, 2, 3, 4]), refused(), "{sap}");
    }
    assert_eq!(bench.exchange(&[1, 2, 3, 4]), refused());
    assert_eq!(bench.slave.state(), State::WaitParameters);
}

#[test]
fn data_is_exchanged_after_parameters_and_configuration() {
    let mut bench = Bench::in_data_exchange();
    assert_eq!(bench.exchange(&[1, 2, 3, 4]), data(&[0xFE, 0xFD, 0xFC, 0xFB]));
    assert_eq!(bench.service(sap::READ_INPUTS, &[]), data(&[0xFE, 0xFD, 0xFC, 0xFB]));
    assert_eq!(bench.service(sap::READ_OUTPUTS, &[]), data(&[1, 2, 3, 4]));
    assert_eq!(bench.diagnosis(), "ident 1234, master 2: the watchdog is on");
    assert_eq!(bench.slave.application().states, [State::WaitConfiguration, State::DataExchange]);
    // The same configuration once more changes nothing.
    assert_eq!(bench.service(sap::CHECK_CONFIGURATION, &[0xF1]), Answer::Acknowledgement);
    assert_eq!(bench.slave.state(), State::DataExchange);
}

#[test]
fn a_repeated_request_gets_its_answer_again_and_acts_once() {
    let mut bench = Bench::in_data_exchange();
    let answer = bench.exchange(&[1, 2, 3, 4]);
    let repeated = bench.request(None, &[9, 9, 9, 9]);
    for _ in 0..3 {
        assert_eq!(bench.send(&repeated), answer);
    }
    assert_eq!(bench.slave.application().outputs, [vec![1, 2, 3, 4]]);
    bench.exchange(&[5, 6, 7, 8]);
    assert_eq!(bench.slave.application().last(), [5, 6, 7, 8]);
    // What asks for something else is none.
    let other = bench.request(Some(sap::READ_OUTPUTS), &[]);
    assert_eq!(bench.send(&other), data(&[5, 6, 7, 8]));
    // A count that begins anew is no repetition.
    let first = bench.telegram(ADDRESS, Service::SrdHigh, FrameCount { bit: true, valid: false }, None, &[1, 1, 1, 1]);
    bench.send(&first);
    bench.send(&first);
    assert_eq!(bench.slave.application().outputs.len(), 4);
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
        let mut bench = Bench::in_data_exchange();
        bench.exchange(&[1, 2, 3, 4]);
        let identity = Identity { sync: false, freeze: false, ..IDENTITY };
        if text == unknown {
            bench.slave = Slave::new(ADDRESS, identity, BitRate(500_000), bench.slave.application().clone());
        }
        assert_eq!(bench.parameterise(parameters), Answer::Acknowledgement);
        let diagnosis = bench.diagnosis();
        assert!(diagnosis.contains(text) && diagnosis.contains("no master"), "{diagnosis}");
        assert_eq!(bench.exchange(&[1, 2, 3, 4]), refused());
        assert_eq!(bench.service(sap::CHECK_CONFIGURATION, &[0xF1]), refused());
        // Right ones make up for it.
        assert_eq!(bench.parameterise(support::parameters()), Answer::Acknowledgement);
        assert_eq!(bench.diagnosis(), "ident 1234, master 2: not ready for data exchange; the watchdog is on");
    }
    let mut bench = Bench::new();
    assert_eq!(bench.service(sap::SET_PARAMETERS, &[0x80, 0, 0]), Answer::Acknowledgement);
    assert!(bench.diagnosis().contains(fault));
}

#[test]
fn another_configuration_is_a_fault_and_outputs_become_zero() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1, 2, 3, 4]);
    assert_eq!(bench.service(sap::CHECK_CONFIGURATION, &[0xF2]), Answer::Acknowledgement);
    let diagnosis = bench.diagnosis();
    assert!(diagnosis.contains("the configuration is not that of the slave"), "{diagnosis}");
    assert_eq!(bench.slave.application().last(), [0; 4]);
    let mut bench = Bench::in_data_exchange();
    assert_eq!(bench.exchange(&[1, 2, 3]), refused());
    assert_eq!(bench.slave.state(), State::WaitParameters);
}

#[test]
fn the_watchdog_takes_the_outputs_back() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1, 2, 3, 4]);
    // 5 times 2 times 10 ms; the bench takes 1 ms before each request and after it.
    bench.pass(Duration::from_millis(97));
    bench.exchange(&[1, 2, 3, 4]);
    bench.pass(Duration::from_millis(98));
    assert_eq!(bench.slave.application().last(), [1, 2, 3, 4]);
    bench.pass(Duration::from_millis(3));
    assert_eq!((bench.slave.state(), bench.slave.application().last()), (State::WaitParameters, &[0; 4][..]));
    assert_eq!(bench.slave.poll_timeout(), None);
}

#[test]
fn it_belongs_to_one_master() {
    let mut bench = Bench::in_data_exchange();
    bench.from = 3;
    assert_eq!(bench.exchange(&[9; 4]), refused());
    assert_eq!(bench.parameterise(parameters()), refused());
    assert_eq!(bench.service(sap::CHECK_CONFIGURATION, &[0xF1]), refused());
    assert_eq!(bench.diagnosis(), "ident 1234, master 2: the watchdog is on");
    bench.control(GlobalControl { clear: true, ..GlobalControl::default() });
    assert!(bench.slave.application().outputs.is_empty());
    bench.from = 2;
    assert_eq!(bench.parameterise(Parameters { unlock: true, ..parameters() }), Answer::Acknowledgement);
    bench.from = 3;
    assert_eq!(bench.parameterise(parameters()), Answer::Acknowledgement);
    assert!(bench.diagnosis().contains("master 3"));
}

#[test]
fn without_lock_only_the_time_before_answers_changes() {
    let mut bench = Bench::in_data_exchange();
    let slow = Parameters { lock: false, min_tsdr_bits: 200, ident: 0, ..parameters() };
    assert_eq!(bench.parameterise(slow), Answer::Acknowledgement);
    assert_eq!(bench.slave.state(), State::DataExchange);
    let request = bench.request(None, &[0; 4]);
    bench.now += Duration::from_millis(1);
    bench.slave.handle_bytes(bench.now, &request);
    // 200 bits at 500 kbit/s.
    let due = bench.slave.poll_timeout().map(|due| due.since(bench.now));
    assert_eq!(due, Some(Duration::from_micros(400)));
}

#[test]
fn sync_holds_the_outputs_and_freeze_the_inputs() {
    let mut bench = Bench::in_data_exchange();
    let command = GlobalControl::default();
    bench.exchange(&[1; 4]);
    bench.control(GlobalControl { sync: true, freeze: true, ..command });
    assert!(bench.diagnosis().ends_with("inputs are frozen; outputs are synchronised"));
    // The next ones wait, and the inputs are those of then.
    assert_eq!(bench.exchange(&[2; 4]), data(&[0xFE; 4]));
    assert_eq!(bench.slave.application().last(), [1; 4]);
    bench.control(GlobalControl { sync: true, ..command });
    assert_eq!(bench.slave.application().last(), [2; 4]);
    assert_eq!(bench.exchange(&[3; 4]), data(&[0xFE; 4]));
    bench.control(GlobalControl { freeze: true, ..command });
    assert_eq!(bench.exchange(&[3; 4]), data(&[0xFD; 4]));
    bench.control(GlobalControl { unsync: true, ..command });
    assert_eq!(bench.slave.application().last(), [3; 4]);
    bench.control(GlobalControl { unfreeze: true, ..command });
    assert_eq!(bench.exchange(&[4; 4]), data(&[0xFB; 4]));
    bench.control(GlobalControl { clear: true, ..command });
    assert_eq!(bench.slave.application().last(), [0; 4]);
}

#[test]
fn a_command_that_takes_back_goes_before_the_one_that_gives() {
    let mut bench = Bench::in_data_exchange();
    bench.control(GlobalControl { sync: true, unsync: true, freeze: true, unfreeze: true, ..GlobalControl::default() });
    assert_eq!(bench.diagnosis(), "ident 1234, master 2: the watchdog is on");
}

#[test]
fn a_slave_without_sync_and_freeze_does_neither() {
    let mut bench = Bench::new();
    let identity = Identity { sync: false, freeze: false, ..IDENTITY };
    bench.slave = Slave::new(ADDRESS, identity, BitRate(500_000), bench.slave.application().clone());
    assert_eq!(bench.parameterise(parameters()), Answer::Acknowledgement);
    assert_eq!(bench.service(sap::CHECK_CONFIGURATION, &[0xF1]), Answer::Acknowledgement);
    bench.control(GlobalControl { sync: true, freeze: true, ..GlobalControl::default() });
    assert_eq!(bench.diagnosis(), "ident 1234, master 2: the watchdog is on");
    assert_eq!(bench.exchange(&[1; 4]), data(&[0xFE; 4]));
}

#[test]
fn new_parameters_end_sync_freeze_and_an_announcement() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1; 4]);
    bench.control(GlobalControl { sync: true, freeze: true, ..GlobalControl::default() });
    bench.slave.announce_diagnosis();
    assert_eq!(bench.parameterise(parameters()), Answer::Acknowledgement);
    assert_eq!(bench.service(sap::CHECK_CONFIGURATION, &[0xF1]), Answer::Acknowledgement);
    assert_eq!(bench.exchange(&[2; 4]), data(&[0xFD; 4]));
    assert_eq!(bench.slave.application().last(), [2; 4]);
}

#[test]
fn another_master_does_not_keep_the_watchdog_quiet() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1; 4]);
    bench.from = 3;
    for _ in 0..3 {
        bench.pass(Duration::from_millis(40));
        bench.diagnosis();
    }
    assert_eq!((bench.slave.state(), bench.slave.application().last()), (State::WaitParameters, &[0; 4][..]));
}

#[test]
fn an_identity_has_as_many_bytes_as_its_configuration() {
    for (inputs, outputs, is_consistent) in [(4, 4, true), (3, 4, false), (4, 3, false)] {
        assert_eq!(Identity { inputs, outputs, ..IDENTITY }.is_consistent(), is_consistent);
    }
}

#[test]
fn a_command_is_for_its_groups() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1; 4]);
    for (groups, outputs) in [(0x02, [1; 4]), (0x01, [0; 4])] {
        bench.control(GlobalControl { clear: true, groups, ..GlobalControl::default() });
        assert_eq!(bench.slave.application().last(), outputs);
    }
}

#[test]
fn diagnosis_that_waits_is_announced_until_it_is_fetched() {
    let mut bench = Bench::in_data_exchange();
    bench.slave.announce_diagnosis();
    for _ in 0..2 {
        assert_eq!(bench.exchange(&[0; 4]), Answer::Data(Status::DataHigh, vec![0xFF; 4]));
    }
    bench.diagnosis();
    assert_eq!(bench.exchange(&[0; 4]), data(&[0xFF; 4]));
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
    let bench = Bench::new();
    let mut now = bench.now;
    for (sap, payload) in
        [(Some(sap::SET_PARAMETERS), &parameters().head()[..]), (Some(sap::CHECK_CONFIGURATION), &[0x20]), (None, &[1])]
    {
        now += Duration::from_millis(1);
        let first = FrameCount { bit: true, valid: false };
        slave.handle_bytes(now, &bench.telegram(ADDRESS, Service::SrdLow, first, sap, payload));
        now += Duration::from_millis(1);
        assert_eq!(slave.poll_transmit(now), Some(&[0xE5][..]));
    }
}

#[test]
fn a_restart_takes_another_address() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1; 4]);
    bench.slave.restart(bench.now, 99);
    assert_eq!((bench.slave.address(), bench.slave.application().last()), (99, &[0; 4][..]));
    assert_eq!(bench.exchange(&[1; 4]), Answer::Nothing);
}

#[test]
fn it_answers_after_11_bits_or_as_its_parameters_say() {
    let mut bench = Bench::new();
    let status = bench.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    let waits = |bench: &mut Bench| {
        bench.pass(Duration::from_millis(1));
        bench.slave.handle_bytes(bench.now, &status);
        // That of the watchdog is later.
        let due = bench.slave.poll_timeout().unwrap();
        assert!(bench.slave.poll_transmit(due).is_some());
        due.since(bench.now).as_micros()
    };
    assert_eq!(waits(&mut bench), 22);
    for (min_tsdr_bits, micros) in [(5, 22), (200, 400), (0, 400)] {
        bench.parameterise(Parameters { min_tsdr_bits, ..parameters() });
        assert_eq!(waits(&mut bench), micros);
    }
}

#[test]
fn a_silence_of_33_bits_begins_a_telegram() {
    // 66 and 68 microseconds.
    for (micros, is_answered) in [(66, true), (67, false)] {
        let mut bench = Bench::new();
        let status = bench.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
        bench.pass(Duration::from_millis(1));
        bench.slave.handle_bytes(bench.now, &status[..3]);
        bench.now += Duration::from_micros(micros);
        bench.slave.handle_bytes(bench.now, &status[3..]);
        assert_eq!(bench.slave.poll_timeout().is_some(), is_answered);
    }
}

#[test]
fn a_request_is_found_behind_noise() {
    let status = Bench::new().telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    // The beginning of a telegram, and a whole header whose length the request happens to have.
    for noise in [&[0x68][..], &[0x68, 4, 4, 0x68]] {
        assert_eq!(Bench::new().send(&[noise, &status].concat()), Answer::Data(Status::Ok, Vec::new()));
    }
}

#[test]
fn what_was_to_be_answered_is_forgotten_with_the_next_telegram_and_by_a_restart() {
    let mut bench = Bench::new();
    let status = bench.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    let other = bench.telegram(ADDRESS + 1, Service::FdlStatus, NONE, None, &[]);
    bench.pass(Duration::from_millis(1));
    bench.slave.handle_bytes(bench.now, &[&status[..], &other].concat());
    assert_eq!(bench.slave.poll_timeout(), None);
    bench.slave.handle_bytes(bench.now, &status);
    bench.slave.restart(bench.now, ADDRESS);
    assert_eq!(bench.slave.poll_timeout(), None);
}

#[test]
fn a_request_that_does_not_count_leaves_nothing_to_repeat() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1, 2, 3, 4]);
    let status = bench.telegram(ADDRESS, Service::FdlStatus, NONE, None, &[]);
    bench.send(&status);
    let repeated = bench.request(None, &[1, 2, 3, 4]);
    assert_eq!(bench.send(&repeated), data(&[0xFE, 0xFD, 0xFC, 0xFB]));
}

#[test]
fn repeated_requests_and_commands_keep_the_watchdog_quiet() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1, 2, 3, 4]);
    let repeated = bench.request(None, &[1, 2, 3, 4]);
    for _ in 0..3 {
        bench.pass(Duration::from_millis(90));
        bench.send(&repeated);
    }
    for _ in 0..3 {
        bench.pass(Duration::from_millis(90));
        bench.control(GlobalControl { groups: 0x02, ..GlobalControl::default() });
    }
    assert_eq!(bench.slave.state(), State::DataExchange);
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
        let mut bench = Bench::in_data_exchange();
        bench.exchange(&[1; 4]);
        let telegram = bench.telegram(to, Service::SdnHigh, NONE, Some(to_sap), &clear);
        assert_eq!((bench.send(&telegram), bench.slave.application().last()), (Answer::Nothing, &outputs[..]));
    }
}

#[test]
fn before_data_exchange_no_data_and_no_commands_are_taken() {
    let mut bench = Bench::new();
    let all = Parameters { sync: true, freeze: true, ..parameters() };
    assert_eq!(bench.parameterise(all), Answer::Acknowledgement);
    bench.control(GlobalControl { sync: true, freeze: true, clear: true, ..GlobalControl::default() });
    assert_eq!(bench.diagnosis(), "ident 1234, master 2: not ready for data exchange; the watchdog is on");
    assert_eq!(bench.exchange(&[1; 4]), refused());
    assert!(bench.slave.application().outputs.is_empty());
}

#[test]
fn inputs_are_read_as_they_are_now() {
    let mut bench = Bench::in_data_exchange();
    bench.exchange(&[1; 4]);
    bench.slave.application_mut().outputs.push(vec![2; 4]);
    assert_eq!(bench.service(sap::READ_INPUTS, &[]), data(&[0xFD; 4]));
}

#[test]
fn bits_take_time() {
    assert_eq!(BitRate(500_000).bits(33), Duration::from_micros(66));
    assert_eq!(BitRate(45_450).bits(1), Duration::from_micros(23));
    assert_eq!(BitRate(0).bits(1), Duration::from_secs(1));
}
