//! A manager that configures a device at random, and random traffic: 100,000 steps in virtual time, the same in every
//! run.
//!
//! The device does not panic, answers each frame with few frames, sends only under identifiers in its dictionary,
//! misses no deadline, and never has two services with the same identifier.

use crate::common::{NODE, Rig};
use lexican_runtime::device::Event;
use lexican_runtime::object::{Address, ObjectDictionary, TimeOfDay};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant};

const STEPS: usize = 100_000;
/// SYNC or a deadline may send all three TPDOs, and there may be an error, its end, a heartbeat and an answer.
const MOST_FRAMES: usize = 8;

/// The generator SplitMix64, which needs no crate.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    fn one_of<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len() as u64) as usize]
    }
}

/// Identifiers that services often use, including restricted and extended ones.
const IDS: [u32; 18] = [
    0x000,
    0x080,
    0x085,
    0x100,
    0x181,
    0x185,
    0x1A5,
    0x205,
    0x206,
    0x285,
    0x385,
    0x405,
    0x585,
    0x605,
    0x6D0,
    0x6D1,
    0x705,
    0x2001_2345,
];

/// A parameter, and a value to write to it.
fn write(random: &mut Random) -> (u16, u8, usize, u32) {
    let cob_id = random.one_of(&IDS) | random.one_of(&[0, 0, 0x8000_0000, 0x4000_0000, 0xC000_0000]);
    let small = random.one_of(&[0, 0, 1, 2, 3, 10, 240, 241, 255]);
    let time = random.one_of(&[0, 0, 1, 5, 20, 100]);
    let pdo = random.one_of(&[0_u16, 0, 2, 2, 1]);
    let parameter = pdo + random.one_of(&[0x1400, 0x1800]);
    let mapping = pdo + random.one_of(&[0x1600, 0x1A00]);
    let mapped = random.one_of(&[
        0,
        0x6040_0010,
        0x6041_0010,
        0x6064_0020,
        0x607A_0020,
        0x2000_0101,
        0x2000_0208,
        0x2000_0340,
        0x0005_0008,
        0x1001_0008,
        0x2FFF_0008,
    ]);
    match random.below(20) {
        0 => (0x1005, 0, 4, cob_id),
        1 => (0x1006, 0, 4, time * 1000),
        2 => (0x1007, 0, 4, time * 500),
        3 => (0x100C, 0, 2, time),
        4 => (0x100D, 0, 1, small),
        5 => (0x1012, 0, 4, cob_id),
        6 => (0x1014, 0, 4, cob_id),
        7 => (0x1015, 0, 2, time),
        8 => (0x1016, random.one_of(&[1, 2, 3]), 4, random.one_of(&[0x06_0000, 0x07_0000]) | time),
        9 => (0x1017, 0, 2, time),
        10 => (0x1019, 0, 1, small),
        11 => (0x1029, 1, 1, small),
        12 => (0x1201, random.one_of(&[1, 2]), 4, cob_id),
        13 | 14 => (parameter, 1, 4, cob_id),
        15 => (parameter, 2, 1, random.one_of(&[0, 1, 2, 240, 252, 253, 254, 255])),
        16 => (parameter, random.one_of(&[3, 5]), 2, time),
        17 => (parameter, 6, 1, small),
        18 => (mapping, 0, 1, random.one_of(&[0, 0, 1, 2, 3, 9])),
        _ => (mapping, random.one_of(&[1, 2, 3]), 4, mapped),
    }
}

/// A frame of another node, under an identifier that the device may receive.
fn traffic(random: &mut Random) -> Frame {
    let id = match random.below(6) {
        0 => CobId::NMT,
        1 => CobId::SYNC,
        2 => CobId::from_parameter(0x700 + random.one_of(&[5, 6, 7])),
        _ => CobId::from_parameter(random.one_of(&IDS)),
    };
    if id == CobId::NMT {
        return Frame::from_array(
            id,
            [random.one_of(&[1, 1, 1, 1, 1, 1, 2, 0x80, 0x81, 0x82]), random.one_of(&[0, 5, 6])],
        );
    }
    let len = random.one_of(&[0, 1, 1, 2, 6, 8]);
    if random.below(8) == 0 {
        return Frame::remote(id, len).unwrap();
    }
    Frame::new(id, &random.next().to_le_bytes()[..usize::from(len)]).unwrap()
}

/// A COB-ID in the dictionary, if its service exists. 1005h and 1012h show that by other bits than the rest.
fn cob_id(od: &mut dyn ObjectDictionary, index: u16, sub: u8, exists: fn(u32) -> bool) -> Option<CobId> {
    let entry = od.entry(Address::new(index, sub)).ok()?;
    let mut bytes = [0; 4];
    od.read(&entry, 0, &mut bytes).ok()?;
    Some(u32::from_le_bytes(bytes)).filter(|&value| exists(value)).map(CobId::from_parameter)
}

fn is_valid(cob_id: u32) -> bool {
    cob_id >> 31 == 0
}

