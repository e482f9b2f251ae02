//! No bytes on a PROFIBUS line stop a drive behind its slave: afterwards a master gets answers, moves it and stops it.

use lexican_profibus::dp::{Parameters, sap};
use lexican_profibus::fdl::{Data, Decoded, FrameCount, Function, Service, Status, Telegram, decode};
use lexican_profibus::pkw::{Pkw, PkwMaster, Reply, Task, Value};
use lexican_profibus::{BitRate, Slave, State};
use lexican_runtime::{Duration, Instant};
use siko_profibus::{AG03_1, PPO, ProfibusDrive};

const ADDRESS: u8 = 7;
const RATE: BitRate = BitRate(500_000);

/// Bytes on the line, in pieces with pauses between them; a byte gives the length of each piece and pause.
pub fn profibus(data: &[u8]) {
    let mut slave = Slave::new(ADDRESS, AG03_1.identity, RATE, ProfibusDrive::new(Instant::ZERO, &AG03_1, ADDRESS));
    let (mut now, mut rest) = (Instant::ZERO, data);
    while let [head, tail @ ..] = rest {
        let (part, after) = tail.split_at(tail.len().min(usize::from(head & 0x3F)));
        now += Duration::from_micros(u64::from(head >> 6) * 100);
        codecs(part);
        slave.handle_bytes(now, part);
        if slave.poll_timeout().is_some_and(|due| due <= now) {
            slave.handle_timeout(now);
        }
        let _answer = slave.poll_transmit(now);
        rest = after;
    }
    // Longer than any watchdog.
    now += Duration::from_secs(1000);
    slave.handle_timeout(now);
    let _answer = slave.poll_transmit(now);
    // Without a watchdog, a slave stays with the master that has set its parameters.
    assert!(slave.state() == State::WaitParameters || slave.poll_timeout().is_none());
    let from = slave.diagnosis().master.unwrap_or(2);
    let parameters = Parameters {
        lock: true,
        unlock: false,
        sync: false,
        freeze: false,
        watchdog: None,
        min_tsdr_bits: 11,
        ident: AG03_1.identity.ident,
        groups: 0,
        user: &[],
    };
    let mut master = Requests { slave, now, from };
    assert_eq!(master.request(Some(sap::SET_PARAMETERS), &parameters.head()), None);
    assert_eq!(master.request(Some(sap::CHECK_CONFIGURATION), AG03_1.identity.configuration), None);
    let read = Task::Read { number: 1033 }.pkw();
    let mut outputs = [0; 14];
    PPO.set_pkw(&mut outputs, read);
    let inputs = master.request(None, &outputs).expect("data");
    let reply = PPO.pkw(&inputs).map(Reply::parse);
    assert_eq!(reply, Some(Ok(Some(Reply::Value(Value::DoubleWord(1))))));
}

struct Requests {
    slave: Slave<ProfibusDrive>,
    now: Instant,
    /// The master's address.
    from: u8,
}

impl Requests {
    /// Returns the data of the answer; empty for an acknowledgement.
    fn request(&mut self, to_sap: Option<u8>, payload: &[u8]) -> Option<Vec<u8>> {
        self.now += Duration::from_millis(1);
        let function = Function::Request { service: Service::SrdHigh, count: FrameCount { bit: true, valid: false } };
        let from_sap = to_sap.map(|_| sap::MASTER);
        let data = Data { to: ADDRESS, from: self.from, to_sap, from_sap, function, payload };
        let telegram = Telegram::Data(data).encode().expect("it fits");
        self.slave.handle_bytes(self.now, &telegram);
        self.now += Duration::from_millis(1);
        let answer = self.slave.poll_transmit(self.now).expect("each request is answered").to_vec();
        match decode(&answer) {
            Decoded::Complete(Telegram::Acknowledgement, 1) => None,
            Decoded::Complete(Telegram::Data(data), _) => {
                assert_eq!(data.function, Function::Response { station: 0, status: Status::DataLow });
                Some(data.payload.to_vec())
            }
            other => panic!("{other:?}"),
        }
    }
}

/// What was parsed is written so that it parses to the same value, and no reply stops the master's side.
fn codecs(bytes: &[u8]) {
    if let Decoded::Complete(telegram, _) = decode(bytes) {
        let wire = telegram.encode().expect("it has come in a telegram");
        assert!(matches!(decode(&wire), Decoded::Complete(again, _) if again == telegram));
    }
    if let Some(pkw) = Pkw::parse(bytes) {
        assert_eq!(Pkw::parse(&pkw.bytes()), Some(pkw));
        let mut master = PkwMaster::new(Duration::from_millis(100));
        if let Ok(Some(task)) = Task::parse(pkw) {
            assert_eq!(Task::parse(task.pkw()), Ok(Some(task)));
            assert!(master.start(Instant::ZERO, task));
        }
        master.handle_input(Pkw::default());
        for part in bytes.chunks(8).filter_map(Pkw::parse) {
            master.handle_input(part);
        }
        let over = Instant::ZERO + Duration::from_millis(100);
        master.handle_timeout(over);
        assert!(!master.is_busy());
    }
}
