//! XML as CANopenEditor writes it, so that it reads what is written here.

use std::fmt::Write as _;

use super::NAMESPACES;
use crate::text::escaped;

/// Elements that the schema declares at its top, and so in its namespace; all others are in none.
pub(super) const QUALIFIED: &str = "\
    ISO15745ProfileContainer ISO15745Profile DeviceIdentity vendorName vendorID productName productID productText \
    orderNumber DeviceFunction capabilities characteristicsList characteristic characteristicName \
    characteristicContent ApplicationProcess dataTypeList struct varDeclaration dataTypeIDRef parameterList \
    parameter denotation actualValue defaultValue allowedValues value range unit property CANopenObjectList";

/// The prefix of [`QUALIFIED`].
const PREFIX: &str = "co:";

/// The attributes of an element, by their names.
pub(super) type Attributes<'a> = [(&'a str, &'a str)];

#[derive(Default)]
pub(super) struct Xml {
    out: String,
    open: Vec<String>,
}

impl Xml {
    /// The document with its root element, which is closed by [`finish`](Self::finish).
    pub(super) fn begin() -> Self {
        let mut xml = Self { out: "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n".to_owned(), open: Vec::new() };
        let schema = "http://www.w3.org/2001/XMLSchema-instance";
        xml.open("ISO15745ProfileContainer", &[("xmlns:co", NAMESPACES[1]), ("xmlns:xsi", schema)]);
        xml
    }

    pub(super) fn open(&mut self, name: &str, attributes: &Attributes<'_>) {
        let name = self.start(name, attributes);
        self.out.push_str(">\n");
        self.open.push(name);
    }

    pub(super) fn close(&mut self) {
        if let Some(name) = self.open.pop() {
            self.indent();
            let _ = writeln!(self.out, "</{name}>");
        }
    }

    pub(super) fn empty(&mut self, name: &str, attributes: &Attributes<'_>) {
        self.start(name, attributes);
        self.out.push_str(" />\n");
    }

    pub(super) fn text(&mut self, name: &str, attributes: &Attributes<'_>, text: &str) {
        if text.is_empty() {
            return self.empty(name, attributes);
        }
        let name = self.start(name, attributes);
        let _ = writeln!(self.out, ">{}</{name}>", escaped(text));
    }

    /// A `label` or `description`.
    pub(super) fn words(&mut self, name: &str, text: &str) {
        self.text(name, &[("lang", "en")], text);
    }

    /// An element with only a `label` or `description`.
    pub(super) fn with_words(&mut self, name: &str, words: &str, text: &str) {
        self.open(name, &[]);
        self.words(words, text);
        self.close();
    }

    pub(super) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.out
    }

    fn start(&mut self, name: &str, attributes: &Attributes<'_>) -> String {
        let name = if QUALIFIED.split(' ').any(|it| it == name) { format!("{PREFIX}{name}") } else { name.to_owned() };
        self.indent();
        let _ = write!(self.out, "<{name}");
        for (key, value) in attributes {
            let _ = write!(self.out, " {key}=\"{}\"", escaped(value));
        }
        name
    }

    fn indent(&mut self) {
        self.out.extend(std::iter::repeat_n("  ", self.open.len()));
    }
}
