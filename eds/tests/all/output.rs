//! Findings and devices in formats for other programs.

use lexican_eds::report::sarif;
use lexican_eds::{Input, Severity, Source, dump, load};
use serde_json::json;

const EDS: &str =
    "[2000]\nParameterName=Größe, \"x\"\nObjectType=7\nDataType=6\nAccessType=rw\nLowLimit=10\nHighLimit=1\n";

fn input() -> Input {
    Input::new(Source::new("x.eds", EDS))
}

#[test]
fn json_names_places_from_one() {
    let input = input();
    let (_, mut diagnostics) = load(&input);
    for code in ["eds::missing-section", "cia301::missing-object", "cia301::no-error-control", "eds::object-not-listed"]
    {
        diagnostics.allow(code);
    }
    let expected = json!([{
        "code": "eds::limits-reversed",
        "severity": "warning",
        "message": "the limits of 2000:00 are reversed",
        "file": "x.eds",
        "line": 6,
        "column": 10,
        "labels": [
            { "file": "x.eds", "line": 6, "column": 10, "end_line": 6, "end_column": 12, "primary": true, "text": "the low one" },
            { "file": "x.eds", "line": 7, "column": 11, "end_line": 7, "end_column": 12, "primary": false, "text": "the high one" },
        ],
        "help": "if they are only exchanged, in an overlay:\n[object.\"2000\"]\nreason = \"…\"\nlow = 1\nhigh = 10",
    }]);
    assert_eq!(diagnostics.to_json(&input), expected);
}

#[test]
fn sarif_holds_rules_and_results() {
    let input = input();
    let (_, diagnostics) = load(&input);
    let log = sarif([(&input, &diagnostics)]);
    let run = &log["runs"][0];
    assert_eq!(log["version"], "2.1.0");
    assert_eq!(run["results"].as_array().map(Vec::len), Some(diagnostics.len()));
    let result =
        run["results"].as_array().into_iter().flatten().find(|result| result["ruleId"] == "eds::limits-reversed");
    let region = &result.expect("it is among the results")["locations"][0]["physicalLocation"]["region"];
    assert_eq!((&region["startLine"], &region["startColumn"]), (&json!(6), &json!(10)));
    for rule in run["tool"]["driver"]["rules"].as_array().into_iter().flatten() {
        assert!(rule["fullDescription"]["text"].is_string(), "{rule}");
    }
}

#[test]
fn sarif_names_files_by_uri() {
    let uri = |name: &str| {
        let input = Input::new(Source::new(name, "x"));
        let log = load(&input).1.to_sarif(&input);
        let place = &log["runs"][0]["results"][0]["locations"][0]["physicalLocation"];
        place["artifactLocation"]["uri"].as_str().map(str::to_owned)
    };
    assert_eq!(uri("eds/drive-2_a.eds").as_deref(), Some("eds/drive-2_a.eds"));
    assert_eq!(uri("a drive#1 100%: ü.eds").as_deref(), Some("a%20drive%231%20100%25%3A%20%C3%BC.eds"));
}

#[test]
fn what_a_terminal_would_obey_is_shown_and_not_sent() {
    let input =
        Input::new(Source::new("x.eds", "[2000]\nParameterName=a\u{1b}[31mb\nKey\u{1b}]0;title\u{7}\u{9b}=1\n"));
    let (device, diagnostics) = load(&input);
    let short: String = diagnostics.iter().map(|finding| finding.render_short(&input) + "\n").collect();
    assert!(short.contains("`Key␛]0;title␇\u{FFFD}`"), "{short}");
    for text in [short, diagnostics.render(&input), dump::md(&device)] {
        assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
    }
}

#[test]
fn what_is_missing_from_the_whole_file_is_accepted_at_no_object() {
    let input = Input::new(Source::new("x.eds", "[1000]\n"));
    let (_, diagnostics) = load(&input);
    let missing = diagnostics.iter().find(|finding| finding.code == "eds::missing-section").expect("it is found");
    assert_eq!(
        missing.help.as_deref(),
        Some("no overlay is needed for it; mend the file for the sake of other readers")
    );
}

#[test]
fn severities_are_changed_by_code() {
    let (_, mut diagnostics) = load(&input());
    assert!(!diagnostics.has_errors());
    diagnostics.deny("eds::limits-reversed");
    assert_eq!((diagnostics.count(Severity::Error), diagnostics.worst()), (1, Some(Severity::Error)));
    diagnostics.allow("eds::limits-reversed");
    assert!(!diagnostics.has_errors());
}

#[test]
fn one_line_says_where_and_what() {
    let input = input();
    let (_, diagnostics) = load(&input);
    let finding = diagnostics.iter().find(|finding| finding.code == "eds::limits-reversed").expect("it is found");
    assert_eq!(
        finding.render_short(&input),
        "x.eds:6:10: warning[eds::limits-reversed]: the limits of 2000:00 are reversed"
    );
}

#[test]
fn tables_quote_what_they_must() {
    let (device, _) = load(&input());
    assert_eq!(
        dump::csv(&device),
        "index,subindex,name,object_type,data_type,access,pdo_mapping,default,low_limit,high_limit,configured,obj_flags\n\
         2000,00,\"Größe, \"\"x\"\"\",VAR,UNSIGNED16,rw,0,,10,1,,0\n"
    );
    assert!(dump::md(&device).contains("| 2000 | 00 | Größe, \"x\" | VAR |"));
    let record = "[2001]\nParameterName=Gear\nObjectType=9\nSubNumber=1\n[2001sub1]\nParameterName=Ratio\nDataType=5\n";
    let (record, _) = load(&Input::new(Source::new("x.eds", record)));
    assert!(dump::md(&record).contains("| 2001 | 01 | Gear: Ratio | RECORD |"));
    assert!(dump::csv(&record).contains("2001,01,Ratio,RECORD,"));
    assert_eq!(dump::json(&device)["objects"][0]["entries"][0]["low_limit"], json!(10));
}
