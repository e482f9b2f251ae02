//! A DP-V0 slave: data link layer responder, state machine and services.

use lexican_runtime::{Duration, Instant};

use crate::dp::{self, Diagnosis, GlobalControl, Parameters, diagnosis, sap};
use crate::fdl::{BROADCAST, Data, Decoded, FrameCount, Function, IDLE_BITS, Service, Status, Telegram, Wire, decode};

/// The application behind a slave.
pub trait Application {
    /// Takes new outputs. They are zero when the master is lost, or clears them.
    fn take_outputs(&mut self, now: Instant, outputs: &[u8]);

    /// Writes the inputs for the answer; their length is that of the slave's identity.
    fn write_inputs(&mut self, now: Instant, inputs: &mut [u8]);

    /// The slave has changed to another state.
    fn enter(&mut self, now: Instant, state: State) {
        let _ = (now, state);
    }
}

/// The properties of a slave in its GSD file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The ident number.
    pub ident: u16,
    /// The configuration that Chk_Cfg has to carry.
    pub configuration: &'static [u8],
    /// Length of the inputs in bytes, up to 244.
    pub inputs: u8,
    /// Length of the outputs in bytes, up to 244.
    pub outputs: u8,
    /// Whether it supports Sync.
    pub sync: bool,
    /// Whether it supports Freeze.
    pub freeze: bool,
}

/// In bits per second. A real slave detects it by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitRate(pub u32);

impl BitRate {
    /// All bit rates of PROFIBUS-DP.
    pub const ALL: [BitRate; 10] = [
        BitRate(9_600),
        BitRate(19_200),
        BitRate(45_450),
        BitRate(93_750),
        BitRate(187_500),
        BitRate(500_000),
        BitRate(1_500_000),
        BitRate(3_000_000),
        BitRate(6_000_000),
        BitRate(12_000_000),
    ];

    /// The duration of some bits, rounded up to microseconds.
    #[must_use]
    pub const fn bits(self, bits: u32) -> Duration {
        let rate = if self.0 == 0 { 1 } else { self.0 as u64 };
        Duration::from_micros((bits as u64 * 1_000_000).div_ceil(rate))
    }
}

/// The state of a slave between power-on and data exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It waits for Set_Prm.
    WaitParameters,
    /// It has parameters and waits for Chk_Cfg.
    WaitConfiguration,
    /// Cyclic data is exchanged.
    DataExchange,
}

/// The most bytes of cyclic data in one direction.
const MOST: usize = 244;

/// A slave, which takes bytes of the bus and returns the bytes of its answers.
///
/// # Decisions where the standards are silent or were not available
///
/// | question | here |
/// |---|---|
/// | a service in a state that does not have it, or of another master than the slave's own | RS, SAP not enabled |
/// | Set_Slave_Add, Ident, LSAP status, data to be acknowledged (SDA) | RS: drives with switches have no need of them |
/// | the frame count bit of the request before, but another service | a new request: `profirust` keeps the bit after a refusal |
/// | outputs of another length than the configuration's | a fault of the configuration, and parameters are needed |
/// | what restarts the watchdog | every request of the own master to the slave, and Global_Control |
/// | T_SDR below 11 bits in Set_Prm | 11 bits |
#[derive(Clone, Debug)]
pub struct Slave<A> {
    identity: Identity,
    address: u8,
    bit_rate: BitRate,
    idle: Duration,
    application: A,
    state: State,
    /// The master that has parameterised the slave, from Set_Prm on.
    master: Option<u8>,
    groups: u8,
    min_tsdr_bits: u8,
    /// Bits of the diagnosis that stay set until the next Set_Prm.
    faults: u32,
    watchdog: Option<Duration>,
    watchdog_due: Option<Instant>,
    /// The last outputs; `synchronised` is whether they wait for Sync.
    outputs: [u8; MOST],
    synchronised: bool,
    inputs: [u8; MOST],
    frozen: bool,
    diagnosis_waits: bool,
    received: Wire,
    received_at: Instant,
    /// Source, SAP and frame count bit of the last request; `None` if the bit was not valid.
    counted: Option<(u8, Option<u8>, bool)>,
    answer: Wire,
    answer_due: Option<Instant>,
}