/// The identifiers under which the dictionary allows the device to send.
fn sent_as(od: &mut dyn ObjectDictionary) -> Vec<CobId> {
    let produces = |cob_id| cob_id & 1 << 30 != 0;
    let messages = [(0x1005, 0), (0x1012, 0)].map(|(index, sub)| cob_id(od, index, sub, produces));
    let others = [(0x1014, 0), (0x1200, 2), (0x1201, 2), (0x1800, 1), (0x1802, 1)];
    let others = others.map(|(index, sub)| cob_id(od, index, sub, is_valid));
    messages.into_iter().chain(others).flatten().chain([CobId::of_node(0x700, NODE)]).collect()
}

/// The identifiers of all services that exist.
fn in_use(od: &mut dyn ObjectDictionary) -> Vec<CobId> {
    let sync = cob_id(od, 0x1005, 0, |_| true);
    let time = cob_id(od, 0x1012, 0, |cob_id| cob_id >> 30 != 0);
    let others = [0x1400, 0x1402, 0x1800, 0x1802, 0x1200, 0x1201].map(|index| cob_id(od, index, 1, is_valid));
    let answers = [0x1200, 0x1201].map(|index| cob_id(od, index, 2, is_valid));
    let emcy = cob_id(od, 0x1014, 0, is_valid);
    [sync, time, emcy].into_iter().chain(others).chain(answers).flatten().collect()
}

struct Walk {
    rig: Rig,
    /// How many writes were taken, frames sent, and states entered.
    taken: usize,
    sent: usize,
    operational: usize,
}

impl Walk {
    fn step(&mut self, random: &mut Random) {
        // The answer to a write that changes its own SDO server is sent under the previous identifiers.
        let before = sent_as(&mut self.rig.od);
        let event = match random.below(10) {
            0..=4 => {
                let (index, sub, size, value) = write(random);
                let [low, high] = index.to_le_bytes();
                let [a, b, c, d] = value.to_le_bytes();
                let data = [0x23 | (4 - size as u8) << 2, low, high, sub, a, b, c, d];
                let server = if random.below(8) == 0 { 0x6D0 } else { 0x605 };
                self.take(&Frame::from_array(CobId::from_parameter(server), data))
            }
            5..=6 => self.take(&traffic(random)),
            7 => {
                let (index, sub) = random.one_of(&[(0x6041, 0), (0x6064, 0), (0x2000, 2), (0x1001, 0)]);
                self.rig.device.changed(Address::new(index, sub));
                self.rig.device.request_tpdo(random.one_of(&[1, 3]));
                None
            }
            _ => {
                self.rig.now += Duration::from_micros(random.below(20_000));
                None
            }
        };
        self.taken += usize::from(matches!(event, Some(Event::Written(_))));
        self.operational += usize::from(event == Some(Event::StateChanged(NmtState::Operational)));
        self.pull(&before);
        let mut used = in_use(&mut self.rig.od);
        let count = used.len();
        used.sort();
        used.dedup();
        assert_eq!(used.len(), count, "two services have one identifier");
        let mut due = 0;
        while self.rig.device.poll_timeout().is_some_and(|due| due <= self.rig.now) {
            due += 1;
            assert!(due < 32, "a deadline that does not pass");
            self.rig.device.handle_timeout(self.rig.now, &mut self.rig.od);
            self.pull(&[]);
        }
        if self.rig.state() == NmtState::Initialising {
            self.rig.restart();
            self.pull(&[]);
        }
    }

    /// The device caches that there is nothing to do, and until when. A copy that is made to look again must find the
    /// same.
    fn look_again(&self) {
        let (mut device, mut od) = (self.rig.device.clone(), self.rig.od.clone());
        // The device does not produce TIME, so this only makes it look again.
        device.send_time(TimeOfDay { days: 0, ms: 0 });
        assert_eq!(device.poll_timeout(), self.rig.device.poll_timeout());
        assert_eq!(device.poll_transmit(self.rig.now, &mut od), None);
    }

    fn take(&mut self, frame: &Frame) -> Option<Event> {
        self.rig.device.handle_frame(self.rig.now, frame, &mut self.rig.od)
    }

    fn pull(&mut self, before: &[CobId]) {
        let listed = sent_as(&mut self.rig.od);
        for count in 0.. {
            let Some(frame) = self.rig.device.poll_transmit(self.rig.now, &mut self.rig.od) else { break };
            assert!(count < MOST_FRAMES, "{frame} is one too many");
            let id = frame.id();
            assert!(listed.contains(&id) || before.contains(&id), "{frame} under an identifier that is not listed");
            self.sent += 1;
        }
    }
}

#[test]
fn with_any_configuration_the_device_neither_panics_nor_babbles_nor_takes_the_identifiers_of_others() {
    for seed in 0..4 {
        let mut random = Random(seed);
        let mut walk = Walk { rig: Rig::full(), taken: 0, sent: 0, operational: 0 };
        for step in 0..STEPS / 4 {
            walk.step(&mut random);
            if step % 8 == 0 {
                walk.look_again();
            }
            // A reset restores the defaults.
            if step % 500 == 499 {
                let now = walk.rig.now;
                walk.rig = Rig { now, ..Rig::full() };
                walk.rig.restart();
            }
        }
        let Walk { taken, sent, operational, .. } = walk;
        assert!(taken > 2_000 && sent > 10_000 && operational > 150, "it gets about: {taken}, {sent}, {operational}");
        assert!(walk.rig.now > Instant::ZERO);
    }
}
