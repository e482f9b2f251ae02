//! Wires: plans PDOs that carry values from node to node, and to and from the manager.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use lexican_runtime::object::{Address, Direction, Mapped};
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{CobId, Duration, NodeId};
use lexican_toolbox::pdo::{Change, Objection, PdoName, PdoState, Plan};

use crate::file::Wire;
use crate::model::{Bus, Node, PlannedPdo};
use crate::nodes::{MANAGER, in_100us, in_ms, object_to, place};
use crate::read::{Named, Out, span};

/// COB-IDs that no service uses, for PDOs beyond the predefined ones (CiA 301, 7.3.5).
const FREE: Range<u16> = 0x680..0x6E0;
/// The most bits of a PDO.
const MOST_BITS: u32 = 64;

/// An end of a wire.
pub(crate) enum End<'w> {
    Manager,
    /// An object of a node.
    Node(usize, &'w str),
}

/// A value that needs a PDO.
struct Request {
    /// The node with the PDO: the sender, or the receiver if the manager sends.
    node: usize,
    direction: Direction,
    mapped: Mapped,
    /// The timing of the PDO; `None` in it means as in the data sheet.
    timing: Change,
    at: Range<usize>,
    /// The objects of other nodes that receive the value.
    takers: Vec<(usize, Mapped, Range<usize>)>,
}

/// Plans the PDOs for all wires.
pub(crate) fn connect(nodes: &mut [Node], wires: &[Named<Wire>], bus: &Bus, out: &mut Out) {
    let mut requests: Vec<Request> = Vec::new();
    for Named { name: from, table: Wire(wire), .. } in wires {
        let timing = Change {
            transmission: wire.transmission.as_ref().map(|it| it.value.0),
            event_timer_ms: wire.every.as_ref().and_then(|it| in_ms(it.value.0, &it.span, out)),
            inhibit_100us: wire.inhibit.as_ref().and_then(|it| in_100us(it.value.0, &it.span, out)),
            ..Change::default()
        };
        if timing.transmission.is_some_and(TransmissionType::is_synchronous) && bus.sync.is_none() {
            let help = Some("give its period: [bus] sync = \"10 ms\"".to_owned());
            out.wrong("machine::sync", &from.span, "this goes with SYNC, which nobody sends", help);
        }
        if wire.to.is_empty() {
            out.wrong("machine::wire", &from.span, "this goes nowhere", Some("to = \"manager\"".to_owned()));
        }
        let sent = match end(nodes, &from.value, &from.span, out) {
            None => continue,
            Some(End::Manager) => None,
            Some(End::Node(node, object)) => {
                Some((node, mapped(nodes, node, Direction::Transmit, object, &from.span, out)))
            }
        };
        let mut takers = Vec::new();
        for to in &wire.to {
            let at = if to.span.is_empty() { &from.span } else { &to.span };
            let (taker, object) = match end(nodes, &to.value, at, out) {
                Some(End::Node(taker, object)) => (taker, object),
                Some(End::Manager) if sent.is_none() => {
                    out.wrong("machine::wire", at, "the manager sends nothing to itself", None);
                    continue;
                }
                _ => continue,
            };
            let Some(taken) = mapped(nodes, taker, Direction::Receive, object, at, out) else { continue };
            match sent {
                None => requests.push(Request {
                    node: taker,
                    direction: Direction::Receive,
                    mapped: taken,
                    timing: timing.clone(),
                    at: at.clone(),
                    takers: Vec::new(),
                }),
                Some((node, Some(sent))) if sent.bits != taken.bits => {
                    let (name, other) = (&nodes[node].name.value, &nodes[taker].name.value);
                    let (from, to) = (sent.address, taken.address);
                    let what = format!("{name} sends {} bits ({from}), {other} takes {} ({to})", sent.bits, taken.bits);
                    out.wrong("machine::wire", at, what, None);
                }
                Some(_) => takers.push((taker, taken, at.clone())),
            }
        }
        if let Some((node, Some(mapped))) = sent {
            let at = from.span.clone();
            requests.push(Request { node, direction: Direction::Transmit, mapped, timing, at, takers });
        }
    }
    let mut wiring = Wiring { nodes, free: FREE };
    // First those that an existing PDO carries already; only the others need a free PDO.
    let (carried, others): (Vec<_>, Vec<_>) =
        requests.into_iter().map(|request| (wiring.carrier(&request), request)).partition(|(pdo, _)| pdo.is_some());
    let mut links: BTreeMap<(usize, PdoName), Vec<Request>> = BTreeMap::new();
    for (pdo, request) in carried {
        links.entry((request.node, pdo.expect("it is carried"))).or_default().push(request);
    }
    for (pdo, requests) in wiring.pack(others.into_iter().map(|(_, request)| request), out) {
        links.entry(pdo).or_default().extend(requests);
    }
    for ((node, pdo), requests) in links {
        wiring.take(node, pdo, &requests, out);
    }
}

