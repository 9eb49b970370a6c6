//! The review server for tests: the program on a port of its own, and a minimal HTTP client.

#![allow(dead_code)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A running review server. It is stopped when this value is dropped.
pub struct Desk {
    program: Child,
    pub at: SocketAddr,
    /// Address printed for the browser.
    pub address: String,
    /// Lines of standard error, and further ones of standard output.
    told: Arc<Mutex<Vec<String>>>,
}

pub fn command(folder: &Path, more: &[&str]) -> Command {
    let program = super::bundle::program();
    let mut command = Command::new(program);
    command.arg("review").arg(folder).args(more).current_dir(env!("CARGO_MANIFEST_DIR"));
    command.env_remove("TYPODONT_REVIEW_PASSWORD").stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

impl Desk {
    pub fn open(folder: &Path, more: &[&str]) -> Desk {
        Desk::start(command(folder, more))
    }

    pub fn start(mut command: Command) -> Desk {
        let mut program = command.spawn().unwrap();
        let told = Arc::new(Mutex::new(Vec::new()));
        let mut lines = BufReader::new(program.stdout.take().unwrap()).lines();
        let errors = BufReader::new(program.stderr.take().unwrap()).lines();
        let keep = Arc::clone(&told);
        std::thread::spawn(move || errors.map_while(Result::ok).for_each(|line| keep.lock().unwrap().push(line)));
        let Some(Ok(address)) = lines.next() else {
            std::thread::sleep(Duration::from_millis(200));
            panic!("no address: {}", told.lock().unwrap().join("\n"))
        };
        let keep = Arc::clone(&told);
        std::thread::spawn(move || lines.map_while(Result::ok).for_each(|line| keep.lock().unwrap().push(line)));
        let authority = address.strip_prefix("http://").unwrap().split('/').next().unwrap();
        Desk { program, at: authority.parse().unwrap(), address, told }
    }

    /// Path and query of the login address.
    pub fn way_in(&self) -> String {
        self.address.split_once(&self.at.to_string()).unwrap().1.to_string()
    }

    /// Waits for a printed line that contains this text.
    pub fn told(&self, what: &str) -> String {
        for _ in 0..200 {
            if let Some(line) = self.told.lock().unwrap().iter().find(|line| line.contains(what)) {
                return line.clone();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("nobody told \"{what}\": {}", self.all_told())
    }

    pub fn all_told(&self) -> String {
        self.told.lock().unwrap().join("\n")
    }

    pub fn browser(&self) -> Browser {
        let mut browser = Browser { at: self.at, cookie: String::new() };
        let answer = browser.get(&self.way_in());
        assert_eq!(answer.status, 200, "{}", answer.text());
        browser.take_cookie(&answer);
        browser
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

pub struct Answer {
    pub status: u16,
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(own, _)| own == name).map_or("", |(_, value)| value)
    }
}

/// Sends a request and reads the response until the server closes the connection; status 0 if there is no response.
pub fn ask(at: SocketAddr, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Answer {
    let mut text = format!("{method} {path} HTTP/1.1\r\nconnection: close\r\n");
    for (name, value) in headers {
        text += &format!("{name}: {value}\r\n");
    }
    if !body.is_empty() {
        text += &format!("content-length: {}\r\n", body.len());
    }
    sent(at, (text + "\r\n" + body).as_bytes())
}

pub fn sent(at: SocketAddr, bytes: &[u8]) -> Answer {
    let mut stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    // Whoever refuses a long body may close before it is all there.
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let _ = stream.shutdown(Shutdown::Both);
    let Some(end) = answer.windows(4).position(|w| w == b"\r\n\r\n") else {
        return Answer { status: 0, headers: Vec::new(), body: answer };
    };
    let head = String::from_utf8_lossy(&answer[..end]).into_owned();
    let mut lines = head.lines();
    let status = lines.next().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
    let split = |line: &str| line.split_once(": ").map(|(n, v)| (n.to_ascii_lowercase(), v.to_string())).unwrap();
    Answer { status, headers: lines.map(split).collect(), body: answer[end + 4..].to_vec() }
}

/// Keeps its cookie, says its origin with a form, and finds a form's own value in the page.
pub struct Browser {
    pub at: SocketAddr,
    pub cookie: String,
}

impl Browser {
    pub fn get(&self, path: &str) -> Answer {
        ask(self.at, "GET", path, &[("host", self.at.to_string().as_str()), ("cookie", self.cookie.as_str())], "")
    }

    pub fn take_cookie(&mut self, answer: &Answer) {
        self.cookie = answer.header("set-cookie").split(';').next().unwrap().to_string();
        assert!(!self.cookie.is_empty());
    }

    /// Posts as a page of ours does.
    pub fn post(&self, path: &str, pairs: &[(&str, &str)]) -> Answer {
        let (host, origin) = (self.at.to_string(), format!("http://{}", self.at));
        let headers = [
            ("host", host.as_str()),
            ("origin", origin.as_str()),
            ("cookie", self.cookie.as_str()),
            ("content-type", "application/x-www-form-urlencoded"),
        ];
        ask(self.at, "POST", path, &headers, &encoded(pairs))
    }

    /// The value that our own forms show.
    pub fn form_value(&self) -> String {
        after(&self.get("/").text(), "name=\"form\" value=\"", "\"").to_string()
    }

    /// Overrides an item, or `grade`, having seen the session's page; gives the answer.
    pub fn judge(&self, id: &str, item: &str, more: &[(&str, &str)]) -> Answer {
        let page = self.get(&format!("/session/{id}")).text();
        let form = after(&page, "name=\"form\" value=\"", "\"");
        let seen = after(
            &page,
            &format!("name=\"item\" value=\"{item}\"><input type=\"hidden\" name=\"seen\" value=\""),
            "\"",
        );
        let pairs = [&[("form", form), ("item", item), ("seen", seen)][..], more].concat();
        self.post(&format!("/session/{id}/override"), &pairs)
    }

    /// Ids of the sessions on a page of the list, in their order.
    pub fn ids(&self, path: &str) -> Vec<String> {
        let page = self.get(path).text();
        page.split("name=\"session\" value=\"").skip(1).map(|part| part[..36].to_string()).collect()
    }
}

pub fn encoded(pairs: &[(&str, &str)]) -> String {
    let mut out = url::form_urlencoded::Serializer::new(String::new());
    out.extend_pairs(pairs).finish()
}

/// Part of a text between two others.
pub fn after<'a>(text: &'a str, before: &str, until: &str) -> &'a str {
    let (_, rest) = text.split_once(before).unwrap_or_else(|| panic!("no {before} in {text}"));
    rest.split_once(until).unwrap().0
}
