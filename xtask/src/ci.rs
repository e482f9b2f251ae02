//! What CI runs. There is no other script with logic in it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use clap::ValueEnum;
use serde_json::Value;

use crate::disk::Free;
use crate::proved::{self, Inputs};
use crate::{checkout, command, package, workspace};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(crate) enum Job {
    /// rustfmt
    Fmt,
    /// the habits that no compiler checks
    Tidy,
    /// the public API is what `tests/api` has
    Api,
    /// dependencies: none unused, licences and duplicates as `deny.toml` has them
    Dependencies,
    /// the README's command that runs the main job
    Main,
    /// the README's command that passes the tests
    Test,
    /// clippy, warnings are errors, with all features
    Clippy,
    /// rustdoc, warnings are errors
    Doc,
    /// clippy of what is published, without features and with each alone
    Features,
    /// what does not run here: Windows, macOS, a microcontroller; compiled where their targets are installed
    Targets,
    /// the lowest versions of dependencies that the manifests permit
    Minimal,
    /// every package that is published: complete, and built from packages alone
    Package,
    /// crates as users write them, and a firmware without std, built outside of the workspace
    Users,
    /// the pages "A drive in an hour" and "For users of CANopenNode", followed
    Hour,
    /// the bench's page is what its sources make, where there is npm
    Page,
    /// drives against every table of their manuals
    Verify,
    /// devices of many kinds, simulated: what `lexican conform` says of them
    Conform,
    /// our own programs, disturbed by `lexican chaos` at a few moments
    Chaos,
    /// every golden data sheet, simulated, and as generated code under clippy
    Corpus,
    /// real data sheets of many vendors, where there are any: LEXICAN_CORPUS, a folder or an archive
    Sheets,
    /// what generated code costs, but for times
    Size,
    /// the firmware, on a microcontroller that QEMU plays
    Firmware,
    /// every fuzz target for a few seconds
    Fuzz,
    /// the Python package: built, tested and type-checked, where there is a Python with venv
    Python,
    /// the tests that want a kernel with CAN, in one
    Vcan,
    /// lexican against python-canopen, both ways: what the tables say
    Interop,
}

/// Runs one job, or all that no record proves; with `all`, those as well.
pub(crate) fn run(root: &Path, job: Option<Job>, all: bool) -> Result<(), String> {
    if let Some(free) = Free::for_builds(root) {
        println!("{free}");
    }
    match job {
        Some(job) => job.run_and_look(root, is_clean(root)),
        None => run_all(root, all),
    }
}

/// Runs the jobs in two lanes, since tests spend half of their time waiting: beside them run the jobs that compile and whose
/// outcome does not depend on timing. The interoperability runs do depend on it, so they come last and alone.
fn run_all(root: &Path, all: bool) -> Result<(), String> {
    let is_clean = is_clean(root);
    // Asked now: once a job has rebuilt this program, the system no longer knows the path of the running one.
    let program = std::env::current_exe().map_err(|error| format!("this program: {error}"))?;
    let wanted = Job::value_variants().iter().filter(|job| all || !job.is_proved(root));
    let (last, wanted): (Vec<Job>, Vec<Job>) = wanted.partition(|job| **job == Job::Interop);
    let (beside, others): (Vec<Job>, Vec<Job>) = wanted.into_iter().partition(|job| job.is_beside());
    let has_failed = AtomicBool::new(false);
    let times = Mutex::new(Vec::new());
    let carry_out = |job: Job, work: &dyn Fn() -> Result<(), String>| {
        if has_failed.load(Ordering::Relaxed) {
            return Ok(());
        }
        #[expect(clippy::disallowed_methods, reason = "how long a job takes is measured")]
        let began = Instant::now();
        let outcome = work();
        has_failed.fetch_or(outcome.is_err(), Ordering::Relaxed);
        times.lock().unwrap_or_else(PoisonError::into_inner).push((began.elapsed(), job));
        outcome
    };
    let (alone, beside) = std::thread::scope(|scope| {
        let beside =
            scope.spawn(|| beside.iter().try_for_each(|job| carry_out(*job, &|| job.run_silently(root, &program))));
        let alone = others.iter().try_for_each(|job| carry_out(*job, &|| job.run_and_look(root, is_clean)));
        (alone, beside.join().unwrap_or_else(|_| Err("a job beside the others has panicked".to_owned())))
    });
    let last = last.iter().try_for_each(|job| carry_out(*job, &|| job.run_and_look(root, is_clean)));
    let mut times = times.into_inner().unwrap_or_else(PoisonError::into_inner);
    times.sort();
    println!("== how long each job took, two at a time");
    times.iter().rev().for_each(|(time, job)| println!("{:5} s  {}", time.as_secs(), job.name()));
    alone.and(beside).and(last)
}

