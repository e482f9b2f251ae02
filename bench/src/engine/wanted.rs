//! Entries and signals that clients want to be read repeatedly. Each ends with the last client that wants it, and their
//! number is limited.

use std::collections::{BTreeMap, BTreeSet};

use lexican_runtime::NodeId;
use lexican_runtime::object::Address;
use lexican_toolbox::trace::sampler::Signal;

use crate::request::Refused;

/// The most watched entries of all clients.
const MOST_WATCHES: usize = 64;

/// The most plotted objects and PDOs of all clients; each curve may take 3 MB.
const MOST_CURVES: usize = 32;

type Watch = (NodeId, Address);
type Curve = (NodeId, Signal);

/// Watched entries and plotted signals, with the clients that want them.
#[derive(Default)]
pub(super) struct Wanted {
    pub(super) watches: BTreeMap<Watch, BTreeSet<u32>>,
    pub(super) curves: BTreeMap<Curve, BTreeSet<u32>>,
}

impl Wanted {
    /// Watches an entry for a client.
    pub(super) fn watch(&mut self, client: u32, watch: Watch) -> Result<(), Refused> {
        want(&mut self.watches, client, &[watch], MOST_WATCHES).ok_or_else(|| {
            Refused::new(format_args!("{MOST_WATCHES} entries are watched, and no more can be"))
                .with_remedy("end another watch first")
        })
    }

    /// Plots curves for a client: all of these, or none if there would be too many.
    pub(super) fn draw(&mut self, client: u32, curves: &[Curve]) -> Result<(), Refused> {
        want(&mut self.curves, client, curves, MOST_CURVES).ok_or_else(|| {
            Refused::new(format_args!("at most {MOST_CURVES} objects and PDOs have curves"))
                .with_remedy("remove other curves first")
        })
    }

    /// Removes a client; returns what no other client wants.
    pub(super) fn leave(&mut self, client: u32) -> (Vec<Watch>, Vec<Curve>) {
        (ended(&mut self.watches, client), ended(&mut self.curves, client))
    }
}

fn want<K: Ord + Copy>(known: &mut BTreeMap<K, BTreeSet<u32>>, client: u32, keys: &[K], most: usize) -> Option<()> {
    let new: BTreeSet<_> = keys.iter().filter(|key| !known.contains_key(key)).collect();
    if known.len() + new.len() > most {
        return None;
    }
    for key in keys {
        known.entry(*key).or_default().insert(client);
    }
    Some(())
}

fn ended<K: Ord + Copy>(known: &mut BTreeMap<K, BTreeSet<u32>>, client: u32) -> Vec<K> {
    let mut ended = Vec::new();
    known.retain(|key, clients| {
        if clients.remove(&client) && clients.is_empty() {
            ended.push(*key);
        }
        !clients.is_empty()
    });
    ended
}
