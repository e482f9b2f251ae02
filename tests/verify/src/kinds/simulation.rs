//! What the simulated drive does not do, according to the overlay: `simulated = false`.

use lexican_eds::model::Meaning;
use lexican_runtime::object::Address;

use crate::checker::Checker;
use crate::drive::Case;
use crate::sheet::address;

/// Compares the overlay with the entries that the drive has read or set by itself, in everything that it can be made to
/// do: `uses` says which. An entry that can only be read and has a default is a constant.
pub(crate) fn entries(checker: &mut Checker<'_>, case: &Case<'_>, uses: impl Fn(Address) -> bool) {
    for entry in case.sheet.device.entries() {
        if let Some(why) = &entry.not_simulated {
            checker.not_simulated(why, format!("{:04X}h", entry.index));
        }
        // Objects below 2000h are those of CiA 301, which the runtime serves.
        if entry.index < 0x2000 {
            continue;
        }
        let object = case.sheet.device.object(entry.index);
        // The number of entries.
        let counts = entry.sub == 0 && object.is_some_and(|object| object.kind.has_subs());
        let holds = counts || !entry.access.writable() && entry.default.is_some();
        let (used, said) = (uses(address(entry)), entry.not_simulated.is_none());
        checker.require(used == said || holds && said, || {
            let [is, says] = [used, said].map(|yes| if yes { "" } else { " not" });
            format!(
                "{:04X}:{:02X}: the simulated drive does{is} use it, and the overlay says{says} that it does",
                entry.index, entry.sub
            )
        });
    }
}

/// Compares the overlay with bits that are compared with the drive: none of them is marked as not simulated.
pub(crate) fn bits(checker: &mut Checker<'_>, case: &Case<'_>, shown: impl Fn(u16, u8) -> bool) {
    for entry in case.sheet.device.entries() {
        let Meaning::BitField(name) = &entry.meaning else { continue };
        let field = case.sheet.device.bit_fields.get(name);
        for (low, why) in field.into_iter().flat_map(|field| &field.not_simulated) {
            checker.not_simulated(why, format!("{:04X}h from bit {low} on", entry.index));
            checker.require(!shown(entry.index, *low), || format!("{name}, bit {low}: the simulated drive shows it"));
        }
    }
}
