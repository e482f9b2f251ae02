//! Prints figures and goals.

use crate::measure::Figure;

/// The name of our own contender, which the others are compared with.
pub(crate) const OURS: &str = "lexican";

/// Goals, said and judged at the end.
#[derive(Default)]
pub(crate) struct Goals(Vec<Goal>);

struct Goal {
    met: bool,
    text: String,
    measured: String,
}

impl Goals {
    /// `measured` is to be at most `bound`.
    pub(crate) fn at_most(&mut self, text: impl Into<String>, measured: f64, bound: f64, unit: &str) {
        let measured_text = format!("{measured:.2}{unit}, at most {bound}{unit}");
        self.0.push(Goal { met: measured <= bound, text: text.into(), measured: measured_text });
    }

    /// Ours is to be faster than every other one.
    pub(crate) fn fastest(&mut self, text: &str, figures: &[Figure]) {
        let Some(ours) = ours(figures) else { return };
        let rivals = figures.iter().filter(|figure| !figure.name.starts_with(OURS));
        for rival in rivals {
            let measured = format!("{:.1} ns, {:.1} ns: {:.2} times", ours.best_ns, rival.best_ns, ratio(ours, rival));
            let text = format!("{text}: faster than {}", rival.name);
            self.0.push(Goal { met: ours.best_ns < rival.best_ns, text, measured });
        }
    }

    pub(crate) fn print(&self) {
        println!();
        for Goal { met, text, measured } in &self.0 {
            println!("{}  {text} ({measured})", if *met { "PASS" } else { "miss" });
        }
        let missed = self.0.iter().filter(|goal| !goal.met).count();
        println!("{} of {} goals met", self.0.len() - missed, self.0.len());
    }
}

pub(crate) fn ours(figures: &[Figure]) -> Option<&Figure> {
    figures.iter().find(|figure| figure.name == OURS)
}

/// What ours takes, in what the other one takes: below 1, ours is faster.
pub(crate) fn ratio(ours: &Figure, other: &Figure) -> f64 {
    ours.best_ns / other.best_ns
}

/// The head of a table of [`row`]s.
pub(crate) fn head(what: &str) {
    println!(
        "\n{:<34} {:<22} {:>11} {:>11} {:>10} {:>8} {:>11}",
        what, "", "best ns", "median ns", "Mframes/s", "MB/s", "ours/theirs"
    );
}

/// One case: a line for each contender. `bytes` is what one piece of work moves.
pub(crate) fn rows(case: &str, bytes: usize, figures: &[Figure]) {
    let ours = ours(figures);
    for (line, figure) in figures.iter().enumerate() {
        let per_us =
            |count: f64| if count > 0.0 { format!("{:.1}", count * 1e3 / figure.best_ns) } else { String::new() };
        let ratio = ours.filter(|ours| ours.name != figure.name).map(|ours| format!("{:.2}", ratio(ours, figure)));
        println!(
            "{:<34} {:<22} {:>11} {:>11} {:>10} {:>8} {:>11}",
            if line == 0 { case } else { "" },
            figure.name,
            nanoseconds(figure.best_ns),
            nanoseconds(figure.median_ns),
            per_us(figure.frames as f64),
            per_us(bytes as f64),
            ratio.unwrap_or_default()
        );
    }
}

/// Tenths only where they are significant.
fn nanoseconds(ns: f64) -> String {
    if ns < 1000.0 { format!("{ns:.1}") } else { format!("{ns:.0}") }
}
