//! The identity object and DeviceInfo name the same device.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Value;
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::identity",
    severity: Severity::Warning,
    holds: "The identity object and DeviceInfo name the same device.",
    explain: "Tools find the data sheet of a device by the numbers in 1018h, and look for them in `[DeviceInfo]`.",
    help: "when `[DeviceInfo]` is right, an overlay can correct 1018: `default` with a reason",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let info = &context.device.info;
    let numbers = [
        (1, "VendorNumber", info.vendor_number),
        (2, "ProductNumber", info.product_number),
        (3, "RevisionNumber", info.revision_number),
    ];
    for (sub, key, said) in numbers {
        let entry = context.device.entry(0x1018, sub);
        let value = entry.and_then(|entry| entry.default.as_ref()).and_then(Value::as_integer);
        let (Some(entry), Some(value), Some(said)) = (entry, value, said) else { continue };
        // 0 stands for "not given" in either place.
        if value == i128::from(said) || value == 0 || said == 0 {
            continue;
        }
        let Some(span) = context.device_info(key) else { continue };
        let finding = RULE.finding(format!("`{key}` is {said:#X}, but 1018:{sub:02X} is {value:#X}"));
        let finding = finding.at(span, "").and(context.entry_span(entry, Key::DefaultValue), "says otherwise");
        let overlay = format!("`[object.\"1018:{sub:02X}\"]`, `default = {said:#X}` with a reason");
        out.push(finding.help(format!("when `{key}` is right, an overlay can correct the object: {overlay}")));
    }
}
