//! Devices that answer in another way than ours, and are right: no case fails on them.

use std::sync::atomic::AtomicBool;

use lexican_conform::{Tester, Verdict};
use lexican_runtime::host::{Node, VirtualBus};
use lexican_runtime::{CobId, Frame, Instant};

use crate::device::{DeviceUnderTest, NODE};
use crate::faulty::{Fault, Faulty, fault, heard, sent};
use crate::{SUBJECTS, name, settings, sheet};

const fn right(title: &'static str, rules: &'static [crate::faulty::Rule]) -> Fault {
    fault(title, rules, "")
}

/// What is seen in CANopenNode and lely-core, or left open by CiA 301.
const RIGHT: &[Fault] = &[
    right(
        "a transfer that begins while segments are sent is aborted",
        &[heard("605#40..10*").is_answered("585#80......01000405").after(&["585#41081000*"]).until("605#.0*")],
    ),
    right("segment 128 is an unknown command", &[sent("585#80......03000405").becomes("585#80......01000405")]),
    right("a mapping that counts is not mappable", &[sent("585#80..1A0100000106").becomes("585#80..1A0141000406")]),
    right("a mapping that counts is an invalid value", &[sent("585#80..1A..00000106").becomes("585#80..1A..30000906")]),
    right("too many objects do not exist", &[sent("585#80..1A0042000406").becomes("585#80..1A0000000206")]),
    right("an input in an RPDO is read-only", &[sent("585#80..16..41000406").becomes("585#80..16..02000106")]),
    right("an output in a TPDO is write-only", &[sent("585#80..1A..41000406").becomes("585#80..1A..01000106")]),
    right(
        "1003h:01 is a general error while it is empty",
        &[sent("585#8003100124000008").becomes("585#8003100100000008")],
    ),
    right(
        "remote frames may not ask for TPDOs",
        &[
            heard("605#2F001802FC*").is_answered("585#8000180230000906"),
            heard("605#2F001802FD*").is_answered("585#8000180230000906"),
            heard("185#R*"),
        ],
    ),
    right(
        "counting begins with the second SYNC",
        &[
            heard("080#").after(&["605#2F00180203*"]).until("080#"),
            heard("080#").after(&["605#2F00180207*"]).until("080#"),
            heard("080#").after(&["605#2F001802F0*"]).until("080#"),
        ],
    ),
    right(
        "a mapping is not written while it counts, not even with what it is",
        &[
            heard("605#23001A01*").is_answered("585#80001A0100000106").until("605#2F001A0000*"),
            heard("605#2F001A00*").is_answered("585#80001A0000000106").until("605#2300180185010080"),
        ],
    ),
    right(
        "the inhibit time is not written while the PDO exists, nor longer than the event timer",
        &[
            heard("605#2B001803*").is_answered("585#8000180322000008").until("605#2300180185010080"),
            heard("605#2B001803E8*").is_answered("585#8000180330000906").after(&["605#2B00180514*"]),
        ],
    ),
    right(
        "a segment whose toggle bit is wrong is not answered",
        &[heard("605#1B*").after(&["605#21171000*"]).until("605#80*")],
    ),
    right(
        "a TPDO of type 2 comes with the second SYNC from its start value on",
        &[heard("605#2F00180605*").becomes("605#2F00180606*")],
    ),
    right("guarding is not answered before it is configured", &[heard("705#R*").until("605#2F0D1000*")]),
    Fault {
        sheet: Some((
            "[1800sub5]\nParameterName=Event timer\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nDefaultValue=0",
            "[1800sub5]\nParameterName=Event timer\nObjectType=0x7\nDataType=0x0006\nAccessType=ro\nDefaultValue=70",
        )),
        ..right(
            "the event timer is fixed",
            &[
                heard("605#40001805*").is_answered("585#4B00180546000000"),
                heard("605#2B001805*").is_answered("585#8000180502000106"),
                heard("605#2F001805*").is_answered("585#8000180502000106"),
            ],
        )
    },
    Fault {
        sheet: Some((
            "[1800sub3]\nParameterName=Inhibit time\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nDefaultValue=0",
            "[1800sub3]\nParameterName=Inhibit time\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nDefaultValue=100",
        )),
        ..right(
            "an inhibit time that stays what it is is taken",
            &[
                heard("605#40001803*").is_answered("585#4B00180364000000"),
                heard("605#2B0018036400*").is_answered("585#6000180300000000"),
            ],
        )
    },
    Fault {
        sheet: Some((
            "[1016sub1]\nParameterName=Consumer heartbeat time 1\nObjectType=0x7\nDataType=0x0007\nAccessType=rw\nDefaultValue=0",
            "[1016sub1]\nParameterName=Consumer heartbeat time 1\nObjectType=0x7\nDataType=0x0007\nAccessType=rw\nDefaultValue=0x100BB8",
        )),
        ..right("a node is waited for by default", &[sent("585#4316100100000000").becomes("585#43161001B80B1000")])
    },
    right(
        "a transfer that is under way is aborted for another",
        &[heard("605#4000100000000000").is_answered("585#8008100001000405").after(&["585#41081000*"]).until("605#.0*")],
    ),
    right(
        "a parameter is stored as it is written",
        &[
            sent("585#4310100101000000").becomes("585#4310100103000000"),
            heard("605#40171000*").is_answered("585#4B171000D0070000").after(&["605#2B171000D007*"]),
        ],
    ),
    Fault {
        sheet: Some(("1014", "1F99")),
        ..right(
            "there are no emergencies, nor 1014h",
            &[
                sent("085#*"),
                heard("605#..991F*").becomes("605#..1410*"),
                heard("605#..1410*").is_answered("585#8014100000000206"),
                sent("585#..1410*").becomes("585#..991F*"),
            ],
        )
    },
];