impl<A: Application> Slave<A> {
    /// A slave that has just been switched on.
    #[must_use]
    pub fn new(address: u8, identity: Identity, bit_rate: BitRate, application: A) -> Self {
        Slave {
            identity,
            address,
            bit_rate,
            idle: bit_rate.bits(IDLE_BITS),
            application,
            state: State::WaitParameters,
            master: None,
            groups: 0,
            min_tsdr_bits: 11,
            faults: 0,
            watchdog: None,
            watchdog_due: None,
            outputs: [0; MOST],
            synchronised: false,
            inputs: [0; MOST],
            frozen: false,
            diagnosis_waits: false,
            received: Wire::EMPTY,
            received_at: Instant::ZERO,
            counted: None,
            answer: Wire::EMPTY,
            answer_due: None,
        }
    }

    /// With another idle time before telegrams than 33 bits: through an operating system, bytes come in pieces, with
    /// pauses in between.
    #[must_use]
    pub fn with_idle(self, idle: Duration) -> Self {
        Slave { idle, ..self }
    }

    /// Its address.
    #[must_use]
    pub fn address(&self) -> u8 {
        self.address
    }

    /// Its state.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// What is behind it.
    #[must_use]
    pub fn application(&self) -> &A {
        &self.application
    }

    /// The application behind the slave.
    pub fn application_mut(&mut self) -> &mut A {
        &mut self.application
    }

    /// The present answer to Slave_Diag.
    #[must_use]
    pub fn diagnosis(&self) -> Diagnosis {
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        let bits = self.faults
            | diagnosis::ALWAYS
            | bit(self.state != State::DataExchange, diagnosis::STATION_NOT_READY)
            | bit(self.state == State::WaitParameters, diagnosis::PARAMETERS_REQUIRED)
            | bit(self.watchdog.is_some(), diagnosis::WATCHDOG_ON)
            | bit(self.frozen, diagnosis::FREEZE)
            | bit(self.synchronised, diagnosis::SYNC);
        Diagnosis { bits, master: self.master, ident: self.identity.ident }
    }

    /// Makes the next answer of data exchange announce a diagnosis.
    pub fn announce_diagnosis(&mut self) {
        self.diagnosis_waits = true;
    }

    /// Switches the slave off and on, with another address. The application has its own supply, and keeps its state.
    pub fn restart(&mut self, now: Instant, address: u8) {
        self.leave(now, 0);
        self.address = address;
        (self.counted, self.answer_due, self.received) = (None, None, Wire::EMPTY);
    }

