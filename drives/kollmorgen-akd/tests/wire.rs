//! The simulated drive, asked by frames: what its manual says, and no driver relies on.

use std::sync::{Arc, Mutex};

use kollmorgen_akd::fault;
use kollmorgen_akd::sim::{Inputs, MODEL, SimulatedServo};
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, NodeId};

const STATUS: u16 = 0x6041;
const SYSTEM: u16 = 0x1002;

/// A simulated drive with node-ID 3, in OPERATIONAL.
struct Rig {
    bus: VirtualBus,
    link: VirtualLink,
    servo: Arc<Mutex<SimulatedServo>>,
}

impl Rig {
    fn new() -> Self {
        let bus = VirtualBus::new();
        let servo = Arc::new(Mutex::new(SimulatedServo::new(bus.now(), &MODEL, NodeId::literal(3))));
        bus.attach(Arc::clone(&servo));
        let mut rig = Rig { link: bus.link(), bus, servo };
        rig.hear(0);
        rig.send(0x000, &[0x01, 3]);
        rig.hear(0);
        rig
    }

    fn send(&mut self, id: u16, data: &[u8]) {
        self.link.send(&Frame::new(CobId::standard(id).unwrap(), data).unwrap()).unwrap();
    }

    fn hear(&mut self, ms: u64) -> Vec<Frame> {
        let until = self.bus.now() + Duration::from_millis(ms);
        std::iter::from_fn(|| self.link.receive_frame(until).unwrap()).collect()
    }

    fn hear_from(&mut self, id: u32, ms: u64) -> Vec<Vec<u8>> {
        let frames = self.hear(ms);
        frames.iter().filter(|frame| frame.id().raw() == id).map(|frame| frame.data().to_vec()).collect()
    }

    fn ask(&mut self, data: [u8; 8]) -> Result<u32, u32> {
        self.send(0x603, &data);
        let answer = self.hear_from(0x583, 0).pop().expect("an answer");
        let number = u32::from_le_bytes(*answer.last_chunk().unwrap());
        if answer[0] == 0x80 { Err(number) } else { Ok(number) }
    }

    fn read(&mut self, index: u16, sub: u8) -> Result<u32, u32> {
        let [low, high] = index.to_le_bytes();
        self.ask([0x40, low, high, sub, 0, 0, 0, 0])
    }

    /// Writes so many bytes.
    fn write(&mut self, index: u16, sub: u8, size: u8, value: i32) -> Result<(), u32> {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        self.ask([0x23 | (4 - size) << 2, low, high, sub, a, b, c, d]).map(|_| ())
    }

    fn control(&mut self, words: &[u16]) {
        words.iter().for_each(|word| self.write(0x6040, 0, 2, (*word).into()).unwrap());
    }

    fn enabled_in(mode: i32) -> Self {
        let mut rig = Rig::new();
        rig.write(0x6060, 0, 1, mode).unwrap();
        rig.control(&[0x06, 0x07, 0x0F]);
        rig
    }

    fn world(&self, change: impl FnOnce(&mut Inputs)) {
        self.servo.lock().unwrap().set_inputs(self.bus.now(), change);
    }

    /// Whether somebody could turn the shaft by hand.
    fn turns(&self) -> bool {
        let now = self.bus.now();
        self.servo.lock().unwrap().with_servo(now, |servo, od| servo.turn(now, od, 10.0))
    }

    fn velocity(&self) -> f64 {
        self.servo.lock().unwrap().servo().shaft(self.bus.now()).velocity
    }
}

/// F007, F126, F138; 7.2.1.7 expects 0250h with supply.
#[test]
fn bit_5_is_clear_in_switch_on_disabled() {
    let mut rig = Rig::new();
    assert_eq!(rig.read(STATUS, 0), Ok(0x0250));
    rig.world(|inputs| inputs.supply = false);
    assert_eq!(rig.read(STATUS, 0), Ok(0x0240));
    rig.control(&[0x06]);
    assert_eq!(rig.read(STATUS, 0), Ok(0x0221));
}

