//! The PDOs of a slave.

use std::collections::BTreeSet;
use std::ops::Range;

use lexican_eds::model::Device;
use lexican_runtime::object::{Address, Direction, Mapped};
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{CobId, NodeId, cia301};
use lexican_toolbox::pdo::{Change, PdoName, PdoState, Plan};

use super::keys::Keys;
use super::tree::Yaml;
use super::{Reader, Slave};
use crate::draft::{object_name, pdo_text, quoted};

/// The pool of "auto".
pub(super) const FREE: Range<u16> = 0x680..0x6E0;

impl Reader<'_> {
    pub(super) fn pdos(&mut self, slave: &mut Slave, direction: Direction) {
        let key = if direction == Direction::Receive { "rpdo" } else { "tpdo" };
        let Some(blocks) = slave.keys.get(key).cloned() else { return };
        let mut done = BTreeSet::new();
        for (number, block) in Keys::of(&blocks, &mut self.out).each() {
            let name = number.parse().ok().filter(|number| (1..=512).contains(number));
            let state = name.map(|number| PdoName { direction, number });
            match state.and_then(|name| PdoState::of_sheet(&slave.device, slave.id, name)) {
                Some(before) if !done.insert(before.name) => {
                    self.out.wrong("bus-yml::pdo", &number.span, format!("{} comes twice", before.name), None);
                }
                Some(before) => {
                    let number = before.name.number;
                    if let Some(text) = self.pdo(block, before, slave) {
                        slave.section.put(&format!("{key}.{number}"), text);
                    }
                }
                None => {
                    let what =
                        format!("the data sheet has no such PDO as {key} {}: {} stops here", number.value, self.tool);
                    self.out.wrong("bus-yml::pdo", &number.span, what, None);
                }
            }
        }
    }

    /// A PDO in the words of a machine.
    fn pdo(&mut self, block: &Yaml, before: PdoState, slave: &Slave) -> Option<String> {
        let keys = Keys::of(block, &mut self.out);
        let Slave { device, id, .. } = slave;
        let (name, is_sent) = (before.name, before.name.direction == Direction::Transmit);
        let is_on = keys.flag("enabled", true, &mut self.out);
        let cob_id = match keys.get("cob_id") {
            Some(auto) if auto.text() == Some("auto") => Some(self.auto(name, *id, auto)?),
            _ => keys.number::<u32>("cob_id", &mut self.out),
        };
        let code = keys.number::<u8>("transmission", &mut self.out);
        let inhibit = keys.number::<u16>("inhibit_time", &mut self.out).filter(|_| is_sent);
        let timer = keys.number::<u16>("event_timer", &mut self.out).filter(|_| is_sent);
        let deadline = keys.number::<u16>("event_deadline", &mut self.out);
        if let (Some(_), true) = (deadline, is_sent) {
            self.warn(
                &block.at,
                "`event_deadline` of a TPDO is left out: it is how long the master waits for it",
                None,
            );
        }
        keys.leave_out(&[("sync_start", "no PDO of a machine begins later")], &mut self.out);
        let mapping = self.mapping(&keys, name, device);
        keys.end(self.tool, &mut self.of_ros, &mut self.out);
        let raw = cob_id.unwrap_or(before.cob_id.0);
        if is_on && raw & cia301::INVALID != 0 {
            let what = format!(
                "{name} has a COB-ID that is switched off: {} drops the rest of this without a word, and so does the machine",
                self.tool
            );
            self.warn(&block.at, what, Some("cob_id: auto"));
        }
        if !is_on || raw & cia301::INVALID != 0 {
            return Some(quoted("off"));
        }
        let given = cob_id.filter(|id| *id != before.cob_id.0 & 0x7FF || !before.cob_id.is_valid());
        let mut change = Change {
            on: Some(true),
            cob_id: given.and_then(|id| u16::try_from(id).ok()).and_then(CobId::standard),
            transmission: code.map(TransmissionType::from_code),
            inhibit_100us: inhibit,
            event_timer_ms: if is_sent { timer } else { deadline },
            mapping,
        };
        let is_known = given.is_some() == change.cob_id.is_some();
        let plan = Plan::new(Some(device), *id, before, &change);
        let objections = plan.err().into_iter().flatten().map(|it| it.to_string());
        let objections: Vec<_> =
            objections.chain((!is_known).then(|| format!("{raw:X}h is no COB-ID of 11 bits"))).collect();
        if !objections.is_empty() {
            let what = format!("{name} is left out: {}", objections.join("; "));
            self.out.wrong("bus-yml::pdo", &block.at, what, None);
            return None;
        }
        if let Some(ticks) = inhibit.filter(|ticks| !ticks.is_multiple_of(10)) {
            let what = format!("an inhibit time of {ticks}00 us is left out: a machine has whole milliseconds");
            self.warn(&block.at, what, None);
            change.inhibit_100us = None;
        }
        pdo_text(device, name, &change)
    }

    /// The objects of a PDO.
    fn mapping(&mut self, keys: &Keys, name: PdoName, device: &Device) -> Option<Vec<Mapped>> {
        let mut mapping = Vec::new();
        for item in keys.get("mapping")?.list().unwrap_or_default() {
            let item_keys = Keys::of(item, &mut self.out);
            let index = item_keys.number::<u16>("index", &mut self.out);
            let sub = item_keys.number::<u8>("sub_index", &mut self.out).unwrap_or(0);
            item_keys.end(self.tool, &mut self.of_ros, &mut self.out);
            let Some(index) = index else { continue };
            match name.map(Some(device), &[object_name(device, Address::new(index, sub))]) {
                Ok(mapped) => mapping.extend(mapped),
                Err(objections) => {
                    for objection in objections {
                        let what = format!("{objection}; {} writes it all the same", self.tool);
                        self.out.wrong("bus-yml::pdo", &item.at, what, objection.advice());
                    }
                }
            }
        }
        Some(mapping)
    }

    /// The COB-ID that "auto" stands for.
    fn auto(&mut self, name: PdoName, id: NodeId, at: &Yaml) -> Option<u32> {
        let next = name.predefined(id).map(CobId::raw).or_else(|| self.free.next().map(u32::from));
        if next.is_none() {
            let what = "there is no COB-ID left for this: the pool of \"auto\" has 680h to 6DFh";
            self.out.wrong("bus-yml::pdo", &at.at, what, None);
        }
        next
    }
}
