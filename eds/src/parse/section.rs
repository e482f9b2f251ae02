//! Section names (CiA 306-1), and how names are compared.

use std::borrow::Cow;

/// What a section is about. In this order, the sections of an object follow each other, header first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SectionKind {
    FileInfo,
    DeviceInfo,
    DummyUsage,
    Comments,
    MandatoryObjects,
    OptionalObjects,
    ManufacturerObjects,
    Commissioning,
    SupportedModules,
    ConnectedModules,
    DynamicChannels,
    Tools,
    Tool(u16),
    Object(u16, ObjectPart),
    Module(u16, ModulePart),
    /// Keys before the first section.
    Unnamed,
    Unknown,
}

/// `[1018]` and what goes with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ObjectPart {
    /// `[1018]`.
    Header,
    /// `[1018sub1]`.
    Sub(u8),
    /// `[1018Name]`.
    Names,
    /// `[1018Value]`.
    Values,
    /// `[1018Denotation]`.
    Denotations,
    /// `[1018ObjectLinks]`.
    Links,
}

/// `[M1…]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ModulePart {
    /// `[M1ModuleInfo]`.
    Info,
    /// `[M1Comments]`.
    Comments,
    /// `[M1FixedObjects]`.
    FixedObjects,
    /// `[M1Fixed1018]`, `[M1Fixed1018sub1]`.
    Fixed(u16, ObjectPart),
    /// `[M1SubExtends]`.
    SubExtends,
    /// `[M1SubExt6000]`.
    SubExt(u16),
}

impl SectionKind {
    /// Ignores case and blanks.
    pub(crate) fn of(name: &str) -> Self {
        // Shortcut: most sections are objects in the plain spelling.
        if let Some((index, part)) = object(name) {
            return Self::Object(index, part);
        }
        let name: String = name.split_whitespace().collect::<String>().to_ascii_lowercase();
        match name.as_str() {
            "" => Self::Unnamed,
            "fileinfo" => Self::FileInfo,
            "deviceinfo" => Self::DeviceInfo,
            "dummyusage" => Self::DummyUsage,
            "comments" => Self::Comments,
            "mandatoryobjects" => Self::MandatoryObjects,
            "optionalobjects" => Self::OptionalObjects,
            "manufacturerobjects" => Self::ManufacturerObjects,
            // The standard spells it with one m; people use two.
            "devicecomissioning" | "devicecommissioning" => Self::Commissioning,
            "supportedmodules" => Self::SupportedModules,
            "connectedmodules" => Self::ConnectedModules,
            "dynamicchannels" => Self::DynamicChannels,
            "tools" => Self::Tools,
            other => Self::numbered(other).unwrap_or(Self::Unknown),
        }
    }

    /// The module that it belongs to.
    pub(crate) fn module(self) -> Option<u16> {
        match self {
            Self::Module(number, _) => Some(number),
            _ => None,
        }
    }

    fn numbered(name: &str) -> Option<Self> {
        if let Some((index, part)) = object(name) {
            return Some(Self::Object(index, part));
        }
        if let Some(number) = name.strip_prefix("tool").filter(|number| !number.starts_with('+')) {
            return Some(Self::Tool(number.parse().ok()?));
        }
        let rest = name.strip_prefix('m')?;
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, rest) = rest.split_at(digits);
        Some(Self::Module(number.parse().ok()?, module_part(rest)?))
    }
}

fn module_part(name: &str) -> Option<ModulePart> {
    Some(match name {
        "moduleinfo" => ModulePart::Info,
        "comments" => ModulePart::Comments,
        "fixedobjects" => ModulePart::FixedObjects,
        "subextends" => ModulePart::SubExtends,
        other => {
            if let Some(index) = other.strip_prefix("subext") {
                ModulePart::SubExt(hex(index, 4)?)
            } else {
                let (index, part) = object(other.strip_prefix("fixed")?)?;
                ModulePart::Fixed(index, part)
            }
        }
    })
}

fn object(name: &str) -> Option<(u16, ObjectPart)> {
    // Try the longest index first: the `De` of `Denotation` are hexadecimal digits, too.
    (1..=4).rev().find_map(|digits| {
        let (index, part) = name.split_at_checked(digits)?;
        Some((hex(index, 4)?, object_part(part)?))
    })
}

fn object_part(part: &str) -> Option<ObjectPart> {
    let is = |word: &str| part.eq_ignore_ascii_case(word);
    Some(match part {
        "" => ObjectPart::Header,
        _ if part.get(..3).is_some_and(|start| start.eq_ignore_ascii_case("sub")) => {
            ObjectPart::Sub(u8::try_from(hex(&part[3..], 2)?).ok()?)
        }
        _ if is("Name") => ObjectPart::Names,
        _ if is("Value") => ObjectPart::Values,
        _ if is("Denotation") => ObjectPart::Denotations,
        _ if is("ObjectLinks") => ObjectPart::Links,
        _ => return None,
    })
}

/// At most `digits` hexadecimal digits and nothing else.
fn hex(text: &str, digits: usize) -> Option<u16> {
    let fits = (1..=digits).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_hexdigit());
    fits.then(|| u16::from_str_radix(text, 16).ok())?
}

/// The position of a key in a table, ignoring case and blanks.
pub(crate) fn position(table: &[&str], key: &str) -> Option<usize> {
    let find = |key: &str| table.iter().position(|name| name.eq_ignore_ascii_case(key));
    // Shortcut: most keys have the spelling of the standard.
    let exact = table.iter().position(|&name| name == key);
    exact.or_else(|| find(key)).or_else(|| key.contains(char::is_whitespace).then(|| find(&without_blanks(key)))?)
}

pub(crate) fn without_blanks(text: &str) -> Cow<'_, str> {
    if text.contains(char::is_whitespace) { Cow::Owned(text.split_whitespace().collect()) } else { Cow::Borrowed(text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_in_any_spelling() {
        use {ModulePart as M, ObjectPart as P, SectionKind as S};
        let check = |name: &str, kind: S| assert_eq!(S::of(name), kind, "{name:?}");
        check("FileInfo", S::FileInfo);
        check("deviceINFO", S::DeviceInfo);
        check("Mandatory Objects", S::MandatoryObjects);
        check("DeviceComissioning", S::Commissioning);
        check("DeviceCommissioning", S::Commissioning);
        check("1018", S::Object(0x1018, P::Header));
        check("1a00", S::Object(0x1A00, P::Header));
        check("40", S::Object(0x40, P::Header));
        check("1018sub1", S::Object(0x1018, P::Sub(1)));
        check("1018SubFF", S::Object(0x1018, P::Sub(0xFF)));
        check("1018 sub 0A", S::Object(0x1018, P::Sub(10)));
        check("1018Name", S::Object(0x1018, P::Names));
        check("1018value", S::Object(0x1018, P::Values));
        check("1018Denotation", S::Object(0x1018, P::Denotations));
        check("40Denotation", S::Object(0x40, P::Denotations));
        check("1018ObjectLinks", S::Object(0x1018, P::Links));
        check("M1ModuleInfo", S::Module(1, M::Info));
        check("M12Fixed6423sub1", S::Module(12, M::Fixed(0x6423, P::Sub(1))));
        check("M1SubExt6000", S::Module(1, M::SubExt(0x6000)));
        check("Tool1", S::Tool(1));
        check("", S::Unnamed);
        for name in ["10180", "1018sub", "1018sub100", "1018x", "M1", "MxModuleInfo", "Toolx", "ü", "1018ü", "0x1018"]
        {
            check(name, S::Unknown);
        }
    }
}
