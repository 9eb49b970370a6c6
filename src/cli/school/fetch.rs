//! `typodont school fetch` and `judgements`: bundles out of the school, and an examiner's word back into it.

use super::asking::Line;
use super::database::At;
use super::mark;
use super::source::{Source, note_read};
use super::store::Named;
use super::sync::bar;
use crate::cli::{Failure, say};
use crate::report::harmless;
use crate::review::{Entry, Log, OVERRIDES, Told, Unwritten};
use crate::scenario::hex;
use crate::school::records::{self, Kept, is_name};
use clap::Args;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
}

#[derive(Args)]
pub struct Judgements {
    /// Folder in which `typodont review` was used
    folder: PathBuf,
    #[command(flatten)]
    at: At,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Source { folder, at, store, class, .. } = &arguments.source;
    let Some(folder) = folder else {
        return Err(Failure::misuse("no-folder: name the folder that the bundles go to"));
    };
    let (fetched, failed) = bundles(at, store, class.as_deref(), folder)?;
    say(format!("{}: {fetched} bundles fetched, {failed} failed", folder.display()))?;
    if failed > 0 { Err(Failure::Told) } else { Ok(()) }
}

/// Fetches what is not there yet; a bundle is whole or absent. Gives how many came, and how many did not.
pub fn bundles(at: &At, store: &Named, class: Option<&str>, folder: &Path) -> Result<(usize, usize), Failure> {
    let class = class.map(String::from);
    let source = Source { folder: None, at: at.clone(), store: store.clone(), class, scorer: None };
    let store = store.open(at.patience()?)?;
    let (mut line, kept) = source.kept()?;
    mark::check(&mut line, &store)?;
    note_read(&mut line, &kept)?;
    let bar = bar(kept.len() as u64, "fetched");
    let (mut fetched, mut failed) = (0, 0);
    for k in &kept {
        let (path, partial) = (folder.join(&k.id), folder.join(format!("{}.partial", k.id)));
        if !path.exists() {
            match bundle(&store, k, &partial) {
                Ok(()) => {
                    let unwritable = |e| Failure::wrong(format!("{}: unwritable-folder: {e}", path.display()));
                    fs::rename(&partial, &path).map_err(unwritable)?;
                    fetched += 1;
                }
                Err(why) => {
                    failed += 1;
                    eprintln!("{}: {}", k.id, harmless(&why, 300));
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok((fetched, failed))
}

fn bundle(store: &super::Store, kept: &Kept, partial: &Path) -> Result<(), String> {
    let unwritable = |e: std::io::Error| format!("unwritable-folder: {e}: {}", partial.display());
    for file in &kept.manifest.files {
        // A station named it: it must not lead elsewhere.
        if !file.name.split('/').all(is_name) {
            return Err(format!("\"{}\" is not a file of a bundle", file.name));
        }
        let path = partial.join(&file.name);
        fs::create_dir_all(path.parent().unwrap_or(partial)).map_err(unwritable)?;
        let bytes = store.take(&kept.manifest, &file.name).map_err(|(why, _)| why)?;
        fs::write(path, bytes).map_err(unwritable)?;
    }
    Ok(())
}

pub fn judgements(arguments: &Judgements) -> Result<(), Failure> {
    let Exchanged { entered, taken } = exchange(&mut arguments.at.line()?, &arguments.folder)?;
    say(format!("{}: {entered} judgements entered, {taken} taken over", arguments.folder.display()))
}

/// How many judgements went each way.
pub struct Exchanged {
    pub entered: u64,
    pub taken: usize,
}

/// Enters those lines of a folder's log that hold and are not in the records yet, word for word; and appends to the log what others
/// judged meanwhile.
pub fn exchange(line: &mut Line, folder: &Path) -> Result<Exchanged, Failure> {
    let path = folder.join(OVERRIDES);
    let failed = |e| Failure::wrong(format!("{}: unreadable-file: {e}", path.display()));
    let mut log = Log::of(folder);
    let own = log.told(None).map_err(failed)?;
    let theirs = line.ask(records::judgements)?;
    let is_in = |told: &Told, entry: &Entry| told.counting().any(|e| e.at == entry.at && e.draft == entry.draft);
    let text = if path.is_file() { crate::content::read_text(&path)?.text.clone() } else { String::new() };
    let mut lines = Vec::new();
    for entry in own.counting().filter(|entry| !is_in(&theirs, entry)) {
        let line = text.lines().find(|line| serde_json::from_str::<Entry>(line).is_ok_and(|e| e == *entry));
        lines.extend(line.map(|line| (entry.clone(), line.to_string(), hex(&Sha256::digest(line)))));
    }
    let mut entered = 0;
    if !lines.is_empty() {
        // A log is known by its first line, and by whose it is.
        let first = hex(&Sha256::digest(text.lines().next().unwrap_or_default()));
        let name = format!("{}:{}", line.ask(records::login)?, &first[..16]);
        entered = line.ask(|client| records::judge(client, &name, &lines))?;
    }
    let mut taken = 0;
    // What was judged here since stands: a line that is taken over later must not overrule it.
    let is_overtaken = |entry: &Entry| {
        let item = entry.draft.item.as_ref().map(|item| item.index);
        own.last_of(&entry.draft.session, item).is_some_and(|last| last.at > entry.at)
    };
    for entry in theirs.counting().filter(|entry| !is_in(&own, entry) && !is_overtaken(entry)) {
        let append = log.append(&entry.at, None, |_| Ok::<_, std::convert::Infallible>(entry.draft.clone()));
        append.map_err(|unwritten| match unwritten {
            Unwritten::Failed(error) => failed(error),
            Unwritten::Refused(never) => match never {},
        })?;
        taken += 1;
    }
    Ok(Exchanged { entered, taken })
}
