//! The results as Markdown.

use std::fmt::Write;

use super::calls::Calls;
use super::client::Figure;
use super::nodes::Rates;
use super::player::{Pair, Party};
use super::wire::Wire;

pub(super) fn text(wire: &Wire, rows: &[(Pair, Figure)], calls: Option<&[Calls]>, nodes: &[Rates]) -> String {
    let mut text = format!("### {}\n\n{}\n\n", wire.name, machine());
    text.push_str(
        "| client | device | round trips/s | processor of the client, us per frame | of the device, us per frame | \
         round trips, of python-canopen's | processor, of python-canopen's |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    let of = |client, device| rows.iter().find(|(pair, _)| *pair == Pair { client, device }).map(|(_, figure)| figure);
    for (pair, figure) in rows {
        // Clients are compared before the same device, devices behind the same client.
        let (rate, processor) = match (pair.client, pair.device) {
            (Party::Python, _) | (_, Party::Python) => (None, None),
            (Party::Blocking | Party::Tokio | Party::TokioTask, _) => {
                let theirs = of(Party::Python, pair.device);
                let rate = theirs.map(|theirs| figure.trips_per_s() / theirs.trips_per_s());
                (rate, theirs.map(|theirs| figure.client_us / theirs.client_us))
            }
            (Party::Lexican, _) => (None, None),
        };
        let _ = writeln!(
            text,
            "| {} | {} | {:.0} | {:.1} | {:.1} | {} | {} |",
            pair.client.name(),
            pair.device.name(),
            figure.trips_per_s(),
            figure.client_us,
            figure.device_us,
            times(rate),
            times(processor)
        );
    }
    if let (Some(ours), Some(theirs)) = (of(Party::Blocking, Party::Lexican), of(Party::Blocking, Party::Python)) {
        let _ = writeln!(
            text,
            "\nOur device behind the same client: {} the round trips of python-canopen's device, {} of its processor \
             time.",
            times(Some(ours.trips_per_s() / theirs.trips_per_s())),
            times(Some(ours.device_us / theirs.device_us))
        );
    }
    if let Some(calls) = calls {
        text.push_str(
            "\nSystem calls of the client per round trip, counted by `strace -c`:\n\n| client | calls | of these |\n",
        );
        text.push_str("| --- | --- | --- |\n");
        for Calls { client, each } in calls {
            let list: Vec<String> = each.iter().map(|(name, calls)| format!("{name} {calls:.1}")).collect();
            let _ = writeln!(text, "| {client} | {:.1} | {} |", each.values().sum::<f64>(), list.join(", "));
        }
    }
    for rates in nodes {
        let _ = writeln!(text, "\nEight nodes on one tokio shell, {}, round trips per second:\n", rates.pace);
        text.push_str(&nodes_table(rates));
    }
    text
}

fn nodes_table(nodes: &Rates) -> String {
    let (all, one_silent) = (&nodes.all, &nodes.one_silent);
    let sum = |rates: &[f64]| rates.iter().take(rates.len() - 1).sum::<f64>();
    let row = |head: &str, cells: Vec<String>| format!("| {head} | {} |\n", cells.join(" | "));
    let rates = |head: &str, rates: &[f64]| {
        let each = rates.iter().copied().chain([sum(rates)]);
        row(head, each.map(|rate| format!("{rate:.0}")).collect())
    };
    let ratios = all.iter().zip(one_silent).map(|(all, silent)| silent / all).chain([sum(one_silent) / sum(all)]);
    let heads = (1..=all.len()).map(|node| node.to_string()).chain(["1 to 7".to_owned()]);
    row("node", heads.collect())
        + &row("---", vec!["---".to_owned(); all.len() + 1])
        + &rates("all answer", all)
        + &rates("node 8 is silent", one_silent)
        + &row("ratio", ratios.map(|ratio| format!("{ratio:.2}")).collect())
}

fn times(ratio: Option<f64>) -> String {
    ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2}"))
}

/// What the figures hold for.
fn machine() -> String {
    let read = |path| std::fs::read_to_string(path).unwrap_or_default();
    let kernel = read("/proc/sys/kernel/osrelease");
    // User-mode Linux calls its processor so.
    let guest = if read("/proc/cpuinfo").contains("User Mode Linux") { ", user-mode Linux in a guest" } else { "" };
    let processors = std::thread::available_parallelism().map_or(0, usize::from);
    let load = read("/proc/loadavg");
    let load = load.split(' ').next().unwrap_or_default();
    format!("Linux {}{guest}, processors: {processors}, load average at the end: {load}.", kernel.trim())
}
