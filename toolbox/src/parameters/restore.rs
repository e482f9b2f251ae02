//! Writes parameters into a device in the required order, and reads each back.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use lexican_eds::model::{Device, Entry, Value};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{NodeId, cia301};

use super::order::{Write, in_order, switches};
use super::{Ended, LONGEST, LeftOut, LeftOuts, OnProgress, Parameters, Progress, read, read_entry, write_entry};
use crate::node::remote::{Entries, Refusal};
use crate::text::files::{ReadError, read_up_to};
use crate::values::wire::{encode, parse_padded, written};
use crate::values::{address, given, resolved};

/// Values by entry, in wire form.
pub type Settings = BTreeMap<Address, Vec<u8>>;

/// Options of a restore.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Only find out what differs; write nothing.
    pub dry_run: bool,
    /// Have the device store its parameters at the end (1010h:01).
    pub store: bool,
}

/// The result of a restore, complete or not.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The number of parameters that already had their value.
    pub equal: usize,
    /// Parameters that had another value, with that value if it could be read.
    pub differing: BTreeMap<Address, Option<Vec<u8>>>,
    /// Parameters that were written and read back, in this order.
    pub written: Vec<Address>,
    /// Parameters that were refused, or that read back with another value.
    pub refused: Vec<(Address, Refusal)>,
    /// The COB-ID entries of PDOs that were disabled and not enabled again.
    pub switched_off: Vec<Address>,
    /// Whether the device has stored its parameters.
    pub stored: bool,
}

/// The device differs in vendor or product from the one that the parameters are for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it is another device: its {what} is {got}, by the data sheet {expected}")]
pub struct OtherDevice {
    /// `vendor` or `product`.
    pub what: &'static str,
    /// In hexadecimal digits, or "none".
    pub got: String,
    /// From the data sheet, likewise, or "unknown".
    pub expected: String,
}

/// A number of the identity: from `[DeviceInfo]`, else from the entry of 1018h.
fn identity_of(device: &Device, sub: u8) -> Option<u32> {
    let number = if sub == 1 { device.info.vendor_number } else { device.info.product_number };
    let of_entry = || given(device.entry(cia301::IDENTITY, sub)?)?.as_integer();
    number.filter(|number| *number != 0).or_else(|| of_entry().and_then(|number| u32::try_from(number).ok()))
}

/// Whether the node has the vendor-ID and product code of a data sheet or backup; revision and serial number may
/// differ. Without a vendor-ID in the data sheet, or without an answer of the node, there is no contradiction.
pub fn check_identity<N: Entries>(node: &mut N, sheet: &Device) -> Result<Result<(), OtherDevice>, Ended> {
    if identity_of(sheet, 1).is_none_or(|vendor| vendor == 0) {
        return Ok(Ok(()));
    }
    for (sub, what) in [(1, "vendor"), (2, "product")] {
        let found = match node.read(Address::new(cia301::IDENTITY, sub))? {
            Ok(data) => <[u8; 4]>::try_from(data).ok().map(u32::from_le_bytes),
            Err(Refusal::Aborted(_)) => None,
            Err(Refusal::Failed(_)) => return Ok(Ok(())),
        };
        let has_entry = sheet.entry(cia301::IDENTITY, sub).is_some();
        // 0 means "not given".
        let expected = identity_of(sheet, sub).filter(|expected| has_entry && *expected != 0);
        let differs = found.zip(expected).is_some_and(|(found, expected)| found != expected);
        if differs || found.is_some() != has_entry {
            let text = |number: Option<u32>, other| number.map_or(other, |number| format!("{number:X}h"));
            let expected = text(expected, if has_entry { "unknown" } else { "none" }.to_owned());
            return Ok(Err(OtherDevice { what, got: text(found, "none".to_owned()), expected }));
        }
    }
    Ok(Ok(()))
}

