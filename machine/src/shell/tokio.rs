//! A machine for tokio.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use futures_util::future::{join_all, select_all, try_join_all};
use lexican_driver::{Any, Description, DriveContext};
use lexican_eds::model::Device;
use lexican_runtime::host::tokio::{Event as NetworkEvent, Network};
use lexican_runtime::object::{Address, Direction, Object, Readable, Value, Writable};
use lexican_runtime::{Duration, NodeId, cia301};
use lexican_toolbox::drive::{Ending, Order, Scales, Times, carry_out, describe, prepare};
use lexican_toolbox::lss::Trouble;
use lexican_toolbox::pdo::PdoState;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::{ObjectError, resolve, resolve_all};
use lexican_toolbox::values::report::ValueReport;
use lexican_toolbox::values::wire::{encode, parse_padded, written};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;

use super::event::Pdos;
use super::{BoxedLink, Event, MachineError, What};
use crate::model;
use crate::wire::active;

/// The default time within which mandatory nodes must boot.
const BOOT_TIME: Duration = Duration::from_secs(10);

/// A machine on its buses. Clones refer to the same machine; it ends when all clones, and all nodes and drives from it,
/// are dropped.
#[derive(Clone)]
pub struct Machine {
    file: Arc<model::Machine>,
    /// One for each bus.
    networks: Arc<[Network]>,
    /// Set by the boot: from then on the manager watches the nodes, and drives watch the manager.
    is_booted: Arc<AtomicBool>,
}

impl Machine {
    /// Opens the machine of a file on the buses that it names, or on one of them with `machine.toml#left`. Nothing is
    /// sent, except that nodes get their node-IDs by LSS if the file says so; that blocks.
    ///
    /// # Panics
    ///
    /// Outside a tokio runtime.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, MachineError> {
        let file = model::Machine::of_path(path.as_ref())?;
        Machine::on(file.links()?, file, Network::spawn)
    }

    /// Opens a machine on other buses, such as simulated ones: one link for each bus in the order of the file.
    ///
    /// # Panics
    ///
    /// Outside a tokio runtime.
    pub fn over(links: Vec<BoxedLink>, file: model::Machine) -> Result<Self, MachineError> {
        Machine::on(links, file, Network::spawn)
    }

    pub(super) fn on(
        mut links: Vec<BoxedLink>,
        file: model::Machine,
        mut spawn: impl FnMut(BoxedLink) -> std::io::Result<Network>,
    ) -> Result<Self, MachineError> {
        let file = file.sound()?;
        let (buses, links_given) = (file.buses().count(), links.len());
        if buses != links_given {
            return Err(MachineError::Links { file: file.file().to_owned(), buses, links: links_given });
        }
        file.buses()
            .zip(&mut links)
            .try_for_each(|(bus, link)| bus.give_node_ids(link, |_, _| Ok::<_, Trouble>(())))?;
        let networks = links.into_iter().map(&mut spawn).collect::<Result<_, _>>()?;
        Ok(Machine { file: Arc::new(file), networks, is_booted: Arc::default() })
    }

    /// A machine with one bus, whose network exists already: for nodes that a program adds at run time.
    pub fn beside(network: Network, file: model::Machine) -> Result<Self, MachineError> {
        let file = file.sound()?;
        match file.buses().count() {
            1 => Ok(Machine { file: Arc::new(file), networks: Arc::new([network]), is_booted: Arc::default() }),
            buses => Err(MachineError::Links { file: file.file().to_owned(), buses, links: 1 }),
        }
    }

    /// The machine as read from its file.
    #[must_use]
    pub fn file(&self) -> &model::Machine {
        &self.file
    }

    /// The network of the first bus, for everything else.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.networks[0]
    }

    fn buses(&self) -> impl Iterator<Item = (&model::Machine, &Network)> {
        self.file.buses().zip(&*self.networks)
    }

    /// Boots the machine as planned (CiA 302-2): checks, configures, watches and starts its nodes. From then on, nodes
    /// that are lost or return are booted again. This is reported by [`events`](Machine::events).
    pub async fn boot(&self) -> Result<(), MachineError> {
        self.is_booted.store(true, Ordering::Relaxed);
        let boot = async |at: usize, file: &model::Machine, network: &Network| {
            let all = Arc::clone(&self.file);
            let produce = move |manager: &mut _, now| all.buses().nth(at).expect("it is one").produce(manager, now);
            network.with_manager(produce).await?;
            Ok(network.boot(file.boot_plan(), file.bus.boot_time.unwrap_or(BOOT_TIME), |_| {}).await?)
        };
        try_join_all(self.buses().enumerate().map(|(at, (file, network))| boot(at, file, network))).await.map(drop)
    }

    /// The events of all nodes from now on. For each bus, up to 1024 events wait to be taken.
    #[must_use]
    pub fn events(&self) -> Events {
        let buses = self.buses().map(|(file, network)| (network.events(), file.pdos()));
        Events { buses: buses.collect(), file: Arc::clone(&self.file) }
    }

    /// The node of this name.
    pub fn node(&self, name: &str) -> Result<Node, MachineError> {
        let (bus, at) = self.file.place(name)?;
        let node = Node { machine: self.clone(), bus, at, id: NodeId::literal(1) };
        let id = node.stated().id.ok_or_else(|| node.stated().lacks("node-ID: it gets one by LSS"))?;
        Ok(Node { id, ..node })
    }

    /// The drive with this name. If the drive can notice the loss of this program, its protection is armed, unless the
    /// machine has booted and its file already makes the drive watch the manager, by heartbeat or guarding.
    pub async fn drive(&self, name: &str) -> Result<Drive, MachineError> {
        use lexican_driver::tokio::Drive as Driver;
        let node = self.node(name)?;
        let description = node.description()?;
        let it = node.stated();
        let watches = node.on_bus().watches_manager(it).is_some();
        let (network, id) = (node.network().clone(), node.id);
        let drive = match self.is_booted.load(Ordering::Relaxed) && (it.guarding.is_some() || watches) {
            true => Driver::connect_described_unprotected(network, id, description).await?,
            false => Driver::connect_described(network, id, description).await?,
        };
        Ok(Drive { drive, node })
    }
}

