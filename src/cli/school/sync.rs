//! `typodont sync`: a station's finished bundles to the school. The bytes first, the row last.

use super::asking::{Line, Unanswered};
use super::database::At;
use super::mark;
use super::patience::Passing;
use super::store::{Named, Store, Undone};
use crate::cli::{Failure, say};
use crate::handover::session_id;
use crate::report::SessionFile;
use crate::report::cohort::{find, read_session};
use crate::report::harmless;
use crate::school::records::{self, Entered, Finished, Standing};
use crate::school::{Changed, Pack};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use postgres::error::SqlState;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

#[derive(Args)]
pub struct Arguments {
    /// Folder that holds bundles, at any depth
    folder: PathBuf,
    /// Class that the sessions belong to
    #[arg(long, value_name = "NAME")]
    class: String,
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    store: Named,
    /// Delete bundles here whose session or participant the school erased
    #[arg(long)]
    remove_erased: bool,
    /// Stay, and send whatever is finished, until ended
    #[arg(long)]
    stay: bool,
}

/// Sessions that are asked about at once.
const ASKED_AT_ONCE: usize = 500;

/// Between two looks into the folder.
const LOOK_EVERY: Duration = Duration::from_secs(5);

/// Letters of a path or a reason that are told.
const TOLD_MAX: usize = 300;

/// What came of a round.
#[derive(Default)]
struct Round {
    sent: usize,
    known: usize,
    erased: usize,
    refused: usize,
}

/// Why a round broke off.
pub enum Stopped {
    Database(Unanswered),
    Store(Undone),
    /// It is not the store that the records know.
    WrongStore(Failure),
    NoClass,
}

impl From<Unanswered> for Stopped {
    fn from(unanswered: Unanswered) -> Stopped {
        Stopped::Database(unanswered)
    }
}

impl From<Undone> for Stopped {
    fn from(undone: Undone) -> Stopped {
        Stopped::Store(undone)
    }
}

/// A bundle that was found.
struct Found {
    path: PathBuf,
    session: SessionFile,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { folder, at, store, stay, .. } = arguments;
    if !folder.is_dir() {
        return Err(Failure::wrong(format!("{}: missing-folder: there is no such folder", folder.display())));
    }
    let mut line = at.line()?;
    let store = store.open(at.patience()?)?;
    let mut told = BTreeSet::new();
    loop {
        let mut round = Round::default();
        let stopped = send_all(arguments, &mut line, &store, &mut round, &mut told).err();
        let words = in_words(&round);
        match stopped {
            None if !stay && round.refused == 0 => return say(words),
            None if !stay => {
                say(words)?;
                return Err(Failure::Told);
            }
            None => {
                if round.sent > 0 {
                    say(words)?;
                }
            }
            Some(Stopped::NoClass) => return Err(no_class(&arguments.class)),
            Some(Stopped::WrongStore(failure)) if !stay => return Err(failure),
            Some(Stopped::Database(Unanswered::Refused(error))) => return Err(Unanswered::Refused(error).into()),
            Some(Stopped::Database(away)) if !stay => return Err(offline(away.into(), &words)),
            Some(Stopped::Store(undone)) if !stay => return Err(offline(undone.into(), &words)),
            // A station goes on without its school: what is finished waits in its folder.
            Some(Stopped::WrongStore(failure)) => {
                if told.insert("wrong-store".into()) {
                    failure.tell();
                }
            }
            // A store that is away will be back; one that refuses says so once.
            Some(Stopped::Store(undone)) if !undone.is_passing() && told.insert(undone.why.clone()) => {
                Failure::from(undone).tell();
            }
            Some(Stopped::Database(_) | Stopped::Store(_)) => {}
        }
        thread::sleep(LOOK_EVERY);
    }
}

fn in_words(round: &Round) -> String {
    let Round { sent, known, erased, refused } = round;
    format!("{sent} sessions sent, {known} were there, {erased} are erased, {refused} refused")
}

pub fn no_class(class: &str) -> Failure {
    let class = harmless(class, 80);
    Failure::wrong(format!("--class: unknown-class: there is no class \"{class}\"; typodont school class makes one"))
}

fn offline(failure: Failure, words: &str) -> Failure {
    Failure::wrong(format!("{}; so far {words}; the rest waits here and is sent next time", failure.lines()))
}