/// Whether the checkout has no changes of its own, so that those that a job leaves can be seen.
fn is_clean(root: &Path) -> bool {
    let why = match checkout::changes(root) {
        Ok(changes) if changes.is_empty() => return true,
        Ok(_) => "it has changes already".to_owned(),
        Err(error) => error,
    };
    println!("skipped: whether jobs leave the checkout as it is: {why}");
    false
}

/// An error if a job has left changes: what tests and measurements make belongs into the target folder.
fn still_clean(root: &Path) -> Result<(), String> {
    let changes = checkout::changes(root)?;
    if changes.is_empty() {
        return Ok(());
    }
    Err(format!("the job has left changes in the checkout:\n{changes}commit them, or let the job write elsewhere"))
}

/// When the disk is nearly full, that this is the likely cause of a failure, and what to do.
fn short_of_space(root: &Path) -> String {
    match Free::for_builds(root) {
        Some(free) if free.is_short() => format!(
            "only {free}: that is the likely cause\nmake room: cargo clean, or a larger disk by CARGO_TARGET_DIR\n"
        ),
        _ => String::new(),
    }
}

pub(crate) fn bless(root: &Path) -> Result<(), String> {
    command::run_cargo(root, &["test", "--workspace", "golden"], &[("LEXICAN_BLESS", "1")])?;
    crate::api::run(root, false)
}

impl Job {
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Whether it can run in the second lane: its outcome does not depend on timing. Cargo's lock keeps two builds apart.
    const fn is_beside(self) -> bool {
        use Job::{Clippy, Doc, Features, Firmware, Fuzz, Main, Minimal, Package, Targets};
        // The firmware is timed, too, but a case that fails by its time is tried again.
        matches!(self, Main | Clippy | Doc | Features | Targets | Minimal | Package | Firmware | Fuzz)
    }