impl fmt::Debug for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Machine").field("nodes", &self.file.names()).finish_non_exhaustive()
    }
}

/// The node-IDs that respond to reading 1000h within a time. Changes nothing.
pub async fn scan(network: &Network, within: Duration) -> Vec<NodeId> {
    let network = network.clone().with_patience(within);
    let answers =
        async |id: NodeId| network.read_bytes(id, Address::new(cia301::DEVICE_TYPE, 0)).await.is_ok().then_some(id);
    join_all(NodeId::all().map(answers)).await.into_iter().flatten().collect()
}

/// The events of a machine's nodes, from [`Machine::events`].
pub struct Events {
    buses: Vec<(Receiver<NetworkEvent>, Pdos)>,
    file: Arc<model::Machine>,
}

impl Events {
    /// Waits for the next event; `None` if a bus is gone.
    pub async fn next(&mut self) -> Option<Event> {
        loop {
            let all = self.buses.iter_mut().map(|(receiver, _)| Box::pin(receiver.recv()));
            let (received, bus, _) = select_all(all).await;
            let event = match received {
                Ok(event) => self.named(bus, event),
                Err(RecvError::Lagged(events)) => Some(Event { node: None, what: What::Missed(events) }),
                Err(RecvError::Closed) => return None,
            };
            if event.is_some() {
                return event;
            }
        }
    }

    fn named(&self, bus: usize, event: NetworkEvent) -> Option<Event> {
        self.file.buses().nth(bus)?.named(&self.buses[bus].1, event)
    }
}

/// A node of a machine, from [`Machine::node`].
#[derive(Clone, Debug)]
pub struct Node {
    machine: Machine,
    bus: usize,
    at: usize,
    id: NodeId,
}

impl Node {
    /// Its node-ID.
    #[must_use]
    pub fn id(&self) -> NodeId {
        self.id
    }

    /// The node as read from the file.
    #[must_use]
    pub fn stated(&self) -> &model::Node {
        &self.on_bus().nodes[self.at]
    }

    /// The part of the file about its bus.
    fn on_bus(&self) -> &model::Machine {
        self.machine.file.buses().nth(self.bus).expect("it is one of its buses")
    }

