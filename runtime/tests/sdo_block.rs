//! Block transfers between the client and the server of the runtime, and frame by frame.

mod sdo_support;

use lexican_runtime::object::{Access, Address, DataType};
use lexican_runtime::service::sdo_client::{Event, SdoClient, SdoError};
use lexican_runtime::service::sdo_server::{self, Side};
use lexican_runtime::{AbortCode, Duration, Frame, Instant};
use sdo_support::{Bus, NODE, Od, at, frame, pattern};

const DOMAIN: Address = at(0x2003, 0);

fn bus(data: &[u8]) -> Bus {
    let mut bus = Bus::new(Od::default().with(DOMAIN, DataType::Domain, Access::Rw, data).with(
        at(0x2000, 8),
        DataType::Unsigned64,
        Access::Rw,
        &[1, 2, 3, 4, 5, 6, 7, 8],
    ));
    bus.client = SdoClient::of_node(NODE).with_block_writes_from(0);
    bus
}

fn frames(texts: &[&str]) -> Vec<Frame> {
    texts.iter().map(|text| frame(text)).collect()
}

#[test]
fn every_length_survives_a_block_write_and_a_block_read() {
    for (hides_len, block_size) in [(false, 127), (true, 127), (false, 1), (true, 2), (false, 3)] {
        let mut bus = bus(b"");
        bus.od.hides_len = hides_len;
        bus.client = bus.client.with_block_size(block_size);
        bus.server = bus.server.with_block_size(block_size);
        for len in (0..60).chain([888, 889, 890, 1777, 1778, 1779]) {
            let data = pattern(len);
            let done = Event::Done { address: DOMAIN, len: len as u32 };
            assert_eq!(bus.write(DOMAIN, &data), done);
            assert_eq!(bus.read_block(DOMAIN), (done, data));
            bus.settle();
            assert_eq!(bus.events.pop(), Some(sdo_server::Event::Read(DOMAIN)));
            assert_eq!(bus.events.pop(), Some(sdo_server::Event::Written(DOMAIN)));
            assert_eq!(bus.events, []);
        }
    }
}

#[test]
fn a_block_write_is_what_the_standard_says() {
    let mut bus = bus(b"");
    bus.server = bus.server.with_block_size(2);
    bus.write(DOMAIN, b"123456789123456789");
    assert_eq!(
        bus.log,
        frames(&[
            "605#C6 0320 00 12000000",
            "585#A4 0320 00 02000000",
            "605#01 31323334353637",
            "605#02 38393132333435",
            "585#A2 02 02 0000000000",
            "605#81 36373839000000",
            "585#A2 01 02 0000000000",
            "605#CD C6ED 0000000000",
            "585#A1 00000000000000",
        ])
    );
}

#[test]
fn a_block_read_is_what_the_standard_says() {
    let mut bus = bus(b"1234567891234567891234");
    bus.client = bus.client.with_block_size(3);
    bus.read_block(DOMAIN);
    bus.settle();
    assert_eq!(
        bus.log,
        frames(&[
            "605#A4 0320 00 03 15 0000",
            "585#C6 0320 00 16000000",
            "605#A3 00000000000000",
            "585#01 31323334353637",
            "585#02 38393132333435",
            "585#03 36373839313233",
            "605#A2 03 03 0000000000",
            "585#81 34000000000000",
            "605#A2 01 03 0000000000",
            "585#D9 B2FE 0000000000",
            "605#A1 00000000000000",
        ])
    );
    assert_eq!(bus.events, [sdo_server::Event::Read(DOMAIN)], "the client has confirmed the end");
}

