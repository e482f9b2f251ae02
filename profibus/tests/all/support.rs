//! A slave whose application records its outputs and answers with their complement, as the slaves of test benches do.
#![allow(dead_code, reason = "not every test needs all of it")]

use lexican_profibus::dp::{Parameters, sap};
use lexican_profibus::fdl::{Data, Decoded, FrameCount, Function, Service, Status, Telegram, decode};
use lexican_profibus::{Application, BitRate, Identity, Slave, State};
use lexican_runtime::{Duration, Instant};

pub(crate) const ADDRESS: u8 = 7;
pub(crate) const MASTER: u8 = 2;

pub(crate) const IDENTITY: Identity =
    Identity { ident: 0x1234, configuration: &[0xF1], inputs: 4, outputs: 4, sync: true, freeze: true };

/// Answers with the complement of its outputs, and remembers all of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Echo {
    pub(crate) outputs: Vec<Vec<u8>>,
    pub(crate) states: Vec<State>,
}

impl Echo {
    pub(crate) fn last(&self) -> &[u8] {
        self.outputs.last().map_or(&[], Vec::as_slice)
    }
}

impl Application for Echo {
    fn take_outputs(&mut self, _: Instant, outputs: &[u8]) {
        self.outputs.push(outputs.to_vec());
    }

    fn write_inputs(&mut self, _: Instant, inputs: &mut [u8]) {
        let last = self.outputs.last().cloned().unwrap_or_default();
        for (number, input) in inputs.iter_mut().enumerate() {
            *input = !last.get(number).copied().unwrap_or(0);
        }
    }

    fn enter(&mut self, _: Instant, state: State) {
        self.states.push(state);
    }
}

/// What came back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    Nothing,
    Acknowledgement,
    Data(Status, Vec<u8>),
}

pub(crate) fn refused() -> Answer {
    Answer::Data(Status::SapNotEnabled, Vec::new())
}

pub(crate) fn data(payload: &[u8]) -> Answer {
    Answer::Data(Status::DataLow, payload.to_vec())
}

/// A slave, and a master that sends what a test says.
pub(crate) struct Rig {
    pub(crate) slave: Slave<Echo>,
    pub(crate) now: Instant,
    pub(crate) from: u8,
    /// The frame count bit of the next request.
    bit: bool,
}

impl Rig {
    pub(crate) fn new() -> Self {
        let slave = Slave::new(ADDRESS, IDENTITY, BitRate(500_000), Echo::default());
        Rig { slave, now: Instant::ZERO, from: MASTER, bit: true }
    }

    pub(crate) fn in_data_exchange() -> Self {
        let mut rig = Rig::new();
        assert_eq!(rig.parameterise(parameters()), Answer::Acknowledgement);
        assert_eq!(rig.service(sap::CHECK_CONFIGURATION, IDENTITY.configuration), Answer::Acknowledgement);
        assert_eq!(rig.slave.state(), State::DataExchange);
        rig
    }

    pub(crate) fn request(&self, to_sap: Option<u8>, payload: &[u8]) -> Vec<u8> {
        let count = FrameCount { bit: self.bit, valid: true };
        self.telegram(ADDRESS, Service::SrdHigh, count, to_sap, payload)
    }

    pub(crate) fn telegram(
        &self,
        to: u8,
        service: Service,
        count: FrameCount,
        to_sap: Option<u8>,
        payload: &[u8],
    ) -> Vec<u8> {
        let from_sap = to_sap.map(|_| sap::MASTER);
        let function = Function::Request { service, count };
        let data = Data { to, from: self.from, to_sap, from_sap, function, payload };
        Telegram::Data(data).encode().expect("a telegram").to_vec()
    }

    /// Sends bytes after a silence and waits for the answer.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Answer {
        self.pass(Duration::from_millis(1));
        self.slave.handle_bytes(self.now, bytes);
        self.now += BitRate(500_000).bits(10);
        assert!(self.slave.poll_transmit(self.now).is_none(), "an answer before T_SDR");
        self.pass(Duration::from_millis(1));
        let Some(bytes) = self.slave.poll_transmit(self.now).map(<[u8]>::to_vec) else { return Answer::Nothing };
        match decode(&bytes) {
            Decoded::Complete(Telegram::Acknowledgement, 1) => Answer::Acknowledgement,
            Decoded::Complete(Telegram::Data(data), len) if len == bytes.len() => {
                assert_eq!((data.to, data.from), (self.from, ADDRESS));
                let Function::Response { station: 0, status } = data.function else { panic!("{data:?}") };
                Answer::Data(status, data.payload.to_vec())
            }
            other => panic!("{other:?} of {bytes:02X?}"),
        }
    }

    pub(crate) fn service(&mut self, to_sap: u8, payload: &[u8]) -> Answer {
        self.bit = !self.bit;
        let request = self.request(Some(to_sap), payload);
        self.send(&request)
    }

    pub(crate) fn exchange(&mut self, outputs: &[u8]) -> Answer {
        self.bit = !self.bit;
        let request = self.request(None, outputs);
        self.send(&request)
    }

    pub(crate) fn parameterise(&mut self, parameters: Parameters<'_>) -> Answer {
        self.service(sap::SET_PARAMETERS, &parameters.head())
    }

    pub(crate) fn control(&mut self, command: lexican_profibus::dp::GlobalControl) {
        let count = FrameCount { bit: false, valid: false };
        let telegram = self.telegram(127, Service::SdnLow, count, Some(sap::GLOBAL_CONTROL), &command.bytes());
        assert_eq!(self.send(&telegram), Answer::Nothing);
    }

    pub(crate) fn pass(&mut self, span: Duration) {
        let until = self.now + span;
        // An answer that nobody takes is due all the time.
        while let Some(due) = self.slave.poll_timeout().filter(|due| *due <= until && *due > self.now) {
            self.now = due;
            self.slave.handle_timeout(due);
        }
        self.now = until;
    }

    pub(crate) fn diagnosis(&mut self) -> String {
        match self.service(sap::DIAGNOSIS, &[]) {
            Answer::Data(Status::DataLow, bytes) => {
                lexican_profibus::dp::Diagnosis::parse(&bytes).expect("six bytes").to_string()
            }
            other => panic!("{other:?}"),
        }
    }
}

pub(crate) fn parameters() -> Parameters<'static> {
    Parameters {
        lock: true,
        unlock: false,
        sync: false,
        freeze: false,
        watchdog: Some((5, 2)),
        min_tsdr_bits: 11,
        ident: IDENTITY.ident,
        groups: 0x01,
        user: &[],
    }
}