    /// The network of its bus, for everything else.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.machine.networks[self.bus]
    }

    /// Reads an object by its handle.
    pub async fn read<T: Value, A: Readable, M, D>(&self, object: Object<T, A, M, D>) -> Result<T, MachineError> {
        self.network().read(self.id, object).await.map_err(|error| self.stated().access(error))
    }

    /// Writes an object by its handle.
    pub async fn write<T: Value, A: Writable, M, D>(
        &self,
        object: Object<T, A, M, D>,
        value: T,
    ) -> Result<(), MachineError> {
        self.network().write(self.id, object, value).await.map_err(|error| self.stated().access(error))
    }

    /// Reads an object by name: "position actual value", `6064`, "Motor Parameter Set/v-Pos".
    pub async fn get(&self, object: &str) -> Result<ValueReport, MachineError> {
        let (values, address) = self.found(object).await?;
        Ok(ValueReport::of_bytes(Some(&values), address, &self.bytes(address).await?))
    }

    /// Reads all readable entries of an object, in order.
    pub async fn get_all(&self, object: &str) -> Result<Vec<ValueReport>, MachineError> {
        let device = self.device()?;
        let mut reports = Vec::new();
        for address in resolve_all(Some(device), object).map_err(|error| self.unknown(error))? {
            if device.entry(address.index(), address.sub()).is_none_or(|entry| entry.access.readable()) {
                reports.push(self.get(&address.to_string()).await?);
            }
        }
        Ok(reports)
    }

    /// Writes bytes to an object by name, without interpreting them.
    pub async fn set_bytes(&self, object: &str, data: &[u8]) -> Result<(), MachineError> {
        let address = resolve(self.stated().device(), object).map_err(|error| self.unknown(error))?;
        self.network().write_bytes(self.id, address, data).await.map_err(|error| self.stated().access(error))
    }

    /// Writes a value with its unit to an object by name: "2.5 mm", "profile velocity".
    pub async fn set(&self, object: &str, value: &str) -> Result<(), MachineError> {
        let (values, address) = self.found(object).await?;
        let it = self.stated();
        let entry = values.entry(address).ok_or_else(|| it.wrong(format_args!("the data sheet has no {address}")))?;
        let value = values.parse(entry, value).map_err(|error| it.wrong(format_args!("{address}: {error}")))?;
        values.check_write(entry, &value, self.id).map_err(|error| it.wrong(format_args!("{address}: {error}")))?;
        let data = encode(entry.data_type, &value)
            .ok_or_else(|| it.wrong(format_args!("{address}: the value is no {}", entry.data_type)))?;
        let data = written(it.device(), data);
        self.network().write_bytes(self.id, address, &data).await.map_err(|error| it.access(error))
    }

    /// The PDOs that it sends, by the file or else by its data sheet.
    #[must_use]
    pub fn sent_pdos(&self) -> Vec<PdoState> {
        active(self.stated(), Direction::Transmit).into_iter().map(|sent| sent.state).collect()
    }

    /// Reads the values on which units and limits of objects depend.
    pub async fn conditions(
        &self,
        objects: impl IntoIterator<Item = Address>,
    ) -> Result<Vec<(Address, i128)>, MachineError> {
        let mut values = DeviceValues::new(self.device()?);
        self.read_conditions(objects, &mut values).await?;
        Ok(values.all_seen().collect())
    }

    /// An object by name, with the values on which its unit and limits depend.
    async fn found(&self, object: &str) -> Result<(DeviceValues<'_>, Address), MachineError> {
        let device = self.device()?;
        let address = resolve(Some(device), object).map_err(|error| self.unknown(error))?;
        let mut values = DeviceValues::new(device);
        self.read_conditions([address], &mut values).await?;
        Ok((values, address))
    }

    fn unknown(&self, error: ObjectError) -> MachineError {
        MachineError::Object { node: self.stated().name.value.clone(), error }
    }

    async fn read_conditions(
        &self,
        objects: impl IntoIterator<Item = Address>,
        values: &mut DeviceValues<'_>,
    ) -> Result<(), MachineError> {
        for address in objects {
            for when in values.entry(address).map(|entry| values.conditions(entry)).unwrap_or_default() {
                let Some(entry) = values.entry(when).filter(|_| values.seen(when).is_none()) else { continue };
                let bytes = self.bytes(when).await?;
                parse_padded(entry.data_type, &bytes).iter().for_each(|value| values.set(when, value));
            }
        }
        Ok(())
    }

    async fn bytes(&self, address: Address) -> Result<Vec<u8>, MachineError> {
        self.network().read_bytes(self.id, address).await.map_err(|error| self.stated().access(error))
    }

    pub(super) fn device(&self) -> Result<&Device, MachineError> {
        self.stated().device().ok_or_else(|| self.stated().lacks("data sheet"))
    }

    fn description(&self) -> Result<&'static Description, MachineError> {
        let it = self.stated();
        let sheet = it.sheet.as_ref().ok_or_else(|| it.lacks("data sheet"))?;
        describe(&sheet.input).map_err(|error| MachineError::NotADrive { node: it.name.value.clone(), error })
    }

    /// The units of a drive's positions and velocities, which depend on its settings.
    async fn scales(&self) -> Result<Scales<'_>, MachineError> {
        let mut scales = Scales::new(self.device()?, self.description()?);
        let objects: Vec<_> = scales.objects().collect();
        self.read_conditions(objects, scales.values()).await?;
        Ok(scales)
    }
}

