//! Recognises the devices of the library by their identity object (1018h).

use std::sync::LazyLock;

use lexican_eds::library;
use lexican_eds::model::{Device, Value};
use lexican_runtime::cia301;
use lexican_runtime::object::Address;

/// The vendor-ID.
pub const VENDOR: Address = Address::new(cia301::IDENTITY, 1);
/// The product code.
pub const PRODUCT: Address = Address::new(cia301::IDENTITY, 2);

/// The known ones of `vendor 195h`, `product 0h`, `revision 10000h`, `serial 2Ah`.
pub fn words(numbers: [Option<u32>; 4]) -> impl Iterator<Item = String> {
    let names = ["vendor", "product", "revision", "serial"];
    names.into_iter().zip(numbers).filter_map(|(name, number)| Some(format!("{name} {:X}h", number?)))
}

/// A device of the library, with its parsed data sheet.
pub struct Shipped {
    /// `vendor/device`.
    pub id: &'static str,
    /// Its data sheet.
    pub device: Device,
}

/// Parsed at first use.
static LIBRARY: LazyLock<Vec<Shipped>> = LazyLock::new(|| {
    let all = library::all().iter();
    all.map(|shipped| Shipped { id: shipped.id, device: lexican_eds::device(&shipped.input()) }).collect()
});

/// The only device of the library with this vendor-ID and product code; `None` if there are none or several. A node
/// without 1018h:02 matches a data sheet without a product code.
pub fn recognise(vendor: u32, product: Option<u32>) -> Option<&'static Shipped> {
    let mut same = LIBRARY.iter().filter(|shipped| is_of(&shipped.device, vendor, product));
    same.next().filter(|_| same.next().is_none())
}

/// Whether a data sheet is for this vendor-ID and product code.
#[must_use]
pub fn is_of(device: &Device, vendor: u32, product: Option<u32>) -> bool {
    vendor != 0 && device.info.vendor_number == Some(vendor) && has_product(device, product)
}

/// Whether a data sheet is for this product code. If it has 1018h:02 without a value, it is for all devices of its
/// vendor.
fn has_product(device: &Device, product: Option<u32>) -> bool {
    match (device.entry(PRODUCT.index(), PRODUCT.sub()), product) {
        (None, None) => true,
        (Some(entry), Some(product)) => {
            let default = entry.default.as_ref().and_then(Value::as_integer);
            let known = device.info.product_number.filter(|&number| number != 0).map(i128::from).or(default);
            known.is_none_or(|known| known == i128::from(product))
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_recognised_by_vendor_and_product() {
        const SIKO: u32 = 0x195;
        const KOLLMORGEN: u32 = 0x6A;
        for (vendor, product, expected) in [
            (SIKO, Some(0), Some("siko/ag03-1")),
            (SIKO, Some(1), None),
            // The other drive has no product code.
            (SIKO, None, Some("siko/ag02")),
            // The product code is the size of the drive.
            (KOLLMORGEN, Some(u32::from_le_bytes(*b"M006")), Some("kollmorgen/akd")),
            (KOLLMORGEN, None, None),
            (SIKO + 1, Some(0), None),
            (0, Some(0), None),
        ] {
            assert_eq!(recognise(vendor, product).map(|shipped| shipped.id), expected, "{vendor:X} {product:?}");
        }
    }
}
