//! Fuzzing with libFuzzer, on any toolchain: the compiler counts coverage on stable, too, and only the sanitizers of
//! memory want a nightly one, which code without `unsafe` can do without.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::{command, workspace};

/// As cargo-fuzz has them with `--sanitizer none`.
const FLAGS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                     -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
                     -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1 --cfg fuzzing";

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The target; all of them, one after the other, when none is named
    target: Option<String>,
    /// How long each of them runs
    #[arg(long, default_value_t = 60)]
    seconds: u32,
}

/// Runs targets from the committed inputs and those that earlier runs have found, which lie below the target folder.
pub(crate) fn run(root: &Path, target: Option<&str>, seconds: u32) -> Result<(), String> {
    let folder = workspace::target_folder(root).join("fuzz");
    let host = host()?;
    let text = folder.to_string_lossy();
    // With an explicit target, build scripts and macros are not instrumented.
    let mut build = vec!["build", "--release", "--quiet", "--locked", "--manifest-path", "fuzz/Cargo.toml"];
    build.extend(["--target", &host, "--target-dir", &text]);
    command::run_cargo(root, &build, &[("RUSTFLAGS", FLAGS)])?;
    let targets = targets(root)?;
    if let Some(unknown) = target.filter(|target| !targets.iter().any(|known| known == target)) {
        return Err(format!("there is no target {unknown}; there are {}", targets.join(", ")));
    }
    for name in targets.iter().filter(|name| target.is_none_or(|target| target == *name)) {
        let made = |what: &str| {
            let folder = folder.join(what).join(name);
            let made = fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()));
            made.map(|()| format!("{}/", folder.display()))
        };
        let program = folder.join(&host).join("release").join(name).to_string_lossy().into_owned();
        let (found, failed) = (made("corpus")?, made("failures")?);
        let mut words = vec![program, found, format!("{}/fuzz/corpus/{name}", root.display())];
        words.extend(more_inputs(name).map(|folder| format!("{}/{folder}", root.display())));
        words.extend([format!("-max_total_time={seconds}"), format!("-artifact_prefix={failed}")]);
        // One input takes milliseconds; the memory is far above what any of them takes.
        words.extend(["-timeout=10", "-rss_limit_mb=1024", "-print_final_stats=1"].map(str::to_owned));
        if matches!(name.as_str(), "eds" | "codegen") {
            words.push(format!("-dict={}/fuzz/eds.dict", root.display()));
        }
        let output = Command::new(&words[0]).args(&words[1..]).output().map_err(|error| format!("{name}: {error}"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            let lines: Vec<&str> = said.lines().collect();
            let last = lines[lines.len().saturating_sub(40)..].join("\n");
            return Err(format!(
                "{last}\n{name}: {}\nthe input lies in {failed}: make it small, name it, and move it to fuzz/corpus/{name}",
                output.status
            ));
        }
        println!("{name}: {}", summary(&said));
    }
    Ok(())
}

/// The last lines of libFuzzer as one line.
fn summary(said: &str) -> String {
    let last = |key: &str| said.rsplit(key).next().and_then(|rest| rest.split_whitespace().next()).unwrap_or("?");
    let (runs, found) = (last("number_of_executed_units:"), last("new_units_added:"));
    format!("{runs} runs, {found} inputs found, {} places reached", last("cov:"))
}

impl Arguments {
    pub(crate) fn run(&self, root: &Path) -> Result<(), String> {
        run(root, self.target.as_deref(), self.seconds)
    }
}

/// Files of other tests from which fuzzing can begin.
fn more_inputs(target: &str) -> Option<&'static str> {
    match target {
        "eds" => Some("eds/tests/golden"),
        "codegen" => Some("tests/downstream/no_std/eds"),
        _ => None,
    }
}

/// The names of all targets.
fn targets(root: &Path) -> Result<Vec<String>, String> {
    let packages = workspace::packages(root, "fuzz/Cargo.toml")?;
    let targets = packages.iter().flat_map(|package| workspace::all(&package.says["targets"]));
    let bins = targets.filter(|target| target["kind"][0] == "bin");
    Ok(bins.filter_map(|bin| Some(bin["name"].as_str()?.to_owned())).collect())
}

/// The machine that this is, as the compiler names it.
fn host() -> Result<String, String> {
    let output = command::output(Command::new("rustc").arg("-vV"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: ")).map(str::to_owned);
    host.ok_or_else(|| "rustc -vV names no host".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_has_the_last_figures() {
        let said = "#2 INITED cov: 7 ft: 8\n#9 DONE   cov: 12 ft: 13 corp: 1/1b\nstat::number_of_executed_units: 33503\n\
                    stat::new_units_added:          804\n";
        assert_eq!(summary(said), "33503 runs, 804 inputs found, 12 places reached");
    }

    #[test]
    fn every_target_has_inputs_and_a_test_over_them() {
        let root = workspace::root();
        let tests = fs::read_to_string(root.join("tests/tests/all/fuzzed.rs")).unwrap();
        let targets = targets(&root).unwrap();
        assert!(targets.len() >= 10, "{targets:?}");
        for target in targets {
            assert!(tests.contains(&format!("check(fuzz::{target}, ")), "{target} has a test");
            assert!(root.join("fuzz/corpus").join(&target).is_dir(), "{target} has inputs");
        }
    }
}
