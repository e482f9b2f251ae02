//! What the manuals of SIKO's drives share beyond those of other drives: tables, and the behaviour that they describe.

pub(crate) mod bits;
pub(crate) mod checks;
pub(crate) mod examples;
pub(crate) mod facts;
pub(crate) mod faults;
pub(crate) mod formats;
pub(crate) mod leds;
pub(crate) mod network;
pub(crate) mod objects;
pub(crate) mod parameters;
pub(crate) mod profibus;
pub(crate) mod rig;
pub(crate) mod serial;
pub(crate) mod statements;
pub(crate) mod states;
pub(crate) mod tables;
pub(crate) mod values;

use rig::Siko;

/// The key of a row as in the AG03/1's manual, where chapter 6 has the parameters, 7 CANopen, and 7.12.2 the objects.
/// For the objects, the number of the chapter is left out.
fn known<D: Siko>(key: &str) -> String {
    let [parameters, network] = D::CHAPTERS;
    let (chapter, subject) = key.split_once(':').unwrap_or((key, ""));
    let (first, rest) = chapter.split_once('.').map_or((chapter, ""), |(first, rest)| (first, rest));
    let first = if first == parameters {
        "6"
    } else if first == network {
        "7"
    } else {
        first
    };
    let rest = if rest.starts_with("12.2.") { "12.2" } else { rest };
    let dot = if rest.is_empty() { "" } else { "." };
    format!("{first}{dot}{rest}:{subject}")
}
