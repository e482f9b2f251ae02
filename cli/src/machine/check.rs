//! `lexican machine check`.

use std::io::Write;

use lexican_eds::Severity;
use lexican_machine::Machine;
use serde_json::json;

use super::file::MachineArgs;
use crate::eds::lint::Format;
use crate::output::{self, Failure, Outcome, colours, plural};

/// Check a machine: its file, and what cannot work together
///
/// Keys and values, data sheets, parameters and their limits, wires and the types at both ends, COB-IDs that two send,
/// error control and the protection of drives, the load of the bus in the worst case. Exit code 1 if anything is wrong.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    machine: MachineArgs,

    /// How to print the findings
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,

    /// Print one JSON document
    #[arg(long, conflicts_with = "format")]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican machine check
    lexican machine check line/machine.toml --format sarif > findings.sarif";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let machine = args.machine.read()?;
    let Machine { findings, input, .. } = &*machine;
    let mut stdout = output::raw_stdout();
    let counts = [Severity::Error, Severity::Warning, Severity::Note].map(|severity| findings.count(severity));
    if args.json {
        let bus = |machine: &Machine| {
            let load = machine.load().map(|load| {
                json!({
                    "percent": load.percent,
                    "sync_chain_us": load.sync_chain.as_micros(),
                    "at_any_time": load.unbounded,
                })
            });
            let name = machine.bus.name.as_ref().map(|name| &name.value);
            json!({ "bus": name, "nodes": machine.nodes.len(), "load": load })
        };
        let document = json!({
            "machine": machine.name,
            "buses": machine.buses().map(bus).collect::<Vec<_>>(),
            "findings": findings.to_json(input),
        });
        writeln!(stdout, "{document:#}")?;
    } else {
        match args.format {
            Format::Text if colours() => write!(stdout, "{}", findings.render_styled(input))?,
            Format::Text => write!(stdout, "{}", findings.render(input))?,
            Format::Short => findings.iter().try_for_each(|it| writeln!(stdout, "{}", it.render_short(input)))?,
            Format::Sarif | Format::Json => writeln!(stdout, "{:#}", findings.to_sarif(input))?,
        }
        if args.format != Format::Sarif {
            machine.buses().try_for_each(|machine| print_bus(&mut stdout, machine))?;
            let [errors, warnings, notes] = counts;
            let [errors, warnings, notes] =
                [(errors, "error"), (warnings, "warning"), (notes, "note")].map(|(count, what)| plural(count, what));
            writeln!(stdout, "{errors}, {warnings}, {notes}")?;
        }
    }
    stdout.flush()?;
    Ok(if counts[0] > 0 { Outcome::Found } else { Outcome::Clean })
}

/// The most messages without a known period that are named.
const NAMED: usize = 8;

/// Prints what is on a bus, and its load.
fn print_bus(stdout: &mut impl Write, machine: &Machine) -> std::io::Result<()> {
    if let Some(name) = &machine.bus.name {
        write!(stdout, "{}: ", name.value)?;
    }
    let pdos: usize = machine.nodes.iter().map(|node| node.pdos.len()).sum();
    write!(stdout, "{}, {} configured", plural(machine.nodes.len(), "node"), plural(pdos, "PDO"))?;
    match machine.load() {
        Some(load) => {
            write!(stdout, ", the bus is busy for {:.1} % in the worst case", load.percent)?;
            if !load.unbounded.is_empty() {
                let (shown, more) = load.unbounded.split_at(load.unbounded.len().min(NAMED));
                write!(stdout, ", but for what may come at any time: {}", shown.join(", "))?;
                if !more.is_empty() {
                    write!(stdout, " and {} more", more.len())?;
                }
            }
        }
        None => write!(stdout, "; how busy the bus is depends on its bit-rate, which is not given")?,
    }
    writeln!(stdout)
}
