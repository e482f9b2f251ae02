//! Every format reads what it has written, and no bytes make a reader panic.

use std::io::Cursor;

use lexican_runtime::{CobId, Frame, Instant};
use lexican_toolbox::log::{Direction, Format, Reader, Record, Skipped, TrcVersion, Writer};
use proptest::prelude::*;

fn written(format: Format, records: &[Record]) -> Vec<u8> {
    let mut writer = Writer::in_memory(format);
    records.iter().for_each(|record| writer.write(record).unwrap());
    writer.into_bytes()
}

fn read(bytes: Vec<u8>) -> (Vec<Record>, Format, Skipped) {
    let mut reader = Reader::new("log", Cursor::new(bytes), None).unwrap();
    let records = reader.by_ref().map(|record| record.unwrap()).collect();
    (records, reader.format(), reader.skipped())
}

/// The record as a format preserves it, in a log that begins at `start`.
fn kept(format: Format, record: &Record, start: Instant) -> Record {
    let mut record = record.clone();
    let us = record.at.as_micros();
    let to = |unit: u64| Instant::from_micros(start.as_micros() + (us - start.as_micros()) / unit * unit);
    let keeps = format.facts();
    record.at = match keeps.times.split(" since").next() {
        // The start has a resolution of a tenth of a millisecond, and times relative to it of a millisecond.
        Some("1 ms") => Instant::from_micros(start.as_micros() / 100 * 100 + (us - start.as_micros()) / 1000 * 1000),
        Some("100 us") => to(100),
        _ => record.at,
    };
    if keeps.interface == "-" {
        record.interface = "can0".into();
    }
    if keeps.direction != "kept" {
        record.direction = Direction::Received;
    }
    record
}

fn frame() -> impl Strategy<Value = Frame> {
    let id = prop_oneof![
        (0..=0x7FFu16).prop_map(|id| CobId::standard(id).unwrap()),
        (0..0x1FFF_FFFFu32).prop_map(|id| CobId::extended(id).unwrap()),
    ];
    let data = proptest::collection::vec(any::<u8>(), 0..=8);
    prop_oneof![
        4 => (id.clone(), data).prop_map(|(id, data)| Frame::new(id, &data).unwrap()),
        1 => (id, 0..=8u8).prop_map(|(id, len)| Frame::remote(id, len).unwrap()),
    ]
}

