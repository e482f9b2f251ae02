//! `lexican machine export`.

use std::io::Write;
use std::path::PathBuf;

use lexican_toolbox::doc;

use super::file::{MachineArgs, sound};
use crate::output::{self, Failure, ForceArgs, Outcome, warn};

/// Write what other tools take of a machine into a folder
///
/// For each node a DCF (NAME.dcf, CiA 306-1) and a concise DCF (NAME.bin, 1F22h of CiA 302-3), which is by the rules of dcfgen: what
/// the data sheet says already is left out. Of all nodes their list (nodelist.cpj, CiA 306-3), a CAN database (machine.dbc) and names
/// for Wireshark (machine.lua); for people a page (machine.md), a picture (machine.svg), and both in one page with the data sheet of
/// each node as a boot configures it, to search in and to print (machine.html). Exit code 1 if two messages have the same COB-ID, of
/// which the database has the first.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    machine: MachineArgs,

    /// The folder, which is made if it is not there
    #[arg(long, value_name = "DIR")]
    folder: PathBuf,

    /// What to write; everything by default
    #[arg(long, value_enum, value_delimiter = ',')]
    format: Vec<Format>,

    #[command(flatten)]
    force: ForceArgs,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// A DCF for each node with a data sheet
    Dcf,
    /// A concise DCF for each node
    Concise,
    /// The list of nodes
    Cpj,
    /// A CAN database
    Dbc,
    /// A script for Wireshark
    Wireshark,
    /// A page about the machine
    Markdown,
    /// The same with the data sheets of all nodes
    Html,
    /// A picture of the network
    Svg,
}

const EXAMPLES: &str = "\
Examples:
    lexican machine export --folder line
    lexican machine export --folder dcf --format dcf,cpj";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let machine = sound(&args.machine.path()?)?;
    std::fs::create_dir_all(&args.folder).map_err(|error| Failure::file("make", &args.folder, &error))?;
    let wants = |format| args.format.is_empty() || args.format.contains(&format);
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut outcome = Outcome::Clean;
    for machine in machine.buses() {
        for node in &machine.nodes {
            let name = &node.name.value;
            if wants(Format::Dcf) {
                files.extend(machine.dcf(node).map(|dcf| (format!("{name}.dcf"), dcf.into_bytes())));
            }
            if wants(Format::Concise) {
                files.push((format!("{name}.bin"), machine.concise_dcf(node)));
            }
        }
        let bus = machine.bus.name.as_ref().map(|name| name.value.as_str());
        let stem = bus.unwrap_or("machine");
        if wants(Format::Dbc) {
            let database = machine.database();
            for name in &database.left_out {
                warn(format_args!("{name} is left out of {stem}.dbc: another message has its COB-ID"));
                outcome = Outcome::Found;
            }
            files.push((format!("{stem}.dbc"), database.to_bytes()));
        }
        if wants(Format::Wireshark) {
            files.push((format!("{stem}.lua"), machine.wireshark_script().into_bytes()));
        }
        if wants(Format::Markdown) {
            let picture = format!("{stem}.svg");
            let page = machine.page(doc::Format::Markdown, wants(Format::Svg).then_some(&picture));
            files.push((format!("{stem}.md"), page.into_bytes()));
        }
        if wants(Format::Html) {
            let page = machine.page(doc::Format::Html, Some(stem));
            files.push((format!("{stem}.html"), page.into_bytes()));
        }
        if wants(Format::Svg) {
            files.push((format!("{stem}.svg"), machine.picture().into_bytes()));
        }
    }
    if wants(Format::Cpj) {
        files.push(("nodelist.cpj".to_owned(), machine.node_list().into_bytes()));
    }
    for (name, content) in files {
        let path = args.folder.join(name);
        args.force.write(&path, &content)?;
        writeln!(output::stdout(), "{}", path.display())?;
    }
    Ok(outcome)
}
