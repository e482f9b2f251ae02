//! Reading objects that hold numbers, and reporting what contradicts CiA 402.

use super::data::Number;
use super::finding::severity;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::model::types::{Class, DataType};
use crate::model::{Device, Entry, Object, Value};
use crate::standard;
use crate::text::Span;

/// The data sheet, and the findings so far.
pub(super) struct Reader<'a> {
    pub(super) device: &'a Device,
    pub(super) findings: Diagnostics,
}

/// How a driver uses an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Need {
    /// Writes 16 bits.
    Word,
    /// Reads 16 bits.
    Status,
    /// Reads a position or velocity, which has at most 32 bits and a sign.
    Moved,
    /// Writes a position or velocity.
    Target,
    /// Reads a number.
    Read,
    /// Writes a number.
    Written,
}

impl<'a> Reader<'a> {
    pub(super) fn new(device: &'a Device) -> Self {
        Reader { device, findings: Diagnostics::default() }
    }

    /// Reports a finding; the severity is that of its code.
    pub(super) fn report(&mut self, code: &'static str, message: impl Into<String>, span: Span, help: &str) {
        self.findings.push(Diagnostic::new(code, severity(code), message).at(span, "").help(help));
    }

    /// Reads an object that every driver needs; its absence is an error.
    pub(super) fn needed(&mut self, index: u16, what: &str, need: Need) -> Option<Number> {
        let Some(entry) = self.device.entry(index, 0) else {
            let message = format!("there is no {index:04X}h ({what})");
            let help = "if the drive has the object, add it to the data sheet; else the driver cannot command it";
            self.report("drive::no-object", message, self.nearest(index), help);
            return None;
        };
        self.number(entry, what, need, "drive::object")
    }

    /// Reads an object that a driver can do without.
    pub(super) fn optional(&mut self, (index, sub): (u16, u8), what: &str, need: Need) -> Option<Number> {
        self.number(self.device.entry(index, sub)?, what, need, "drive::left-out")
    }

    fn number(&mut self, entry: &Entry, what: &str, need: Need, code: &'static str) -> Option<Number> {
        let place = if entry.sub == 0 && !self.has_subs(entry.index) {
            format!("{:04X}", entry.index)
        } else {
            format!("{:04X}:{:02X}", entry.index, entry.sub)
        };
        if !need.fits(entry.data_type) {
            let standard = standard::object(entry.index, Some(402)).and_then(|it| it.data_type(entry.sub));
            let right = standard.unwrap_or(need.usual());
            let message = format!("{place} ({what}) is {}, and {right} by CiA 402", entry.data_type);
            let help = format!(
                "if the data sheet is wrong, an overlay corrects it: `[object.\"{place}\"]`, `data_type = \"{right}\"`"
            );
            self.report(code, message, entry.span, &help);
            return None;
        }
        let allowed = if need.writes() { entry.access.writable() } else { entry.access.readable() };
        if !allowed {
            let verb = if need.writes() { "written" } else { "read" };
            let message = format!("{place} ({what}) is {}, and cannot be {verb}", entry.access.name());
            let help = format!(
                "if the data sheet is wrong, an overlay corrects it: `[object.\"{place}\"]`, `access = \"rw\"`"
            );
            self.report(code, message, entry.span, &help);
            return None;
        }
        Some(Number { index: entry.index, sub: entry.sub, data_type: entry.data_type, limits: limits(entry) })
    }

    fn has_subs(&self, index: u16) -> bool {
        self.device.object(index).is_some_and(|object| object.kind.has_subs())
    }

    /// The place of an object, or of the one before it if it is missing.
    pub(super) fn nearest(&self, index: u16) -> Span {
        let after = self.device.objects.partition_point(|object| object.index <= index);
        let before: Option<&Object> = self.device.objects[..after].last().or(self.device.objects.first());
        before.map(|object| object.span).unwrap_or_default()
    }
}

impl Need {
    fn fits(self, data_type: DataType) -> bool {
        let whole = matches!(data_type.class(), Class::Signed | Class::Unsigned);
        let bits = data_type.bits().filter(|_| whole);
        let range = data_type.range().unwrap_or_default();
        matches!(bits, Some(8 | 16 | 32 | 64))
            && match self {
                Need::Word | Need::Status => bits == Some(16),
                Need::Moved | Need::Target => range.0 >= i32::MIN.into() && range.1 <= i32::MAX.into(),
                Need::Read | Need::Written => true,
            }
    }

    fn usual(self) -> DataType {
        match self {
            Need::Word | Need::Status => DataType::Unsigned16,
            Need::Moved | Need::Target => DataType::Integer32,
            Need::Read | Need::Written => DataType::Unsigned32,
        }
    }

    fn writes(self) -> bool {
        matches!(self, Need::Word | Need::Target | Need::Written)
    }
}

/// Limits narrower than the data type. Equal limits are ignored: tools write them where there are none.
fn limits(entry: &Entry) -> Option<(i64, i64)> {
    let (lowest, highest) = entry.data_type.range()?;
    let limit = |value: &Option<Value>| entry.data_type.fit(value.as_ref()?.as_integer()?);
    let (low, high) = (limit(&entry.low).unwrap_or(lowest), limit(&entry.high).unwrap_or(highest));
    let narrower = low < high && (low, high) != (lowest, highest);
    Some((i64::try_from(low).ok()?, i64::try_from(high).ok()?)).filter(|_| narrower)
}