fn send_all(
    arguments: &Arguments,
    line: &mut Line,
    store: &Store,
    round: &mut Round,
    told: &mut BTreeSet<String>,
) -> Result<(), Stopped> {
    let mut complain = |path: &Path, why: &str| {
        let text = format!("{}: {}", harmless(&path.display().to_string(), TOLD_MAX), harmless(why, TOLD_MAX));
        // Who stays does not say the same every five seconds.
        if told.insert(text.clone()) {
            eprintln!("{text}");
        }
    };
    let found = bundles(&arguments.folder, &mut complain);
    let station = line.ask(records::login)?;
    if !line.ask(|client| records::has_class(client, &arguments.class))? {
        return Err(Stopped::NoClass);
    }
    mark::check_or_lay(line, store)?;
    let mut new = Vec::new();
    for some in found.chunks(ASKED_AT_ONCE) {
        let sessions: Vec<&SessionFile> = some.iter().map(|found| &found.session).collect();
        let standing = line.ask(|client| records::standing(client, &sessions))?;
        let ids: Vec<String> = sessions.iter().map(|session| session_id(session)).collect();
        let written = line.ask(|client| records::written(client, &ids))?;
        for (found, standing) in some.iter().zip(standing) {
            match standing {
                Standing::New => new.push(found),
                Standing::Known => {
                    round.known += 1;
                    if written.get(&session_id(&found.session)).is_some_and(|digest| *digest != digest_of(&found.path))
                    {
                        complain(&found.path, "changed: its session.json is not what was sent; what was sent counts");
                    }
                }
                Standing::Erased => erased(arguments, round, found, &mut complain),
            }
        }
    }
    let bar = bar(new.len() as u64, "sent");
    for found in new {
        match send(arguments, line, store, &station, found)? {
            Ok(Entered::Now) => round.sent += 1,
            Ok(Entered::Before | Entered::Elsewhere) => round.known += 1,
            Ok(Entered::Erased) => erased(arguments, round, found, &mut complain),
            Ok(Entered::NoClass) => return Err(Stopped::NoClass),
            Err(why) => {
                round.refused += 1;
                complain(&found.path, &why);
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

/// Every bundle below a folder, each session once.
fn bundles(folder: &Path, complain: &mut impl FnMut(&Path, &str)) -> Vec<Found> {
    let all = find(folder);
    for (path, why) in &all.left_out {
        complain(path, why);
    }
    let mut known = BTreeSet::new();
    let mut found = Vec::new();
    for file in all.files {
        let path = file.parent().unwrap_or(folder).to_path_buf();
        match read_session(&file) {
            Ok(session) if known.insert(session_id(&session)) => found.push(Found { path, session }),
            Ok(_) => complain(&path, "skipped: another bundle here is of the same session"),
            Err(why) => complain(&path, &format!("skipped: {why}")),
        }
    }
    found
}

fn erased(arguments: &Arguments, round: &mut Round, found: &Found, complain: &mut impl FnMut(&Path, &str)) {
    round.erased += 1;
    if !arguments.remove_erased {
        return complain(&found.path, "erased: the school erased it; delete it here, or sync with --remove-erased");
    }
    if let Err(error) = std::fs::remove_dir_all(&found.path) {
        complain(&found.path, &format!("erased: it cannot be deleted: {error}"));
    }
}

/// Sends one bundle. The inner `Err` says why it is refused, for good.
fn send(
    arguments: &Arguments,
    line: &mut Line,
    store: &Store,
    station: &str,
    found: &Found,
) -> Result<Result<Entered, String>, Stopped> {
    let folder = format!("{station}/{}", session_id(&found.session));
    let text = match crate::content::read_text(&found.path.join(crate::report::bundle::SESSION_FILE)) {
        Ok(source) => source.text.clone(),
        Err(complaint) => return Ok(Err(complaint.message)),
    };
    let pack = match Pack::of(&found.path, &found.session, folder.clone()) {
        Ok(pack) => pack,
        Err(why) => return Ok(Err(why.to_string())),
    };
    if let Err(why) = store_parts(store, &pack)? {
        return Ok(Err(why.to_string()));
    }
    let bundle = found.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let finished = Finished {
        class: &arguments.class,
        bundle: &bundle,
        session: &found.session,
        text: &text,
        manifest: &pack.manifest,
    };
    let entered = match line.ask(|client| records::enter(client, &finished)) {
        // What a person wrote that no database takes, as a letter of the value zero.
        Err(Unanswered::Refused(error)) if is_of_values(&error) => {
            store.clear(&folder)?;
            return Ok(Err(format!("unkept-session: {}", records::told(&error))));
        }
        entered => entered?,
    };
    if matches!(entered, Entered::Elsewhere | Entered::Erased) {
        // Its row names other bytes, or none.
        store.clear(&folder)?;
    }
    Ok(Ok(entered))
}

/// Of a bundle's `session.json` as it would be sent; nothing of one that is gone.
fn digest_of(bundle: &Path) -> String {
    let text = crate::content::read_text(&bundle.join(crate::report::bundle::SESSION_FILE));
    text.map_or(String::new(), |source| crate::scenario::hex(&Sha256::digest(source.text.as_bytes())))
}

fn is_of_values(error: &postgres::Error) -> bool {
    let class = error.code().map(SqlState::code).unwrap_or_default();
    class.starts_with("22") || class.starts_with("23")
}

/// Stores the parts that are not there. What is there from an earlier try is read back and compared.
fn store_parts(store: &Store, pack: &Pack) -> Result<Result<(), Changed>, Undone> {
    store.settle(&pack.manifest.folder);
    let there = store.list(&pack.manifest.folder)?;
    for (index, part) in pack.manifest.parts.iter().enumerate() {
        let name = pack.manifest.part_name(index);
        if there.iter().any(|(known, bytes)| *known == name && *bytes == part.bytes) {
            let digest = crate::scenario::hex(&Sha256::digest(store.get(&name)?));
            if digest == part.sha256 {
                continue;
            }
        }
        match pack.part(index) {
            Ok(bytes) => store.put(&name, bytes)?,
            Err(why) => return Ok(Err(why)),
        }
    }
    for (name, _) in there {
        // Parts of a bundle that was another when it was begun.
        if !(0..pack.manifest.parts.len()).any(|index| pack.manifest.part_name(index) == name) {
            store.remove(&name)?;
        }
    }
    Ok(Ok(()))
}

/// A bar for people; it draws nothing where nobody looks.
pub fn bar(length: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {eta} left").expect("the template is valid");
    ProgressBar::new(length).with_style(style).with_message(what)
}