/// Printed status words: F146 and F152, F205, F221 to F224, F324 and F326.
#[test]
fn bit_10_is_set_when_something_ordered_was_reached() {
    for mode in [1, 6, 7] {
        assert_eq!(Rig::enabled_in(mode).read(STATUS, 0), Ok(0x0237), "mode {mode}");
    }
    let mut positions = Rig::enabled_in(1);
    positions.write(0x607A, 0, 4, 5000).unwrap();
    positions.control(&[0x1F]);
    assert_eq!(positions.read(STATUS, 0), Ok(0x1237));
    positions.control(&[0x0F]);
    assert_eq!(positions.read(STATUS, 0), Ok(0x0237));
    positions.hear(10_000);
    assert_eq!(positions.read(STATUS, 0), Ok(0x0637));

    let mut homes = Rig::enabled_in(6);
    homes.world(|inputs| inputs.machine.negative_limit = Some(-500.0));
    homes.write(0x6098, 0, 1, 17).unwrap();
    homes.control(&[0x1F]);
    assert_eq!(homes.read(STATUS, 0), Ok(0x0237));
    homes.hear(20_000);
    assert_eq!(homes.read(STATUS, 0), Ok(0x1637));

    let mut interpolates = Rig::enabled_in(7);
    interpolates.control(&[0x1F]);
    assert_eq!(interpolates.read(STATUS, 0), Ok(0x1237));
}

/// 6.4.1.2: transition 3 gives torque, transitions 6 and 10 take it; 1002h shows it in bit 14.
#[test]
fn it_has_torque_in_switched_on() {
    let mut rig = Rig::new();
    for (word, holds) in
        [(0x06, false), (0x07, true), (0x06, false), (0x07, true), (0x0F, true), (0x07, true), (0, false)]
    {
        rig.control(&[word]);
        let shown = rig.read(SYSTEM, 0).unwrap() >> 14 & 1 == 1;
        assert_eq!((!rig.turns(), shown), (holds, holds), "{word:#04X}");
    }
    // An axis that runs out is braked by the torque that comes.
    let mut rig = Rig::enabled_in(3);
    rig.write(0x60FF, 0, 4, 100_000).unwrap();
    rig.write(0x6084, 0, 4, 1_000_000).unwrap();
    rig.hear(5000);
    rig.control(&[0x06]);
    rig.hear(10);
    let running_out = rig.velocity();
    rig.control(&[0x07]);
    rig.hear(100);
    assert!(running_out > 50_000.0 && rig.velocity() == 0.0, "{running_out}");
}

/// 6.2.1.5: "the bits 11 to 30 are always 0"; 6.3.1.1, 6.3.2.1: 29 bits are not supported.
#[test]
fn it_knows_identifiers_of_11_bits_only_and_sends_no_sync() {
    let mut rig = Rig::new();
    rig.send(0x000, &[0x80, 3]);
    for written in [1 << 30 | 0x80, 1 << 29 | 0x80, 0x3FFF_F880_u32 as i32] {
        assert_eq!((rig.write(0x1005, 0, 4, written), rig.read(0x1005, 0)), (Ok(()), Ok(0x80)), "{written:X}");
    }
    rig.write(0x1006, 0, 4, 1000).unwrap();
    assert_eq!(rig.hear_from(0x80, 100), Vec::<Vec<u8>>::new());
    for index in (0x1400..0x1404).chain(0x1800..0x1804) {
        let is = rig.read(index, 1).unwrap();
        assert_eq!(rig.write(index, 1, 4, (is | 1 << 29) as i32), Err(0x0609_0030), "{index:X}");
    }
}

