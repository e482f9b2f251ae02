//! Replaces a failed device: finds the new one, gives it the node-ID, checks and restores it, tests its protection,
//! compares.
//!
//! The progress shows in the device and is stored nowhere else, so if [`replace`] was interrupted, call it again.

use std::fmt;
use std::ops::ControlFlow;

use lexican_eds::Source;
use lexican_eds::model::Device;
use lexican_eds::standard::{Role, role};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{self, BootNetworkError, Link, LinkError, Pump};
use lexican_runtime::manager::{Assignment, Event, NetworkEvent, OnLoss};
use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{Duration, NodeId, cia301};

use crate::bus::sdo_channel::{request_frame, responder};
use crate::lss::{Session, Times, Trouble};
use crate::node::identity::words;
use crate::node::remote::{Refusal, RemoteNode};
use crate::parameters::archive::{ArchivedNode, read_versions};
use crate::parameters::backup::{Identity, read_identity};
use crate::parameters::compare::Comparison;
use crate::parameters::restore::{Options, OtherDevice, Outcome, check_identity, restore};
use crate::parameters::{Ended, Progress};
use crate::values::wire::written;

/// How long a device may take to boot.
const BOOTING: Duration = Duration::from_millis(10_000);
/// How long a device may take to answer.
const ANSWERING: Duration = Duration::from_millis(300);
/// How long a device receives the heartbeat of its manager before that stops.
const HEARING: Duration = Duration::from_millis(1_000);
/// The error code for a missing heartbeat or guarding (CiA 301, table 26).
const MISSED: u16 = 0x8130;
/// The interval of reading a drive's state.
const LOOK: Duration = Duration::from_millis(20);
const CONTROL_WORD: Address = Address::new(0x6040, 0);
const STATUS_WORD: Address = Address::new(0x6041, 0);
const READY: Option<State> = Some(State::ReadyToSwitchOn);
/// 1010h:01.
const STORE: Address = Address::new(cia301::STORE_PARAMETERS, 1);

/// The new device, and what it has to become.
#[derive(Debug)]
pub struct Replacement<'a> {
    /// The backup of the device that it replaces.
    pub archived: &'a ArchivedNode,
    /// The data sheet, by which it is read and written.
    pub sheet: &'a Device,
    /// Overlays with units and meanings of its values.
    pub overlays: &'a [Source],
    /// The identity (1018h) that the machine requires of it.
    pub identity: Identity,
    /// The node-IDs of the machine's other nodes and of its manager.
    pub others: Vec<NodeId>,
    /// How the machine boots it.
    pub assignment: Assignment<Vec<u8>>,
    /// How it notices that its manager is gone; `None` if it does not watch the manager.
    pub watched: Option<Watched>,
    /// The times for LSS.
    pub times: Times,
    /// Whether a device of another vendor or product is accepted.
    pub force: bool,
}

/// How a device notices that its manager is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watched {
    /// The manager's node-ID and heartbeat period; `None` if the device is guarded instead.
    pub heartbeat: Option<(NodeId, Duration)>,
    /// The time within which it has to notice.
    pub within: Duration,
}

/// A step that has been done.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Step {
    Present { identity: Identity, is_the_same: bool },
    Named { before: Option<NodeId> },
    Checked { remarks: Vec<String> },
    Restored { written: usize, equal: usize, stored: bool },
    Booted,
    Forgetful,
    Equal { compared: usize },
    Protected { after: Duration },
    Untested(&'static str),
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Step::Present { identity, is_the_same } => {
                write!(f, "a device is there: {}", words(*identity).collect::<Vec<_>>().join(", "))?;
                f.write_str(if *is_the_same { "; by its serial number, the one of the backup" } else { "" })
            }
            Step::Named { before: None } => f.write_str("a device without node-ID has got it, and has stored it"),
            Step::Named { before: Some(before) } => {
                write!(f, "a device with node-ID {before} has got the one of its place, and has stored it")
            }
            Step::Checked { remarks } if remarks.is_empty() => f.write_str("vendor, product and versions as before"),
            Step::Checked { remarks } => write!(f, "vendor and product as before; {}", remarks.join("; ")),
            Step::Restored { written, equal, stored } => {
                let stored = if *stored { "; the device has stored them" } else { "" };
                write!(f, "{written} parameters written, {equal} had their value{stored}")
            }
            Step::Booted => f.write_str("reset, and booted again"),
            Step::Forgetful => f.write_str("it does not keep all of them without power; they were written again"),
            Step::Equal { compared } => write!(f, "{compared} parameters read back after that, all as in the backup"),
            Step::Protected { after } => {
                write!(f, "booted as in the machine; when the manager fell silent, it noticed after {after}")
            }
            Step::Untested(why) => write!(f, "protection not tested: {why}"),
        }
    }
}

