//! Developer tasks: everything that CI does, callable one by one.
//!
//! A task that fails says what to do about it, and the process exits with 1.

mod api;
mod bench;
mod chaos;
mod checkout;
mod ci;
mod command;
mod conform;
mod corpus;
mod disk;
mod firmware;
mod fuzz;
mod interop;
mod outside;
mod package;
mod page;
mod proved;
mod python;
mod qemu;
mod report;
mod size;
mod tidy;
mod vcan;
mod verify;
mod wheel;
mod workspace;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Developer tasks of lexican", disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run what CI runs, or one job of it
    Ci {
        /// The job; when none is named, all of them, in order, but for those that have passed with these sources
        job: Option<ci::Job>,
        /// Run all of them
        #[arg(long, conflicts_with = "job")]
        all: bool,
    },
    /// Check the habits that no compiler checks: arrows between crates, names, sizes of files, subjects of commits; and
    /// say what has grown since its size was recorded
    Tidy {
        /// Write the sizes into ARCHITECTURE.md
        #[arg(long)]
        record: bool,
    },
    /// Write the public API of every library anew: review the difference before you commit it
    Api {
        /// Only check that the files are right
        #[arg(long)]
        check: bool,
    },
    /// Measure, side by side with our peers
    Bench(bench::Bench),
    /// Write the expected files of all golden tests and the public API anew; review the difference before you commit it
    Bless,
    /// Simulate every data sheet below a folder, then generate from each, and compile and lint all of it
    Corpus {
        /// The folder; its files stay where they are
        folder: PathBuf,
        /// Only simulate
        #[arg(long)]
        simulate: bool,
    },
    /// Measure what a device takes on a microcontroller, and what generated code costs: the compiler's time, lines,
    /// the instructions of one write
    Size {
        /// Only check what no machine changes: no times
        #[arg(long)]
        check: bool,
        /// Only the device
        #[arg(long)]
        device: bool,
    },
    /// Fuzz what reads untrusted input with libFuzzer, and look for broken promises
    Fuzz(fuzz::Arguments),
    /// Build the firmware, boot it in QEMU, and hold the command's tools against it
    Firmware(firmware::Arguments),
    /// Run lexican against python-canopen, both ways, over slcan and vcan, and write the tables of results
    Interop {
        /// Only check that the tables are right, but for what is measured
        #[arg(long)]
        check: bool,
    },
    /// Test devices of many kinds with `lexican conform`, and write the page of what it says of them
    Conform {
        /// Only test those that are simulated, and check that the page is right
        #[arg(long)]
        check: bool,
    },
    /// Compare drives with every table of their manuals, and write each drive's report
    Verify {
        /// The drive, such as siko/ag03-1; all of them when none is named
        drive: Option<String>,
        /// Only check that the report is right
        #[arg(long)]
        check: bool,
    },
    /// Make the bench's page anew from its sources: bench/page/dist
    Page {
        /// Only check that it is right
        #[arg(long)]
        check: bool,
    },
    /// Make the package of the extension for VS Code by npm: editors/vscode/lexican.vsix
    Vscode,
    /// Make the pictures of the bench's documentation anew, in a browser: bench/docs
    BenchPictures,
    /// Make the wheel of the Python package: one for every Python from 3.10 on, on systems like this one
    Wheel(wheel::Arguments),
    /// Run a command with the CAN interfaces vcan0 and vcan1 up, under a guest kernel where this one
    /// has no CAN
    Vcan(vcan::Arguments),
}

fn main() -> ExitCode {
    let root = workspace::root();
    let outcome = match Arguments::parse().task {
        Task::Ci { job, all } => ci::run(&root, job, all),
        Task::Tidy { record } => tidy::run(&root, record),
        Task::Api { check } => api::run(&root, check),
        Task::Bench(bench) => bench::run(&root, &bench),
        Task::Bless => ci::bless(&root),
        Task::Corpus { folder, simulate: true } => corpus::simulate(&root, &folder),
        Task::Corpus { folder, simulate: false } => {
            corpus::simulate(&root, &folder).and_then(|()| corpus::compile(&root, &folder))
        }
        Task::Size { check, device: true } => size::device::run(&root, check),
        Task::Size { check, device: false } => size::run(&root, check),
        Task::Fuzz(arguments) => arguments.run(&root),
        Task::Firmware(arguments) => firmware::run(&root, &arguments),
        Task::Interop { check } => interop::run(&root, check),
        Task::Conform { check } => conform::run(&root, check),
        Task::Verify { drive, check } => verify::run(&root, drive.as_deref(), check),
        Task::Page { check } => page::run(&root, check),
        Task::Vscode => page::extension(&root),
        Task::BenchPictures => page::pictures(&root),
        Task::Wheel(arguments) => wheel::make(&root, &arguments),
        Task::Vcan(arguments) => return vcan::main(&root, &arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}
