//! HTTP/1.1 server of the program: accepts connections, and limits the times and sizes of each.
//!
//! Takes a listener and a handler. Gives every request to the handler. Never decides what is answered, or who may
//! connect.

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpStream;

/// Time limit for the head of a request; a browser needs milliseconds.
const HEAD_WAIT: Duration = Duration::from_secs(5);

/// Time limit of a connection: a report of 6 MB over a slow line takes a minute.
const CONNECTION_LIFE: Duration = Duration::from_secs(180);

/// Pause after the system failed to accept a connection.
const ACCEPT_BACKOFF: Duration = Duration::from_millis(100);

/// Maximum number of headers of a request, and of bytes of its head; a browser sends about fifteen headers.
const HEADERS_MAX: usize = 64;
const HEAD_MAX: usize = 32 << 10;

pub type HttpRequest = hyper::Request<Incoming>;
pub type HttpResponse = hyper::Response<Full<Bytes>>;

/// Accepts connections until the program is stopped, and gives each to `accepted` on a runtime of this thread.
/// Connections are accepted at any time: one that waits to be accepted could not be told from an idle one.
///
/// # Errors
/// The system's error if the server cannot be started on this listener.
pub fn listen(
    listener: std::net::TcpListener,
    mut accepted: impl FnMut(TcpStream, SocketAddr),
    log: impl Fn(&str),
) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_io().enable_time().max_blocking_threads(8).build()?;
    runtime.block_on(async move {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        loop {
            match listener.accept().await {
                Ok((stream, peer)) => accepted(stream, peer),
                Err(error) => {
                    log(&format!("a connection could not be accepted: {error}"));
                    tokio::time::sleep(ACCEPT_BACKOFF).await;
                }
            }
        }
    })
}

/// Answers the requests of a connection, one after another, until the client ends it or its time is over. Neither is an
/// error of the server.
pub async fn serve_connection<F>(stream: TcpStream, handle: impl Fn(HttpRequest) -> F)
where
    F: Future<Output = HttpResponse>,
{
    let service = service_fn(|request| {
        let response = handle(request);
        async { Ok::<_, Infallible>(response.await) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_WAIT)
        .max_headers(HEADERS_MAX)
        .max_buf_size(HEAD_MAX)
        .serve_connection(TokioIo::new(stream), service);
    let _ = tokio::time::timeout(CONNECTION_LIFE, connection).await;
}
