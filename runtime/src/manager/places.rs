//! Places of a table of nodes, and sets of them.

/// A place in a table. At most 127 are taken, as there are no more node-IDs, so a set of them fits into an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place(u8);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Places(u128);

impl Place {
    pub(super) const FIRST: Place = Place(0);
    /// A place that is never taken.
    pub(super) const NONE: Place = Place(u8::MAX);

    /// `None` from 128 on.
    pub(super) fn at(index: usize) -> Option<Self> {
        u8::try_from(index).ok().filter(|&index| index < 128).map(Place)
    }

    /// The place with this index, whether or not it can be taken.
    pub(super) fn nearest(index: usize) -> Self {
        u8::try_from(index).map_or(Place::NONE, Place)
    }

    pub(super) fn index(self) -> usize {
        self.0.into()
    }

    /// The next place; after the last, the first one.
    pub(super) const fn next(self) -> Self {
        Place((self.0 + 1) % 128)
    }
}

impl Places {
    pub(super) const NONE: Places = Places(0);

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Adds a place to the set, or removes it.
    pub(super) const fn set(&mut self, place: Place, is_in: bool) {
        self.0 = self.0 & !(1 << place.0) | (is_in as u128) << place.0;
    }

    /// The places from `turn` on, then those before it.
    pub(super) fn from(self, turn: Place) -> impl Iterator<Item = Place> {
        let mut left = self.0.rotate_right(turn.0.into());
        core::iter::from_fn(move || {
            let ahead = u8::try_from(left.trailing_zeros()).ok().filter(|_| left != 0)?;
            left &= left - 1;
            Some(Place((turn.0 + ahead) % 128))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_places_of_a_set_take_turns() {
        let mut places = Places::NONE;
        let [first, middle, last] = [0, 64, 127].map(|index| Place::at(index).unwrap());
        for place in [first, middle, last, middle] {
            places.set(place, true);
        }
        assert_eq!(places.from(Place::FIRST).collect::<Vec<_>>(), [first, middle, last]);
        assert_eq!(places.from(first.next()).collect::<Vec<_>>(), [middle, last, first]);
        assert_eq!(places.from(last.next()).collect::<Vec<_>>(), [first, middle, last]);
        [first, middle, last].into_iter().for_each(|place| places.set(place, false));
        assert!(places.is_empty() && places == Places::NONE && places.from(last).next().is_none());
        assert_eq!(Place::at(128), None);
    }
}