    /// What its outcome depends on; `None` for jobs so light that no record is kept.
    fn inputs(self) -> Option<Inputs> {
        // Where a tool is missing, the job would skip its work: that proves nothing.
        match self {
            Job::Firmware | Job::Size if crate::firmware::is_possible().is_err() => return None,
            Job::Python if crate::wheel::is_possible().is_err() => return None,
            Job::Targets if TARGETS.iter().any(|target| !workspace::has_target(target)) => return None,
            Job::Page if !command::is_there("npm") => return None,
            Job::Sheets if !corpus().is_some_and(|corpus| corpus.is_file()) => return None,
            _ => {}
        }
        // Its files in `xtask/src`, the manifests, and what is read besides.
        let (own, manifests, paths): (&[&str], &[&str], &[&str]) = match self {
            // The benchmarks are below `tests`. What is not below a package is included by one.
            Job::Clippy | Job::Doc => (&[], &["Cargo.toml"], &["README.md", "docs", "drives", "examples", "fuzz"]),
            Job::Page => (&["page.rs"], &[], &["bench/page"]),
            Job::Features | Job::Minimal | Job::Package => (&["package.rs"], &["cli/Cargo.toml"], &["drives"]),
            Job::Targets => (&["package.rs"], &["cli/Cargo.toml"], &["drives", "examples/firmware"]),
            Job::Users => {
                let tests: &[&str] = &["tests/Cargo.toml", "tests/bare", "tests/downstream", "tests/tests"];
                (&[], &["codegen/Cargo.toml", "drives/driver/Cargo.toml", "drives/simulator/Cargo.toml"], tests)
            }
            Job::Hour => {
                (&[], &["cli/Cargo.toml"], &["docs", "drives", "tests/Cargo.toml", "tests/downstream", "tests/tests"])
            }
            // The mutated crates are made of the sources of others.
            Job::Verify => {
                let manifests = &["tests/mutants/Cargo.toml", "tests/verify/Cargo.toml"];
                (&["verify.rs"], manifests, &["drives", "profibus", "tests/manual"])
            }
            Job::Conform => {
                let sheets: &[&str] = &["conform", "drives", "tests/conformance", "tests/downstream", "tests/interop"];
                (&["conform.rs", "report.rs"], &["cli/Cargo.toml"], sheets)
            }
            Job::Chaos => {
                let programs = &["cli/Cargo.toml", "examples/changeover/Cargo.toml", "examples/circle/Cargo.toml"];
                (&["chaos.rs"], programs, &[])
            }
            Job::Corpus => (&["corpus.rs"], &["cli/Cargo.toml"], &[]),
            Job::Sheets => {
                (&[], &["eds/Cargo.toml", "simulation/Cargo.toml", "toolbox/Cargo.toml"], &["tests", "cli/tests"])
            }
            Job::Size => (&["firmware", "qemu.rs", "size", "size.rs"], &["cli/Cargo.toml"], &["tests/size"]),
            Job::Firmware => {
                let firmware = &["examples/firmware/Cargo.toml", "cli/Cargo.toml"];
                (&["firmware", "qemu.rs", "report.rs"], firmware, &["examples/firmware"])
            }
            Job::Fuzz => (&["fuzz.rs"], &["fuzz/Cargo.toml"], &["eds/tests/golden", "tests/downstream/no_std/eds"]),
            Job::Python => (&["wheel.rs"], &["python/Cargo.toml"], &["docs", "python"]),
            Job::Vcan => (&["vcan"], &["cli/Cargo.toml", "tests/Cargo.toml"], &[]),
            Job::Interop => {
                (&["interop", "python.rs", "vcan"], &["cli/Cargo.toml", "tests/Cargo.toml"], &["tests/interop"])
            }
            _ => return None,
        };
        let outside = if self == Job::Sheets { corpus() } else { None };
        Some(Inputs { own, manifests, paths, outside })
    }

    /// Whether its record says that it has passed with exactly these sources; if so, prints that it is skipped.
    fn is_proved(self, root: &Path) -> bool {
        let Some(inputs) = self.inputs() else { return false };
        let name = self.name();
        match inputs.hash(root) {
            Ok(hash) if proved::is_right(root, &name, &hash) => {
                println!(
                    "skipped: {name} has passed with these sources ({}/{name}): ci --all runs it",
                    checkout::RECORDS
                );
                true
            }
            Ok(_) => false,
            Err(error) => {
                println!("skipped: whether {name} is proved already: {error}");
                false
            }
        }
    }

    /// Runs it; fails if it has left changes in the checkout, and else keeps a record of a heavy job.
    fn run_and_look(self, root: &Path, is_clean: bool) -> Result<(), String> {
        let name = self.name();
        println!("== {name}");
        let hash = || self.inputs().and_then(|inputs| inputs.hash(root).ok());
        let before = hash();
        let outcome = self.run(root).and_then(|()| if is_clean { still_clean(root) } else { Ok(()) });
        outcome
            .map_err(|error| format!("{error}\n{}run it again alone: cargo xtask ci {name}", short_of_space(root)))?;
        match before.filter(|before| hash().as_ref() == Some(before)) {
            Some(hash) => proved::write(root, &name, &hash),
            None => Ok(()),
        }
    }

    /// Runs it as a process of its own, and prints its output when it has ended.
    fn run_silently(self, root: &Path, program: &Path) -> Result<(), String> {
        let name = self.name();
        println!("== {name}: begun beside the others");
        // Jobs that only compile get less of the processor: some tests wait for a program to answer in time.
        let gives_way = cfg!(unix) && self != Job::Firmware;
        let mut command = if gives_way { Command::new("nice") } else { Command::new(program) };
        if gives_way {
            command.arg(program);
        }
        let output = command.args(["ci", &name]).current_dir(root).stdin(Stdio::null()).output();
        let output = output.map_err(|error| format!("cargo xtask ci {name}: {error}"))?;
        let text = [output.stdout, output.stderr].concat();
        println!("{}", String::from_utf8_lossy(&text).trim_end());
        if output.status.success() { Ok(()) } else { Err(format!("cargo xtask ci {name}: {}", output.status)) }
    }

