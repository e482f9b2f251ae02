//! 8: storing and restoring parameters, and restricted identifiers.

use lexican_runtime::wire::nmt::NmtCommand;

use crate::answers;
use crate::case::{Case, case};
use crate::hazard::Hazard;
use crate::tester::Tester;
use crate::verdict::{Outcome, failed, not_applicable};

/// The hazards of cases that store a value, and remove it afterwards.
pub(crate) const BOTH: &[Hazard] = &[Hazard::Store, Hazard::Restore];
const STORE: &[Hazard] = &[Hazard::Store];
const RESTORE: &[Hazard] = &[Hazard::Restore];

/// The id of the case about storing.
pub(crate) const STORED: &str = "301/7.5.2.13/2";

pub(crate) const SAVE: u32 = u32::from_le_bytes(*b"save");
const LOAD: u32 = u32::from_le_bytes(*b"load");

const BY_SAVE: &str = "1010h stores with the signature \"save\" only.";
const BY_LOAD: &str = "1011h restores with the signature \"load\" only.";
const STORES: &str = "What was stored by 1010h is there after a reset.";
const RESTORES: &str = "What was restored by 1011h has its defaults after the next reset.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.5.2.13/1", "8.1", "1010h:01 wants its signature", |t| refuses_signatures(t, 0x1010, 1, LOAD))
        .requires(BY_SAVE)
        .needs(STORE),
    case("301/7.5.2.13/2", "8.2", "1010h:01 stores", |t| stores(t, 1)).requires(STORES).needs(BOTH),
    case("301/7.5.2.14/1", "8.3", "1011h:01 wants its signature", |t| refuses_signatures(t, 0x1011, 1, SAVE))
        .requires(BY_LOAD)
        .needs(RESTORE),
    case("301/7.5.2.14/2", "8.4", "1011h:01 restores with the next reset", |t| restores(t, 1))
        .requires(RESTORES)
        .needs(BOTH),
    case("301/7.5.2.13/3", "8.5", "1010h:02 wants its signature", |t| refuses_signatures(t, 0x1010, 2, LOAD))
        .requires(BY_SAVE)
        .needs(STORE),
    case("301/7.5.2.13/4", "8.6", "1010h:02 stores", |t| stores(t, 2)).requires(STORES).needs(BOTH),
    case("301/7.5.2.14/3", "8.7", "1011h:02 wants its signature", |t| refuses_signatures(t, 0x1011, 2, SAVE))
        .requires(BY_LOAD)
        .needs(RESTORE),
    case("301/7.5.2.14/4", "8.8", "1011h:02 restores with the next reset", |t| restores(t, 2))
        .requires(RESTORES)
        .needs(BOTH),
    case("301/7.5.2.23/1", "8.9", "1020h is stored", |t| {
        t.entry(0x1020, 1)?;
        t.entry(0x1010, 1)?;
        for (sub, value) in [(1, 1234), (2, 5678)] {
            t.write(0x1020, sub, value)?;
        }
        t.write(0x1010, 1, SAVE)?;
        t.reset(NmtCommand::ResetNode)?;
        for (sub, value) in [(1, 1234), (2, 5678)] {
            let stored = t.reads(0x1020, sub, value);
            t.needs(STORED, stored)?;
        }
        forget(t)
    })
    .requires("1020h keeps the date and the time of the configuration when they are stored.")
    .needs(BOTH),
    case("301/7.5.2.14/5", "", "1011h:01 restores all communication parameters", |t| {
        t.entry(0x1011, 1)?;
        t.entry(0x1010, 1)?;
        let changed = changed_parameters(t)?;
        t.write(0x1010, 1, SAVE)?;
        t.reset(NmtCommand::ResetNode)?;
        t.write(0x1011, 1, LOAD)?;
        t.reset(NmtCommand::ResetNode)?;
        for ((index, sub), _) in changed {
            let entry = t.entry(index, sub)?;
            t.is_default(&entry)?;
        }
        forget(t)
    })
    .requires(RESTORES)
    .needs(BOTH),
    case("301/7.3.2.2.1/2", "", "without being stored, communication parameters last until a reset", |t| {
        if stores_by_itself(t)? {
            return Err(not_applicable("1010h says that the device stores by itself"));
        }
        for command in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
            let changed = changed_parameters(t)?;
            t.reset(command)?;
            for ((index, sub), before) in changed {
                if !t.entry(index, sub)?.persistent {
                    t.reads(index, sub, before)?;
                }
            }
        }
        Ok(())
    })
    .requires("A reset brings back the values that were stored, or the defaults."),
    case("301/7.3.5/1", "8.10", "no service takes a restricted identifier", |t| {
        // The first and the last COB-ID of each range in CiA 301, 7.3.5, and this node's own.
        let node = u32::from(t.node.get());
        let edges = [0, 1, 0x7F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x77F, 0x780, 0x7FF];
        let own = [0x580, 0x600, 0x700].map(|base| base + node);
        let services = t.some("is a COB-ID that can be written", |entry| {
            let of_message = matches!((entry.index, entry.sub), (0x1005 | 0x1014, 0));
            let of_pdo = matches!((entry.index, entry.sub), (0x1400..=0x15FF | 0x1800..=0x19FF, 1));
            let of_sdo = matches!((entry.index, entry.sub), (0x1201..=0x127F, 1 | 2));
            entry.access.writable() && (of_message || of_pdo || of_sdo)
        })?;
        for service in services {
            let (index, sub) = (service.index, service.sub);
            // A COB-ID is changed while its service is disabled. SYNC cannot be disabled, since there may be consumers.
            if index != 0x1005 {
                let cob_id = t.read(index, sub)? as u32;
                t.write(index, sub, cob_id | 1 << 31)?;
            }
            for restricted in edges.into_iter().chain(own) {
                t.refuses(index, sub, restricted, &answers::RESTRICTED)?;
            }
        }
        Ok(())
    })
    .requires("Restricted identifiers are used by no object that can be configured."),
];