/// A drive of a machine. It dereferences to [the driver's](lexican_driver::tokio::Drive), whose methods take positions
/// in counts of the drive; the methods here take them with units.
///
/// Dropping a drive that may be moving sends it a stop, and reports that on standard error.
pub struct Drive {
    drive: lexican_driver::tokio::Drive<Any>,
    node: Node,
}

impl Drive {
    /// The node that it is.
    #[must_use]
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Converts a position to counts of the drive: "120 mm".
    pub async fn counts(&self, position: &str) -> Result<i32, MachineError> {
        let scales = self.node.scales().await?;
        scales.parse_position(position).map_err(|error| self.node.stated().wrong(error))
    }

    /// Moves to a position and waits for the end: "120 mm".
    pub async fn move_to(&mut self, position: &str) -> Result<Ending, MachineError> {
        let target = self.counts(position).await?;
        self.carry_out(Order::MoveTo(target), None).await
    }

    /// Starts to move to a position; [`finish`](lexican_driver::tokio::Drive::finish) waits for the end.
    pub async fn start_moving_to(&mut self, position: &str) -> Result<(), MachineError> {
        let target = self.counts(position).await?;
        self.drive.run(async |context: DriveContext| prepare(&context, Order::MoveTo(target)).await).await?;
        Ok(self.drive.start_moving_to(target).await?)
    }

    /// Runs at a velocity for a time, then stops: "60 rpm".
    pub async fn run_at(&mut self, velocity: &str, lasting: Duration) -> Result<Ending, MachineError> {
        let velocity = self.node.scales().await?.parse_velocity(velocity);
        let velocity = velocity.map_err(|error| self.node.stated().wrong(error))?;
        self.carry_out(Order::Run(velocity), Some(lasting)).await
    }

    /// Carries out an order: sets its mode, checks it before anything moves, and stops a drive that stalls or is late.
    pub async fn carry_out(&mut self, order: Order, lasting: Option<Duration>) -> Result<Ending, MachineError> {
        let carry_out = async |context: DriveContext| {
            let times = Times { within: context.patience(), lasting };
            carry_out(&context, order, times, &mut |_| {}, &mut |_| None).await
        };
        Ok(self.drive.run(carry_out).await?)
    }
}

impl Deref for Drive {
    type Target = lexican_driver::tokio::Drive<Any>;

    fn deref(&self) -> &Self::Target {
        &self.drive
    }
}

impl DerefMut for Drive {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.drive
    }
}

impl fmt::Debug for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.drive.fmt(f)
    }
}

/// Moves several drives at once, and waits until all have reached their positions. If one does not, all others are
/// stopped.
pub async fn move_together(orders: &mut [(&mut Drive, &str)]) -> Result<(), MachineError> {
    let travel = async |drive: &mut Drive, position: &str| match drive.move_to(position).await? {
        ending if ending.is_success() => Ok(()),
        ending => Err(MachineError::Together { node: drive.node.stated().name.value.clone(), ending }),
    };
    let ended = try_join_all(orders.iter_mut().map(|(drive, position)| travel(drive, position))).await;
    if ended.is_err() {
        stop_all(orders.iter_mut().map(|(drive, _)| &mut **drive)).await?;
    }
    ended.map(drop)
}

/// Stops all drives at once.
pub(super) async fn stop_all(drives: impl Iterator<Item = &mut Drive>) -> Result<(), MachineError> {
    try_join_all(drives.map(async |drive| Ok(drive.drive.stop().await?))).await.map(drop)
}
