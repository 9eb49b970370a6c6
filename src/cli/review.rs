//! `typodont review`: an examiner's desk in a browser.

mod server;

use super::school::{self, At, Named};
use super::{Failure, say, templates};
use crate::report::harmless;
use crate::review::{Desk, Lock, Look, Options, PASSWORD_MIN};
use clap::Args;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

#[derive(Args)]
pub struct Arguments {
    /// Folder that holds bundles, at any depth; what examiners judge is written beside them. With --database, --store or --class the
    /// bundles that you may read are fetched into it first
    folder: PathBuf,
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    store: Named,
    /// Of a database: sessions of this class only
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    /// Port of the page; without it one that is free
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Address to listen on. Beyond this machine it takes a password
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
    /// A name by which this machine or its HTTPS proxy is reached, beside its address; may stand several times
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// A file with the examiners' password; without it the password is taken from TYPODONT_REVIEW_PASSWORD, if it is there
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
    /// Show participants as codes that nobody can guess
    #[arg(long)]
    anonymous: bool,
}

/// Between two exchanges of judgements with a database.
const EXCHANGE_EVERY: Duration = Duration::from_secs(5);

const PASSWORD: &str = "TYPODONT_REVIEW_PASSWORD";

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { folder, port, listen, name, anonymous, .. } = arguments;
    if !folder.is_dir() {
        return Err(Failure::wrong(format!("{}: missing-folder: there is no such folder", folder.display())));
    }
    let Arguments { at, store, class, .. } = arguments;
    if at.database.is_some() || store.store.is_some() || class.is_some() {
        exchange(arguments)?;
    }
    let password = password(arguments)?;
    if password.is_none() && !listen.is_loopback() {
        let what = "no-password: beyond this machine the page takes a password";
        return Err(Failure::misuse(format!(
            "{what}: give --password-file, or the password in the environment's {PASSWORD}"
        )));
    }
    let lock = password.map_or(Lock::Address, Lock::Password);
    let has_password = matches!(lock, Lock::Password(_));
    let look = Look::in_folder(Path::new("reports/templates"), &templates()?).map_err(Failure::Wrong)?;
    let options = Options { folder: folder.clone(), lock, names: name.clone(), anonymous: *anonymous, look };
    let (desk, token) = Desk::set_up(options).map_err(Failure::Wrong)?;
    let (sessions, left_out, troubles) = desk.look_over().map_err(Failure::Wrong)?;
    let listener = TcpListener::bind((*listen, *port))
        .map_err(|e| Failure::wrong(format!("{}: no-address: {e}", SocketAddr::new(*listen, *port))))?;
    let at = listener.local_addr().map_err(|e| Failure::wrong(format!("no-address: {e}")))?;
    eprintln!("{sessions} sessions, {left_out} files left out");
    for trouble in troubles {
        eprintln!("{}", harmless(&trouble, 300));
    }
    if !listen.is_loopback() {
        eprintln!(
            "plain-http: passwords and grades can be read on the way; put an HTTPS proxy or an SSH tunnel before it"
        );
    }
    if listen.is_unspecified() {
        eprintln!("{listen} stands for every address of this machine: open the page under one of them");
    }
    if has_password {
        say(format!("http://{at}/"))?;
    } else {
        say(address(at, &token))?;
    }
    server::serve(listener, Arc::new(desk)).map_err(|e| Failure::wrong(format!("{at}: the server failed: {e}")))
}

/// Fetches bundles and judgements, and from then on carries judgements to and fro.
fn exchange(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { folder, at, store, class, .. } = arguments;
    let (fetched, failed) = school::fetch::bundles(at, store, class.as_deref(), folder)?;
    eprintln!("{fetched} bundles fetched, {failed} failed");
    let mut line = at.line()?;
    school::fetch::exchange(&mut line, folder)?;
    let folder = folder.clone();
    std::thread::spawn(move || {
        let mut before = String::new();
        loop {
            std::thread::sleep(EXCHANGE_EVERY);
            // What is judged while the database is away is entered when it is back; it is said once.
            let now = school::fetch::exchange(&mut line, &folder).err().map_or_else(String::new, |e| e.lines());
            if !now.is_empty() && now != before {
                eprintln!("{}", harmless(&now, 300));
            }
            before = now;
        }
    });
    Ok(())
}

/// What opens the door once.
fn address(at: SocketAddr, token: &str) -> String {
    format!("http://{at}/enter?token={token}")
}

/// The password, where one is given; it never stands in the command line, which every user of the machine can read.
fn password(arguments: &Arguments) -> Result<Option<String>, Failure> {
    let given = match &arguments.password_file {
        Some(path) => Some(crate::content::read_text(path)?.text.trim_end_matches(['\r', '\n']).to_string()),
        None => match std::env::var(PASSWORD) {
            Ok(password) => Some(password),
            Err(std::env::VarError::NotPresent) => None,
            Err(_) => return Err(Failure::misuse(format!("wrong-password: {PASSWORD} is not text"))),
        },
    };
    match given {
        Some(password) if password.chars().count() < PASSWORD_MIN => {
            Err(Failure::misuse(format!("weak-password: it takes {PASSWORD_MIN} letters or more")))
        }
        given => Ok(given),
    }
}