/// Parses an end of a wire: `feeder.statusword` or `manager`.
pub(crate) fn end<'w>(nodes: &[Node], text: &'w str, at: &Range<usize>, out: &mut Out) -> Option<End<'w>> {
    if text == MANAGER {
        return Some(End::Manager);
    }
    let Some((name, object)) = text.split_once('.') else {
        let help = Some("an end of a wire is \"manager\", or NODE.OBJECT".to_owned());
        out.wrong("machine::wire", at, format!("{text:?} is no end of a wire"), help);
        return None;
    };
    place(nodes, name, at, out).map(|node| End::Node(node, object))
}

fn mapped(
    nodes: &[Node],
    node: usize,
    direction: Direction,
    object: &str,
    at: &Range<usize>,
    out: &mut Out,
) -> Option<Mapped> {
    let Some(device) = nodes[node].device() else {
        // If it could not be loaded, that has been reported already.
        if nodes[node].sheet_name.is_none() {
            let what = format!("{} has no data sheet, which this is about", nodes[node].name.value);
            out.wrong("machine::sheet", at, what, Some("sheet = \"FILE.eds\"".to_owned()));
        }
        return None;
    };
    let found = PdoName { direction, number: 1 }.map(Some(device), &[object]);
    found.map_err(|objections| object_to(&objections, at, out)).ok()?.pop()
}

struct Wiring<'n> {
    nodes: &'n mut [Node],
    free: Range<u16>,
}

