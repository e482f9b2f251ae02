//! The data sheets that are shipped with the crate (`devices/<vendor>/<device>/`).

use crate::{Input, Source};

/// A device of the library.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// Its folder: `vendor/device`.
    pub id: &'static str,
    /// The name of the data sheet's file.
    pub file_name: &'static str,
    /// The data sheet.
    pub eds: &'static [u8],
    /// The name of the overlay's file, empty when there is none.
    pub overlay_name: &'static str,
    /// The overlay.
    pub overlay: Option<&'static str>,
    /// Other names it answers to: `names` of the overlay.
    pub names: &'static [&'static str],
}

impl Shipped {
    /// What [`load`](crate::load) reads.
    #[must_use]
    pub fn input(&self) -> Input {
        let name = |file: &str| format!("{}/{file}", self.id);
        let overlays = self.overlay.map(|text| Source::new(name(self.overlay_name), text));
        Input { eds: Source::from_bytes(name(self.file_name), self.eds), overlays: overlays.into_iter().collect() }
    }
}

/// The device with this id, file name or other name, in any case.
#[must_use]
pub fn find(name: &str) -> Option<&'static Shipped> {
    let name = name.trim();
    let is = |other: &str| other.eq_ignore_ascii_case(name);
    all()
        .iter()
        .find(|shipped| is(shipped.id))
        .or_else(|| all().iter().find(|shipped| is(shipped.file_name) || shipped.names.iter().copied().any(is)))
}

/// All devices, by id.
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
