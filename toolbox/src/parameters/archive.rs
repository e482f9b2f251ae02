//! The parameters of a machine in one file, a tar archive with:
//!
//! - `backup.json`: date, identity of each node, what was left out and why, and the checksum of every other file;
//! - `NAME.dcf` for each node, with a file for each DOMAIN that it names (`DownloadFile`, CiA 306).

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Read};

use lexican_eds::model::Device;
use lexican_eds::{Input, Source};
use lexican_runtime::object::{Address, TimeOfDay};
use lexican_runtime::{NodeId, cia301};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::{Digest, Sha256};
use tar::{Builder, EntryType, Header};

use super::backup::{Identity, backup, read_identity};
use super::compare::{Comparison, Side, compare};
use super::restore::{Settings, configured};
use super::{Ended, OnProgress};
use crate::node::remote::Entries;
use crate::text::time_of_day;
use crate::values::report::ValueReport;
use crate::values::{DeviceValues, address};

/// The file extension.
pub const ENDING: &str = "tar";
/// The largest archive that is read, in bytes.
pub const LONGEST: usize = 1 << 30;

const MANIFEST: &str = "backup.json";
const FORMAT: u32 = 1;
/// The names of the versions, in the order of [`ArchivedNode::versions`].
pub const VERSIONS: [&str; 3] = ["device name", "hardware version", "software version"];

/// The parameters of a machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Archive {
    /// The name of the machine.
    pub machine: Option<String>,
    /// When they were read, in UTC.
    #[serde(serialize_with = "as_text", deserialize_with = "of_text")]
    pub made: TimeOfDay,
    /// The nodes that were read.
    pub nodes: Vec<ArchivedNode>,
    /// The nodes that were not read, by name, with the reason.
    pub unread: BTreeMap<String, String>,
}

/// The parameters of a node, and what it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArchivedNode {
    /// What it is called.
    pub name: String,
    /// Its node-ID.
    #[serde(serialize_with = "as_number", deserialize_with = "of_number")]
    pub node: NodeId,
    /// Vendor-ID, product code, revision number, serial number (1018h).
    pub identity: Identity,
    /// 1008h, 1009h and 100Ah.
    pub versions: [Option<String>; 3],
    /// Its DCF.
    #[serde(skip)]
    pub dcf: String,
    /// The contents of its DOMAINs.
    #[serde(skip)]
    pub domains: Settings,
    /// Entries that are no parameters, with the reason.
    pub left_out: BTreeMap<String, String>,
    /// Parameters that could not be read, with the reason.
    pub refused: BTreeMap<String, String>,
}

/// Why a file is not a valid archive.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the words of an error say what it is")]
pub enum ArchiveError {
    #[error("it is no backup of a machine: {0}")]
    Tar(#[from] io::Error),
    #[error("it is no backup of a machine: it has no {MANIFEST}")]
    NoManifest,
    #[error("its {MANIFEST} cannot be read: {0}")]
    Manifest(#[from] serde_json::Error),
    #[error("its format is {0}, and this program knows {FORMAT}")]
    Format(u32),
    #[error("it lacks {0}")]
    Missing(String),
    #[error("its {0} is not what was saved: the checksum differs")]
    Changed(String),
}

#[derive(Serialize, Deserialize)]
struct Manifest<'a> {
    format: u32,
    #[serde(flatten)]
    archive: Cow<'a, Archive>,
    /// Of each file, as `sha256sum` prints it.
    sha256: BTreeMap<String, String>,
}

impl Archive {
    /// The node of this name.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<&ArchivedNode> {
        self.nodes.iter().find(|node| node.name == name)
    }

    /// Reads a node into the archive. If the node is gone, it is noted as unread.
    pub fn take<N: Entries>(
        &mut self,
        node: &mut N,
        name: &str,
        sheet: &Device,
        progress: OnProgress<'_>,
    ) -> Result<(), Ended> {
        match ArchivedNode::take(node, name, sheet, progress) {
            Ok(node) => self.nodes.push(node),
            Err(Ended::Lost(error)) => drop(self.unread.insert(name.to_owned(), error.to_string())),
            Err(ended) => return Err(ended),
        }
        Ok(())
    }

