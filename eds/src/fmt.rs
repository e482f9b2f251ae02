//! Formats a data sheet as CiA 306-1 spells it, line by line: nothing is lost or moved or changes its meaning, and
//! comments stay where they are.

use crate::model::keys::KEYS;
use crate::parse::section::{ModulePart, ObjectPart, SectionKind};
use crate::parse::syntax::Line;
use crate::text::Source;
use crate::xdd;

/// Sections and keys get the spelling of the standard, indices and types the form `0x1018`, flags 0 or 1; there is one
/// empty line before each section, and no blanks around names and values. Formatting twice changes nothing.
///
/// A line that is neither section nor key becomes a comment. Lines end as most of them did before. XML gets one element
/// per line, indented by depth as in CANopenEditor; XML that is not well-formed stays as it is.
#[must_use]
pub fn normalise(source: &Source) -> String {
    if xdd::is_xml(source) {
        return xdd::normalise(source);
    }
    let end = source.end_of_line();
    let mut writer = Writer { out: String::with_capacity(source.text().len()), end, pending: Vec::new() };
    let mut section = SectionKind::Unnamed;
    for number in 0..source.line_count() {
        match Line::of(source.line(number)) {
            Line::Blank => writer.blank(),
            Line::Comment(comment) => writer.pending.push(comment.to_owned()),
            Line::Section { name, rest, .. } => {
                section = SectionKind::of(name);
                if !rest.is_empty() {
                    writer.pending.push(commented(rest));
                }
                writer.section(&section_name(section, name));
            }
            Line::Pair { key, value, .. } => writer.pair(section, key, value),
            Line::Other(other) => writer.pending.push(commented(other)),
        }
    }
    writer.flush();
    writer.out
}

struct Writer {
    out: String,
    end: &'static str,
    /// Comments that may turn out to stand before a section; empty texts separate their groups.
    pending: Vec<String>,
}

impl Writer {
    /// Keeps empty lines between comments only; those before sections are written with the section.
    fn blank(&mut self) {
        if self.pending.last().is_some_and(|last| !last.is_empty()) {
            self.pending.push(String::new());
        }
    }

    fn section(&mut self, name: &str) {
        if !self.out.is_empty() {
            self.line("");
        }
        self.flush();
        self.line(&format!("[{name}]"));
    }

    fn pair(&mut self, section: SectionKind, key: &str, value: &str) {
        self.flush();
        let key = key_name(section, key);
        let value = value_text(section, &key, value);
        self.line(&format!("{key}={value}"));
    }

    fn flush(&mut self) {
        while self.pending.last().is_some_and(String::is_empty) {
            self.pending.pop();
        }
        for line in std::mem::take(&mut self.pending) {
            self.line(&line);
        }
    }

    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push_str(self.end);
    }
}

fn commented(text: &str) -> String {
    if text.starts_with([';', '#']) { text.to_owned() } else { format!("; {text}") }
}

fn section_name(kind: SectionKind, name: &str) -> String {
    match kind {
        SectionKind::FileInfo => "FileInfo".to_owned(),
        SectionKind::DeviceInfo => "DeviceInfo".to_owned(),
        SectionKind::DummyUsage => "DummyUsage".to_owned(),
        SectionKind::Comments => "Comments".to_owned(),
        SectionKind::MandatoryObjects => "MandatoryObjects".to_owned(),
        SectionKind::OptionalObjects => "OptionalObjects".to_owned(),
        SectionKind::ManufacturerObjects => "ManufacturerObjects".to_owned(),
        SectionKind::Commissioning => "DeviceComissioning".to_owned(),
        SectionKind::SupportedModules => "SupportedModules".to_owned(),
        SectionKind::ConnectedModules => "ConnectedModules".to_owned(),
        SectionKind::DynamicChannels => "DynamicChannels".to_owned(),
        SectionKind::Tools => "Tools".to_owned(),
        SectionKind::Tool(number) => format!("Tool{number}"),
        SectionKind::Object(index, part) => object_name(index, part),
        SectionKind::Module(number, part) => format!("M{number}{}", module_name(part)),
        SectionKind::Unnamed | SectionKind::Unknown => name.to_owned(),
    }
}

fn object_name(index: u16, part: ObjectPart) -> String {
    match part {
        ObjectPart::Header => format!("{index:04X}"),
        ObjectPart::Sub(sub) => format!("{index:04X}sub{sub:X}"),
        ObjectPart::Names => format!("{index:04X}Name"),
        ObjectPart::Values => format!("{index:04X}Value"),
        ObjectPart::Denotations => format!("{index:04X}Denotation"),
        ObjectPart::Links => format!("{index:04X}ObjectLinks"),
    }
}

fn module_name(part: ModulePart) -> String {
    match part {
        ModulePart::Info => "ModuleInfo".to_owned(),
        ModulePart::Comments => "Comments".to_owned(),
        ModulePart::FixedObjects => "FixedObjects".to_owned(),
        ModulePart::Fixed(index, part) => format!("Fixed{}", object_name(index, part)),
        ModulePart::SubExtends => "SubExtends".to_owned(),
        ModulePart::SubExt(index) => format!("SubExt{index:04X}"),
    }
}

