//! Samples values of a node: polls objects, and listens to PDOs.

use std::collections::VecDeque;
use std::fmt::{self, Display};

use lexican_eds::model::Device;
use lexican_runtime::host::{Bytes, StateMachine};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::{self, SdoClient, SdoError};
use lexican_runtime::{AbortCode, Duration, Frame, Instant, NodeId};

use crate::decode::{Decoded, Decoder, Detail};
use crate::values::DeviceValues;
use crate::values::lookup::{ObjectError, resolve};
use crate::values::report::ValueReport;

/// The longest value that is read, in bytes.
const LONGEST: usize = 1024;

/// A signal to sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Signal {
    /// An entry of the dictionary.
    Object(Address),
    /// All values in a PDO.
    Pdo {
        /// Whether it is an RPDO of the device.
        received: bool,
        /// From 1.
        number: u16,
    },
}

impl Signal {
    /// Parses `tpdo1`, `rpdo2`, or an object as [`resolve`] does.
    pub fn parse(device: Option<&Device>, text: &str) -> Result<Self, ObjectError> {
        let lower = text.to_ascii_lowercase();
        let pdo = |prefix| lower.strip_prefix(prefix)?.parse().ok().filter(|number| (1..=512).contains(number));
        match (pdo("rpdo"), pdo("tpdo")) {
            (Some(number), _) => Ok(Signal::Pdo { received: true, number }),
            (_, Some(number)) => Ok(Signal::Pdo { received: false, number }),
            _ => resolve(device, text).map(Signal::Object),
        }
    }
}

/// In the form that [`Signal::parse`] accepts.
impl Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Signal::Object(address) => write!(f, "{address}"),
            Signal::Pdo { received: true, number } => write!(f, "rpdo{number}"),
            Signal::Pdo { received: false, number } => write!(f, "tpdo{number}"),
        }
    }
}

/// Samples signals of one node: a [`StateMachine`] for a link.
///
/// It reads objects in rounds, one after the other. Values in other clients' transfers and in PDOs count as well.
pub struct Sampler<'a> {
    node: NodeId,
    signals: Vec<Signal>,
    decoder: Decoder<'a>,
    client: SdoClient,
    buffer: Bytes,
    /// Entries on which units depend, still to be read once.
    conditions: VecDeque<Address>,
    polled: Vec<Address>,
    /// The position of the next one in `polled`.
    next: usize,
    every: Duration,
    /// The start of the next round; `None` to read nothing.
    round: Option<Instant>,
}

/// What a sampler reports.
#[derive(Clone, Debug, PartialEq)]
pub enum Sampled {
    /// New values.
    Values(Vec<ValueReport>),
    /// An object could not be read. The next round tries again, unless the device lacks the object.
    Failed(SdoError),
}

impl<'a> Sampler<'a> {
    /// Creates a sampler that reads the objects among `signals` at intervals of `every`, from `now` on; with `None` it
    /// only listens.
    #[must_use]
    pub fn new(
        now: Instant,
        node: NodeId,
        device: Option<&'a Device>,
        signals: Vec<Signal>,
        every: Option<Duration>,
    ) -> Self {
        let mut decoder = Decoder::new();
        if let Some(device) = device {
            decoder.introduce(node, device);
        }
        let polled: Vec<_> = signals
            .iter()
            .filter_map(|signal| match signal {
                Signal::Object(address) => Some(*address),
                Signal::Pdo { .. } => None,
            })
            .collect();
        let values = device.map(DeviceValues::new);
        let conditions = values.iter().flat_map(|values| {
            polled.iter().filter_map(|address| values.entry(*address)).flat_map(|entry| values.conditions(entry))
        });
        Sampler {
            node,
            conditions: conditions.collect(),
            polled,
            signals,
            decoder,
            client: SdoClient::of_node(node),
            buffer: Bytes::default(),
            next: 0,
            every: every.unwrap_or_default(),
            round: every.map(|_| now),
        }
    }

    /// Allows the node this much more time to respond, for a link with [latency](lexican_runtime::host::Link::latency).
    #[must_use]
    pub fn with_latency(self, latency: Duration) -> Self {
        let timeout = self.client.timeout() + latency;
        Sampler { client: self.client.with_timeout(timeout), ..self }
    }

