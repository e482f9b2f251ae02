//! Backs up the parameters of a device as a DCF.

use std::collections::BTreeMap;

use lexican_eds::model::{Commissioning, Device, Entry, Value};
use lexican_eds::{Input, Source};
use lexican_runtime::cia301;
use lexican_runtime::object::Address;

use super::{Ended, LeftOut, LeftOuts, OnProgress, Parameters, read_entry, read_parameters};
use crate::node::remote::{Entries, Refusal};
use crate::values::{address, resolved};

/// The parameters that were read of a device.
#[derive(Clone, Debug)]
pub struct Backup {
    /// The data sheet with the values of the parameters, the identity and the node-ID.
    pub device: Device,
    /// The number of parameters in it.
    pub kept: usize,
    /// Parameters that could not be read, or that a DCF cannot hold.
    pub left_out: Vec<(Address, Refusal)>,
    /// The DOMAINs, for which the DCF names files.
    pub domains: BTreeMap<Address, Vec<u8>>,
    /// Entries that are no parameters, with the reason; among them DOMAINs if they were not to be read.
    pub no_parameters: LeftOuts,
}

/// Vendor-ID, product code, revision number and serial number (1018h).
pub type Identity = [Option<u32>; 4];

/// Reads the identity of a node; `None` for entries that it lacks.
pub fn read_identity<N: Entries>(node: &mut N) -> Result<Identity, Ended> {
    let mut identity = Identity::default();
    for (number, sub) in identity.iter_mut().zip(1..) {
        let data = node.read(Address::new(cia301::IDENTITY, sub))?.ok();
        *number = data.and_then(|data| <[u8; 4]>::try_from(data).ok()).map(u32::from_le_bytes);
    }
    Ok(identity)
}

/// Reads every parameter of a node by its data sheet; DOMAINs only if `domains` is set.
pub fn backup<N: Entries>(
    node: &mut N,
    sheet: &Device,
    domains: bool,
    progress: OnProgress<'_>,
) -> Result<Backup, Ended> {
    let [vendor, product, revision, serial] = read_identity(node)?;
    let mut found = read_parameters(node, sheet, progress)?;
    let parameters = Parameters::of_node(sheet, node.id(), &found.values);
    let mut no_parameters = parameters.rest(sheet.entries());
    found.values.retain(|address, _| !no_parameters.contains_key(address));
    found.refused.retain(|(address, _)| !no_parameters.contains_key(address));
    // An entry that cannot be read is left out, even if the data sheet is a DCF that gives it a value.
    for entry in sheet.entries().filter(|entry| !entry.access.readable()) {
        no_parameters.entry(address(entry)).or_insert(LeftOut::WriteOnly);
    }
    let mut domains_read = BTreeMap::new();
    let is_wanted = |entry: &&Entry| domains && parameters.left_out(entry) == Some(LeftOut::Domain);
    for entry in sheet.entries().filter(is_wanted).filter(|entry| entry.access.readable()) {
        no_parameters.remove(&address(entry));
        match read_entry(node, address(entry), progress)? {
            Ok(data) => drop(domains_read.insert(address(entry), data)),
            Err(refusal) => found.refused.push((address(entry), refusal)),
        }
    }
    let mut device = sheet.clone();
    let info = &mut device.info;
    info.vendor_number = vendor.or(info.vendor_number);
    info.product_number = product.or(info.product_number);
    info.revision_number = revision.or(info.revision_number);
    device.commissioning = Some(Commissioning {
        node_id: Some(node.id().get()),
        serial_number: serial,
        ..device.commissioning.take().unwrap_or_default()
    });
    for entry in entries(&mut device) {
        // A default with `$NODEID` is kept, so that it fits any node.
        let follows = entry.default.clone().filter(|default| matches!(default, Value::NodeIdPlus(_)));
        let value = found.values.get(&address(entry)).cloned();
        let follows = follows.filter(|default| value.as_ref() == Some(&resolved(default, node.id())));
        entry.configured = follows.or(value);
    }
    let mut left_out = found.refused;
    left_out.extend(drop_what_a_dcf_cannot_hold(&mut device));
    let kept = device.entries().filter(|entry| entry.configured.is_some()).count() + domains_read.len();
    Ok(Backup { device, kept, left_out, domains: domains_read, no_parameters })
}

impl Backup {
    /// Gives each DOMAIN of the DCF a file whose name begins with `stem` (`DownloadFile`, CiA 306), and returns names
    /// and contents.
    pub fn domain_files(&mut self, stem: &str) -> Vec<(String, Vec<u8>)> {
        let mut files = Vec::new();
        for entry in entries(&mut self.device) {
            if let Some(data) = self.domains.get(&address(entry)) {
                let name = format!("{stem}.{:04X}-{:02X}.bin", entry.index, entry.sub);
                entry.download_file = Some(name.clone());
                files.push((name, data.clone()));
            }
        }
        files
    }

    /// The text of the DCF.
    #[must_use]
    pub fn dcf(&self) -> String {
        lexican_eds::write::dcf(&self.device)
    }
}

fn entries(device: &mut Device) -> impl Iterator<Item = &mut Entry> {
    device.objects.iter_mut().flat_map(|object| &mut object.entries)
}

/// Removes values that writing and reading would change: texts with line breaks or with blanks at an end, empty texts,
/// and bytes of an unknown type.
fn drop_what_a_dcf_cannot_hold(device: &mut Device) -> Vec<(Address, Refusal)> {
    let text = lexican_eds::write::dcf(device);
    let again = lexican_eds::device(&Input::new(Source::new("backup.dcf", text.as_str())));
    let mut dropped = Vec::new();
    for entry in entries(device) {
        let same = again.entry(entry.index, entry.sub).is_some_and(|again| again.configured == entry.configured);
        if !same {
            entry.configured = None;
            dropped.push((address(entry), Refusal::Failed("a DCF cannot hold this value".to_owned())));
        }
    }
    dropped
}