    fn run(self, root: &Path) -> Result<(), String> {
        match self {
            Job::Fmt => command::run_cargo(root, &["fmt", "--all", "--check"], &[])
                .map_err(|error| format!("{error}\nmend it: cargo fmt")),
            Job::Clippy => {
                let all = [
                    "clippy",
                    "--workspace",
                    "--all-targets",
                    "--features",
                    "lexican-tests/nested,lexican-mutants/mutants",
                ];
                let all = [&all[..], &["--", "-D", "warnings"]].concat();
                command::run_cargo(root, &all, &[])?;
                // With the target folder of the workspace, so that shared dependencies are compiled once.
                let folder = workspace::target_folder(root).to_string_lossy().into_owned();
                let benchmarks = ["clippy", "--manifest-path", "tests/bench/Cargo.toml", "--target-dir", &folder];
                command::run_cargo(root, &[&benchmarks[..], &["--locked", "--", "-D", "warnings"]].concat(), &[])
            }
            Job::Features => {
                // Without features, as firmware takes the core, and each feature by itself.
                for package in package::published(root)? {
                    let alone = package::features(&package).collect::<Vec<_>>();
                    let none = if alone.is_empty() { None } else { Some("") };
                    for features in none.into_iter().chain(alone) {
                        let alone = ["clippy", "-p", &package.name, "--no-default-features", "--features", features];
                        command::run_cargo(root, &[&alone[..], &["--", "-D", "warnings"]].concat(), &[])?;
                    }
                }
                Ok(())
            }
            Job::Targets => targets(root),
            Job::Doc => command::run_cargo(
                root,
                &["doc", "--workspace", "--no-deps", "--all-features"],
                &[("RUSTDOCFLAGS", "-D warnings")],
            ),
            Job::Tidy => crate::tidy::run(root, false),
            Job::Api => crate::api::run(root, true),
            Job::Dependencies => dependencies(root),
            Job::Minimal => minimal(root),
            Job::Package => package::run(root),
            Job::Main => readme_command(root, "main job"),
            Job::Test => {
                readme_command(root, "tests")?;
                // The harness hides what passing tests print, so skipped ones are named here.
                for programs in [&["chromium-headless-shell", "chromium", "google-chrome"][..], &["tmux"], &["tshark"]]
                {
                    if !programs.iter().any(|program| command::is_there(program)) {
                        println!("skipped: the tests that want {}", programs.join(" or "));
                    }
                }
                Ok(())
            }
            Job::Users => nested(root, &["downstream::", "bare::"]),
            Job::Hour => nested(root, &["a_drive_in_an_hour::", "for_canopennode::"]),
            Job::Page => crate::page::run(root, true),
            Job::Verify => {
                crate::verify::run(root, None, true)?;
                let tests = ["test", "--workspace", "--features", "lexican-mutants/mutants", "--test"];
                // All of SIKO's simulated drives and of the AKD, and some of the other interfaces.
                let all = [&tests[..], &["mutants", "--test", "akd"]].concat();
                command::run_cargo(root, &all, &[("LEXICAN_VERIFY_ALL", "1")])?;
                command::run_cargo(root, &[&tests[..], &["interfaces"]].concat(), &[])
            }
            Job::Conform => crate::conform::run(root, true),
            Job::Chaos => crate::chaos::run(root),
            Job::Corpus => {
                let folder = root.join("eds/tests/golden");
                crate::corpus::simulate(root, &folder).and_then(|()| crate::corpus::compile(root, &folder))
            }
            Job::Sheets => {
                let Some(corpus) = corpus() else {
                    println!("skipped: real data sheets: LEXICAN_CORPUS names none");
                    return Ok(());
                };
                let tests = ["test", "--workspace", "--test", "all", "--", "corpus::", "precision::", "declared::"];
                command::run_cargo(root, &tests, &[("LEXICAN_CORPUS", &corpus.to_string_lossy())])
            }
            Job::Size => crate::size::run(root, true),
            Job::Firmware => {
                let arguments = crate::firmware::Arguments { check: true, round_trips: 10_000 };
                crate::firmware::run(root, &arguments)
            }
            Job::Fuzz => crate::fuzz::run(root, None, 5),
            Job::Python => crate::wheel::run(root),
            Job::Interop => crate::interop::run(root, true),
            Job::Vcan => {
                // With the features that the workspace's tests have been built with.
                let tests = ["test", "--workspace", "--test", "link_socketcan"];
                // Built here, where it is quick; in the guest it only runs.
                command::run_cargo(root, &[&tests[..], &["--no-run"]].concat(), &[])?;
                let required = ["env", "LEXICAN_REQUIRE_CAN=1", "cargo"];
                crate::vcan::run_command(root, &[&required[..], &tests[..], &["--offline"]].concat(), &[])
            }
        }
    }
}

