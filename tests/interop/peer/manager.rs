//! The manager: tries every service on a device with the dictionary of `peer.eds`.

use std::time::Instant as WallClock;

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Bytes, Incoming, Link, Pump};
use lexican_runtime::manager::{Event, Manager, Remote};
use lexican_runtime::object::{Address, TimeOfDay};
use lexican_runtime::service::lss_manager::{self, Busy, LssManager};
use lexican_runtime::service::sdo_client::{self, SdoClient, SdoError};
use lexican_runtime::wire::lss::{LssState, Part};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

use crate::device::Outcome;
use crate::od;

const STORE: Address = Address::new(0x2005, 0);
const SECOND: Duration = Duration::from_secs(1);

/// Prints a line for each service; fails if one of them fails.
pub(crate) fn run(link: impl Link, node: NodeId) -> Outcome<()> {
    let network = Network::new(link);
    let mut run = Run { network: Some(network), node, failed: 0 };
    run.watch()?;
    run.report("LSS", Run::lss);
    run.report("boot-up", Run::boot_up);
    run.report("heartbeat", Run::heartbeat);
    run.report("node guarding", Run::guarding);
    run.report("NMT", Run::nmt);
    run.report("SDO read expedited", Run::read_expedited);
    run.report("SDO write expedited", Run::write_expedited);
    run.report("SDO read segmented", Run::read_segmented);
    run.report("SDO write segmented", Run::write_segmented);
    run.report("SDO read block", Run::read_block);
    run.report("SDO write block", Run::write_block);
    run.report("SDO aborts", Run::aborts);
    run.report("PDO", Run::pdo);
    run.report("SYNC", Run::sync);
    run.report("TIME", Run::time);
    run.report("EMCY", Run::emcy);
    run.report("SDO reads per second", Run::speed);
    if run.failed == 0 { Ok(()) } else { Err(format!("{} services failed", run.failed).into()) }
}

/// Reads one object again and again for `seconds`; fails if an answer is lost.
#[expect(clippy::disallowed_methods, reason = "the rate is one of real time")]
pub(crate) fn read_on(mut link: impl Link, node: NodeId, seconds: u64) -> Outcome<()> {
    link.listen_to(&[0x080, 0x580, 0x700].map(|base| CobId::of_node(base, node)))?;
    let mut network = Network::new(link);
    let begin = WallClock::now();
    let (mut answered, mut lost) = (0_u32, 0_u32);
    while begin.elapsed().as_secs() < seconds {
        match network.read(node, od::DEVICE_TYPE) {
            Ok(_) => answered += 1,
            Err(AccessError::Sdo { .. }) => lost += 1,
            Err(error) => return Err(error.into()),
        }
    }
    let rate = f64::from(answered) / begin.elapsed().as_secs_f64();
    let verdict = if lost == 0 { "ok" } else { "failed" };
    println!("answers beside a full bus\t{verdict}\t{rate:.0}/s, {lost} of {} lost", answered + lost);
    if lost == 0 { Ok(()) } else { Err(format!("{lost} answers were lost").into()) }
}

struct Run<L> {
    /// `None` only while the link is used without the network.
    network: Option<Network<L>>,
    node: NodeId,
    failed: u32,
}

impl<L: Link> Run<L> {
    fn report(&mut self, service: &str, try_it: fn(&mut Self) -> Outcome<String>) {
        match try_it(self) {
            Ok(remark) => println!("{service}\tok\t{remark}"),
            Err(error) => {
                self.failed += 1;
                println!("{service}\tfailed\t{error}");
            }
        }
    }

    fn network(&mut self) -> &mut Network<L> {
        self.network.as_mut().expect("the link was given back")
    }

    fn look_after(&mut self, remote: Remote) -> Outcome<()> {
        let now = self.network().now();
        Ok(self.network().manager().add(now, remote)?)
    }

    /// Monitors the node's heartbeat.
    fn watch(&mut self) -> Outcome<()> {
        self.look_after(Remote::new(self.node).with_heartbeat(Duration::from_millis(500)))
    }

    /// Uses the link without the network.
    fn with_link<R>(&mut self, work: impl FnOnce(&mut L) -> Outcome<R>) -> Outcome<R> {
        let mut link = self.network.take().expect("the link was given back").into_link();
        let outcome = work(&mut link);
        self.network = Some(Network::new(link));
        self.watch()?;
        outcome
    }

