//! The review pages over HTTP: requests and responses of the review application, with limits on connections.

use super::connections::{Admission, ConnectionTable};
use crate::cli::http_server::{self, HttpRequest, HttpResponse};
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::Bytes;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::task::AbortHandle;
use typodont_report::sanitize_display;
use typodont_review::{BODY_MAX, Request, Response, ReviewApp, route_name};

/// Time limit for the body of a request; a browser needs milliseconds.
const BODY_WAIT: Duration = Duration::from_secs(10);

/// Maximum length of a logged line, characters.
const LOG_LINE_MAX: usize = 300;

/// Open connections, shared with the tasks that serve them.
type Connections = Arc<Mutex<ConnectionTable<AbortHandle>>>;

/// Locks the table. Its values are complete after every statement, so a poisoned mutex is used nevertheless.
fn locked(connections: &Connections) -> MutexGuard<'_, ConnectionTable<AbortHandle>> {
    connections.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Serves requests until the program is stopped. `proxy` is the address whose X-Forwarded-For header is believed.
///
/// # Errors
/// The system's error if the server cannot be started on this listener.
pub fn serve(listener: std::net::TcpListener, app: Arc<ReviewApp>, proxy: Option<IpAddr>) -> io::Result<()> {
    let at = listener.local_addr()?;
    let connections = Arc::new(Mutex::new(ConnectionTable::new(proxy)));
    let accepted = move |stream: TcpStream, peer: SocketAddr| {
        let Admission::Admitted(number, evicted) = locked(&connections).admit(peer.ip().to_canonical()) else {
            return;
        };
        if let Some(evicted) = evicted {
            evicted.abort();
        }
        let (desk, open) = (Arc::clone(&app), Arc::clone(&connections));
        let connection = ConnectionContext { number, peer, at, proxy, app: desk, connections: open };
        let task = tokio::spawn(serve_connection(stream, connection));
        locked(&connections).set_handle(number, task.abort_handle());
    };
    http_server::listen(listener, accepted, log)
}

/// A connection, and what its requests need.
#[derive(Clone)]
struct ConnectionContext {
    number: u64,
    peer: SocketAddr,
    at: SocketAddr,
    proxy: Option<IpAddr>,
    app: Arc<ReviewApp>,
    connections: Connections,
}

async fn serve_connection(stream: TcpStream, mut context: ConnectionContext) {
    // For a listener on an address such as 0.0.0.0: the local address at which this request arrived.
    context.at = stream.local_addr().unwrap_or(context.at);
    let _guard = ConnectionGuard { connections: Arc::clone(&context.connections), number: context.number };
    let answered = async |request: HttpRequest| {
        let response = handle(request, &context).await;
        locked(&context.connections).end_request(context.number, Instant::now());
        to_hyper(response)
    };
    http_server::serve_connection(stream, answered).await;
}

/// Entry of a connection in the table, removed when the connection ends in whichever way.
struct ConnectionGuard {
    connections: Connections,
    number: u64,
}

impl Drop for ConnectionGuard {
    fn drop(&mut self) {
        locked(&self.connections).remove(self.number);
    }
}

/// Returns the address of the client: that of the connection, or, if this is the proxy's, the last one that the proxy
/// has entered. Earlier entries are the client's own and may be invented.
fn client_address(peer: IpAddr, proxy: Option<IpAddr>, headers: &hyper::HeaderMap) -> IpAddr {
    let peer = peer.to_canonical();
    if proxy.map(|proxy| proxy.to_canonical()) != Some(peer) {
        return peer;
    }
    let last = headers.get_all("x-forwarded-for").iter().next_back().and_then(|value| value.to_str().ok());
    let last = last.and_then(|list| list.rsplit(',').next()).unwrap_or_default().trim();
    let address = last.parse::<IpAddr>().or_else(|_| last.parse::<SocketAddr>().map(|with_port| with_port.ip()));
    address.map_or(peer, |address| address.to_canonical())
}

