//! No frames on the bus stop a participant.

use lexican_runtime::manager::{Event, Manager, Remote};
use lexican_runtime::object::{Access, DataType};
use lexican_runtime::service::sdo_client::{self, Scalar, SdoClient};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use super::common::Rig;
use super::sdo_support::{Bus, Growing, Od, at, pattern};

/// Takes choices from the input; zeros after its end.
struct Choices<'d>(&'d [u8]);

impl Choices<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.0.split_at(self.0.len().min(N));
        self.0 = rest;
        let mut bytes = [0; N];
        bytes[..taken.len()].copy_from_slice(taken);
        bytes
    }

    fn byte(&mut self) -> u8 {
        let [byte] = self.bytes();
        byte
    }

    /// One of `known` or, rarely, any other identifier.
    fn frame(&mut self, known: &[u16]) -> Option<Frame> {
        let kind = self.byte();
        let id = match kind {
            0xF0.. => CobId::extended(u32::from_le_bytes(self.bytes())),
            0xE0.. => CobId::standard(u16::from_le_bytes(self.bytes())),
            _ => CobId::standard(known[usize::from(kind) % known.len()]),
        }?;
        match self.byte() {
            len @ 0..=8 => Frame::new(id, &self.bytes::<8>()[..usize::from(len)]),
            len @ 9..=17 => Frame::remote(id, len - 9),
            _ => Frame::new(id, &self.bytes::<8>()),
        }
    }

    /// A pause of up to 65 ms.
    fn pause(&mut self) -> Duration {
        Duration::from_micros(u16::from_le_bytes(self.bytes()).into())
    }
}

/// A device with all services: it never sends a burst without end, and it boots and answers afterwards.
pub fn device(data: &[u8]) {
    let known = [0x000, 0x080, 0x100, 0x185, 0x205, 0x385, 0x405, 0x605, 0x705, 0x710];
    let mut choices = Choices(data);
    let mut rig = Rig::full();
    while !choices.0.is_empty() {
        if choices.byte() < 0xC0 {
            let Some(frame) = choices.frame(&known) else { continue };
            rig.device.handle_frame(rig.now, &frame, &mut rig.od);
            rig.sent();
        } else {
            let pause = choices.pause();
            let sent = rig.pass(pause).len();
            assert!(sent < 10 + 2 * pause.as_micros() as usize, "{sent} frames in {pause:?}");
        }
        if rig.state() == NmtState::Initialising {
            rig.restart();
            rig.sent();
        }
    }
    rig.send("000#8105");
    rig.restart();
    assert_eq!(rig.sent().first().map(String::as_str), Some("705#00"));
    assert_eq!(rig.read(0x1000, 0), Ok(0x192));
}

/// A manager whose peer answers every request from the input, and repeats the last answer for ever: each transfer ends.
pub fn manager(data: &[u8]) {
    const NODE: NodeId = NodeId::literal(5);
    /// More frames than a transfer of eight bytes can take, with all repetitions.
    const MOST: usize = 20_000;
    let known = [0x000, 0x080, 0x085, 0x100, 0x185, 0x385, 0x585, 0x585, 0x585, 0x585, 0x705, 0x706];
    let mut now = Instant::ZERO;
    let mut manager = Manager::<2>::new();
    let guarded = Remote::new(NodeId::literal(6)).with_guarding(Duration::from_millis(100), 2);
    manager.add(now, Remote::new(NODE).with_heartbeat(Duration::from_millis(100))).expect("there is room");
    manager.add(now, guarded).expect("there is room");
    manager.produce_sync(now, CobId::SYNC, Duration::from_millis(50), 10);
    let mut value = Scalar::room_for::<u64>();
    let mut choices = Choices(data);
    let writes = choices.byte() & 1 == 1;
    let repeated = usize::from(choices.byte());
    let repeated = &choices.0[choices.0.len().saturating_sub(repeated)..];
    for _ in 0..3 {
        let begun = match writes {
            true => manager.write(now, NODE, at(0x2000, 0), 8),
            false => manager.read(now, NODE, at(0x2000, 0)),
        };
        begun.expect("the transfer before has ended");
        let mut answers = 0;
        while manager.sdo(NODE).is_ok_and(|client| client.is_busy()) {
            // Every request of the client gets one answer, and every other frame gets none.
            let mut is_asked = false;
            while let Some(frame) = manager.poll_transmit(now, &mut value) {
                is_asked |= frame.id().raw() == 0x605;
            }
            if is_asked {
                if choices.0.is_empty() {
                    choices.0 = repeated;
                }
                answers += 1;
                assert!(answers < MOST, "a peer keeps the manager busy for ever");
                now += Duration::from_millis(1);
                if let Some(frame) = choices.frame(&known) {
                    manager.handle_frame(now, &frame, &mut value);
                }
            } else if let Some(due) = manager.poll_timeout() {
                now = now.max(due);
            }
            if manager.poll_timeout().is_some_and(|due| due <= now) {
                manager.handle_timeout(now);
            }
        }
    }
    manager.read(now, NODE, at(0x1000, 0)).expect("no transfer is under way");
    while manager.poll_transmit(now, &mut value).is_some() {}
    let answer = Frame::from_array(CobId::standard(0x585).expect("11 bits"), [0x43, 0x00, 0x10, 0, 0x92, 1, 0, 0]);
    let event = manager.handle_frame(now, &answer, &mut value);
    let done = sdo_client::Event::Done { address: at(0x1000, 0), len: 4 };
    assert_eq!(event, Some(Event::Sdo { node: NODE, event: done }));
}

