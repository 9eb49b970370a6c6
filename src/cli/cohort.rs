//! `typodont cohort`: compares many bundles.

use super::verification::{self, VerificationArguments};
use super::{CliError, DEFAULT_LANGUAGE, SessionSource, load_templates, print_line, write_file};
use clap::Args;
use std::path::{Path, PathBuf};
use typodont_report::cohort::{Cohort, ExaminerRating, read_ratings, recording_of};
use typodont_report::{SessionFile, Templates, sanitize_display};

#[derive(Args)]
#[command(group = clap::ArgGroup::new("pages").args(["html", "trainees"]).multiple(true))]
pub struct Arguments {
    #[command(flatten)]
    source: SessionSource,
    /// Table to write: one line per session, one column per measure
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Page to write: distributions, maps, learning curves, reliability, pass marks, questionnaire
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Folder for a page for each participant: own attempts, rank in the class, progress since the last attempt
    #[arg(long, value_name = "DIR")]
    trainees: Option<PathBuf>,
    /// Language of the pages, by its code: en, tr, or one that the school added
    #[arg(long, value_name = "CODE", default_value = DEFAULT_LANGUAGE, requires = "pages")]
    language: String,
    /// File to write with the same figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Participants with whom the others are compared
    #[arg(long, value_name = "CODE[,CODE]", value_delimiter = ',')]
    expert: Vec<String>,
    /// Examiners' ratings, from which pass marks and the examiners' agreement are derived: a CSV file of the review desk, or one
    /// with the columns participant, rating (1 to 5) and, optionally, scenario and rater; may be given several times
    #[arg(long, value_name = "FILE.csv")]
    ratings: Vec<PathBuf>,
    /// Folder for NRRD maps of the proportion of participants who removed each voxel
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
    #[command(flatten)]
    verification: VerificationArguments,
}

/// Maximum length of a printed path or reason, characters.
const PRINTED_MAX: usize = 300;

/// Page of a cohort, or folder of pages, that is to be written.
pub struct PageRequest<'a> {
    path: &'a Path,
    templates: Templates,
    /// Code of a language that the templates have.
    language: &'a str,
}

impl<'a> PageRequest<'a> {
    /// Loads the templates.
    ///
    /// # Errors
    /// Fails if a template is not valid, or if there is no such language.
    pub fn new(path: &'a Path, language: &'a str) -> Result<PageRequest<'a>, CliError> {
        let templates = load_templates()?;
        templates.languages().translator(language).map_err(CliError::misuse)?;
        Ok(PageRequest { path, templates, language })
    }
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { csv, html, json, maps, trainees, .. } = arguments;
    let trainees = trainees.as_deref().map(|path| PageRequest::new(path, &arguments.language)).transpose()?;
    let page = html.as_deref().map(|path| PageRequest::new(path, &arguments.language)).transpose()?;
    let compares = csv.is_some() && !arguments.expert.is_empty();
    let mut sourced = arguments.source.read(html.is_some() || json.is_some() || maps.is_some() || compares)?;
    let mut cohort = std::mem::take(&mut sourced.cohort);
    verification::settle(&mut cohort, &arguments.verification)?;
    cohort.experts = known_experts(&cohort, &arguments.expert)?;
    for path in &arguments.ratings {
        let found = load_ratings(&cohort, path)?;
        cohort.ratings.extend(found);
    }
    let reported_count = cohort.skipped.len();
    if html.is_some() || json.is_some() || maps.is_some() || csv.is_some() && !cohort.experts.is_empty() {
        cohort.map_removals();
    }
    report_skipped(&cohort, reported_count);
    write_all(&cohort, page.as_ref(), csv.as_deref(), json.as_deref())?;
    if let Some(request) = trainees {
        write_trainee_pages(&cohort, &request)?;
    }
    if let Some(folder) = maps {
        write_maps(&cohort, folder)?;
    }
    print_line(cohort.text().trim_end())
}

