//! The values that are written into nodes when the machine boots, in order.

use lexican_eds::model::Device;
use lexican_runtime::host::{self, Link};
use lexican_runtime::manager::{Assignment, Guarding, Manager};
use lexican_runtime::object::{Address, Direction};
use lexican_runtime::procedure::{ConciseDcf, Step};
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{CobId, Duration, Instant, NodeId, cia301};
use lexican_toolbox::lss::{Session, Times, Trouble};
use lexican_toolbox::node::identity::{PRODUCT, VENDOR};
use lexican_toolbox::parameters::order::in_order;
use lexican_toolbox::parameters::restore::configured;
use lexican_toolbox::values::wire::{encode, written};
use lexican_toolbox::values::{given, resolved};

use crate::at::Time;
use crate::model::{Identity, Machine, Node, PlannedPdo};
use crate::nodes::PATIENCE;

/// A value to write into a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Write {
    /// The entry.
    pub address: Address,
    /// In wire form.
    pub data: Vec<u8>,
    /// Where the value comes from.
    pub why: Why,
    /// Whether the data sheet has the same value, so that a device in its factory state needs no write.
    pub is_default: bool,
}

/// Where a written value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The concise DCF of the node.
    ConciseDcf,
    /// The DCF that serves as the node's data sheet.
    Dcf,
    /// Error control: it watches the manager, or is watched.
    ErrorControl,
    /// The configuration of a PDO.
    Pdo,
    /// A setting of the node.
    Setting,
}

impl Why {
    /// One or two words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Why::ConciseDcf => "concise DCF",
            Why::Dcf => "DCF",
            Why::ErrorControl => "error control",
            Why::Pdo => "PDO",
            Why::Setting => "setting",
        }
    }
}