/// A known key in the spelling of the standard.
fn key_name(section: SectionKind, key: &str) -> String {
    let table = keys_of(section);
    let known = crate::parse::position(table, key).map(|at| table[at]);
    known.unwrap_or(key).to_owned()
}

/// The keys of a section, except keys that are numbers.
pub(crate) fn keys_of(section: SectionKind) -> &'static [&'static str] {
    match section {
        SectionKind::FileInfo => &crate::model::keys::FILE_INFO,
        SectionKind::DeviceInfo => &crate::model::keys::DEVICE_INFO,
        SectionKind::Commissioning => &crate::model::keys::COMMISSIONING,
        SectionKind::MandatoryObjects | SectionKind::OptionalObjects | SectionKind::ManufacturerObjects => {
            &["SupportedObjects"]
        }
        SectionKind::Object(_, ObjectPart::Header | ObjectPart::Sub(_)) => &KEYS,
        SectionKind::Object(_, ObjectPart::Names | ObjectPart::Values | ObjectPart::Denotations) => &["NrOfEntries"],
        SectionKind::Object(_, ObjectPart::Links) => &["ObjectLinks"],
        SectionKind::Module(_, ModulePart::Fixed(_, ObjectPart::Header | ObjectPart::Sub(_))) => &KEYS,
        _ => &[],
    }
}

/// Writes numbers with a fixed notation in that notation; other values stay as they are.
fn value_text(section: SectionKind, key: &str, value: &str) -> String {
    let number = || crate::parse::number::integer(value).filter(|read| read.oddity.is_none()).map(|read| read.value);
    let with_digits = |digits: usize| {
        let number = number().filter(|number| (0..=0xFFFF).contains(number));
        number.map_or_else(|| value.to_owned(), |number| format!("0x{number:0digits$X}"))
    };
    let listed = matches!(
        section,
        SectionKind::MandatoryObjects | SectionKind::OptionalObjects | SectionKind::ManufacturerObjects
    );
    match key {
        "DataType" => with_digits(4),
        "ObjectType" => with_digits(1),
        "AccessType" => crate::model::AccessType::from_name(value).map_or(value, |access| access.name()).to_owned(),
        "PDOMapping" => match number() {
            Some(flag @ (0 | 1)) => flag.to_string(),
            _ => value.to_owned(),
        },
        "SupportedObjects" => number().map_or_else(|| value.to_owned(), |number| number.to_string()),
        _ if listed => with_digits(4),
        _ => value.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, load};

    fn check(text: &str, expected: &str) {
        assert_eq!(normalise(&Source::new("x", text)), expected, "{text:?}");
    }

    #[test]
    fn spelling_becomes_that_of_the_standard() {
        check("[fileinfo]\nfilename = x.eds \n", "[FileInfo]\nFileName=x.eds\n");
        check("[1018SUB0a]\nDATATYPE=7\n", "[1018subA]\nDataType=0x0007\n");
        check("[1a00]\nobjecttype=0x09\nACCESSTYPE=RO\n", "[1A00]\nObjectType=0x9\nAccessType=ro\n");
        check(
            "[OptionalObjects]\nSupported Objects=1\n1 = 0x1017\n",
            "[OptionalObjects]\nSupportedObjects=1\n1=0x1017\n",
        );
        check("[40]\nPDOMapping=0x0\n", "[0040]\nPDOMapping=0\n");
        check("[Custom]\nkey = 1 ; x\n", "[Custom]\nkey=1 ; x\n");
    }

    #[test]
    fn comments_stay_and_nothing_is_lost() {
        check(
            "; head\n\n\n; second\n[1000]x\nParameterName Device type\nlost text\nDataType=7\r; tail",
            "; head\n\n; second\n; x\n[1000]\nParameterName=Device type\n; lost text\nDataType=0x0007\n; tail\n",
        );
        check("[1000]\nDataType=7\n[1001]\nDataType=5\n", "[1000]\nDataType=0x0007\n\n[1001]\nDataType=0x0005\n");
        check("[1000]\n; about 1001\n[1001]\n", "[1000]\n\n; about 1001\n[1001]\n");
    }

    #[test]
    fn line_ends_stay_as_they_were() {
        check("[1000]\r\nDataType=7\r\n", "[1000]\r\nDataType=0x0007\r\n");
        check("", "");
    }

    proptest::proptest! {
        #[test]
        fn the_meaning_stays_and_twice_is_once(text in "(\\[(1018|2000(sub[0-3])?|FileInfo|optionalobjects)\\] ?\r?\n|(datatype|ParameterName|Access Type|AccessType|1|PDOMAPPING|objecttype)( ?= ?|:| )(0x[0-9a-f]{1,3}|[0-9]{1,4}|ro|RW)?\n|;x\n|\n|[a-z=\\[\\]]{0,5}\n){0,20}") {
            let source = Source::new("x", text);
            let once = normalise(&source);
            let again = normalise(&Source::new("x", once.as_str()));
            proptest::prop_assert_eq!(&again, &once);
            let read = |text: &str| {
                let mut device = load(&Input::new(Source::new("x", text))).0;
                device.clear_spans();
                device
            };
            proptest::prop_assert_eq!(read(&once), read(source.text()));
        }
    }
}
