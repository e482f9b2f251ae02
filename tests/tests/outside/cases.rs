//! The golden cases of generated code, `golden/<case>.txt`. Each has up to five parts:
//!
//! - `generate:` and the options that differ from a new `Config`: `storage`, `names`, `driver`;
//! - the difference of its data sheet from that of `golden/base.txt`: a line for each section, such as
//!   `[2000] Speed ; DataType=3`, where the first word of an object is its name. Unless the line says otherwise, an
//!   object is a variable that cannot be mapped, and it is listed by its index. `file:` and the path of a data sheet
//!   instead;
//! - `overlay:` and the overlay;
//! - `findings:` and the findings of the generator, and on a line each those of the reader;
//! - `code:` and the generated items that the base does not have. Of a table that both have, only the rows that differ.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{env, fs};

use lexican_codegen::{Options, compile};
use lexican_eds::{Input, Source};

/// A golden case.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    /// The part from which it generates.
    given: String,
    /// The whole file.
    pub(crate) text: String,
}

type Keys = Vec<(String, String)>;
type Sections = Vec<(String, Keys)>;

/// All cases, by name.
pub(crate) fn cases() -> Vec<Case> {
    let entries = fs::read_dir(folder()).expect("tests/golden can be read");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("tests/golden can be read").path()).collect();
    paths.sort();
    paths.into_iter().map(Case::read).collect()
}

