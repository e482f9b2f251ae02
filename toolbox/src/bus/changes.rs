//! What is new on a bus: leaves out frames that only repeat the one before.

use std::collections::BTreeMap;

use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Frame, NodeId};

use crate::bus::transfers::Transfer;
use crate::decode::{Decoded, Detail};
use crate::values::report::ValueReport;

/// Remembers the last frame of each COB-ID, and the last value of each entry that a transfer carried.
#[derive(Debug, Default)]
pub struct Changes {
    frames: BTreeMap<CobId, Last>,
    transfers: BTreeMap<(NodeId, Address, Option<bool>), String>,
}

#[derive(Debug)]
struct Last {
    frame: Frame,
    fields: Vec<ValueReport>,
}

impl Changes {
    /// Handles a frame, and returns what is new in it: for a PDO, the values that differ from the last ones; for other
    /// frames, everything or nothing.
    pub fn observe(&mut self, frame: &Frame, decoded: Decoded) -> Option<Decoded> {
        let fields = match &decoded.detail {
            Detail::Pdo(pdo) => pdo.fields.clone(),
            _ => Vec::new(),
        };
        let before = self.frames.insert(frame.id(), Last { frame: *frame, fields });
        let Some(before) = before else { return Some(decoded) };
        if before.frame == *frame {
            return None;
        }
        match decoded.detail {
            Detail::Pdo(mut pdo) if !pdo.fields.is_empty() && !before.fields.is_empty() => {
                pdo.fields.retain(|field| !before.fields.contains(field));
                let text = pdo.fields.iter().map(ValueReport::brief).collect::<Vec<_>>().join(", ");
                // Bits outside of all entries may differ even so.
                (!pdo.fields.is_empty()).then_some(Decoded { text, detail: Detail::Pdo(pdo), ..decoded })
            }
            _ => Some(decoded),
        }
    }

    /// Handles a transfer; returns whether its value or its end differs from the last transfer of the entry.
    pub fn observe_transfer(&mut self, transfer: &Transfer) -> bool {
        let Some(report) = &transfer.report else { return true };
        let outcome = format!("{:?} {:?}", transfer.end, report.text);
        let key = (transfer.node, report.address, transfer.writes);
        self.transfers.insert(key, outcome.clone()).is_none_or(|before| before != outcome)
    }
}
