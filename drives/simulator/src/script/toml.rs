//! Scripts as TOML.

use std::borrow::Cow;

use lexican_runtime::Duration;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Condition, Range, Script, Takes, Trigger, listed};

/// Why a script cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}; {remedy}")]
pub struct ScriptError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: String,
    /// What to write instead.
    pub remedy: String,
}

/// The changes of a kind of drive, as scripts write them.
pub trait FromToml: Sized {
    /// The drive; keys and values may depend on it.
    type Model: ?Sized;

    /// The keys. Those of a step take effect in this order, whatever their order in the file.
    fn keys() -> impl Iterator<Item = &'static str>;

    /// The changes that a key and its value in `reading` make.
    fn read(model: &Self::Model, reading: &Reading<'_>) -> Result<Vec<Self>, ScriptError>;

    /// A line of a step, for a message: `battery_v = 2.5`.
    const EXAMPLE: &'static str;
}

impl<C: FromToml> Script<C> {
    /// Reads a script from TOML, for drives of this model.
    pub fn from_toml(model: &C::Model, text: &str) -> Result<Self, ScriptError> {
        let table = DeTable::parse(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            let remedy = "write every step as [[step]] with lines of `key = value` below it";
            wrong(text, at, format!("not TOML: {}", error.message().replace('\n', ", ")), remedy)
        })?;
        let mut script = Script::default();
        let mut last_at_ms = 0;
        for (key, value) in table.get_ref() {
            let steps = value.get_ref().as_array().filter(|_| key.get_ref() == "step").ok_or_else(|| {
                wrong(
                    text,
                    key.span().start,
                    format!("`{}` stands outside of a step", key.get_ref()),
                    "write [[step]] above",
                )
            })?;
            for step in steps {
                let at = step.span().start;
                let table =
                    step.get_ref().as_table().ok_or_else(|| wrong(text, at, "not a step", "write it as [[step]]"))?;
                let reader = Step { text, table };
                let trigger = reader.trigger(at, &mut last_at_ms)?;
                let changes = reader.changes(model)?;
                if changes.is_empty() {
                    return Err(wrong(
                        text,
                        at,
                        "a step that changes nothing",
                        format!("say what happens, such as `{}`", C::EXAMPLE),
                    ));
                }
                script = script.then(trigger, changes);
            }
        }
        if script.steps().is_empty() {
            return Err(wrong(text, 0, "a script without steps", "begin with [[step]]"));
        }
        Ok(script)
    }
}

fn wrong(text: &str, at: usize, problem: impl Into<String>, remedy: impl Into<String>) -> ScriptError {
    let line = 1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    ScriptError { line, problem: problem.into(), remedy: remedy.into() }
}

type Name<'i> = Spanned<Cow<'i, str>>;
type Value<'i> = Spanned<DeValue<'i>>;

const TRIGGERS: [&str; 3] = ["at_ms", "when", "after_ms"];

struct Step<'t, 'i> {
    text: &'t str,
    table: &'t DeTable<'i>,
}