/// 6.9.2.3: multiples of 1 ms only, which take effect when both entries have been written.
#[test]
fn the_cycle_is_of_whole_milliseconds_and_of_both_entries() {
    let mut rig = Rig::new();
    for (units, exponent, answer) in [
        (5, -4, Err(0x0609_0030)),
        (1, -3, Ok(())),
        (10, -4, Ok(())),
        (0, -3, Err(0x0609_0030)),
        (250, -6, Err(0x0609_0030)),
    ] {
        let mut rig = Rig::new();
        assert_eq!(rig.write(0x60C2, 1, 1, units), Ok(()));
        assert_eq!(rig.write(0x60C2, 2, 1, exponent), answer, "{units} x 10^{exponent}");
        assert_eq!(Rig::new().write(0x60C2, 2, 1, exponent), Ok(()), "until the other one is written");
    }
    rig.write(0x60C2, 1, 1, 10).unwrap();
    rig.write(0x60C2, 2, 1, -3).unwrap();
    rig.write(0x6060, 0, 1, 8).unwrap();
    rig.control(&[0x06, 0x07, 0x0F]);
    // One entry alone changes nothing.
    let entries = [None, Some((1, 20)), Some((2, -3))];
    for (entry, velocity) in entries.into_iter().zip([10_000.0, 10_000.0, 5000.0]) {
        if let Some((sub, value)) = entry {
            rig.write(0x60C2, sub, 1, value).unwrap();
        }
        let at = rig.read(0x6064, 0).unwrap() as i32;
        rig.write(0x607A, 0, 4, at + 100).unwrap();
        rig.send(0x080, &[]);
        rig.hear(0);
        assert!((rig.velocity() - velocity).abs() < 1.0, "{entry:?}: {}", rig.velocity());
        rig.hear(10);
    }
}

/// 5.4.5.6: codes that are not in the table are reserved.
#[test]
fn it_refuses_by_codes_that_it_has() {
    let mut rig = Rig::new();
    assert_eq!(rig.read(0x1003, 4), Ok(0), "no error is there");
    for size in [1, 2, 3] {
        assert_eq!(rig.write(0x6081, 0, size, 1), Err(0x0607_0010));
    }
    assert_eq!(rig.write(0x6060, 0, 4, 1), Err(0x0607_0010));
    rig.send(0x000, &[0x80, 3]);
    assert_eq!(rig.write(0x1600, 1, 4, 0x6040_0010), Ok(()), "what is there already");
    assert_eq!(rig.write(0x1600, 1, 4, 0x607A_0020), Err(0x0800_0022), "while it counts");
    assert_eq!(rig.write(0x1600, 0, 1, 0), Ok(()));
    assert_eq!(rig.write(0x1600, 1, 4, 0x6040_000C), Err(0x0604_0041), "no whole bytes");
    assert_eq!(rig.write(0x1600, 1, 4, 0x6060_0008), Ok(()), "an odd number of them");
    // A segmented download whose toggle bit does not alternate.
    assert!(rig.ask([0x21, 0x26, 0x20, 0x01, 10, 0, 0, 0]).is_ok());
    assert_eq!(rig.ask([0x10, b'D', b'R', b'V', b'.', 0, 0, 0]), Err(0x0504_0001));
}

/// 7.2.1.7: the values that the setup software has set before.
#[test]
fn it_begins_with_the_setup_of_the_examples() {
    let mut rig = Rig::new();
    let setup = [0x6081, 0x6083, 0x6084, 0x609A].map(|index| rig.read(index, 0));
    assert_eq!(setup, [Ok(20_000), Ok(100_000), Ok(100_000), Ok(10_000)]);
}

/// 5.4.4.1: of several errors each has its EMCY, and its end says what is left, also where another has its bit.
#[test]
fn the_end_of_one_error_says_which_remain() {
    let code = |label| fault::find(label).unwrap().number;
    let emcy = |code: u16, register: u8| [&code.to_le_bytes()[..], &[register, 0, 0, 0, 0, 0]].concat();
    let mut rig = Rig::new();
    rig.world(|inputs| ["F234", "F235", "F502"].map(code).iter().for_each(|code| _ = inputs.faults.insert(*code)));
    assert_eq!(rig.hear_from(0x83, 0), [emcy(0x4210, 0x08), emcy(0x4310, 0x08), emcy(0x3220, 0x0C)]);
    rig.world(|inputs| inputs.faults.remove(0x4210));
    assert_eq!(rig.hear_from(0x83, 0), [emcy(0, 0x0C)]);
    rig.world(|inputs| inputs.faults.remove(0x3220));
    assert_eq!(rig.hear_from(0x83, 0), [emcy(0, 0x08)]);
    assert_eq!((rig.read(0x1001, 0), rig.read(0x1003, 0)), (Ok(0x08), Ok(3)));
    rig.control(&[0x80]);
    assert_eq!(rig.read(STATUS, 0).unwrap() & 0x4F, 0x08, "the last one is still there");
    rig.world(|inputs| inputs.faults.remove(0x4310));
    assert_eq!(rig.hear_from(0x83, 0), Vec::<Vec<u8>>::new(), "it stays until it is reset");
    rig.control(&[0x00, 0x80]);
    assert_eq!((rig.read(STATUS, 0).unwrap() & 0x4F, rig.read(0x1001, 0)), (0x40, Ok(0)));
}