/// One case.
pub(crate) fn case(name: &str) -> Case {
    Case::read(folder().join(format!("{name}.txt")))
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

impl Case {
    fn read(path: PathBuf) -> Case {
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let given = text.split("findings:\n").next().unwrap_or_default().to_owned();
        Case { name, path, given, text }
    }

    /// A case without a file.
    pub(crate) fn of(name: &str, given: String) -> Case {
        Case { name: name.to_owned(), path: PathBuf::new(), text: String::new(), given }
    }

    /// The data sheet with its overlay, under paths in `place`.
    pub(crate) fn input(&self, place: &str) -> Input {
        let (sheet, overlay) = match self.given.split_once("overlay:\n") {
            Some((sheet, overlay)) => (sheet, Some(overlay)),
            None => (self.given.as_str(), None),
        };
        let file = sheet.lines().find_map(|line| line.strip_prefix("file: "));
        let eds = match file {
            Some(file) => fs::read_to_string(folder().join(file)).expect("the data sheet of a case can be read"),
            None => {
                let base = merged(Sections::new(), sections(&case("base").given));
                written(&merged(base, sections(sheet)))
            }
        };
        let input = Input::new(Source::new(format!("{place}input.eds"), eds));
        match overlay {
            Some(overlay) => input.overlay(Source::new(format!("{place}overlay.toml"), overlay)),
            None => input,
        }
    }

    fn options(&self) -> Options {
        let wanted = self.given.lines().find_map(|line| line.strip_prefix("generate: ")).unwrap_or_default();
        let has = |option: &str| wanted.split(", ").any(|wanted| wanted == option);
        Options { storage: has("storage"), names: has("names"), driver: has("driver"), ..Options::default() }
    }

    /// The code.
    pub(crate) fn code(&self) -> String {
        self.code_of(&self.input(""))
    }

    /// The code of an input.
    pub(crate) fn code_of(&self, input: &Input) -> String {
        compile(&lexican_eds::load(input).0, &self.options()).code
    }

    /// The content that the file should have.
    pub(crate) fn expected(&self) -> String {
        let input = self.input("");
        let (device, read) = lexican_eds::load(&input);
        let output = compile(&device, &self.options());
        let read: Vec<String> = read.iter().map(|finding| finding.render_short(&input) + "\n").collect();
        let base = match self.name.as_str() {
            "base" => String::new(),
            _ => compile(&lexican_eds::load(&case("base").input("")).0, &self.options()).code,
        };
        let found = output.diagnostics.render(&input);
        format!("{}findings:\n{found}{}code:\n{}", self.given, read.concat(), difference(&output.code, &base))
    }
}

/// The sections of a case.
fn sections(text: &str) -> Sections {
    let lines = text.lines().take_while(|line| *line != "overlay:").filter(|line| line.starts_with('['));
    let section = |line: &str| {
        let (name, rest) = line[1..].split_once("] ").expect("a section and its keys");
        let mut keys = Keys::new();
        for (number, part) in rest.split(" ; ").enumerate() {
            match part.split_once('=').filter(|_| number > 0 || !is_object(name)) {
                Some((key, value)) => keys.push((key.to_owned(), value.to_owned())),
                None => keys.push(("ParameterName".into(), part.to_owned())),
            }
        }
        (name.to_owned(), keys)
    };
    lines.map(section).collect()
}

fn is_object(section: &str) -> bool {
    section.as_bytes().first_chunk::<4>().is_some_and(|index| index.iter().all(u8::is_ascii_hexdigit))
}

/// The base with the changes of a case: whole objects, but only the named keys of other sections.
fn merged(mut base: Sections, changes: Sections) -> Sections {
    for (name, keys) in changes {
        match base.iter_mut().find(|(known, _)| *known == name) {
            Some((_, known)) if !is_object(&name) => {
                known.retain(|(key, _)| keys.iter().all(|(changed, _)| changed != key));
                known.extend(keys);
            }
            Some((_, known)) => *known = keys,
            None => base.push((name, keys)),
        }
    }
    base
}

/// As the text of a data sheet.
fn written(sections: &Sections) -> String {
    let mut lists: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for list in ["MandatoryObjects", "ManufacturerObjects", "OptionalObjects"] {
        lists.insert(list, Vec::new());
    }
    let mut text = String::new();
    for (name, keys) in sections {
        if name.len() == 4 && is_object(name) {
            let list = match name.as_str() {
                "1000" | "1001" | "1018" => "MandatoryObjects",
                index if ("2000"..="5FFF").contains(&index) => "ManufacturerObjects",
                _ => "OptionalObjects",
            };
            lists.entry(list).or_default().push(name);
        }
        text.extend(["[", name, "]\n"]);
        let mut line = |key: &str, value: &str| text.extend([key, "=", value, "\n"]);
        keys.iter().for_each(|(key, value)| line(key, value));
        let lacks = |key: &str| keys.iter().all(|(known, _)| known != key);
        if is_object(name) && lacks("ObjectType") {
            line("ObjectType", "7");
        }
        if is_object(name) && lacks("PDOMapping") && lacks("SubNumber") {
            line("PDOMapping", "0");
        }
        text.push('\n');
    }
    for (list, indices) in lists {
        text += &format!("[{list}]\nSupportedObjects={}\n", indices.len());
        for (index, number) in indices.iter().zip(1..) {
            text += &format!("{number}=0x{index}\n");
        }
        text.push('\n');
    }
    text
}

/// The items that the base does not have. Of a table in the base, only the rows that differ.
fn difference(code: &str, base: &str) -> String {
    let base = items(base);
    let mut shown = Vec::new();
    for item in items(code) {
        if base.contains(&item) {
            continue;
        }
        let declared = |item: &str| item.lines().find(|line| line.starts_with("pub static")).map(str::to_owned);
        let table = declared(item).and_then(|line| base.iter().find(|known| declared(known).as_ref() == Some(&line)));
        shown.push(match table {
            Some(table) => {
                let is_row = |line: &str| line.starts_with(' ') && line.ends_with("),");
                let differs = |line: &&str| !is_row(line) || table.lines().all(|known| known != *line);
                item.lines().filter(differs).collect::<Vec<_>>().join("\n")
            }
            None => item.to_owned(),
        });
    }
    shown.join("\n\n") + "\n"
}

/// Items at the top of a file.
fn items(code: &str) -> Vec<&str> {
    let mut items = Vec::new();
    let mut rest = code.trim_end();
    let mut from = 0;
    while let Some(at) = rest[from..].find("\n\n").map(|at| from + at) {
        if rest[at + 2..].starts_with([' ', '\n']) {
            from = at + 2;
        } else {
            items.push(&rest[..at]);
            (rest, from) = (&rest[at + 2..], 0);
        }
    }
    items.push(rest);
    items
}
