//! Stored values over power failures: whichever byte is being programmed or erased, a device starts with the old values
//! or the new ones, and can store again.

use std::collections::BTreeMap;

use lexican_runtime::object::{Access, Address, DataType, Dictionary, PdoMapping, Row, Table};
use lexican_runtime::service::snapshot::{Flash, FlashError, Snapshot};
use lexican_runtime::service::storage::Storage;
use lexican_runtime::{AbortCode, NodeId};
use proptest::prelude::*;

const NODE: NodeId = NodeId::literal(5);
const SLOT: usize = 128;
/// The entry where the application keeps a value of its own.
const OWN: Address = Address::new(0x0001, 0);
const COB_ID: Address = Address::new(0x1014, 0);
const HEARTBEAT: Address = Address::new(0x1017, 0);
const NAME: Address = Address::new(0x2000, 0);
const SPEED: Address = Address::new(0x6000, 0);
const OUTPUT: Address = Address::new(0x6200, 0);

const fn entry(address: Address, data_type: DataType, access: Access) -> Row {
    Row::new(address.index(), address.sub(), data_type, access, PdoMapping::None)
}

static TABLE: Table = Table {
    rows: &[
        entry(Address::new(0x1003, 0), DataType::Unsigned8, Access::Rw).at(0, 1),
        entry(Address::new(0x1010, 1), DataType::Unsigned32, Access::Rw).at(1, 4),
        entry(COB_ID, DataType::Unsigned32, Access::Rw).at(5, 4).plus_node(),
        entry(HEARTBEAT, DataType::Unsigned16, Access::Rw).at(9, 2),
        entry(NAME, DataType::VisibleString, Access::Rw).at(13, 10),
        entry(SPEED, DataType::Unsigned16, Access::Rw).at(23, 2),
        entry(Address::new(0x6001, 0), DataType::Unsigned16, Access::Ro).at(25, 2),
        entry(OUTPUT, DataType::Unsigned8, Access::Rw).at(27, 1),
    ],
    limits: &[],
    image: &[0, 1, 0, 0, 0, 0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
};

type Od = Dictionary<28>;

/// Flash that programs `WRITE` bytes at once. Its power fails after `left` bytes.
#[derive(Clone)]
struct Nor<const WRITE: usize> {
    bytes: [u8; 2 * SLOT],
    left: Option<usize>,
}

impl<const WRITE: usize> Nor<WRITE> {
    const ERASED: Self = Nor { bytes: [0xFF; 2 * SLOT], left: None };

    /// Changes a byte to `new`. If power fails, the byte is torn.
    fn change(&mut self, at: usize, new: u8) -> Result<(), FlashError> {
        match &mut self.left {
            Some(0) => Err(FlashError),
            Some(left) if *left == 1 => {
                *left = 0;
                // Some of the bits have changed, which ones depends on the place.
                let changed = (at as u8).wrapping_mul(0x9D) ^ 0xA5;
                self.bytes[at] = self.bytes[at] & !changed | new & changed;
                Err(FlashError)
            }
            left => {
                left.iter_mut().for_each(|left| *left -= 1);
                self.bytes[at] = new;
                Ok(())
            }
        }
    }
}

impl<const WRITE: usize> Flash for Nor<WRITE> {
    const WRITE_SIZE: usize = WRITE;

    fn slot_size(&self) -> u32 {
        SLOT as u32
    }

    fn read(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(), FlashError> {
        buffer.copy_from_slice(&self.bytes[offset as usize..][..buffer.len()]);
        Ok(())
    }

    fn erase(&mut self, offset: u32) -> Result<(), FlashError> {
        assert_eq!(offset as usize % SLOT, 0);
        (offset as usize..offset as usize + SLOT).try_for_each(|at| self.change(at, 0xFF))
    }

    fn program(&mut self, offset: u32, data: &[u8]) -> Result<(), FlashError> {
        assert_eq!((offset as usize % WRITE, data.len() % WRITE), (0, 0), "{offset} {data:?}");
        for (at, byte) in (offset as usize..).zip(data) {
            assert_eq!(self.bytes[at], 0xFF, "byte {at} is not erased");
            self.change(at, *byte)?;
        }
        Ok(())
    }
}

/// A device's dictionary and what it stores.
#[derive(Clone)]
struct Device<const WRITE: usize> {
    od: Od,
    snapshot: Snapshot<Nor<WRITE>>,
}

impl<const WRITE: usize> Device<WRITE> {
    fn boot(flash: Nor<WRITE>, node: NodeId) -> Self {
        let snapshot = Snapshot::new(flash, &TABLE, |address| address != OUTPUT);
        let mut device = Device { od: Dictionary::new(&TABLE, node), snapshot };
        device.snapshot.load(node, 0..=0xFFFF, &mut device.od).unwrap();
        device
    }

    /// Restores power.
    fn reboot(mut self) -> Self {
        let bytes = self.snapshot.flash().bytes;
        Device::boot(Nor { bytes, left: None }, NODE)
    }

    fn bytes(&mut self, address: Address) -> Vec<u8> {
        use lexican_runtime::object::ObjectDictionary;
        let entry = self.od.entry(address).unwrap();
        let mut buffer = [0; 16];
        let len = self.od.read(&entry, 0, &mut buffer).unwrap();
        buffer[..len].to_vec()
    }

    fn write(&mut self, address: Address, value: &[u8]) {
        use lexican_runtime::object::ObjectDictionary;
        let entry = self.od.entry(address).unwrap();
        self.od.write(&entry, 0, value, true).unwrap();
    }

    /// All values that can be stored.
    fn values(&mut self) -> BTreeMap<Address, Vec<u8>> {
        let own = self.snapshot.kept(OWN, &mut [0; 16]).map(|own| (OWN, own.to_vec()));
        let entries = TABLE.entries().map(|entry| (entry.address, self.bytes(entry.address)));
        entries.chain(own).collect()
    }
}

/// What is done to a device.
#[derive(Clone, Copy, Debug)]
enum Step {
    Write(Address, u8),
    Store(u8),
    Restore(u8),
    Keep(Option<u8>),
}

impl Step {
    fn take<const WRITE: usize>(self, device: &mut Device<WRITE>) -> Result<(), AbortCode> {
        match self {
            Step::Write(address, value) => {
                let len = device.bytes(address).len().max(1);
                device.write(address, &vec![value; len]);
                Ok(())
            }
            Step::Store(group) => device.snapshot.store(group, &mut device.od),
            Step::Restore(group) => device.snapshot.restore(group),
            Step::Keep(value) => {
                Ok(device.snapshot.keep(OWN, value.map(|value| [value; 3]).as_ref().map(|v| &v[..]))?)
            }
        }
    }
}

const LIFE: [Step; 13] = [
    Step::Keep(Some(7)),
    Step::Write(HEARTBEAT, 1),
    Step::Store(2),
    Step::Write(SPEED, 2),
    Step::Write(NAME, b'a'),
    Step::Store(1),
    Step::Write(HEARTBEAT, 3),
    Step::Store(1),
    Step::Restore(3),
    Step::Write(COB_ID, 4),
    Step::Store(2),
    Step::Keep(None),
    Step::Restore(1),
];

/// Takes the step with a power failure after `cut` bytes. Returns whether the step was finished before.
fn survives_a_cut<const WRITE: usize>(device: &mut Device<WRITE>, step: Step, cut: usize) -> bool {
    let old = device.clone().reboot().values();
    let mut whole = device.clone();
    step.take(&mut whole).unwrap();
    let new = whole.clone().reboot().values();

    let mut cut_off = device.clone();
    cut_off.snapshot.flash().left = Some(cut);
    let outcome = step.take(&mut cut_off);
    let mut rebooted = cut_off.reboot();
    let values = rebooted.values();
    if outcome.is_ok() {
        assert_eq!(values, new, "{step:?} is done: {cut}");
    } else {
        assert!(values == old || values == new, "{step:?} after {cut}: {values:?}\n{old:?}\n{new:?}");
    }
    // The device works on, with the slot in which it was interrupted.
    rebooted.od = device.od.clone();
    step.take(&mut rebooted).unwrap();
    assert_eq!(rebooted.clone().reboot().values(), new, "{step:?} again after {cut}");
    *device = rebooted;
    outcome.is_ok()
}

fn survives_every_cut<const WRITE: usize>() {
    let mut device = Device::boot(Nor::<WRITE>::ERASED, NODE);
    let mut cuts = 0;
    for step in LIFE {
        for cut in 0.. {
            cuts += 1;
            if survives_a_cut(&mut device.clone(), step, cut) {
                break;
            }
        }
        step.take(&mut device).unwrap();
    }
    assert!(cuts > 900, "{cuts}");
}

#[test]
fn a_loss_of_power_at_any_byte_leaves_the_old_values_or_the_new_ones() {
    survives_every_cut::<1>();
    survives_every_cut::<4>();
    survives_every_cut::<8>();
    survives_every_cut::<32>();
}

fn any_step() -> impl Strategy<Value = Step> {
    let addresses = prop::sample::select(vec![HEARTBEAT, COB_ID, NAME, SPEED, OUTPUT]);
    prop_oneof![
        (addresses, any::<u8>()).prop_map(|(address, value)| Step::Write(address, value)),
        (1..=4_u8).prop_map(Step::Store),
        (1..=4_u8).prop_map(Step::Restore),
        any::<Option<u8>>().prop_map(Step::Keep),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn losses_of_power_one_after_the_other_are_survived(
        life in prop::collection::vec((any_step(), 0..300_usize), 1..20),
    ) {
        let mut device = Device::boot(Nor::<8>::ERASED, NODE);
        for (step, cut) in life {
            survives_a_cut(&mut device, step, cut);
        }
    }

    #[test]
    fn whatever_lies_in_the_flash_is_survived(bytes in prop::collection::vec(any::<u8>(), 2 * SLOT), is_ours in any::<bool>()) {
        let mut bytes: [u8; 2 * SLOT] = bytes.try_into().unwrap();
        if is_ours {
            bytes[..4].copy_from_slice(b"LXS1");
            bytes[SLOT..SLOT + 4].copy_from_slice(b"LXS1");
        }
        let mut device = Device::boot(Nor::<4> { bytes, left: None }, NODE);
        prop_assert!(device.snapshot.is_empty());
        device.snapshot.store(1, &mut device.od).unwrap();
    }
}

#[test]
fn groups_are_stored_and_restored_by_themselves() {
    let mut device = Device::boot(Nor::<8>::ERASED, NODE);
    for step in [Step::Write(HEARTBEAT, 1), Step::Write(SPEED, 2), Step::Write(OUTPUT, 3), Step::Store(1)] {
        step.take(&mut device).unwrap();
    }
    let mut device = device.reboot();
    assert_eq!((device.bytes(HEARTBEAT), device.bytes(SPEED)), (vec![1, 1], vec![2, 2]));
    assert_eq!(device.bytes(OUTPUT), [0], "the application has left it out");
    for step in [Step::Write(HEARTBEAT, 4), Step::Write(SPEED, 5), Step::Store(2), Step::Restore(3)] {
        step.take(&mut device).unwrap();
    }
    let mut device = device.reboot();
    assert_eq!((device.bytes(HEARTBEAT), device.bytes(SPEED)), (vec![4, 4], vec![0, 0]));
}

#[test]
fn a_default_cob_id_follows_the_node_id_and_another_one_stays() {
    let mut device = Device::boot(Nor::<8>::ERASED, NODE);
    Step::Store(1).take(&mut device).unwrap();
    let flash = device.snapshot.flash().clone();
    assert_eq!(Device::boot(flash, NodeId::literal(9)).bytes(COB_ID), [0x89, 0, 0, 0]);
    device.write(COB_ID, &[0xA0, 0, 0, 0]);
    Step::Store(1).take(&mut device).unwrap();
    let flash = device.snapshot.flash().clone();
    assert_eq!(Device::boot(flash, NodeId::literal(9)).bytes(COB_ID), [0xA0, 0, 0, 0]);
}

#[test]
fn every_flipped_bit_brings_back_the_older_snapshot() {
    let mut device = Device::boot(Nor::<1>::ERASED, NODE);
    for step in [Step::Write(SPEED, 1), Step::Store(1), Step::Write(SPEED, 2), Step::Store(1)] {
        step.take(&mut device).unwrap();
    }
    // The newest snapshot is in the second slot, up to the last programmed byte.
    let flash = device.snapshot.flash().clone();
    let end = flash.bytes.iter().rposition(|byte| *byte != 0xFF).unwrap() + 1;
    for bit in SLOT * 8..end * 8 {
        let mut flash = flash.clone();
        flash.bytes[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(Device::boot(flash, NODE).bytes(SPEED), [1, 1], "bit {bit}");
    }
}

#[test]
fn what_a_slot_cannot_hold_is_refused_and_nothing_is_lost() {
    let mut device = Device::boot(Nor::<8>::ERASED, NODE);
    Step::Keep(Some(7)).take(&mut device).unwrap();
    assert_eq!(device.snapshot.keep(OWN, Some(&[0; 65])), Err(FlashError));
    for sub in 1.. {
        if device.snapshot.keep(Address::new(2, sub), Some(&[0; 40])).is_err() {
            assert_eq!(sub, 3, "two of them fit into {SLOT} bytes");
            break;
        }
    }
    assert_eq!(device.snapshot.kept(OWN, &mut [0; 3]), Some(&[7; 3][..]));
    assert_eq!(device.reboot().snapshot.kept(OWN, &mut [0; 3]), Some(&[7; 3][..]));
}