#[test]
fn no_case_fails_on_a_device_that_is_right_in_another_way() {
    let mut wrong = Vec::new();
    let subject = &SUBJECTS[0];
    for fault in RIGHT {
        let sheet = sheet(&fault.data_sheet(subject.data_sheet));
        assert!(!sheet.is_unfit, "{}: {}", fault.title, sheet.findings);
        for case in subject.cases().filter(|case| case.id != "306-1/6/2") {
            if let (Err(Verdict::Failed(why)), _) = subject.run(case, &sheet, Some(fault)) {
                wrong.push(format!("{}: {} {why}", fault.title, name(case)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Goes on to OPERATIONAL when it has booted (CiA 302-2).
struct StartsItself(Faulty<DeviceUnderTest>);

impl Node for StartsItself {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        self.0.handle_frame(now, frame);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.0.handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let frame = self.0.poll_transmit(now)?;
        if frame.to_string() == "705#00" {
            self.0.handle_frame(now, &Frame::new(CobId::NMT, &[1, NODE.get()]).unwrap());
        }
        Some(frame)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.0.poll_timeout()
    }
}

#[test]
fn no_case_fails_on_a_device_that_starts_itself() {
    const STARTUP: Fault = right(
        "1F80h is 0",
        &[
            heard("605#40801F00*").is_answered("585#43801F0000000000"),
            heard("605#2.801F00*").is_answered("585#80801F0002000106"),
            heard("605#40801F01*").is_answered("585#80801F0111000906"),
        ],
    );
    let entry = "[1F80]\nParameterName=NMT startup\nObjectType=7\nDataType=7\nAccessType=ro\nPDOMapping=0\n";
    let text = format!("{}\n{entry}", SUBJECTS[0].data_sheet);
    let (list, rest) = text.split_once("[OptionalObjects]\n").unwrap();
    let (count, rest) = rest.split_once('\n').unwrap();
    let number: u32 = count.split_once('=').unwrap().1.trim().parse().unwrap();
    let more = number + 1;
    let says_so = format!("{list}[OptionalObjects]\nSupportedObjects={more}\n{more}=0x1F80\n{rest}");
    // It does so by local control otherwise.
    for (text, startup) in [(&*says_so, Some(&STARTUP)), (SUBJECTS[0].data_sheet, None)] {
        let sheet = sheet(text);
        assert!(!sheet.is_unfit, "{}", sheet.findings);
        for case in SUBJECTS[0].cases().filter(|case| case.id != "306-1/6/2") {
            let bus = VirtualBus::new();
            bus.attach(StartsItself(Faulty::new(DeviceUnderTest::new(), startup)));
            let (mut link, settings, cancelled) = (bus.link(), settings(), AtomicBool::new(false));
            let outcome = Tester::new(&mut link, &sheet, &settings, &cancelled).run(case);
            assert!(!matches!(outcome, Err(Verdict::Failed(_))), "{}: {outcome:?}", name(case));
        }
    }
}

#[test]
fn a_client_whose_identifiers_could_not_be_put_back_is_not_stored() {
    const NO_RESTORE: Fault = Fault {
        sheet: Some(("1011", "1F98")),
        ..right(
            "1280h has what no service may have, and there is no 1011h",
            &[
                heard("605#..981F*").becomes("605#..1110*"),
                sent("585#..1110*").becomes("585#..981F*"),
                heard("605#40801201*").is_answered("585#4380120100000000").until("605#23801201*"),
                heard("605#2380120100000000").is_answered("585#8080120130000906"),
            ],
        )
    };
    let subject = &SUBJECTS[0];
    let sheet = sheet(&NO_RESTORE.data_sheet(subject.data_sheet));
    let case = subject.cases().find(|case| case.plan == "2.30").unwrap();
    let (outcome, frames) = subject.run(case, &sheet, Some(&NO_RESTORE));
    assert!(matches!(outcome, Err(Verdict::NotApplicable(_))), "{outcome:?}");
    assert!(!frames.iter().any(|frame| frame.ends_with("73617665")), "stored: {frames:?}");
}
