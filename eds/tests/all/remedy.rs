//! The remedies that findings print, and the data sheet after applying them.

#![allow(dead_code, reason = "not every test needs all of it")]

use lexican_eds::model::Device;
use lexican_eds::{Diagnostic, Input, Source, diff};

/// The number of findings with this code and message.
pub(crate) fn count(findings: &[Diagnostic], like: &Diagnostic) -> usize {
    findings.iter().filter(|finding| finding.code == like.code && finding.message == like.message).count()
}

/// The places in which two devices differ.
pub(crate) fn changes(before: &Device, after: &Device) -> Vec<String> {
    diff::diff(before, after).into_iter().map(|change| change.place).collect()
}

/// The text below `in the data sheet:` or `in an overlay:`.
pub(crate) struct Remedy {
    pub(crate) text: String,
    place: Place,
}

#[derive(PartialEq)]
enum Place {
    DataSheet,
    Overlay,
    Encoding,
}

/// The remedies in the help of a finding.
pub(crate) fn remedies(help: &str) -> Vec<Remedy> {
    let mut remedies: Vec<Remedy> = Vec::new();
    for line in help.lines() {
        let place = match line {
            _ if line.ends_with("in the data sheet:") => Place::DataSheet,
            _ if line.ends_with("in an overlay:") => Place::Overlay,
            _ if line.contains("save the file as UTF-8") => Place::Encoding,
            _ => {
                if let Some(remedy) = remedies.last_mut() {
                    remedy.text += &format!("{line}\n");
                }
                continue;
            }
        };
        remedies.push(Remedy { text: String::new(), place });
    }
    remedies
}

impl Remedy {
    pub(crate) fn applied(&self, input: &Input) -> Input {
        let eds = |text: String| Input { eds: Source::new(input.eds.name(), text), ..input.clone() };
        match self.place {
            Place::Encoding => eds(input.eds.text().to_owned()),
            Place::DataSheet => eds(self.edited(input.eds.text())),
            Place::Overlay => {
                let text = format!("[overlay]\nformat = 1\n{}", self.text);
                input.clone().overlay(Source::new("remedy.toml", text))
            }
        }
    }

    /// The text with the changes. Line numbers are those before the changes.
    fn edited(&self, text: &str) -> String {
        let mut lines: Vec<Vec<&str>> = text.lines().map(|line| vec![line]).collect();
        lines.push(Vec::new());
        let number = |text: &str| text.parse::<usize>().expect("a line number") - 1;
        for step in self.text.lines() {
            if let Some((line, becomes)) = step.strip_prefix("line ").and_then(|rest| rest.split_once(": ")) {
                lines[number(line)][0] = becomes;
            } else if let Some((line, added)) = step.strip_prefix("after line ").and_then(|rest| rest.split_once(": "))
            {
                lines[number(line)].push(added);
            } else if let Some((first, last)) = step.strip_prefix("no lines ").and_then(|rest| rest.split_once(" to "))
            {
                lines[number(first)..=number(last)].iter_mut().for_each(Vec::clear);
            } else if let Some(line) = step.strip_prefix("no line ") {
                lines[number(line)].clear();
            } else {
                panic!("{step:?} is no change of a data sheet");
            }
        }
        lines.concat().join("\n") + "\n"
    }

    /// Whether the remedy may affect a part of the device: an overlay, the objects that it names; a change of the data
    /// sheet, the object of the finding or the content of the changed section.
    pub(crate) fn may_change(&self, place: &str, finding: &Diagnostic, input: &Input) -> bool {
        let index = place.split(':').next().unwrap_or_default();
        match self.place {
            Place::Encoding => false,
            Place::Overlay => self.text.contains(&format!("\"{index}")),
            Place::DataSheet => {
                // Parts derived from other sections: the PDO parameters of `CompactPDO`, the list of an object.
                let of_info = matches!(finding.code, "eds::bad-compact-pdo" | "eds::wrong-list")
                    || place == "DeviceInfo"
                    || place == "FileInfo";
                let lines =
                    input.eds.text().lines().take(
                        finding.labels.first().map_or(0, |label| input.eds.position(label.span.start).line as usize),
                    );
                let section = lines.filter(|line| line.trim().starts_with('[')).last().unwrap_or_default();
                of_info || section.trim_start_matches('[').starts_with(index)
            }
        }
    }
}