fn records() -> impl Strategy<Value = Vec<Record>> {
    let record = (0..5_000_000u64, 0..4u8, any::<bool>(), frame());
    (0..4_000_000_000_000_000u64, proptest::collection::vec(record, 0..200)).prop_map(|(start, records)| {
        let mut us = start;
        let record = |(span, interface, is_sent, frame)| {
            us += span;
            let direction = if is_sent { Direction::Sent } else { Direction::Received };
            Record { at: Instant::from_micros(us), interface: format!("can{interface}").into(), direction, frame }
        };
        records.into_iter().map(record).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_format_reads_what_it_has_written(records in records()) {
        for format in Format::all() {
            let bytes = written(format, &records);
            let (found, recognised, skipped) = read(bytes);
            let start = records.first().map_or(Instant::ZERO, |record| record.at);
            let expected: Vec<_> = records.iter().map(|record| kept(format, record, start)).collect();
            prop_assert_eq!(&found, &expected, "{}", format);
            prop_assert_eq!(skipped, Skipped::default());
            // A reader takes the version from the file.
            let same = std::mem::discriminant(&recognised) == std::mem::discriminant(&format);
            prop_assert!(same, "{} is taken for {}", format, recognised);
        }
    }

    #[test]
    fn a_log_that_is_cut_off_has_the_frames_before(records in records(), cut in 0..10_000usize) {
        for format in Format::all() {
            let mut bytes = written(format, &records);
            bytes.truncate(bytes.len() - cut % (bytes.len() + 1));
            let all = read(written(format, &records)).0;
            let Ok(reader) = Reader::new("log", Cursor::new(bytes), Some(format)) else { continue };
            let mut found: Vec<_> = reader.map_while(Result::ok).collect();
            // The last line may be cut so that it is still a frame.
            if !matches!(format, Format::Pcap | Format::Pcapng | Format::Blf) {
                found.pop();
            }
            prop_assert_eq!(&found[..], &all[..found.len()], "{}", format);
        }
    }

    #[test]
    fn any_change_of_a_log_is_read_to_an_end(records in records(), changes in proptest::collection::vec(any::<(usize, u8)>(), 1..20)) {
        for format in Format::all() {
            let mut bytes = written(format, &records);
            let len = bytes.len().max(1);
            for (at, byte) in &changes {
                if let Some(place) = bytes.get_mut(at % len) {
                    *place = *byte;
                }
            }
            if let Ok(reader) = Reader::new("log", Cursor::new(bytes), Some(format)) {
                for result in reader {
                    if let Err(error) = result {
                        prop_assert!(error.to_string().starts_with("log:"), "{}", error);
                    }
                }
            }
        }
    }
}

#[test]
fn errors_name_the_line_or_the_byte() {
    let record = Record {
        at: Instant::from_micros(1_000_000),
        interface: "can0".into(),
        direction: Direction::Received,
        frame: Frame::from_array(CobId::SYNC, [1]),
    };
    for (format, tail, error) in [
        (Format::Candump, &b"(1.5) can0 800#\n"[..], "log:2: this is no CAN frame"),
        (Format::Asc, b"1.0 1 605 Rx d 2 01\n", "log:8: this is no CAN frame"),
        (Format::Trc(TrcVersion::V2_1), b"2 x DT 1 0605 Rx - 0\n", "log:9: the line has no time stamp"),
        (Format::Pcap, &[0xFF; 16], "log: before byte 72: a block of 4294967295 bytes cannot be here"),
        (Format::Pcapng, &[0x06, 0, 0, 0, 13, 0, 0, 0], "log: before byte 116: a block of 13 bytes cannot be here"),
        (Format::Blf, &[0xFF; 16], "there is no object here"),
    ] {
        let bytes = [&written(format, std::slice::from_ref(&record)), tail].concat();
        let mut reader = Reader::new("log", Cursor::new(bytes), None).unwrap();
        assert_eq!(reader.next().unwrap().unwrap(), record, "{format}");
        let found = reader.next().unwrap().unwrap_err().to_string();
        assert!(found.contains(error), "{format}: {found}");
        assert!(reader.next().is_none(), "{format}: reading ends at an error");
    }
    let unknown = Reader::new("log", &b"nonsense\n"[..], None).err().unwrap();
    assert_eq!(unknown.to_string(), format!("log: this is no log of a known format: {}", Format::kinds()));
    assert_eq!(read(b" \n".to_vec()).0, []);
}

#[test]
fn captures_of_both_byte_orders_and_resolutions_are_read() {
    let packet = [0x80, 0, 1, 0x85, 2, 0, 0, 0, 0xAB, 0xCD];
    let expected = |us| vec![(us, "00000185#ABCD".to_owned())];
    let frames = |bytes: Vec<u8>| {
        let (records, _, skipped) = read(bytes);
        assert_eq!(skipped, Skipped::default());
        records.iter().map(|record| (record.at.as_micros(), record.frame.to_string())).collect::<Vec<_>>()
    };
    let pcap = |magic: u32, parts: u32, order: fn(u32) -> [u8; 4]| {
        let words = [magic, 0, 0, 0, 65_535, 227, 7, parts, packet.len() as u32, packet.len() as u32];
        [words.map(order).as_flattened(), &packet].concat()
    };
    assert_eq!(frames(pcap(0xA1B2_C3D4, 5, u32::to_be_bytes)), expected(7_000_005));
    assert_eq!(frames(pcap(0xA1B2_3C4D, 5_999, u32::to_le_bytes)), expected(7_000_005));
    assert_eq!(frames(pcap(0xA1B2_3C4D, 5_999, u32::to_be_bytes)), expected(7_000_005));
    // Big endian, nanoseconds and an offset of 2 s, an unknown block, a packet of the older kind, and a simple one.
    let block = |kind: u32, body: &[u8]| {
        let len = (body.len() as u32 + 12).to_be_bytes();
        [&kind.to_be_bytes()[..], &len, body, &len].concat()
    };
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_be_bytes()).collect::<Vec<u8>>();
    let section = block(0x0A0D_0D0A, &words(&[0x1A2B_3C4D, 0x0001_0000, u32::MAX, u32::MAX]));
    let options = words(&[0x0009_0001, 0x0900_0000, 0x000E_0008, 0, 2, 0]);
    let interface = block(1, &[&words(&[0x00E3_0000, 0])[..], &options].concat());
    let padded = [&packet[..], &[0, 0]].concat();
    let ticks = 5_000_005_999u64;
    let len = packet.len() as u32;
    let stamped = [&words(&[0, (ticks >> 32) as u32, ticks as u32, len, len])[..], &padded].concat();
    let simple = [&words(&[len])[..], &padded].concat();
    let file = [section, interface, block(0x0BAD, &[0; 8]), block(2, &stamped), block(6, &stamped), block(3, &simple)];
    let [late, early] = [expected(7_000_005), expected(2_000_000)];
    assert_eq!(frames(file.concat()), [late.clone(), late, early].concat());
}

#[test]
fn what_is_no_classic_frame_is_counted() {
    let mut bytes = written(Format::Pcap, &[]);
    // CAN FD by its flag, an error frame, and a packet that is cut off.
    for (id, len, flags, captured) in [(0x123u32, 8, 4, 16), (0x2000_0004, 8, 0, 16), (0x123, 8, 0, 12)] {
        let words = [1u32, 0, captured, 16].map(u32::to_le_bytes);
        bytes.extend(words.as_flattened());
        bytes.extend(id.to_be_bytes());
        bytes.extend([len, flags, 0, 0]);
        bytes.extend(vec![0; captured as usize - 8]);
    }
    bytes.push(0);
    let (records, _, skipped) = read(bytes);
    assert_eq!((records, skipped), (vec![], Skipped { fd: 1, errors: 1, other: 1, cut: true }));
}
