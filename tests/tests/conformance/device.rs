//! The device under test: the runtime's device with the dictionary generated from `tests/conformance/device.eds`, and a
//! small application.

use std::collections::BTreeMap;

use lexican_conform::{InputStimulus, Stimuli, Write};
use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::host::Node;
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::storage::{Storage, Storing};
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::{AbortCode, Duration, Frame, Instant, NodeId};

use crate::od;

pub const NODE: NodeId = NodeId::literal(5);

/// How a test makes the application act: the writes that it reacts to.
pub const STIMULI: Stimuli = Stimuli {
    emergency: Some(Write { index: 0x2004, sub: 0, value: 0xCDAB_3120 }),
    input: Some(InputStimulus {
        starts: Write { index: 0x2003, sub: 0, value: 10 },
        stops: Write { index: 0x2003, sub: 0, value: 0 },
        shown_by: (0x6041, 0),
    }),
};

/// The values that survive a reset.
#[derive(Default)]
struct Memory {
    stored: BTreeMap<Address, Vec<u8>>,
}

impl Memory {
    fn range(group: u8) -> std::ops::RangeInclusive<u16> {
        if group == 2 { 0x1000..=0x1FFF } else { 0..=0xFFFF }
    }
}

impl Storage for Memory {
    fn store(&mut self, group: u8, od: &mut dyn ObjectDictionary) -> Result<(), AbortCode> {
        let range = Memory::range(group);
        for entry in od::TABLE.entries().filter(|entry| range.contains(&entry.address.index())) {
            let mut buffer = [0; 32];
            let len = od.read(&entry, 0, &mut buffer)?;
            self.stored.insert(entry.address, buffer[..len].to_vec());
        }
        Ok(())
    }

    fn restore(&mut self, group: u8) -> Result<(), AbortCode> {
        let range = Memory::range(group);
        self.stored.retain(|address, _| !range.contains(&address.index()));
        Ok(())
    }
}

/// The device, switched on.
pub struct DeviceUnderTest {
    device: Device<3, 3, 2, 3>,
    od: od::Storage,
    memory: Memory,
    /// When the input changes next.
    input: Option<Instant>,
}

impl DeviceUnderTest {
    pub fn new() -> Self {
        let device = Device::new(NODE, Behaviour::CIA_301);
        let mut dut = DeviceUnderTest { device, od: od::storage(NODE), memory: Memory::default(), input: None };
        dut.device.restart(Instant::ZERO, &mut dut.od);
        dut
    }

    fn follow(&mut self, now: Instant, event: Event) {
        match event {
            Event::Written(address) if address == od::PERIOD_IN_WHICH_THE_STATUSWORD_CHANGES.address() => {
                self.input = self.period().map(|period| now + period);
            }
            Event::Written(address) if address == od::EMERGENCY_TO_BE_SENT.address() => {
                let [low, high, info, more_info] = self.od.get(od::EMERGENCY_TO_BE_SENT).to_le_bytes();
                let (code, vendor) = (ErrorCode(u16::from_le_bytes([low, high])), [info, more_info, 3, 4, 5]);
                self.device.emergency(code, ErrorRegister::VOLTAGE, vendor, &mut self.od);
            }
            Event::Reset(reset) => self.reset(now, reset),
            _ => {}
        }
    }

    fn period(&self) -> Option<Duration> {
        let period = Duration::from_millis(u64::from(self.od.get(od::PERIOD_IN_WHICH_THE_STATUSWORD_CHANGES)));
        (!period.is_zero()).then_some(period)
    }

    fn reset(&mut self, now: Instant, reset: Reset) {
        let indices = match reset {
            Reset::Node => 0..=0xFFFF,
            Reset::Communication => 0x1000..=0x1FFF,
        };
        self.od.reset(NODE, indices.clone());
        for (address, bytes) in self.memory.stored.iter().filter(|(address, _)| indices.contains(&address.index())) {
            let entry = self.od.entry(*address).unwrap();
            self.od.write(&entry, 0, bytes, true).unwrap();
        }
        self.input = self.input.filter(|_| reset == Reset::Communication);
        self.device.restart(now, &mut self.od);
    }
}

impl Node for DeviceUnderTest {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let event = self.device.handle_frame(now, frame, &mut Storing::new(&mut self.od, &mut self.memory));
        if let Some(event) = event {
            self.follow(now, event);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.input.is_some_and(|due| due <= now) {
            self.input = self.period().map(|period| now + period);
            let od::Statusword(word) = self.od.get(od::STATUSWORD);
            self.od.set(od::STATUSWORD, od::Statusword(word.wrapping_add(1)));
            self.device.changed(od::STATUSWORD.address());
        }
        if let Some(event) = self.device.handle_timeout(now, &mut self.od) {
            self.follow(now, event);
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.device.poll_transmit(now, &mut Storing::new(&mut self.od, &mut self.memory))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        [self.input, self.device.poll_timeout()].into_iter().flatten().min()
    }
}
