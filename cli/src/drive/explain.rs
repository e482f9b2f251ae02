//! `lexican drive NODE --explain`: whether a drive can be moved, without moving it.

use std::io::Write;

use lexican_driver::Error;
use lexican_runtime::host::Pace;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::{Fact, Verdict, explain_drive, explain_sheet};
use serde_json::json;

use super::args::Args;
use super::node::{Drive, failed, find_sheet};
use crate::output::{Failure, Outcome, note, stdout};

/// Findings of a data sheet that affect every order, not only some.
const SAID: [&str; 3] = ["drive::profile", "drive::velocity", "drive::vendor"];

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let (link, sheet) = find_sheet(&args.bus, Pace::Virtual, args.node, args.device.as_deref(), &args.overlay)?;
    let (description, mut facts) = explain_sheet(&sheet.input, &sheet.device);
    if let Some(description) = description {
        match Drive::connect_described_unprotected(link, args.node, description) {
            Ok(mut drive) => {
                facts.extend(drive.run(async |drive| explain_drive(&drive).await).map_err(Failure::new)?);
                drop(drive.release());
            }
            Err(error @ (Error::Link(_) | Error::Sdo(_))) => return Err(failed(error, args.device.is_some())),
            Err(error) => {
                let remedy = "name the data sheet of this node, or correct it by an overlay";
                facts.push(Fact::new(Verdict::Missing, error.to_string(), Some(remedy.to_owned())));
            }
        }
    }
    facts.sort_by_key(|fact| fact.verdict);
    let mut out = stdout();
    for fact in &facts {
        let word = fact.verdict.word();
        if args.json {
            let fields = json!({
                "event": "fact", "node": args.node.get(), "verdict": word, "text": fact.text, "remedy": fact.remedy,
            });
            writeln!(out, "{fields}")?;
        } else {
            let remedy = fact.remedy.as_ref().map_or_else(String::new, |remedy| format!("\n         {remedy}"));
            writeln!(out, "{word:<8} {}{remedy}", fact.text)?;
        }
    }
    let worst = facts.last().map_or(Verdict::Ready, |fact| fact.verdict);
    let (outcome, text) = match worst {
        Verdict::Ready => (Outcome::Clean, "it can be moved"),
        Verdict::Instead => (Outcome::Clean, "it can be moved, with what is used instead"),
        Verdict::Set => (Outcome::Found, "it can be moved once it is set"),
        Verdict::Missing => (Outcome::Unreadable, "it cannot be moved"),
    };
    match args.json {
        true => writeln!(
            out,
            "{}",
            json!({ "event": "end", "node": args.node.get(), "outcome": worst.word(), "text": text })
        )?,
        false => writeln!(out, "node {}: {text}", args.node)?,
    }
    Ok(outcome)
}

/// Before an order, tells what the driver uses instead of missing objects.
pub(super) fn say_what_is_used_instead(sheet: &DataSheet) {
    let facts = explain_sheet(&sheet.input, &sheet.device).1.into_iter();
    let said: Vec<Fact> = facts.filter(|fact| fact.code.is_some_and(|code| SAID.contains(&code))).collect();
    say(&said);
}

/// Prints facts as notes.
pub(super) fn say(facts: &[Fact]) {
    for fact in facts {
        let remedy = fact.remedy.as_ref().map_or_else(String::new, |remedy| format!(": {remedy}"));
        note(format_args!("{}{remedy}", fact.text));
    }
}
