//! Counters for Prometheus, on the loopback address: text exposition format 0.0.4.

use crate::cli::http_server::{self, HttpRequest, HttpResponse};
use hyper::body::Bytes;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;
use typodont_school::jobs::JobCounts;

#[derive(Debug, Default)]
pub struct Counters {
    pub scored: AtomicU64,
    pub failed: AtomicU64,
    pub set_aside: AtomicU64,
    milliseconds: AtomicU64,
    queue: [AtomicI64; 4],
}

impl Counters {
    pub fn add_seconds(&self, time: Duration) {
        self.milliseconds.fetch_add(time.as_millis() as u64, Ordering::Relaxed);
    }

    pub fn set_queue(&self, tally: JobCounts) {
        let now = [tally.waiting, tally.leased, tally.done, tally.set_aside];
        for (gauge, value) in self.queue.iter().zip(now) {
            gauge.store(value, Ordering::Relaxed);
        }
    }

    /// The counters in the text format that Prometheus reads.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut counter = |name: &str, help: &str, value: f64| {
            text +=
                &format!("# HELP typodont_{name} {help}\n# TYPE typodont_{name} counter\ntypodont_{name} {value}\n");
        };
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed) as f64;
        counter("sessions_scored_total", "Sessions scored by this worker.", count(&self.scored));
        counter("attempts_failed_total", "Failed scoring attempts of this worker.", count(&self.failed));
        counter("sessions_set_aside_total", "Sessions set aside by this worker.", count(&self.set_aside));
        counter(
            "scoring_seconds_total",
            "Time spent downloading and scoring sessions.",
            count(&self.milliseconds) / 1000.0,
        );
        text += "# HELP typodont_jobs Sessions in the queue of this scoring version at the last query.\n# TYPE \
        typodont_jobs gauge\n";
        for (state, gauge) in ["waiting", "leased", "done", "set_aside"].iter().zip(&self.queue) {
            text += &format!("typodont_jobs{{state=\"{state}\"}} {}\n", gauge.load(Ordering::Relaxed));
        }
        text
    }
}

/// Serves the counters on a thread of its own until the program ends; returns the address.
///
/// # Errors
/// The system's error if the port cannot be opened.
pub fn serve(port: u16, counters: Arc<Counters>) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let at = listener.local_addr()?;
    thread::spawn(move || {
        let accepted = move |stream, _| {
            let counters = Arc::clone(&counters);
            tokio::spawn(async move {
                http_server::serve_connection(stream, async |request| respond(&request, &counters)).await;
            });
        };
        // Without its counters a worker works as well.
        if let Err(error) = http_server::listen(listener, accepted, |_| {}) {
            eprintln!("the counters are not served: {error}");
        }
    });
    Ok(at)
}

fn respond(request: &HttpRequest, counters: &Counters) -> HttpResponse {
    let is_read = matches!(*request.method(), hyper::Method::GET | hyper::Method::HEAD);
    let (status, body) = match request.uri().path() {
        "/metrics" if is_read => (hyper::StatusCode::OK, counters.text()),
        _ => (hyper::StatusCode::NOT_FOUND, "counters are at /metrics\n".to_string()),
    };
    let mut response = HttpResponse::new(Bytes::from(body).into());
    *response.status_mut() = status;
    let plain = hyper::header::HeaderValue::from_static("text/plain; version=0.0.4");
    response.headers_mut().insert(hyper::header::CONTENT_TYPE, plain);
    response.headers_mut().insert(hyper::header::CONNECTION, hyper::header::HeaderValue::from_static("close"));
    response
}
