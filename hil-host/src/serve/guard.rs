//! Who may talk to the workbench: a page that this server itself handed out,
//! on this machine, with the token of this run.
//!
//! A web page of another site can make a browser send requests to 127.0.0.1.
//! Three checks stop it: the `Host` header must be this machine's loopback (DNS
//! rebinding brings another name), the `Origin` header, where a browser sends
//! one, must be of that host and port, and the token, which only the printed
//! address carries, must be there. Any port will do: a tunnel has its own.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// What a request must show.
#[derive(Clone, Debug)]
pub struct Guard {
    /// Random token of this run, hexadecimal.
    pub token: String,
}

impl Guard {
    /// A guard with a fresh token: 128 bits from the operating system.
    ///
    /// # Errors
    /// When the system gives no random numbers.
    pub fn new() -> std::io::Result<Self> {
        use std::fmt::Write;
        let mut bytes = [0u8; 16];
        getrandom::fill(&mut bytes).map_err(|e| std::io::Error::other(e.to_string()))?;
        let token = bytes.iter().fold(String::new(), |mut s, b| {
            let _ = write!(s, "{b:02x}");
            s
        });
        Ok(Self { token })
    }

    /// Why a request is refused, if it is.
    #[must_use]
    pub fn refusal(&self, headers: &HeaderMap, query: Option<&str>) -> Option<&'static str> {
        // A second one might be what another program goes by.
        let all = |name| headers.get_all(name).iter().map(HeaderValue::to_str).collect::<Vec<_>>();
        let host = match all(header::HOST).as_slice() {
            [Ok(host)] if is_loopback(host) => *host,
            _ => return Some("this page answers only to 127.0.0.1 and localhost; from another machine: ssh -L PORT:localhost:PORT"),
        };
        match all(header::ORIGIN).as_slice() {
            [] => {}
            [Ok(origin)] if origin.strip_prefix("http://").is_some_and(|o| o.eq_ignore_ascii_case(host)) => {}
            _ => return Some("requests of other sites are refused"),
        }
        let given = headers
            .get("x-glider-token")
            .and_then(|v| v.to_str().ok())
            .or_else(|| query.and_then(|q| q.split('&').find_map(|pair| pair.strip_prefix("token="))));
        // Compared in full length, so that timing tells nothing of the token.
        let same =
            given.is_some_and(|g| g.len() == self.token.len() && g.bytes().zip(self.token.bytes()).fold(0, |d, (a, b)| d | (a ^ b)) == 0);
        if same { None } else { Some("the token is missing or of an earlier run: open the address that `glider serve` printed") }
    }
}

/// Whether a host, with or without a port, is this machine itself.
fn is_loopback(authority: &str) -> bool {
    let (host, port) = authority.rsplit_once(':').unwrap_or((authority, "80"));
    port.parse::<u16>().is_ok() && (host == "127.0.0.1" || host.eq_ignore_ascii_case("localhost"))
}

/// Axum layer: refuses what the guard refuses, and forbids the page to load anything from elsewhere.
pub async fn check(State(guard): State<Arc<Guard>>, request: Request, next: Next) -> Response {
    if let Some(why) = guard.refusal(request.headers(), request.uri().query()) {
        return (StatusCode::FORBIDDEN, why).into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static(
            "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src data: blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
        ),
    );
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(&'static str, &'static str)]) -> HeaderMap {
        let mut all = HeaderMap::new();
        for (name, value) in pairs {
            all.append(*name, HeaderValue::from_static(value));
        }
        all
    }

    #[test]
    fn only_our_own_page_with_the_token_passes() {
        let guard = Guard { token: "00112233445566778899aabbccddeeff".into() };
        let token = Some("token=00112233445566778899aabbccddeeff");
        assert_eq!(guard.refusal(&headers(&[("host", "127.0.0.1:8123")]), token), None);
        assert_eq!(guard.refusal(&headers(&[("host", "localhost:8123"), ("origin", "http://localhost:8123")]), token), None);
        // A tunnel (ssh -L 9000:localhost:8123) has a port of its own.
        assert_eq!(guard.refusal(&headers(&[("host", "LOCALHOST:9000"), ("origin", "http://localhost:9000")]), token), None);
        let refused: &[&[(&str, &str)]] = &[
            &[],
            &[("host", "evil.example:8123")],
            &[("host", "localhost.evil.example:8123")],
            &[("host", "localhost:http")],
            &[("host", "127.0.0.1:8123"), ("host", "evil.example:8123")],
            &[("host", "127.0.0.1:8123"), ("host", "127.0.0.1:8123")],
            &[("host", "127.0.0.1:8123"), ("origin", "http://evil.example")],
            &[("host", "127.0.0.1:8123"), ("origin", "http://127.0.0.1:8123"), ("origin", "http://evil.example")],
            &[("host", "127.0.0.1:8123"), ("origin", "http://127.0.0.1:3000")],
            &[("host", "127.0.0.1:8123"), ("origin", "null")],
            &[("host", "127.0.0.1:8123"), ("origin", "https://127.0.0.1:8123")],
        ];
        for pairs in refused {
            assert!(guard.refusal(&headers(pairs), token).is_some(), "{pairs:?}");
        }
        for query in [None, Some(""), Some("token="), Some("token=00112233445566778899aabbccddeefe"), Some("x=1&tok=1")] {
            assert!(guard.refusal(&headers(&[("host", "127.0.0.1:8123")]), query).is_some(), "{query:?}");
        }
    }

    #[test]
    fn tokens_differ_from_run_to_run() {
        let (a, b) = (Guard::new().expect("random numbers"), Guard::new().expect("random numbers"));
        assert_eq!(a.token.len(), 32);
        assert_ne!(a.token, b.token);
    }
}
