//! Reads recipes, which give the target of each drive.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use lexican_driver::Units;
use lexican_machine::Machine;
use serde::{Deserialize, Serialize};
use toml::Spanned;

/// A recipe without mistakes of its own; whether it suits the drives is checked later.
pub(crate) struct Recipe {
    pub(crate) source: Source,
    pub(crate) name: String,
    pub(crate) drives: Vec<Entry>,
}

/// A drive of a recipe.
#[derive(Clone)]
pub(crate) struct Entry {
    /// The name in the machine.
    pub(crate) name: String,
    pub(crate) position: Position,
    /// Whether to wait for SYNC, if the drive supports that.
    pub(crate) sync: bool,
    /// The places of the node and the position in the file.
    pub(crate) node_span: Range<usize>,
    pub(crate) position_span: Range<usize>,
}

/// The target of a drive.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Position {
    Mm(f64),
    Degrees(f64),
    Increments(i32),
}

/// The unit of a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Unit {
    Mm,
    Degrees,
    Increments,
}

/// A mistake, its place in the recipe, and the remedy.
pub(crate) struct Problem {
    pub(crate) what: String,
    pub(crate) span: Range<usize>,
    pub(crate) remedy: String,
}

/// The text of a recipe, to show the lines of problems.
pub(crate) struct Source {
    path: PathBuf,
    text: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    machine: Spanned<PathBuf>,
    #[serde(rename = "drive")]
    drives: Vec<Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    node: Spanned<String>,
    position: Spanned<Position>,
    sync: Option<bool>,
}

impl Recipe {
    /// Reads a recipe and its machine. The error is the text to print.
    pub(crate) fn read(path: &Path) -> Result<(Recipe, Machine), String> {
        let text = std::fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        let source = Source { path: path.to_owned(), text };
        let file: File = toml::from_str(&source.text).map_err(|error| {
            let span = error.span().unwrap_or_default();
            let remedy = "examples/changeover/README.md has the keys of a recipe".to_owned();
            source.report(&[Problem { what: error.message().to_owned(), span, remedy }])
        })?;
        let machine = path.parent().unwrap_or(Path::new("")).join(file.machine.get_ref());
        let machine = Machine::open(&machine).map_err(|error| {
            let remedy = "its path is relative to the recipe".to_owned();
            source.report(&[Problem { what: error.to_string(), span: file.machine.span(), remedy }])
        })?;
        let machine = machine.sound().map_err(|error| error.to_string())?;
        let (mut drives, mut problems) = (Vec::<Entry>::new(), Vec::new());
        for Row { node, position, sync } in file.drives {
            let (span, name) = (node.span(), node.into_inner());
            let wrong = match machine.node(&name) {
                _ if drives.iter().any(|other| other.name == name) => Some(("is in the recipe already", "remove one")),
                Some(node) if node.id.is_some() && node.sheet.is_some() => None,
                Some(_) => Some(("has no node-ID or no data sheet", "give it both in the machine's file")),
                None => Some(("is no node of the machine", "its names are those of the machine's file")),
            };
            if let Some((what, remedy)) = wrong {
                problems.push(Problem { what: format!("{name} {what}"), span, remedy: remedy.to_owned() });
                continue;
            }
            let position_span = position.span();
            let (position, sync) = (position.into_inner(), sync.unwrap_or(true));
            drives.push(Entry { name, position, sync, node_span: span, position_span });
        }
        match problems.is_empty() {
            true => Ok((Recipe { name: file.name, drives, source }, machine)),
            false => Err(source.report(&problems)),
        }
    }
}

impl Position {
    pub(crate) fn unit(self) -> Unit {
        match self {
            Position::Mm(_) => Unit::Mm,
            Position::Degrees(_) => Unit::Degrees,
            Position::Increments(_) => Unit::Increments,
        }
    }

    /// The position in counts of the drive; `None` if the drive cannot express it.
    pub(crate) fn counts(self, units: Option<Units>) -> Option<i32> {
        match self {
            Position::Mm(mm) => units?.position_of_millimetres(mm),
            Position::Degrees(degrees) => units?.position_of_revolutions(degrees / 360.0),
            Position::Increments(increments) => Some(increments),
        }
    }
}

impl Unit {
    /// Converts counts of the drive to this unit.
    pub(crate) fn of(self, counts: i32, units: Option<Units>) -> f64 {
        let value = match self {
            Unit::Mm => units.and_then(|units| units.millimetres(counts)),
            Unit::Degrees => units.map(|units| units.revolutions(counts) * 360.0),
            Unit::Increments => None,
        };
        value.unwrap_or_else(|| counts.into())
    }

    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Unit::Mm => "mm",
            Unit::Degrees => "°",
            Unit::Increments => "increments",
        }
    }

    /// A value with as many decimals as make sense for the unit.
    pub(crate) fn show(self, value: f64) -> String {
        let decimals = if self == Unit::Increments { 0 } else { 2 };
        format!("{value:.decimals$} {}", self.symbol())
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&match *self {
            Position::Mm(value) | Position::Degrees(value) => self.unit().show(value),
            Position::Increments(value) => self.unit().show(value.into()),
        })
    }
}

impl Source {
    /// The problems with their lines, as compilers print them.
    pub(crate) fn report(&self, problems: &[Problem]) -> String {
        let path = self.path.to_string_lossy();
        let renderer = Renderer::plain().decor_style(DecorStyle::Ascii);
        let render = |problem: &Problem| {
            let place = AnnotationKind::Primary.span(problem.span.clone());
            let group = Level::ERROR
                .primary_title(&problem.what)
                .element(Snippet::source(&self.text).path(&*path).annotation(place))
                .element(Level::HELP.message(&problem.remedy));
            renderer.render(&[group]).to_string()
        };
        problems.iter().map(render).collect::<Vec<_>>().join("\n\n")
    }
}
