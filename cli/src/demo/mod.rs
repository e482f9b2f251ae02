//! `lexican demo`: the two worked examples in the manual of the AG03/1.

mod play;
mod stage;

use std::io::Write;
use std::path::PathBuf;

use anstyle::AnsiColor;
use indicatif::ProgressBar;
use lexican_runtime::host::Pace;
use lexican_runtime::host::candump::Line;
use lexican_toolbox::data_sheet::DataSheet;
use siko_ag03_1::worked_examples::{Example, POSITIONING, VELOCITY};

use crate::output::{Failure, ForceArgs, Outcome, progress, stdout, styled};
use play::Check;
use stage::Stage;

/// Run the two worked examples of the SIKO AG03/1's manual against a simulated drive
///
/// Sends every frame of the manual's tables 25 (positioning) and 26 (velocity) over a bus inside the process, and
/// prints all frames of the bus, decoded. The run checks itself: exit code 1 if anything differs from the manual.
/// Writes demo.svg (the motion as a picture) and demo.log (all frames, in the format of candump -L).
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Run in real time instead of as fast as possible
    #[arg(long)]
    realtime: bool,

    /// The folder of demo.svg and demo.log
    #[arg(long, value_name = "DIR", default_value = ".")]
    folder: PathBuf,

    #[command(flatten)]
    force: ForceArgs,
}

/// The data sheet for decoding frames.
const DEVICE: &str = "siko/ag03-1";
const EXAMPLES: [&Example; 2] = [&POSITIONING, &VELOCITY];
/// The interface to which `canplayer -I demo.log` sends.
const INTERFACE: &str = "vcan0";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    std::fs::create_dir_all(&args.folder).map_err(|error| Failure::file("create", &args.folder, &error))?;
    let device = DataSheet::load(DEVICE, &[])?.device;
    let rows = EXAMPLES.iter().map(|example| example.rows.len() as u64).sum();
    let (progress, pace) = match args.realtime {
        true => (progress("{bar:12.cyan/dim} {pos:>2}/{len}  {wide_msg}", rows), Pace::RealTime),
        false => (ProgressBar::hidden(), Pace::Virtual),
    };
    let mut stage = Stage::new(&device, progress, pace);
    let played = play::all(&mut stage, &EXAMPLES);
    stage.progress.finish_and_clear();
    let (checks, pictures) = played?;
    stage.heading("Checks")?;
    let mut stdout = stdout();
    let width = checks.iter().map(|check| check.what.chars().count()).max().unwrap_or(0);
    for Check { what, seen, passed } in &checks {
        let verdict = match passed {
            true => styled(AnsiColor::Green.on_default().bold(), "    ok"),
            false => styled(AnsiColor::Red.on_default().bold(), "FAILED"),
        };
        writeln!(stdout, "{verdict}  {what:<width$}  {seen}")?;
    }
    stdout.flush()?;
    let line = |&(at, frame)| Line { at, interface: INTERFACE.to_owned(), frame }.to_string() + "\n";
    let log: String = stage.frames.iter().map(line).collect();
    args.force.write(&args.folder.join("demo.svg"), lexican_pictures::svg(&pictures).as_bytes())?;
    args.force.write(&args.folder.join("demo.log"), log.as_bytes())?;
    Ok(if checks.iter().all(|check| check.passed) { Outcome::Clean } else { Outcome::Found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::kept;
    use lexican_runtime::host::{Fate, VirtualBus};

    /// The checks that fail when the bus is tampered with.
    fn failures(tamper: impl FnOnce(&VirtualBus)) -> Vec<String> {
        let device = DataSheet::load(DEVICE, &[]).unwrap().device;
        let mut stage = Stage::new(&device, ProgressBar::hidden(), Pace::Virtual);
        tamper(&stage.bus);
        let (checks, _) = kept(|| play::all(&mut stage, &EXAMPLES)).0.unwrap();
        checks.into_iter().filter(|check| !check.passed).map(|check| check.what).collect()
    }

    /// Makes the bus lose the n-th frame with this identifier.
    fn lose(id: u32, n: u32) -> impl FnOnce(&VirtualBus) {
        move |bus: &VirtualBus| {
            let mut seen = 0;
            bus.set_fate(move |_, frame| {
                seen += u32::from(frame.id().raw() == id && !frame.is_remote());
                if frame.id().raw() == id && seen == n && !frame.is_remote() { Fate::Lose } else { Fate::Deliver }
            });
        }
    }

    #[test]
    fn an_undisturbed_run_fails_no_check() {
        assert_eq!(failures(|_| {}), Vec::<String>::new());
    }

    #[test]
    fn a_lost_command_fails_the_checks_that_depend_on_it() {
        let failed = failures(lose(0x405, 1));
        assert!(failed.contains(&"table 25: position +5000 increments reached".to_owned()), "{failed:?}");
        let failed = failures(lose(0x405, 2));
        assert!(failed.contains(&"table 25: position -5000 increments reached".to_owned()), "{failed:?}");
        let failed = failures(lose(0x505, 2));
        assert!(failed.contains(&"table 26: velocity +30 rev/min reached".to_owned()), "{failed:?}");
        // The last command.
        let failed = failures(lose(0x000, 4));
        assert!(failed.contains(&"table 26: node ends in PRE-OPERATIONAL".to_owned()), "{failed:?}");
    }

    #[test]
    fn every_lost_command_fails_a_check() {
        for (id, frames) in [(0x000, 4), (0x205, 17), (0x405, 2), (0x505, 3)] {
            for n in 1..=frames {
                assert!(!failures(lose(id, n)).is_empty(), "frame {n} of {id:03X}");
            }
        }
    }
}