impl<'t, 'i> Step<'t, 'i> {
    fn get(&self, name: &'static str) -> Option<Reading<'t>>
    where
        'i: 't,
    {
        let (key, value) = self.table.iter().find(|(key, _)| key.get_ref() == name)?;
        Some(Reading { text: self.text, key, value })
    }

    fn trigger(&self, at: usize, last_at_ms: &mut u64) -> Result<Trigger, ScriptError> {
        let time = |name| self.get(name).map(|value| value.scaled(1.0, Range::new(0.0, 1e12, "ms"))).transpose();
        let after = time("after_ms")?.map(|ms| Duration::from_millis(ms as u64));
        match (time("at_ms")?, self.get("when")) {
            (Some(_), None) if after.is_some() => {
                Err(wrong(self.text, at, "a step with both `at_ms` and `after_ms`", "keep one of them"))
            }
            (Some(_), Some(_)) => Err(wrong(self.text, at, "a step with both `at_ms` and `when`", "keep one of them")),
            (Some(ms), None) => {
                let ms = ms as u64;
                if ms < *last_at_ms {
                    let problem = format!("{ms} ms is before the {last_at_ms} ms of a step above");
                    return Err(wrong(self.text, at, problem, "write the steps in the order in which they happen"));
                }
                *last_at_ms = ms;
                Ok(Trigger::At(Duration::from_millis(ms)))
            }
            (None, Some(when)) => {
                let condition = when.text().and_then(Condition::named);
                let condition = condition.ok_or_else(|| when.wrong(&listed(Condition::names())))?;
                Ok(Trigger::When { condition, and_then: after.unwrap_or_default() })
            }
            (None, None) => Ok(Trigger::After(after.unwrap_or_default())),
        }
    }

    fn changes<C: FromToml>(&self, model: &C::Model) -> Result<Vec<C>, ScriptError>
    where
        'i: 't,
    {
        let known = || C::keys().chain(TRIGGERS);
        for key in self.table.keys() {
            let name = key.get_ref();
            if !known().any(|known| known == name) {
                let nearest = known().max_by(|a, b| strsim::jaro(a, name).total_cmp(&strsim::jaro(b, name)));
                let near = nearest.filter(|nearest| strsim::jaro(nearest, name) > 0.8);
                let remedy =
                    near.map_or_else(|| format!("there is {}", listed(known())), |near| format!("write `{near}`"));
                return Err(wrong(self.text, key.span().start, format!("no key `{name}`"), remedy));
            }
        }
        let made = C::keys().filter_map(|name| Some(C::read(model, &self.get(name)?)));
        Ok(made.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }
}

/// A key and its value in the text.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'t> {
    text: &'t str,
    key: &'t Name<'t>,
    value: &'t Value<'t>,
}

impl Reading<'_> {
    /// An error about the value; `remedy` is what to write instead.
    #[must_use]
    pub fn wrong(&self, remedy: &str) -> ScriptError {
        let found = self.text.get(self.value.span()).unwrap_or_default();
        let problem = format!("`{}` cannot be {found}", self.key.get_ref());
        wrong(self.text, self.key.span().start, problem, format!("write {remedy}"))
    }

    /// The key, as it is written.
    #[must_use]
    pub fn key(&self) -> &str {
        self.key.get_ref()
    }

    /// The value as a text, if it is one.
    #[must_use]
    pub fn text(&self) -> Option<&str> {
        self.value.get_ref().as_str()
    }

    /// The value without quotes: a text as it is, a number in decimal, `true` or `false`.
    #[must_use]
    pub fn plain(&self) -> String {
        match self.value.get_ref() {
            DeValue::String(text) => text.to_string(),
            DeValue::Boolean(flag) => flag.to_string(),
            _ => self.number().map_or_else(String::new, |number| number.to_string()),
        }
    }

    /// Whether the value is this text.
    #[must_use]
    pub fn is(&self, word: &str) -> bool {
        self.text() == Some(word)
    }

    /// The value, if it is `true` or `false`.
    pub fn flag(&self) -> Result<bool, ScriptError> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong(&Takes::Flag.to_string()))
    }

    /// The value, if it is a number.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self.value.get_ref() {
            DeValue::Integer(number) => {
                i64::from_str_radix(number.as_str(), number.radix()).ok().map(|number| number as f64)
            }
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        }
    }

    /// A number within a range, multiplied by `scale` and rounded.
    pub fn scaled(&self, scale: f64, range: Range) -> Result<f64, ScriptError> {
        self.within(scale, range).ok_or_else(|| self.wrong(&Takes::Number(range, None).to_string()))
    }

    /// The same, or `None` for `word`.
    pub fn scaled_or(&self, word: &'static str, scale: f64, range: Range) -> Result<Option<f64>, ScriptError> {
        let number = if self.is(word) { Some(None) } else { self.within(scale, range).map(Some) };
        number.ok_or_else(|| self.wrong(&Takes::Number(range, Some(word)).to_string()))
    }

    fn within(&self, scale: f64, Range { low, high, .. }: Range) -> Option<f64> {
        self.number().filter(|number| (low..=high).contains(number)).map(|number| (number * scale).round())
    }

    /// The meaning of the value, which has to be one of these words.
    pub fn of<T: Copy>(&self, words: &[(&'static str, T)]) -> Result<T, ScriptError> {
        let word = words.iter().find(|(word, _)| self.is(word));
        word.map(|(_, meaning)| *meaning).ok_or_else(|| self.wrong(&Takes::words(words).to_string()))
    }
}
