//! What else is on the bus changes no verdict: each case listens to its own service.

use crate::faulty::State::{Operational, PreOperational, Stopped};
use crate::faulty::{Fault, every_ms, fault};
use crate::{SUBJECTS, name, sheet};

const RESET: &[&str] = &["000#8105"];
/// A device that loses its node-ID has no heartbeat.
const LOSES_ID: &str = "7E5#11FF*";

/// What is injected, how frames begin by which a case has to do with it, and the cases that are about its absence.
const NOISE: &[(&[&str], Fault)] = &[
    (
        &["705#R", "705#7", "705#F"],
        fault(
            "heartbeats of the device",
            &[
                every_ms(64, "705#7F").when(PreOperational).after(RESET).until(LOSES_ID),
                every_ms(64, "705#05").when(Operational).after(RESET).until(LOSES_ID),
                every_ms(64, "705#04").when(Stopped).after(RESET).until(LOSES_ID),
            ],
            "7.202 305/6.4.2/4",
        ),
    ),
    (&["080#"], fault("SYNC of the device", &[every_ms(3, "080#").after(RESET)], "9.4")),
    (&["100#"], fault("TIME", &[every_ms(4, "100#0000000000C0").after(RESET)], "")),
    (
        &["085#"],
        fault("emergencies of the device", &[every_ms(40, "085#0050010000000000").after(RESET).until(LOSES_ID)], ""),
    ),
    (
        &["385#"],
        fault(
            "another TPDO of the device",
            &[every_ms(4, "385#0102").after(RESET).until(LOSES_ID)],
            "3.11 3.12 3.14 3.17 3.18 3.20",
        ),
    ),
    (
        &["703#", "603#", "583#", "083#", "183#", "203#"],
        fault(
            "another node",
            &[
                every_ms(9, "703#05").after(RESET),
                every_ms(2, "603#4000100000000000").after(RESET),
                every_ms(2, "583#4300100092010000").after(RESET),
                every_ms(5, "083#3081110000000000").after(RESET),
                every_ms(3, "183#0102").after(RESET),
                every_ms(3, "203#0102").after(RESET),
            ],
            "",
        ),
    ),
];

#[test]
fn other_traffic_changes_no_verdict() {
    let (mut runs, mut wrong) = (0, Vec::new());
    for subject in &SUBJECTS {
        let sheet = sheet(subject.data_sheet);
        for case in subject.cases() {
            let (quiet, frames) = subject.run(case, &sheet, None);
            for (own, noise) in NOISE {
                let has_to_do = |frame: &String| own.iter().any(|begin| frame.starts_with(begin));
                if frames.iter().any(has_to_do) || noise.fails.split(' ').any(|id| id == name(case)) {
                    continue;
                }
                runs += 1;
                let (loud, _) = subject.run(case, &sheet, Some(noise));
                if loud != quiet {
                    wrong.push(format!("{} with {}: {loud:?}", name(case), noise.title));
                }
            }
        }
    }
    assert!(runs > 500, "{runs}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
