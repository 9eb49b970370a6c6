//! `typodont review`: serves the examiners' review pages to a browser.

mod connections;
mod server;

#[cfg(not(feature = "school"))]
use super::folder_source::SchoolArguments;
#[cfg(feature = "school")]
use super::school::{self, DatabaseArguments, StoreArguments};
use super::{CliError, load_templates, print_line, verification};
use clap::Args;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use typodont_report::sanitize_display;
use typodont_review::{AuthMode, PASSWORD_MIN, PageRenderer, ReviewApp, ReviewOptions, SCALE_MAX, SCALE_MIN};

#[derive(Args)]
pub struct Arguments {
    /// Folder that contains bundles, at any depth; examiners' overrides are written beside them. With --database, --store or
    /// --class, the bundles that you may read are downloaded into it first
    folder: PathBuf,
    #[cfg(feature = "school")]
    #[command(flatten)]
    at: DatabaseArguments,
    #[cfg(feature = "school")]
    #[command(flatten)]
    store: StoreArguments,
    /// With --database: only sessions of this class
    #[cfg(feature = "school")]
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    #[cfg(not(feature = "school"))]
    #[command(flatten)]
    school: SchoolArguments,
    /// Port of the page; 0 selects a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Address to listen on; any other than a loopback address requires a password
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
    /// Host name of this computer or of its HTTPS proxy, in addition to its address; may be given several times
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Address of the HTTPS proxy in front of this page: its X-Forwarded-For header then tells who is asking, so that wrong
    /// passwords are counted for each client and not for the proxy; the header is ignored from any other address
    #[arg(long, value_name = "ADDRESS")]
    behind_proxy: Option<IpAddr>,
    /// File with the examiners' password; by default the password is taken from TYPODONT_REVIEW_PASSWORD, if that is set
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
    /// Replace participant codes by random codes
    #[arg(long)]
    anonymous: bool,
    /// Hide marks and other examiners' judgements of a session until the examiner has rated it; includes --anonymous
    #[arg(long)]
    blind: bool,
    /// Highest value of the rating scale: 1 is a fail, 2 borderline, 3 a pass, and higher values are better
    #[arg(long, value_name = "N", default_value_t = 5,
          value_parser = clap::value_parser!(u8).range(i64::from(SCALE_MIN)..=i64::from(SCALE_MAX)))]
    scale: u8,
}

/// Interval between two exchanges of overrides with a database.
#[cfg(feature = "school")]
const EXCHANGE_EVERY: Duration = Duration::from_secs(5);

/// Interval at which the folder is searched for bundles that are new or changed.
const VERIFY_EVERY: Duration = Duration::from_secs(2);

const PASSWORD: &str = "TYPODONT_REVIEW_PASSWORD";

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { folder, port, listen, name, anonymous, blind, scale, .. } = arguments;
    if !folder.is_dir() {
        return Err(CliError::wrong(format!("{}: missing-folder: the folder does not exist", folder.display())));
    }
    #[cfg(not(feature = "school"))]
    arguments.school.require_absent()?;
    #[cfg(feature = "school")]
    if arguments.at.database.is_some() || arguments.store.store.is_some() || arguments.class.is_some() {
        start_override_exchange(arguments)?;
    }
    let password = read_password(arguments)?;
    if password.is_none() && !listen.is_loopback() {
        let what = "no-password: a page that other computers can reach requires a password";
        return Err(CliError::misuse(format!(
            "{what}: give --password-file, or set the environment variable {PASSWORD}"
        )));
    }
    let auth_mode = password.map_or(AuthMode::OneTimeLink, AuthMode::Password);
    let has_password = matches!(auth_mode, AuthMode::Password(_));
    let renderer =
        PageRenderer::in_folder(Path::new("reports/templates"), &load_templates()?).map_err(CliError::Wrong)?;
    let options = ReviewOptions {
        folder: folder.clone(),
        auth_mode,
        host_names: name.clone(),
        anonymous: *anonymous,
        blind: *blind,
        scale: *scale,
        renderer,
    };
    let (app, token) = ReviewApp::new(options).map_err(CliError::Wrong)?;
    let (sessions, left_out, issues) = app.startup_summary().map_err(CliError::Wrong)?;
    let listener = TcpListener::bind((*listen, *port))
        .map_err(|e| CliError::wrong(format!("{}: no-address: {e}", SocketAddr::new(*listen, *port))))?;
    let at = listener.local_addr().map_err(|e| CliError::wrong(format!("no-address: {e}")))?;
    eprintln!("{sessions} sessions, {left_out} files skipped");
    for trouble in issues {
        eprintln!("{}", sanitize_display(&trouble, 300));
    }
    if !listen.is_loopback() {
        eprintln!(
            "plain-http: passwords and grades are transmitted without encryption; use an HTTPS proxy or an SSH tunnel"
        );
    }
    if listen.is_unspecified() {
        eprintln!("{listen} means every address of this computer; open the page at one of them");
    }
    if has_password {
        print_line(format!("http://{at}/"))?;
    } else {
        print_line(login_url(at, &token))?;
    }
    let app = Arc::new(app);
    start_verification(&app)?;
    server::serve(listener, app, arguments.behind_proxy)
        .map_err(|e| CliError::wrong(format!("{at}: the server stopped: {e}")))
}