    /// Begins the next read when it is due.
    fn begin(&mut self, now: Instant) {
        let Some(round) = self.round.filter(|round| *round <= now && !self.client.is_busy()) else { return };
        let address = match self.conditions.pop_front() {
            Some(condition) => condition,
            None => {
                let Some(address) = self.polled.get(self.next).copied() else { return };
                self.next += 1;
                if self.next >= self.polled.len() {
                    self.next = 0;
                    // If a round takes longer than its interval, the next one follows without a pause.
                    self.round = Some((round + self.every).max(now));
                }
                address
            }
        };
        self.buffer = Bytes::room_for(LONGEST);
        self.client.read(now, address).expect("the client is idle");
    }

    fn failed(&mut self, error: SdoError) -> Option<Sampled> {
        let address = error.address();
        if let SdoError::Aborted { code: AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX, .. } = error
            && let Some(place) = self.polled.iter().position(|polled| *polled == address)
        {
            self.polled.remove(place);
            self.next -= usize::from(place < self.next);
        }
        // An entry that is read only for a unit keeps the value of the data sheet.
        self.signals.contains(&Signal::Object(address)).then_some(Sampled::Failed(error))
    }

    /// The values of the signals in a frame.
    fn values(&self, decoded: Decoded) -> Vec<ValueReport> {
        if decoded.node != Some(self.node) {
            return Vec::new();
        }
        match decoded.detail {
            Detail::Pdo(mut pdo) => {
                let whole = Signal::Pdo { received: pdo.received, number: pdo.number };
                if !self.signals.contains(&whole) {
                    pdo.fields.retain(|field| self.signals.contains(&Signal::Object(field.address)));
                }
                pdo.fields
            }
            Detail::Sdo(sdo) if sdo.complete && sdo.abort.is_none() => {
                let mut report = sdo.report;
                report.take_if(|it| it.text.is_none() || !self.signals.contains(&Signal::Object(it.address)));
                report.into_iter().collect()
            }
            _ => Vec::new(),
        }
    }
}

