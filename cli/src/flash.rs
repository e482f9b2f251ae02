//! `lexican flash`: downloads a program to a boot loader.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use lexican_runtime::NodeId;
use lexican_runtime::host::AccessError;
use lexican_toolbox::node::flash::{Cause, FlashError, Held, Loader, Progress, Stage, flash, held};
use serde_json::json;

use crate::bus::{Connected, NetworkArgs, node_id};
use crate::output::{Failure, Outcome, ctrl_c, note, print_result, progress, warn};
use lexican_toolbox::text::files::read_up_to;
use lexican_toolbox::text::toml_text::{TomlError, parse};

/// Transfer a program to a node, and start it (CiA 302-3)
///
/// The program is stopped, the flash cleared, the image written, checked and started, by 1F50h, 1F51h, 1F56h and 1F57h. A
/// download that fails says what the device holds; it cannot go on in the middle, so run the command again.
/// Exit code 1 if the device refuses or fails, 2 if it does not answer.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    network: NetworkArgs,

    /// How the boot loader deviates from CiA 302-3 (TOML); see below
    #[arg(long, value_name = "FILE")]
    loader: Option<PathBuf>,

    /// The number of the program, the sub-index of 1F50h; in place of that of the loader's file
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=254))]
    program: Option<u8>,

    /// Only say what the device holds
    #[arg(long, conflicts_with = "image")]
    status: bool,

    /// Print a JSON object
    #[arg(long)]
    json: bool,

    /// The node-ID: 1 to 127, or 0x1 to 0x7F
    #[arg(value_name = "NODE", value_parser = node_id)]
    node: NodeId,

    /// The image, as the boot loader takes it
    #[arg(value_name = "IMAGE", required_unless_present = "status")]
    image: Option<PathBuf>,
}

const EXAMPLES: &str = "\
A loader's file has what differs from CiA 302-3; these are the defaults:
    program = 1                 # the sub-index
    stop = 0                    # written to 1F51h before, clear = 3 and start = 1 as well
    boots_after_stop = false    # whether a boot-up message follows; boots_after_start as well
    device_type = 0x1234        # 1000h of the boot loader, if it differs from the program's (none)
    pre_operational = true      # whether the node is commanded PRE-OPERATIONAL first
    block = true                # block transfer, or segments
    flash_status = true         # whether there is 1F57h
    identification = \"any\"      # 1F56h after the download: any, none, crc32 (that of the image)
    patience_ms = 30000         # how long the device may be busy or silent
    poll_ms = 100               # how often 1F57h is read meanwhile
stop = false, clear = false or start = false leave a step out.

Examples:
    lexican flash --bus can0 5 firmware.bin
    lexican flash --bus can0 5 --loader bootloader.toml firmware.bin
    lexican flash --bus can0 5 --status";

/// More than the flash of any microcontroller.
const MAX_BYTES: usize = 256 << 20;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut loader = args.loader.as_deref().map_or_else(|| Ok(Loader::default()), load)?;
    loader.program = args.program.unwrap_or(loader.program);
    let image = args.image.as_deref().map(read).transpose()?;
    let Connected { mut network, id, .. } = args.network.connect(Some(args.node))?;
    let Some(image) = image else {
        let held = held(&mut network, id, &loader);
        let state = json!({ "node": id.get(), "held": word(held), "text": held.to_string() });
        print_result(args.json, state, held)?;
        return Ok(if matches!(held, Held::Unknown | Held::NoControl) { Outcome::Found } else { Outcome::Clean });
    };
    let bar = progress("{msg} {wide_bar} {bytes}/{total_bytes} {eta}", image.len() as u64);
    let interrupted = ctrl_c()?;
    let follow = |progress: Progress| {
        bar.set_message(progress.stage.to_string());
        bar.set_position(if progress.stage > Stage::Write { image.len() as u64 } else { progress.written.into() });
        if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let done = flash(&mut network, id, &loader, &image, follow);
    bar.finish_and_clear();
    match done {
        Ok(done) => {
            let (bytes, seconds) = (image.len(), done.duration.as_secs_f64());
            let number = |number: Option<u32>| number.map(|number| format!("{number:08X}"));
            let identification = number(done.after).map(|it| format!("; 1F56h is {it}h")).unwrap_or_default();
            let text = format!("node {id} holds the program: {bytes} bytes in {seconds:.1} s{identification}");
            let object = json!({ "node": id.get(), "bytes": bytes, "seconds": seconds, "before": number(done.before),
                "after": number(done.after) });
            print_result(args.json, object, text)?;
            Ok(Outcome::Clean)
        }
        Err(error) => failed(args.json, id.get(), &error),
    }
}

/// Reports a failed download, and what the device holds.
fn failed(as_json: bool, node: u8, error: &FlashError) -> Result<Outcome, Failure> {
    let is_lost = matches!(error.held, Held::Unknown | Held::NoControl);
    let help = match error.held {
        Held::Unknown => {
            "see that it has power, and run the command again; `lexican flash --status` says what it holds"
        }
        Held::NoControl => {
            "--program names another program, --loader what the boot loader has in place of 1F51h; if the device has \
             neither, its maker has a way of his own"
        }
        Held::Nothing => "run the command again: it begins anew",
        Held::Program { .. } => "nothing has been lost: mend the cause, and run the command again",
    };
    if as_json {
        let object = json!({ "node": node, "stage": error.stage.to_string(), "error": error.cause.to_string(),
            "held": word(error.held) });
        print_result(true, object, "")?;
    }
    if is_lost || matches!(error.cause, Cause::Access(AccessError::Link(_))) {
        return Err(Failure::new(error).help(help));
    }
    warn(error);
    note(help);
    Ok(Outcome::Found)
}

/// One word for programs.
const fn word(held: Held) -> &'static str {
    match held {
        Held::Unknown => "unknown",
        Held::NoControl => "unchanged",
        Held::Nothing => "nothing",
        Held::Program { runs: true, .. } => "running",
        Held::Program { runs: false, .. } => "stopped",
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let image = read_up_to(path, MAX_BYTES + 1)?;
    match image.len() {
        0 => Err(Failure::new(format_args!("{} is empty", path.display())).help("name the image of the program")),
        1..=MAX_BYTES => Ok(image),
        _ => Err(Failure::new(format_args!("{} is no image: it has more than 256 MiB", path.display()))),
    }
}

fn load(path: &Path) -> Result<Loader, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| Failure::file("read", path, &error))?;
    parse(&text).map_err(|TomlError { line, reason }| {
        Failure::new(format_args!("{}:{line}: {reason}", path.display())).help("`lexican flash --help` lists the keys")
    })
}
