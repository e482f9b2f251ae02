//! A format change-over: the drives of a machine move to the positions of a recipe, together.
//!
//! ```text
//! recipe      which drive goes where, in mm and degrees; the machine says what these are
//!   bus       a real bus, or a simulated one
//!   run       all drives: connect, check, enable, release by SYNC, travel, disable
//!     axis    one of them; stop: what ends all of them
//!   progress  while it runs
//!   report    the result; plot: the same as a picture
//! ```

mod axis;
mod bus;
mod plot;
mod progress;
mod recipe;
mod report;
mod run;
mod stop;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use lexican_machine::tokio::Machine;
use lexican_runtime::host::BusUrl;

use bus::{Fault, Pace};
use recipe::Recipe;
use report::{Format, Report};
use run::Run;
use stop::{Reason, Stop};

/// Move the drives of a machine to the positions of a recipe, together
///
/// Exits with 0 if every drive is where the recipe has it, with 1 if one is not, and with 2 if nothing has moved because
/// something was wrong before.
#[derive(Parser)]
#[command(version)]
struct Args {
    /// The recipe
    recipe: PathBuf,

    /// The bus: can0, or slcan:/dev/ttyACM0?bitrate=500000. Without it, all drives are simulated
    #[arg(long, value_name = "URL")]
    bus: Option<BusUrl>,

    /// Check the recipe against the drives, print what would be done, and move nothing
    #[arg(long)]
    dry_run: bool,

    /// How to print the report
    #[arg(long, value_enum, default_value_t)]
    format: Format,

    /// Draw the positions of all drives over time into this file, as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// How fast the time of simulated drives passes
    #[arg(long, value_enum, default_value_t, conflicts_with = "bus")]
    pace: Pace,

    /// Simulate an AG02 at its serial port and an AG03/1 on PROFIBUS, behind gateways
    #[arg(long, conflicts_with_all = ["bus", "fault"])]
    doors: bool,

    /// Let a simulated drive fail, so many seconds after the program has begun: 7@2.5
    #[arg(long, value_name = "NODE@SECONDS", conflicts_with = "bus")]
    fault: Option<Fault>,
}

fn main() -> ExitCode {
    match changeover(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

/// Whether all drives have reached the positions of the recipe; an error if nothing has moved.
fn changeover(args: &Args) -> Result<bool, String> {
    let (recipe, machine) = Recipe::read(&args.recipe)?;
    let link = match &args.bus {
        Some(url) => url.open().map_err(|error| format!("cannot open {url}: {error}"))?,
        None => bus::simulated(&machine, args.pace, args.fault, args.doors)?,
    };
    let stop = Stop::default();
    let signal = stop.clone();
    // Called for SIGINT and SIGTERM.
    ctrlc::set_handler(move || signal.order(Reason::Signal)).map_err(|error| error.to_string())?;
    // A single thread, because simulated time passes when all tasks wait.
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|error| error.to_string())?;
    let report = runtime.block_on(async {
        let machine = Machine::over(vec![link], machine).map_err(|error| error.to_string())?;
        let mut run = Run::connect(machine, &recipe, stop).await?;
        if !args.dry_run {
            run.change_over().await;
        }
        Ok::<Report, String>(Report::of(&run))
    })?;
    print!("{}", report.print(args.format));
    if let Some(path) = &args.plot {
        std::fs::write(path, plot::svg(&report))
            .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    }
    Ok(report.is_done())
}
