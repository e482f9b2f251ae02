//! `lexican check`: a device against its data sheet.

mod compare;
#[cfg(test)]
mod simulated;

use std::collections::BTreeMap;

use anstyle::{AnsiColor, Style};
use lexican_eds::model::{Device, Entry};
use lexican_eds::types::DataType;
use lexican_runtime::NodeId;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use serde_json::json;

use crate::bus::failure::access_failure;
use crate::bus::{Node, NodeArgs, network};
use crate::output::{Failure, Outcome, fields, progress, styled, tell};
use crate::values::Known;
use crate::values::told::Told;
use crate::values::wire::{fitting, parse};
use compare::{Answer, Comparison, Finding, Kind, address, may_be_written_back, written_back};

/// Check a device against its data sheet
///
/// Reads every entry that the data sheet describes, and compares: whether it is there, its length, whether it may be
/// read, its limits, constants, the identity. Nothing is written, unless --write asks for it. Exit code 1 when
/// the device is not as its data sheet says.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    node: NodeArgs,

    #[command(flatten)]
    extent: Extent,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

/// What is looked at beside the values of all entries.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
struct Extent {
    /// Write back the value of every entry that may be written, to see whether it is so
    ///
    /// Entries that command the device are left out: 1003h, 1010h, 1011h, programs, NMT by objects, 6040h.
    #[arg(long)]
    write: bool,

    /// Tell values that are not the defaults, too; they are no differences
    #[arg(long)]
    defaults: bool,

    /// Read DOMAIN entries, too, which may be long
    #[arg(long)]
    domains: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican check --bus can0 --node 5 --device FILE.eds
    lexican check --bus can0 --node 5 --write --defaults";

/// A node that leaves so many questions unanswered, one after the other, is not there any more.
const SILENCE: usize = 3;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let Node { link, id, device } = args.node.open()?;
    let device = device.ok_or_else(|| {
        Failure::new("nothing tells which data sheet the device should have")
            .help("name it with --device FILE, or --device siko/ag03-1 for one that lexican brings along")
    })?;
    let mut result = Tally::default();
    inspect(&mut network(link)?, id, &device, args.extent, |told, findings| {
        result.count(findings);
        findings.iter().try_for_each(|finding| print(args.json, id, told, finding))
    })?;
    result.print(args.json, id)?;
    Ok(if result.differ > 0 { Outcome::Found } else { Outcome::Clean })
}

/// Compares every entry of a node with its data sheet, and reports each, mostly without any finding.
fn inspect<L: Link>(
    network: &mut Network<L>,
    node: NodeId,
    device: &Device,
    extent: Extent,
    mut report: impl FnMut(&Told, &[Finding]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut known = Known::new(device);
    let mut inspection = Inspection { network, node, silent: 0, extent };
    let answers = inspection.read_all(&mut known)?;
    let comparison = Comparison { known: &known, node, defaults: extent.defaults };
    for entry in device.entries() {
        let Some(answer) = answers.get(&address(entry)) else { continue };
        let mut findings = comparison.read(entry, answer);
        if let Answer::Value(data) = answer
            && extent.write
            && may_be_written_back(entry)
        {
            findings.extend(inspection.write_back(entry, data)?);
        }
        report(&told(&known, entry, answer), &findings)?;
    }
    Ok(())
}

/// Somebody who asks a node for everything.
struct Inspection<'a, L> {
    network: &'a mut Network<L>,
    node: NodeId,
    /// How many questions in a row were not answered.
    silent: usize,
    extent: Extent,
}