/// The values of all parameters in a DCF, for a node; for the others see [`not_restored`].
#[must_use]
pub fn configured(device: &Device, node: NodeId) -> Settings {
    let data = |entry: &Entry| {
        let value = resolved(entry.configured.as_ref()?, node);
        Some((address(entry), encode(entry.data_type, &value)?))
    };
    Parameters::of_sheet(device, node).entries().filter_map(data).collect()
}

/// The entries with values in a DCF that are not restored, with the reason.
#[must_use]
pub fn not_restored(device: &Device, node: NodeId) -> LeftOuts {
    let mut left_out = Parameters::of_sheet(device, node)
        .rest(device.entries().filter(|entry| entry.configured.is_some() || entry.download_file.is_some()));
    left_out.retain(|_, reason| *reason != LeftOut::Domain);
    left_out
}

/// The contents of the files that a DCF names for DOMAINs (`DownloadFile`, CiA 306), by entry. Names are relative to
/// `folder`, that of the DCF.
pub fn domains(device: &Device, node: NodeId, folder: &Path) -> Result<Settings, ReadError> {
    let parameters = Parameters::of_sheet(device, node);
    let domains = device.entries().filter(|entry| parameters.left_out(entry) == Some(LeftOut::Domain));
    let files = domains.filter_map(|entry| Some((entry, entry.download_file.as_ref()?)));
    files.map(|(entry, file)| Ok((address(entry), read_up_to(&folder.join(file), LONGEST)?))).collect()
}

/// Writes the settings that differ in the node, and reads each back. To continue a restore that ended early, call it
/// again.
///
/// The node is set PRE-OPERATIONAL before the first write, and stays so. PDOs with any difference are disabled
/// meanwhile. Refused settings are tried again after the others, as long as any of them is accepted: limits may depend
/// on other parameters.
///
/// `outcome` is valid even if the restore ends early.
pub fn restore<N: Entries>(
    node: &mut N,
    sheet: &Device,
    settings: &Settings,
    options: Options,
    progress: OnProgress<'_>,
    outcome: &mut Outcome,
) -> Result<(), Ended> {
    node.has_restarted()?;
    let writes = differing(node, sheet, settings, progress, outcome)?;
    if options.dry_run {
        return Ok(());
    }
    if !writes.is_empty() {
        node.command(NmtCommand::EnterPreOperational)?;
    }
    write(node, sheet, writes, progress, outcome)?;
    // A node that has restarted has lost what was written, and must not store that.
    if node.has_restarted()? {
        return Err(Ended::Restarted);
    }
    if options.store && outcome.refused.is_empty() {
        store(node, progress, outcome)?;
    }
    Ok(())
}

/// The writes that are needed, in order.
fn differing<N: Entries>(
    node: &mut N,
    sheet: &Device,
    settings: &Settings,
    progress: OnProgress<'_>,
    outcome: &mut Outcome,
) -> Result<Vec<Write>, Ended> {
    let is_wanted = |entry: &&Entry| settings.contains_key(&address(entry)) && entry.access.readable();
    let present = read(node, sheet.entries().filter(is_wanted), progress)?;
    let of = |address: Address| {
        let entry = sheet.entry(address.index(), address.sub())?;
        encode(entry.data_type, present.values.get(&address)?)
    };
    for (&address, wanted) in settings {
        match of(address) {
            Some(present) if present == *wanted => outcome.equal += 1,
            present => {
                outcome.differing.insert(address, present);
            }
        }
    }
    let mut changes: Settings = settings.clone();
    changes.retain(|address, _| outcome.differing.contains_key(address));
    // To disable and enable PDOs, their current COB-ID and number of mapped objects are used unless they change.
    for switch in switches(changes.keys().copied().collect::<Vec<_>>()) {
        let Some(entry) = sheet.entry(switch.index(), switch.sub()).filter(|entry| entry.access.writable()) else {
            continue;
        };
        let wanted = match settings.get(&switch) {
            Some(wanted) => Some(wanted.clone()),
            None => node.read(address(entry))?.ok(),
        };
        changes.extend(wanted.map(|wanted| (switch, wanted)));
    }
    Ok(in_order(changes))
}