/// 6.2.3.1, 6.2.2.11: bits 16 to 22 mirror the inputs, bits 24 to 30 say which have changed until 20B8h resets them.
#[test]
fn changed_inputs_are_shown_until_they_are_reset() {
    let mut rig = Rig::new();
    assert_eq!(rig.read(0x60FD, 0), Ok(0));
    rig.world(|inputs| (inputs.probes[1], inputs.digital) = (true, 1 << 22 | 1 << 24));
    assert_eq!(rig.read(0x60FD, 0), Ok(0x4242_0000));
    rig.world(|inputs| inputs.probes[1] = false);
    assert_eq!(rig.read(0x60FD, 0), Ok(0x4240_0000), "it has changed");
    rig.write(0x20B8, 0, 2, 1 << 1).unwrap();
    assert_eq!(rig.read(0x60FD, 0), Ok(0x4040_0000));
    rig.write(0x20B8, 0, 2, 1 << 6).unwrap();
    assert_eq!(rig.read(0x60FD, 0), Ok(0x0040_0000));
    rig.write(0x20B8, 0, 2, 0).unwrap();
    assert_eq!(rig.read(0x60FD, 0), Ok(0x0040_0000));
    rig.world(|inputs| inputs.digital = 0);
    assert_eq!(rig.read(0x60FD, 0), Ok(0x4000_0000));
}

/// 6.2.2.4 to 6.2.2.10.
#[test]
fn latches_show_inputs_edges_and_the_index_pulse() {
    let mut rig = Rig::enabled_in(1);
    // Inputs 3 and 4, and what is none.
    for (bit, shown) in [(18, 0x2000), (19, 0x1000), (20, 0)] {
        rig.world(|inputs| inputs.digital = 1 << bit);
        assert_eq!(rig.read(0x20A5, 0), Ok(shown));
    }
    rig.world(|inputs| inputs.digital = 0);
    rig.write(0x607A, 0, 4, 1200).unwrap();
    rig.control(&[0x1F, 0x0F]);
    rig.hear(10_000);
    // The first edge after a travel to 1200 is the negative one of input 1.
    rig.world(|inputs| inputs.probes[0] = true);
    rig.write(0x20A4, 0, 2, 0x03).unwrap();
    rig.world(|inputs| inputs.probes[0] = false);
    assert_eq!([0x20A1, 0x20A6, 0x20A0].map(|index| rig.read(index, 0)), [Ok(1200), Ok(1200), Ok(0)]);
    rig.write(0x607A, 0, 4, 1400).unwrap();
    rig.control(&[0x1F, 0x0F]);
    rig.hear(10_000);
    rig.world(|inputs| inputs.probes[0] = true);
    assert_eq!([0x20A0, 0x20A6].map(|index| rig.read(index, 0)), [Ok(1400), Ok(1200)], "the first one");
    // 20A6h is that of input 1 only.
    rig.write(0x20A4, 0, 2, 0x04).unwrap();
    rig.world(|inputs| inputs.probes[1] = true);
    assert_eq!([0x20A2, 0x20A6].map(|index| rig.read(index, 0)), [Ok(1400), Ok(1200)]);
    rig.world(|inputs| inputs.probes[1] = false);
    // Pulses are at 500, 1500, 2500 ...; one at rest is none.
    rig.write(0x20A4, 0, 2, 0x10).unwrap();
    assert_eq!(rig.read(0x20A5, 0), Ok(0x8000));
    // Inputs 3 and 4 have no latch.
    rig.world(|inputs| inputs.digital = 1 << 18);
    assert_eq!(rig.read(0x20A5, 0), Ok(0xA000));
    rig.world(|inputs| inputs.digital = 0);
    rig.write(0x607A, 0, 4, 3000).unwrap();
    rig.control(&[0x1F, 0x0F]);
    rig.hear(10_000);
    assert_eq!((rig.read(0x20A5, 0), rig.read(0x20A0, 0)), (Ok(0x8010), Ok(1500)));
    rig.write(0x20A4, 0, 2, 0).unwrap();
    assert_eq!(rig.read(0x20A5, 0), Ok(0x8000));
}

