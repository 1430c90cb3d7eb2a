//! The workbench as a page on this machine only.
//!
//! The server listens on 127.0.0.1, prints an address with a random token, and
//! refuses requests of other hosts, other origins or without the token
//! ([`guard`]). Flights arrive as text in a request, or by their number in the
//! list that the command line named; no request carries a path. axum does
//! routing, limits and bodies: it is the Tokio project's own server library.
//!
//! | request | answer |
//! |---|---|
//! | `GET /?token=…` | the page |
//! | `GET /api/catalogue` | effects with parameters, units, ranges; flights on offer; faults |
//! | `POST /api/open` | a dropped flight, a listed one, or the example: its summary and number |
//! | `GET /api/opening` | how far that is |
//! | `POST /api/evaluate` | error, traces and L/D curve with the ticked effects |
//! | `POST /api/overlay` | the traces of a second open flight, and their difference |
//! | `POST /api/fit` | the same, with the ticked effects refitted |
//! | `POST /api/diagnose` | lines of progress, then the verdict |
//! | `POST /api/next`, `POST /api/report` | the next mission, the offline report, of the last diagnosis |
//! | `POST /api/fly` | lines of a HIL flight while it flies; of two with the learnt world, old table and new |
//! | `GET /api/watch` | the lines of that flight so far, for a page that was loaded again |
//! | `POST /api/fault`, `POST /api/stop` | act on the flight under way |
//! | `POST /api/save` | vehicle file with the ticked effects, or calibrated alone, and its flight table |

mod dropped;
pub mod flights;
mod found;
pub mod guard;
pub mod live;
mod mission;
pub mod overlay;
mod requests;

use anyhow::Context;
use axum::extract::{DefaultBodyLimit, Query, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::Next;
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router, middleware};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::Value;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Largest request, bytes: a flight of a month at 1 Hz is about 200 MB and belongs to the command line.
pub const MAX_REQUEST: usize = 80 << 20;

/// What the server knows.
#[derive(Debug, Default)]
pub struct Workbench {
    /// Flights named on the command line; the page picks them by number.
    pub offered: Vec<PathBuf>,
    /// Flights opened in this run.
    pub open: Mutex<Vec<Arc<flights::Opened>>>,
    /// The HIL flight under way.
    pub live: live::Live,
    /// What is done with the flight that is being opened.
    pub opening: Mutex<&'static str>,
    /// Where logs of HIL flights go.
    pub logs: PathBuf,
}

/// A request that cannot be done, in one sentence for the person at the page.
#[derive(Debug)]
pub struct Sorry(pub String);

impl<E: std::fmt::Display> From<E> for Sorry {
    fn from(e: E) -> Self {
        Self(format!("{e:#}"))
    }
}

impl IntoResponse for Sorry {
    fn into_response(self) -> Response {
        (StatusCode::BAD_REQUEST, self.0).into_response()
    }
}

/// Time in which the head of a request has to be here, and its files: 80 MB through a slow tunnel.
const HEAD_WITHIN: Duration = Duration::from_secs(20);
const FILES_WITHIN: Duration = Duration::from_secs(600);

/// Axum layer: says in a sentence what was too large, before reading it where its length is told, and lets go of what never comes.
async fn bounded(request: Request, next: Next) -> Response {
    let length = request.headers().get(header::CONTENT_LENGTH).and_then(|v| v.to_str().ok()).and_then(|v| v.parse::<u64>().ok());
    let (head, body) = request.into_parts();
    let read =
        async { if length.is_some_and(|n| n > MAX_REQUEST as u64) { None } else { axum::body::to_bytes(body, MAX_REQUEST).await.ok() } };
    match tokio::time::timeout(FILES_WITHIN, read).await {
        Ok(Some(whole)) => next.run(Request::from_parts(head, whole.into())).await,
        Ok(None) => {
            let text = format!(
                "These files are too large for the page, which takes up to {} MB: use `glider compare` and `glider diagnose --flight` for more.",
                MAX_REQUEST >> 20
            );
            (StatusCode::PAYLOAD_TOO_LARGE, text).into_response()
        }
        Err(_) => (StatusCode::REQUEST_TIMEOUT, "these files did not arrive in ten minutes").into_response(),
    }
}

/// What a request is answered that met a fault of the program.
const FAULT: &str = "this request failed by a fault of the program, which the terminal of `glider serve` shows; all else goes on";

