//! HTTP/1.1 server of the review pages, with limits on connections and times.

use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use typodont_report::sanitize_display;
use typodont_review::{BODY_MAX, Request, Response, ReviewApp, route_name};

/// Maximum number of simultaneous connections; a browser opens six.
const CONNECTIONS_MAX: usize = 96;

/// Time limits for the head of a request and for its body; a browser needs milliseconds.
const HEAD_WAIT: Duration = Duration::from_secs(10);
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

/// Serves requests until the program is stopped.
///
/// # Errors
/// The system's error if the server cannot be started on this listener.
pub fn serve(listener: std::net::TcpListener, app: Arc<ReviewApp>) -> io::Result<()> {
    let at = listener.local_addr()?;
    listener.set_nonblocking(true)?;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_io().enable_time().max_blocking_threads(8).build()?;
    runtime.block_on(async move {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let room = Arc::new(Semaphore::new(CONNECTIONS_MAX));
        loop {
            let Ok(place) = Arc::clone(&room).acquire_owned().await else { return Ok(()) };
            match listener.accept().await {
                Ok((stream, peer)) => {
                    let desk = Arc::clone(&app);
                    tokio::spawn(async move {
                        serve_connection(stream, peer, at, desk).await;
                        drop(place);
                    });
                }
                Err(error) => {
                    log(&format!("a connection could not be accepted: {error}"));
                    tokio::time::sleep(ACCEPT_BACKOFF).await;
                }
            }
        }
    })
}

async fn serve_connection(stream: TcpStream, peer: SocketAddr, at: SocketAddr, app: Arc<ReviewApp>) {
    // For a listener on an address such as 0.0.0.0: the local address at which this request arrived.
    let at = stream.local_addr().unwrap_or(at);
    let service = service_fn(move |asked: hyper::Request<Incoming>| {
        let desk = Arc::clone(&app);
        async move { Ok::<_, Infallible>(to_hyper(handle(asked, peer, at, desk).await)) }
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

/// Handles one request; the log line about it contains none of the request's content.
async fn handle(
    hyper_request: hyper::Request<Incoming>,
    peer: SocketAddr,
    at: SocketAddr,
    app: Arc<ReviewApp>,
) -> Response {
    let begun = Instant::now();
    let method = match hyper_request.method().as_str() {
        known @ ("GET" | "HEAD" | "POST") => known.to_string(),
        _ => "other".to_string(),
    };
    let page = route_name(hyper_request.uri().path());
    let response = match read_request(hyper_request, peer, at).await {
        // Handling a request reads from disk; it runs on a blocking thread, so that other requests do not wait.
        Ok(request) => tokio::task::spawn_blocking(move || app.handle(&request))
            .await
            .unwrap_or_else(|_| Response::plain_error(500, "failed: the request failed; see the program's log")),
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
    log(&format!("{} {method} {page} {} {took:.1} ms", peer.ip(), response.status));
    response
}

async fn read_request(
    hyper_request: hyper::Request<Incoming>,
    peer: SocketAddr,
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
        peer: peer.ip().to_canonical(),
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