/// Restores the defaults of the device.
pub(crate) fn forget(t: &mut Tester<'_>) -> Outcome {
    if t.entry(0x1011, 1).is_ok() {
        t.write(0x1011, 1, LOAD)?;
    }
    t.reset(NmtCommand::ResetNode)
}

fn refuses_signatures(t: &mut Tester<'_>, index: u16, group: u8, of_the_other: u32) -> Outcome {
    t.entry(index, group)?;
    let backwards = if index == 0x1010 { *b"evas" } else { *b"daol" };
    for signature in [u32::from_le_bytes(backwards), of_the_other, 0] {
        t.refuses(index, group, signature, &answers::SIGNATURE)?;
    }
    Ok(())
}

/// Whether the device stores parameters by itself, so that every written value persists (CiA 301, 7.5.2.13, bit 1).
pub(crate) fn stores_by_itself(t: &mut Tester<'_>) -> Outcome<bool> {
    Ok(t.entry(0x1010, 1).is_ok() && t.read(0x1010, 1)? & 2 != 0)
}

/// Checks that a value is stored, and that a later one is not.
fn stores(t: &mut Tester<'_>, group: u8) -> Outcome {
    t.entry(0x1010, group)?;
    t.entry(0x1017, 0)?;
    let able = t.read(0x1010, group)?;
    if able & 1 == 0 {
        return Err(failed("1010h says that it does not store on command"));
    }
    if able & 2 != 0 || stores_by_itself(t)? {
        return Err(not_applicable("1010h says that the device stores by itself"));
    }
    t.write(0x1017, 0, 1000)?;
    t.write(0x1010, group, SAVE)?;
    t.write(0x1017, 0, 2000)?;
    for command in [NmtCommand::ResetCommunication, NmtCommand::ResetNode] {
        t.reset(command)?;
        t.reads(0x1017, 0, 1000)?;
    }
    forget(t)
}

fn restores(t: &mut Tester<'_>, group: u8) -> Outcome {
    t.entry(0x1011, group)?;
    t.entry(0x1010, group)?;
    t.entry(0x1017, 0)?;
    let default = t.read(0x1017, 0)?;
    t.write(0x1017, 0, 1000)?;
    t.write(0x1010, group, SAVE)?;
    t.reset(NmtCommand::ResetNode)?;
    t.write(0x1011, group, LOAD)?;
    // Restored values take effect at the reset, and not before.
    let stored = t.reads(0x1017, 0, 1000);
    t.needs(if group == 2 { "301/7.5.2.13/4" } else { STORED }, stored)?;
    t.reset(NmtCommand::ResetNode)?;
    t.reads(0x1017, 0, default)?;
    forget(t)
}

/// Writes harmless communication parameters, and reads them back. Returns their addresses and former values.
pub(crate) fn changed_parameters(t: &mut Tester<'_>) -> Outcome<Vec<((u16, u8), u64)>> {
    let candidates = [
        (0x1006, 0, 10_000),
        (0x1007, 0, 1),
        (0x1015, 0, 100),
        (0x1017, 0, 1000),
        (0x1400, 2, 254),
        (0x1800, 2, 1),
        (0x1800, 5, 50),
    ];
    let mut changed = Vec::new();
    for (index, sub, value) in candidates {
        if t.entry(index, sub).is_ok_and(|entry| entry.access.writable()) && t.has_value(index, sub, value) {
            // The event timer may have to be at least as long as the inhibit time.
            if (index, sub) == (0x1800, 5) && t.entry(index, 3).is_ok() && t.read(index, 3)? > u64::from(value) * 10 {
                continue;
            }
            super::pdo_mapping::switch_off_of(t, index)?;
            changed.push(((index, sub), t.read(index, sub)?));
            t.write(index, sub, value)?;
            t.reads(index, sub, u64::from(value))?;
        }
    }
    if changed.is_empty() { Err(not_applicable("no communication parameter can be written")) } else { Ok(changed) }
}
