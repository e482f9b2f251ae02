//! What can be done to a drive, as data for buttons and messages.

/// A key of a drive's scripts, described.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The key.
    pub name: &'static str,
    /// Its allowed values.
    pub takes: Takes,
    /// Its meaning, in words.
    pub what: &'static str,
    /// The present value as [`Input::line`] takes it; `None` for a key that acts once, or whose value does not show.
    pub value: Option<String>,
}

/// What a key takes.
#[derive(Clone, Debug, PartialEq)]
pub enum Takes {
    /// `true` or `false`.
    Flag,
    /// One of these words.
    Words(Vec<&'static str>),
    /// A number, or a word that means none.
    Number(Range, Option<&'static str>),
    /// Anything else, described in words: `ten digits, SW1 first`.
    Text(&'static str),
}

/// The numbers that a key takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The lowest.
    pub low: f64,
    /// The highest.
    pub high: f64,
    /// What it is measured in.
    pub unit: &'static str,
}

impl Range {
    /// From `low` to `high`.
    #[must_use]
    pub const fn new(low: f64, high: f64, unit: &'static str) -> Self {
        Range { low, high, unit }
    }
}

impl Takes {
    /// One of these words.
    #[must_use]
    pub fn words<T>(words: &[(&'static str, T)]) -> Self {
        Takes::Words(words.iter().map(|(word, _)| *word).collect())
    }
}

impl Input {
    /// The line of a script that gives it a value, with the quotes that the value needs: `shaft = "blocked"`.
    #[must_use]
    pub fn line(&self, value: &str) -> String {
        let is_word = match &self.takes {
            Takes::Flag => false,
            Takes::Number(_, word) => *word == Some(value),
            Takes::Words(_) | Takes::Text(_) => true,
        };
        if is_word { format!("{} = {value:?}", self.name) } else { format!("{} = {value}", self.name) }
    }
}

/// What may be written, for a message.
impl std::fmt::Display for Takes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Takes::Flag => f.write_str("true or false"),
            Takes::Words(words) => f.write_str(&listed(words.iter().copied())),
            Takes::Number(Range { low, high, unit }, None) => write!(f, "a number from {low} to {high} ({unit})"),
            Takes::Number(Range { low, high, unit }, Some(word)) => {
                write!(f, "a number from {low} to {high} ({unit}, or {word:?})")
            }
            Takes::Text(text) => f.write_str(text),
        }
    }
}

/// Words as a list for a message: `"a", "b" or "c"`.
pub fn listed<'w>(words: impl Iterator<Item = &'w str>) -> String {
    let mut words: Vec<String> = words.map(|word| format!("{word:?}")).collect();
    let last = words.pop().unwrap_or_default();
    if words.is_empty() { last } else { format!("{} or {last}", words.join(", ")) }
}
