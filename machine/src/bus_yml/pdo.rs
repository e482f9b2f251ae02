//! The PDOs of a slave.

use std::ops::Range;

use lexican_runtime::object::Direction;
use lexican_runtime::{CobId, NodeId, cia301};
use lexican_toolbox::pdo::PdoName;

use super::Reader;
use super::keys::Keys;
use super::tree::Yaml;
use crate::draft::{Found, object_name};

/// The COB-IDs that "auto" chooses from.
pub(super) const FREE: Range<u16> = 0x680..0x6E0;

impl Reader<'_> {
    pub(super) fn pdos(&mut self, keys: &Keys, found: &mut Found, direction: Direction) {
        let key = if direction == Direction::Receive { "rpdo" } else { "tpdo" };
        let Some(blocks) = keys.get(key) else { return };
        for (number, block) in Keys::of(blocks, &mut self.out).each() {
            let number_of = number.parse().ok().filter(|number| (1..=512).contains(number));
            let name = number_of.map(|number| PdoName { direction, number });
            match name.and_then(|name| Some((name, u32::try_from(found.held(name.parameter(1))?).ok()?))) {
                Some((name, before)) => self.pdo(block, name, before, found),
                None => {
                    let what = format!("no such PDO as {key} {}: {} stops here", number.value, self.tool);
                    self.out.wrong("bus-yml::pdo", &number.span, what, None);
                }
            }
        }
    }

    fn pdo(&mut self, block: &Yaml, name: PdoName, before: u32, found: &mut Found) {
        let keys = Keys::of(block, &mut self.out);
        let is_on = keys.flag("enabled", true, &mut self.out);
        let cob_id = match keys.get("cob_id") {
            Some(auto) if auto.text() == Some("auto") => self.auto(name, found.id, auto),
            _ => keys.number("cob_id", &mut self.out),
        };
        let cob_id = cob_id.unwrap_or(before);
        let (given, left_out) = match name.direction {
            Direction::Transmit => (
                &[("transmission", 2), ("inhibit_time", 3), ("event_timer", 5)][..],
                &[("event_deadline", "it is how long the master waits for this PDO")][..],
            ),
            Direction::Receive => (
                &[("transmission", 2), ("event_deadline", 5)][..],
                &[("inhibit_time", "it is of TPDOs"), ("event_timer", "it is of TPDOs")][..],
            ),
        };
        keys.leave_out(left_out, &mut self.out);
        keys.leave_out(&[("sync_start", "no PDO of a machine begins later")], &mut self.out);
        let given = given.iter().map(|(key, sub)| (*sub, keys.number::<u16>(key, &mut self.out)));
        let given: Vec<_> = given.collect();
        let mapping = keys.get("mapping").map(|mapping| self.mapping(mapping, name, found));
        self.end(&keys);
        let at = &block.at;
        if !is_on || cob_id & cia301::INVALID != 0 {
            if is_on {
                let what = format!(
                    "{name} has a COB-ID that is switched off: {} drops the rest of this without a word, and so does the machine",
                    self.tool
                );
                self.warn(at, what, Some("cob_id: auto"));
            }
            return self.record(found, name.parameter(1), (before | cia301::INVALID).into(), at);
        }
        self.record(found, name.parameter(1), cob_id.into(), at);
        for (sub, value) in given {
            if let Some(value) = value {
                self.record(found, name.parameter(sub), value.into(), at);
            }
        }
        if let Some(mapping) = mapping {
            found.written.insert(name.mapping(0));
            self.record(found, name.mapping(0), mapping.len() as i64, at);
            for (sub, mapped) in (1..).zip(mapping) {
                self.record(found, name.mapping(sub), mapped.into(), at);
            }
        }
    }

    /// The objects that a PDO maps, as entries of its mapping parameter.
    fn mapping(&mut self, mapping: &Yaml, name: PdoName, found: &Found) -> Vec<u32> {
        let mut mapped = Vec::new();
        for item in mapping.list().unwrap_or_default() {
            let (keys, address) = self.item(item);
            self.end(&keys);
            let (Some(address), Some((_, sheet, _))) = (address, &found.sheet) else { continue };
            match name.map(Some(sheet), &[object_name(sheet, address)]) {
                Ok(one) => mapped.extend(one.iter().map(|it| it.to_parameter())),
                Err(objections) => {
                    for objection in objections {
                        let what = format!("{objection}; {} writes it all the same", self.tool);
                        self.out.wrong("bus-yml::pdo", &item.at, what, objection.advice());
                    }
                }
            }
        }
        mapped
    }

    /// The COB-ID that "auto" chooses.
    fn auto(&mut self, name: PdoName, id: NodeId, at: &Yaml) -> Option<u32> {
        let next = name.predefined(id).map(CobId::raw).or_else(|| self.free.next().map(u32::from));
        if next.is_none() {
            let what = "there is no COB-ID left for this: the pool of \"auto\" has 680h to 6DFh";
            self.out.wrong("bus-yml::pdo", &at.at, what, None);
        }
        next
    }
}