#[test]
fn few_bytes_are_read_without_blocks_though_asked_for() {
    let mut bus = bus(&pattern(21));
    assert_eq!(bus.read_block(DOMAIN).1, pattern(21));
    assert_eq!(bus.log[1], frame("585#4103200015000000"));
    assert_eq!(bus.read_block(at(0x2000, 8)).1, [1, 2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn a_value_is_written_by_block_as_a_whole() {
    let mut bus = bus(b"");
    bus.write(at(0x2000, 8), &[8, 7, 6, 5, 4, 3, 2, 1]);
    assert_eq!(bus.od.value(at(0x2000, 8)), [8, 7, 6, 5, 4, 3, 2, 1]);
    let Event::Failed(error) = bus.write(at(0x2000, 8), &[0; 9]) else { panic!("nine bytes are no UNSIGNED64") };
    assert_eq!(error, SdoError::Aborted { address: at(0x2000, 8), code: AbortCode::LENGTH_TOO_HIGH });
}

/// What the server answers, request by request; a request without an answer is followed by another one.
#[track_caller]
fn check_server(bus: &mut Bus, script: &[(&str, &[&str])]) {
    for (request, responses) in script {
        bus.events.extend(bus.server.handle_frame(Instant::ZERO, &frame(request), &mut bus.od));
        let mut sent = vec![];
        while let Some(frame) = bus.server.poll_transmit(Instant::ZERO, &mut bus.od) {
            sent.push(frame);
        }
        assert_eq!(sent, frames(responses), "the answer to {request}");
    }
}

#[test]
fn the_client_may_change_the_block_size_with_every_block() {
    check_server(
        &mut bus(&pattern(40)),
        &[
            ("605#A0 0320 00 01 00 0000", &["585#C6 0320 00 28000000"]),
            ("605#A3 00000000000000", &["585#01 01203F5E7D9CBB"]),
            ("605#A2 01 02 0000000000", &["585#01 DAF91837567594", "585#02 B3D2F1102F4E6D"]),
            ("605#A2 02 7F 0000000000", &["585#01 8CABCAE9082746", "585#02 6584A3C2E1001F", "585#83 3E5D7C9BBA0000"]),
            ("605#A2 03 7F 0000000000", &["585#C9 0000 0000000000"]),
            ("605#A1 00000000000000", &[]),
        ],
    );
}

#[test]
fn what_was_not_confirmed_is_sent_again() {
    check_server(
        &mut bus(&pattern(20)),
        &[
            ("605#A0 0320 00 7F 00 0000", &["585#C6 0320 00 14000000"]),
            ("605#A3 00000000000000", &["585#01 01203F5E7D9CBB", "585#02 DAF91837567594", "585#83 B3D2F1102F4E00"]),
            ("605#A2 01 7F 0000000000", &["585#01 DAF91837567594", "585#82 B3D2F1102F4E00"]),
            ("605#A2 00 01 0000000000", &["585#01 DAF91837567594"]),
            ("605#A2 01 01 0000000000", &["585#81 B3D2F1102F4E00"]),
            ("605#A2 01 01 0000000000", &["585#C5 0000 0000000000"]),
            // The client did not hear the end, and says again what it has.
            ("605#A2 01 01 0000000000", &["585#C5 0000 0000000000"]),
            ("605#A1 00000000000000", &[]),
        ],
    );
}

#[test]
fn block_sizes_and_sequence_numbers_out_of_range_are_refused() {
    for size in ["00", "80", "FF"] {
        check_server(&mut bus(&pattern(40)), &[(&format!("605#A0032000{size}000000"), &["585#8003200002000405"])]);
        let script: &[(&str, &[&str])] = &[
            ("605#A003200001000000", &["585#C603200028000000"]),
            ("605#A300000000000000", &["585#0101203F5E7D9CBB"]),
            (&format!("605#A201{size}0000000000"), &["585#8003200002000405"]),
        ];
        check_server(&mut bus(&pattern(40)), script);
    }
    for sequence in ["02", "7F", "80", "FF"] {
        let script: &[(&str, &[&str])] = &[
            ("605#A003200001000000", &["585#C603200028000000"]),
            ("605#A300000000000000", &["585#0101203F5E7D9CBB"]),
            (&format!("605#A2{sequence}010000000000"), &["585#8003200003000405"]),
        ];
        check_server(&mut bus(&pattern(40)), script);
    }
}

#[test]
fn a_checksum_is_compared_only_when_both_sides_can_compute_it() {
    for (initiate, answer) in
        [("605#C603200004000000", "585#8003200004000405"), ("605#C203200004000000", "585#A100000000000000")]
    {
        check_server(
            &mut bus(b""),
            &[
                (initiate, &["585#A40320007F000000"]),
                ("605#8101020304000000", &["585#A2017F0000000000"]),
                ("605#CD12340000000000", &[answer]),
            ],
        );
    }
}

#[test]
fn a_block_write_of_another_length_than_announced_is_refused() {
    for (announced, code) in [("05", "13"), ("03", "12")] {
        check_server(
            &mut bus(b""),
            &[
                (&format!("605#C2032000{announced}000000"), &["585#A40320007F000000"]),
                ("605#8101020304000000", &["585#A2017F0000000000"]),
                ("605#CD00000000000000", &[&format!("585#80032000{code}000706")]),
            ],
        );
    }
}

#[test]
fn an_error_in_the_midst_of_a_block_is_sent_at_once_and_reported_at_the_next_deadline() {
    let mut bus = bus(&pattern(40));
    bus.od.breaks_at = Some(14);
    check_server(
        &mut bus,
        &[
            ("605#A00320007F000000", &["585#C603200028000000"]),
            ("605#A300000000000000", &["585#0101203F5E7D9CBB", "585#02DAF91837567594", "585#8003200000000606"]),
        ],
    );
    assert_eq!(bus.server.poll_timeout(), Some(Instant::ZERO));
    let code = AbortCode::HARDWARE_ERROR;
    let aborted = sdo_server::Event::Aborted { address: DOMAIN, code, by: Side::Server };
    assert_eq!(bus.server.handle_timeout(Instant::ZERO), Some(aborted));
    assert_eq!(bus.server.poll_timeout(), None);
}

#[test]
fn a_client_may_abort_in_the_midst_of_a_block() {
    let mut bus = bus(b"");
    check_server(
        &mut bus,
        &[
            ("605#C603200028000000", &["585#A40320007F000000"]),
            ("605#0101020304050607", &[]),
            ("605#8003200000000008", &[]),
        ],
    );
    let code = AbortCode::GENERAL;
    assert_eq!(bus.events, [sdo_server::Event::Aborted { address: DOMAIN, code, by: Side::Client }]);
    assert!(!bus.server.is_busy());
}

/// What a foreign server answers to the client, and how the transfer ends.
#[track_caller]
fn check_client(mut client: SdoClient, data: &mut [u8], script: &[(&str, &str)], event: Event) {
    let mut ended = None;
    for (request, response) in script {
        let sent = client.poll_transmit(Instant::ZERO, &mut { &mut *data });
        assert_eq!(sent, Some(frame(request)));
        if !response.is_empty() {
            assert_eq!(ended, None, "nothing is to come");
            ended = client.handle_frame(Instant::ZERO, &frame(response), &mut { &mut *data });
        }
    }
    assert_eq!(ended, Some(event));
}

fn reading() -> SdoClient {
    let mut client = SdoClient::of_node(NODE);
    client.read_block(Instant::ZERO, DOMAIN).unwrap();
    client
}

fn writing(len: u32) -> SdoClient {
    let mut client = SdoClient::of_node(NODE).with_block_writes_from(0);
    client.write(Instant::ZERO, DOMAIN, len).unwrap();
    client
}

#[test]
fn a_server_that_knows_no_blocks_is_asked_for_segments() {
    check_client(
        reading(),
        &mut [0; 8],
        &[
            ("605#A40320007F150000", "585#8003200001000405"),
            ("605#4003200000000000", "585#4103200005000000"),
            ("605#6000000000000000", "585#0501020304050000"),
        ],
        Event::Done { address: DOMAIN, len: 5 },
    );
    check_client(
        writing(5),
        &mut [1, 2, 3, 4, 5],
        &[
            ("605#C603200005000000", "585#8003200001000405"),
            ("605#2103200005000000", "585#6003200000000000"),
            ("605#0501020304050000", "585#2000000000000000"),
        ],
        Event::Done { address: DOMAIN, len: 5 },
    );
}

#[test]
fn a_server_may_answer_a_block_request_with_segments() {
    check_client(
        reading(),
        &mut [0; 8],
        &[("605#A40320007F150000", "585#4103200005000000"), ("605#6000000000000000", "585#0501020304050000")],
        Event::Done { address: DOMAIN, len: 5 },
    );
    check_client(
        reading(),
        &mut [0; 8],
        &[("605#A40320007F150000", "585#4303200001020304")],
        Event::Done { address: DOMAIN, len: 4 },
    );
    check_client(
        writing(5),
        &mut [1, 2, 3, 4, 5],
        &[("605#C603200005000000", "585#6003200000000000"), ("605#0501020304050000", "585#2000000000000000")],
        Event::Done { address: DOMAIN, len: 5 },
    );
}

#[test]
fn other_refusals_of_a_block_request_are_final() {
    let code = AbortCode::NO_SUCH_OBJECT;
    check_client(
        reading(),
        &mut [0; 8],
        &[("605#A40320007F150000", "585#8003200000000206")],
        Event::Failed(SdoError::Aborted { address: DOMAIN, code }),
    );
}

#[test]
fn a_payload_that_is_too_small_ends_a_block_read() {
    let mut bus = bus(&pattern(40));
    bus.client.read_block(bus.now, DOMAIN).unwrap();
    let event = bus.run(&mut [0_u8; 20], &mut |_, frame| vec![frame]);
    assert_eq!(event, Event::Failed(SdoError::TooLong { address: DOMAIN, capacity: 20 }));
    bus.settle();
    assert_eq!(bus.read_block(DOMAIN).1, pattern(40));
}

#[test]
fn a_payload_that_is_too_short_ends_a_block_write() {
    let mut bus = bus(b"");
    bus.client.write(bus.now, DOMAIN, 40).unwrap();
    let event = bus.run(&mut [0_u8; 20], &mut |_, frame| vec![frame]);
    assert_eq!(event, Event::Failed(SdoError::TooShort { address: DOMAIN, len: 20 }));
    bus.settle();
    assert_eq!(bus.write(DOMAIN, &pattern(40)), Event::Done { address: DOMAIN, len: 40 });
}

/// A client that goes over to blocks from 30 bytes on.
fn by_size() -> SdoClient {
    SdoClient::of_node(NODE).with_block_writes_from(30).with_block_reads_from(30)
}

#[test]
fn what_is_announced_to_be_long_is_read_by_block() {
    for len in [0, 1, 4, 5, 29, 30, 31, 890, 5000] {
        let mut bus = bus(&pattern(len));
        bus.client = by_size();
        let done = Event::Done { address: DOMAIN, len: len as u32 };
        for _ in 0..2 {
            bus.log.clear();
            assert_eq!(bus.read(DOMAIN), (done, pattern(len)));
            bus.settle();
            assert_eq!(bus.log.contains(&frame("605#A40320007F150000")), len >= 30, "{len} bytes");
        }
        bus.od.hides_len = true;
        bus.log.clear();
        assert_eq!(bus.read(DOMAIN), (done, pattern(len)));
        assert!(!bus.log.contains(&frame("605#A40320007F150000")), "{len} bytes that were not announced");
    }
}

#[test]
fn a_server_that_begins_no_block_read_is_asked_for_segments_from_then_on() {
    let announced = "585#4103200020000000";
    let segments = [
        ("605#6000000000000000", "585#0001020304050607"),
        ("605#7000000000000000", "585#1001020304050607"),
        ("605#6000000000000000", "585#0001020304050607"),
        ("605#7000000000000000", "585#1001020304050607"),
        ("605#6000000000000000", "585#0701020304000000"),
    ];
    // It aborts, for whatever reason, or is silent.
    for refusal in [Some("585#8003200001000405"), Some("585#8003200000000008"), None] {
        let (mut client, mut data, mut now) = (by_size(), [0; 40], Instant::ZERO);
        client.read(now, DOMAIN).unwrap();
        let mut asks = |client: &mut SdoClient, now, request: &str, response: Option<&str>| {
            assert_eq!(client.poll_transmit(now, &mut data), Some(frame(request)));
            response.and_then(|response| client.handle_frame(now, &frame(response), &mut data))
        };
        asks(&mut client, now, "605#4003200000000000", Some(announced));
        asks(&mut client, now, "605#8003200000000008", None);
        asks(&mut client, now, "605#A40320007F150000", refusal);
        if refusal.is_none() {
            now = client.poll_timeout().unwrap();
            assert_eq!(client.handle_timeout(now), None);
        }
        for _ in 0..2 {
            asks(&mut client, now, "605#4003200000000000", Some(announced));
            let ended = segments.map(|(request, response)| asks(&mut client, now, request, Some(response)));
            assert_eq!(ended[4], Some(Event::Done { address: DOMAIN, len: 32 }));
            client.read(now, DOMAIN).unwrap();
        }
    }
}

#[test]
fn a_server_that_begins_no_block_write_gets_segments_from_then_on() {
    // It aborts, or is silent.
    for refusal in [Some("585#8003200001000405"), None] {
        let (mut client, mut data, mut now) = (by_size(), [7; 30], Instant::ZERO);
        client.write(now, DOMAIN, 30).unwrap();
        assert_eq!(client.poll_transmit(now, &mut data), Some(frame("605#C60320001E000000")));
        match refusal {
            Some(refusal) => assert_eq!(client.handle_frame(now, &frame(refusal), &mut data), None),
            None => {
                now = client.poll_timeout().unwrap();
                assert_eq!(client.handle_timeout(now), None);
            }
        }
        for _ in 0..2 {
            assert_eq!(client.poll_transmit(now, &mut data), Some(frame("605#210320001E000000")));
            client.handle_frame(now, &frame("585#6003200000000000"), &mut data);
            let mut ended = None;
            for response in ["585#20", "585#30", "585#20", "585#30", "585#20"] {
                assert!(client.poll_transmit(now, &mut data).is_some());
                ended = client.handle_frame(now, &frame(&format!("{response}00000000000000")), &mut data);
            }
            assert_eq!(ended, Some(Event::Done { address: DOMAIN, len: 30 }));
            client.write(now, DOMAIN, 30).unwrap();
        }
    }
}

#[test]
fn a_dead_node_does_not_count_as_one_without_blocks() {
    let (mut client, mut data) = (by_size(), [7; 30]);
    client.write(Instant::ZERO, DOMAIN, 30).unwrap();
    client.poll_transmit(Instant::ZERO, &mut data);
    let mut ended = None;
    while ended.is_none() {
        let now = client.poll_timeout().unwrap();
        ended = client.handle_timeout(now);
        client.poll_transmit(now, &mut data);
    }
    assert_eq!(ended, Some(Event::Failed(SdoError::TimedOut { address: DOMAIN })));
    client.write(Instant::ZERO, DOMAIN, 30).unwrap();
    assert_eq!(client.poll_transmit(Instant::ZERO, &mut data), Some(frame("605#C60320001E000000")));
}

/// How long a transfer lasts with a server that gives the same answers after every request, each 100 ms after it;
/// and how it ends.
fn stalling(mut client: SdoClient, answers: &[&str]) -> (Duration, Event) {
    let (mut now, mut data) = (Instant::ZERO, [0; 64]);
    let mut at = answers.iter().cycle();
    for _ in 0..100_000 {
        while client.poll_transmit(now, &mut data).is_some() {}
        let deadline = client.poll_timeout().unwrap();
        let answer = now + Duration::from_millis(100);
        now = deadline.min(answer);
        let event = match deadline <= answer {
            true => client.handle_timeout(now),
            false => client.handle_frame(now, &frame(at.next().unwrap()), &mut data),
        };
        if let Some(event) = event {
            return (now.since(Instant::ZERO), event);
        }
    }
    panic!("the transfer never ends");
}

#[test]
fn a_transfer_that_makes_no_progress_ends() {
    let stalled = Event::Failed(SdoError::Stalled { address: DOMAIN });
    let begun = |mut client: SdoClient, first: &str, read: bool| {
        let now = Instant::ZERO;
        if read { client.read(now, DOMAIN) } else { client.write(now, DOMAIN, 60) }.unwrap();
        client.poll_transmit(now, &mut [0; 64]);
        client.handle_frame(now, &frame(first), &mut [0; 64]);
        client
    };
    let ten_seconds = Duration::from_secs(10);
    // Segments without a byte.
    let client = begun(SdoClient::of_node(NODE), "585#4003200000000000", true);
    assert_eq!(stalling(client, &["585#0E00000000000000", "585#1E00000000000000"]), (ten_seconds, stalled));
    // The first segment of a block, for ever.
    let mut client = begun(by_size(), "585#4103200040000000", true);
    while client.poll_transmit(Instant::ZERO, &mut [0; 64]).is_some() {}
    client.handle_frame(Instant::ZERO, &frame("585#C603200040000000"), &mut [0; 64]);
    let (lasted, event) = stalling(client, &["585#0101020304050607"]);
    assert_eq!(event, stalled);
    assert!(lasted > ten_seconds && lasted < Duration::from_millis(10_200), "{lasted:?}: seven bytes came");
    // Nothing of a block is ever confirmed.
    let client = begun(by_size(), "585#A40320007F000000", false);
    let (lasted, event) = stalling(client, &["585#A2007F0000000000"]);
    assert!(matches!(event, Event::Failed(_)) && lasted <= ten_seconds, "{event:?}");
}

#[test]
fn a_slow_transfer_that_makes_progress_does_not_end() {
    let mut client = SdoClient::of_node(NODE);
    let (mut now, mut data) = (Instant::ZERO, vec![0; 7000]);
    client.read(now, DOMAIN).unwrap();
    client.poll_transmit(now, &mut &mut data[..]);
    client.handle_frame(now, &frame("585#4003200000000000"), &mut &mut data[..]);
    // Each segment takes a tenth of the time-out.
    for toggle in [0x00, 0x10].into_iter().cycle().take(999) {
        assert!(client.poll_transmit(now, &mut &mut data[..]).is_some());
        now += Duration::from_millis(100);
        assert!(client.poll_timeout().unwrap() > now);
        let segment = frame(&format!("585#{toggle:02X}01020304050607"));
        assert_eq!(client.handle_frame(now, &segment, &mut &mut data[..]), None);
    }
}