/// Reads all bundles below a folder, and prints a complaint about each that is not valid.
///
/// # Errors
/// A message if the folder does not exist or contains no valid bundle.
pub fn read_folder(folder: &Path) -> Result<Cohort, CliError> {
    if !folder.is_dir() {
        return Err(CliError::wrong(format!("{}: missing-folder: the folder does not exist", folder.display())));
    }
    let cohort = Cohort::read(folder);
    report_skipped(&cohort, 0);
    if cohort.sessions.is_empty() {
        return Err(CliError::Wrong(format!("{}: no-sessions: the folder contains no bundle", folder.display())));
    }
    Ok(cohort)
}

/// Prints path and reason of every file that was skipped after the first `reported_count`.
pub fn report_skipped(cohort: &Cohort, reported_count: usize) {
    for (path, reason) in &cohort.skipped[reported_count..] {
        eprintln!(
            "{}: skipped: {}",
            sanitize_display(&path.display().to_string(), PRINTED_MAX),
            sanitize_display(reason, PRINTED_MAX)
        );
    }
}

fn known_experts(cohort: &Cohort, codes: &[String]) -> Result<Vec<String>, CliError> {
    let is_there = |code: &&String| cohort.sessions.iter().any(|(_, s)| s.participant == **code && !code.is_empty());
    let missing: Vec<String> = codes.iter().filter(|code| !is_there(code)).map(|c| sanitize_display(c, 40)).collect();
    match missing.is_empty() {
        true => Ok(codes.to_vec()),
        false => {
            let what = format!(
                "unknown-expert: there is no session of participant \"{}\"; write codes exactly as in session.json",
                missing.join("\", \"")
            );
            Err(CliError::Wrong(what))
        }
    }
}

fn load_ratings(cohort: &Cohort, path: &Path) -> Result<Vec<ExaminerRating>, CliError> {
    let source = typodont_formats::read_text(path)?;
    let found = read_ratings(&path.display().to_string(), &source.text).map_err(|e| CliError::Wrong(e.join("\n")))?;
    for rating in &found {
        let is_own = |session: &SessionFile| match rating.recording.is_empty() {
            true => session.participant == rating.participant,
            false => recording_of(session) == rating.recording,
        };
        if !rating.recording.is_empty() && !cohort.sessions.iter().any(|(_, session)| is_own(session)) {
            let start: String = rating.recording.chars().take(12).collect();
            eprintln!(
                "{}: no-session: there is no session with the recording {}…; the rating is ignored",
                path.display(),
                sanitize_display(&start, 12)
            );
        } else if !cohort.sessions.iter().any(|(_, session)| is_own(session)) {
            let code = sanitize_display(&rating.participant, 40);
            eprintln!(
                "{}: no-session: there is no session of participant \"{code}\"; the rating is ignored",
                path.display()
            );
        }
    }
    Ok(found)
}

/// Writes the outputs that the arguments name.
pub fn write_all(
    cohort: &Cohort,
    page: Option<&PageRequest>,
    csv: Option<&Path>,
    json: Option<&Path>,
) -> Result<(), CliError> {
    if let Some(PageRequest { path, templates, language }) = page {
        write_file(path, cohort.html(templates, path, language).map_err(CliError::wrong)?)?;
    }
    if let Some(path) = csv {
        write_file(path, cohort.csv())?;
    }
    if let Some(path) = json {
        write_file(path, cohort.json())?;
    }
    Ok(())
}

/// Writes a page for each participant into the folder of the request.
fn write_trainee_pages(cohort: &Cohort, request: &PageRequest) -> Result<(), CliError> {
    let PageRequest { path: folder, templates, language } = request;
    let pages = cohort.trainee_pages(templates, folder, language).map_err(CliError::wrong)?;
    let unwritable = |e: std::io::Error| CliError::wrong(format!("{}: unwritable-folder: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    for page in pages {
        write_file(&folder.join(page.file_name), page.html)?;
    }
    Ok(())
}

fn write_maps(cohort: &Cohort, folder: &Path) -> Result<(), CliError> {
    let unwritable = |e: std::io::Error| CliError::wrong(format!("{}: unwritable-folder: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    for removal in &cohort.removals {
        write_file(&folder.join(removal.file_name()), removal.nrrd().map_err(CliError::wrong)?)?;
    }
    Ok(())
}