/// 6.7.2.2: the current that makes torque is limited; 0, the default, is no limit.
#[test]
fn the_largest_current_limits_the_torque() {
    let mut rig = Rig::enabled_in(4);
    rig.write(0x6071, 0, 2, 400).unwrap();
    rig.hear(5000);
    assert_eq!(rig.read(0x6077, 0), Ok(400));
    rig.write(0x6073, 0, 2, 300).unwrap();
    rig.hear(5000);
    assert_eq!((rig.read(0x6077, 0), rig.read(STATUS, 0).unwrap() >> 11 & 1), (Ok(300), 1));
}

/// 6.11.2.2: "changed values must be saved and the drive must be restarted".
#[test]
fn software_limits_hold_from_the_restart_on() {
    let travel = |rig: &mut Rig| {
        rig.write(0x6060, 0, 1, 1).unwrap();
        rig.write(0x607A, 0, 4, 5000).unwrap();
        rig.control(&[0x06, 0x07, 0x0F, 0x1F]);
        rig.hear(10_000);
        rig.read(0x6064, 0)
    };
    for (stores, command, end) in
        [(false, None, 5000), (true, None, 5000), (true, Some(0x82), 5000), (true, Some(0x81), 1000)]
    {
        let mut rig = Rig::new();
        rig.write(0x607D, 1, 4, -1000).unwrap();
        rig.write(0x607D, 2, 4, 1000).unwrap();
        if stores {
            rig.write(0x1010, 1, 4, 0x6576_6173).unwrap();
        }
        if let Some(command) = command {
            rig.send(0x000, &[command, 3]);
            rig.hear(0);
            rig.send(0x000, &[0x01, 3]);
        }
        assert_eq!(travel(&mut rig), Ok(end), "{stores} {command:?}");
    }
    // Without power in between, too; and the limits that were there hold until then.
    let mut rig = Rig::new();
    rig.write(0x607D, 1, 4, -1000).unwrap();
    rig.write(0x607D, 2, 4, 1000).unwrap();
    rig.write(0x1010, 1, 4, 0x6576_6173).unwrap();
    let now = rig.bus.now();
    [false, true].into_iter().for_each(|on| rig.servo.lock().unwrap().set_power(now, on));
    rig.hear(0);
    rig.send(0x000, &[0x01, 3]);
    rig.write(0x607D, 2, 4, 3000).unwrap();
    assert_eq!(travel(&mut rig), Ok(1000));
}

/// 6.3.1.1: of a type from 1 to 240, so many SYNCs less one are ignored before one counts.
#[test]
fn an_rpdo_of_type_n_takes_every_nth_sync() {
    let mut rig = Rig::new();
    rig.send(0x000, &[0x80, 3]);
    rig.write(0x1400, 2, 1, 3).unwrap();
    rig.send(0x000, &[0x01, 3]);
    // Its word comes before the first SYNC, between the fourth and the fifth, and after the eighth.
    let mut seen = Vec::new();
    for sync in 1..=9 {
        if let Some(word) = [(1, 0x06), (5, 0x07), (9, 0x0F)].iter().find(|(at, _)| *at == sync) {
            rig.send(0x203, &[word.1, 0]);
        }
        rig.send(0x080, &[]);
        rig.hear(0);
        seen.push(rig.read(STATUS, 0).unwrap() & 0x6F);
    }
    assert_eq!(seen, [0x40, 0x40, 0x21, 0x21, 0x21, 0x23, 0x23, 0x23, 0x27]);
}

