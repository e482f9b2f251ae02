//! Files that a page can fetch once.

use std::collections::VecDeque;
use std::fmt::Write;
use std::sync::{Mutex, PoisonError};

use axum::body::Body;
use axum::http::Response;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};

use super::guard::Token;

/// The most files that wait for a client; a new one replaces the oldest.
const WAITING: usize = 4;

/// The waiting files.
#[derive(Default)]
pub(super) struct Downloads {
    waiting: Mutex<VecDeque<Download>>,
}

struct Download {
    /// The client that may fetch it; dropped when that is closed.
    client: u32,
    key: Token,
    name: String,
    content: Vec<u8>,
}

impl Downloads {
    /// Keeps a file for a client; returns the address to fetch it from.
    pub(super) fn offer(&self, client: u32, name: String, content: Vec<u8>) -> std::io::Result<String> {
        let key = Token::new()?;
        let address = format!("/file/{}", key.as_str());
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.iter().filter(|download| download.client == client).count() >= WAITING
            && let Some(oldest) = waiting.iter().position(|download| download.client == client)
        {
            waiting.remove(oldest);
        }
        waiting.push_back(Download { client, key, name, content });
        Ok(address)
    }

    /// The response to the first request for a file.
    pub(super) fn answer(&self, key: &str) -> Option<Response<Body>> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let found = waiting.iter().position(|download| download.key.is(key))?;
        let download = waiting.remove(found)?;
        Response::builder()
            .header(CONTENT_TYPE, "application/octet-stream")
            .header(CONTENT_DISPOSITION, format!("attachment; filename*=UTF-8''{}", percent_encoded(&download.name)))
            .header(CACHE_CONTROL, "no-store")
            .body(download.content.into())
            .ok()
    }

    /// Drops the files of a client.
    pub(super) fn forget(&self, client: u32) {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).retain(|download| download.client != client);
    }
}

/// Encodes a parameter of a header (RFC 8187).
fn percent_encoded(name: &str) -> String {
    let mut encoded = String::new();
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' => encoded.push(byte.into()),
            _ => {
                let _ = write!(encoded, "%{byte:02X}");
            }
        }
    }
    encoded
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(address: &str) -> &str {
        address.strip_prefix("/file/").unwrap()
    }

    #[test]
    fn a_file_is_given_once() {
        let downloads = Downloads::default();
        let address = downloads.offer(1, "förderer 1.dcf".to_owned(), b"[FileInfo]".to_vec()).unwrap();
        assert!(downloads.answer("0f3a").is_none());
        let answer = downloads.answer(key(&address)).unwrap();
        let name = answer.headers()[CONTENT_DISPOSITION].to_str().unwrap();
        assert_eq!(name, "attachment; filename*=UTF-8''f%C3%B6rderer%201.dcf");
        assert!(downloads.answer(key(&address)).is_none());
    }

    #[test]
    fn only_the_last_files_of_a_client_wait_and_none_of_a_closed_one() {
        let downloads = Downloads::default();
        let offer = |client| downloads.offer(client, "a".to_owned(), Vec::new()).unwrap();
        let (other, first) = (offer(2), offer(1));
        let rest: Vec<_> = (0..WAITING).map(|_| offer(1)).collect();
        assert!(downloads.answer(key(&first)).is_none());
        assert!(downloads.answer(key(&rest[0])).is_some());
        downloads.forget(1);
        assert!(downloads.answer(key(&rest[1])).is_none());
        assert!(downloads.answer(key(&other)).is_some());
    }
}