impl StateMachine for Sampler<'_> {
    type Event = Sampled;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Sampled> {
        let decoded = self.decoder.decode(frame);
        if let Some(sdo_client::Event::Failed(error)) = self.client.handle_frame(now, frame, &mut self.buffer) {
            return self.failed(error);
        }
        let values = self.values(decoded);
        (!values.is_empty()).then_some(Sampled::Values(values))
    }

    fn handle_timeout(&mut self, now: Instant) -> Option<Sampled> {
        match self.client.handle_timeout(now)? {
            sdo_client::Event::Failed(error) => self.failed(error),
            sdo_client::Event::Done { .. } => None,
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.begin(now);
        let frame = self.client.poll_transmit(now, &mut self.buffer)?;
        self.decoder.decode(&frame);
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        if self.client.is_busy() {
            return self.client.poll_timeout();
        }
        self.round.filter(|_| !self.polled.is_empty() || !self.conditions.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use lexican_runtime::host::candump::Line;

    const NODE: NodeId = NodeId::literal(5);

    fn frame(text: &str) -> Frame {
        format!("(0.000000) can0 {text}").parse::<Line>().unwrap().frame
    }

    #[test]
    fn signals_are_objects_and_pdos() {
        let device = samples::drive();
        let check = |text, signal| assert_eq!(Signal::parse(Some(&device), text).ok(), signal, "{text}");
        check("TPDO3", Some(Signal::Pdo { received: false, number: 3 }));
        check("rpdo1", Some(Signal::Pdo { received: true, number: 1 }));
        check("statusword", Some(Signal::Object(Address::new(0x6041, 0))));
        check("tpdo0", None);
    }

    /// Answers requests with these frames; returns what is sampled.
    fn answered(sampler: &mut Sampler<'_>, answers: &[(&str, &str)], until_ms: u64) -> Vec<String> {
        let (mut now, mut lines) = (Instant::ZERO, Vec::new());
        while now <= Instant::from_micros(until_ms * 1000) {
            let mut events = Vec::new();
            while let Some(request) = sampler.poll_transmit(now) {
                let answer = answers.iter().find(|(wanted, _)| request == frame(wanted));
                events.extend(answer.and_then(|(_, answer)| sampler.handle_frame(now, &frame(answer))));
            }
            if sampler.poll_timeout().is_some_and(|due| due <= now) {
                events.extend(sampler.handle_timeout(now));
            }
            for event in events {
                match event {
                    Sampled::Values(reports) => {
                        lines.extend(reports.iter().map(|report| format!("{now} {}", report.brief())));
                    }
                    Sampled::Failed(error) => lines.push(format!("{now} {error}")),
                }
            }
            now += Duration::from_millis(1);
        }
        lines
    }

    #[test]
    fn objects_are_read_in_rounds_and_those_that_do_not_exist_once() {
        let device = samples::drive();
        let object = |index| Signal::Object(Address::new(index, 0));
        let signals = vec![object(0x6060), object(0x2FFF), object(0x6041)];
        let every = Some(Duration::from_millis(10));
        let mut sampler = Sampler::new(Instant::ZERO, NODE, Some(&device), signals, every);
        let answers = [
            ("605#4060600000000000", "585#4F60600002000000"),
            ("605#4041600000000000", "585#4B41600037020000"),
            ("605#40FF2F0000000000", "585#80FF2F0000000206"),
        ];
        let lines = answered(&mut sampler, &answers, 11);
        let mode = "Modes of Operation = profile velocity (2)";
        let status = "Statusword = OPERATION ENABLED + voltage enabled + remote";
        let missing = "2FFF:00: the device aborts: 0602 0000: object does not exist in the object dictionary";
        assert_eq!(
            lines,
            [
                format!("0.000000 {mode}"),
                format!("0.000000 {missing}"),
                format!("0.000000 {status}"),
                format!("0.010000 {mode}"),
                format!("0.010000 {status}"),
            ]
        );
    }

    #[test]
    fn a_listener_takes_what_pdos_and_other_clients_carry() {
        let device = samples::drive();
        let signals = vec![Signal::Pdo { received: false, number: 3 }, Signal::Object(Address::new(0x6060, 0))];
        let mut sampler = Sampler::new(Instant::ZERO, NODE, Some(&device), signals, None);
        assert_eq!((sampler.poll_transmit(Instant::ZERO), sampler.poll_timeout()), (None, None));
        let mut check = |text: &str, expected: &[&str]| {
            let briefs: Vec<_> = match sampler.handle_frame(Instant::ZERO, &frame(text)) {
                Some(Sampled::Values(reports)) => reports.iter().map(ValueReport::brief).collect(),
                event => event.iter().map(|event| format!("{event:?}")).collect(),
            };
            assert_eq!(briefs, expected, "{text}");
        };
        check(
            "385#400205000000",
            &["Statusword = SWITCH ON DISABLED + remote", "Position Actual Value = +5 increments"],
        );
        check("605#2F60600002000000", &[]);
        check("585#6060600000000000", &["Modes of Operation = profile velocity (2)"]);
        check("606#2F60600002000000", &[]);
        check("586#6060600000000000", &[]);
        check("605#4064600000000000", &[]);
        check("585#4364600005000000", &[]);
    }

    #[test]
    fn a_node_without_answer_is_asked_again() {
        let signals = vec![Signal::Object(Address::new(0x6064, 0))];
        let mut sampler = Sampler::new(Instant::ZERO, NODE, None, signals, Some(Duration::from_millis(10)));
        let lines = answered(&mut sampler, &[], 3000);
        assert!(lines.len() >= 2 && lines.iter().all(|line| line.contains("no answer")), "{lines:?}");
    }

    #[test]
    fn a_node_behind_a_latency_has_so_much_longer() {
        let signals = vec![Signal::Object(Address::new(0x6064, 0))];
        let sampler = Sampler::new(Instant::ZERO, NODE, None, signals, Some(Duration::from_millis(10)));
        let mut sampler = sampler.with_latency(Duration::from_secs(2));
        let lines = answered(&mut sampler, &[], 3001);
        assert!(lines.len() == 1 && lines[0].starts_with("3.000000 "), "{lines:?}");
    }
}
