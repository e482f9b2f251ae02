//! The same travel of the simulated AG02 through each of its interfaces, by the same program: what differs is the line
//! that opens the link. Draws `docs/doors.svg`.
//!
//! `cargo run -p lexican-siko-serial --example doors [FILE]`

#[allow(dead_code, reason = "not every picture has all of it")]
#[path = "../../../siko-ag03-1/examples/motion_plots/chart.rs"]
mod chart;
mod travel;

use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/doors.svg");
    let file = std::env::args_os().nth(1).map_or(file, PathBuf::from);
    let runs = travel::through_each_door()?;
    for run in &runs {
        println!("{}: {:?}, {} readings", run.door, run.outcome, run.positions.len());
    }
    let line = travel::line_of_a_travel()?;
    println!(
        "{}: {} telegrams, {} bytes, {:.2} s of the line in {:.2} s",
        line.baud, line.telegrams, line.bytes, line.busy_s, line.span_s
    );
    std::fs::write(&file, travel::picture(&runs).svg())?;
    println!("{}", file.display());
    Ok(())
}