/// 6.2.2.1: only the bits that are set in 2014h to 2017h are monitored.
#[test]
fn masks_choose_the_bits_whose_change_sends_a_tpdo() {
    let supply = |rig: &mut Rig| {
        rig.world(|inputs| inputs.supply = !inputs.supply);
        rig.hear_from(0x183, 10)
    };
    let mut rig = Rig::new();
    rig.hear(10);
    assert_eq!(rig.read(0x2014, 1), Ok(0xFFFF_FFFF));
    assert_eq!(supply(&mut rig), [[0x40, 0x02]]);
    // Bit 4, voltage enabled, does not count.
    rig.write(0x2014, 1, 4, !0x10).unwrap();
    assert_eq!(supply(&mut rig), Vec::<Vec<u8>>::new());
    rig.send(0x203, &[0x06, 0x00]);
    assert_eq!(rig.hear_from(0x183, 0), [[0x31, 0x02]], "another bit changes, and all are sent");
    rig.send(0x000, &[0x80, 3]);
    rig.send(0x000, &[0x01, 3]);
    rig.hear(10);
    // Position in bytes 2 to 5 of TPDO3: once per 4096 increments, above byte 4 not at all.
    for (sub, mask) in [(1, 0xF000_0000_u32), (2, 0)] {
        rig.write(0x2016, sub, 4, mask as i32).unwrap();
    }
    rig.control(&[0x07, 0x0F]);
    rig.write(0x607A, 0, 4, 20_000).unwrap();
    rig.write(0x6060, 0, 1, 1).unwrap();
    rig.hear(10);
    rig.control(&[0x1F]);
    let positions = rig.hear_from(0x383, 20_000);
    let positions: Vec<u32> =
        positions.iter().map(|data| u32::from_le_bytes([data[2], data[3], data[4], data[5]]) >> 12).collect();
    assert_eq!(positions, [1, 2, 3, 4]);
}

/// 5.4.7, 5.4.8: F129, once, and no movement until it is reset, in whatever state the drive is.
#[test]
fn a_manager_that_falls_silent_is_a_fault() {
    type Arm = fn(&mut Rig);
    let guarding: Arm = |rig| {
        rig.write(0x100C, 0, 2, 100).unwrap();
        rig.write(0x100D, 0, 1, 3).unwrap();
        rig.link.send(&Frame::remote(CobId::standard(0x703).unwrap(), 1).unwrap()).unwrap();
    };
    let heartbeat: Arm = |rig| {
        rig.write(0x1016, 1, 4, 0x007F_012C).unwrap();
        rig.send(0x77F, &[5]);
    };
    for arm in [guarding, heartbeat] {
        for (words, moves) in [(&[][..], false), (&[0x06], false), (&[0x06, 0x07], false), (&[0x06, 0x07, 0x0F], true)]
        {
            let mut rig = Rig::new();
            rig.write(0x6060, 0, 1, 3).unwrap();
            rig.write(0x60FF, 0, 4, 1000).unwrap();
            rig.control(words);
            arm(&mut rig);
            assert_eq!(rig.hear_from(0x83, 290), Vec::<Vec<u8>>::new(), "{words:X?}");
            assert_eq!(rig.velocity() > 0.0, moves);
            assert_eq!(rig.hear_from(0x83, 20), [[0x30, 0x81, 0x10, 0, 0, 0, 0, 0]], "{words:X?}");
            rig.hear(1000);
            assert_eq!((rig.read(STATUS, 0).unwrap() & 0x4F, rig.velocity()), (0x08, 0.0), "{words:X?}");
            assert_eq!((rig.read(0x1003, 0), rig.read(0x1003, 1)), (Ok(1), Ok(0x8130)));
        }
    }
}
