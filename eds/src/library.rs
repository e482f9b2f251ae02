//! The data sheets that are shipped with the crate (`devices/<vendor>/<device>/`).

use crate::{Input, Source};

/// A data sheet of the library.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// Its folder: `vendor/device`.
    pub id: &'static str,
    /// The file name of the data sheet.
    pub file_name: &'static str,
    /// The bytes of the data sheet.
    pub eds: &'static [u8],
    /// The file name of the overlay; empty if there is none.
    pub overlay_name: &'static str,
    /// The text of the overlay.
    pub overlay: Option<&'static str>,
    /// Other names of the device: `names` of the overlay.
    pub names: &'static [&'static str],
}

impl Shipped {
    /// The input for [`load`](crate::load).
    #[must_use]
    pub fn input(&self) -> Input {
        let name = |file: &str| format!("{}/{file}", self.id);
        let overlays = self.overlay.map(|text| Source::new(name(self.overlay_name), text));
        Input { eds: Source::from_bytes(name(self.file_name), self.eds), overlays: overlays.into_iter().collect() }
    }
}

/// The device with this id, file name or other name, in upper or lower case.
#[must_use]
pub fn find(name: &str) -> Option<&'static Shipped> {
    let name = name.trim();
    let is = |other: &str| other.eq_ignore_ascii_case(name);
    all()
        .iter()
        .find(|shipped| is(shipped.id))
        .or_else(|| all().iter().find(|shipped| is(shipped.file_name) || shipped.names.iter().copied().any(is)))
}

/// All devices, sorted by id.
#[must_use]
pub fn all() -> &'static [Shipped] {
    SHIPPED
}

include!(concat!(env!("OUT_DIR"), "/library.rs"));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_device_answers_to_all_its_names() {
        for shipped in all() {
            for name in shipped.names.iter().chain([&shipped.id]) {
                assert_eq!(find(&name.to_lowercase()).map(|found| found.id), Some(shipped.id), "{name}");
            }
        }
        assert!(find("no/such-device").is_none());
    }
}