    /// What the archive should hold but does not, one sentence each.
    pub fn missing(&self) -> impl Iterator<Item = String> {
        let refused = |node: &ArchivedNode| {
            let sentence = |(address, why)| format!("{}: {address}: {why}", node.name);
            node.refused.iter().map(sentence).collect::<Vec<_>>()
        };
        let unread = self.unread.iter().map(|(name, why)| format!("{name}: {why}"));
        self.nodes.iter().flat_map(refused).chain(unread)
    }

    /// The bytes of the file. Errors: a name is not valid for a file.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let mut files = BTreeMap::new();
        for node in &self.nodes {
            let device = node.device(&[]);
            let domains = node.domains.iter().filter_map(|(address, data)| {
                let named = device.entry(address.index(), address.sub())?.download_file.clone()?;
                Some((named, data.as_slice()))
            });
            files.extend(domains);
            files.insert(node.file(), node.dcf.as_bytes());
        }
        let sha256 = files.iter().map(|(name, data)| (name.clone(), checksum(data))).collect();
        let manifest = Manifest { format: FORMAT, archive: Cow::Borrowed(self), sha256 };
        let manifest = serde_json::to_vec_pretty(&manifest).expect("texts and numbers are JSON");
        let mut tar = Builder::new(Vec::new());
        for (name, data) in [(MANIFEST.to_owned(), manifest.as_slice())].into_iter().chain(files) {
            let mut header = Header::new_gnu();
            header.set_size(data.len() as u64);
            header.set_mode(0o644);
            header.set_mtime(time_of_day::to_unix(self.made) / 1000);
            tar.append_data(&mut header, name, data)?;
        }
        tar.into_inner()
    }

    /// Reads an archive, and checks each file by its checksum.
    pub fn read(bytes: &[u8]) -> Result<Self, ArchiveError> {
        let mut files = BTreeMap::new();
        let mut tar = tar::Archive::new(bytes);
        for entry in tar.entries()? {
            let mut entry = entry?;
            // Archives have regular files only, and other types may expand beyond the size of the archive.
            if entry.header().entry_type() == EntryType::Regular {
                let name = entry.path()?.to_string_lossy().into_owned();
                let mut data = Vec::new();
                entry.read_to_end(&mut data)?;
                files.insert(name, data);
            }
        }
        let manifest = files.get(MANIFEST).ok_or(ArchiveError::NoManifest)?;
        let Manifest { format, archive, sha256 } = serde_json::from_slice(manifest)?;
        if format != FORMAT {
            return Err(ArchiveError::Format(format));
        }
        let file = |name: &str| match (files.get(name), sha256.get(name)) {
            (Some(data), Some(sum)) if checksum(data) == *sum => Ok(data.clone()),
            (Some(_), Some(_)) => Err(ArchiveError::Changed(name.to_owned())),
            _ => Err(ArchiveError::Missing(name.to_owned())),
        };
        let mut archive = archive.into_owned();
        for node in &mut archive.nodes {
            node.dcf = String::from_utf8_lossy(&file(&node.file())?).into_owned();
            let device = node.device(&[]);
            let named = device.entries().filter_map(|it| Some((address(it), it.download_file.as_ref()?)));
            let domains = named.map(|(address, name)| Ok((address, file(name)?)));
            node.domains = domains.collect::<Result<_, ArchiveError>>()?;
        }
        Ok(archive)
    }
}

impl ArchivedNode {
    /// Reads all parameters of a node, DOMAINs included, and its identity.
    pub fn take<N: Entries>(node: &mut N, name: &str, sheet: &Device, progress: OnProgress<'_>) -> Result<Self, Ended> {
        let (identity, versions) = (read_identity(node)?, read_versions(node, sheet)?);
        let mut backup = backup(node, sheet, true, progress)?;
        drop(backup.domain_files(&stem(name)));
        let left_out = backup.no_parameters.iter().map(|(address, why)| (address.to_string(), why.words(1).to_owned()));
        let refused = backup.left_out.iter().map(|(address, why)| (address.to_string(), why.to_string()));
        Ok(ArchivedNode {
            name: name.to_owned(),
            node: node.id(),
            identity,
            versions,
            dcf: backup.dcf(),
            left_out: left_out.collect(),
            refused: refused.collect(),
            domains: backup.domains,
        })
    }

