//! The nodes of a manager. The node for a frame or a deadline is found without walking over all of them.

use super::deadlines::Deadlines;
use super::error::Full;
use super::places::{Place, Places};
use crate::id::{CobId, NodeId};
use crate::time::Instant;

/// What a table needs to know of one node.
pub(super) trait Entry {
    fn node(&self) -> NodeId;
    /// The COB-IDs of frames for it, besides error control.
    fn cob_ids(&self) -> [Option<CobId>; IDS];
    /// When its deadline is.
    fn poll_timeout(&self) -> Option<Instant>;
    /// The answers to questions about it, which the table keeps for all nodes: [`Table::marked`].
    fn marks(&self) -> [bool; MARKS];
}

/// How many COB-IDs an entry may have.
pub(super) const IDS: usize = 2;

/// How many questions may be asked about an entry.
pub(super) const MARKS: usize = 3;

/// Up to `N` nodes, each in its own place.
#[derive(Clone, Debug)]
pub(super) struct Table<T, const N: usize> {
    entries: [Option<T>; N],
    /// By node-ID.
    places: [Place; 128],
    identifiers: Identifiers<N>,
    deadlines: Deadlines<N>,
    marked: [Places; MARKS],
}

impl<T: Entry, const N: usize> Table<T, N> {
    pub(super) const fn new() -> Self {
        Table {
            entries: [const { None }; N],
            places: [Place::NONE; 128],
            identifiers: Identifiers::new(),
            deadlines: Deadlines::new(),
            marked: [Places::NONE; MARKS],
        }
    }

    /// Puts an entry into the present place of its node, or into a free one.
    pub(super) fn insert(&mut self, entry: T) -> Result<(), Full> {
        let node = entry.node();
        let free = || Place::at(self.entries.iter().position(Option::is_none)?);
        let place = self.place(node).or_else(free).ok_or(Full { node, nodes: N })?;
        self.identifiers.remove(place);
        self.identifiers.insert(place, entry.cob_ids());
        if let Some(known) = self.entries.get_mut(place.index()) {
            *known = Some(entry);
        }
        self.set_place(node, place);
        self.follow(place);
        Ok(())
    }

    pub(super) fn remove(&mut self, node: NodeId) -> Option<T> {
        let place = self.place(node)?;
        let entry = self.entries.get_mut(place.index())?.take();
        self.identifiers.remove(place);
        self.set_place(node, Place::NONE);
        self.follow(place);
        entry
    }

    pub(super) fn place(&self, node: NodeId) -> Option<Place> {
        self.places.get(usize::from(node.get())).copied().filter(|&place| place != Place::NONE)
    }

    fn set_place(&mut self, node: NodeId, place: Place) {
        if let Some(known) = self.places.get_mut(usize::from(node.get())) {
            *known = place;
        }
    }

    /// The place that a COB-ID belongs to, and its position in [`Entry::cob_ids`]; the first place if there are
    /// several.
    pub(super) fn find(&self, id: CobId) -> Option<(Place, usize)> {
        self.identifiers.find(id)
    }

    pub(super) fn get(&self, node: NodeId) -> Option<&T> {
        self.at(self.place(node)?)
    }

    pub(super) fn at(&self, place: Place) -> Option<&T> {
        self.entries.get(place.index())?.as_ref()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &T> {
        self.entries.iter().flatten()
    }

    /// Changes an entry, and updates what the table knows of it.
    pub(super) fn change<R>(&mut self, place: Place, change: impl FnOnce(&mut T) -> R) -> Option<R> {
        let result = change(self.entries.get_mut(place.index())?.as_mut()?);
        self.follow(place);
        Some(result)
    }

    pub(super) fn change_all(&mut self, mut change: impl FnMut(&mut T)) {
        for place in (0..N).map_while(Place::at) {
            self.change(place, &mut change);
        }
    }

    /// Lends an entry. Until [`Table::take_back`], the table ignores its deadline, and its marks may be out of date.
    pub(super) fn lend(&mut self, place: Place) -> Option<&mut T> {
        self.deadlines.set(place, None);
        self.entries.get_mut(place.index())?.as_mut()
    }

    /// Takes back an entry, whose COB-IDs may have changed.
    pub(super) fn take_back(&mut self, place: Place) {
        let ids = self.at(place).map_or([None; IDS], Entry::cob_ids);
        let is_known = |(which, id): (usize, Option<CobId>)| id.is_none_or(|id| self.find(id) == Some((place, which)));
        if !(0..).zip(ids).all(is_known) {
            self.identifiers.remove(place);
            self.identifiers.insert(place, ids);
        }
        self.follow(place);
    }

    fn follow(&mut self, place: Place) {
        let entry = self.entries.get(place.index()).and_then(Option::as_ref);
        self.deadlines.set(place, entry.and_then(T::poll_timeout));
        let marks = entry.map_or([false; MARKS], T::marks);
        for (places, mark) in self.marked.iter_mut().zip(marks) {
            places.set(place, mark);
        }
    }

    /// The places of the entries for which the question with this number is true.
    pub(super) fn marked(&self, question: usize) -> Places {
        self.marked.get(question).copied().unwrap_or(Places::NONE)
    }

    /// The earliest deadline.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.deadlines.first()
    }

    /// Handles deadlines that have come, the earliest first, until one has something to report.
    pub(super) fn handle_timeout<R>(&mut self, now: Instant, mut handle: impl FnMut(&mut T) -> Option<R>) -> Option<R> {
        // At most N, since an entry that is always due would never end.
        for _ in 0..N {
            let reported = self.change(self.deadlines.due(now)?, &mut handle)?;
            if reported.is_some() {
                return reported;
            }
        }
        None
    }
}

/// The meaning of COB-IDs, found by binary search.
#[derive(Clone, Debug)]
struct Identifiers<const N: usize> {
    /// The first `len` are sorted by COB-ID, then by place.
    meanings: [[Meaning; IDS]; N],
    len: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Meaning {
    id: CobId,
    place: Place,
    which: u8,
}

impl<const N: usize> Identifiers<N> {
    const fn new() -> Self {
        Identifiers { meanings: [[Meaning { id: CobId::NMT, place: Place::FIRST, which: 0 }; IDS]; N], len: 0 }
    }

    fn known(&self) -> &[Meaning] {
        self.meanings.as_flattened().get(..self.len).unwrap_or(&[])
    }

    fn find(&self, id: CobId) -> Option<(Place, usize)> {
        let known = self.known();
        let found = known.get(known.partition_point(|meaning| meaning.id < id))?;
        (found.id == id).then_some((found.place, found.which.into()))
    }

    fn insert(&mut self, place: Place, ids: [Option<CobId>; IDS]) {
        for (id, which) in ids.into_iter().zip(0..) {
            let Some(id) = id else { continue };
            let new = Meaning { id, place, which };
            let at = self.known().partition_point(|known| *known < new);
            let all = self.meanings.as_flattened_mut();
            all.copy_within(at..self.len, at + 1);
            self.len += 1;
            all.get_mut(at).into_iter().for_each(|free| *free = new);
        }
    }

    fn remove(&mut self, place: Place) {
        let mut kept = 0;
        let all = self.meanings.as_flattened_mut();
        for at in 0..self.len {
            let Some(&meaning) = all.get(at).filter(|meaning| meaning.place != place) else { continue };
            all.get_mut(kept).into_iter().for_each(|free| *free = meaning);
            kept += 1;
        }
        self.len = kept;
    }
}
