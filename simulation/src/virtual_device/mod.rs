//! A device made of its data sheet: its values are the defaults, and can be written. A drive of CiA 402 moves.

mod dictionary;
mod program;

use std::sync::Arc;

use dictionary::SheetDictionary;
use lexican_eds::model;
use lexican_runtime::device::{Behaviour, Device, Event, Misconfigured};
use lexican_runtime::host::Node;
use lexican_runtime::object::{Address, ObjectDictionary};
use lexican_runtime::service::lss_device::{self, LssDevice};
use lexican_runtime::service::nmt::Reset;
use lexican_runtime::service::storage::Storing;
use lexican_runtime::wire::emcy::{ErrorCode, ErrorRegister};
use lexican_runtime::wire::lss::{self, Identity};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId, cia301};
use program::{BOOT_LOADER, Loader};
use simulator::eeprom::EepromError;
use simulator::script::Following;
use simulator::servo::script::{Change, Script, Seen};
use simulator::servo::{self, Inputs, Servo, ServoModel};
use simulator::{Memory, Storage};

/// Control word, status word and mode of operation. A device with all three is a drive that moves.
const DRIVE: [Address; 3] = [Address::new(0x6040, 0), Address::new(0x6041, 0), Address::new(0x6060, 0)];

/// The device of a data sheet: a [`Node`], to be attached to a bus.
pub struct VirtualDevice {
    sheet: Arc<model::Device>,
    on: bool,
    /// The node-ID unless another one is stored.
    given: Option<NodeId>,
    identity: Identity,
    lss: LssDevice,
    serves_lss: bool,
    /// `None` without a node-ID.
    device: Option<Box<Device<64, 64, 4, 32>>>,
    dictionary: SheetDictionary,
    memory: Memory,
    /// The axis of a drive with control word, status word and modes.
    servo: Option<Servo>,
    following: Following<Change>,
    /// `None` without a boot loader.
    loader: Option<Loader>,
    /// The parts of the dictionary that were inconsistent at the last boot.
    misconfigured: Vec<Misconfigured>,
}

/// Whether the device of a data sheet could have stored a value of an entry.
pub(super) fn keeps(sheet: &model::Device) -> impl Fn(Address, &[u8]) -> bool {
    let dictionary = SheetDictionary::new(dictionary::NO_NODE, sheet);
    move |address, value| dictionary.can_keep(address, value)
}

impl VirtualDevice {
    /// A new device that is switched on at `now`.
    #[must_use]
    pub fn power_on(now: Instant, node: NodeId, sheet: &model::Device) -> Self {
        VirtualDevice::with_memory(now, Some(node), Arc::new(sheet.clone()), Memory::default())
    }

    /// A device with stored parameters. Without a node-ID it waits for one by LSS.
    pub fn with_memory(now: Instant, node: Option<NodeId>, sheet: Arc<model::Device>, mut memory: Memory) -> Self {
        memory.bit_rates_kbit.clone_from(&sheet.info.bit_rates_kbit);
        let dictionary = SheetDictionary::new(dictionary::NO_NODE, &sheet);
        let part = |sub| {
            let value = dictionary.value(Address::new(cia301::IDENTITY, sub)).ok()?;
            Some(u32::from_le_bytes(value.try_into().ok()?))
        };
        let identity = Identity {
            vendor: part(1).unwrap_or(0),
            product: part(2).unwrap_or(0),
            revision: part(3).unwrap_or(0),
            serial: part(4).unwrap_or(0),
        };
        let mut virtual_device = VirtualDevice {
            on: false,
            given: node,
            identity,
            lss: LssDevice::new(identity, node),
            serves_lss: sheet.info.lss || node.is_none(),
            device: None,
            dictionary,
            memory,
            servo: None,
            following: Following::default(),
            loader: None,
            misconfigured: Vec::new(),
            sheet,
        };
        let is_drive = DRIVE.iter().all(|object| virtual_device.dictionary.raw(*object).is_some());
        virtual_device.servo = is_drive.then(|| Servo::new(now, &ServoModel::CIA_402));
        let has_loader = BOOT_LOADER.iter().all(|object| virtual_device.dictionary.value(*object).is_ok());
        let loader = || Loader::new(|address| virtual_device.dictionary.is_given(address));
        virtual_device.loader = has_loader.then(loader);
        virtual_device.set_power(now, true);
        virtual_device
    }

