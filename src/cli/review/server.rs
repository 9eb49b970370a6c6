//! HTTP/1.1 server of the review pages, with limits on connections and times.

use super::connections::{Admission, ConnectionTable};
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::task::AbortHandle;
use typodont_report::sanitize_display;
use typodont_review::{BODY_MAX, Request, Response, ReviewApp, route_name};

/// Time limits for the head of a request and for its body; a browser needs milliseconds.
const HEAD_WAIT: Duration = Duration::from_secs(5);
const BODY_WAIT: Duration = Duration::from_secs(10);

/// Time limit of a connection: a report of 6 MB over a slow line takes a minute.
const CONNECTION_LIFE: Duration = Duration::from_secs(180);

/// Pause after the system failed to accept a connection.
const ACCEPT_BACKOFF: Duration = Duration::from_millis(100);

/// Maximum number of headers of a request, and of bytes of its head; a browser sends about fifteen headers.
const HEADERS_MAX: usize = 64;
const HEAD_MAX: usize = 32 << 10;

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
    listener.set_nonblocking(true)?;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_io().enable_time().max_blocking_threads(8).build()?;
    runtime.block_on(async move {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let connections = Arc::new(Mutex::new(ConnectionTable::new(proxy)));
        // Connections are accepted at any time: one that waits to be accepted could not be told from an idle one.
        loop {
            match listener.accept().await {
                Ok((stream, peer)) => {
                    let Admission::Admitted(number, evicted) = locked(&connections).admit(peer.ip().to_canonical())
                    else {
                        continue;
                    };
                    if let Some(evicted) = evicted {
                        evicted.abort();
                    }
                    let (desk, open) = (Arc::clone(&app), Arc::clone(&connections));
                    let connection = ConnectionContext { number, peer, at, proxy, app: desk, connections: open };
                    let task = tokio::spawn(serve_connection(stream, connection));
                    locked(&connections).set_handle(number, task.abort_handle());
                }
                Err(error) => {
                    log(&format!("a connection could not be accepted: {error}"));
                    tokio::time::sleep(ACCEPT_BACKOFF).await;
                }
            }
        }
    })
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
    let service = service_fn(move |asked: hyper::Request<Incoming>| {
        let context = context.clone();
        async move {
            let response = handle(asked, &context).await;
            locked(&context.connections).end_request(context.number, Instant::now());
            Ok::<_, Infallible>(to_hyper(response))
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_WAIT)
        .max_headers(HEADERS_MAX)
        .max_buf_size(HEAD_MAX)
        .serve_connection(TokioIo::new(stream), service);
    // A connection that the browser closes, or that exceeds its time limit, is not an error of the server.
    let _ = tokio::time::timeout(CONNECTION_LIFE, connection).await;
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
async fn handle(hyper_request: hyper::Request<Incoming>, context: &ConnectionContext) -> Response {
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

async fn read_request(
    hyper_request: hyper::Request<Incoming>,
    peer: IpAddr,
    at: SocketAddr,
) -> Result<Request, Box<Response>> {
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

fn to_hyper(response: Response) -> hyper::Response<Full<Bytes>> {
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
