//! Recognises the devices of the library by their identity object (1018h).

use std::sync::LazyLock;

use lexican_eds::library;
use lexican_eds::model::Device;
use lexican_runtime::cia301;
use lexican_runtime::object::Address;

/// The vendor-ID.
pub(crate) const VENDOR: Address = Address::new(cia301::IDENTITY, 1);
/// The product code.
pub(crate) const PRODUCT: Address = Address::new(cia301::IDENTITY, 2);

/// `vendor 195h`, `product 0h`, `revision 10000h`, `serial 2Ah`, without the unknown ones.
pub(crate) fn words(numbers: [Option<u32>; 4]) -> impl Iterator<Item = String> {
    let names = ["vendor", "product", "revision", "serial"];
    names.into_iter().zip(numbers).filter_map(|(name, number)| Some(format!("{name} {:X}h", number?)))
}

/// A device of the library with its data sheet read.
pub(crate) struct Shipped {
    /// `vendor/device`.
    pub(crate) id: &'static str,
    pub(crate) device: Device,
}

/// The data sheets, read at first use.
static LIBRARY: LazyLock<Vec<Shipped>> = LazyLock::new(|| {
    let all = library::all().iter();
    all.map(|shipped| Shipped { id: shipped.id, device: lexican_eds::load(&shipped.input()).0 }).collect()
});

/// The device of the library with this vendor-ID and product code; `None` if there is none or several.
pub(crate) fn recognise(vendor: u32, product: u32) -> Option<&'static Shipped> {
    if vendor == 0 {
        return None;
    }
    let mut same = LIBRARY.iter().filter(|shipped| {
        let info = &shipped.device.info;
        info.vendor_number == Some(vendor) && info.product_number.unwrap_or(0) == product
    });
    same.next().filter(|_| same.next().is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_recognised_by_both_numbers() {
        let drive = &LIBRARY.iter().find(|shipped| shipped.id == "siko/ag03-1").unwrap().device.info;
        let (vendor, product) = (drive.vendor_number.unwrap(), drive.product_number.unwrap_or(0));
        assert_eq!(recognise(vendor, product).map(|shipped| shipped.id), Some("siko/ag03-1"));
        assert!(recognise(vendor, product + 1).is_none());
        assert!(recognise(vendor + 1, product).is_none());
        assert!(recognise(0, 0).is_none());
    }
}