    fn boot(&mut self, now: Instant, node: Option<NodeId>, reset: Reset) {
        let dictionary = SheetDictionary::new(node.unwrap_or(dictionary::NO_NODE), &self.sheet);
        let before = std::mem::replace(&mut self.dictionary, dictionary);
        if self.servo.is_some() {
            self.dictionary.supply_defaults(servo::DEFAULTS);
        }
        let data_sheet = Address::new(cia301::STORE_EDS, 0);
        self.dictionary.supply_default(data_sheet, &self.memory.data_sheet);
        self.dictionary.reset(self.memory.values());
        if reset == Reset::Communication {
            self.dictionary.keep_application(before);
        }
        self.memory.writable = self.dictionary.writable();
        let Some(node) = node else {
            self.device = None;
            return;
        };
        let dummies = self.sheet.dummies.iter().filter(|dummy| dummy.code() < 32);
        let dummies = dummies.fold(0, |set, dummy| set | 1 << dummy.code());
        let behaviour = Behaviour { dummies, ..Behaviour::CIA_301 };
        self.measure(now);
        self.device.get_or_insert_with(|| Box::new(Device::new(node, behaviour)));
        let misconfigured = self.with_device(|device, od| {
            device.restart_as(node, now, od);
            device.misconfigured(od).collect()
        });
        self.misconfigured = misconfigured.unwrap_or_default();
    }

    pub(super) fn node(&self) -> Option<NodeId> {
        self.device.as_ref().filter(|_| self.on).map(|device| device.node())
    }

    /// The NMT state; `None` while it is off or has no node-ID.
    pub(super) fn nmt_state(&self) -> Option<NmtState> {
        self.device.as_ref().filter(|_| self.on).map(|device| device.nmt_state())
    }

    pub(super) fn serves_lss(&self) -> bool {
        self.serves_lss
    }

    /// The axis of a drive; `None` while it is off.
    pub(super) fn servo(&self) -> Option<&Servo> {
        self.servo.as_ref().filter(|_| self.on)
    }

    /// The inputs of a drive.
    pub(super) fn world(&self) -> Option<&Inputs> {
        self.servo.as_ref().map(Servo::inputs)
    }