/// Axum layer: a panic ends the request that met it, and nothing else.
async fn contained(request: Request, next: Next) -> Response {
    let answer = tokio::spawn(next.run(request)).await;
    answer.unwrap_or_else(|_| (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response())
}

type Answer = Result<Json<Value>, Sorry>;

/// The page, whole.
#[must_use]
pub fn page() -> String {
    use crate::pages::assets::{PAGE_CSS, PAGE_JS, UPLOT_CSS, UPLOT_JS};
    let (css, js, fly) = (include_str!("workbench.css"), include_str!("workbench.js"), include_str!("fly.js"));
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <link rel=\"icon\" href=\"data:,\"><title>Glider workbench</title><style>{UPLOT_CSS}</style><style>{PAGE_CSS}{css}</style></head>\n\
         <body><main id=\"page\"></main>\n<script>{UPLOT_JS}</script>\n<script>{PAGE_JS}</script>\n<script>{js}</script>\n<script>{fly}</script></body></html>\n"
    )
}

/// One JSON document per line, to the page, as the work goes on. Sending never
/// fails: when the page is gone the work goes on without it.
#[derive(Clone, Debug)]
pub struct Lines {
    sender: tokio::sync::mpsc::UnboundedSender<Result<String, std::convert::Infallible>>,
    /// The same lines kept for a page that is loaded again.
    kept: Option<live::Kept>,
}

impl Lines {
    /// These lines, kept as well.
    #[must_use]
    pub fn kept(self, kept: live::Kept) -> Self {
        Self { kept: Some(kept), ..self }
    }

    /// One more line.
    pub fn send(&self, document: &Value) {
        // The page may have been closed; the flight or the search is not its slave.
        let _ = self.sender.send(Ok(format!("{document}\n")));
        if let Some(kept) = &self.kept {
            kept.push(document);
        }
    }
}

/// A sender of lines, and the body that carries them.
#[must_use]
pub fn lines() -> (Lines, tokio_stream::wrappers::UnboundedReceiverStream<Result<String, std::convert::Infallible>>) {
    let (sender, receiver) = tokio::sync::mpsc::unbounded_channel();
    (Lines { sender, kept: None }, tokio_stream::wrappers::UnboundedReceiverStream::new(receiver))
}

/// Work that takes more than a moment goes to a thread of its own, so that the page stays answered.
async fn blocking(work: impl FnOnce() -> anyhow::Result<Value> + Send + 'static) -> Answer {
    Ok(Json(tokio::task::spawn_blocking(work).await.map_err(|_| FAULT)??))
}

/// Work whose lines go out as they come; what it failed by is the last of them.
fn streaming(lines: Lines, work: impl FnOnce(&Lines) -> anyhow::Result<()> + Send + 'static) {
    tokio::task::spawn_blocking(move || {
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&lines)));
        if let Err(e) = done.unwrap_or_else(|_| Err(anyhow::anyhow!(FAULT))) {
            lines.send(&serde_json::json!({"error": format!("{e:#}")}));
        }
    });
}

/// All routes behind the guard.
pub fn router(bench: Arc<Workbench>, guard: Arc<guard::Guard>) -> Router {
    type Bench = State<Arc<Workbench>>;
    Router::new()
        .route("/", get(|| async { Html(page()) }))
        .route("/api/catalogue", get(|State(b): Bench| async move { blocking(move || Ok(flights::catalogue(&b))).await }))
        .route("/api/open", post(|State(b): Bench, Json(r): Json<flights::Open>| async move { blocking(move || b.open_flight(&r)).await }))
        .route("/api/own", post(|Json(r): Json<flights::Own>| async move { blocking(move || flights::own(&r)).await }))
        .route("/api/opening", get(|State(b): Bench| async move { Json(b.opening_now()) }))
        .route(
            "/api/evaluate",
            post(|State(b): Bench, Json(r): Json<flights::Evaluate>| async move { blocking(move || b.evaluate(&r)).await }),
        )
        .route(
            "/api/overlay",
            post(|State(b): Bench, Json(r): Json<flights::Overlay>| async move { blocking(move || b.overlay(&r)).await }),
        )
        .route("/api/fit", post(|State(b): Bench, Json(r): Json<flights::Fit>| async move { blocking(move || b.fit(&r)).await }))
        .route("/api/save", post(|State(b): Bench, Json(r): Json<flights::Evaluate>| async move { blocking(move || b.save(&r)).await }))
        .route("/api/next", post(|State(b): Bench, Json(r): Json<flights::Fit>| async move { blocking(move || b.next_flight(&r)).await }))
        .route("/api/timeline", post(|State(b): Bench, Json(r): Json<flights::Fit>| async move { blocking(move || b.timeline(&r)).await }))
        .route("/api/report", post(|State(b): Bench, Json(r): Json<flights::Fit>| async move { blocking(move || b.report(&r)).await }))
        .route("/api/diagnose", post(found::diagnose))
        .route("/api/fly", post(live::fly))
        .route(
            "/api/watch",
            get(|State(b): Bench, Query(w): Query<live::Watch>| async move { blocking(move || Ok(b.live.watch(w.from))).await }),
        )
        .route(
            "/api/fault",
            post(|State(b): Bench, Json(r): Json<live::FaultRequest>| async move { blocking(move || b.live.inject(&r)).await }),
        )
        .route("/api/stop", post(|State(b): Bench| async move { blocking(move || b.live.recall()).await }))
        .layer(DefaultBodyLimit::max(MAX_REQUEST))
        .layer(middleware::from_fn(bounded))
        .layer(middleware::from_fn(contained))
        .layer(middleware::from_fn_with_state(guard, guard::check))
        .with_state(bench)
}

