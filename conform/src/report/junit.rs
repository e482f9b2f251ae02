//! The report as XML for build servers.

use std::fmt::Write as _;

use lexican_eds::text::escaped;

use super::{Document, Row};

/// How many frames before the end of a case are shown in its failure.
const EXCERPT: usize = 24;

impl Document {
    /// As JUnit XML: a suite with the cases, grouped by the clauses of the standards.
    #[must_use]
    pub fn junit(&self) -> String {
        page(self)
    }
}

fn page(document: &Document) -> String {
    let (tally, cases) = (document.sum.tally, &document.cases);
    let skipped = tally.known + tally.not_applicable + tally.not_allowed + tally.blocked + tally.not_decidable;
    let time: f64 = cases.iter().map(|row| row.seconds).sum();
    let name = escaped(&format!("{}, node {}", document.about.device, document.about.node));
    let mut page = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    // Writing to a string does not fail.
    let _ = writeln!(
        page,
        "  <testsuite name=\"{name}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{skipped}\" time=\"{time:.3}\">",
        cases.len(),
        tally.failed,
        tally.unfinished,
    );
    let about = &document.about;
    page.push_str("    <properties>\n");
    let head = [("verdict", document.sum.overall), ("data sheet", &about.data_sheet), ("tester", &about.tester)];
    let facts = about.facts.iter().map(|(name, text)| (&**name, &**text));
    let remarks = about.remarks.iter().map(|text| ("remark", &**text));
    for (name, text) in head.into_iter().chain(facts).chain(remarks) {
        let _ = writeln!(page, "      <property name=\"{}\" value=\"{}\"/>", escaped(name), escaped(text));
    }
    page.push_str("    </properties>\n");
    for row in cases {
        let (clause, number) = row.id.rsplit_once('/').unwrap_or(("", row.id));
        let _ = write!(
            page,
            "    <testcase classname=\"{}\" name=\"{number}: {}\" time=\"{:.3}\"",
            escaped(clause),
            escaped(row.title),
            row.seconds
        );
        let element = match row.verdict {
            "failed" => "failure",
            "unfinished" => "error",
            "known" | "not applicable" | "not allowed" | "blocked" | "not decidable" => "skipped",
            _ => "",
        };
        if element.is_empty() && row.reason.is_empty() {
            page.push_str("/>\n");
            continue;
        }
        page.push_str(">\n");
        let known = row.known.as_ref().map(|why| format!(" (known: {why})")).unwrap_or_default();
        let blocked = if row.verdict == "blocked" { "blocked " } else { "" };
        let reason = escaped(&format!("{blocked}{}{known}", row.reason));
        let _ = match element {
            "" => writeln!(page, "      <system-out>recommended: {reason}</system-out>"),
            "skipped" => writeln!(page, "      <skipped message=\"{reason}\"/>"),
            element => writeln!(
                page,
                "      <{element} message=\"{reason}\">{}</{element}>",
                escaped(&requirement(row)) + &escaped(&excerpt(row))
            ),
        };
        page.push_str("    </testcase>\n");
    }
    for text in document.sum.not_put_back.iter().chain(&document.sum.findings) {
        let _ = writeln!(page, "    <system-err>{}</system-err>", escaped(text));
    }
    page.push_str("  </testsuite>\n</testsuites>\n");
    page
}

/// The requirement of the clause, and the accepted answers.
fn requirement(row: &Row) -> String {
    let expected: String = row.expected.iter().map(|set| format!("expected: {set}\n")).collect();
    format!("{}: {}\n{expected}", row.clause, row.requirement)
}

fn excerpt(row: &Row) -> String {
    let first = row.frames.len().saturating_sub(EXCERPT);
    let mut text = String::new();
    for line in &row.frames[first..] {
        let way = if line.sent { ">" } else { "<" };
        let _ = writeln!(text, "{:10.6} {way} {:<24} {}", line.seconds, line.frame, line.words);
    }
    text
}