    /// The model of a drive.
    pub(super) fn model(&self) -> Option<&'static ServoModel> {
        self.servo.as_ref().map(Servo::model)
    }

    /// Applies a change to the drive. A device that is no drive follows only changes of its power.
    pub(super) fn apply(&mut self, now: Instant, change: &Change) {
        match (change, &mut self.servo) {
            (Change::Input(setting), Some(servo)) => {
                servo.set_inputs(now, &mut self.dictionary, |inputs| setting.apply(inputs));
            }
            (Change::Turn(by), Some(servo)) => _ = servo.turn(now, &mut self.dictionary, *by),
            (Change::Input(_) | Change::Turn(_), None) => {}
            (Change::Power(on), _) => self.set_power(now, *on),
            (Change::PowerCycle, _) => {
                self.set_power(now, false);
                self.set_power(now, true);
            }
        }
        self.report(now);
    }

    /// Runs `script` on the drive, beginning at `now`.
    pub(super) fn follow_script(&mut self, now: Instant, script: Script) {
        self.following = Following::new(now, script);
        self.run_script(now);
    }

    fn seen(&self) -> Option<Seen<'_>> {
        let servo = self.servo.as_ref()?;
        Some(Seen { servo, storage: &self.dictionary, state: self.nmt_state() })
    }

    fn run_script(&mut self, now: Instant) {
        loop {
            let mut following = std::mem::take(&mut self.following);
            let is_so = |at, condition| self.seen().is_some_and(|seen| seen.is_so(at, condition));
            let changes = following.take_step(now, is_so);
            self.following = following;
            let Some(changes) = changes else { return };
            changes.iter().for_each(|change| self.apply(now, change));
        }
    }

    /// Puts what the drive measures into the dictionary.
    fn measure(&mut self, now: Instant) {
        if let Some(servo) = self.servo.as_mut().filter(|_| self.on) {
            servo.update(now, &mut self.dictionary);
        }
    }

    /// Sends what the drive reports, and TPDOs whose objects have changed.
    fn report(&mut self, now: Instant) {
        let Some(device) = self.device.as_mut().filter(|_| self.on) else { return };
        self.dictionary.state = device.nmt_state();
        match &mut self.servo {
            Some(servo) => servo::report(servo, now, device, &mut self.dictionary),
            None => device.compare(&mut self.dictionary),
        }
    }

    pub(super) fn value(&mut self, now: Instant, address: Address) -> Result<Vec<u8>, AbortCode> {
        self.measure(now);
        self.dictionary.value(address).map(<[u8]>::to_vec)
    }

    /// Changes a value from inside the device: regardless of its access, but within its size and limits. A
    /// configuration of the communication takes effect.
    pub(super) fn set_value(&mut self, now: Instant, address: Address, data: &[u8]) -> Result<(), AbortCode> {
        self.measure(now);
        if cia301::COMMUNICATION.contains(&address.index())
            && let Some(written) = self.with_device(|device, od| device.write(now, address, data, od))
        {
            written?;
            self.follow(now, Some(Event::Written(address)));
            return Ok(());
        }
        self.dictionary.set(address, data)?;
        self.keep(address);
        self.measure(now);
        self.with_device(|device, _| device.changed(address));
        self.report(now);
        Ok(())
    }

    pub(super) fn emergency(&mut self, code: ErrorCode, register: ErrorRegister, vendor: [u8; 5]) {
        self.with_device(|device, od| device.emergency(code, register, vendor, od));
    }

    pub(super) fn clear_errors(&mut self) {
        self.with_device(|device, od| device.clear(ErrorRegister(0xFF), od));
    }

    /// Why the stored parameters could not be written to their file.
    pub(super) fn trouble(&self) -> Option<&EepromError> {
        self.memory.trouble()
    }

    /// The parts of the dictionary that the device could not serve at its last boot; reported once.
    pub(super) fn take_misconfigured(&mut self) -> Vec<Misconfigured> {
        std::mem::take(&mut self.misconfigured)
    }

    fn with_device<T>(
        &mut self,
        call: impl FnOnce(&mut Device<64, 64, 4, 32>, &mut dyn ObjectDictionary) -> T,
    ) -> Option<T> {
        let device = self.device.as_mut().filter(|_| self.on)?;
        self.dictionary.state = device.nmt_state();
        let mut storing = Storing::new(&mut self.dictionary, &mut self.memory);
        Some(match &mut self.loader {
            Some(loader) => call(device, &mut loader.of(&mut storing)),
            None => call(device, &mut storing),
        })
    }

    fn follow(&mut self, now: Instant, event: Option<Event>) {
        if let Some(loader) = &mut self.loader {
            loader.obey(event);
        }
        if let (Some(servo), Some(device)) = (&mut self.servo, &self.device) {
            servo::follow(servo, now, device, &mut self.dictionary, event);
        }
        match event {
            Some(Event::Reset(reset)) => {
                if let Some(servo) = self.servo.as_mut().filter(|_| reset == Reset::Node) {
                    servo.restart(now);
                }
                let node = self.lss.reset();
                self.boot(now, node, reset);
            }
            Some(Event::Written(address)) => self.keep(address),
            _ => {}
        }
        self.report(now);
    }

    /// Stores an entry that needs no store command.
    fn keep(&mut self, address: Address) {
        if self.dictionary.is_persistent(address)
            && let Ok(value) = self.dictionary.value(address)
        {
            self.memory.keep(address, value.to_vec());
        }
    }
}

