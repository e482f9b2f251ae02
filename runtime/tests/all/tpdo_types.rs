//! Every transmission type with every order of events, compared with the text of CiA 301 (7.5.2.37).

use crate::common;
use crate::common::testing::TestOd;
use lexican_runtime::Instant;
use lexican_runtime::object::{Address, Mapped};
use lexican_runtime::service::mapping::Mapping;
use lexican_runtime::service::tpdo::{Parameters, Tpdo, Triggers};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};

const VALUE: Address = Address::new(0x2000, 0);

#[derive(Clone, Copy, Debug)]
enum Step {
    /// The object has another value, and the application reports the change.
    Changed,
    /// The object has another value, and the application has the values compared.
    Compared,
    /// The value is the same, and the application has the values compared.
    Same,
    Sync,
    Request,
    Transmit,
}

const STEPS: [Step; 6] = [Step::Changed, Step::Compared, Step::Same, Step::Sync, Step::Request, Step::Transmit];

/// What the text of the standard requires.
#[derive(Default)]
struct Words {
    code: u8,
    value: u8,
    /// The value that the receivers of the PDO have, or are about to get.
    known: u8,
    syncs: u8,
    event: bool,
    /// The value at the last SYNC, for remote frames.
    sampled: Option<u8>,
    /// A sampled value that is still to be sent.
    sample: Option<u8>,
    /// Whether the present value is to be sent.
    asked: bool,
}

impl Words {
    fn take(&mut self, step: Step) -> Option<u8> {
        match step {
            Step::Changed | Step::Compared => {
                self.value ^= 1;
                self.event |= matches!(step, Step::Changed) || self.value != self.known;
            }
            Step::Same => self.event |= self.value != self.known,
            Step::Sync => {
                self.syncs += 1;
                let is_due = match self.code {
                    // At the next SYNC after an event.
                    0 => core::mem::take(&mut self.event),
                    n @ 1..=240 => self.syncs.is_multiple_of(n),
                    _ => false,
                };
                // Type 252 sends this sample when it is requested.
                self.sampled = Some(self.value);
                if is_due {
                    self.sample = Some(self.value);
                    self.known = self.value;
                }
            }
            Step::Request if self.code == 252 => self.sample = self.sampled,
            Step::Request => self.asked = true,
            Step::Transmit => {
                let event = self.code >= 254 && core::mem::take(&mut self.event);
                let asked = core::mem::take(&mut self.asked) || event;
                let sent = self.sample.take().or(asked.then_some(self.value));
                self.known = sent.unwrap_or(self.known);
                return sent;
            }
        }
        None
    }
}

fn tpdo(code: u8) -> Tpdo {
    let mut mapping: Mapping = Mapping::EMPTY;
    assert!(mapping.push(Mapped::new(0x2000, 0, 8)));
    let transmission = TransmissionType::from_code(code);
    let mut pdo =
        Tpdo::new(Parameters { cob_id: PdoCobId(0x185), transmission, ..Parameters::OFF }, mapping, Triggers::ALL);
    pdo.start(Instant::ZERO);
    pdo
}

fn check(code: u8, steps: &[Step]) {
    let (mut pdo, mut od) = (tpdo(code), TestOd::new("2000:00 u8 rw tpdo 0"));
    // Entering OPERATIONAL is an event.
    let mut words = Words { code, event: matches!(code, 0 | 254 | 255), ..Words::default() };
    let request = common::frame("185#R1");
    let steps = [&[Step::Transmit], steps, &[Step::Transmit, Step::Sync, Step::Transmit]].concat();
    for (at, &step) in steps.iter().enumerate() {
        let expected = words.take(step);
        od.set(0x2000, 0, words.value.into());
        let mut sent = None;
        match step {
            Step::Changed => pdo.changed(VALUE),
            Step::Compared | Step::Same => pdo.compare(&mut od),
            Step::Sync => {
                let is_sampled = pdo.handle_sync(None, &mut od);
                assert!(!is_sampled || pdo.is_due(Instant::ZERO));
            }
            Step::Request => pdo.handle_frame(Instant::ZERO, &request),
            Step::Transmit => sent = pdo.poll_transmit(Instant::ZERO, &mut od),
        }
        assert_eq!(sent.map(|frame| frame.data()[0]), expected, "type {code}: {:?}", &steps[..=at]);
    }
}

#[test]
fn every_type_is_sent_as_the_standard_says_in_whatever_order_things_happen() {
    for code in [0, 1, 2, 3, 252, 253, 254, 255] {
        for number in 0..STEPS.len().pow(6) {
            let steps: Vec<Step> = (0..6).map(|at| STEPS[number / STEPS.len().pow(at) % STEPS.len()]).collect();
            check(code, &steps);
        }
    }
}

#[test]
fn cyclic_types_are_sent_with_every_nth_sync() {
    for code in 1..=240 {
        let mut steps = [Step::Changed, Step::Sync, Step::Compared, Step::Transmit].repeat(usize::from(code));
        steps.push(Step::Same);
        check(code, &steps);
    }
}
