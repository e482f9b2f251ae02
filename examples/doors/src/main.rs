//! One program moves the simulated AG02 through CANopen, its serial port and PROFIBUS.
//!
//! ```text
//! travel    the program, and for each interface the line that opens the link
//! plot      the positions that the program has read, as a picture
//! ```

mod plot;
mod travel;

use std::path::PathBuf;

use clap::Parser;
use lexican_runtime::host::MainError;

/// Move a simulated SIKO AG02 through each of its interfaces by the same program
#[derive(Parser)]
#[command(version)]
struct Args {
    /// Draw the positions that the program has read into this file, as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

fn main() -> Result<(), MainError> {
    let runs = travel::through_each_door()?;
    for run in &runs {
        println!("{}: {:?} after {:.3} s; {}", run.door, run.outcome, run.took_s(), run.traffic);
    }
    for run in &runs[1..] {
        let most = run.differences(&runs[0]).map(|(_, difference)| difference.abs()).fold(0.0, f64::max);
        println!("{}: at most {most:.0} increments from where the drive is through {}", run.door, runs[0].door);
    }
    if let Some(path) = Args::parse().plot {
        std::fs::write(path, plot::svg(&runs))?;
    }
    Ok(())
}
