//! `[enumeration.…]`, `[bit_field.…]` and `[quantity.…]`.

use std::collections::BTreeMap;

use toml::de::DeTable;

use super::keys::keys_of;
use super::{Name, Node, Reader};
use crate::finding::Kind;
use crate::model::{BitField, Bits, Enumeration, Named, Quantity, Unit};

impl Reader<'_> {
    pub(super) fn enumeration(&mut self, name: &Name<'_>, node: &Node<'_>) {
        let (description, list) = self.described(node, "values");
        let (mut values, mut is_hex): (Vec<Named<i128>>, bool) = (Vec::new(), false);
        for node in list {
            let read = |reader: &mut Self, node: &Node<'_>| {
                is_hex |= node.get_ref().as_integer().is_some_and(|integer| integer.radix() == 16);
                reader.integer(node)
            };
            let Some(named) = self.named(node, "value", read) else { continue };
            if let Some(other) = values.iter().find(|other| other.value == named.value || other.name == named.name) {
                let values = [&named, other].map(|named| (named.value, named.name.as_str().into()));
                self.push(Kind::OverlayDuplicateValue { values }, node);
                continue;
            }
            values.push(named);
        }
        values.sort_by_key(|named| named.value);
        let span = self.span(name.span());
        self.device.enumerations.insert(name.get_ref().to_string(), Enumeration { description, values, is_hex, span });
    }

    pub(super) fn bit_field(&mut self, name: &Name<'_>, node: &Node<'_>) {
        let (description, list) = self.described(node, "fields");
        let (mut fields, mut not_simulated): (Vec<Named<Bits>>, _) = (Vec::new(), BTreeMap::new());
        for node in list {
            let Some(named) = self.named(node, "bits", Self::bits) else { continue };
            let overlaps = |other: &&Named<Bits>| {
                other.name == named.name || (other.value.low <= named.value.high && named.value.low <= other.value.high)
            };
            if let Some(other) = fields.iter().find(overlaps) {
                let names = [&named, other].map(|named| named.name.as_str().into());
                self.push(Kind::OverlayBits { names }, node);
                continue;
            }
            if let Some(reason) = node.get_ref().as_table().and_then(|table| self.not_simulated(table)) {
                self.expect(node, (!reason.is_empty()).then_some(()), "a `reason` beside `simulated = false`");
                not_simulated.insert(named.value.low, reason);
            }
            fields.push(named);
        }
        fields.sort_by_key(|named| named.value.low);
        let span = self.span(name.span());
        self.device
            .bit_fields
            .insert(name.get_ref().to_string(), BitField { description, fields, not_simulated, span });
    }

    pub(super) fn quantity(&mut self, name: &Name<'_>, node: &Node<'_>) {
        let (description, list) = self.described(node, "units");
        let units: Vec<Unit> = list.into_iter().filter_map(|node| self.unit(node)).collect();
        if units.is_empty() || (units.len() > 1 && units.iter().any(|unit| unit.when.is_none())) {
            self.push(Kind::OverlayUnits { units: units.len() }, name);
        }
        let span = self.span(name.span());
        self.device.quantities.insert(name.get_ref().to_string(), Quantity { description, units, span });
    }

    /// Reads `description`, and the list under `key`.
    pub(super) fn described<'n, 'i>(&mut self, node: &'n Node<'i>, key: &str) -> (Option<String>, Vec<&'n Node<'i>>) {
        let (mut description, mut list) = (None, None);
        let before = self.out.total();
        for (name, node) in self.table(node).into_iter().flatten() {
            match name.get_ref().as_ref() {
                "description" => description = self.text(node),
                found if found == key => list = self.array(node).map(|nodes| nodes.iter().collect()),
                _ => self.unknown(name, &["description", key]),
            }
        }
        let list: Option<Vec<&Node<'_>>> = self.expect_whole(node, before, list, &format!("a table with `{key}`"));
        (description, list.unwrap_or_default())
    }

    pub(super) fn named<T>(
        &mut self,
        node: &Node<'_>,
        what: &str,
        mut read: impl FnMut(&mut Self, &Node<'_>) -> Option<T>,
    ) -> Option<Named<T>> {
        let (mut name, mut description, mut value) = (None, None, None);
        let before = self.out.total();
        for (key, node) in self.table(node)? {
            match key.get_ref().as_ref() {
                "name" => name = self.text(node),
                "description" => description = self.text(node),
                found if found == what => value = Some(read(self, node)?),
                "simulated" | "reason" if what == "bits" => {}
                _ => self.unknown(key, keys_of(if what == "bits" { "fields" } else { "values" })),
            }
        }
        let named = name.zip(value).map(|(name, value)| Named { name, description, value });
        self.expect_whole(node, before, named, &format!("a table with `{what}` and `name`"))
    }

    /// The `reason` of `simulated = false`, empty if it is missing; `None` if it is simulated.
    pub(super) fn not_simulated(&mut self, table: &DeTable<'_>) -> Option<String> {
        let key = |key: &str| table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, node)| node);
        let reason = key("reason").and_then(|node| node.get_ref().as_str()).unwrap_or_default().trim();
        let simulated = self.flag(key("simulated")?)?;
        (!simulated).then(|| reason.to_owned())
    }

    /// A bit `3` or a range `"4..7"`.
    fn bits(&mut self, node: &Node<'_>) -> Option<Bits> {
        let bits = match node.get_ref().as_str() {
            None => self.number(node).map(|bit| Bits { low: bit, high: bit })?,
            Some(text) => {
                let bits = text.split_once("..").and_then(|(low, high)| {
                    Some(Bits { low: low.trim().parse().ok()?, high: high.trim().parse().ok()? })
                });
                self.expect(node, bits, "a bit such as 3, or bits such as \"4..7\"")?
            }
        };
        self.expect(
            node,
            (bits.low <= bits.high && bits.high < 64).then_some(bits),
            "bits from 0 to 63, the lowest first",
        )
    }

    fn unit(&mut self, node: &Node<'_>) -> Option<Unit> {
        let (mut symbol, mut method, mut scale, mut when) = (None, None, None, None);
        let before = self.out.total();
        for (key, node) in self.table(node)? {
            match key.get_ref().as_ref() {
                "symbol" => symbol = self.text(node),
                "method" => method = self.method(node),
                "scale" => scale = self.scale(node),
                "when" => when = self.condition(node),
                _ => self.unknown(key, keys_of("units")),
            }
        }
        let unit = symbol.zip(method).zip(scale);
        let unit = unit.map(|((symbol, method), (num, den))| Unit { symbol, method, num, den, when });
        self.expect_whole(node, before, unit, "a unit with `symbol`, `method` and `scale`")
    }

    /// A word that is valid as a method name.
    fn method(&mut self, node: &Node<'_>) -> Option<String> {
        let method = self.text(node)?;
        let word = method.starts_with(|c: char| c.is_ascii_lowercase())
            && method.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_');
        self.expect(node, word.then_some(method), "a word in snake case")
    }

    /// `"1/100"`, `"10"`, `"0.25"` or a number, as numerator and denominator.
    fn scale(&mut self, node: &Node<'_>) -> Option<(i64, i64)> {
        let scale = match node.get_ref().as_str() {
            Some(text) => rational(text),
            None => match node.get_ref().as_float() {
                Some(float) => rational(float.as_str()),
                None => self.number(node).map(|number: i64| (number, 1)),
            },
        };
        self.expect(node, scale.filter(|&(num, den)| num != 0 && den > 0), "a scale such as \"1/100\"")
    }
}

/// `1/100`, `10` or `0.25`, as numerator and denominator.
pub(crate) fn rational(text: &str) -> Option<(i64, i64)> {
    if let Some((num, den)) = text.split_once('/') {
        return Some((num.trim().parse().ok()?, den.trim().parse().ok()?));
    }
    let (whole, fraction) = text.trim().split_once('.').unwrap_or((text.trim(), ""));
    let den = 10_i64.checked_pow(fraction.len() as u32)?;
    let num: i64 = format!("{whole}{fraction}").parse().ok()?;
    let divisor = gcd(num.unsigned_abs(), den.unsigned_abs()) as i64;
    Some((num / divisor, den / divisor))
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a.max(1) } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_fractions_or_decimals() {
        assert_eq!(rational("1/100"), Some((1, 100)));
        assert_eq!(rational("10"), Some((10, 1)));
        assert_eq!(rational("0.25"), Some((1, 4)));
        assert_eq!(rational("-1.5"), Some((-3, 2)));
        for text in ["", "x", "1/", "1/2/3", "99999999999999999999", "0.00000000000000000001"] {
            assert_eq!(rational(text), None, "{text:?}");
        }
    }
}
