//! Tries each mutant of a crate with tests of this program, in a new process for each mutant.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The mutants of a crate.
pub(crate) struct Mutants {
    /// The name of the crate.
    pub(crate) package: &'static str,
    /// The environment variable that selects a mutant by the crate's name and the mutant's number.
    pub(crate) variable: &'static str,
    /// Their descriptions, by number.
    pub(crate) names: &'static [&'static str],
    /// Whether a mutant is tried here, by its description.
    pub(crate) are_tried: fn(&str) -> bool,
    /// Mutants that are not found because they behave the same, and why.
    pub(crate) unfound: &'static [(&'static str, &'static str)],
    /// The names of tests that each mutant is tried by, one group after the other until one fails.
    pub(crate) trials: &'static [&'static [&'static str]],
    /// The number of mutants to try in each file, unless `LEXICAN_VERIFY_ALL` is set. `LEXICAN_VERIFY_SEED` is a number
    /// that selects others.
    pub(crate) samples: usize,
}

impl Mutants {
    /// Tries the mutants, and returns how many each trial has found, in words.
    ///
    /// # Panics
    ///
    /// If a mutant survives, or an entry of `unfound` matches none.
    pub(crate) fn find(&self) -> String {
        for (name, _) in self.unfound {
            assert!(self.names.contains(name), "no mutant is called {name:?}");
        }
        let chosen = self.sample();
        let (next, outcomes) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let work = || {
            while let Some(&number) = chosen.get(next.fetch_add(1, Ordering::Relaxed)) {
                let found = self.trials.iter().position(|tests| !self.passes(number, tests));
                outcomes.lock().unwrap().push((number, found));
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
        let mut outcomes = outcomes.into_inner().unwrap();
        outcomes.sort_unstable();
        let survivors = outcomes.iter().filter(|(_, found)| found.is_none());
        let names: Vec<String> = survivors
            .map(|(number, _)| format!("{}={}: {}", self.variable, self.chosen(*number), self.names[*number]))
            .collect();
        assert!(names.is_empty(), "{} of {} not found:\n{}", names.len(), chosen.len(), names.join("\n"));
        let by = |trial| outcomes.iter().filter(|(_, found)| *found == Some(trial)).count().to_string();
        let found: Vec<String> = (0..self.trials.len()).map(by).collect();
        let all = self.names.iter().filter(|name| (self.are_tried)(name)).count();
        format!("{}: of {all} mutants {} tried, found by each trial: {}", self.package, chosen.len(), found.join(", "))
    }

    /// The numbers of the mutants to try, in order.
    fn sample(&self) -> Vec<usize> {
        let all = std::env::var_os("LEXICAN_VERIFY_ALL").is_some();
        let seed = std::env::var("LEXICAN_VERIFY_SEED").map_or(0, |seed| seed.parse::<u64>().expect("a number"));
        let is_found = |name: &str| !self.unfound.iter().any(|(known, _)| *known == name);
        let mut files: BTreeMap<&str, Vec<(u64, usize)>> = BTreeMap::new();
        let is_tried = |name: &str| is_found(name) && (self.are_tried)(name);
        for (number, name) in self.names.iter().enumerate().filter(|(_, name)| is_tried(name)) {
            let mut hasher = DefaultHasher::new();
            (seed, name).hash(&mut hasher);
            files.entry(name.split(' ').next().unwrap()).or_default().push((hasher.finish(), number));
        }
        let mut chosen = Vec::new();
        for mut of_file in files.into_values() {
            of_file.sort_unstable();
            let count = if all { of_file.len() } else { self.samples.min(of_file.len()) };
            chosen.extend(of_file[..count].iter().map(|(_, number)| *number));
        }
        chosen.sort_unstable();
        chosen
    }

    /// The value of the variable that selects a mutant.
    fn chosen(&self, number: usize) -> String {
        format!("{}:{number}", self.package)
    }

    fn passes(&self, number: usize, tests: &[&str]) -> bool {
        let mut run = Command::new(std::env::current_exe().unwrap());
        run.args(tests).arg("--test-threads=1").env(self.variable, self.chosen(number)).env("RUST_BACKTRACE", "0");
        // Property tests use the same values each time. A failing one is not shrunk, and not stored as a regression.
        run.env("PROPTEST_RNG_SEED", "0").env("PROPTEST_MAX_SHRINK_ITERS", "0");
        run.env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1");
        run.stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().success()
    }
}
