//! A PostgreSQL of the tests' own, on a Unix socket in a temporary folder; and an S3 of PyPI's on loopback.

#![allow(dead_code)]

use super::tools;
use postgres::{Client, NoTls};
use std::fs;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// A cluster with the database `school`, owned by `owner`; it is removed when this value is dropped.
pub struct Cluster {
    bin: PathBuf,
    pub folder: PathBuf,
}

/// Folder of the server's programs, on Debian or in the path; all of them must be in one folder.
fn programs() -> Option<PathBuf> {
    let debian = fs::read_dir("/usr/lib/postgresql").into_iter().flatten().flatten().map(|e| e.path().join("bin"));
    let mut debian: Vec<PathBuf> = debian.collect();
    debian.sort();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut all = debian.into_iter().rev().chain(std::env::split_paths(&path));
    all.find(|folder| ["initdb", "pg_ctl", "pg_dump"].iter().all(|program| folder.join(program).is_file()))
}

/// Starts a program as a user that the server accepts: it refuses to run as root.
fn as_somebody(program: &Path, arguments: &[&str]) -> Command {
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.trim_ascii() == b"0");
    let mut command = match is_root {
        true => {
            let mut command = Command::new("setpriv");
            command.args(["--reuid", "postgres", "--regid", "postgres", "--clear-groups"]).arg(program);
            command
        }
        false => Command::new(program),
    };
    command.args(arguments).current_dir("/").stdin(Stdio::null());
    command
}

fn done(mut command: Command) {
    let output = command.output().unwrap();
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{command:?}: {}{}", said(&output.stdout), said(&output.stderr));
}

impl Cluster {
    /// A new cluster with this school's tables; none where there is no PostgreSQL here.
    pub fn start() -> Option<Cluster> {
        static STARTED: AtomicU32 = AtomicU32::new(0);
        let Some(bin) = programs() else {
            tools::skip("there is no PostgreSQL: a school's records are not tested");
            return None;
        };
        // A socket's path has 107 letters at most.
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("typodont-pg-{}-{number}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        // If the tests run as root, the folder must belong to the server's user.
        let _ = Command::new("chown").arg("postgres").arg(&folder).stderr(Stdio::null()).status();
        let cluster = Cluster { bin, folder };
        let data = cluster.data();
        let initdb = cluster.bin.join("initdb");
        done(as_somebody(
            &initdb,
            &["-D", &data, "-U", "owner", "--auth=trust", "-E", "UTF8", "--locale=C", "--no-sync"],
        ));
        // The text of a failed statement is logged, as by default; durability after a power cut is not tested.
        fs::write(cluster.folder.join("more.conf"), "").unwrap();
        cluster.up();
        let mut client = cluster.client_of("owner", "postgres");
        client.batch_execute("CREATE DATABASE school").unwrap();
        let output = cluster.typodont("owner", &["school", "init"]);
        assert!(output.status.success(), "{}", complained(&output));
        Some(cluster)
    }

    fn data(&self) -> String {
        self.folder.join("data").display().to_string()
    }

    pub fn log(&self) -> PathBuf {
        self.folder.join("log.txt")
    }

    pub fn up(&self) {
        self.up_with("-c listen_addresses=");
    }

    /// Restarts the server on loopback under TLS, with a certificate for `localhost`. Returns the port and the file of
    /// the certificate authority to trust; `None` if openssl is not installed.
    pub fn up_with_tls(&self) -> Option<(u16, PathBuf)> {
        let openssl = |arguments: &str| {
            let made = Command::new("openssl").args(arguments.split(' ')).current_dir(&self.folder).output();
            made.is_ok_and(|output| output.status.success())
        };
        fs::write(self.folder.join("names"), "subjectAltName=DNS:localhost").unwrap();
        let made = openssl("req -x509 -newkey rsa:2048 -nodes -keyout ca.key -out ca.pem -days 2 -subj /CN=school")
            && openssl("req -newkey rsa:2048 -nodes -keyout server.key -out server.csr -subj /CN=localhost")
            && openssl(
                "x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile names -out server.crt",
            );
        if !made {
            tools::skip("there is no openssl: TLS is not spoken");
            return None;
        }
        let key = self.folder.join("server.key");
        let _ = Command::new("chown").arg("postgres").arg(&key).stderr(Stdio::null()).status();
        assert!(Command::new("chmod").arg("600").arg(&key).status().unwrap().success());
        self.down();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let folder = self.folder.display();
        self.up_with(&format!(
            "-c listen_addresses=127.0.0.1 -p {port} -c ssl=on -c ssl_cert_file={folder}/server.crt -c ssl_key_file={folder}/server.key"
        ));
        Some((port, self.folder.join("ca.pem")))
    }

    fn up_with(&self, more: &str) {
        let options = format!("-k {} -c fsync=off -c max_connections=200 {more}", self.folder.display());
        let log = self.log().display().to_string();
        let pg_ctl = self.bin.join("pg_ctl");
        let mut command =
            as_somebody(&pg_ctl, &["-D", &self.data(), "-l", &log, "-w", "-t", "120", "-o", &options, "start"]);
        // Whoever waits for the output of pg_ctl would wait for the server's.
        let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
        assert!(status.success(), "{}", fs::read_to_string(self.log()).unwrap_or_default());
    }

    /// Stops it as a power cut would.
    pub fn down(&self) {
        let mut command = as_somebody(&self.bin.join("pg_ctl"), &["-D", &self.data(), "-m", "immediate", "-w", "stop"]);
        let _ = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    }

    pub fn address(&self, login: &str) -> String {
        format!("host={} user={login} dbname=school", self.folder.display())
    }

    pub fn client(&self, login: &str) -> Client {
        self.client_of(login, "school")
    }

    fn client_of(&self, login: &str, database: &str) -> Client {
        let address = format!("host={} user={login} dbname={database}", self.folder.display());
        Client::connect(&address, NoTls).unwrap()
    }

    /// One number, asked as the owner.
    pub fn count(&self, sql: &str) -> i64 {
        self.client("owner").query_one(sql, &[]).unwrap().get(0)
    }

    /// The program, with this database for a login, from its environment.
    pub fn command(&self, login: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program());
        command.args(arguments).env("TYPODONT_DATABASE", self.address(login)).stdin(Stdio::null());
        command
    }