    fn expect(&mut self, what: &str, pick: impl Fn(&Event) -> bool) -> Outcome<()> {
        let found = self.network().wait_for(SECOND.times(3), |event| pick(event).then_some(()))?;
        found.ok_or_else(|| format!("no {what}").into())
    }

    /// Finds a device without a node-ID, gives it one, and waits until it boots.
    fn lss(&mut self) -> Outcome<String> {
        let node = self.node;
        let vendor = self.with_link(|link| {
            let vendor = match operate(link, LssManager::fastscan)? {
                lss_manager::Event::Found(identity) => identity.vendor,
                other => return Err(format!("{other:?} instead of a device").into()),
            };
            same(&operate(link, |lss| lss.configure_node(Some(node)))?, &lss_manager::Event::Done)?;
            same(&operate(link, LssManager::store)?, &lss_manager::Event::Done)?;
            let inquired = operate(link, |lss| lss.inquire(Part::Serial))?;
            same(&inquired, &lss_manager::Event::Inquired(Part::Serial, 0x1234_5678))?;
            let mut lss = LssManager::new();
            lss.switch_global(LssState::Waiting)?;
            let frame = lss.poll_transmit(link.now()).ok_or("nothing to send")?;
            link.send(&frame)?;
            Ok(vendor)
        })?;
        same(&vendor, &0x4C58)?;
        self.expect("boot-up message", |event| *event == Event::BootedUp { node })?;
        Ok("fast scan, configure, store, inquire".to_owned())
    }

    /// Guards a device without heartbeat, by remote frames.
    fn guarding(&mut self) -> Outcome<String> {
        let node = self.node;
        self.network().write(node, od::PRODUCER_HEARTBEAT_TIME, 0)?;
        self.look_after(Remote::new(node).with_guarding(Duration::from_millis(50), 3))?;
        let outcome = self.follow_guarding();
        self.watch()?;
        self.network().write(node, od::PRODUCER_HEARTBEAT_TIME, 100)?;
        self.expect("heartbeat", |event| matches!(event, Event::Appeared { .. }))?;
        outcome
    }

    fn follow_guarding(&mut self) -> Outcome<String> {
        let node = self.node;
        self.expect("answer", |event| matches!(event, Event::Appeared { .. }))?;
        for (command, state) in
            [(NmtCommand::Stop, NmtState::Stopped), (NmtCommand::EnterPreOperational, NmtState::PreOperational)]
        {
            self.network().command(command, Some(node))?;
            self.expect("change of the state", |event| *event == Event::StateChanged { node, state })?;
        }
        Ok(String::new())
    }

    fn boot_up(&mut self) -> Outcome<String> {
        let node = self.node;
        self.network().command(NmtCommand::ResetNode, Some(node))?;
        self.expect("boot-up message", |event| *event == Event::BootedUp { node })?;
        Ok(String::new())
    }

    fn heartbeat(&mut self) -> Outcome<String> {
        let node = self.node;
        self.network().write(node, od::PRODUCER_HEARTBEAT_TIME, 100)?;
        self.expect("heartbeat", |event| matches!(event, Event::StateChanged { .. } | Event::Appeared { .. }))?;
        self.network().write(node, od::PRODUCER_HEARTBEAT_TIME, 0)?;
        self.expect("loss of the heartbeat", |event| *event == Event::Lost { node })?;
        self.network().write(node, od::PRODUCER_HEARTBEAT_TIME, 100)?;
        self.expect("return of the heartbeat", |event| matches!(event, Event::Appeared { .. }))?;
        Ok("lost and back, too".to_owned())
    }

    fn nmt(&mut self) -> Outcome<String> {
        let node = self.node;
        for (command, state) in [
            (NmtCommand::Start, NmtState::Operational),
            (NmtCommand::Stop, NmtState::Stopped),
            (NmtCommand::EnterPreOperational, NmtState::PreOperational),
        ] {
            self.network().command(command, Some(node))?;
            self.expect("change of the state", |event| *event == Event::StateChanged { node, state })?;
        }
        Ok(String::new())
    }

    fn read_expedited(&mut self) -> Outcome<String> {
        let node = self.node;
        same(&self.network().read(node, od::DEVICE_TYPE)?, &0)?;
        same(&self.network().read(node, od::IDENTITY_OBJECT.serial_number())?, &0x1234_5678)?;
        Ok(String::new())
    }

