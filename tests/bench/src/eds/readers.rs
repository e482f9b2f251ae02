//! The readers that are compared, each from the text or bytes of one file to what it makes of them.

use std::borrow::Cow;

use ini::{Ini, ParseOption};
use lexican_eds::{Diagnostics, Input, Source, model};

pub(super) fn lexican(bytes: &[u8]) -> (model::Device, Diagnostics) {
    lexican_eds::load(&Input::new(Source::from_bytes("bench.eds", bytes)))
}

pub(super) fn rust_ini(text: &str) -> Result<Ini, ini::ParseError> {
    let options = ParseOption { enabled_quote: false, enabled_escape: false, ..ParseOption::default() };
    Ini::load_from_str_opt(text, options)
}

pub(super) fn canopen_host(text: &str) -> Result<canopen_host::eds::Eds, canopen_host::eds::EdsError> {
    canopen_host::eds::Eds::parse(text)
}

/// For those who do not decode: every byte that is no UTF-8 costs a replacement character.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}