/// Why a replacement failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the words of an error say what it is")]
pub enum ReplaceError {
    #[error("there is no device: none at its node-ID, none without node-ID, and none of its kind at another one")]
    Nobody,
    #[error("{0} devices of this vendor and product could be it")]
    Several(usize),
    #[error("the device with node-ID {0} has no LSS")]
    NoLss(NodeId),
    #[error("the device refuses its node-ID by LSS")]
    RefusesId,
    #[error(transparent)]
    Other(#[from] OtherDevice),
    #[error("{} parameters are refused, and nothing is stored: {}", .0.len(), refusals(.0))]
    Refused(Vec<(Address, Refusal)>),
    #[error("it does not boot after a reset")]
    NotBack,
    #[error("{} parameters are not as in the backup", .0.differences.len() + .0.unknown.len() + .1.len())]
    Differs(Box<Comparison>, Vec<Address>),
    #[error("it does not boot as in the machine: {0}")]
    NotBooted(String),
    #[error("it did not notice within {0} that its manager was gone")]
    Unprotected(Duration),
    #[error(transparent)]
    Lss(#[from] Trouble),
    #[error(transparent)]
    Ended(#[from] Ended),
}

fn refusals(refused: &[(Address, Refusal)]) -> String {
    refused.iter().map(|(address, refusal)| format!("{address}: {refusal}")).collect::<Vec<_>>().join("; ")
}

impl From<LinkError> for ReplaceError {
    fn from(error: LinkError) -> Self {
        ReplaceError::Ended(error.into())
    }
}

impl ReplaceError {
    /// What to do about it before calling [`replace`] again, which then continues.
    #[must_use]
    pub const fn remedy(&self) -> &'static str {
        match self {
            ReplaceError::Nobody => "is it on the bus, with power and at this bit rate? `lexican scan` shows all nodes",
            ReplaceError::Several(_) => "leave only one of them on the bus",
            ReplaceError::NoLss(_) | ReplaceError::RefusesId => {
                "give it its node-ID by its own means: switches, a parameter, the tool of its maker"
            }
            ReplaceError::Other(_) => "take a device of the same kind; --force takes this one",
            ReplaceError::Refused(_) => "correct the data sheet or the backup: a newer device may have other limits",
            ReplaceError::NotBack => "has it its power? Switch it off and on",
            ReplaceError::Differs(..) => "it may be that another manager writes them: switch that off",
            ReplaceError::NotBooted(_) => "`lexican machine plan --live` shows what the machine wants of it",
            ReplaceError::Unprotected(_) => "do not let it move: see 1016h, 100Ch, 1029h and 6007h in its manual",
            ReplaceError::Lss(_) | ReplaceError::Ended(_) => "the same command goes on from here",
        }
    }
}

/// What a replacement reports.
#[derive(Debug)]
pub enum Replacing<'a> {
    /// A step has been done.
    Done(&'a Step),
    /// Parameters are being read or written.
    At(Progress<'a>),
}

/// Gets reports; [`ControlFlow::Break`] ends the replacement.
pub type OnReplacing<'a> = &'a mut dyn FnMut(Replacing<'_>) -> ControlFlow<()>;

/// Makes the new device take the place of the failed one. After an error, it can be called again and continues.
pub fn replace<L: Link>(link: &mut L, of: &Replacement<'_>, see: OnReplacing<'_>) -> Result<(), ReplaceError> {
    find(link, of, see)?;
    configure(link, of, see)?;
    if !boots(link, of)? {
        return Err(ReplaceError::NotBack);
    }
    done(see, &Step::Booted)?;
    protect(link, of, see)?;
    prove(link, of, see)
}

fn done(see: OnReplacing<'_>, step: &Step) -> Result<(), ReplaceError> {
    if see(Replacing::Done(step)).is_break() { Err(Ended::Stopped.into()) } else { Ok(()) }
}

impl Replacement<'_> {
    fn node(&self) -> NodeId {
        self.archived.node
    }

    /// Whether a device has the vendor-ID and product code of the one that it replaces.
    fn is_kind(&self, vendor: Option<u32>, product: Option<u32>) -> bool {
        (vendor, product) == (self.archived.identity[0], self.archived.identity[1])
    }
}

/// Finds the device and gives it its node-ID.
fn find<L: Link>(link: &mut L, of: &Replacement<'_>, see: OnReplacing<'_>) -> Result<(), ReplaceError> {
    if is_present(link, of, see)? {
        return Ok(());
    }
    let unconfigured =
        Session::run(&mut *link, of.times, |session| session.find_all(|_| Ok::<_, Trouble>(true), |_| ()));
    let mut unconfigured = unconfigured?;
    unconfigured.retain(|it| of.force || of.is_kind(Some(it.vendor), Some(it.product)));
    let (identity, before) = match unconfigured.as_slice() {
        [identity] => (*identity, None),
        // A device that was given its node-ID in an earlier run may start to use it only after the session.
        [] if is_present(link, of, see)? => return Ok(()),
        [] => stranger(link, of)?,
        several => return Err(ReplaceError::Several(several.len())),
    };
    let booted =
        Session::run(&mut *link, of.times, |session| match (session.name(identity, of.node(), true), before) {
            (Err(Trouble::Refused(_)), _) => Err(ReplaceError::RefusesId),
            (Ok(None), Some(before)) => Err(ReplaceError::NoLss(before)),
            (named, _) => Ok(named?.is_some() && session.take(before, Some(of.node()), true)?),
        })?;
    if booted { done(see, &Step::Named { before }) } else { Err(ReplaceError::NotBack) }
}

fn by_lss(identity: Identity) -> lss::Identity {
    let [vendor, product, revision, serial] = identity.map(Option::unwrap_or_default);
    lss::Identity { vendor, product, revision, serial }
}

/// Whether a device answers at the node-ID; if so, has it store the node-ID.
fn is_present<L: Link>(link: &mut L, of: &Replacement<'_>, see: OnReplacing<'_>) -> Result<bool, ReplaceError> {
    if answering(link, &[of.node()])?.is_empty() {
        return Ok(false);
    }
    let identity = read_identity(&mut RemoteNode::new(&mut network(link)?, of.node()))?;
    let is_the_same = identity[3].is_some_and(|serial| serial != 0) && identity == of.archived.identity;
    done(see, &Step::Present { identity, is_the_same })?;
    // An earlier run may have given it the node-ID without storing it.
    match Session::run(&mut *link, of.times, |session| session.name(by_lss(identity), of.node(), true)) {
        Ok(_) | Err(Trouble::Refused(_)) => Ok(true),
        Err(trouble) => Err(trouble.into()),
    }
}

/// The only device of this product that does not belong to the machine: its identity for LSS, and its node-ID.
fn stranger<L: Link>(link: &mut L, of: &Replacement<'_>) -> Result<(lss::Identity, Option<NodeId>), ReplaceError> {
    let nodes = (1..=127).filter_map(NodeId::new).filter(|node| *node != of.node() && !of.others.contains(node));
    let mut found = Vec::new();
    for node in answering(link, &nodes.collect::<Vec<_>>())? {
        let identity = read_identity(&mut RemoteNode::new(&mut network(link)?, node))?;
        if of.is_kind(identity[0], identity[1]) {
            found.push((identity, node));
        }
    }
    match found.as_slice() {
        [] => Err(ReplaceError::Nobody),
        [(identity, node)] => Ok((by_lss(*identity), Some(*node))),
        several => Err(ReplaceError::Several(several.len())),
    }
}

/// A network on a link without a filter, which an LSS session may have set.
fn network<L: Link>(link: &mut L) -> Result<Network<&mut L>, LinkError> {
    link.listen_to(&[])?;
    Ok(Network::new(link))
}

/// Those of the node-IDs that respond to SDO.
fn answering<L: Link>(link: &mut L, nodes: &[NodeId]) -> Result<Vec<NodeId>, LinkError> {
    let device_type = ClientRequest::InitiateUpload { address: Address::new(cia301::DEVICE_TYPE, 0) };
    link.listen_to(&[])?;
    let (mut pump, mut answering) = (Pump::new(), Vec::new());
    for node in nodes {
        link.send(&request_frame(*node, device_type))?;
    }
    let until = link.now() + ANSWERING + link.latency();
    while let Some(frame) = pump.receive_frame(link, until)? {
        if let Some(node) = responder(&frame).filter(|node| nodes.contains(node) && !answering.contains(node)) {
            answering.push(node);
            if answering.len() == nodes.len() {
                break;
            }
        }
    }
    Ok(answering)
}

/// Checks the identity of the device, and writes parameters that differ.
fn configure<L: Link>(link: &mut L, of: &Replacement<'_>, see: OnReplacing<'_>) -> Result<(), ReplaceError> {
    let mut network = network(link)?;
    let mut node = RemoteNode::new(&mut network, of.node());
    match check_identity(&mut node, &of.archived.device(&[]))? {
        Err(other) if !of.force => return Err(other.into()),
        _ => {}
    }
    let identity = read_identity(&mut node)?;
    let mut remarks = of.archived.other_versions(&identity, &read_versions(&mut node, of.sheet)?);
    let names = ["vendor", "product", "revision", "serial number"];
    for ((name, wanted), is) in names.into_iter().zip(of.identity).zip(identity) {
        if let Some(wanted) = wanted.filter(|wanted| Some(*wanted) != is) {
            let is = is.map_or_else(|| "none".to_owned(), |is| format!("{is:X}h"));
            remarks.push(format!("its {name} is {is}, and the machine wants {wanted:X}h: change its file"));
        }
    }
    done(see, &Step::Checked { remarks })?;
    let outcome = write(&mut node, of, see)?;
    let (written, equal, stored) = (outcome.written.len(), outcome.equal, outcome.stored);
    done(see, &Step::Restored { written, equal, stored })
}

/// Writes parameters that differ, and has the device store them if it can.
fn write<L: Link>(
    node: &mut RemoteNode<'_, L>,
    of: &Replacement<'_>,
    see: OnReplacing<'_>,
) -> Result<Outcome, ReplaceError> {
    let options = Options { store: has_store(of), ..Options::default() };
    let mut outcome = Outcome::default();
    let at = &mut |progress: Progress<'_>| see(Replacing::At(progress));
    restore(node, of.sheet, &of.archived.settings(), options, at, &mut outcome)?;
    if outcome.refused.is_empty() { Ok(outcome) } else { Err(ReplaceError::Refused(outcome.refused)) }
}

fn has_store(of: &Replacement<'_>) -> bool {
    of.sheet.entry(STORE.index(), STORE.sub()).is_some()
}

/// Resets the device and returns whether it boots; then it has only what it has stored.
fn boots<L: Link>(link: &mut L, of: &Replacement<'_>) -> Result<bool, ReplaceError> {
    let mut network = network(link)?;
    network.command(NmtCommand::ResetNode, Some(of.node()))?;
    let is_boot_up = |event: &Event| matches!(event, Event::BootedUp { node } if *node == of.node()).then_some(());
    Ok(network.wait_for(BOOTING, is_boot_up)?.is_some())
}

/// Reads everything that can be read, and compares it with the backup.
fn prove<L: Link>(link: &mut L, of: &Replacement<'_>, see: OnReplacing<'_>) -> Result<(), ReplaceError> {
    let mut network = network(link)?;
    let mut node = RemoteNode::new(&mut network, of.node());
    let mut is_forgetful = false;
    loop {
        let at = &mut |progress: Progress<'_>| see(Replacing::At(progress));
        let now = ArchivedNode::take(&mut node, &of.archived.name, of.sheet, at)?;
        let (comparison, domains) = of.archived.compare(&now, of.overlays);
        if comparison.differences.is_empty() && comparison.unknown.is_empty() && domains.is_empty() {
            let compared = comparison.compared + of.archived.domains.len();
            return done(see, &Step::Equal { compared });
        }
        if is_forgetful || has_store(of) {
            return Err(ReplaceError::Differs(Box::new(comparison), domains));
        }
        is_forgetful = true;
        write(&mut node, of, see)?;
        done(see, &Step::Forgetful)?;
    }
}

/// Boots the device as the machine does, stops the heartbeat or guarding, and waits for the device to notice.
fn protect<L: Link>(link: &mut L, of: &Replacement<'_>, see: OnReplacing<'_>) -> Result<(), ReplaceError> {
    let Some(watched) = of.watched else {
        return done(see, &Step::Untested("by the machine, it does not watch its manager"));
    };
    let node = of.node();
    let mut network = network(link)?;
    if let Some((manager, period)) = watched.heartbeat {
        let now = network.now();
        network.manager().produce_heartbeat(now, manager, period);
    }
    let mut plan = host::Plan::new(OnLoss::ResetNode);
    let mut assignment = of.assignment.clone();
    // Leave the other nodes running.
    (assignment.mandatory, assignment.plan.keep_alive) = (true, true);
    plan.assign(node, assignment).expect("there is room for one node");
    network.boot(plan, BOOTING, |_| {}).map_err(|error| match error {
        BootNetworkError::Link(error) => error.into(),
        BootNetworkError::NotReady(error) => ReplaceError::NotBooted(error.to_string()),
    })?;
    // A drive without power cannot move by being enabled, and the state is the only sign of some drives that they have
    // noticed.
    let is_drive = role(of.sheet, CONTROL_WORD.index(), CONTROL_WORD.sub()) == Some(Role::Command);
    let shutdown = written(Some(of.sheet), vec![0x06, 0x00]);
    let is_ready =
        is_drive && RemoteNode::new(&mut network, node).write(CONTROL_WORD, &shutdown).map_err(Ended::from)?.is_ok();
    let is_lost = |event: &Event| matches!(event, Event::Network(NetworkEvent::Lost { .. })).then_some(());
    if network.wait_for(HEARING, is_lost)?.is_some() {
        return Err(ReplaceError::NotBooted("it is lost at once".to_owned()));
    }
    drop(network);
    let is_ready = is_ready && state(link, node)? == READY;
    let noticed = match notices(link, node, watched, is_ready)? {
        Err(_) if is_drive && !is_ready => {
            Ok(Step::Untested("the drive shows nothing of it as long as it is not enabled"))
        }
        noticed => noticed,
    };
    if !boots(link, of)? {
        return Err(ReplaceError::NotBack);
    }
    done(see, &noticed?)
}

/// The state of a drive; `None` if its status word encodes none.
fn state<L: Link>(link: &mut L, node: NodeId) -> Result<Option<State>, Ended> {
    let read = RemoteNode::new(&mut network(link)?, node).read(STATUS_WORD)?.ok();
    let word = read.and_then(|data| Some(u16::from_le_bytes([*data.first()?, *data.get(1)?])));
    Ok(word.and_then(State::from_status_word))
}

/// Whether a device notices that its manager is gone. A drive that `is_ready` to switch on leaves that state.
fn notices<L: Link>(
    link: &mut L,
    node: NodeId,
    watched: Watched,
    is_ready: bool,
) -> Result<Result<Step, ReplaceError>, Ended> {
    let (mut pump, begun) = (Pump::new(), link.now());
    let until = begun + watched.within.times(2) + HEARING;
    let own = ErrorControl::cob_id(node);
    while link.now() < until {
        link.listen_to(&[])?;
        let look = until.min(link.now() + LOOK);
        while let Some(frame) = pump.receive_frame(link, look)? {
            let is_manager = watched.heartbeat.is_some_and(|(it, _)| frame.id() == ErrorControl::cob_id(it));
            if is_manager || frame.id() == own && frame.is_remote() {
                return Ok(Ok(Step::Untested("another manager watches it: switch that off for the test")));
            }
            let is_emergency = frame.id() == Emergency::cob_id(node)
                && [CodeOrder::LowByteFirst, CodeOrder::HighByteFirst]
                    .into_iter()
                    .filter_map(|order| Emergency::parse(frame.data(), order))
                    .any(|emergency| emergency.code.0 == MISSED);
            let state = ErrorControl::parse(frame.data()).filter(|_| frame.id() == own).map(|it| it.state);
            if is_emergency || state.is_some_and(|state| state != NmtState::Operational) {
                return Ok(Ok(Step::Protected { after: link.now().since(begun) }));
            }
        }
        if is_ready && state(link, node)? != READY {
            return Ok(Ok(Step::Protected { after: link.now().since(begun) }));
        }
    }
    Ok(Err(ReplaceError::Unprotected(until.since(begun))))
}
