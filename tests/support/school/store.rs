//! Record stores: one of our own that behaves badly on purpose, and Ralph.

use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// A store that keeps to ids as xAPI demands, but hangs up on every third sender after it has written everything down, and is busy
/// for every fifth. A batch of which it has a part already is a conflict to it, and only single statements are compared.
pub struct Store {
    port: u16,
    state: Arc<Mutex<State>>,
}

#[derive(Default)]
struct State {
    kept: Vec<Value>,
    requests: u32,
    hung_up: u32,
}

impl Store {
    pub fn start() -> Store {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (port, state) = (listener.local_addr().unwrap().port(), Arc::new(Mutex::new(State::default())));
        let shared = Arc::clone(&state);
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let _ = serve(stream, &shared);
            }
        });
        Store { port, state }
    }

    pub fn endpoint(&self) -> String {
        format!("http://127.0.0.1:{}/xapi/", self.port)
    }

    /// Ids of what it wrote down, in the order in which it did.
    pub fn kept(&self) -> Vec<String> {
        self.state.lock().unwrap().kept.iter().map(|s| s["id"].as_str().unwrap().to_string()).collect()
    }

    pub fn hung_up(&self) -> u32 {
        self.state.lock().unwrap().hung_up
    }
}

/// Answers one request and closes.
fn serve(stream: TcpStream, state: &Mutex<State>) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let mut head = Vec::new();
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line)? <= 2 {
            break;
        }
        head.push(line.trim().to_string());
    }
    let header = |name: &str| {
        let found = head.iter().find_map(|l| l.split_once(':').filter(|(n, _)| n.eq_ignore_ascii_case(name)));
        found.map_or(String::new(), |(_, value)| value.trim().to_string())
    };
    let mut body = vec![0; header("content-length").parse().unwrap_or(0)];
    reader.read_exact(&mut body)?;
    let mut state = state.lock().unwrap();
    state.requests += 1;
    let mut stream = stream;
    let mut reply =
        |status: &str| write!(stream, "HTTP/1.1 {status}\r\nContent-Length: 2\r\nConnection: close\r\n\r\n[]");
    // base64 of station:secret.
    if header("authorization") != "Basic c3RhdGlvbjpzZWNyZXQ=" {
        return reply("401 Unauthorized");
    }
    if head[0].starts_with("GET") {
        let found = state.kept.iter().any(|s| head[0].contains(s["id"].as_str().unwrap()));
        return reply(if found { "200 OK" } else { "404 Not Found" });
    }
    if state.requests.is_multiple_of(5) {
        return reply("503 Service Unavailable");
    }
    let sent: Vec<Value> = serde_json::from_slice(&body).unwrap();
    let new: Vec<Value> = sent.iter().filter(|s| !state.kept.iter().any(|k| k["id"] == s["id"])).cloned().collect();
    if new.len() < sent.len() {
        let same = sent.iter().all(|s| state.kept.contains(s));
        return reply(if sent.len() == 1 && same { "204 No Content" } else { "409 Conflict" });
    }
    state.kept.extend(new);
    if state.requests.is_multiple_of(3) {
        state.hung_up += 1;
        return stream.shutdown(Shutdown::Both);
    }
    reply("200 OK")
}

/// A port that nobody listens at, a moment ago.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Ralph, a learning record store in Python, on loopback.
pub struct Ralph {
    pub python: PathBuf,
    pub folder: PathBuf,
    pub port: u16,
}

impl Ralph {
    /// Starts it, and waits until it answers.
    pub fn start(&self) -> Child {
        fs::create_dir_all(&self.folder).unwrap();
        let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/python/record_store.py");
        let log = fs::File::create(self.folder.join("log.txt")).unwrap();
        let mut child = Command::new(&self.python)
            .arg(script)
            .arg(&self.folder)
            .arg(self.port.to_string())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .unwrap();
        let begun = Instant::now();
        while TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            let ended = child.try_wait().unwrap();
            let log = || fs::read_to_string(self.folder.join("log.txt")).unwrap_or_default();
            assert!(ended.is_none() && begun.elapsed() < Duration::from_secs(120), "Ralph does not come up: {}", log());
            thread::sleep(Duration::from_millis(50));
        }
        child
    }

    /// Ids of everything in its files.
    pub fn kept(&self) -> Vec<String> {
        let files = fs::read_dir(self.folder.join("statements")).unwrap().map(|e| e.unwrap().path());
        let lines: Vec<String> = files
            .map(|f| fs::read_to_string(f).unwrap())
            .flat_map(|t| t.lines().map(String::from).collect::<Vec<_>>())
            .collect();
        lines.iter().map(|l| serde_json::from_str::<Value>(l).unwrap()["id"].as_str().unwrap().to_string()).collect()
    }
}