impl Node for VirtualDevice {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.on && self.serves_lss && frame.id() == lss::REQUEST {
            let event = self.lss.handle_frame(now, frame, &mut self.memory);
            if let Some(lss_device::Event::NodeIdGiven(node)) = event {
                self.boot(now, Some(node), Reset::Communication);
            }
        } else {
            self.measure(now);
            let event = self.with_device(|device, od| device.handle_frame(now, frame, od)).flatten();
            self.follow(now, event);
        }
        self.run_script(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.measure(now);
        let event = self.with_device(|device, od| device.handle_timeout(now, od)).flatten();
        self.follow(now, event);
        self.run_script(now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let answer = self.lss.poll_transmit(now).filter(|_| self.on);
        answer.or_else(|| self.with_device(|device, od| device.poll_transmit(now, od)).flatten())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let device = self.device.as_ref().filter(|_| self.on);
        let servo = self.servo.as_ref().filter(|_| device.is_some()).and_then(Servo::next_event);
        let script = self.seen().and_then(|seen| seen.next_step(&self.following));
        [device.and_then(|device| device.poll_timeout()), servo, script].into_iter().flatten().min()
    }

    fn concerns(&self) -> Vec<CobId> {
        let device = self.device.as_ref().filter(|_| self.on);
        // Never empty, which would mean all frames.
        [lss::REQUEST].into_iter().chain(device.into_iter().flat_map(|device| device.cob_ids())).collect()
    }

    fn generation(&self) -> u32 {
        self.device.as_ref().filter(|_| self.on).map_or(0, |device| device.generation())
    }

    fn changes_only_when_called(&self) -> bool {
        true
    }

    fn set_power(&mut self, now: Instant, on: bool) {
        let boots = on && !self.on;
        if on != self.on
            && let Some(servo) = &mut self.servo
        {
            servo.restart(now);
        }
        self.on = on;
        if boots {
            let node = self.memory.node().or(self.given);
            self.lss = LssDevice::new(self.identity, node);
            self.boot(now, node, Reset::Node);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use lexican_runtime::host::blocking::Network;
    use lexican_runtime::host::{AccessError, VirtualBus, VirtualLink};
    use lexican_runtime::service::sdo_client::SdoError;
    use lexican_runtime::wire::nmt::NmtState;
    use lexican_runtime::{CobId, Duration, host::Link};
    use simulator::servo::script::Setting;

    const NODE: NodeId = NodeId::literal(5);

    /// A bus with a device that has the dictionary of the drive.
    fn network() -> (VirtualBus, Network<VirtualLink>) {
        let sheet = samples::drive();
        let bus = VirtualBus::new();
        bus.attach(VirtualDevice::power_on(Instant::ZERO, NODE, &sheet));
        let link = bus.link();
        bus.advance(Duration::from_millis(1));
        (bus, Network::new(link))
    }

    fn aborted(result: Result<(), AccessError>) -> Option<AbortCode> {
        match result {
            Err(AccessError::Sdo { error: SdoError::Aborted { code, .. }, .. }) => Some(code),
            _ => None,
        }
    }

    #[test]
    fn defaults_are_read_and_values_are_written() {
        let (_, mut network) = network();
        assert_eq!(network.read_bytes(NODE, Address::new(0x1400, 1)).unwrap(), 0x205_u32.to_le_bytes());
        assert_eq!(network.read_bytes(NODE, Address::new(0x1018, 1)).unwrap(), 0x195_u32.to_le_bytes());
        let a_pos = Address::new(0x2410, 4);
        network.write_bytes(NODE, a_pos, &[77]).or_else(|_| network.write_bytes(NODE, a_pos, &[77, 0])).unwrap();
        assert_eq!(network.read_bytes(NODE, a_pos).unwrap()[0], 77);
    }

    #[test]
    fn access_sizes_and_limits_are_enforced() {
        let (_, mut network) = network();
        let mut write = |index, sub, data: &[u8]| aborted(network.write_bytes(NODE, Address::new(index, sub), data));
        assert_eq!(write(0x1018, 1, &[0; 4]), Some(AbortCode::READ_ONLY));
        assert_eq!(write(0x6060, 0, &[1, 0, 0]), Some(AbortCode::LENGTH_TOO_HIGH));
        assert_eq!(write(0x6060, 0, &[9]), Some(AbortCode::VALUE_TOO_HIGH));
        assert_eq!(write(0x6060, 0, &[0]), Some(AbortCode::VALUE_TOO_LOW));
        assert_eq!(write(0x1018, 9, &[0]), Some(AbortCode::NO_SUCH_SUB_INDEX));
        assert_eq!(write(0x7000, 0, &[0]), Some(AbortCode::NO_SUCH_OBJECT));
    }

    #[test]
    fn it_has_nmt_a_heartbeat_and_pdos() {
        let (bus, mut network) = network();
        network.write_bytes(NODE, Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0), &100_u16.to_le_bytes()).unwrap();
        let mut link = network.into_link();
        let beat = link.receive_frame(bus.now() + Duration::from_millis(150)).unwrap().unwrap();
        assert_eq!((beat.id().raw(), beat.data()), (0x705, &[NmtState::PreOperational.code()][..]));

        // RPDO3 has the target position, which SDO reads back.
        let start = Frame::from_array(CobId::NMT, [0x01, 0x05]);
        let target = Frame::from_array(CobId::of_node(0x400, NODE), [0x1F, 0, 0x88, 0x13, 0, 0]);
        link.send(&start).unwrap();
        link.send(&target).unwrap();
        bus.advance(Duration::from_millis(1));
        let mut network = Network::new(link);
        assert_eq!(network.read_bytes(NODE, Address::new(0x607A, 0)).unwrap(), 5000_i32.to_le_bytes());
    }

    #[test]
    fn a_reset_restores_the_defaults_except_for_persistent_entries() {
        let (bus, mut network) = network();
        let (target, mode) = (Address::new(0x607A, 0), Address::new(0x6060, 0));
        network.write_bytes(NODE, target, &5000_i32.to_le_bytes()).unwrap();
        network.write_bytes(NODE, mode, &[2]).unwrap();
        network.command(lexican_runtime::wire::nmt::NmtCommand::ResetNode, Some(NODE)).unwrap();
        let until = bus.now() + Duration::from_millis(10);
        while network.next_event(until).unwrap().is_some() {}
        assert_eq!(network.read_bytes(NODE, target).unwrap(), [0; 4]);
        assert_eq!(network.read_bytes(NODE, mode).unwrap(), [2]);
    }

    #[test]
    fn a_reset_of_the_communication_leaves_the_application_alone() {
        let (bus, mut network) = network();
        let (target, heartbeat) = (Address::new(0x607A, 0), Address::new(0x1017, 0));
        network.write_bytes(NODE, target, &5000_i32.to_le_bytes()).unwrap();
        network.write_bytes(NODE, heartbeat, &1000_u16.to_le_bytes()).unwrap();
        network.command(lexican_runtime::wire::nmt::NmtCommand::ResetCommunication, Some(NODE)).unwrap();
        let until = bus.now() + Duration::from_millis(10);
        while network.next_event(until).unwrap().is_some() {}
        assert_eq!(network.read_bytes(NODE, target).unwrap(), 5000_i32.to_le_bytes());
        assert_eq!(network.read_bytes(NODE, heartbeat).unwrap(), [0; 2]);
    }

    #[test]
    fn a_drive_of_cia_402_moves() {
        let sheet = lexican_toolbox::data_sheet::DataSheet::load("kollmorgen/akd", &[]).unwrap().device;
        let bus = VirtualBus::new();
        let mut device = VirtualDevice::power_on(Instant::ZERO, NODE, &sheet);
        assert!(device.servo().is_some());
        let limit = Setting::new("positive_limit", "3000").unwrap();
        device.apply(Instant::ZERO, &Change::Input(limit));
        bus.attach(device);
        let link = bus.link();
        bus.advance(Duration::from_millis(1));
        let mut network = Network::new(link);
        let mut write = |index, sub, data: &[u8]| network.write_bytes(NODE, Address::new(index, sub), data).unwrap();
        write(0x6060, 0, &[1]);
        write(0x6081, 0, &1000_u32.to_le_bytes());
        for word in [0x06_u16, 0x07, 0x0F] {
            write(0x6040, 0, &word.to_le_bytes());
        }
        write(0x607A, 0, &2000_i32.to_le_bytes());
        write(0x6040, 0, &0x1F_u16.to_le_bytes());
        bus.advance(Duration::from_secs(60));
        let mut read = |index| network.read_bytes(NODE, Address::new(index, 0)).unwrap();
        assert_eq!(read(0x6064), 2000_i32.to_le_bytes());
        assert_eq!(u16::from_le_bytes(read(0x6041).try_into().unwrap()), 0x1637);
        // Reset node loses the position; the limit switch stays where it is.
        network.command(lexican_runtime::wire::nmt::NmtCommand::ResetNode, Some(NODE)).unwrap();
        bus.advance(Duration::from_millis(10));
        assert_eq!(network.read_bytes(NODE, Address::new(0x6064, 0)).unwrap(), [0; 4]);
        assert_eq!(network.read_bytes(NODE, Address::new(0x6041, 0)).unwrap(), 0x0270_u16.to_le_bytes());
    }

    #[test]
    fn another_device_has_no_axis() {
        let device = VirtualDevice::power_on(Instant::ZERO, NODE, &samples::sensor());
        assert!(device.servo().is_none());
    }
}
