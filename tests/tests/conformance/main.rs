//! The 127 cases of the CiA conformance test plan, against the device of `tests/conformance/device.eds`: the
//! runtime's own, with the dictionary that was generated from that data sheet.
//!
//! The numbers are those of the plan (CCT 3.0.3.10); what a case does is said in our words. A case that the
//! device cannot have names the fact of the data sheet that makes it so, and the fact is looked up there. The
//! table is shown by `cargo test -p lexican-tests --test conformance -- --nocapture`.

#[allow(unreachable_pub, reason = "none of the modules of a test is reachable")]
mod cases;
#[allow(unreachable_pub, reason = "none of the modules of a test is reachable")]
mod dut;
#[allow(unreachable_pub, reason = "none of the modules of a test is reachable")]
mod sheet;

mod od {
    lexican_runtime::include_od!("device");
}

use cases::*;
use dut::Dut;
use lexican_eds::model;
use lexican_runtime::AbortCode;
use lexican_runtime::device::Event;
use lexican_runtime::object::Access;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::nmt::NmtState;

type Test = fn(&mut Dut);
type Fact = fn(&model::Device) -> bool;

enum Case {
    Run(Test),
    /// The device cannot have it: the fact of its data sheet, in words and to be looked up.
    NotApplicable(&'static str, Fact),
}
use Case::{NotApplicable, Run};

/// Number, what it is about, and the case.
const CASES: &[(&str, &str, Case)] = &[
    ("1.0", "the data sheet has no findings", Run(|_| assert_eq!(sheet::findings(), ""))),
    ("2.1", "1000h is read", Run(|dut| assert_eq!(dut.read(0x1000, 0), Ok(0x192)))),
    ("2.2", "entries are written and read back", Run(read_back)),
    ("2.3", "1000h is not written", Run(|dut| assert_eq!(dut.write(0x1000, 0, &[0; 4]), Err(AbortCode::READ_ONLY)))),
    ("2.4", "a write-only entry is not read", Run(|dut| assert_eq!(dut.read(0x2001, 0), Err(AbortCode::WRITE_ONLY)))),
    ("2.5", "1000h:01 does not exist", Run(|dut| assert_eq!(dut.read(0x1000, 1), Err(AbortCode::NO_SUCH_SUB_INDEX)))),
    ("2.6", "1004h does not exist", Run(|dut| assert_eq!(dut.read(0x1004, 0), Err(AbortCode::NO_SUCH_OBJECT)))),
    ("2.7", "an unknown command is aborted", Run(|dut| dut.aborts("605#E000100000000000", AbortCode::UNKNOWN_COMMAND))),
    (
        "2.8",
        "four bytes do not fit one or two",
        Run(|dut| {
            assert_eq!(dut.write(0x1017, 0, &[0; 4]), Err(AbortCode::LENGTH_TOO_HIGH));
            assert_eq!(dut.write(0x1019, 0, &[0; 4]), Err(AbortCode::LENGTH_TOO_HIGH));
        }),
    ),
    (
        "2.9",
        "one byte does not fill two or four",
        Run(|dut| {
            assert_eq!(dut.write(0x1017, 0, &[0]), Err(AbortCode::LENGTH_TOO_LOW));
            assert_eq!(dut.write(0x1006, 0, &[0]), Err(AbortCode::LENGTH_TOO_LOW));
        }),
    ),
    (
        "2.10",
        "a value above its limit",
        Run(|dut| assert_eq!(dut.write(0x2002, 0, &[201, 0]), Err(AbortCode::VALUE_TOO_HIGH))),
    ),
    (
        "2.11",
        "a value below its limit",
        Run(|dut| assert_eq!(dut.write(0x2002, 0, &[9, 0]), Err(AbortCode::VALUE_TOO_LOW))),
    ),
    (
        "2.12",
        "the default server is the predefined one",
        Run(|dut| {
            assert_eq!((dut.read(0x1200, 1), dut.read(0x1200, 2)), (Ok(0x605), Ok(0x585)));
        }),
    ),
    ("2.13", "1000h in segments", Run(|dut| assert_eq!(dut.upload(0x1000, 0), Ok(vec![0x92, 1, 0, 0])))),
    ("2.14", "100Ch written in segments", Run(|dut| dut.written(Dut::download_segments, 0x100C))),
    ("2.15", "1017h written in segments", Run(|dut| dut.written(Dut::download_segments, 0x1017))),
    (
        "2.16",
        "more than four bytes in segments",
        Run(|dut| assert_eq!(dut.upload(0x1008, 0), Ok(b"test-device".to_vec()))),
    ),
    (
        "2.17",
        "a wrong toggle bit is aborted",
        Run(|dut| {
            dut.send("605#4008100000000000");
            dut.aborts("605#7000000000000000", AbortCode::TOGGLE_BIT);
        }),
    ),
    (
        "2.18",
        "segments to the end, twice",
        Run(|dut| {
            for _ in 0..2 {
                assert_eq!(dut.upload(0x1008, 0), Ok(b"test-device".to_vec()));
            }
        }),
    ),
    (
        "2.19",
        "1000h as a block without CRC",
        Run(|dut| assert_eq!(dut.upload_block(0x1000, 0, false), [0x92, 1, 0, 0])),
    ),
    (
        "2.20",
        "100Ch as a block without CRC",
        Run(|dut| dut.written(|dut, at, data| dut.download_block(at, data, false), 0x100C)),
    ),
    (
        "2.21",
        "1017h as a block without CRC",
        Run(|dut| dut.written(|dut, at, data| dut.download_block(at, data, false), 0x1017)),
    ),
    ("2.22", "several segments as a block", Run(|dut| assert_eq!(dut.upload_block(0x1008, 0, false), b"test-device"))),
    ("2.23", "a block with CRC", Run(|dut| assert_eq!(dut.upload_block(0x1008, 0, true), b"test-device"))),
    (
        "2.24",
        "100Ch as a block with CRC",
        Run(|dut| dut.written(|dut, at, data| dut.download_block(at, data, true), 0x100C)),
    ),
    (
        "2.25",
        "1017h as a block with CRC",
        Run(|dut| dut.written(|dut, at, data| dut.download_block(at, data, true), 0x1017)),
    ),
    (
        "2.26",
        "a block of 128 segments is impossible",
        Run(|dut| {
            dut.aborts("605#A408100080000000", AbortCode::INVALID_BLOCK_SIZE);
        }),
    ),
    (
        "2.27",
        "segment 128 cannot be acknowledged",
        Run(|dut| {
            dut.send("605#A40810007F000000");
            dut.send("605#A300000000000000");
            dut.aborts("605#A2807F0000000000", AbortCode::INVALID_SEQUENCE_NUMBER);
        }),
    ),
    (
        "2.28",
        "additional servers are read",
        Run(|dut| {
            assert_eq!([0, 1, 2, 3].map(|sub| dut.read(0x1201, sub).is_ok()), [true; 4]);
        }),
    ),
    (
        "2.29",
        "additional servers are what they were after a reset",
        Run(|dut| {
            dut.write(0x1201, 1, &0x6D0_u32.to_le_bytes()).unwrap();
            dut.send("000#8205");
            assert_eq!(dut.read(0x1201, 1), Ok(0x8000_0000));
        }),
    ),
    (
        "2.30",
        "clients are stored",
        NotApplicable("no object 1280h to 12FFh: it has no SDO client", |device| {
            device.objects.iter().all(|object| !(0x1280..=0x12FF).contains(&object.index))
        }),
    ),
    ("3.1", "parameters of RPDOs are read", Run(|dut| dut.scan(0x1400..=0x15FF, 3))),
    ("3.2", "parameters of TPDOs are read", Run(|dut| dut.scan(0x1800..=0x19FF, 2))),
    ("3.3", "OPERATIONAL: remote frame", Run(|dut| remote(dut, NmtState::Operational))),
    ("3.4", "OPERATIONAL: event", Run(|dut| event(dut, NmtState::Operational))),
    ("3.5", "OPERATIONAL: event timer", Run(|dut| timer(dut, NmtState::Operational))),
    ("3.6", "OPERATIONAL: cyclic", Run(|dut| cyclic(dut, NmtState::Operational))),
    ("3.7", "OPERATIONAL: acyclic", Run(|dut| acyclic(dut, NmtState::Operational))),
    ("3.8", "OPERATIONAL: SYNC start value", Run(|dut| sync_start(dut, NmtState::Operational))),
    ("3.9", "STOPPED: remote frame", Run(|dut| remote(dut, NmtState::Stopped))),
    ("3.10", "STOPPED: event", Run(|dut| event(dut, NmtState::Stopped))),
    ("3.11", "STOPPED: event timer", Run(|dut| timer(dut, NmtState::Stopped))),
    ("3.12", "STOPPED: cyclic", Run(|dut| cyclic(dut, NmtState::Stopped))),
    ("3.13", "STOPPED: acyclic", Run(|dut| acyclic(dut, NmtState::Stopped))),
    ("3.14", "STOPPED: SYNC start value", Run(|dut| sync_start(dut, NmtState::Stopped))),
    ("3.15", "PRE-OPERATIONAL: remote frame", Run(|dut| remote(dut, NmtState::PreOperational))),
    ("3.16", "PRE-OPERATIONAL: event", Run(|dut| event(dut, NmtState::PreOperational))),
    ("3.17", "PRE-OPERATIONAL: event timer", Run(|dut| timer(dut, NmtState::PreOperational))),
    ("3.18", "PRE-OPERATIONAL: cyclic", Run(|dut| cyclic(dut, NmtState::PreOperational))),
    ("3.19", "PRE-OPERATIONAL: acyclic", Run(|dut| acyclic(dut, NmtState::PreOperational))),
    ("3.20", "PRE-OPERATIONAL: SYNC start value", Run(|dut| sync_start(dut, NmtState::PreOperational))),
    ("3.21", "what is mapped exists", Run(mapped_exists)),
    (
        "3.22",
        "a mapping by the procedure",
        Run(|dut| {
            dut.unmap(0x1800);
            dut.write_u32(0x1A00, 1, 0x6064_0020).unwrap();
            dut.write(0x1A00, 0, &[1]).unwrap();
            dut.write_u32(0x1800, 1, 0x185).unwrap();
            dut.enter(NmtState::Operational);
            assert_eq!(dut.take_sent(), ["185#FEFFFFFF"]);
        }),
    ),
    (
        "3.23",
        "a mapping without the procedure",
        Run(|dut| {
            dut.write_u32(0x1800, 1, 0x8000_0185).unwrap();
            assert_eq!(dut.write_u32(0x1A00, 1, 0x6064_0020), Err(AbortCode::UNSUPPORTED_ACCESS));
        }),
    ),
    (
        "3.24",
        "a mapping of a PDO that exists",
        Run(|dut| {
            assert_eq!(dut.write(0x1A00, 0, &[0]), Err(AbortCode::UNSUPPORTED_ACCESS));
        }),
    ),
    (
        "3.25",
        "too many objects",
        Run(|dut| {
            dut.unmap(0x1800);
            assert_eq!(dut.write(0x1A00, 0, &[65]), Err(AbortCode::PDO_LENGTH_EXCEEDED));
        }),
    ),
    (
        "3.26",
        "objects that are too long",
        Run(|dut| {
            dut.unmap(0x1800);
            dut.write_u32(0x1A00, 1, 0x2000_0340).unwrap();
            dut.write_u32(0x1A00, 2, 0x6041_0010).unwrap();
            assert_eq!(dut.write(0x1A00, 0, &[2]), Err(AbortCode::PDO_LENGTH_EXCEEDED));
        }),
    ),
    ("3.27", "an output may be received", Run(|dut| assert_eq!(dut.map(0x1400, 0x607A_0020), Ok(())))),
    (
        "3.28",
        "an input may not be received",
        Run(|dut| assert_eq!(dut.map(0x1400, 0x6064_0020), Err(AbortCode::NOT_MAPPABLE))),
    ),
    (
        "3.29",
        "what no PDO maps may not be received",
        Run(|dut| assert_eq!(dut.map(0x1400, 0x2001_0020), Err(AbortCode::NOT_MAPPABLE))),
    ),
    ("3.30", "an input may be transmitted", Run(|dut| assert_eq!(dut.map(0x1800, 0x6064_0020), Ok(())))),
    (
        "3.31",
        "an output may not be transmitted",
        Run(|dut| assert_eq!(dut.map(0x1800, 0x607A_0020), Err(AbortCode::NOT_MAPPABLE))),
    ),
    (
        "3.32",
        "what no PDO maps may not be transmitted",
        Run(|dut| assert_eq!(dut.map(0x1800, 0x2001_0020), Err(AbortCode::NOT_MAPPABLE))),
    ),
    ("3.33", "a dummy may be received", Run(|dut| assert_eq!(dut.map(0x1400, 0x0005_0008), Ok(())))),
    ("4.1", "entries are read as their access says", Run(read_all)),
    ("4.2", "values are the defaults", Run(compare_defaults)),
    ("4.3", "read-only entries are not written", Run(write_read_only)),
    (
        "4.4",
        "write-only entries are not read",
        Run(|dut| {
            for entry in dut.entries(|entry| entry.access == Access::Wo) {
                assert_eq!(dut.read(entry.address.index(), entry.address.sub()), Err(AbortCode::WRITE_ONLY));
            }
        }),
    ),
    (
        "4.5",
        "sub-index FFh",
        NotApplicable("no object has sub-index FFh", |device| device.entries().all(|entry| entry.sub != 0xFF)),
    ),
    (
        "4.6",
        "limits hold",
        Run(|dut| {
            for (value, result) in
                [(10, Ok(())), (200, Ok(())), (9, Err(AbortCode::VALUE_TOO_LOW)), (201, Err(AbortCode::VALUE_TOO_HIGH))]
            {
                assert_eq!(dut.write(0x2002, 0, &[value, 0]), result);
            }
        }),
    ),
    ("4.7", "entries are accessed as their access says", Run(read_all)),
    ("4.8", "read-only and read-write values are the defaults", Run(compare_defaults)),
    ("4.9", "what was read may be written", Run(write_back)),
    ("5.1", "1014h is the predefined one", Run(|dut| assert_eq!(dut.read(0x1014, 0), Ok(0x85)))),
    ("5.2", "1001h is read", Run(|dut| assert_eq!(dut.read(0x1001, 0), Ok(0)))),
    ("5.3", "1003h:01 is empty", Run(|dut| assert_eq!(dut.read(0x1003, 1), Err(AbortCode::NO_DATA)))),
    ("5.4", "an emergency is sent", Run(|dut| assert_eq!(dut.emergency(), ["085#2031050000000000"]))),
    (
        "5.5",
        "1001h shows the error",
        Run(|dut| {
            dut.emergency();
            assert_eq!(dut.read(0x1001, 0), Ok(5));
        }),
    ),
    (
        "5.6",
        "1003h:01 has the code that was sent",
        Run(|dut| {
            dut.emergency();
            assert_eq!((dut.read(0x1003, 0), dut.read(0x1003, 1)), (Ok(1), Ok(0x3120)));
        }),
    ),
    ("6.1", "SYNC has 080h", Run(|dut| assert_eq!(dut.read(0x1005, 0), Ok(0x80)))),
    (
        "6.2",
        "SYNC is produced in its period",
        Run(|dut| {
            dut.produce_sync();
            assert_eq!(dut.pass_ms(100).len(), 10);
        }),
    ),
    (
        "6.3",
        "TPDOs follow SYNC",
        Run(|dut| {
            dut.write(0x1800, 2, &[2]).unwrap();
            dut.produce_sync();
            dut.enter(NmtState::Operational);
            dut.take_sent();
            let sent = dut.pass_ms(100);
            assert_eq!(sent.iter().filter(|frame| frame.starts_with("185")).count(), 5);
        }),
    ),
    (
        "6.4",
        "a consumer needs no period",
        Run(|dut| {
            dut.write_u32(0x1006, 0, 0).unwrap();
            dut.write_u32(0x1005, 0, 0x80).unwrap();
            assert_eq!(dut.pass_ms(100), [""; 0]);
            dut.send("080#");
            assert!(matches!(dut.events.last(), Some(Event::Sync { .. })));
        }),
    ),
    (
        "6.5",
        "the counter overflow has a range",
        Run(|dut| {
            for bad in [1, 241, 255] {
                assert_eq!(dut.write(0x1019, 0, &[bad]), Err(AbortCode::INVALID_VALUE));
            }
        }),
    ),
    (
        "6.6",
        "overflow 0 is no counter",
        Run(|dut| {
            dut.write(0x1019, 0, &[0]).unwrap();
            dut.produce_sync();
            assert_eq!(dut.pass_ms(20), ["080#", "080#"]);
        }),
    ),
    (
        "6.7",
        "the counter counts",
        Run(|dut| {
            dut.write(0x1019, 0, &[2]).unwrap();
            dut.produce_sync();
            assert_eq!(dut.pass_ms(30), ["080#01", "080#02", "080#01"]);
        }),
    ),
    (
        "6.8",
        "the counter overflow is stored",
        Run(|dut| {
            dut.write(0x1019, 0, &[10]).unwrap();
            dut.write(0x1010, 1, b"save").unwrap();
            dut.send("000#8105");
            assert_eq!(dut.read(0x1019, 0), Ok(10));
        }),
    ),
    (
        "6.9",
        "the counter overflow stays while there is a period",
        Run(|dut| {
            dut.write_u32(0x1006, 0, 10_000).unwrap();
            assert_eq!(dut.write(0x1019, 0, &[10]), Err(AbortCode::DEVICE_STATE));
        }),
    ),
    (
        "6.10",
        "SYNC is stored, and produced after a reset",
        Run(|dut| {
            dut.produce_sync();
            dut.write(0x1010, 1, b"save").unwrap();
            dut.send("000#8105");
            assert_eq!(dut.pass_ms(20), ["080#", "080#"]);
        }),
    ),
    (
        "7.1",
        "100Ch and 100Dh are read",
        Run(|dut| assert_eq!((dut.read(0x100C, 0), dut.read(0x100D, 0)), (Ok(0), Ok(0)))),
    ),
    ("7.2", "a guarding request is answered", Run(|dut| assert_eq!(dut.send("705#R1"), ["705#7F"]))),
    (
        "7.3",
        "the toggle bit toggles",
        Run(|dut| {
            assert_eq!(["", "", ""].map(|_| dut.send("705#R1").concat()), ["705#7F", "705#FF", "705#7F"]);
        }),
    ),
    (
        "7.4",
        "requests to others are not answered",
        Run(|dut| {
            for id in (0x701..=0x77F).filter(|&id| id != 0x705) {
                assert_eq!(dut.send(&format!("{id:03X}#R1")), [""; 0]);
            }
        }),
    ),
    (
        "7.5",
        "guarding is configured",
        Run(|dut| {
            dut.guard();
            assert_eq!((dut.read(0x100C, 0), dut.read(0x100D, 0)), (Ok(100), Ok(2)));
        }),
    ),
    (
        "7.6",
        "life guarding notices silence",
        Run(|dut| {
            dut.guard();
            dut.send("705#R1");
            assert_eq!(dut.pass_ms(199), [""; 0]);
            assert_eq!(dut.pass_ms(1), ["085#3081110000000000"]);
        }),
    ),
    ("7.101", "1017h is written", Run(|dut| assert_eq!(dut.write(0x1017, 0, &[100, 0]), Ok(())))),
    (
        "7.102",
        "heartbeats are counted",
        Run(|dut| {
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            assert_eq!(dut.pass_ms(1000), ["705#7F"; 11]);
        }),
    ),
    (
        "7.103",
        "the heartbeat is switched off",
        Run(|dut| {
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            dut.write(0x1017, 0, &[0, 0]).unwrap();
            assert_eq!(dut.pass_ms(1000), [""; 0]);
        }),
    ),
    (
        "7.104",
        "a node in 1016h twice",
        Run(|dut| {
            dut.write_u32(0x1016, 1, 0x0010_0064).unwrap();
            assert_eq!(dut.write_u32(0x1016, 2, 0x0010_0064), Err(AbortCode::PARAMETER_INCOMPATIBLE));
        }),
    ),
    (
        "7.105",
        "heartbeats in time",
        Run(|dut| {
            dut.write_u32(0x1016, 1, 0x0010_0064).unwrap();
            for _ in 0..20 {
                dut.send("710#05");
                assert_eq!(dut.pass_ms(90), [""; 0]);
            }
        }),
    ),
    (
        "7.106",
        "heartbeats too late",
        Run(|dut| {
            dut.write_u32(0x1016, 1, 0x0010_0064).unwrap();
            dut.send("710#05");
            assert_eq!(dut.pass_ms(110), ["085#3081110000000000"]);
        }),
    ),
    (
        "7.107",
        "the consumer begins anew after a reset",
        Run(|dut| {
            dut.write_u32(0x1016, 1, 0x0010_0064).unwrap();
            dut.send("710#05");
            dut.send("000#8105");
            assert_eq!(dut.pass_ms(1000), [""; 0]);
        }),
    ),
    (
        "7.201",
        "heartbeat and guarding have their objects",
        Run(|dut| {
            assert!([0x1017, 0x100C, 0x100D].iter().all(|&index| dut.read(index, 0).is_ok()));
        }),
    ),
    (
        "7.202",
        "heartbeat off",
        Run(|dut| {
            dut.write(0x1017, 0, &[0, 0]).unwrap();
            assert_eq!(dut.pass_ms(1000), [""; 0]);
        }),
    ),
    (
        "7.203",
        "heartbeat off: guarding works",
        Run(|dut| {
            dut.guard();
            assert_eq!(dut.send("705#R1"), ["705#7F"]);
        }),
    ),
    (
        "7.204",
        "guarding off, heartbeat on",
        Run(|dut| {
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            assert_eq!(dut.pass_ms(100), ["705#7F"; 2]);
        }),
    ),
    (
        "7.205",
        "guarding off, heartbeat on: no answers",
        Run(|dut| {
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            dut.pass_ms(50);
            assert_eq!(dut.send("705#R1"), [""; 0]);
        }),
    ),
    (
        "7.206",
        "both on: heartbeats",
        Run(|dut| {
            dut.guard();
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            assert_eq!(dut.pass_ms(1000), ["705#7F"; 11]);
        }),
    ),
    (
        "7.207",
        "both on: no answers",
        Run(|dut| {
            dut.guard();
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            dut.pass_ms(50);
            assert_eq!(dut.send("705#R1"), [""; 0]);
        }),
    ),
    (
        "8.1",
        "1010h:01 refuses another signature",
        Run(|dut| assert_eq!(dut.write(0x1010, 1, b"evas"), Err(AbortCode::CANNOT_TRANSFER))),
    ),
    ("8.2", "1010h:01 stores", Run(|dut| dut.stores(1))),
    (
        "8.3",
        "1011h:01 refuses another signature",
        Run(|dut| assert_eq!(dut.write(0x1011, 1, b"daol"), Err(AbortCode::CANNOT_TRANSFER))),
    ),
    ("8.4", "1011h:01 restores with the next reset", Run(|dut| dut.restores(1))),
    (
        "8.5",
        "1010h:02 refuses another signature",
        Run(|dut| assert_eq!(dut.write(0x1010, 2, b"evas"), Err(AbortCode::CANNOT_TRANSFER))),
    ),
    ("8.6", "1010h:02 stores", Run(|dut| dut.stores(2))),
    (
        "8.7",
        "1011h:02 refuses another signature",
        Run(|dut| assert_eq!(dut.write(0x1011, 2, b"daol"), Err(AbortCode::CANNOT_TRANSFER))),
    ),
    ("8.8", "1011h:02 restores with the next reset", Run(|dut| dut.restores(2))),
    (
        "8.9",
        "1020h is stored",
        Run(|dut| {
            dut.write_u32(0x1020, 1, 1234).unwrap();
            dut.write(0x1010, 1, b"save").unwrap();
            dut.send("000#8105");
            assert_eq!(dut.read(0x1020, 1), Ok(1234));
        }),
    ),
    (
        "8.10",
        "restricted identifiers are refused",
        Run(|dut| {
            for (index, sub, off) in [(0x1014, 0, 0x8000_0085), (0x1400, 1, 0x8000_0205), (0x1800, 1, 0x8000_0185)] {
                dut.write_u32(index, sub, off).unwrap();
                for restricted in [0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x7FF] {
                    assert_eq!(dut.write_u32(index, sub, restricted), Err(AbortCode::INVALID_VALUE), "{index:04X}");
                }
            }
        }),
    ),
    (
        "9.1",
        "boot-up, and defaults after it",
        Run(|dut| {
            dut.write(0x1017, 0, &[100, 0]).unwrap();
            assert_eq!(dut.send("000#8105"), ["705#00"]);
            assert_eq!(dut.read(0x1017, 0), Ok(0));
        }),
    ),
    (
        "9.2",
        "PRE-OPERATIONAL follows the boot-up message",
        Run(|dut| {
            assert_eq!(dut.send("000#8205"), ["705#00"]);
            assert_eq!(dut.device.nmt_state(), NmtState::PreOperational);
            dut.allows(true, false);
        }),
    ),
    (
        "9.3",
        "OPERATIONAL",
        Run(|dut| {
            dut.enter(NmtState::Operational);
            dut.allows(true, true);
        }),
    ),
    (
        "9.4",
        "STOPPED",
        Run(|dut| {
            dut.enter(NmtState::Stopped);
            dut.allows(false, false);
        }),
    ),
    (
        "10.1",
        "both resets from every state",
        Run(|dut| {
            for state in STATES {
                for reset in ["000#8105", "000#8205", "000#8100", "000#8200"] {
                    dut.enter(state);
                    dut.take_sent();
                    assert_eq!(dut.send(reset), ["705#00"]);
                    assert_eq!(dut.device.nmt_state(), NmtState::PreOperational);
                }
            }
        }),
    ),
    ("10.2", "PRE-OPERATIONAL from every state", Run(|dut| transitions(dut, 0x80, NmtState::PreOperational))),
    ("10.3", "OPERATIONAL from every state", Run(|dut| transitions(dut, 0x01, NmtState::Operational))),
    ("10.4", "STOPPED from every state", Run(|dut| transitions(dut, 0x02, NmtState::Stopped))),
];

const STATES: [NmtState; 3] = [NmtState::PreOperational, NmtState::Operational, NmtState::Stopped];

#[test]
fn every_case_of_the_plan_passes_or_is_not_applicable() {
    let device = sheet::device();
    let (mut passed, mut not_applicable, mut failed) = (0, 0, Vec::new());
    for (number, about, case) in CASES {
        let holds = match case {
            NotApplicable(_, fact) => fact(&device),
            Run(test) => std::panic::catch_unwind(|| test(&mut Dut::new())).is_ok(),
        };
        let outcome = match (holds, case) {
            (true, Run(_)) => "passed".to_owned(),
            (true, NotApplicable(fact, _)) => format!("not applicable: {fact}"),
            (false, Run(_)) => "FAILED".to_owned(),
            (false, NotApplicable(fact, _)) => format!("FAILED: the data sheet does not say that {fact}"),
        };
        println!("{number:>6} {about:<55} {outcome}");
        match (holds, case) {
            (true, Run(_)) => passed += 1,
            (true, NotApplicable(..)) => not_applicable += 1,
            (false, _) => failed.push(*number),
        }
    }
    println!("{passed} passed, {not_applicable} not applicable, {} failed", failed.len());
    assert_eq!(failed, [""; 0]);
    assert_eq!((CASES.len(), passed, not_applicable), (127, 125, 2));
}

#[test]
fn no_case_is_there_twice() {
    let numbers: std::collections::BTreeSet<&str> = CASES.iter().map(|(number, ..)| *number).collect();
    assert_eq!(numbers.len(), CASES.len());
}

// Beyond the plan.

#[test]
fn a_sync_start_value_means_nothing_to_a_sync_without_counter() {
    let mut dut = Dut::new();
    dut.write_u32(0x1800, 1, 0x8000_0185).unwrap();
    dut.write(0x1800, 6, &[5]).unwrap();
    dut.write_u32(0x1800, 1, 0x185).unwrap();
    assert!(tpdo(&mut dut, 2, NmtState::Operational));
    assert_eq!([(); 4].map(|()| dut.send("080#").len()), [1, 0, 1, 0]);
}

#[test]
fn an_error_that_the_device_still_has_is_not_told_as_over() {
    let mut dut = Dut::new();
    dut.write_u32(0x1016, 1, 0x0010_0064).unwrap();
    dut.send("710#05");
    assert_eq!(dut.pass_ms(110), ["085#3081110000000000"]);
    dut.device.emergency(ErrorCode(0x8100), ErrorRegister::COMMUNICATION, [0; 5], &mut dut.od);
    dut.pull();
    assert_eq!(dut.take_sent(), ["085#0081110000000000"]);
    dut.device.clear(ErrorRegister::COMMUNICATION, &mut dut.od);
    dut.pull();
    assert_eq!(dut.take_sent(), [""; 0], "the heartbeat is still lost");
    assert_eq!(dut.read(0x1001, 0), Ok(0x11));
    assert_eq!(dut.send("710#05"), ["085#0000000000000000"]);
    assert_eq!(dut.read(0x1001, 0), Ok(0));
}
