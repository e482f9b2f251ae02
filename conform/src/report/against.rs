//! The differences from an earlier test.

use std::cmp::{Ordering, Reverse};
use std::collections::BTreeMap;
use std::fmt::{self, Display};

use serde::{Deserialize, Serialize};

/// An earlier test, read from its [`Document::json`](super::Document::json).
#[derive(Clone, Debug, Deserialize)]
pub struct Earlier {
    cases: Vec<EarlierCase>,
}

#[derive(Clone, Debug, Deserialize)]
struct EarlierCase {
    id: String,
    verdict: String,
}

/// The differences from an earlier test, with a sentence for each case whose verdict has changed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Differences {
    /// The name of the earlier report.
    pub with: String,
    /// Cases with a worse verdict, such as one that is not tested any more.
    pub worse: Vec<String>,
    /// Cases with a better verdict.
    pub better: Vec<String>,
    /// Cases that only this test has run.
    pub new: Vec<String>,
    /// Cases that only the earlier test has run.
    pub gone: Vec<String>,
}

/// How bad a verdict is; higher is worse.
fn rank(verdict: &str) -> u8 {
    match verdict {
        "passed" | "known" => 0,
        "not applicable" | "not allowed" => 1,
        "advised" => 2,
        "not decidable" => 3,
        "blocked" | "unfinished" => 4,
        _ => 5,
    }
}

/// The worst verdict of each case, which may have been run several times.
fn worst<'a>(cases: impl Iterator<Item = (&'a str, &'a str)>) -> BTreeMap<&'a str, &'a str> {
    let mut worst = BTreeMap::new();
    for (id, verdict) in cases {
        let known = worst.entry(id).or_insert(verdict);
        if rank(verdict) > rank(known) {
            *known = verdict;
        }
    }
    worst
}

impl Earlier {
    /// Reads a report in JSON.
    pub fn parse(json: &str) -> Result<Self, String> {
        serde_json::from_str(json).map_err(|error| error.to_string())
    }
}

impl Earlier {
    /// Compares these cases, given by id, title and verdict, with the earlier report of this name.
    pub(super) fn compare<'a>(
        &self,
        with: &str,
        cases: impl Iterator<Item = (&'a str, &'a str, &'a str)> + Clone,
    ) -> Differences {
        let before = worst(self.cases.iter().map(|case| (&*case.id, &*case.verdict)));
        let now = worst(cases.clone().map(|(id, _, verdict)| (id, verdict)));
        let titles: BTreeMap<&str, &str> = cases.map(|(id, title, _)| (id, title)).collect();
        let title = |id: &str| titles.get(id).copied().unwrap_or_default();
        let mut found = Differences { with: with.to_owned(), ..Differences::default() };
        // Worst first.
        let mut order: Vec<_> = now.iter().collect();
        order.sort_by_key(|(_, verdict)| Reverse(rank(verdict)));
        for (id, verdict) in order {
            let Some(was) = before.get(id) else {
                found.new.push(format!("{id} {}: {verdict}", title(id)));
                continue;
            };
            let sentence = || format!("{id} {}: {verdict}, was {was}", title(id));
            match rank(verdict).cmp(&rank(was)) {
                Ordering::Greater => found.worse.push(sentence()),
                Ordering::Less => found.better.push(sentence()),
                Ordering::Equal => {}
            }
        }
        let gone = before.iter().filter(|(id, _)| !now.contains_key(*id));
        found.gone = gone.map(|(id, was)| format!("{id}: was {was}")).collect();
        found
    }
}

impl Display for Differences {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (what, cases) in
            [("worse", &self.worse), ("better", &self.better), ("new", &self.new), ("gone", &self.gone)]
        {
            cases.iter().try_for_each(|case| writeln!(f, "{what}: {case}"))?;
        }
        let [worse, better, new, gone] = [&self.worse, &self.better, &self.new, &self.gone].map(Vec::len);
        write!(f, "against {}: {worse} worse, {better} better, {new} new, {gone} gone", self.with)
    }
}