impl Wiring<'_> {
    fn node_id(&self, node: usize) -> NodeId {
        self.nodes[node].id.unwrap_or(NodeId::literal(1))
    }

    /// All PDOs of a node, as planned or else as in the data sheet; the flag says whether the PDO is planned.
    fn states(&self, node: usize, direction: Direction) -> Vec<(PdoState, bool)> {
        let (planned, id) = (&self.nodes[node].pdos, self.node_id(node));
        let Some(device) = self.nodes[node].device() else { return Vec::new() };
        let names = PdoName::of_sheet(device).into_iter().filter(|name| name.direction == direction);
        names
            .filter_map(|name| match planned.iter().find(|pdo| pdo.after.name == name) {
                Some(planned) => Some((planned.after.clone(), true)),
                None => Some((PdoState::of_sheet(device, id, name)?, false)),
            })
            .collect()
    }

    /// An enabled PDO that maps the value already: one that the file configures, or, without a wanted timing, any.
    fn carrier(&mut self, request: &Request) -> Option<PdoName> {
        let states = self.states(request.node, request.direction);
        let carries = |(state, is_planned): &&(PdoState, bool)| {
            let has = state.mapping.contains(&request.mapped) && state.cob_id.is_valid();
            has && (*is_planned || request.timing == Change::default())
        };
        let (state, is_planned) = states.iter().find(carries)?.clone();
        let name = state.name;
        if !is_planned {
            let planned = PlannedPdo { before: state.clone(), after: state, maps: true, place: span(&request.at) };
            self.nodes[request.node].pdos.push(planned);
        }
        Some(name)
    }

    /// Packs values with the same timing into free PDOs.
    fn pack(
        &mut self,
        requests: impl Iterator<Item = Request>,
        out: &mut Out,
    ) -> Vec<((usize, PdoName), Vec<Request>)> {
        let mut groups: Vec<Vec<Request>> = Vec::new();
        for request in requests {
            let most = self.most_objects(request.node, request.direction);
            let has_room = |group: &&mut Vec<Request>| {
                let first = &group[0];
                let bits: u32 = group.iter().map(|it| u32::from(it.mapped.bits)).sum();
                (first.node, first.direction, &first.timing) == (request.node, request.direction, &request.timing)
                    && bits + u32::from(request.mapped.bits) <= MOST_BITS
                    && group.len() < most
            };
            match groups.iter_mut().find(has_room) {
                Some(group) => group.push(request),
                None => groups.push(vec![request]),
            }
        }
        let mut packed = Vec::new();
        for group in groups {
            let first = &group[0];
            let mapping = group.iter().map(|request| request.mapped).collect();
            let transmission = first.timing.transmission.or(Some(TransmissionType::EventProfile));
            let change = Change { on: Some(true), transmission, mapping: Some(mapping), ..first.timing.clone() };
            if let Some(pdo) = self.plan(first.node, first.direction, change, &first.at, out) {
                packed.push(((first.node, pdo), group));
            }
        }
        packed
    }

    /// The number of objects that a PDO of the node can map.
    fn most_objects(&self, node: usize, direction: Direction) -> usize {
        let Some(device) = self.nodes[node].device() else { return 0 };
        let names = PdoName::of_sheet(device).into_iter().filter(|name| name.direction == direction);
        let objects =
            |name: PdoName| (1..=64).take_while(|sub| device.entry(name.mapping(0).index(), *sub).is_some()).count();
        names.map(objects).max().unwrap_or(0).max(1)
    }

    /// Plans a change for the first PDO of a node that is not planned yet.
    fn plan(
        &mut self,
        node: usize,
        direction: Direction,
        change: Change,
        at: &Range<usize>,
        out: &mut Out,
    ) -> Option<PdoName> {
        let Some((before, _)) = self.states(node, direction).into_iter().find(|(_, is_planned)| !is_planned) else {
            let kind = if direction == Direction::Receive { "RPDO" } else { "TPDO" };
            let help = Some("let several wires go at the same time, so that they share one".to_owned());
            out.wrong("machine::pdo", at, format!("{} has no {kind} left for this", self.nodes[node].name.value), help);
            return None;
        };
        let (name, id) = (before.name, self.node_id(node));
        let needs_id = change.cob_id.is_none() && before.cob_id.id().raw() == 0 && name.predefined(id).is_none();
        let cob_id = if needs_id { self.free.next().and_then(CobId::standard) } else { change.cob_id };
        let change = Change { cob_id, ..change };
        match Plan::new(self.nodes[node].device(), id, before, &change) {
            Ok(plan) => {
                let planned = PlannedPdo { before: plan.before, after: plan.after, maps: true, place: span(at) };
                self.nodes[node].pdos.push(planned);
                Some(name)
            }
            Err(objections) => {
                object_to(&objections, at, out);
                None
            }
        }
    }

    /// Makes other nodes receive a PDO.
    fn take(&mut self, node: usize, pdo: PdoName, requests: &[Request], out: &mut Out) {
        let takers: BTreeSet<usize> =
            requests.iter().flat_map(|request| request.takers.iter().map(|it| it.0)).collect();
        let Some(sent) = self.nodes[node].pdos.iter().find(|it| it.after.name == pdo).map(|it| it.after.clone()) else {
            return;
        };
        for taker in takers {
            let wanted: BTreeMap<Address, (Mapped, &Range<usize>)> = requests
                .iter()
                .flat_map(|request| request.takers.iter().map(move |it| (request.mapped.address, it)))
                .filter(|(_, (who, ..))| *who == taker)
                .map(|(sent, (_, mapped, at))| (sent, (*mapped, at)))
                .collect();
            let Some(at) = wanted.values().next().map(|(_, at)| (*at).clone()) else { continue };
            let mut mapping = Vec::new();
            let mut left = wanted.len();
            for mapped in &sent.mapping {
                if left == 0 {
                    break;
                }
                match wanted.get(&mapped.address) {
                    Some((own, _)) => {
                        mapping.push(*own);
                        left -= 1;
                    }
                    None => mapping.extend(self.gaps(taker, mapped.bits, &at, out)),
                }
            }
            let is_cyclic = sent.transmission.is_some_and(TransmissionType::is_synchronous);
            let transmission =
                if is_cyclic { TransmissionType::SynchronousCyclic(1) } else { TransmissionType::EventProfile };
            let change = Change {
                on: Some(true),
                cob_id: Some(sent.cob_id.id()),
                transmission: Some(transmission),
                mapping: Some(mapping),
                ..Change::default()
            };
            self.plan(taker, Direction::Receive, change, &at, out);
        }
    }

    /// Gaps in a mapping for values that the node does not receive.
    fn gaps(&self, node: usize, bits: u8, at: &Range<usize>, out: &mut Out) -> Vec<Mapped> {
        let name = PdoName { direction: Direction::Receive, number: 1 };
        let (mut left, mut gaps) = (bits, Vec::new());
        for (size, data_type) in [(32, "UNSIGNED32"), (16, "UNSIGNED16"), (8, "UNSIGNED8"), (1, "BOOLEAN")] {
            while left >= size {
                match name.map(self.nodes[node].device(), &[data_type]) {
                    Ok(gap) => gaps.extend(gap),
                    Err(objections) => {
                        let is_gap = |it: &Objection| matches!(it, Objection::GapNotAllowed(_));
                        let help = "give what it takes a PDO of its own, by another time of the wire".to_owned();
                        let what = objections.iter().find(|it| is_gap(it)).map(ToString::to_string);
                        out.wrong("machine::wire", at, what.unwrap_or_default(), Some(help));
                        return gaps;
                    }
                }
                left -= size;
            }
        }
        gaps
    }
}

