//! `lexican check`: compares a device with its data sheet.

#[cfg(test)]
mod simulated;

use std::collections::BTreeMap;

use anstyle::{AnsiColor, Style};
use lexican_eds::model::{Device, Entry};
use lexican_eds::types::DataType;
use lexican_runtime::NodeId;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link, Pace};
use lexican_runtime::object::Address;
use serde_json::json;

use crate::bus::{Connected, Identity, NODE, NetworkArgs, node_id};
use crate::output::{Failure, Outcome, fields, print_result, progress, styled};
use lexican_toolbox::node::check::{Answer, Comparison, Finding, Kind, may_be_written_back, refused_write};
use lexican_toolbox::node::remote::{Refusal, RemoteNode};
use lexican_toolbox::parameters::order::in_order;
use lexican_toolbox::values::report::ValueReport;
use lexican_toolbox::values::wire::{fitting, parse_padded, written};
use lexican_toolbox::values::{DeviceValues, address};

/// Compare a device with its data sheet
///
/// Reads every entry of the data sheet, and checks that it exists, its length, access, limits and constant values,
/// and the identity of the device. Other values that are not the defaults are shown, too, but are no differences.
/// Nothing is written, unless --write is given. Exit code 1 if the device differs from its data sheet.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    #[command(flatten)]
    extent: Extent,

    /// Print one JSON object per line
    #[arg(long)]
    json: bool,

    #[arg(value_name = "NODE", value_parser = node_id, help = NODE)]
    node: Option<NodeId>,
}

#[derive(clap::Args, Clone, Copy, Debug, Default)]
struct Extent {
    /// Write back the value of every writable entry, to check its access
    ///
    /// PDOs are off meanwhile: each is switched off, its mapping cleared and written, and switched on again.
    /// Except for entries that command the device: 1003h, 1010h, 1011h, programs (1F50h, 1F51h), NMT (1F82h), 6040h.
    #[arg(long)]
    write: bool,

    /// Also read DOMAIN entries, which may be long
    #[arg(long)]
    domains: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican check --bus can0 5 --device FILE.eds
    lexican check --bus can0 5 --write --domains";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let Connected { mut network, id, device } = args.network.connect_as(Pace::Virtual, args.node, Identity::Any)?;
    let device = device.ok_or_else(|| {
        Failure::new("the data sheet of the device is unknown")
            .help("name it with --device FILE, or --device siko/ag03-1 for one that lexican knows")
    })?;
    let mut tally = Tally::default();
    inspect(&mut network, id, &device, args.extent, |report, findings| {
        tally.count(findings);
        findings.iter().try_for_each(|finding| print(args.json, id, report, finding))
    })?;
    tally.print(args.json, id)?;
    Ok(if tally.differ > 0 { Outcome::Found } else { Outcome::Clean })
}

/// Compares every entry of a node with its data sheet. `done` is called for each, mostly without findings.
fn inspect<L: Link>(
    network: &mut Network<L>,
    node: NodeId,
    device: &Device,
    extent: Extent,
    mut done: impl FnMut(&ValueReport, &[Finding]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut values = DeviceValues::new(device);
    let mut inspection = Inspection { node: RemoteNode::new(network, node), extent };
    let answers = inspection.read_all(&mut values)?;
    let comparison = Comparison { values: &values, node };
    let mut refused = if extent.write { inspection.write_back(device, &answers)? } else { BTreeMap::new() };
    for entry in device.entries() {
        let Some(answer) = answers.get(&address(entry)) else { continue };
        let mut findings = comparison.read(entry, answer);
        findings.extend(refused.remove(&address(entry)));
        let report = match answer {
            Answer::Value(data) => ValueReport::of_bytes(Some(&values), address(entry), data),
            _ => ValueReport::without_value(Some(&values), address(entry)),
        };
        done(&report, &findings)?;
    }
    Ok(())
}

struct Inspection<'a, L> {
    node: RemoteNode<'a, L>,
    extent: Extent,
}