/// The feature that has the tests which run cargo.
const NESTED: &str = "lexican-tests/nested";

/// Runs tests that run cargo, with what else the workspace's tests have been built with.
fn nested(root: &Path, tests: &[&str]) -> Result<(), String> {
    let nested = ["test", "--workspace", "--features", NESTED, "--test", "outside", "--"];
    command::run_cargo(root, &[&nested[..], tests].concat(), &[])
}

/// Data sheets that are no part of this project: a folder, or an archive of one.
fn corpus() -> Option<PathBuf> {
    let beside = || workspace::root().join("../shared/corpus/dev.tar.xz");
    let place = std::env::var_os("LEXICAN_CORPUS").map_or_else(beside, PathBuf::from);
    place.canonicalize().ok()
}

/// What firmware uses.
const CORE: &[&str] = &["-p", "lexican-runtime", "--no-default-features", "--features", "defmt"];

/// The firmware, but for the board whose crates take minutes.
const FIRMWARE: &[&str] = &[
    "--locked",
    "--manifest-path",
    "examples/firmware/Cargo.toml",
    "--target-dir",
    "target",
    "-p",
    "io-device",
    "-p",
    "firmware-mps2",
];

const TARGETS: [&str; 3] = ["x86_64-pc-windows-gnu", "aarch64-apple-darwin", "thumbv7em-none-eabihf"];

/// Checks what is compiled for other machines: the command and all drives for hosts, the core for firmware.
fn targets(root: &Path) -> Result<(), String> {
    let published = package::published(root)?;
    let drives = published.iter().filter(|package| package.manifest_path.starts_with(root.join("drives")));
    let mut host = vec!["--all-features", "-p", "lexican"];
    drives.for_each(|package| host.extend(["-p", &package.name]));
    let [windows, mac, controller] = TARGETS;
    let targets = [(windows, &host[..]), (mac, &host), (controller, CORE), (controller, FIRMWARE)];
    for (target, packages) in targets {
        if !workspace::has_target(target) {
            println!("skipped: {target} is not installed: rustup target add {target}");
            continue;
        }
        command::run_cargo(
            root,
            &[&["clippy", "--target", target], packages, &["--", "-D", "warnings"]].concat(),
            &[],
        )?;
    }
    Ok(())
}

/// What we are made of.
fn dependencies(root: &Path) -> Result<(), String> {
    let hint = |error| format!("{error}\n.ci/run installs what is missing");
    // By its own name: as a command of cargo it would take its name for a folder, since cargo has started this task.
    command::run(&["cargo-machete", "--skip-target-dir", &root.to_string_lossy()]).map_err(hint)?;
    command::run_cargo(root, &["deny", "--offline", "--all-features", "check", "licenses", "bans", "sources"], &[])
        .map_err(hint)?;
    compiled_once(root)?;
    // What the firmware's boards and the Python package are made of may come in several versions, but under no other licence.
    for manifest in ["examples/firmware/Cargo.toml", "python/Cargo.toml"] {
        let manifest = ["--manifest-path", manifest];
        command::run_cargo(root, &[&["fetch", "--quiet", "--locked"], &manifest[..]].concat(), &[])?;
        let check =
            ["--config", "deny.toml", "check", "--allow", "license-exception-not-encountered", "licenses", "sources"];
        command::run_cargo(root, &[&["deny", "--offline"], &manifest[..], &check].concat(), &[]).map_err(hint)?;
    }
    Ok(())
}