    fn write_expedited(&mut self) -> Outcome<String> {
        let node = self.node;
        for value in [10, 1000] {
            self.network().write(node, od::LIMITED_VALUE, value)?;
            same(&self.network().read(node, od::LIMITED_VALUE)?, &value)?;
        }
        Ok(String::new())
    }

    fn read_segmented(&mut self) -> Outcome<String> {
        let node = self.node;
        let name = self.network().read_bytes(node, Address::new(0x1008, 0))?;
        same(&name, &b"lexican interoperability peer".to_vec())?;
        let counter = self.network().read(node, od::COUNTER)?;
        same(&counter, &0x0123_4567_89AB_CDEF)?;
        Ok(String::new())
    }

    fn write_segmented(&mut self) -> Outcome<String> {
        let node = self.node;
        for len in [5, 7, 8, 500] {
            self.network().write_bytes(node, STORE, &pattern(len))?;
            same(&self.network().read_bytes(node, STORE)?, &pattern(len))?;
        }
        Ok("5 to 500 bytes".to_owned())
    }

    fn read_block(&mut self) -> Outcome<String> {
        let node = self.node;
        self.network().write_bytes(node, STORE, &pattern(5000))?;
        let (data, blocks) = self.with_link(|link| read_by_block(link, node, STORE))?;
        same(&data, &pattern(5000))?;
        Ok(if blocks { "5000 bytes" } else { "the device knows no blocks; 5000 bytes in segments instead" }.to_owned())
    }

    fn write_block(&mut self) -> Outcome<String> {
        let node = self.node;
        let sdo = SdoClient::of_node(node).with_block_writes_from(1);
        self.look_after(Remote::new(node).with_heartbeat(Duration::from_millis(500)).with_sdo(sdo))?;
        for len in [8, 889, 890, 5000] {
            self.network().write_bytes(node, STORE, &pattern(len))?;
            same(&self.network().read_bytes(node, STORE)?, &pattern(len))?;
        }
        Ok("8 to 5000 bytes".to_owned())
    }

    fn aborts(&mut self) -> Outcome<String> {
        let node = self.node;
        let read = |index, sub| Address::new(index, sub);
        for (address, write, code) in [
            (read(0x3000, 0), None, AbortCode::NO_SUCH_OBJECT),
            (read(0x1018, 9), None, AbortCode::NO_SUCH_SUB_INDEX),
            (read(0x1000, 0), Some(&[0u8; 4][..]), AbortCode::READ_ONLY),
            (read(0x2003, 0), None, AbortCode::WRITE_ONLY),
        ] {
            let outcome = match write {
                Some(data) => self.network().write_bytes(node, address, data),
                None => self.network().read_bytes(node, address).map(drop),
            };
            match outcome {
                Err(AccessError::Sdo { error: SdoError::Aborted { code: got, .. }, .. }) if got == code => {}
                other => return Err(format!("{address}: {other:?} instead of {code:?}").into()),
            }
        }
        Ok(String::new())
    }

    fn pdo(&mut self) -> Outcome<String> {
        let node = self.node;
        self.network().command(NmtCommand::Start, Some(node))?;
        let operational = |event: &Event| {
            // The first heartbeat that is received, or one after others.
            matches!(event, Event::StateChanged { state, .. } | Event::Appeared { state, .. }
                if *state == NmtState::Operational)
        };
        self.expect("OPERATIONAL", operational)?;
        for value in [1_i32, -2, 1_000_000] {
            let data = value.to_le_bytes();
            let frame = Frame::new(CobId::of_node(0x200, node), &data).expect("four bytes");
            self.network().send(&frame)?;
            let answer = |event: &Event| {
                matches!(event, Event::Pdo { node: Some(from), frame }
                    if *from == node && frame.id() == CobId::of_node(0x180, node) && frame.data() == data)
            };
            self.expect("PDO with the value", answer)?;
        }
        Ok("both ways".to_owned())
    }

    fn sync(&mut self) -> Outcome<String> {
        let node = self.node;
        let now = self.network().now();
        self.network().manager().produce_sync(now, CobId::SYNC, Duration::from_millis(50), 0);
        for _ in 0..10 {
            let answer =
                |event: &Event| matches!(event, Event::Pdo { frame, .. } if frame.id() == CobId::of_node(0x280, node));
            self.expect("synchronous PDO", answer)?;
        }
        let now = self.network().now();
        self.network().manager().produce_sync(now, CobId::SYNC, Duration::ZERO, 0);
        Ok("10 synchronous PDOs".to_owned())
    }

