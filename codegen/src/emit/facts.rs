//! What the data sheet says of the device as a whole.

use super::context::Context;
use super::literal;

/// One constant for each fact that the data sheet states.
pub(super) fn facts(context: &Context<'_>, code: &mut String) {
    let device = context.plan.device;
    let info = &device.info;
    *code += "\nconst _: () = generated_for(2);\n";
    let mut constant = |name: &str, doc: &str, r#type: &str, value: Option<String>| {
        if let Some(value) = value {
            *code += &format!("\n/// {doc}\npub const {name}: {type} = {value};\n");
        }
    };
    let text = |text: &Option<String>| text.as_ref().filter(|text| !text.is_empty()).map(|text| format!("{text:?}"));
    constant("VENDOR_NAME", "Who makes the device.", "&str", text(&info.vendor_name));
    constant("PRODUCT_NAME", "What the device is called.", "&str", text(&info.product_name));
    constant("ORDER_CODE", "How the device is ordered.", "&str", text(&info.order_code));
    let hex = |number: Option<u32>| number.map(|number| literal::integer(number.into(), true));
    constant("VENDOR_ID", "The vendor-ID, as in 1018:01.", "u32", hex(info.vendor_number));
    constant("PRODUCT_CODE", "The product code, as in 1018:02.", "u32", hex(info.product_number));
    constant("REVISION_NUMBER", "The revision number, as in 1018:03.", "u32", hex(info.revision_number));
    let profile = device.profile.map(|profile| profile.to_string());
    constant("DEVICE_PROFILE", "The number of the device profile.", "u16", profile);
    let rates = Some(format!("&{:?}", info.bit_rates_kbit));
    constant("BIT_RATES_KBIT", "The bit rates that the device knows, in kbit/s.", "&[u16]", rates);
}
