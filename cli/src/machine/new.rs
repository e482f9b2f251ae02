//! `lexican machine new`: makes the file of an existing machine.

use std::io::Write;
use std::path::{Path, PathBuf};

use lexican_eds::Source;
use lexican_eds::convert::Format;
use lexican_eds::model::Device;
use lexican_machine::{BusYml, Cpj, Draft, Files, Found, Machine};
use lexican_runtime::cia301;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, BusUrl, Pace, Pump};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{CobId, Duration, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::node::identity::{is_of, recognise};
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::backup::backup;
use lexican_toolbox::parameters::restore::configured;
use lexican_toolbox::text::duration::milliseconds;
use lexican_toolbox::text::files::read;

use crate::bus::{BoxedLink, Bus, BusArgs, url};
use crate::output::{self, Failure, ForceArgs, Outcome, plural, warn};
use crate::parameters::Watch;
use crate::scan;

/// Write the file of a machine from what is there
///
/// From a bus: its nodes with their identities and data sheets, heartbeat and guarding, PDOs and parameters where these differ from
/// the data sheets. What a boot writes is what the nodes have. Set-points and what an RPDO writes are left out, as in a backup.
/// From a folder of DCFs or backups: the same of these. From a bus.yml of dcfgen (lely-core) or cogen (ros2_canopen): what these
/// tools make of it; what they drop, override or reorder without a word is said. From a CPJ (CiA 306-3): its networks and nodes, with
/// what their DCFs say.
///
/// Then the file is checked, as `lexican machine check` does it. Exit code 1 if anything is wrong with it.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A bus.yml, a CPJ, or a folder of DCFs
    #[arg(value_name = "FILE|DIR", conflicts_with = "bus")]
    source: Option<PathBuf>,

    /// The bus whose nodes are found
    #[arg(long, value_name = "URL", value_parser = url)]
    bus: Option<BusUrl>,

    /// A folder of EDS and DCF files, by which nodes are known beside those that lexican knows; may be given several times
    #[arg(long, value_name = "DIR")]
    sheets: Vec<PathBuf>,

    /// The file to write; stdout by default
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,

    #[command(flatten)]
    force: ForceArgs,

    /// How long each answer of a node may take
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = milliseconds)]
    timeout: Duration,
}

const EXAMPLES: &str = "\
Examples:
    lexican machine new --bus can0 -o machine.toml
    lexican machine new --bus can0 --sheets sheets -o machine.toml
    lexican machine new config/bus.yml -o machine.toml
    lexican machine new nodelist.cpj -o machine.toml
    lexican machine new backups -o machine.toml";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(path) = &args.output {
        args.force.guard(path, [])?;
    }
    // Paths in a machine are relative to its file.
    let folder = args.output.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let sheets = Sheets::read(&args.sheets, folder)?;
    let (draft, outcome) = match (&args.source, &args.bus) {
        (Some(source), _) if source.is_dir() => (of_folder(source, &sheets, folder)?, Outcome::Clean),
        (Some(source), _) if source.extension().is_some_and(|it| it.eq_ignore_ascii_case("cpj")) => {
            of_cpj(source, &sheets, folder)?
        }
        (Some(source), _) => of_bus_yml(source, folder)?,
        (None, Some(bus)) => (of_bus(bus, &sheets, args.timeout)?, Outcome::Clean),
        (None, None) => {
            return Err(
                Failure::new("from what?").help("name the bus, --bus can0, or a bus.yml, a CPJ, or a folder of DCFs")
            );
        }
    };
    let text = draft.text();
    let name = args.output.as_ref().map_or_else(|| "machine.toml".to_owned(), |path| path.display().to_string());
    match &args.output {
        Some(path) => args.force.write(path, text.as_bytes())?,
        None => write!(output::raw_stdout(), "{text}")?,
    }
    let Machine { findings, input, .. } = Machine::parse(Source::new(name, text), Files::Folder(folder));
    eprint!("{}", findings.render(&input));
    Ok(if findings.has_errors() { Outcome::Found } else { outcome })
}

