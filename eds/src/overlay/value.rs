//! Reads values of an overlay. A value of the wrong kind is reported and then treated as absent.

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::{Node, Reader};
use crate::finding::Kind;
use crate::model::types::DataType;
use crate::model::{Condition, Value};
use crate::parse::number::{self, Read};

impl Reader<'_> {
    pub(super) fn table<'n, 'i>(&mut self, node: &'n Node<'i>) -> Option<&'n DeTable<'i>> {
        self.expect(node, node.get_ref().as_table(), "a table")
    }

    pub(super) fn array<'n, 'i>(&mut self, node: &'n Node<'i>) -> Option<&'n DeArray<'i>> {
        self.expect(node, node.get_ref().as_array(), "an array")
    }

    pub(super) fn text(&mut self, node: &Node<'_>) -> Option<String> {
        self.expect(node, node.get_ref().as_str().map(str::to_owned), "a text")
    }

    pub(super) fn flag(&mut self, node: &Node<'_>) -> Option<bool> {
        self.expect(node, node.get_ref().as_bool(), "true or false")
    }

    pub(super) fn integer(&mut self, node: &Node<'_>) -> Option<i128> {
        self.expect(node, as_integer(node.get_ref()), "an integer")
    }

    /// An integer in the range of `T`.
    pub(super) fn number<T: TryFrom<i128>>(&mut self, node: &Node<'_>) -> Option<T> {
        let integer = self.integer(node)?;
        let is_signed = T::try_from(-1).is_ok();
        let expected = match u32::try_from(size_of::<T>() * 8) {
            Ok(bits) if !is_signed && bits < 64 => format!("a number from 0 to {}", (1_u64 << bits) - 1),
            _ => "a smaller number".to_owned(),
        };
        self.expect(node, T::try_from(integer).ok(), &expected)
    }

    /// A value of a data type: a TOML number, a text, or a text in the notation of a data sheet.
    pub(super) fn value(&mut self, node: &Node<'_>, data_type: DataType) -> Option<Value> {
        let text = match node.get_ref() {
            DeValue::String(text) => text.to_string(),
            DeValue::Float(float) => float.as_str().replace('_', ""),
            DeValue::Boolean(flag) => u8::from(*flag).to_string(),
            other => match as_integer(other) {
                Some(integer) => integer.to_string(),
                None => return self.expect(node, None, "a number or a text"),
            },
        };
        let value = number::value(&text, data_type).ok().flatten().map(|Read { value, .. }| value);
        self.expect(node, value, &format!("a value of {data_type}"))
    }

    /// `2102:00 == 2`.
    pub(super) fn condition(&mut self, node: &Node<'_>) -> Option<Condition> {
        let text = self.text(node)?;
        let condition = self.expect(node, condition(&text), "a condition such as \"2102:00 == 2\"")?;
        let span = self.span(node.span());
        self.changes.conditions.push((condition.clone(), span));
        Some(condition)
    }

    pub(super) fn expect<T>(&mut self, node: &Node<'_>, value: Option<T>, expected: &str) -> Option<T> {
        if value.is_none() {
            self.push(Kind::OverlayValue { expected: expected.into() }, node);
        }
        value
    }

    /// The same for a value composed of several: adds no finding if one of its parts was reported already, that is, if
    /// there are more findings than `before`.
    pub(super) fn expect_whole<T>(
        &mut self,
        node: &Node<'_>,
        before: usize,
        value: Option<T>,
        expected: &str,
    ) -> Option<T> {
        if self.out.total() > before { value } else { self.expect(node, value, expected) }
    }

    /// A finding about a key or a value.
    pub(super) fn push<T>(&mut self, kind: Kind, at: &Spanned<T>) {
        let span = self.span(at.span());
        self.out.push(kind, span);
    }
}

/// `2410` or `2410:05`, hexadecimal.
pub(super) fn address(text: &str) -> Option<(u16, Option<u8>)> {
    let hex = |text: &str, digits: usize| {
        let fits = text.len() == digits && text.bytes().all(|b| b.is_ascii_hexdigit());
        fits.then(|| u16::from_str_radix(text, 16).ok())?
    };
    match text.trim().split_once(':') {
        None => Some((hex(text.trim(), 4)?, None)),
        Some((index, sub)) => Some((hex(index, 4)?, Some(u8::try_from(hex(sub, 2)?).ok()?))),
    }
}

fn condition(text: &str) -> Option<Condition> {
    let (address_text, value, equal) = match text.split_once("==") {
        Some((address, value)) => (address, value, true),
        None => text.split_once("!=").map(|(address, value)| (address, value, false))?,
    };
    let (index, sub) = address(address_text)?;
    Some(Condition { index, sub: sub.unwrap_or(0), equal, value: number::integer(value)?.value })
}

fn as_integer(value: &DeValue<'_>) -> Option<i128> {
    let integer = value.as_integer()?;
    i128::from_str_radix(&integer.as_str().replace('_', ""), integer.radix()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_hexadecimal_with_all_digits() {
        assert_eq!(address("2410"), Some((0x2410, None)));
        assert_eq!(address("2410:0a"), Some((0x2410, Some(10))));
        for text in ["", "241", "2410:", "2410:5", "2410:100", "24100", "x410", "+410"] {
            assert_eq!(address(text), None, "{text:?}");
        }
    }

    #[test]
    fn conditions_compare_an_entry_with_a_number() {
        let expected = |equal, value| Some(Condition { index: 0x2102, sub: 1, equal, value });
        assert_eq!(condition("2102:01 == 2"), expected(true, 2));
        assert_eq!(condition("2102:01!=0x10"), expected(false, 16));
        assert_eq!(condition("2102:01 != -1"), expected(false, -1));
        for text in ["", "2102:01", "2102:01 = 2", "2102:01 == x", "== 2"] {
            assert_eq!(condition(text), None, "{text:?}");
        }
    }
}