    /// Sends TIME, and compares what the device has understood.
    fn time(&mut self) -> Outcome<String> {
        let node = self.node;
        for time in [TimeOfDay { days: 0, ms: 0 }, TimeOfDay { days: 15_300, ms: 86_399_999 }] {
            self.network().manager().send_time(time)?;
            same(&self.network().read(node, od::TIME_RECEIVED)?, &time)?;
        }
        Ok(String::new())
    }

    fn emcy(&mut self) -> Outcome<String> {
        let node = self.node;
        self.network().write(node, od::RAISE_ERROR, 0x2310)?;
        let raised = |event: &Event| {
            matches!(event, Event::Emergency { node: from, emergency }
                if *from == node && emergency.code.0 == 0x2310 && emergency.vendor == [1, 2, 3, 4, 5])
        };
        self.expect("EMCY", raised)?;
        self.network().write(node, od::RAISE_ERROR, 0)?;
        let over = |event: &Event| matches!(event, Event::Emergency { emergency, .. } if emergency.code.0 == 0);
        self.expect("end of the error", over)?;
        Ok(String::new())
    }

    #[expect(clippy::disallowed_methods, reason = "the rate is one of real time")]
    fn speed(&mut self) -> Outcome<String> {
        const READS: u32 = 2_000;
        let node = self.node;
        let (begin, used) = (WallClock::now(), processor_us());
        for _ in 0..READS {
            self.network().read(node, od::DEVICE_TYPE)?;
        }
        let rate = f64::from(READS) / begin.elapsed().as_secs_f64();
        let each = (processor_us() - used) / u64::from(READS);
        Ok(format!("{rate:.0}/s, {each} us of processor time each"))
    }
}

/// Runs an LSS operation to its end.
fn operate(
    link: &mut impl Link,
    begin: impl FnOnce(&mut LssManager) -> Result<(), Busy>,
) -> Outcome<lss_manager::Event> {
    // Longer than a bus needs: even beside a busy build, no answer must mean that there is none.
    let mut lss = LssManager::new().with_timeouts(SECOND, Duration::from_millis(100));
    begin(&mut lss)?;
    let event = Pump::new().run(link, &mut lss, Instant::MAX)?;
    Ok(event.ok_or("an operation has a deadline")?)
}

/// Reads an entry by block, without a shell. Returns also whether blocks were used.
fn read_by_block(link: &mut impl Link, node: NodeId, address: Address) -> Outcome<(Vec<u8>, bool)> {
    let mut manager = Manager::<1>::new();
    manager.add(link.now(), Remote::new(node))?;
    manager.sdo(node)?.read_block(link.now(), address)?;
    let mut data = Bytes::room_for(1 << 20);
    let mut blocks = true;
    loop {
        while let Some(frame) = manager.poll_transmit(link.now(), &mut data) {
            // All requests of a client in a block upload are A0h to A7h (CiA 301, 7.2.4.3.10).
            blocks &= frame.data().first().is_some_and(|command| command >> 5 == 5);
            link.send(&frame)?;
        }
        let until = manager.poll_timeout().ok_or("a transfer has a deadline")?;
        let event = match link.receive(until)? {
            Some(Incoming::Frame(frame)) => manager.handle_frame(link.now(), &frame, &mut data),
            Some(Incoming::State(_) | Incoming::Gap(_)) => None,
            None => manager.handle_timeout(link.now()),
        };
        match event {
            Some(Event::Sdo { event: sdo_client::Event::Done { len, .. }, .. }) => {
                while let Some(frame) = manager.poll_transmit(link.now(), &mut data) {
                    link.send(&frame)?;
                }
                return Ok((data.into_vec(len), blocks));
            }
            Some(Event::Sdo { event: sdo_client::Event::Failed(error), .. }) => return Err(error.into()),
            _ => {}
        }
    }
}

fn pattern(len: usize) -> Vec<u8> {
    (0..len).map(|at| (at * 7 + len) as u8).collect()
}

fn same<T: PartialEq + std::fmt::Debug>(got: &T, expected: &T) -> Outcome<()> {
    if got == expected { Ok(()) } else { Err(format!("{got:?} instead of {expected:?}").into()) }
}

/// The processor time of this process, if the system reports it.
fn processor_us() -> u64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_ascii_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<u64>().ok()).sum::<u64>() * 10_000
}
