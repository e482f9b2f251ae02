//! What the data sheet says of the device as a whole.

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::context::Context;
use super::{docs, literal};

/// One constant for each fact that the data sheet states.
pub(super) fn facts(context: &Context<'_>) -> TokenStream {
    let device = context.plan.device;
    let info = &device.info;
    let runtime = &context.runtime;
    let texts = [
        ("VENDOR_NAME", "Who makes the device.", &info.vendor_name),
        ("PRODUCT_NAME", "What the device is called.", &info.product_name),
        ("ORDER_CODE", "How the device is ordered.", &info.order_code),
    ];
    let numbers = [
        ("VENDOR_ID", "The vendor-ID, as in 1018:01.", info.vendor_number.map(|number| (number, 8))),
        ("PRODUCT_CODE", "The product code, as in 1018:02.", info.product_number.map(|number| (number, 8))),
        ("REVISION_NUMBER", "The revision number, as in 1018:03.", info.revision_number.map(|number| (number, 8))),
        ("DEVICE_PROFILE", "The number of the device profile.", device.profile.map(|profile| (profile.into(), 4))),
    ];
    let texts = texts.into_iter().filter_map(|(name, doc, text)| {
        let text = text.as_deref().filter(|text| !text.is_empty())?;
        Some(constant(name, doc, quote!(&str), quote!(#text)))
    });
    let numbers = numbers.into_iter().filter_map(|(name, doc, number)| {
        let (number, digits) = number?;
        let (r#type, number) = match digits {
            // A profile is a number of a document, such as 402.
            4 => (quote!(u16), literal::decimal(number.into())),
            _ => (quote!(u32), literal::hex(number, digits)),
        };
        Some(constant(name, doc, r#type, quote!(#number)))
    });
    let rates = info.bit_rates_kbit.iter().map(|&rate| literal::decimal(rate.into()));
    let rates = constant(
        "BIT_RATES_KBIT",
        "The bit rates that the device knows, in kbit/s.",
        quote!(&[u16]),
        quote!(&[#(#rates),*]),
    );
    quote! {
        const _: () = #runtime::object::generated_for(1);
        #(#texts)*
        #(#numbers)*
        #rates
    }
}

fn constant(name: &str, doc: &str, r#type: TokenStream, value: TokenStream) -> TokenStream {
    let ident: Ident = format_ident!("{name}");
    let doc = docs::lines(&[doc.to_owned()]);
    quote!(#doc pub const #ident: #r#type = #value;)
}
