//! A quick answer to "is this frame for us?".

use crate::id::CobId;

/// A set of identifiers that may contain too much, never too little.
///
/// It has one bit for all identifiers with the same low six bits. In the predefined connection set these
/// are the identifiers of one node (and of the one 64 further), so that few bits are set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Filter([u32; 2]);

impl Filter {
    pub(super) const NOTHING: Filter = Filter([0; 2]);

    #[inline]
    pub(super) const fn may_contain(self, id: CobId) -> bool {
        let (word, bit) = Self::place(id);
        self.0[word] & bit != 0
    }

    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn insert(&mut self, id: CobId) {
        let (word, bit) = Self::place(id);
        self.0[word] |= bit;
    }

    /// The word and the bit of an identifier: words, because a shift of 64 bits is a call on a small machine.
    #[inline]
    const fn place(id: CobId) -> (usize, u32) {
        (id.raw() as usize >> 5 & 1, 1 << (id.raw() & 31))
    }
}

impl FromIterator<CobId> for Filter {
    fn from_iter<I: IntoIterator<Item = CobId>>(ids: I) -> Self {
        let mut filter = Filter::NOTHING;
        ids.into_iter().for_each(|id| filter.insert(id));
        filter
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
