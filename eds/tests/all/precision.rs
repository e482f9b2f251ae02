//! The precision of the rules: a random sample of findings in real data sheets, each labelled by a person.
//!
//! `precision.csv` has one line for each finding: the data sheet by the FNV-1a of its bytes (vendors' files are not
//! ours to commit), the line in it, the code, the label, and the reason. `right` is true and worth reading, `noise` is
//! true but of no consequence or a matter of taste, `wrong` is false or has a harmful remedy. What a machine can judge
//! is tested without labels: after applying a remedy, the finding is gone, there is no new one, and the device differs
//! only in what the remedy names.
//!
//! `LEXICAN_DRAW=1 cargo test -p lexican-eds --test all precision -- --nocapture` draws the sample and prints findings
//! without a label.

use crate::corpus_files;
use std::collections::BTreeMap;
use std::{env, fs};

use crate::remedy::{changes, count, remedies};
use lexican_eds::{Diagnostic, Diagnostics, Input, Source, load};

/// The number of findings in the sample.
const SAMPLE: usize = 210;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Label {
    Right,
    Noise,
    Wrong,
}

struct Labelled<'a> {
    sheet: u64,
    line: u32,
    code: &'a str,
    label: Label,
}

fn labelled() -> Vec<Labelled<'static>> {
    let row = |row: &'static str| {
        let mut cells = row.splitn(5, ',');
        let mut next = || cells.next().unwrap_or_else(|| panic!("{row:?} is no row"));
        Labelled {
            sheet: u64::from_str_radix(next(), 16).expect("a hash"),
            line: next().parse().expect("a line"),
            code: next(),
            label: match next() {
                "right" => Label::Right,
                "noise" => Label::Noise,
                "wrong" => Label::Wrong,
                other => panic!("{other:?} is no label"),
            },
        }
    };
    include_str!("../precision.csv").lines().skip(1).map(row).collect()
}

#[test]
fn findings_in_real_data_sheets_are_right() {
    let labelled = labelled();
    assert!(labelled.len() >= 200, "{} findings are labelled", labelled.len());
    let Some(sheets) = sheets() else { return };
    if env::var_os("LEXICAN_DRAW").is_some() {
        draw(&sheets);
    }
    let mut found = BTreeMap::new();
    let mut faults = Vec::new();
    let (mut remedied, mut harmful) = (0, 0);
    for Labelled { sheet, line, code, label } in labelled {
        let Some(input) = sheets.get(&sheet) else { continue };
        let (_, findings) = load(input);
        let Some(finding) = findings.iter().find(|it| it.code == code && line_of(it, input) == line) else {
            if label == Label::Right {
                faults.push(format!("{sheet:016x},{line},{code} is no longer found"));
            }
            continue;
        };
        *found.entry(label as u8).or_insert(0) += 1;
        for fault in judged(input, &findings, finding, &mut remedied) {
            harmful += 1;
            faults.push(fault);
        }
    }
    let of = |label: Label| found.get(&(label as u8)).copied().unwrap_or(0);
    let (right, noise, wrong) = (of(Label::Right), of(Label::Noise), of(Label::Wrong));
    println!("{right} right, {noise} noise, {wrong} wrong; {remedied} remedies applied, {harmful} of them do harm");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(wrong == 0 && noise * 20 <= right + noise, "{noise} noise and {wrong} wrong of {}", right + noise + wrong);
}

/// The undesired effects of a finding's remedies.
fn judged(input: &Input, findings: &Diagnostics, finding: &Diagnostic, applied: &mut usize) -> Vec<String> {
    let (device, _) = load(input);
    let mut faults = Vec::new();
    for remedy in remedies(finding.help.as_deref().unwrap_or_default()) {
        *applied += 1;
        let (after, left) = load(&remedy.applied(input));
        let mut fault =
            |what: String| faults.push(format!("{what}:\n{}with\n{}", finding.render_short(input), remedy.text));
        if count(&left, finding) >= count(findings, finding) {
            fault("is not gone".to_owned());
        }
        for other in left.iter().filter(|other| count(&left, other) > count(findings, other)) {
            fault(format!("now {}: {}", other.code, other.message));
        }
        for place in changes(&device, &after).iter().filter(|place| !remedy.may_change(place, finding, input)) {
            fault(format!("changes {place}"));
        }
    }
    faults
}

/// At most one finding of each code in each data sheet is drawn, however often it occurs there.
fn draw(sheets: &BTreeMap<u64, Input>) {
    let labels: BTreeMap<(u64, u32, &str), Label> =
        labelled().into_iter().map(|it| ((it.sheet, it.line, it.code), it.label)).collect();
    let mut drawn = Vec::new();
    for (&sheet, input) in sheets {
        let (_, findings) = load(input);
        let mut of_code: BTreeMap<&str, (u64, &Diagnostic)> = BTreeMap::new();
        for finding in findings.iter() {
            let lot = mixed(fnv(format!("{sheet:x} {} {}", finding.code, line_of(finding, input)).as_bytes()));
            let best = of_code.entry(finding.code).or_insert((lot, finding));
            if lot < best.0 {
                *best = (lot, finding);
            }
        }
        drawn.extend(of_code.into_values().map(|(lot, finding)| (lot, sheet, finding.clone())));
    }
    drawn.sort_by_key(|(lot, sheet, _)| (*lot, *sheet));
    let all = drawn.len();
    for (number, (_, sheet, finding)) in drawn.into_iter().take(SAMPLE).enumerate() {
        let (input, line) = (&sheets[&sheet], line_of(&finding, &sheets[&sheet]));
        let label = labels.get(&(sheet, line, finding.code));
        println!("#{number} of {all}: {sheet:016x},{line},{} {label:?}", finding.code);
        if label.is_none() {
            println!("{}{}", input.eds.name(), finding.render(input));
        }
    }
}

fn line_of(finding: &Diagnostic, input: &Input) -> u32 {
    finding.span().map_or(0, |span| input.eds.position(span.start).line)
}

/// The data sheets of the corpus by their hashes.
fn sheets() -> Option<BTreeMap<u64, Input>> {
    let read = |path: &std::path::PathBuf| {
        let bytes = fs::read(path).expect("the corpus is readable");
        let is_sheet =
            path.extension().is_some_and(|it| it.eq_ignore_ascii_case("eds") || it.eq_ignore_ascii_case("dcf"));
        is_sheet.then(|| (fnv(&bytes), Input::new(Source::from_bytes(path.to_string_lossy(), &bytes))))
    };
    Some(corpus_files::corpus()?.iter().filter_map(read).collect())
}

fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3))
}

/// The finaliser of SplitMix64. It is needed because hashes of similar texts share their high bits.
fn mixed(hash: u64) -> u64 {
    let hash = (hash ^ hash >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let hash = (hash ^ hash >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    hash ^ hash >> 31
}
