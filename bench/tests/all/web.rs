//! The bench's web server, over real sockets on loopback.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::thread::JoinHandle;

use lexican_bench::Bench;
use lexican_bench::engine::Setup;
use lexican_bench::model::BusInfo;
use lexican_bench::web::{End, Server};
use lexican_runtime::host::{Pace, VirtualBus};
use serde_json::{Value as Json, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::handshake::client::Request;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket, client};

/// A running server, ended with the test.
struct Served {
    address: SocketAddr,
    token: String,
    end: End,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    fn begin() -> Self {
        let server = Server::bind((Ipv4Addr::LOCALHOST, 0).into(), vec!["bench.example".to_owned()]).unwrap();
        let (address, end, url) = (server.address(), server.end(), server.url());
        let token = url.split_once("/?token=").unwrap().1.to_owned();
        let bus = VirtualBus::new();
        bus.set_pace(Pace::RealTime);
        let info = BusInfo { name: "test".to_owned(), is_writable: true, bit_rate: None };
        let bench = Bench::live(Box::new(bus.link()), Setup::new(info)).unwrap();
        let thread = std::thread::spawn(move || {
            server.run(bench.clone()).unwrap();
            bench.end();
        });
        Served { address, token, end, thread: Some(thread) }
    }

    /// The answer to a request with these headers: status, headers in lower case, body.
    fn asks(&self, line: &str, headers: &[(&str, &str)]) -> (u16, String, Vec<u8>) {
        let mut stream = TcpStream::connect(self.address).unwrap();
        let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        write!(stream, "{line} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap();
        let head = String::from_utf8(answer[..end].to_vec()).unwrap().to_lowercase();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        (status, head, answer[end + 4..].to_vec())
    }

    /// As [`Served::asks`], with the right Host.
    fn gets(&self, path: &str) -> (u16, String, Vec<u8>) {
        self.asks(&format!("GET {path}"), &[("Host", &self.address.to_string())])
    }

    /// A WebSocket request with this token, from a page of the bench.
    fn upgrade(&self, token: &str) -> Request {
        let mut request = format!("ws://{}/ws", self.address).into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{}", self.address).parse().unwrap());
        request.headers_mut().insert("Sec-WebSocket-Protocol", format!("lexican-bench, {token}").parse().unwrap());
        request
    }

    /// The status with which a WebSocket request is refused.
    fn refusal(&self, request: Request) -> Option<u16> {
        match client(request, TcpStream::connect(self.address).unwrap()) {
            Ok(_) => None,
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Some(answer.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn opens(&self) -> Page {
        let (socket, answer) = client(self.upgrade(&self.token), TcpStream::connect(self.address).unwrap()).unwrap();
        assert_eq!(answer.headers()["Sec-WebSocket-Protocol"], "lexican-bench", "the token is not sent back");
        let mut page = Page { socket, view: json!({}), views: Vec::new(), number: 0 };
        page.number = page.receives().unwrap()["hello"]["client"].as_u64().unwrap();
        page
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.end.end();
        self.thread.take().unwrap().join().unwrap();
    }
}

struct Page {
    socket: WebSocket<TcpStream>,
    /// All fields of the view.
    view: Json,
    /// The names of the fields in each received view.
    views: Vec<Vec<String>>,
    number: u64,
}

impl Page {
    fn sends(&mut self, message: &Json) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// The next message; `None` if the bench has closed the connection.
    fn receives(&mut self) -> Option<Json> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Some(serde_json::from_str(&text).unwrap()),
                Ok(Message::Close(_)) | Err(_) => return None,
                Ok(_) => {}
            }
        }
    }

    /// Takes over a view.
    fn sees(&mut self, message: &Json) {
        let fields = message["view"].as_object().unwrap();
        self.views.push(fields.keys().cloned().collect());
        for (name, value) in fields {
            self.view[name] = value.clone();
        }
        self.sends(&json!({ "seen": true }));
    }

    /// Takes views until they satisfy a condition.
    fn until(&mut self, holds: impl Fn(&Json) -> bool) {
        while !holds(&self.view) {
            let message = self.receives().unwrap();
            self.sees(&message);
        }
    }

    /// The answer to a request. Views that come meanwhile are taken over.
    fn asks(&mut self, id: u64, command: &Json) -> Json {
        let mut request = command.clone();
        request["id"] = json!(id);
        self.sends(&request);
        loop {
            let message = self.receives().unwrap();
            if message["id"] == id {
                return message;
            }
            self.sees(&message);
        }
    }
}

#[test]
fn the_page_is_served_with_its_policies_compressed_and_kept() {
    let bench = Served::begin();
    let (status, head, page) = bench.gets(&format!("/?token={}", bench.token));
    assert_eq!(status, 200, "{head}");
    assert!(head.contains("content-type: text/html; charset=utf-8") && page.starts_with(b"<!doctype html>"), "{head}");
    for policy in [
        "content-security-policy: default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        "cross-origin-resource-policy: same-origin",
        "cross-origin-opener-policy: same-origin",
        "referrer-policy: no-referrer",
        "x-content-type-options: nosniff",
        // Its address contains the token.
        "cache-control: no-store",
    ] {
        assert!(head.contains(policy), "no {policy}: {head}");
    }
    assert!(!head.contains("access-control"), "{head}");

    let host = ("Host", &*bench.address.to_string());
    let (status, head, script) = bench.asks("GET /app.js", &[host]);
    assert!(status == 200 && head.contains("text/javascript") && head.contains("cache-control: no-cache"), "{head}");
    let (_, packed, deflated) = bench.asks("GET /app.js", &[host, ("Accept-Encoding", "gzip, deflate, br")]);
    assert!(packed.contains("content-encoding: deflate") && deflated.len() < script.len() / 2, "{packed}");
    let etag = head.lines().find_map(|line| line.strip_prefix("etag: ")).unwrap();
    let (status, _, nothing) = bench.asks("GET /app.js", &[host, ("If-None-Match", etag)]);
    assert!(status == 304 && nothing.is_empty());

    let (status, head, nothing) = bench.asks(&format!("HEAD /?token={}", bench.token), &[host]);
    assert!(status == 200 && nothing.is_empty(), "{head}");
    for path in ["/no/such", "/../Cargo.toml", "/page/dist/index.html", "/file/0f3a", "/%2e%2e/Cargo.toml"] {
        assert_eq!(bench.gets(path).0, 404, "{path}");
    }
    assert_eq!(bench.asks("POST /", &[host, ("Content-Length", "0")]).0, 405);
}

#[test]
fn a_missing_or_wrong_token_is_refused() {
    let bench = Served::begin();
    let mut none = bench.upgrade("");
    none.headers_mut().remove("Sec-WebSocket-Protocol");
    assert_eq!(bench.refusal(none), Some(403));
    let short = &bench.token[..31];
    let long = format!("{}0", bench.token);
    for wrong in ["", "lexican-bench", "00000000000000000000000000000000", short, &long] {
        assert_eq!(bench.refusal(bench.upgrade(wrong)), Some(403), "{wrong}");
    }
    assert_eq!(bench.refusal(bench.upgrade(&bench.token)), None);
    // In the address, the token is accepted only for the page, because addresses appear in logs.
    let mut request = format!("ws://{}/ws?token={}", bench.address, bench.token).into_client_request().unwrap();
    request.headers_mut().insert("Origin", format!("http://{}", bench.address).parse().unwrap());
    assert_eq!(bench.refusal(request), Some(403));

    for wrong in ["/?token=", "/?token=0", &format!("/?token={long}"), "/app.js?token=0"] {
        let (status, _, why) = bench.gets(wrong);
        let why = String::from_utf8(why).unwrap();
        assert!(status == 403 && why.contains("open the address that lexican bench printed"), "{wrong}: {why}");
    }
    // Another run has another token.
    let other = Served::begin();
    assert_eq!(other.refusal(other.upgrade(&bench.token)), Some(403));
}

#[test]
fn a_page_of_another_origin_is_refused_even_with_the_token() {
    let bench = Served::begin();
    let port = bench.address.port();
    let foreign = ["http://evil.example", "null", &format!("http://localhost:{port}"), "http://127.0.0.1:1", "file://"];
    for origin in foreign {
        let mut request = bench.upgrade(&bench.token);
        request.headers_mut().insert("Origin", HeaderValue::from_str(origin).unwrap());
        assert_eq!(bench.refusal(request), Some(403), "{origin}");
        let headers = [("Host", &*bench.address.to_string()), ("Origin", origin)];
        assert_eq!(bench.asks(&format!("GET /?token={}", bench.token), &headers).0, 403, "{origin}");
    }
}

#[test]
fn a_rebound_host_is_refused_and_a_given_name_is_not() {
    let bench = Served::begin();
    let page = format!("GET /?token={}", bench.token);
    let port = bench.address.port();
    for host in [&format!("127.0.0.1:{port}"), &format!("localhost:{port}"), "bench.example", "[::1]:80"] {
        assert_eq!(bench.asks(&page, &[("Host", host)]).0, 200, "{host}");
    }
    for host in [&format!("evil.example:{port}"), "127.0.0.1.evil.example", "evil.example", ""] {
        let (status, _, why) = bench.asks(&page, &[("Host", host)]);
        assert_eq!(status, 403, "{host}: {}", String::from_utf8_lossy(&why));
    }
    // After DNS rebinding, the attacker's page has the same origin.
    let mut rebound = bench.upgrade(&bench.token);
    let host = format!("evil.example:{port}");
    rebound.headers_mut().insert("Host", host.parse().unwrap());
    rebound.headers_mut().insert("Origin", format!("http://{host}").parse().unwrap());
    assert_eq!(bench.refusal(rebound), Some(403));
    assert_eq!(bench.asks(&page, &[("Host", "localhost"), ("Host", "evil.example")]).0, 403);
}

#[test]
fn a_page_is_sent_everything_and_then_what_has_changed() {
    let bench = Served::begin();
    let mut page = bench.opens();
    page.until(|view| view["control"]["clients"] == 1);
    assert!(page.views[0].iter().any(|name| name == "nodes"), "{:?}", page.views);
    let mut other = bench.opens();
    assert_ne!(page.number, other.number);
    let before = page.views.len();
    page.until(|view| view["control"]["clients"] == 2);
    assert!(page.views[before..].iter().all(|names| !names.iter().any(|name| name == "nodes")), "{:?}", page.views);
    other.until(|view| view["control"]["clients"] == 2);
    drop(other);
    page.until(|view| view["control"]["clients"] == 1);
}

#[test]
fn requests_are_answered_or_refused_by_their_number() {
    let bench = Served::begin();
    let mut page = bench.opens();
    assert_eq!(page.asks(7, &json!({ "do": "stop-all" })), json!({ "id": 7, "answer": "done" }));
    let refused = page.asks(8, &json!({ "do": "explode" }));
    assert!(refused["refused"]["why"].as_str().unwrap().contains("this is no request"), "{refused}");
    let refused = page.asks(9, &json!({ "do": "nmt", "node": 300, "command": "start" }));
    assert!(refused["refused"]["why"].is_string(), "{refused}");
    // A message that is not JSON, or has no number, is not from the bench's page.
    for wrong in ["no JSON", "{\"do\": \"stop-all\"}"] {
        let mut page = bench.opens();
        page.socket.send(Message::text(wrong)).unwrap();
        while let Some(message) = page.receives() {
            page.sees(&message);
        }
    }
}

#[test]
fn a_page_that_takes_no_view_is_lost() {
    let bench = Served::begin();
    let mut page = bench.opens();
    let mut hanging = bench.opens();
    page.until(|view| view["control"]["clients"] == 2);
    page.until(|view| view["control"]["clients"] == 1);
    // Its browser accepts everything, but the page does not respond: it was sent one view and no more.
    let mut views = 0;
    while let Some(message) = hanging.receives() {
        views += usize::from(message["view"].is_object());
    }
    assert_eq!(views, 1);
}

#[test]
fn the_end_is_said_to_every_page() {
    let bench = Served::begin();
    let mut page = bench.opens();
    bench.end.end();
    let close = loop {
        match page.socket.read().unwrap() {
            Message::Close(close) => break close.unwrap(),
            Message::Text(_) => {}
            other => panic!("{other}"),
        }
    };
    assert_eq!((u16::from(close.code), close.reason.as_str()), (1001, "the bench has ended"));
}

#[test]
fn a_request_whose_head_never_ends_is_not_waited_for() {
    let served = Served::begin();
    let mut slow = TcpStream::connect(served.address).unwrap();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let mut answer = Vec::new();
    // The bench closes it; the harness ends a test that never ends.
    let _ = slow.read_to_end(&mut answer);
    assert_eq!(answer, b"");
}

#[test]
fn more_connections_than_there_are_places_wait_and_do_not_end_the_server() {
    let served = Served::begin();
    let silent: Vec<_> = (0..200).map(|_| TcpStream::connect(served.address).unwrap()).collect();
    // Connections that say nothing are dropped in turn.
    let mut asking = TcpStream::connect(served.address).unwrap();
    write!(asking, "GET /icon.svg HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", served.address).unwrap();
    let mut answer = String::new();
    asking.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    drop(silent);
}