    fn file(&self) -> String {
        format!("{}.dcf", stem(&self.name))
    }

    /// The device in its DCF, with the overlays applied.
    #[must_use]
    pub fn device(&self, overlays: &[Source]) -> Device {
        let input = Input::new(Source::new(self.file(), self.dcf.as_str()));
        lexican_eds::device(&overlays.iter().cloned().fold(input, Input::overlay))
    }

    /// Everything to write to a device that replaces it.
    #[must_use]
    pub fn settings(&self) -> Settings {
        let mut settings = configured(&self.device(&[]), self.node);
        settings.extend(self.domains.clone());
        settings
    }

    /// Compares the parameters with those of another node; returns the addresses of DOMAINs that differ as well.
    #[must_use]
    pub fn compare(&self, other: &ArchivedNode, overlays: &[Source]) -> (Comparison, Vec<Address>) {
        let side = |node: &ArchivedNode| Side::of_sheet(node.device(overlays), node.node);
        let all = self.domains.keys().chain(other.domains.keys());
        let mut domains: Vec<_> = all.filter(|it| self.domains.get(it) != other.domains.get(it)).copied().collect();
        domains.sort();
        domains.dedup();
        (compare(&side(self), &side(other)), domains)
    }

    /// Revision and versions of another device that differ from this one.
    #[must_use]
    pub fn other_versions(&self, identity: &Identity, versions: &[Option<String>; 3]) -> Vec<String> {
        let revision = |identity: &Identity| identity[2].map(|revision| format!("{revision:X}h"));
        let versions = VERSIONS.into_iter().zip(self.versions.iter().cloned().zip(versions.iter().cloned()));
        let all = versions.chain([("revision", (revision(&self.identity), revision(identity)))]);
        let text = |value: Option<String>| value.unwrap_or_else(|| "none".to_owned());
        all.filter(|(_, (one, other))| one != other)
            .map(|(what, (one, other))| format!("{what} {}, and not {}", text(other), text(one)))
            .collect()
    }
}

/// The versions of a node that its data sheet has, in the order of [`VERSIONS`].
pub fn read_versions<N: Entries>(node: &mut N, sheet: &Device) -> Result<[Option<String>; 3], Ended> {
    let values = DeviceValues::new(sheet);
    let mut versions = [const { None }; 3];
    for (version, index) in versions.iter_mut().zip(cia301::MANUFACTURER_DEVICE_NAME..) {
        let address = Address::new(index, 0);
        if values.entry(address).is_some() {
            let data = node.read(address)?.ok();
            *version = data.map(|data| ValueReport::of_bytes(Some(&values), address, &data).text().to_owned());
        }
    }
    Ok(versions)
}

/// The prefix of the names of its files.
fn stem(name: &str) -> String {
    name.replace(['/', '\\'], "_")
}

fn as_text<S: Serializer>(time: &TimeOfDay, serializer: S) -> Result<S::Ok, S::Error> {
    time_of_day::text(*time).serialize(serializer)
}

fn of_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<TimeOfDay, D::Error> {
    Ok(time_of_day::parse(&String::deserialize(deserializer)?).unwrap_or_default())
}

fn as_number<S: Serializer>(node: &NodeId, serializer: S) -> Result<S::Ok, S::Error> {
    node.get().serialize(serializer)
}

fn of_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
    NodeId::new(u8::deserialize(deserializer)?).ok_or_else(|| D::Error::custom("a node-ID is 1 to 127"))
}

fn checksum(data: &[u8]) -> String {
    Sha256::digest(data).iter().map(|byte| format!("{byte:02x}")).collect()
}