impl Machine {
    /// All values to write into a node: its concise DCF, the values of its DCF, error control, PDOs, settings.
    #[must_use]
    pub fn writes(&self, node: &Node) -> Vec<Write> {
        let (device, id) = (node.device(), node.id.unwrap_or(NodeId::literal(1)));
        let mut writes = Vec::new();
        let mut put = |why, address: Address, data: Vec<u8>| {
            let is_default = device.is_some_and(|device| of_sheet(device, id, address).as_ref() == Some(&data));
            writes.push(Write { address, data: written(device, data), why, is_default });
        };
        for (address, data) in node.dcf.iter().flatten() {
            put(Why::ConciseDcf, *address, data.clone());
        }
        let of_dcf = device.map(|device| configured(device, id)).unwrap_or_default();
        in_order(of_dcf).into_iter().for_each(|write| put(Why::Dcf, write.address, write.data));
        if let Some((manager, within)) = self.watches_manager(node) {
            let ms = Time(within).ms() as u32;
            let value = u32::from(manager.get()) << 16 | ms & 0xFFFF;
            put(Why::ErrorControl, Address::new(cia301::CONSUMER_HEARTBEAT_TIME, 1), value.to_le_bytes().to_vec());
        }
        if let Some(heartbeat) = node.heartbeat {
            let ms = Time(heartbeat).ms() as u16;
            put(Why::ErrorControl, Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0), ms.to_le_bytes().to_vec());
        }
        if let (Some(guard_time), Some(_)) = (node.guarding, node.life_time()) {
            let ms = Time(guard_time).ms() as u16;
            put(Why::ErrorControl, Address::new(cia301::GUARD_TIME, 0), ms.to_le_bytes().to_vec());
            put(Why::ErrorControl, Address::new(cia301::LIFE_TIME_FACTOR, 0), vec![node.retry]);
        }
        for direction in [Direction::Receive, Direction::Transmit] {
            let mut pdos: Vec<_> = node.pdos.iter().filter(|pdo| pdo.after.name.direction == direction).collect();
            pdos.sort_by_key(|pdo| pdo.after.name.number);
            for (address, data) in pdos.into_iter().flat_map(|pdo| of_pdo(device, pdo)) {
                put(Why::Pdo, address, data);
            }
        }
        let settings = node.settings.iter().map(|setting| (setting.address, setting.data.clone()));
        in_order(settings).into_iter().for_each(|write| put(Why::Setting, write.address, write.data));
        // Writes that disable and enable a PDO are needed although the final value is that of the data sheet.
        let is_switch = |write: &Write| write.why == Why::Pdo && is_switched(node, write.address);
        writes.iter_mut().filter(|write| is_switch(write)).for_each(|write| write.is_default = false);
        writes
    }

    /// The manager whose heartbeat a node watches (1016h), and the consumer time.
    #[must_use]
    pub fn watches_manager(&self, node: &Node) -> Option<(NodeId, Duration)> {
        let within = node.protection.unwrap_or(self.bus.heartbeat.as_ref()?.value.times(PATIENCE.into()));
        let watches = !within.is_zero() && node.has(cia301::CONSUMER_HEARTBEAT_TIME, 1);
        self.bus.manager.filter(|_| watches).map(|manager| (manager, within))
    }

    /// Gives node-IDs to the devices that the machine identifies for LSS (CiA 305), and calls `named` for each. A
    /// device that has its node-ID already, or does not answer, is left to the boot.
    pub fn give_node_ids<E: From<Trouble>>(
        &self,
        link: &mut impl Link,
        mut named: impl FnMut(&Node, NodeId) -> Result<(), E>,
    ) -> Result<(), E> {
        let wanted: Vec<_> = self.nodes.iter().filter_map(|node| Some((node, node.id?, node.lss?))).collect();
        if wanted.is_empty() {
            return Ok(());
        }
        Session::run(link, Times::default(), |session| {
            for (node, id, identity) in wanted {
                if session.is_taken(id)? {
                    continue;
                }
                let Some(selected) = session.name(identity, id, false)? else { continue };
                if !session.take(selected.node, Some(id), true)? {
                    return Err(Trouble::Refused(id).into());
                }
                named(node, id)?;
            }
            Ok(())
        })
    }

    /// The plan of the manager for the machine's nodes.
    ///
    /// Nodes without node-ID are left out: they have to get one by LSS first.
    #[must_use]
    pub fn boot_plan(&self) -> host::Plan {
        let mut plan = host::Plan::new(self.bus.on_loss).with_start_of_all(self.bus.start_all);
        for node in &self.nodes {
            if let Some(id) = node.id {
                plan.assign(id, self.assignment(node, id)).expect("there is room for all nodes");
            }
        }
        plan
    }

    /// Makes a manager produce heartbeat and SYNC as the machine says.
    pub fn produce<const NODES: usize>(&self, manager: &mut Manager<NODES>, now: Instant) {
        if let (Some(heartbeat), Some(node)) = (&self.bus.heartbeat, self.bus.manager) {
            manager.produce_heartbeat(now, node, heartbeat.value);
        }
        if let Some(period) = self.bus.sync {
            manager.produce_sync(now, CobId::SYNC, period, 0);
        }
    }

    /// The part of the manager's plan about one node.
    #[must_use]
    pub fn assignment(&self, node: &Node, id: NodeId) -> Assignment<Vec<u8>> {
        let writes = self.writes(node);
        let steps = writes.iter().map(|write| Step::bytes(write.address, &write.data));
        let configuration = ConciseDcf::to_vec(steps).expect("these are writes");
        let mut assignment = Assignment::new(id, configuration);
        if let Some(heartbeat) = node.heartbeat {
            assignment = assignment.with_heartbeat(heartbeat.times(PATIENCE.into()));
        }
        if let Some(guard_time) = node.guarding {
            assignment = assignment.with_guarding(Guarding { guard_time, retry_factor: node.retry });
        }
        assignment.mandatory = !node.optional;
        assignment.boots_again = node.boots_again;
        let plan = &mut assignment.plan;
        (plan.start, plan.keep_alive) = (node.start, node.keep_alive);
        let number = |address: Address| {
            let device = node.device()?;
            let value = resolved(given(device.entry(address.index(), address.sub())?)?, id).as_integer()?;
            u32::try_from(value).ok().filter(|value| *value != 0)
        };
        plan.device_type = number(Address::new(cia301::DEVICE_TYPE, 0));
        let Identity { vendor, product, revision, serial } = node.identity;
        (plan.vendor, plan.product) = (vendor.or_else(|| number(VENDOR)), product.or_else(|| number(PRODUCT)));
        (plan.revision, plan.serial) = (revision.map(|it| it.number), serial);
        plan.or_later = revision.is_some_and(|it| it.or_later);
        assignment
    }

    /// The concise DCF of a node (1F22h), without values that the data sheet has already, as dcfgen writes it.
    #[must_use]
    pub fn concise_dcf(&self, node: &Node) -> Vec<u8> {
        let writes = self.writes(node);
        let steps = writes.iter().filter(|write| !write.is_default || write.why == Why::Setting);
        ConciseDcf::to_vec(steps.map(|write| Step::bytes(write.address, &write.data))).expect("these are writes")
    }
}

