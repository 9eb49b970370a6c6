//! Counters for Prometheus, on the loopback address: text exposition format 0.0.4.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;
use typodont_school::jobs::JobCounts;

/// Time limit of a request with its response; a slower client is disconnected.
const CLIENT_TIMEOUT: Duration = Duration::from_secs(2);

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
        text += "# HELP typodont_jobs Sessions in the queue of this scorer version at the last query.\n# TYPE \
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
        for stream in listener.incoming().flatten() {
            // A client that closes the connection early will ask again.
            let _ = respond(stream, &counters);
        }
    });
    Ok(at)
}

fn respond(mut stream: TcpStream, counters: &Counters) -> io::Result<()> {
    stream.set_read_timeout(Some(CLIENT_TIMEOUT))?;
    stream.set_write_timeout(Some(CLIENT_TIMEOUT))?;
    let mut head = [0; 2048];
    let mut length = 0;
    while length < head.len() && !head[..length].windows(4).any(|w| w == b"\r\n\r\n") {
        match stream.read(&mut head[length..])? {
            0 => break,
            more => length += more,
        }
    }
    let (status, body) = match head.starts_with(b"GET /metrics ") {
        true => ("200 OK", counters.text()),
        false => ("404 Not Found", "counters are at /metrics\n".to_string()),
    };
    let length = body.len();
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    )
}