/// Client and server on a bus that loses, repeats, delays and alters frames: data that were not altered arrive or the
/// transfer fails, and the next transfer works.
pub fn sdo(data: &[u8]) {
    let domain = at(0x2003, 0);
    let mut choices = Choices(data);
    let [verb, len, client_block, server_block] = choices.bytes();
    let is_read = verb & 1 == 1;
    let sent = pattern(len.into());
    let od = Od::default().with(domain, DataType::Domain, Access::Rw, if is_read { &sent } else { b"old" }).with(
        at(0x2000, 8),
        DataType::Unsigned64,
        Access::Rw,
        &[7; 8],
    );
    let mut bus = Bus::new(Od { hides_len: verb & 2 == 2, ..od });
    bus.server = bus.server.with_block_size(server_block.clamp(1, 127));
    let from = if verb & 4 == 4 { 0 } else { u32::MAX };
    bus.client = SdoClient::of_node(super::sdo_support::NODE)
        .with_block_writes_from(from)
        .with_block_size(client_block.clamp(1, 127));
    let begun = match (is_read, verb & 4 == 4) {
        (true, true) => bus.client.read_block(bus.now, domain),
        (true, false) => bus.client.read(bus.now, domain),
        (false, _) => bus.client.write(bus.now, domain, len.into()),
    };
    begun.expect("the client is idle");
    let mut payload = Growing(if is_read { Vec::new() } else { sent.clone() });
    let (mut held, mut is_altered) = (None, false);
    let event = bus.run(&mut payload, &mut |_, frame| match choices.byte() {
        0 | 6.. => [frame].into_iter().chain(held.take()).collect(),
        1 => Vec::new(),
        2 => vec![frame, frame],
        3 if held.is_none() => {
            held = Some(frame);
            Vec::new()
        }
        3 => vec![frame],
        4 => {
            is_altered = true;
            let [at, bits] = choices.bytes();
            let mut data = frame.data().to_vec();
            data[usize::from(at) % 8] ^= bits;
            vec![Frame::new(frame.id(), &data).expect("the length stays")]
        }
        5 => {
            is_altered = true;
            vec![Frame::from_array(frame.id(), choices.bytes::<8>()), frame]
        }
    });
    let done = sdo_client::Event::Done { address: domain, len: len.into() };
    if event == done && !is_altered {
        assert_eq!(if is_read { &payload.0 } else { bus.od.value(domain) }, &sent);
    }
    bus.settle();
    assert_eq!(bus.read(at(0x2000, 8)).1, [7; 8]);
    let next = pattern(30);
    assert_eq!(bus.write(domain, &next), sdo_client::Event::Done { address: domain, len: 30 });
    assert_eq!(bus.od.value(domain), next);
}