/// A PDO on the bus.
pub(crate) struct Sent<'m> {
    pub(crate) node: &'m Node,
    pub(crate) state: PdoState,
    /// The place in the file, if it mentions the PDO.
    pub(crate) place: Option<lexican_eds::text::Span>,
}

/// All PDOs of a node in one direction that are enabled and map something, as planned or as in the data sheet.
pub(crate) fn active(node: &Node, direction: Direction) -> Vec<Sent<'_>> {
    let Some((device, id)) = node.device().zip(node.id) else { return Vec::new() };
    let names = PdoName::of_sheet(device).into_iter().filter(|name| name.direction == direction);
    let all = names.filter_map(|name| match node.pdos.iter().find(|pdo| pdo.after.name == name) {
        Some(pdo) => Some(Sent { node, state: pdo.after.clone(), place: Some(pdo.place) }),
        None => Some(Sent { node, state: PdoState::of_sheet(device, id, name)?, place: None }),
    });
    all.filter(|sent| sent.state.cob_id.is_valid() && !sent.state.mapping.is_empty()).collect()
}

/// The shortest interval between two messages of a PDO, if known.
pub(crate) fn period(state: &PdoState, sync: Option<Duration>) -> Option<Duration> {
    let timer = state.event_timer_ms.filter(|ms| *ms > 0).map(|ms| Duration::from_millis(ms.into()));
    let inhibit = state.inhibit_100us.filter(|time| *time > 0).map(Duration::from_100us);
    match state.transmission {
        Some(TransmissionType::SynchronousCyclic(each)) => sync.map(|sync| sync.times(each.into())),
        Some(TransmissionType::SynchronousAcyclic) => sync,
        _ => inhibit.or(timer),
    }
}
