//! Correct devices that answer otherwise than the runtime's: no case fails on them.

use lexican_conform::Verdict;
use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Frame, Instant};

use crate::device::{DeviceUnderTest, NODE};
use crate::faulty::{Faulty, fault, table};
use crate::{SUBJECTS, link_to, name, run, settings, sheet};

#[test]
fn no_case_fails_on_a_device_that_is_right_in_another_way() {
    let mut wrong = Vec::new();
    let subject = &SUBJECTS[0];
    for fault in &table(include_str!("../../conformance/faults/right.txt")) {
        let sheet = sheet(&fault.data_sheet(subject.data_sheet));
        assert!(!sheet.is_unfit, "{}: {}", fault.title, sheet.findings);
        for case in subject.cases().filter(|case| case.id != "306-1/6/2") {
            if let (Err(Verdict::Failed(why)), _) = subject.run(case, &sheet, fault) {
                wrong.push(format!("{}: {} {why}", fault.title, name(case)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A device that enters OPERATIONAL by itself when it has booted (CiA 302-2).
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
    const STARTUP: &str = "heard 605#40801F00* answered 585#43801F0000000000; heard 605#2.801F00* answered \
                           585#80801F0002000106; heard 605#40801F01* answered 585#80801F0111000906";
    let entry = "[1F80]\nParameterName=NMT startup\nObjectType=7\nDataType=7\nAccessType=ro\nPDOMapping=0\n";
    let text = format!("{}\n{entry}", SUBJECTS[0].data_sheet);
    let (list, rest) = text.split_once("[OptionalObjects]\n").unwrap();
    let (count, rest) = rest.split_once('\n').unwrap();
    let number: u32 = count.split_once('=').unwrap().1.trim().parse().unwrap();
    let more = number + 1;
    let says_so = format!("{list}[OptionalObjects]\nSupportedObjects={more}\n{more}=0x1F80\n{rest}");
    // Without 1F80h, it does so by local control.
    for (text, startup) in [(&*says_so, STARTUP), (SUBJECTS[0].data_sheet, "")] {
        let sheet = sheet(text);
        assert!(!sheet.is_unfit, "{}", sheet.findings);
        for case in SUBJECTS[0].cases().filter(|case| case.id != "306-1/6/2") {
            let device = StartsItself(Faulty::new(DeviceUnderTest::new(), &fault(startup)));
            let (outcome, _) = run(case, &sheet, &settings(), &mut link_to(device));
            assert!(!matches!(outcome, Err(Verdict::Failed(_))), "{}: {outcome:?}", name(case));
        }
    }
}

#[test]
fn a_client_whose_identifiers_could_not_be_put_back_is_not_stored() {
    // 1280h has the identifier that no service may have, and there is no 1011h.
    let no_restore = fault(
        "sheet 1011 becomes 1F98; heard 605#..981F* becomes 605#..1110*; sent 585#..1110* becomes 585#..981F*; heard \
         605#40801201* answered 585#4380120100000000 until 605#23801201*; heard 605#2380120100000000 answered \
         585#8080120130000906",
    );
    let subject = &SUBJECTS[0];
    let sheet = sheet(&no_restore.data_sheet(subject.data_sheet));
    let case = subject.cases().find(|case| case.plan == "2.30").unwrap();
    let (outcome, frames) = subject.run(case, &sheet, &no_restore);
    assert!(matches!(outcome, Err(Verdict::NotApplicable(_))), "{outcome:?}");
    assert!(!frames.iter().any(|frame| frame.ends_with("73617665")), "stored: {frames:?}");
}
