//! A quick answer to "is this frame for us?".

use crate::id::CobId;

/// A set of identifiers that may contain too much, never too little.
///
/// It has one bit for all identifiers with the same low six bits. In the predefined connection set these
/// are the identifiers of one node (and of the one 64 further), so that few bits are set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Filter(u64);

impl Filter {
    pub(super) const NOTHING: Filter = Filter(0);

    #[inline]
    pub(super) const fn may_contain(self, id: CobId) -> bool {
        self.0 & Self::bit(id) != 0
    }

    #[inline]
    const fn bit(id: CobId) -> u64 {
        1 << (id.raw() & 63)
    }
}

impl FromIterator<CobId> for Filter {
    fn from_iter<I: IntoIterator<Item = CobId>>(ids: I) -> Self {
        Filter(ids.into_iter().fold(0, |bits, id| bits | Self::bit(id)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_in_is_contained_and_other_nodes_are_not() {
        let id = |raw| CobId::standard(raw).unwrap();
        let filter: Filter = [id(0x205), id(0x605), CobId::SYNC].into_iter().collect();
        assert!(filter.may_contain(id(0x205)) && filter.may_contain(id(0x605)) && filter.may_contain(CobId::SYNC));
        assert!(!filter.may_contain(id(0x206)) && !filter.may_contain(id(0x586)));
        assert!(!Filter::NOTHING.may_contain(CobId::NMT));
    }
}