/// Serves until interrupted; `ready` gets the address to open.
///
/// # Errors
/// The port is taken, or the system gives no sockets.
pub fn run(port: u16, bench: Workbench, ready: impl FnOnce(&str)) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().context("cannot start the server")?;
    runtime.block_on(async move {
        let listener = tokio::net::TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port)))
            .await
            .with_context(|| format!("port {port} is not free; choose another with --port, or 0 for any"))?;
        let port = listener.local_addr().context("cannot read the port")?.port();
        let guard = Arc::new(guard::Guard::new().context("no random token")?);
        ready(&format!("http://127.0.0.1:{port}/?token={}", guard.token));
        accept(listener, router(Arc::new(bench), guard), HEAD_WITHIN).await
    })
}

/// Answers every connection, each in a task of its own; one that sends no whole head of a request within `patience` is closed.
async fn accept(listener: tokio::net::TcpListener, app: Router, patience: Duration) -> ! {
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // Too many open files, say: some will be closed.
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        let service = TowerToHyperService::new(app.clone());
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new()).header_read_timeout(patience);
        // A browser that went away is no error.
        tokio::spawn(async move { drop(http.serve_connection(TokioIo::new(stream), service).await) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;
    use std::io::{Read as _, Write as _};
    use std::net::TcpStream;

    /// A server of these routes on a port of its own, as long as the runtime is kept.
    fn serving(app: Router, patience: Duration) -> (tokio::runtime::Runtime, SocketAddr) {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().expect("a runtime");
        let listener = runtime.block_on(tokio::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0))).expect("a port");
        let at = listener.local_addr().expect("an address");
        runtime.spawn(accept(listener, app, patience));
        (runtime, at)
    }

    /// All that is answered to these bytes until the connection is closed.
    fn answer(at: SocketAddr, sent: &str) -> String {
        let mut stream = TcpStream::connect(at).expect("connected");
        stream.set_read_timeout(Some(Duration::from_secs(10))).expect("set");
        stream.write_all(sent.as_bytes()).expect("sent");
        let mut all = String::new();
        stream.read_to_string(&mut all).expect("closed by the server");
        all
    }

    #[test]
    fn regress_a_connection_without_a_whole_head_is_closed() {
        let app = Router::new().route("/", get(|| async { "here" }));
        let (_runtime, at) = serving(app, Duration::from_millis(300));
        for half in ["", "GET / HT", "GET / HTTP/1.1\r\nHost: a\r\n"] {
            let began = std::time::Instant::now();
            answer(at, half);
            assert!(began.elapsed() < Duration::from_secs(5), "{half:?} took {:?}", began.elapsed());
        }
        assert!(answer(at, "GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n").ends_with("here"));
    }

    #[test]
    fn regress_a_panic_ends_its_request_only() {
        async fn fails() -> &'static str {
            panic!("on purpose")
        }
        let streams = || async {
            let (lines, body) = lines();
            streaming(lines, |_| panic!("on purpose, in a stream"));
            Body::from_stream(body).into_response()
        };
        let slow = || async { blocking(|| panic!("on purpose, in a thread")).await };
        let app = Router::new().route("/fails", get(fails)).route("/stream", get(streams)).route("/slow", get(slow));
        let (_runtime, at) = serving(app.route("/", get(|| async { "here" })).layer(middleware::from_fn(contained)), HEAD_WITHIN);
        let asked = |path: &str| answer(at, &format!("GET {path} HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"));
        for path in ["/fails", "/stream", "/slow"] {
            assert!(asked(path).contains("a fault of the program"), "{path}: {}", asked(path));
        }
        assert!(asked("/fails").starts_with("HTTP/1.1 500") && asked("/").ends_with("here"));
    }

    #[test]
    fn regress_files_that_are_too_large_are_refused_in_a_sentence() {
        let app = Router::new().route("/", post(|| async { "here" })).layer(middleware::from_fn(bounded));
        let (_runtime, at) = serving(app, HEAD_WITHIN);
        let asked = |head: &str| answer(at, &format!("POST / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n{head}"));
        assert!(asked("Content-Length: 900000000\r\n\r\n").contains("up to 80 MB"));
        assert!(asked("Content-Length: 2\r\n\r\n{}").ends_with("here"));
    }
}