impl Node {
    /// The life time, after which a node notices that it is not guarded any more (100Ch, 100Dh).
    #[must_use]
    pub fn life_time(&self) -> Option<Duration> {
        let notices = self.protection != Some(Duration::ZERO)
            && self.has(cia301::GUARD_TIME, 0)
            && self.has(cia301::LIFE_TIME_FACTOR, 0);
        self.guarding.filter(|_| notices).map(|guard_time| guard_time.times(self.retry.into()))
    }

    /// Whether its data sheet has an entry.
    pub(crate) fn has(&self, index: u16, sub: u8) -> bool {
        self.device().is_some_and(|device| device.entry(index, sub).is_some())
    }
}

/// The value of an entry in the data sheet, in wire form.
fn of_sheet(device: &Device, node: NodeId, address: Address) -> Option<Vec<u8>> {
    let entry = device.entry(address.index(), address.sub())?;
    encode(entry.data_type, &resolved(given(entry)?, node))
}

/// Whether an entry enables, disables or maps a PDO of the node.
fn is_switched(node: &Node, address: Address) -> bool {
    node.pdos.iter().any(|pdo| {
        let (name, is_on) = (pdo.after.name, pdo.after.cob_id.is_valid());
        is_on && address == name.parameter(1) || address.index() == name.mapping(0).index()
    })
}

/// The writes that configure a PDO whatever its state: disable, change, enable (CiA 301, 7.5.2.36). Read-only entries
/// have the wanted value already, and are left out.
fn of_pdo(device: Option<&Device>, pdo: &PlannedPdo) -> Vec<(Address, Vec<u8>)> {
    let is_fixed = |address: Address| {
        let entry = device.and_then(|device| device.entry(address.index(), address.sub()));
        entry.is_some_and(|entry| !entry.access.writable())
    };
    let (before, after, name) = (&pdo.before, &pdo.after, pdo.after.name);
    let mut writes = vec![(name.parameter(1), after.cob_id.switched_off().0.to_le_bytes().to_vec())];
    if !after.cob_id.is_valid() {
        writes.retain(|(address, _)| !is_fixed(*address));
        return writes;
    }
    if before.transmission != after.transmission || pdo.maps {
        writes.extend(after.transmission.map(|it: TransmissionType| (name.parameter(2), vec![it.code()])));
    }
    for (sub, before, after) in
        [(3, before.inhibit_100us, after.inhibit_100us), (5, before.event_timer_ms, after.event_timer_ms)]
    {
        if before != after || pdo.maps {
            writes.extend(after.map(|time| (name.parameter(sub), time.to_le_bytes().to_vec())));
        }
    }
    if pdo.maps && !is_fixed(name.mapping(0)) {
        writes.push((name.mapping(0), vec![0]));
        for (sub, mapped) in (1..).zip(&after.mapping) {
            writes.push((name.mapping(sub), mapped.to_parameter().to_le_bytes().to_vec()));
        }
        writes.push((name.mapping(0), vec![after.mapping.len() as u8]));
    }
    writes.push((name.parameter(1), after.cob_id.0.to_le_bytes().to_vec()));
    writes.retain(|(address, _)| !is_fixed(*address));
    writes
}
