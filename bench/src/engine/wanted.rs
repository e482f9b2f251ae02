//! What faces want to be read again and again: it ends with the last face that wants it, and is bounded.

use std::collections::{BTreeMap, BTreeSet};

use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::trace::sampler::Signal;

use crate::command::Refused;

/// The most entries that are watched, by all faces.
const MOST_WATCHES: usize = 64;

/// The most objects and PDOs that have curves, by all faces; each curve may take 3 MB.
const MOST_CURVES: usize = 32;

type Watch = (NodeId, Address);
type Curve = (NodeId, Signal);

/// What is watched and drawn, and the faces that want it.
#[derive(Default)]
pub(super) struct Wanted {
    pub(super) watches: BTreeMap<Watch, BTreeSet<u32>>,
    pub(super) curves: BTreeMap<Curve, BTreeSet<u32>>,
}

impl Wanted {
    /// A face watches an entry.
    pub(super) fn watch(&mut self, face: u32, watch: Watch) -> Result<(), Refused> {
        want(&mut self.watches, face, &[watch], MOST_WATCHES).ok_or_else(|| {
            Refused::new(format_args!("{MOST_WATCHES} entries are watched, and no more can be"))
                .with_remedy("end another watch first")
        })
    }

    /// A face has curves drawn: all of these, or none if that would be too many.
    pub(super) fn draw(&mut self, face: u32, curves: &[Curve]) -> Result<(), Refused> {
        want(&mut self.curves, face, curves, MOST_CURVES).ok_or_else(|| {
            Refused::new(format_args!("at most {MOST_CURVES} objects and PDOs have curves"))
                .with_remedy("remove other curves first")
        })
    }

    /// A face is gone: what no other face wants.
    pub(super) fn leave(&mut self, face: u32) -> (Vec<Watch>, Vec<Curve>) {
        (ended(&mut self.watches, face), ended(&mut self.curves, face))
    }
}

fn want<K: Ord + Copy>(known: &mut BTreeMap<K, BTreeSet<u32>>, face: u32, keys: &[K], most: usize) -> Option<()> {
    let new: BTreeSet<_> = keys.iter().filter(|key| !known.contains_key(key)).collect();
    if known.len() + new.len() > most {
        return None;
    }
    for key in keys {
        known.entry(*key).or_default().insert(face);
    }
    Some(())
}

fn ended<K: Ord + Copy>(known: &mut BTreeMap<K, BTreeSet<u32>>, face: u32) -> Vec<K> {
    let mut ended = Vec::new();
    known.retain(|key, faces| {
        if faces.remove(&face) && faces.is_empty() {
            ended.push(*key);
        }
        !faces.is_empty()
    });
    ended
}