/// A machine of the nodes on a bus.
fn of_bus(bus: &BusUrl, sheets: &Sheets, timeout: Duration) -> Result<Draft, Failure> {
    let Bus { mut link, simulation, .. } = BusArgs::named(bus.clone()).open(Pace::Virtual)?.settled()?;
    let of_url = || bus.get("bitrate")?.parse().ok();
    let bit_rate = simulation.as_ref().map(|it| it.bit_rate).or_else(of_url);
    let sync = sync(&mut link)?;
    let (nodes, mut network) = scan::nodes(link, timeout)?;
    if nodes.is_empty() {
        return Err(Failure::new("no node answers").help(output::NO_ANSWER));
    }
    let watch = Watch::new()?;
    let mut found = Vec::new();
    for (id, node) in nodes {
        for evidence in &node.evidence {
            warn(format_args!("are there two nodes {id}? {evidence}"));
        }
        let identity = [1, 2, 3, 4].map(|sub| node.identity(sub));
        let sheet = match sheets.find(identity) {
            Some((name, sheet)) => {
                let backup = backup(&mut RemoteNode::new(&mut network, id), sheet, false, &mut |step| watch.see(step))?;
                if !backup.left_out.is_empty() {
                    let count = plural(backup.left_out.len(), "parameter");
                    warn(format_args!("{count} of node {id} could not be read; `lexican backup` names them"));
                }
                Some((name, sheet.clone(), backup.device))
            }
            None => {
                warn(format_args!("no data sheet of node {id} is known; --sheets DIR may have it"));
                None
            }
        };
        found.push(Found::new(id, identity, sheet, heartbeat(&mut network, id)?));
    }
    Ok(Draft::on(&bus.to_string(), bit_rate, sync).with(&found))
}

/// A machine of the nodes whose DCFs are in a folder.
fn of_folder(source: &Path, sheets: &Sheets, folder: &Path) -> Result<Draft, Failure> {
    let mut found = Vec::new();
    for path in data_sheets(source)? {
        let (shown, device) = (path.display(), DataSheet::load(&path.to_string_lossy(), &[])?.device);
        let commissioning = device.commissioning.clone().unwrap_or_default();
        let Some(id) = commissioning.node_id.and_then(NodeId::new) else {
            warn(format_args!("{shown} is left out: it has no node-ID, [DeviceComissioning] NodeID"));
            continue;
        };
        if device.entries().any(|entry| entry.download_file.is_some()) {
            warn(format_args!("{shown} has DOMAINs, which are left out; `lexican restore` writes them"));
        }
        let (name, sheet) = sheets.of_dcf(&path, &device, folder);
        found.push(Found::of_dcf(id, device, name, sheet));
    }
    if found.is_empty() {
        return Err(Failure::new(format_args!("{} has no DCF of a node", source.display())));
    }
    found.sort_by_key(|node| node.id);
    Ok(Draft::default().with(&found))
}

/// A machine of the nodes in a CPJ; prints what is wrong with it.
fn of_cpj(source: &Path, sheets: &Sheets, folder: &Path) -> Result<(Draft, Outcome), Failure> {
    let files = Files::Folder(source.parent().unwrap_or(Path::new("")));
    let sheet = |path: &str, dcf: &Device| sheets.of_dcf(path.as_ref(), dcf, folder);
    let Cpj { draft, findings, input } = Cpj::read(read(source)?, files, &sheet);
    eprint!("{}", findings.render(&input));
    Ok((draft, if findings.has_errors() { Outcome::Found } else { Outcome::Clean }))
}

/// The machine that dcfgen or cogen makes of a bus.yml; prints what is wrong with it.
fn of_bus_yml(source: &Path, folder: &Path) -> Result<(Draft, Outcome), Failure> {
    let files = Files::Folder(source.parent().unwrap_or(Path::new("")));
    let name =
        |sheet: &str| if Path::new(sheet).is_file() { relative(sheet.as_ref(), folder) } else { sheet.to_owned() };
    let BusYml { draft, findings, input } = BusYml::read(read(source)?, files, &name);
    eprint!("{}", findings.render(&input));
    Ok((draft, if findings.has_errors() { Outcome::Found } else { Outcome::Clean }))
}