impl<L: Link> Inspection<'_, L> {
    /// Reads all entries first: what one value means and may be depends on others.
    fn read_all(&mut self, known: &mut Known<'_>) -> Result<BTreeMap<Address, Answer>, Failure> {
        let entries: Vec<_> = known.device.entries().collect();
        let progress = progress("reading {msg} {wide_bar} {pos}/{len}", entries.len() as u64);
        let mut answers = BTreeMap::new();
        for entry in entries {
            progress.set_message(address(entry).to_string());
            progress.inc(1);
            let answer = self.read(entry)?;
            if let Answer::Value(data) = &answer
                && let Some(value) = parse(entry.data_type, fitting(entry.data_type, data))
            {
                known.learn(entry.index, entry.sub, &value);
            }
            answers.insert(address(entry), answer);
        }
        progress.finish_and_clear();
        Ok(answers)
    }

    fn read(&mut self, entry: &Entry) -> Result<Answer, Failure> {
        if entry.data_type == DataType::Domain && !self.extent.domains {
            return Ok(Answer::Unasked("a DOMAIN is read with --domains only"));
        }
        let result = self.network.read_bytes(self.node, address(entry));
        self.answer(result)
    }

    fn answer(&mut self, result: Result<Vec<u8>, AccessError>) -> Result<Answer, Failure> {
        let error = match result {
            Ok(data) => {
                self.silent = 0;
                return Ok(Answer::Value(data));
            }
            Err(error) => error,
        };
        let AccessError::Sdo { error: sdo, .. } = &error else { return Err(access_failure(&error)) };
        self.silent = if matches!(sdo, SdoError::TimedOut { .. }) { self.silent + 1 } else { 0 };
        match *sdo {
            SdoError::Aborted { code, .. } => Ok(Answer::Refused(code)),
            _ if self.silent >= SILENCE => Err(access_failure(&error)),
            SdoError::TimedOut { .. } => Ok(Answer::Failed("no answer".to_owned())),
            other => Ok(Answer::Failed(other.to_string())),
        }
    }

    fn write_back(&mut self, entry: &Entry, data: &[u8]) -> Result<Option<Finding>, Failure> {
        let data = fitting(entry.data_type, data);
        let result = self.network.write_bytes(self.node, address(entry), data).map(|()| Vec::new());
        Ok(match self.answer(result)? {
            Answer::Refused(code) => Some(written_back(code)),
            Answer::Failed(text) => Some(Finding { kind: Kind::Failed, text }),
            Answer::Value(_) | Answer::Unasked(_) => None,
        })
    }
}

/// What a check came to.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    entries: usize,
    differ: usize,
    unchecked: usize,
    /// What the data sheet contradicts itself in.
    sheet: usize,
}

impl Tally {
    fn count(&mut self, findings: &[Finding]) {
        let any = |is: &dyn Fn(Kind) -> bool| usize::from(findings.iter().any(|finding| is(finding.kind)));
        self.entries += 1;
        self.differ += any(&Kind::is_difference);
        self.unchecked += any(&|kind| kind == Kind::Unchecked);
        self.sheet += any(&|kind| kind == Kind::Sheet);
    }

    fn print(self, as_json: bool, node: NodeId) -> Result<(), Failure> {
        let Tally { entries, differ, unchecked, sheet } = self;
        let verdict = match differ {
            0 => "as the data sheet says".to_owned(),
            1 => "1 is not as the data sheet says".to_owned(),
            many => format!("{many} are not as the data sheet says"),
        };
        let rest = [(unchecked, "could not be checked"), (sheet, "by which the data sheet contradicts itself")];
        let rest = rest.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("; {count} {what}"));
        let rest: String = rest.collect();
        let object = json!({
            "event": "summary", "node": node.get(), "entries": entries, "differ": differ, "unchecked": unchecked,
            "sheet": sheet,
        });
        tell(as_json, fields(object), format_args!("node {node}: {entries} entries, {verdict}{rest}"))
    }
}

fn told(known: &Known<'_>, entry: &Entry, answer: &Answer) -> Told {
    match answer {
        Answer::Value(data) => Told::transferred(Some(known), address(entry), data),
        _ => Told::entry(Some(known), address(entry)),
    }
}

fn print(as_json: bool, node: NodeId, told: &Told, finding: &Finding) -> Result<(), Failure> {
    let mut object = told.json();
    object.extend(fields(json!({
        "event": "finding",
        "node": node.get(),
        "kind": finding.kind.name(),
        "difference": finding.kind.is_difference(),
        "finding": finding.text,
    })));
    let style = if finding.kind.is_difference() { AnsiColor::Red.on_default() } else { Style::new().dimmed() };
    let kind = styled(style, format_args!("{:<9}", finding.kind.name()));
    tell(as_json, object, format_args!("{kind}  {}: {}", told.title(), finding.text))
}
