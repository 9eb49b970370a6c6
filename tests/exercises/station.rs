//! The file of a station at the command line: checked, and its exercises and sessions brought up to date.

use crate::support::bundle::{complained, program, told};
use crate::support::folder::folder;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread;

/// The program with a home of its own.
fn typodont_at(home: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(program());
    command.args(arguments).current_dir(home).env_clear().env("HOME", home).env("PATH", "/usr/bin:/bin");
    command.env("XDG_CONFIG_HOME", home.join("config")).env("XDG_DATA_HOME", home.join("data")).output().unwrap()
}

fn copy_of(home: &Path, file: &str) -> PathBuf {
    home.join("data/typodont/exercises").join(file)
}

#[test]
fn a_station_is_checked_like_an_exercise() {
    let home = folder("station-check");
    fs::write(home.join("station.toml"), "seat = 'lab-2'\ndevise = 'mouse'\nmode = 'kiosque'\n").unwrap();
    let output = typodont_at(&home, &["check", "station.toml"]);
    let text = complained(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("station.toml:2:1: unknown-key: /devise"), "{text}");
    assert!(text.contains("did you mean \"device\"?") && text.contains("2 | devise = 'mouse'"), "{text}");
    assert!(text.contains("station.toml:3:8: unknown-word: /mode"), "{text}");
    let output = typodont_at(&home, &["check", "station.toml", "--format", "json"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found[0]["line"], &found[0]["code"]), (&2.into(), &"unknown-key".into()), "{found}");
    // A session does not begin at a station that is wrong.
    let output = typodont_at(&home, &["--station", "station.toml"]);
    assert!(complained(&output).contains("unknown-key") && output.status.code() == Some(1), "{}", complained(&output));
    fs::write(home.join("station.toml"), "seat = 'lab-2'\n").unwrap();
    let output = typodont_at(&home, &["check", "station.toml"]);
    assert!(output.status.success() && told(&output).contains("no problems found"), "{}", complained(&output));
}

#[test]
fn the_users_station_is_found_and_sessions_go_where_it_says() {
    // Aim: nobody names the file. Method: the user's place; a scripted session without --out; then the school's folder.
    let home = folder("station-found");
    let (config, school) = (home.join("config/typodont"), home.join("school"));
    fs::create_dir_all(&config).unwrap();
    fs::create_dir(&school).unwrap();
    let sessions = home.join("kept");
    let text = format!("seat = 'lab-2'\nsessions = '{}'\nsend_to = '{}'\n", sessions.display(), school.display());
    fs::write(config.join("station.toml"), text).unwrap();
    let exercise = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/2-decay.json");
    let output = typodont_at(&home, &["run", exercise.to_str().unwrap(), "--headless", "--seed", "1"]);
    let bundle = PathBuf::from(told(&output).lines().last().unwrap_or_default().to_string());
    assert!(bundle.starts_with(&sessions) && bundle.is_dir(), "{}: {}", bundle.display(), complained(&output));
    let output = typodont_at(&home, &["station", "sync"]);
    assert!(output.status.success() && told(&output).contains("sessions: 1 sent"), "{}", complained(&output));
    let sent = school.join("lab-2").join(bundle.file_name().unwrap());
    let output = typodont_at(&home, &["verify", sent.to_str().unwrap()]);
    assert!(output.status.success(), "a sent session holds: {}", complained(&output));
}

#[test]
fn exercises_of_a_folder_are_brought_up_to_date() {
    let home = folder("station-folder");
    let course = home.join("course");
    fs::create_dir(&course).unwrap();
    fs::write(course.join("1.json"), "{}").unwrap();
    fs::write(home.join("s.toml"), format!("exercises = '{}'\n", course.display())).unwrap();
    let sync = || typodont_at(&home, &["station", "sync", "--station", "s.toml"]);
    assert!(told(&sync()).contains("exercises: 1 files added, 0 changed, 0 removed"));
    fs::write(course.join("1.json"), "{ }").unwrap();
    assert!(told(&sync()).contains("0 files added, 1 changed"));
    assert_eq!(fs::read_to_string(copy_of(&home, "1.json")).unwrap(), "{ }");
    // The drive is not connected: exit status 1, and the copy stays.
    fs::remove_dir_all(&course).unwrap();
    let output = sync();
    assert!(output.status.code() == Some(1) && complained(&output).contains("unreadable-folder"));
    assert!(copy_of(&home, "1.json").is_file());
}

/// A web server that answers with files by their paths until it is asked for `/end`; returns its address.
fn serve(files: Vec<(&'static str, String)>) -> (String, thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://127.0.0.1:{}", listener.local_addr().unwrap().port());
    let server = thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut reader = BufReader::new(stream.try_clone().unwrap());
            let mut request = String::new();
            reader.read_line(&mut request).unwrap();
            let mut line = String::new();
            while reader.read_line(&mut line).unwrap() > 2 {
                line.clear();
            }
            let path = request.split(' ').nth(1).unwrap_or_default().to_string();
            if path == "/end" {
                return;
            }
            let found = files.iter().find(|(name, _)| *name == path);
            let (status, body) = found.map_or(("404 Not Found", ""), |(_, body)| ("200 OK", body));
            let head = format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
            stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body.as_bytes())).unwrap();
        }
    });
    (address, server)
}

fn end(address: &str, server: thread::JoinHandle<()>) {
    let mut stream = std::net::TcpStream::connect(address.strip_prefix("http://").unwrap()).unwrap();
    stream.write_all(b"GET /end HTTP/1.1\r\n\r\n").unwrap();
    server.join().unwrap();
}

#[test]
fn exercises_of_an_address_are_fetched_by_their_digests() {
    // Aim: a station fetches what the list announces, and nothing else. Method: a real server; a file whose digest is
    // another leaves the copy as it was.
    const EMPTY_OBJECT: &str = "44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a";
    let home = folder("station-address");
    let sync = |address: &str| {
        fs::write(home.join("s.toml"), format!("exercises = '{address}/course/'\n")).unwrap();
        typodont_at(&home, &["station", "sync", "--station", "s.toml"])
    };
    let list = format!("{EMPTY_OBJECT}  a tooth.json\n{EMPTY_OBJECT}  sub/b.json\n");
    let announced = |body: &str| {
        vec![
            ("/course/SHA256SUMS", list.clone()),
            ("/course/a%20tooth.json", "{}".to_string()),
            ("/course/sub/b.json", body.to_string()),
        ]
    };
    let (address, server) = serve(announced("{}"));
    let output = sync(&address);
    assert!(told(&output).contains("2 files added"), "{}", complained(&output));
    assert!(copy_of(&home, "a tooth.json").is_file() && copy_of(&home, "sub/b.json").is_file());
    end(&address, server);
    fs::write(copy_of(&home, "sub/b.json"), "changed here").unwrap();
    let (address, server) = serve(announced("{ }"));
    let output = sync(&address);
    assert!(complained(&output).contains("sub/b.json: wrong-digest"), "{}", complained(&output));
    assert_eq!(fs::read_to_string(copy_of(&home, "sub/b.json")).unwrap(), "changed here");
    end(&address, server);
    let output = sync(&address);
    assert!(complained(&output).contains("unreachable") && output.status.code() == Some(1), "{}", complained(&output));
}