/// Writes, and tries again what was refused.
fn write<N: Entries>(
    node: &mut N,
    sheet: &Device,
    writes: Vec<Write>,
    progress: OnProgress<'_>,
    outcome: &mut Outcome,
) -> Result<(), Ended> {
    let of = writes.len();
    let mut left: VecDeque<_> = writes.into();
    let mut again: Vec<(Write, Refusal)> = Vec::new();
    let mut at = 0;
    // The number of writes accepted in this round.
    let mut taken = 0;
    loop {
        let Some(next) = left.pop_front() else {
            if again.is_empty() || taken == 0 {
                break;
            }
            taken = 0;
            left.extend(again.drain(..).map(|(write, _)| write));
            continue;
        };
        at = of.min(at + 1);
        if progress(Progress::Writing { address: next.address, at, of }).is_break() {
            outcome.refused.extend(again.into_iter().map(|(write, refusal)| (write.address, refusal)));
            return Err(Ended::Stopped);
        }
        let result = write_one(node, sheet, &next, progress).inspect_err(|_| {
            let refused = again.iter().map(|(write, refusal)| (write.address, refusal.clone()));
            outcome.refused.extend(refused);
        })?;
        match result {
            Ok(()) => {
                taken += 1;
                let is_switch = switches([next.address]).contains(&next.address) && next.address.sub() == 1;
                if is_switch {
                    outcome.switched_off.retain(|off| *off != next.address);
                }
                if is_switch && !next.is_final {
                    outcome.switched_off.push(next.address);
                }
                if let Some(before) = outcome.differing.get(&next.address).filter(|_| next.is_final) {
                    outcome.written.push(next.address);
                    // The next step notices if the callback stops the operation here.
                    let _ = progress(Progress::Written { address: next.address, before: before.as_deref() });
                }
            }
            // The final value shows whether this refusal matters.
            Err(_) if !next.is_final => {}
            Err(refusal) => again.push((next, refusal)),
        }
    }
    outcome.refused.extend(again.into_iter().map(|(write, refusal)| (write.address, refusal)));
    Ok(())
}

/// Writes an entry and reads it back.
fn write_one<N: Entries>(
    node: &mut N,
    sheet: &Device,
    write: &Write,
    progress: OnProgress<'_>,
) -> Result<Result<(), Refusal>, Ended> {
    let data = written(Some(sheet), write.data.clone());
    if let Err(refusal) = write_entry(node, write.address, &data, progress)? {
        return Ok(Err(refusal));
    }
    let entry = sheet.entry(write.address.index(), write.address.sub());
    let Some(entry) = entry.filter(|entry| write.is_final && entry.access.readable()) else { return Ok(Ok(())) };
    Ok(match read_entry(node, write.address, progress)? {
        Err(refusal) => Err(refusal),
        Ok(data) => {
            let value = parse_padded(entry.data_type, &data);
            let is_kept = value.as_ref().and_then(|value| encode(entry.data_type, value)).as_ref() == Some(&write.data);
            if is_kept { Ok(()) } else { Err(Refusal::Failed(not_kept(value.as_ref()))) }
        }
    })
}

fn not_kept(value: Option<&Value>) -> String {
    match value {
        Some(Value::Integer(number)) => format!("the device takes it, but has {number} when it is read back"),
        _ => "the device takes it, but has another value when it is read back".to_owned(),
    }
}

/// Has the device store all parameters (CiA 301, 7.5.2.13).
fn store<N: Entries>(node: &mut N, progress: OnProgress<'_>, outcome: &mut Outcome) -> Result<(), Ended> {
    const ALL: Address = Address::new(cia301::STORE_PARAMETERS, 1);
    if progress(Progress::Storing).is_break() {
        return Err(Ended::Stopped);
    }
    match node.write(ALL, b"save")? {
        Ok(()) => outcome.stored = true,
        Err(refusal) => outcome.refused.push((ALL, refusal)),
    }
    Ok(())
}
