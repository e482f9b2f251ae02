//! Serves the page, which is built into the program.

use std::borrow::Cow;
use std::collections::BTreeMap;

use axum::body::{Body, Bytes};
use axum::http::header::{
    ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, ETAG, HeaderMap, IF_NONE_MATCH, VARY,
};
use axum::http::{Response, StatusCode};
use miniz_oxide::deflate::compress_to_vec_zlib;
use rust_embed::RustEmbed;

#[derive(RustEmbed)]
#[folder = "page/dist"]
struct Dist;

/// The file of the page itself.
const INDEX: &str = "index.html";

/// The files of the page, compressed once.
pub(super) struct Files {
    files: BTreeMap<String, File>,
}

struct File {
    content_type: &'static str,
    etag: String,
    plain: Bytes,
    /// Encoded with `deflate`, if that is shorter.
    deflated: Option<Bytes>,
}

impl Files {
    pub(super) fn new() -> Self {
        let file = |name: Cow<'static, str>| Some((name.to_string(), File::new(&name, &Dist::get(&name)?)));
        Files { files: Dist::iter().filter_map(file).collect() }
    }

    /// The response to a request for `/` or `/name`.
    pub(super) fn answer(&self, path: &str, asked: &HeaderMap) -> Option<Response<Body>> {
        let name = path.strip_prefix('/')?;
        let file = self.files.get(if name.is_empty() { INDEX } else { name })?;
        // The page's address may contain the token, so it must not be cached; other files are cached and revalidated.
        let kept = if name.is_empty() { "no-store" } else { "no-cache" };
        let answer =
            Response::builder().header(ETAG, &file.etag).header(CACHE_CONTROL, kept).header(VARY, "Accept-Encoding");
        let has = |header, wanted: &str| {
            let values = asked.get_all(header).iter().filter_map(|value| value.to_str().ok());
            values.flat_map(|value| value.split(',')).any(|value| value.trim() == wanted)
        };
        if has(IF_NONE_MATCH, &file.etag) {
            return answer.status(StatusCode::NOT_MODIFIED).body(Body::empty()).ok();
        }
        let answer = answer.header(CONTENT_TYPE, file.content_type);
        match &file.deflated {
            Some(deflated) if has(ACCEPT_ENCODING, "deflate") => {
                answer.header(CONTENT_ENCODING, "deflate").body(deflated.clone().into()).ok()
            }
            _ => answer.body(file.plain.clone().into()).ok(),
        }
    }
}

impl File {
    fn new(name: &str, file: &rust_embed::EmbeddedFile) -> Self {
        /// The best compression: it is done once, in milliseconds.
        const BEST: u8 = 9;
        let plain = Bytes::copy_from_slice(&file.data);
        let deflated = Some(compress_to_vec_zlib(&plain, BEST)).filter(|deflated| deflated.len() < plain.len());
        let hash: String = file.metadata.sha256_hash().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
        File {
            content_type: content_type(name),
            etag: format!("\"{hash}\""),
            plain,
            deflated: deflated.map(Bytes::from),
        }
    }
}

fn content_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, ending)| ending) {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "txt" | "" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use miniz_oxide::inflate::decompress_to_vec_zlib;

    #[test]
    fn the_page_is_whole_small_and_of_known_types() {
        let files = Files::new();
        assert!(files.files.contains_key(INDEX));
        for (name, file) in &files.files {
            assert_ne!(file.content_type, "application/octet-stream", "{name}");
            if let Some(deflated) = &file.deflated {
                assert_eq!(decompress_to_vec_zlib(deflated).unwrap(), file.plain, "{name}");
            }
        }
        let compressed: usize =
            files.files.values().map(|file| file.deflated.as_ref().unwrap_or(&file.plain).len()).sum();
        assert!(compressed < 300_000, "{compressed} bytes");
    }

    #[test]
    fn the_page_names_nothing_that_would_be_loaded_from_elsewhere() {
        let files = Files::new();
        let index = std::str::from_utf8(&files.files[INDEX].plain).unwrap();
        // These name what a browser loads; the policy forbids foreign addresses as well, which is tested in a browser.
        let mut named = index.split(['<', '>']).flat_map(str::split_whitespace);
        assert!(
            named.all(|word| !(word.starts_with("src=") || word.starts_with("href=")) || !word.contains("//")),
            "{index}"
        );
    }
}