    /// Handles bytes that have come by `now`. Bytes that are no telegram are skipped; after an idle time of 33 bits, a
    /// telegram begins.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        if now.since(self.received_at) > self.idle {
            self.received = Wire::EMPTY;
        }
        self.received_at = now;
        for byte in bytes {
            // There is room: bytes that begin no telegram have been dropped, and a telegram fits.
            let _ = self.received.push(&[*byte]);
            self.take_telegrams(now);
        }
    }

    /// When [`Slave::poll_transmit`] or [`Slave::handle_timeout`] has something to do.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        [self.answer_due, self.watchdog_due].into_iter().flatten().min()
    }

    /// Handles the watchdog.
    pub fn handle_timeout(&mut self, now: Instant) {
        if self.watchdog_due.is_some_and(|due| due <= now) {
            self.leave(now, 0);
        }
    }

    /// The answer, once the bus has been silent for T_SDR after the request.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<&[u8]> {
        self.answer_due.take_if(|due| *due <= now)?;
        Some(&self.answer)
    }

    fn take_telegrams(&mut self, now: Instant) {
        loop {
            let received = self.received;
            match decode(&received) {
                Decoded::Incomplete => return,
                Decoded::Invalid => self.received.drop_first(1),
                Decoded::Complete(telegram, len) => {
                    self.received.drop_first(len);
                    if let Telegram::Data(data) = telegram {
                        self.handle_data(now, data);
                    }
                }
            }
        }
    }

    fn handle_data(&mut self, now: Instant, data: Data<'_>) {
        // Another station goes on: a late answer would disturb it.
        self.answer_due = None;
        let Function::Request { service, count } = data.function else { return };
        if matches!(service, Service::SdnLow | Service::SdnHigh) && (data.to == BROADCAST || data.to == self.address) {
            if data.to_sap == Some(sap::GLOBAL_CONTROL) {
                self.control_globally(now, data);
            }
            return;
        }
        if data.to != self.address {
            return;
        }
        self.answer_due = Some(now + self.bit_rate.bits(self.min_tsdr_bits.max(11).into()));
        if self.is_repeated(&data, count) {
            self.feed_watchdog(now, data.from);
            return;
        }
        let (status, payload) = match service {
            Service::FdlStatus => (Status::Ok, Wire::EMPTY),
            Service::SrdLow | Service::SrdHigh => self.serve(now, data),
            _ => refused(),
        };
        self.feed_watchdog(now, data.from);
        let function = Function::Response { station: 0, status };
        // Data exchange has no SAPs; the answer of a service goes from its SAP to the master's.
        let response = Data {
            to: data.from,
            from: self.address,
            to_sap: data.from_sap,
            from_sap: data.to_sap,
            function,
            payload: &payload,
        };
        let acknowledged = service != Service::FdlStatus && status == Status::Ok;
        let telegram = if acknowledged { Telegram::Acknowledgement } else { Telegram::Data(response) };
        self.answer = telegram.encode().unwrap_or(Wire::EMPTY);
    }

    /// A repeated request, whose answer has been lost, has the same frame count bit as the previous one. If that bit
    /// was not valid, there is no answer to repeat.
    fn is_repeated(&mut self, data: &Data<'_>, count: FrameCount) -> bool {
        let counted = count.valid.then_some((data.from, data.to_sap, count.bit));
        let before = core::mem::replace(&mut self.counted, counted);
        counted.is_some() && before == counted
    }

    fn serve(&mut self, now: Instant, data: Data<'_>) -> (Status, Wire) {
        let Identity { inputs, outputs, configuration, .. } = self.identity;
        let exchanges = self.state == State::DataExchange;
        let own = self.master == Some(data.from);
        match data.to_sap {
            None if exchanges && own => self.exchange(now, data.payload),
            Some(sap::READ_INPUTS) if exchanges => {
                self.look(now);
                (Status::DataLow, wire(&self.inputs[..usize::from(inputs).min(MOST)]))
            }
            Some(sap::READ_OUTPUTS) if exchanges => {
                (Status::DataLow, wire(&self.outputs[..usize::from(outputs).min(MOST)]))
            }
            Some(sap::GET_CONFIGURATION) => (Status::DataLow, wire(configuration)),
            Some(sap::DIAGNOSIS) => {
                self.diagnosis_waits &= !own;
                (Status::DataLow, wire(&self.diagnosis().bytes()))
            }
            Some(sap::SET_PARAMETERS) if own || self.master.is_none() => {
                self.set_parameters(now, data);
                (Status::Ok, Wire::EMPTY)
            }
            Some(sap::CHECK_CONFIGURATION) if own => {
                self.check_configuration(now, data.payload);
                (Status::Ok, Wire::EMPTY)
            }
            _ => refused(),
        }
    }

    fn exchange(&mut self, now: Instant, outputs: &[u8]) -> (Status, Wire) {
        if outputs.len() != usize::from(self.identity.outputs) {
            self.leave(now, diagnosis::CONFIGURATION_FAULT);
            return refused();
        }
        self.outputs[..outputs.len()].copy_from_slice(outputs);
        if !self.synchronised {
            self.application.take_outputs(now, outputs);
        }
        self.look(now);
        let inputs = &self.inputs[..usize::from(self.identity.inputs).min(MOST)];
        match (inputs.is_empty(), self.diagnosis_waits) {
            (true, false) => (Status::Ok, Wire::EMPTY),
            (_, true) => (Status::DataHigh, wire(inputs)),
            (false, false) => (Status::DataLow, wire(inputs)),
        }
    }

    fn look(&mut self, now: Instant) {
        if !self.frozen {
            let len = usize::from(self.identity.inputs).min(MOST);
            self.application.write_inputs(now, &mut self.inputs[..len]);
        }
    }

    fn set_parameters(&mut self, now: Instant, data: Data<'_>) {
        let Some(parameters) = Parameters::parse(data.payload) else {
            return self.leave(now, diagnosis::PARAMETER_FAULT);
        };
        if parameters.unlock {
            return self.leave(now, 0);
        }
        if parameters.min_tsdr_bits != 0 {
            self.min_tsdr_bits = parameters.min_tsdr_bits;
        }
        if !parameters.lock {
            return;
        }
        let Identity { ident, sync, freeze, .. } = self.identity;
        if parameters.sync && !sync || parameters.freeze && !freeze {
            return self.leave(now, diagnosis::NOT_SUPPORTED | diagnosis::PARAMETER_FAULT);
        }
        let watchdog = parameters.watchdog.map(|(a, b)| Duration::from_millis(10 * u64::from(a) * u64::from(b)));
        if parameters.ident != ident || watchdog.is_some_and(Duration::is_zero) {
            return self.leave(now, diagnosis::PARAMETER_FAULT);
        }
        self.leave(now, 0);
        (self.master, self.groups, self.watchdog) = (Some(data.from), parameters.groups, watchdog);
        self.go(now, State::WaitConfiguration);
    }

    fn check_configuration(&mut self, now: Instant, configuration: &[u8]) {
        if configuration == self.identity.configuration {
            self.go(now, State::DataExchange);
        } else {
            self.leave(now, diagnosis::CONFIGURATION_FAULT);
        }
    }

    fn control_globally(&mut self, now: Instant, data: Data<'_>) {
        let Some(command) = GlobalControl::parse(data.payload) else { return };
        let meant = command.groups == 0 || command.groups & self.groups != 0;
        if self.state != State::DataExchange || self.master != Some(data.from) {
            return;
        }
        self.feed_watchdog(now, data.from);
        if !meant {
            return;
        }
        let outputs = usize::from(self.identity.outputs).min(MOST);
        if command.clear {
            self.outputs = [0; MOST];
            self.application.take_outputs(now, &self.outputs[..outputs]);
        }
        // Unsync and unfreeze take precedence over sync and freeze.
        if command.unsync || command.sync && self.identity.sync {
            self.synchronised = !command.unsync;
            self.application.take_outputs(now, &self.outputs[..outputs]);
        }
        if command.unfreeze || command.freeze && self.identity.freeze {
            self.frozen = false;
            self.look(now);
            self.frozen = !command.unfreeze;
        }
    }

    fn feed_watchdog(&mut self, now: Instant, from: u8) {
        if self.master == Some(from) {
            self.watchdog_due = self.watchdog.map(|watchdog| now + watchdog);
        }
    }

    /// Returns to the initial state, with these faults in the diagnosis.
    fn leave(&mut self, now: Instant, faults: u32) {
        self.faults = faults;
        (self.master, self.groups, self.watchdog, self.watchdog_due) = (None, 0, None, None);
        (self.synchronised, self.frozen, self.diagnosis_waits) = (false, false, false);
        if self.state == State::DataExchange {
            self.outputs = [0; MOST];
            self.application.take_outputs(now, &self.outputs[..usize::from(self.identity.outputs).min(MOST)]);
        }
        self.go(now, State::WaitParameters);
    }

    fn go(&mut self, now: Instant, state: State) {
        if self.state != state {
            self.state = state;
            self.application.enter(now, state);
        }
    }
}

fn refused() -> (Status, Wire) {
    (Status::SapNotEnabled, Wire::EMPTY)
}

fn wire(bytes: &[u8]) -> Wire {
    let mut wire = Wire::EMPTY;
    // At most 244 bytes, so they fit.
    let _ = wire.push(bytes);
    wire
}

impl Identity {
    /// Whether lengths and configuration match.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        dp::lengths(self.configuration).is_some_and(|lengths| {
            lengths.inputs == usize::from(self.inputs) && lengths.outputs == usize::from(self.outputs)
        })
    }
}
