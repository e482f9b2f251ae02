//! Moves the simulated AG02 through CANopen, its serial port and PROFIBUS, by the same lines but one, and draws what the
//! program has seen: `cargo run -p lexican-siko-profibus --features master --example three_doors [FILE.svg]`

#[path = "../../../siko-ag03-1/examples/motion_plots/chart.rs"]
#[allow(dead_code, reason = "other pictures need more")]
mod chart;
mod run;

use std::error::Error;
use std::path::PathBuf;

use chart::{BLUE, Content, Curve, GREEN, ORANGE, Panel, Picture};

fn main() -> Result<(), Box<dyn Error>> {
    let (profibus, traffic) = run::through_profibus()?;
    let runs = [run::through_canopen()?, run::through_serial()?, profibus];
    for run in &runs {
        let passes = run.passes(f64::from(run::TARGET) / 2.0).unwrap_or(f64::NAN);
        println!("{:>8}: {:?}, half way after {passes:.3} s, over after {}", run.door, run.outcome, run.took);
    }
    let run::Traffic { kbit_per_s, exchanges, lasted } = traffic;
    let each_ms = lasted.as_secs_f64() * 1000.0 / exchanges as f64;
    println!("PROFIBUS at {kbit_per_s} kbit/s: {exchanges} exchanges of data in {lasted}, one in {each_ms:.2} ms");
    let Some(path) = std::env::args_os().nth(1).map(PathBuf::from) else { return Ok(()) };
    let curves = runs.iter().zip([BLUE, ORANGE, GREEN]).enumerate().map(|(number, (run, color))| Curve {
        name: run.door.to_owned(),
        color,
        dashed: number > 0,
        points: run.seen.iter().map(|&(at_s, position)| (at_s, f64::from(position))).collect(),
    });
    let end = runs.iter().map(|run| run.took.as_secs_f64()).fold(0.0, f64::max);
    let picture = Picture {
        title: "One program, three doors".to_owned(),
        subtitle: "The simulated SIKO AG02 moves to 5000, as the program sees it".to_owned(),
        span_s: (0.0, end),
        panels: vec![Panel { title: "position", content: Content::Curves(curves.collect()) }],
        events: Vec::new(),
    };
    std::fs::write(&path, picture.svg())?;
    println!("{}", path.display());
    Ok(())
}