    pub fn typodont(&self, login: &str, arguments: &[&str]) -> Output {
        self.command(login, arguments).output().unwrap()
    }

    /// Runs a command that must succeed; returns its standard output.
    pub fn ask(&self, login: &str, arguments: &[&str]) -> String {
        let output = self.typodont(login, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", complained(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Everything in the database, as text.
    pub fn dump(&self) -> String {
        let socket = self.folder.display().to_string();
        let output =
            Command::new(self.bin.join("pg_dump")).args(["-h", &socket, "-U", "owner", "school"]).output().unwrap();
        assert!(output.status.success(), "{}", complained(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        self.down();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Whole sessions are scored by an optimised program where there is one.
pub fn program() -> String {
    super::bundle::program().to_string()
}

pub fn complained(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A server that speaks S3, with a bucket `school`.
pub struct Bucket {
    server: Child,
    pub port: u16,
}

impl Bucket {
    /// None where it is not installed.
    pub fn start() -> Option<Bucket> {
        let python = tools::named_by("TYPODONT_MOTO", "a Python with moto")?;
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let server = Command::new(python)
            .args(["-m", "moto.server", "-H", "127.0.0.1", "-p", &port.to_string()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let bucket = Bucket { server, port };
        let begun = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(begun.elapsed() < Duration::from_secs(120), "the S3 server does not come up");
            thread::sleep(Duration::from_millis(50));
        }
        let answer = bucket.ask("PUT", "/school");
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        Some(bucket)
    }

    /// One request without a signature, which moto does not ask for.
    pub fn ask(&self, method: &str, path: &str) -> String {
        use std::io::Read;
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n",
            self.port
        )
        .unwrap();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Sets the environment variables with which a command reaches the store.
    pub fn known_to(&self, command: &mut Command) {
        command
            .env("TYPODONT_STORE", "s3://school/bundles")
            .env("AWS_ENDPOINT", format!("http://127.0.0.1:{}", self.port))
            .env("AWS_ACCESS_KEY_ID", "station")
            .env("AWS_SECRET_ACCESS_KEY", "secret")
            .env("AWS_REGION", "eu-central-1");
    }

    /// Number of objects in the store.
    pub fn objects(&self) -> usize {
        self.ask("GET", "/school?list-type=2&max-keys=1000").matches("<Key>").count()
    }
}

impl Drop for Bucket {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
