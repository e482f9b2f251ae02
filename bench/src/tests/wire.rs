//! What the page takes from the bench: the types of what they say to each other (`page/src/wire.d.ts`), and the words that both need
//! (`page/src/words.js`).

use std::collections::BTreeMap;

use lexican_runtime::profile::cia402::{State, Transitions};
use lexican_toolbox::drive::Verb;
use lexican_toolbox::log::Format;
use serde::Serialize;
use ts_rs::{Config, TS, TypeVisitor};

use crate::columns::TRACE;
use crate::orders::ORDERS;
use crate::request::Request;
use crate::view::{TraceFilter, View};
use crate::web::ToPage;

const MADE: &str = "// Made of the bench's types: LEXICAN_BLESS=1 cargo test -p lexican-bench golden";

/// Declarations by name.
struct Types {
    config: Config,
    found: BTreeMap<String, String>,
}

impl TypeVisitor for Types {
    fn visit<T: TS + 'static + ?Sized>(&mut self) {
        // Only what is derived has a file of its own.
        if T::output_path().is_none() {
            return;
        }
        let (name, docs) = (T::ident(&self.config), T::docs().unwrap_or_default());
        let declaration = format!("{docs}export {}\n", T::decl(&self.config));
        if self.found.insert(name, declaration).is_none() {
            T::visit_dependencies(self);
        }
    }
}

fn compare(name: &str, text: &str) {
    let path = format!("{}/page/src/{name}", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let present = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(present == text, "{path} is out of date: LEXICAN_BLESS=1 cargo test -p lexican-bench golden");
}

fn union(words: impl Iterator<Item = String>) -> String {
    words.map(|word| format!("{word:?}")).collect::<Vec<_>>().join(" | ")
}

fn constant(name: &str, kind: &str, value: &impl Serialize) -> String {
    format!("/** @type {{{kind}}} */\nexport const {name} = {}\n", serde_json::to_string(value).unwrap())
}

#[test]
fn golden_types_of_the_page() {
    let mut types = Types { config: Config::new().with_large_int("number"), found: BTreeMap::new() };
    types.visit::<View>();
    types.visit::<Request>();
    types.visit::<ToPage>();
    let verbs = union(Verb::ALL.iter().filter(|verb| **verb != Verb::Watch).map(|verb| verb.word().to_owned()));
    let states = union(State::ALL.iter().map(State::to_string));
    let found: Vec<_> = types.found.into_values().collect();
    let named = format!("export type State = {states};\n\nexport type Verb = {verbs};\n");
    compare("wire.d.ts", &format!("{MADE}\n\n{}\n{named}", found.join("\n")));
}

#[test]
fn golden_words_of_the_page() {
    let mut text = format!("{MADE}\n\n");
    // Several commands have the same arrow.
    let mut transitions: Vec<_> =
        Transitions::CIA_402.0.iter().map(|it| (it.number, it.from.to_string(), it.to.to_string())).collect();
    transitions.dedup();
    let formats: Vec<_> = Format::all().map(|format| format.to_string()).collect();
    text += &constant("EMPTY", "import('./wire').View", &View::default());
    let filter = TraceFilter { transfers: true, ..TraceFilter::default() };
    text += &constant("NO_FILTER", "import('./wire').TraceFilter", &filter);
    text += &constant("FORMATS", "string[]", &formats);
    text += &constant("TRANSITIONS", "[number, import('./wire').State, import('./wire').State][]", &transitions);
    let column = "{ name: keyof import('./wire').Row, titles: string[], page: string | null }[]";
    text += &constant("TRACE_COLUMNS", column, &TRACE);
    let order = "{ verb: import('./wire').Verb, group: string, titles: string[], help: string[] }[]";
    text += &constant("ORDERS", order, &ORDERS);
    compare("words.js", &text);
}
