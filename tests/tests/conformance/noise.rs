//! Other traffic on the bus changes no verdict: each case listens only to its own service.

use crate::faulty::fault;
use crate::{NONE, SUBJECTS, name, sheet};

/// The injected traffic, the beginnings of frames by which a case is concerned with it, its rules, and the cases about
/// its absence. A device that loses its node-ID (`7E5#11FF`) has no heartbeat.
const NOISE: &[(&str, &[&str], &str, &str)] = &[
    (
        "heartbeats of the device",
        &["705#R", "705#7", "705#F"],
        "every 64 brings 705#7F in PRE-OPERATIONAL after 000#8105 until 7E5#11FF*; \
         every 64 brings 705#05 in OPERATIONAL after 000#8105 until 7E5#11FF*; \
         every 64 brings 705#04 in STOPPED after 000#8105 until 7E5#11FF*",
        "7.202 305/6.4.2/4",
    ),
    ("SYNC of the device", &["080#"], "every 3 brings 080# after 000#8105", "9.4"),
    ("TIME", &["100#"], "every 4 brings 100#0000000000C0 after 000#8105", ""),
    ("emergencies of the device", &["085#"], "every 40 brings 085#0050010000000000 after 000#8105 until 7E5#11FF*", ""),
    (
        "another TPDO of the device",
        &["385#"],
        "every 4 brings 385#0102 after 000#8105 until 7E5#11FF*",
        "3.11 3.12 3.14 3.17 3.18 3.20",
    ),
    (
        "another node",
        &["703#", "603#", "583#", "083#", "183#", "203#"],
        "every 9 brings 703#05 after 000#8105; every 2 brings 603#4000100000000000 after 000#8105; \
         every 2 brings 583#4300100092010000 after 000#8105; every 5 brings 083#3081110000000000 after 000#8105; \
         every 3 brings 183#0102 after 000#8105; every 3 brings 203#0102 after 000#8105",
        "",
    ),
];

#[test]
fn other_traffic_changes_no_verdict() {
    let (mut runs, mut wrong) = (0, Vec::new());
    for subject in &SUBJECTS {
        let sheet = sheet(subject.data_sheet);
        for case in subject.cases() {
            let (quiet, frames) = subject.run(case, &sheet, &NONE);
            for &(title, own, rules, about) in NOISE {
                let has_to_do = |frame: &String| own.iter().any(|begin| frame.starts_with(begin));
                if frames.iter().any(has_to_do) || about.split(' ').any(|id| id == name(case)) {
                    continue;
                }
                runs += 1;
                let (loud, _) = subject.run(case, &sheet, &fault(rules));
                if loud != quiet {
                    wrong.push(format!("{} with {}: {loud:?}", name(case), title));
                }
            }
        }
    }
    assert!(runs > 500, "{runs}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
