//! `[[pdo]]`.

use super::keys::keys_of;
use super::value::address;
use super::{Changes, Extra, Node, Reader};
use crate::finding::Kind;
use crate::model::pdo::MAX_PDOS;
use crate::model::types::DataType;
use crate::model::{Device, Direction, Mapped, Pdo};

impl Reader<'_> {
    pub(super) fn pdos(&mut self, node: &Node<'_>) {
        for node in self.array(node).into_iter().flatten() {
            if let Some(pdo) = self.pdo(node) {
                let span = self.span(node.span());
                self.changes.pdos.push(Extra { pdo, span });
            }
        }
    }

    fn pdo(&mut self, node: &Node<'_>) -> Option<Pdo> {
        let (mut direction, mut number, mut cob_id, mut transmission_type) = (None, None, None, None);
        let mut mapping = Vec::new();
        let before = self.out.total();
        for (key, node) in self.table(node)? {
            match key.get_ref().as_ref() {
                "direction" => {
                    let word = match node.get_ref().as_str() {
                        Some("receive") => Some(Direction::Receive),
                        Some("transmit") => Some(Direction::Transmit),
                        _ => None,
                    };
                    direction = self.expect(node, word, "\"receive\" or \"transmit\"");
                }
                "number" => {
                    let valid = |number: i128| u16::try_from(number).ok().filter(|n| (1..=MAX_PDOS).contains(n));
                    number = self.integer(node).and_then(|n| self.expect(node, valid(n), "a number from 1 to 512"));
                }
                "cob_id" => cob_id = self.value(node, DataType::Unsigned32),
                "transmission_type" => transmission_type = self.number(node),
                "mapping" => {
                    mapping = self.array(node).into_iter().flatten().filter_map(|node| self.mapped(node)).collect();
                }
                _ => self.unknown(key, keys_of("pdo")),
            }
        }
        let pdo = direction.zip(number).map(|(direction, number)| Pdo {
            direction,
            number,
            cob_id,
            transmission_type,
            mapping,
            dynamic: false,
        });
        self.expect_whole(node, before, pdo, "a PDO with `direction` and `number`")
    }

    /// An object `"6041:00"` with the length of its data type, or a data type such as `"0005:00"` for a gap.
    fn mapped(&mut self, node: &Node<'_>) -> Option<Mapped> {
        let text = self.text(node)?;
        let (index, sub) = self.expect(node, address(&text), "an entry such as \"6041:00\"")?;
        let sub = sub.unwrap_or(0);
        let data_type = match self.device.entry(index, sub) {
            Some(entry) => Some(entry.data_type),
            None => Some(DataType::from_code(index)).filter(|data_type| data_type.bits().is_some()),
        };
        let Some(data_type) = data_type else {
            self.push(Kind::OverlayObject(text.into()), node);
            return None;
        };
        let bits = self.expect(node, data_type.bits(), "an entry of a fixed size")?;
        Some(Mapped { index, sub, bits })
    }
}

/// Replaces PDOs of the data sheet by those of the overlays, and adds the others.
pub(crate) fn merge(device: &mut Device, changes: &Changes) {
    for Extra { pdo, .. } in &changes.pdos {
        let same = |other: &&mut Pdo| (other.direction, other.number) == (pdo.direction, pdo.number);
        match device.pdos.iter_mut().find(same) {
            Some(other) => {
                let cob_id = pdo.cob_id.clone().or_else(|| other.cob_id.take());
                let transmission_type = pdo.transmission_type.or(other.transmission_type);
                let mapping =
                    if pdo.mapping.is_empty() { std::mem::take(&mut other.mapping) } else { pdo.mapping.clone() };
                *other = Pdo { cob_id, transmission_type, mapping, ..other.clone() };
            }
            None => device.pdos.push(pdo.clone()),
        }
    }
    device.pdos.sort_by_key(|pdo| (pdo.direction, pdo.number));
}
