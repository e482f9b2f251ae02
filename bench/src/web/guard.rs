//! Checks who may talk to the bench: requests must have the token, and an address of the bench itself.

use std::hint::black_box;
use std::io;
use std::net::IpAddr;

use axum::http::header::{HOST, HeaderMap, HeaderName, ORIGIN};
use axum::http::uri::{Authority, Uri};

/// The token that `lexican bench` prints: 128 random bits in hexadecimal.
#[derive(Clone)]
pub(super) struct Token(String);

impl Token {
    pub(super) fn new() -> io::Result<Self> {
        let mut bits = [0; 16];
        getrandom::fill(&mut bits).map_err(io::Error::other)?;
        Ok(Token(bits.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    pub(super) fn as_str(&self) -> &str {
        &self.0
    }

    /// Compares in constant time, so that the duration does not reveal how much of the token is right.
    pub(super) fn is(&self, text: &str) -> bool {
        let (this, text) = (self.0.as_bytes(), text.as_bytes());
        let differences = this.iter().zip(text).fold(0, |found, (this, other)| black_box(found | (this ^ other)));
        this.len() == text.len() && differences == 0
    }
}

/// Why a request is refused, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Forbidden {
    pub(super) why: String,
}

fn forbidden(why: impl Into<String>) -> Forbidden {
    Forbidden { why: why.into() }
}

/// The names of the bench in addresses, besides those that nobody else can use.
#[derive(Clone, Debug, Default)]
pub(super) struct Names(pub(super) Vec<String>);

impl Names {
    /// Checks the host and the origin of a request. Foreign pages can send requests to this computer, and their names
    /// can be made to point to it after they are loaded (DNS rebinding). So only IP addresses, `localhost` and the
    /// names given by the user are trusted.
    pub(super) fn judge(&self, headers: &HeaderMap) -> Result<(), Forbidden> {
        let host = only(headers, &HOST)?.ok_or_else(|| forbidden("the request has no Host"))?;
        let host: Authority = host.parse().map_err(|_| forbidden(format!("{host:?} is no Host")))?;
        if !self.knows(host.host()) {
            let name = host.host();
            return Err(forbidden(format!(
                "this bench does not go by the name {name}\nuse its IP address or localhost, or start it with --host {name}"
            )));
        }
        let Some(origin) = only(headers, &ORIGIN)? else { return Ok(()) };
        let from = origin.parse::<Uri>().ok();
        // The bench itself does not serve TLS; a reverse proxy does, with a given name.
        let schemes: &[&str] = if self.is_given(host.host()) { &["http", "https"] } else { &["http"] };
        let is_known = |from: &Uri| from.scheme_str().is_some_and(|scheme| schemes.contains(&scheme));
        if from.as_ref().filter(|from| is_known(from)).and_then(Uri::authority) == Some(&host) {
            return Ok(());
        }
        Err(forbidden(format!(
            "a page of {origin} may not use the bench at {host}\nopen the address that lexican bench printed"
        )))
    }

    fn knows(&self, host: &str) -> bool {
        let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
        bare.parse::<IpAddr>().is_ok() || host.eq_ignore_ascii_case("localhost") || self.is_given(host)
    }

    fn is_given(&self, host: &str) -> bool {
        self.0.iter().any(|name| host.eq_ignore_ascii_case(name))
    }
}

/// The text of a header that may occur once.
fn only<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Result<Option<&'h str>, Forbidden> {
    let mut values = headers.get_all(name).iter();
    let first = values.next();
    if values.next().is_some() {
        return Err(forbidden(format!("the request has more than one {name}")));
    }
    first.map(|value| value.to_str().map_err(|_| forbidden(format!("the request's {name} is no text")))).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(headers: &[(HeaderName, &str)]) -> Result<(), String> {
        let headers = headers.iter().map(|(name, value)| (name.clone(), value.parse().unwrap())).collect::<Vec<_>>();
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(name, value);
        }
        Names(vec!["bench.example".to_owned()]).judge(&map).map_err(|error| error.why)
    }

    #[test]
    fn a_token_is_compared_as_a_whole() {
        let (token, other) = (Token::new().unwrap(), Token::new().unwrap());
        assert_eq!(token.as_str().len(), 32);
        assert!(token.is(token.as_str()) && !token.is(other.as_str()) && !token.is(""));
        assert!(!token.is(&token.as_str()[..31]) && !token.is(&format!("{}0", token.as_str())));
    }

    #[test]
    fn a_host_is_an_address_or_a_name_that_was_given() {
        for host in ["127.0.0.1:7001", "localhost", "LOCALHOST:1", "[::1]:7001", "192.168.0.7", "bench.example:443"] {
            assert_eq!(judge(&[(HOST, host)]), Ok(()), "{host}");
        }
        // Names that browsers resolve, and texts that only look like IP addresses.
        for host in
            ["evil.example:7001", "127.0.0.1.evil.example", "localhost.evil.example", "localhost.", "", "[::1", "a b"]
        {
            assert!(judge(&[(HOST, host)]).is_err(), "{host}");
        }
        assert!(judge(&[(HOST, "other.example")]).unwrap_err().contains("--host other.example"));
        assert!(judge(&[]).is_err());
        assert!(judge(&[(HOST, "localhost"), (HOST, "evil.example")]).is_err());
    }

    #[test]
    fn a_page_of_another_origin_is_refused() {
        let from = |origin: &str| judge(&[(HOST, "127.0.0.1:7001"), (ORIGIN, origin)]);
        assert_eq!(from("http://127.0.0.1:7001"), Ok(()));
        // Behind a reverse proxy with TLS.
        assert_eq!(judge(&[(HOST, "bench.example"), (ORIGIN, "https://bench.example")]), Ok(()));
        // Another port of this computer is another program.
        for origin in [
            "http://127.0.0.1:7002",
            "http://127.0.0.1",
            "http://localhost:7001",
            "https://127.0.0.1:7001",
            "ftp://127.0.0.1:7001",
            "http://evil.example",
            "null",
            "file://",
        ] {
            assert!(from(origin).unwrap_err().contains("may not use the bench"), "{origin}");
        }
        assert!(judge(&[(HOST, "localhost"), (ORIGIN, "http://localhost"), (ORIGIN, "http://evil.example")]).is_err());
    }
}
