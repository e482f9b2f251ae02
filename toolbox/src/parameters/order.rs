//! The order in which parameters have to be written.

use std::collections::BTreeSet;

use lexican_runtime::cia301::{self, is_pdo_mapping};
use lexican_runtime::object::Address;

/// One write to a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Write {
    /// The entry.
    pub address: Address,
    /// The value in wire form.
    pub data: Vec<u8>,
    /// Whether this is the setting itself, and not a temporary value: COB-IDs are disabled and mappings cleared first.
    pub is_final: bool,
}

/// Settings in the order that CiA 301 requires: a PDO is disabled first and enabled last, and its mapping is cleared
/// before it changes (7.5.2.36); EMCY and SDO channels are disabled while they change (7.5.2.17, 7.5.2.33). Date and
/// time of the configuration (1020h) come last, because devices clear them at any other change (CiA 302-3).
pub fn in_order(settings: impl IntoIterator<Item = (Address, Vec<u8>)>) -> Vec<Write> {
    // In this order: what needs no order, numbers of mapped objects, COB-IDs of PDOs, 1020h.
    let mut groups: [Vec<Write>; 4] = Default::default();
    for (address, data) in settings {
        let (before, group) = match (address.index(), address.sub()) {
            (index, 1) if is_pdo(index) => (Some(switched_off(&data)), 2),
            (index, 0) if is_pdo_mapping(index) => (Some(vec![0; data.len()]), 1),
            (cia301::COB_ID_EMCY, 0) | (cia301::SDO_SERVER_2..=cia301::SDO_CLIENT_128, 1 | 2) => {
                (Some(switched_off(&data)), 0)
            }
            (cia301::VERIFY_CONFIGURATION, _) => (None, 3),
            _ => (None, 0),
        };
        groups[0].extend(before.map(|data| Write { address, data, is_final: false }));
        groups[group].push(Write { address, data, is_final: true });
    }
    groups.concat()
}

/// The COB-ID with its highest bit set, which disables it.
fn switched_off(cob_id: &[u8]) -> Vec<u8> {
    let mut off = cob_id.to_vec();
    off.last_mut().into_iter().for_each(|byte| *byte |= 0x80);
    off
}

/// For each PDO with an entry among these, the entries for COB-ID and number of mapped objects: [`in_order`] needs them
/// to disable and enable the PDO.
pub(super) fn switches(entries: impl IntoIterator<Item = Address>) -> BTreeSet<Address> {
    let mut switches = BTreeSet::new();
    for address in entries {
        let index = address.index();
        if is_pdo(index) {
            switches.insert(Address::new(index, 1));
        } else if is_pdo_mapping(index) {
            switches.insert(Address::new(index - cia301::TO_MAPPING, 1));
            switches.insert(Address::new(index, 0));
        }
    }
    switches
}

fn is_pdo(index: u16) -> bool {
    matches!(index, cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pdo_is_switched_off_first_and_on_last() {
        let settings: [(u16, u8, &[u8]); 9] = [
            (0x1014, 0, &[0x90, 0, 0, 0]),
            (0x1017, 0, &[100, 0]),
            (0x1020, 1, &[1, 0, 0, 0]),
            (0x1800, 1, &[5, 2, 0, 0]),
            (0x1800, 2, &[255]),
            (0x1A00, 0, &[1]),
            (0x1A00, 1, &[0x10, 0, 1, 0x20]),
            (0x2001, 0, &[7, 0]),
            (0x6060, 0, &[2]),
        ];
        let settings = settings.map(|(index, sub, data)| (Address::new(index, sub), data.to_vec()));
        let writes: Vec<_> = in_order(settings)
            .iter()
            .map(|write| {
                let number = write.data.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
                format!("{} {number:X}{}", write.address, if write.is_final { "" } else { " for now" })
            })
            .collect();
        assert_eq!(
            writes,
            [
                "1014:00 80000090 for now",
                "1014:00 90",
                "1017:00 64",
                "1800:01 80000205 for now",
                "1800:02 FF",
                "1A00:00 0 for now",
                "1A00:01 20010010",
                "2001:00 7",
                "6060:00 2",
                "1A00:00 1",
                "1800:01 205",
                "1020:01 1",
            ]
        );
    }

    #[test]
    fn a_change_of_a_mapping_needs_the_whole_pdo_switched() {
        let addresses = [(0x1A03, 2), (0x1402, 2), (0x1017, 0)].map(|(index, sub)| Address::new(index, sub));
        let switches: Vec<_> = switches(addresses).iter().map(ToString::to_string).collect();
        assert_eq!(switches, ["1402:01", "1803:01", "1A03:00"]);
    }
}
