//! The page and its WebSocket, over HTTP.
//!
//! Whoever knows the token may use the bench, so every request that shows or does something needs it. The page itself
//! is the same for all users, and shows nothing without the token.

mod changes;
mod connections;
mod downloads;
mod files;
mod guard;
mod shared;
mod socket;

use std::future::IntoFuture;
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Request, State};
use axum::http::header::{
    CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue, REFERRER_POLICY, SEC_WEBSOCKET_PROTOCOL,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, Response, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::IntoResponse;
use axum::routing::{any, get};
use tokio::sync::{Semaphore, watch};
use tokio::time::{MissedTickBehavior, interval, timeout};

use crate::Bench;
use changes::Fields;
use connections::Connections;
use downloads::Downloads;
use files::Files;
use guard::{Names, Token};
use shared::{Shared, ended};
#[cfg(test)]
pub(crate) use socket::ToPage;

/// The interval of taking views.
const VIEWS: Duration = Duration::from_millis(100);
/// The most pages open at once.
const CLIENTS: usize = 32;
/// The longest message of a page, in bytes: the text of a large DCF.
const MESSAGE: usize = 4 << 20;
/// The most threads that begin requests of pages.
const THREADS: usize = 8;
/// How long the end waits for open requests.
const LEAVING: Duration = Duration::from_secs(1);
/// The WebSocket subprotocol; a page requests it, followed by the token.
const PROTOCOL: &str = "lexican-bench";

/// Headers of all responses: nothing is loaded from elsewhere, and no other site gets access.
const POLICIES: [(HeaderName, &str); 5] = [
    (
        CONTENT_SECURITY_POLICY,
        "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'",
    ),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (REFERRER_POLICY, "no-referrer"),
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
];

/// The bench's web server, which accepts connections from its creation on.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: Token,
    names: Names,
    end: watch::Sender<bool>,
}

/// Ends a server from another thread.
#[derive(Clone)]
pub struct End(watch::Sender<bool>);

impl End {
    /// Tells the pages, then makes [`Server::run`] return.
    pub fn end(&self) {
        self.0.send_replace(true);
    }
}

impl Server {
    /// Listens at an address; port 0 means any free port. `names` are allowed in addresses besides the server's IP
    /// addresses, as behind a reverse proxy.
    pub fn bind(address: SocketAddr, names: Vec<String>) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok(Server { listener, address, token: Token::new()?, names: Names(names), end: watch::Sender::new(false) })
    }

    /// The address it listens at.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The URL for a browser on this computer, with the token.
    pub fn url(&self) -> String {
        let mut address = self.address;
        // The server listens at all addresses of this computer.
        if address.ip().is_unspecified() {
            address.set_ip(if address.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
        }
        format!("http://{address}/?token={}", self.token.as_str())
    }

    /// A handle that ends the server.
    pub fn end(&self) -> End {
        End(self.end.clone())
    }

    /// Serves pages of a bench until [`End::end`].
    pub fn run(self, bench: Bench) -> io::Result<()> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .max_blocking_threads(THREADS)
            .enable_all()
            .build()?;
        let outcome = runtime.block_on(self.serve(bench));
        runtime.shutdown_timeout(LEAVING);
        outcome
    }

    async fn serve(self, bench: Bench) -> io::Result<()> {
        let listener = tokio::net::TcpListener::from_std(self.listener)?;
        let shared = Arc::new(Shared {
            bench,
            token: self.token,
            names: self.names,
            files: Files::new(),
            downloads: Downloads::default(),
            fields: watch::Sender::new(Fields::default()),
            clients: Arc::new(Semaphore::new(CLIENTS)),
            end: self.end,
        });
        let (mut ending, mut end) = (shared.end.subscribe(), shared.end.subscribe());
        let clients = Arc::clone(&shared.clients);
        tokio::spawn(take_views(Arc::clone(&shared)));
        let router = Router::new()
            .route("/ws", any(open_socket))
            .route("/file/{key}", get(download))
            .fallback(get(page))
            .layer(from_fn_with_state(Arc::clone(&shared), judge))
            .with_state(shared);
        let server = axum::serve(Connections::new(listener), router)
            .with_graceful_shutdown(async move { ended(&mut ending).await });
        let server = tokio::spawn(server.into_future());
        ended(&mut end).await;
        // Wait until every page has been told; connections that stay open end with the program.
        let leave = async {
            let _ = clients.acquire_many(CLIENTS as u32).await;
            let _ = server.await;
        };
        let _ = timeout(LEAVING, leave).await;
        Ok(())
    }
}

/// Takes views at intervals, once for all pages, while there are any.
async fn take_views(shared: Arc<Shared>) {
    let mut ticks = interval(VIEWS);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        if shared.fields.receiver_count() > 0 {
            let view = shared.bench.view();
            shared.fields.send_modify(|fields| fields.update(&view));
        }
    }
}

/// Refuses foreign requests, and adds headers to all responses.
async fn judge(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response<Body> {
    let mut answer = match shared.names.judge(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(forbidden) => refuse(StatusCode::FORBIDDEN, forbidden.why),
    };
    for (name, value) in POLICIES {
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    answer
}

fn refuse(status: StatusCode, why: impl Into<String>) -> Response<Body> {
    (status, [(CONTENT_TYPE, "text/plain; charset=utf-8")], why.into() + "\n").into_response()
}

const WRONG_TOKEN: &str = "this is not the bench's token\nopen the address that lexican bench printed";

/// A file of the page. A token in the address must be the right one.
async fn page(State(shared): State<Arc<Shared>>, uri: Uri, headers: HeaderMap) -> Response<Body> {
    let mut parameters = uri.query().unwrap_or_default().split('&');
    if parameters.any(|it| it.strip_prefix("token=").is_some_and(|token| !shared.token.is(token))) {
        return refuse(StatusCode::FORBIDDEN, WRONG_TOKEN);
    }
    shared.files.answer(uri.path(), &headers).unwrap_or_else(|| refuse(StatusCode::NOT_FOUND, "there is no such file"))
}

/// A waiting file, for the page that knows its address.
async fn download(State(shared): State<Arc<Shared>>, Path(key): Path<String>) -> Response<Body> {
    let answer = shared.downloads.answer(&key);
    answer.unwrap_or_else(|| refuse(StatusCode::NOT_FOUND, "this file has been fetched, or its page is closed"))
}

/// Opens the WebSocket of a new client.
async fn open_socket(
    State(shared): State<Arc<Shared>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response<Body> {
    let named = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter().filter_map(|value| value.to_str().ok());
    let mut named = named.flat_map(|value| value.split(',')).map(str::trim);
    if !named.any(|name| shared.token.is(name)) {
        return refuse(StatusCode::FORBIDDEN, WRONG_TOKEN);
    }
    let Ok(place) = Arc::clone(&shared.clients).try_acquire_owned() else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, format!("{CLIENTS} pages are open\nclose one of them"));
    };
    let upgrade = upgrade.protocols([PROTOCOL]).max_message_size(MESSAGE).max_frame_size(MESSAGE);
    upgrade.on_upgrade(move |socket| async move {
        socket::serve(socket, shared).await;
        drop(place);
    })
}
