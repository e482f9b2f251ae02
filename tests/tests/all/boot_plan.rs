//! The expectations about a node in a manager's dictionary become those of its boot plan (CiA 302-2): each object sets
//! its own field of the plan.

use std::collections::BTreeMap;

use lexican_runtime::object::{Access, Address, DataType, Entry, ObjectDictionary, PdoMapping};
use lexican_runtime::procedure::BootPlan;
use lexican_runtime::{AbortCode, NodeId};

const NODE: NodeId = NodeId::literal(5);
const NOTHING: &[u8] = &[];

/// Entries of 32 bits.
struct Objects(BTreeMap<Address, u32>);

impl Objects {
    fn new(entries: &[(u16, u8, u32)]) -> Self {
        Objects(entries.iter().map(|&(index, sub, value)| (Address::new(index, sub), value)).collect())
    }
}

impl ObjectDictionary for Objects {
    fn entry(&self, address: Address) -> Result<Entry, AbortCode> {
        let entry = Entry::new(address.index(), address.sub(), DataType::Unsigned32, Access::Rw, PdoMapping::None);
        self.0.get(&address).map(|_| entry).ok_or(AbortCode::NO_SUCH_OBJECT)
    }
    fn len(&self, _entry: &Entry) -> Option<u32> {
        Some(4)
    }
    fn read(&mut self, entry: &Entry, _offset: u32, buffer: &mut [u8]) -> Result<usize, AbortCode> {
        buffer[..4].copy_from_slice(&self.0[&entry.address].to_le_bytes());
        Ok(4)
    }
    fn write(&mut self, _entry: &Entry, _offset: u32, _data: &[u8], _last: bool) -> Result<(), AbortCode> {
        Err(AbortCode::READ_ONLY)
    }
}

/// All expectations of a plan, in the order of their objects.
fn expectations(plan: &BootPlan<&[u8]>) -> [Option<u32>; 5] {
    [plan.device_type, plan.vendor, plan.product, plan.revision, plan.serial]
}

#[test]
fn each_object_is_a_field_of_its_own() {
    // Entries of another node, or of the manager as a whole, are not used.
    let expected = (0x1F84..=0x1F88).flat_map(|index| [(index, 0, 127), (index, 4, 4), (index, 5, u32::from(index))]);
    let configured = [(0x1F26, 5, 2_000), (0x1F27, 5, 3_000), (0x1F26, 4, 1), (0x1F27, 4, 1)];
    let mut objects = Objects::new(&expected.chain(configured).collect::<Vec<_>>());
    let plan = BootPlan::load(NODE, &[1, 2][..], &mut objects);
    assert_eq!(expectations(&plan), [0x1F84, 0x1F85, 0x1F86, 0x1F87, 0x1F88].map(Some));
    assert_eq!((plan.configured, plan.configuration), (Some((2_000, 3_000)), &[1, 2][..]));
}

#[test]
fn what_is_0_or_missing_is_not_expected() {
    let zeros: Vec<_> = (0x1F84..=0x1F88).map(|index| (index, 5, 0)).collect();
    for mut objects in [Objects::new(&zeros), Objects::new(&[])] {
        let plan = BootPlan::load(NODE, NOTHING, &mut objects);
        assert_eq!(expectations(&plan), [None; 5]);
        assert_eq!((plan.configured, plan.start, plan.keep_alive), (None, true, false));
    }
    // A date without a time is no expectation.
    let mut objects = Objects::new(&[(0x1F26, 5, 2_000), (0x1F27, 5, 0)]);
    assert_eq!(BootPlan::load(NODE, NOTHING, &mut objects).configured, None);
}

#[test]
fn starting_and_keeping_alive_have_a_bit_each() {
    for bit in 0..32 {
        let mut objects = Objects::new(&[(0x1F80, 0, 1 << bit), (0x1F81, 5, 1 << bit), (0x1F81, 4, !0)]);
        let plan = BootPlan::load(NODE, NOTHING, &mut objects);
        assert_eq!((plan.start, plan.keep_alive), (bit != 3, bit == 4), "bit {bit}");
    }
}