/// The period of SYNC; `None` if it is not received at least twice within two seconds.
fn sync(link: &mut BoxedLink) -> Result<Option<Duration>, Failure> {
    let (mut pump, until, mut seen) = (Pump::new(), link.now() + Duration::from_secs(2), Vec::new());
    while let Some(frame) = pump.receive_frame(link, until)? {
        if frame.id() == CobId::SYNC {
            seen.push(link.now());
        }
    }
    let span = seen.last().zip(seen.first()).map(|(last, first)| last.since(*first).as_micros());
    let periods = (seen.len() as u64).saturating_sub(1).max(1);
    Ok(span.map(|span| Duration::from_millis((span / periods + 500) / 1000)).filter(|period| !period.is_zero()))
}

/// The heartbeat period of a node in ms, 0 if it has none.
fn heartbeat(network: &mut Network<BoxedLink>, id: NodeId) -> Result<u16, Failure> {
    match network.read_bytes(id, Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0)) {
        Ok(data) => Ok(data.first_chunk().map_or(0, |bytes| u16::from_le_bytes(*bytes))),
        Err(AccessError::Sdo { error: SdoError::Aborted { .. }, .. }) => Ok(0),
        Err(error) => Err(error.into()),
    }
}

/// The data sheets that may match nodes, besides those of the library, with their names in the file.
struct Sheets(Vec<(String, DataSheet)>);

impl Sheets {
    fn read(folders: &[PathBuf], from: &Path) -> Result<Self, Failure> {
        let mut sheets = Vec::new();
        for folder in folders {
            for path in data_sheets(folder)? {
                match DataSheet::load(&path.to_string_lossy(), &[]) {
                    Ok(sheet) => sheets.push((relative(&path, from), sheet)),
                    Err(error) => warn(error),
                }
            }
        }
        Ok(Sheets(sheets))
    }

    /// The data sheet for the device of a DCF, with its name in the file: a known one, or else the DCF itself.
    fn of_dcf(&self, path: &Path, dcf: &Device, folder: &Path) -> (String, Device) {
        let info = &dcf.info;
        let known = self.find([info.vendor_number, info.product_number, info.revision_number, None]);
        // If a data sheet lacks entries that the DCF sets, it is for another version.
        let values = configured(dcf, NodeId::literal(1));
        let has_all = |sheet: &Device| values.keys().all(|it| sheet.entry(it.index(), it.sub()).is_some());
        match known.filter(|(_, sheet)| has_all(sheet)) {
            Some((name, sheet)) => (name, sheet.clone()),
            None => (relative(path, folder), dcf.clone()),
        }
    }

    /// The data sheet of a node. The same revision is preferred, and an EDS to a DCF.
    fn find(&self, [vendor, product, revision, _]: [Option<u32>; 4]) -> Option<(String, &Device)> {
        let vendor = vendor?;
        let of_file = self.0.iter().filter(|(_, sheet)| is_of(&sheet.device, vendor, product));
        let found = of_file.max_by_key(|(_, sheet)| {
            (sheet.device.info.revision_number == revision, sheet.device.commissioning.is_none())
        });
        let of_file = found.map(|(name, sheet)| (name.clone(), &sheet.device));
        of_file.or_else(|| recognise(vendor, product).map(|known| (known.id.to_owned(), &known.device)))
    }
}

/// The data sheets in a folder, sorted by name.
fn data_sheets(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed = |error| Failure::file("read", folder, &error);
    let entries: Result<Vec<_>, _> = std::fs::read_dir(folder).map_err(failed)?.collect();
    let is_sheet = |path: &PathBuf| Format::of(path).is_some();
    let mut files: Vec<_> = entries.map_err(failed)?.into_iter().map(|it| it.path()).filter(is_sheet).collect();
    files.sort();
    Ok(files)
}

/// A path as a file in `folder` names it: relative if the folder contains it, else absolute.
fn relative(path: &Path, folder: &Path) -> String {
    let whole = |folder: &Path| if folder.as_os_str().is_empty() { Path::new(".") } else { folder }.canonicalize().ok();
    // Resolve the folder only: a symbolic link stays a link.
    let here = path.parent().and_then(whole).zip(path.file_name()).map(|(parent, file)| parent.join(file));
    let found = here.zip(whole(folder)).map(|(path, folder)| path.strip_prefix(folder).unwrap_or(&path).to_owned());
    found.unwrap_or_else(|| path.to_owned()).display().to_string()
}
