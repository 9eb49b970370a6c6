//! The socket under the desk: HTTP/1.1, few connections at once, and nobody keeps one waiting.

use crate::report::harmless;
use crate::review::{BODY_MAX, Desk, Request, Response, name_of};
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

/// Connections at once: a browser opens six.
const CONNECTIONS_MAX: usize = 96;

/// For a request's head, and for its body. A browser needs milliseconds.
const HEAD_WAIT: Duration = Duration::from_secs(10);
const BODY_WAIT: Duration = Duration::from_secs(10);

/// For all that goes over a connection: a report of 6 MB over a bad line takes a minute.
const CONNECTION_LIFE: Duration = Duration::from_secs(180);

/// After the system had no connection to give.
const BREATH: Duration = Duration::from_millis(100);

/// Headers of a request, and bytes of its head: a browser sends some fifteen.
const HEADERS_MAX: usize = 64;
const HEAD_MAX: usize = 32 << 10;

/// Letters of a line that is told.
const TOLD_MAX: usize = 300;

/// Answers until the program is ended.
pub fn serve(listener: std::net::TcpListener, desk: Arc<Desk>) -> io::Result<()> {
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
                    let desk = Arc::clone(&desk);
                    tokio::spawn(async move {
                        connection(stream, peer, at, desk).await;
                        drop(place);
                    });
                }
                Err(error) => {
                    tell(&format!("no connection was taken: {error}"));
                    tokio::time::sleep(BREATH).await;
                }
            }
        }
    })
}

async fn connection(stream: TcpStream, peer: SocketAddr, at: SocketAddr, desk: Arc<Desk>) {
    // Of an address like 0.0.0.0 the one at which this question came in.
    let at = stream.local_addr().unwrap_or(at);
    let service = service_fn(move |asked: hyper::Request<Incoming>| {
        let desk = Arc::clone(&desk);
        async move { Ok::<_, Infallible>(carried(exchange(asked, peer, at, desk).await)) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_WAIT)
        .max_headers(HEADERS_MAX)
        .max_buf_size(HEAD_MAX)
        .serve_connection(TokioIo::new(stream), service);
    // What a browser breaks off, or is too slow for, is its own affair.
    let _ = tokio::time::timeout(CONNECTION_LIFE, connection).await;
}

/// One question and its answer, told in a line that holds nothing of what was asked.
async fn exchange(asked: hyper::Request<Incoming>, peer: SocketAddr, at: SocketAddr, desk: Arc<Desk>) -> Response {
    let begun = Instant::now();
    let method = match asked.method().as_str() {
        known @ ("GET" | "HEAD" | "POST") => known.to_string(),
        _ => "other".to_string(),
    };
    let page = name_of(asked.uri().path());
    let response = match read(asked, peer, at).await {
        // The desk looks at disks; nobody else waits for it meanwhile.
        Ok(request) => tokio::task::spawn_blocking(move || desk.answer(&request))
            .await
            .unwrap_or_else(|_| Response::refusal(500, "failed: the program's log says why")),
        Err(refused) => *refused,
    };
    for line in &response.told {
        tell(line);
    }
    if let Some(token) = &response.opens {
        // Whoever closed the terminal's end has heard enough.
        let _ = super::say(super::address(at, token));
    }
    let took = begun.elapsed().as_secs_f64() * 1e3;
    tell(&format!("{} {method} {page} {} {took:.1} ms", peer.ip(), response.status));
    response
}

async fn read(asked: hyper::Request<Incoming>, peer: SocketAddr, at: SocketAddr) -> Result<Request, Box<Response>> {
    let (head, body) = asked.into_parts();
    let refused = |status: u16, why: &str| Err(Box::new(Response::refusal(status, why).with("connection", "close")));
    if head.uri.authority().is_some() {
        return refused(400, "wrong-address: this is no proxy");
    }
    let body = match tokio::time::timeout(BODY_WAIT, Limited::new(body, BODY_MAX).collect()).await {
        Ok(Ok(body)) => body.to_bytes().to_vec(),
        Ok(Err(_)) => return refused(413, "long-form: nobody writes that much"),
        Err(_) => return refused(408, "slow-form: it took too long to arrive"),
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
        at,
        now: jiff::Timestamp::now(),
    })
}

fn carried(response: Response) -> hyper::Response<Full<Bytes>> {
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

/// A line for whoever keeps the program, with its time.
fn tell(line: &str) {
    eprintln!("{} {}", jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ"), harmless(line, TOLD_MAX));
}