impl<L: Link> Inspection<'_, L> {
    /// Reads all entries first, because meanings and limits depend on other entries.
    fn read_all(&mut self, values: &mut DeviceValues<'_>) -> Result<BTreeMap<Address, Answer>, Failure> {
        let entries: Vec<_> = values.device.entries().collect();
        let progress = progress("reading {msg} {wide_bar} {pos}/{len}", entries.len() as u64);
        let mut answers = BTreeMap::new();
        for entry in entries {
            progress.set_message(address(entry).to_string());
            progress.inc(1);
            let answer = self.read(entry)?;
            if let Answer::Value(data) = &answer
                && let Some(value) = parse_padded(entry.data_type, data)
            {
                values.set(address(entry), &value);
            }
            answers.insert(address(entry), answer);
        }
        progress.finish_and_clear();
        Ok(answers)
    }

    fn read(&mut self, entry: &Entry) -> Result<Answer, Failure> {
        if entry.data_type == DataType::Domain && !self.extent.domains {
            return Ok(Answer::NotRead("a DOMAIN is read with --domains only"));
        }
        Ok(self.node.read(address(entry))?.into())
    }

    /// Writes back all values, in the order that CiA 301 requires for PDOs; returns the refusals.
    fn write_back(
        &mut self,
        device: &Device,
        answers: &BTreeMap<Address, Answer>,
    ) -> Result<BTreeMap<Address, Finding>, Failure> {
        let values = device.entries().filter(|entry| may_be_written_back(device, entry)).filter_map(|entry| {
            let Some(Answer::Value(data)) = answers.get(&address(entry)) else { return None };
            Some((address(entry), written(Some(device), fitting(entry.data_type, data).to_vec())))
        });
        let mut refused = BTreeMap::new();
        for write in in_order(values) {
            let finding = match self.node.write(write.address, &write.data)? {
                Ok(()) => continue,
                Err(Refusal::Aborted(code)) => refused_write(code),
                Err(Refusal::Failed(text)) => Finding { kind: Kind::Failed, text },
            };
            // Some PDOs cannot be disabled, but accept their own value: only the final write counts.
            if write.is_final {
                refused.insert(write.address, finding);
            }
        }
        Ok(refused)
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    entries: usize,
    differ: usize,
    unchecked: usize,
    /// The number of values that are not the default.
    set: usize,
    /// The number of entries whose data sheet contradicts itself.
    sheet: usize,
}

impl Tally {
    fn count(&mut self, findings: &[Finding]) {
        let any = |is: &dyn Fn(Kind) -> bool| usize::from(findings.iter().any(|finding| is(finding.kind)));
        self.entries += 1;
        self.differ += any(&Kind::is_difference);
        self.unchecked += any(&|kind| kind == Kind::Unchecked);
        self.set += any(&|kind| kind == Kind::Default);
        self.sheet += any(&|kind| kind == Kind::Sheet);
    }

    fn print(self, as_json: bool, node: NodeId) -> Result<(), Failure> {
        let Tally { entries, differ, unchecked, set, sheet } = self;
        let verdict = match differ {
            0 => "as the data sheet says".to_owned(),
            1 => "1 is not as the data sheet says".to_owned(),
            many => format!("{many} are not as the data sheet says"),
        };
        let rest = [
            (set, "not at the default"),
            (unchecked, "could not be checked"),
            (sheet, "by which the data sheet contradicts itself"),
        ];
        let rest = rest.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("; {count} {what}"));
        let rest: String = rest.collect();
        let object = json!({
            "event": "summary", "node": node.get(), "entries": entries, "differ": differ, "unchecked": unchecked,
            "not_default": set, "sheet": sheet,
        });
        print_result(as_json, object, format_args!("node {node}: {entries} entries, {verdict}{rest}"))
    }
}

fn print(as_json: bool, node: NodeId, report: &ValueReport, finding: &Finding) -> Result<(), Failure> {
    let mut object = report.json();
    object.extend(fields(json!({
        "event": "finding",
        "node": node.get(),
        "kind": finding.kind.to_string(),
        "difference": finding.kind.is_difference(),
        "finding": finding.text,
    })));
    let style = if finding.kind.is_difference() { AnsiColor::Red.on_default() } else { Style::new().dimmed() };
    let kind = styled(style, format_args!("{:<9}", finding.kind));
    print_result(as_json, object, format_args!("{kind}  {}: {}", report.title(), finding.text))
}