/// No library of ours is compiled twice for the tests: of what build scripts and programs share, both want the same features.
fn compiled_once(root: &Path) -> Result<(), String> {
    let mut cargo = command::cargo();
    cargo.args(["test", "--workspace", "--no-run", "--unit-graph", "-Z", "unstable-options"]);
    // An option of cargo that is not stable yet, and builds nothing.
    let graph = command::output(cargo.env("RUSTC_BOOTSTRAP", "1").current_dir(root))?.stdout;
    let graph: Value = serde_json::from_slice(&graph).map_err(|error| format!("cargo test --unit-graph: {error}"))?;
    let libraries =
        workspace::all(&graph["units"]).filter(|it| it["mode"] == "build" && it["target"]["kind"][0] == "lib");
    let ours = libraries.filter_map(|it| it["pkg_id"].as_str().filter(|id| id.starts_with("path+")));
    let mut seen = BTreeSet::new();
    let twice: Vec<&str> = ours.filter(|id| !seen.insert(*id)).collect();
    if twice.is_empty() {
        return Ok(());
    }
    Err(format!(
        "compiled twice, with dependencies of different features: {}\ngive them the same in eds/Cargo.toml",
        twice.join(", ")
    ))
}

/// Compiles what is published with the lowest versions that its manifests permit, in a copy: the lock file is another.
fn minimal(root: &Path) -> Result<(), String> {
    let folder = crate::outside::empty_folder(root, "minimal")?;
    checkout::copy(root, &folder)?;
    // It is an option of the resolver that is not stable yet, and changes nothing of what the compiler takes.
    let unstable = [("RUSTC_BOOTSTRAP", "1")];
    command::run_cargo(&folder, &["-Z", "direct-minimal-versions", "generate-lockfile", "--quiet"], &unstable)?;
    let target = workspace::target_folder(root).join("minimal-target").to_string_lossy().into_owned();
    let mut arguments = vec!["check", "--quiet", "--locked", "--all-features", "--target-dir", &target];
    let packages = package::published(root)?;
    for package in &packages {
        arguments.extend(["--package", &package.name]);
    }
    command::run_cargo(&folder, &arguments, &[])
}

/// Runs the command that the README gives for `purpose`.
fn readme_command(root: &Path, purpose: &str) -> Result<(), String> {
    let readme = std::fs::read_to_string(root.join("README.md")).map_err(|error| format!("README.md: {error}"))?;
    let words =
        command_for(&readme, purpose).ok_or_else(|| format!("README.md: no cargo command below `# {purpose}`"))?;
    command::run_cargo(root, &words, &[])
}

/// The arguments of cargo in the line after `# <purpose>`.
fn command_for<'r>(readme: &'r str, purpose: &str) -> Option<Vec<&'r str>> {
    let marker = format!("# {purpose}");
    let mut lines = readme.lines().skip_while(|line| !line.starts_with(&marker));
    let command = lines.nth(1)?.strip_prefix("cargo ")?;
    Some(command.split_ascii_whitespace().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_is_published_counts_for_the_jobs_that_publish_it() {
        let root = workspace::root();
        let paths = Job::Package.inputs().unwrap().paths(&root).unwrap();
        for package in package::published(&root).unwrap() {
            let manifest = package.manifest_path.strip_prefix(&root).unwrap();
            assert!(paths.iter().any(|path| manifest.starts_with(path)), "{} is not in {paths:?}", manifest.display());
        }
    }

    #[test]
    fn what_a_job_depends_on_is_there() {
        let root = workspace::root();
        for inputs in Job::value_variants().iter().filter_map(|job| job.inputs()) {
            for path in inputs.paths(&root).unwrap() {
                assert!(root.join(&path).exists(), "there is no {path}");
            }
        }
    }

    #[test]
    fn the_readme_has_a_command_for_both_of_its_jobs() {
        let readme = "# Title\n```sh\n# tests: all\ncargo test --workspace\n\n# other\nls\n```\n";
        assert_eq!(command_for(readme, "tests"), Some(vec!["test", "--workspace"]));
        assert_eq!(command_for(readme, "other"), None);
        assert_eq!(command_for(readme, "main job"), None);
        let readme = include_str!("../../README.md");
        assert!(command_for(readme, "main job").is_some() && command_for(readme, "tests").is_some());
    }
}