/// Handles one request; the log line about it contains none of the request's content.
async fn handle(hyper_request: HttpRequest, context: &ConnectionContext) -> Response {
    let (at, app) = (context.at, Arc::clone(&context.app));
    let peer = client_address(context.peer.ip(), context.proxy, hyper_request.headers());
    let begun = Instant::now();
    let method = match hyper_request.method().as_str() {
        known @ ("GET" | "HEAD" | "POST") => known.to_string(),
        _ => "other".to_string(),
    };
    let page = route_name(hyper_request.uri().path());
    let response = match read_request(hyper_request, peer, at).await {
        // Handling a request reads from disk; it runs on a blocking thread, so that other requests do not wait.
        Ok(request) => {
            // Only now: a slow form is as idle as no request.
            locked(&context.connections).begin_request(context.number);
            tokio::task::spawn_blocking(move || app.handle(&request))
                .await
                .unwrap_or_else(|_| Response::plain_error(500, "failed: the request failed; see the program's log"))
        }
        Err(refused) => *refused,
    };
    for line in &response.log_lines {
        log(line);
    }
    if let Some(token) = &response.new_login_token {
        // A closed terminal is not an error.
        let _ = super::print_line(super::login_url(at, token));
    }
    let took = begun.elapsed().as_secs_f64() * 1e3;
    log(&format!("{peer} {method} {page} {} {took:.1} ms", response.status));
    response
}

async fn read_request(hyper_request: HttpRequest, peer: IpAddr, at: SocketAddr) -> Result<Request, Box<Response>> {
    let (head, body) = hyper_request.into_parts();
    let refused =
        |status: u16, why: &str| Err(Box::new(Response::plain_error(status, why).with_header("connection", "close")));
    if head.uri.authority().is_some() {
        return refused(400, "wrong-address: this server is not a proxy");
    }
    let body = match tokio::time::timeout(BODY_WAIT, Limited::new(body, BODY_MAX).collect()).await {
        Ok(Ok(body)) => body.to_bytes().to_vec(),
        Ok(Err(_)) => return refused(413, "long-form: the form is too long"),
        Err(_) => return refused(408, "slow-form: the form took too long to arrive"),
    };
    let header = |(name, value): (&hyper::header::HeaderName, &hyper::header::HeaderValue)| {
        (name.as_str().to_string(), String::from_utf8_lossy(value.as_bytes()).into_owned())
    };
    Ok(Request {
        method: head.method.as_str().to_string(),
        path: head.uri.path().to_string(),
        query: head.uri.query().unwrap_or_default().to_string(),
        headers: head.headers.iter().map(header).collect(),
        body,
        peer,
        local_addr: at,
        now: jiff::Timestamp::now(),
    })
}

fn to_hyper(response: Response) -> HttpResponse {
    let mut built = hyper::Response::builder().status(response.status);
    for (name, value) in &response.headers {
        built = built.header(*name, value);
    }
    built.body(Full::new(Bytes::from(response.body))).unwrap_or_else(|_| {
        let mut failed = hyper::Response::new(Full::default());
        *failed.status_mut() = hyper::StatusCode::INTERNAL_SERVER_ERROR;
        failed
    })
}

/// Prints a log line with the time.
fn log(line: &str) {
    eprintln!("{} {}", jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ"), sanitize_display(line, LOG_LINE_MAX));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_forwarded_address_counts_only_from_the_proxy() {
        let proxy: IpAddr = [192, 0, 2, 1].into();
        let check = |peer: [u8; 4], lines: &[&str], expected: &str| {
            let mut headers = hyper::HeaderMap::new();
            for line in lines {
                headers.append("x-forwarded-for", line.parse().unwrap());
            }
            let found = client_address(peer.into(), Some(proxy), &headers);
            assert_eq!(found.to_string(), expected, "{peer:?} {lines:?}");
        };
        check([192, 0, 2, 1], &["198.51.100.7"], "198.51.100.7");
        check([192, 0, 2, 1], &["10.0.0.1, 198.51.100.7"], "198.51.100.7");
        check([192, 0, 2, 1], &["10.0.0.1", "198.51.100.7"], "198.51.100.7");
        check([192, 0, 2, 1], &["198.51.100.7:4711"], "198.51.100.7");
        check([192, 0, 2, 1], &["2001:db8::1"], "2001:db8::1");
        check([192, 0, 2, 1], &[], "192.0.2.1");
        check([192, 0, 2, 1], &["unknown"], "192.0.2.1");
        check([203, 0, 113, 9], &["198.51.100.7"], "203.0.113.9");
        let headers = hyper::HeaderMap::from_iter([(
            hyper::header::HeaderName::from_static("x-forwarded-for"),
            "1.2.3.4".parse().unwrap(),
        )]);
        assert_eq!(client_address(proxy, None, &headers), proxy, "without --behind-proxy the header means nothing");
    }
}