/// Downloads bundles, and exchanges overrides and ratings, at once and then periodically.
#[cfg(feature = "school")]
fn start_override_exchange(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { folder, at, store, class, .. } = arguments;
    let (fetched, failed) = school::fetch::fetch_bundles(at, store, class.as_deref(), folder)?;
    eprintln!("{fetched} bundles downloaded, {failed} failed");
    let mut connection = at.connection()?;
    school::fetch::exchange_overrides(&mut connection, folder)?;
    // Marking goes on where the owner of the records has not prepared them for ratings yet.
    school::fetch::exchange_ratings(&mut connection, folder).err().iter().for_each(CliError::report);
    let folder = folder.clone();
    std::thread::spawn(move || {
        let mut before = String::new();
        loop {
            std::thread::sleep(EXCHANGE_EVERY);
            // Lines written while the database is unavailable are uploaded later; the error is printed only once.
            let overrides = school::fetch::exchange_overrides(&mut connection, &folder);
            let now = overrides
                .and_then(|_| school::fetch::exchange_ratings(&mut connection, &folder))
                .err()
                .map_or_else(String::new, |e| e.message());
            if !now.is_empty() && now != before {
                eprintln!("{}", sanitize_display(&now, 300));
            }
            before = now;
        }
    });
    Ok(())
}

/// Replays the recordings of the listed sessions in the background, on all processors.
fn start_verification(app: &Arc<ReviewApp>) -> Result<(), CliError> {
    let verifier = Arc::new(verification::verifier()?);
    for number in 0..std::thread::available_parallelism().map_or(1, NonZero::get) {
        let (app, verifier) = (Arc::clone(app), Arc::clone(&verifier));
        std::thread::spawn(move || {
            loop {
                if !app.verify_next(&verifier) {
                    if number == 0 {
                        app.queue_changed_bundles();
                    }
                    std::thread::sleep(VERIFY_EVERY);
                }
            }
        });
    }
    Ok(())
}

/// Address with a token that logs in once.
fn login_url(at: SocketAddr, token: &str) -> String {
    format!("http://{at}/enter?token={token}")
}

/// Reads the password, if there is one. It is never given on the command line, which every user of the computer can
/// read.
fn read_password(arguments: &Arguments) -> Result<Option<String>, CliError> {
    let given = match &arguments.password_file {
        Some(path) => Some(typodont_formats::read_text(path)?.text.trim_end_matches(['\r', '\n']).to_string()),
        None => match std::env::var(PASSWORD) {
            Ok(password) => Some(password),
            Err(std::env::VarError::NotPresent) => None,
            Err(_) => return Err(CliError::misuse(format!("wrong-password: {PASSWORD} is not valid UTF-8 text"))),
        },
    };
    match given {
        Some(password) if password.chars().count() < PASSWORD_MIN => {
            Err(CliError::misuse(format!("weak-password: the password must have at least {PASSWORD_MIN} characters")))
        }
        given => Ok(given),
    }
}
