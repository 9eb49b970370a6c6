//! `typodont package`: puts exercises and the web page into one archive for a learning platform.

use super::gradebook::{AttemptPolicyName, CriticalErrorPolicyName};
use super::{CliError, print_line, write_file};
use clap::{Args, Subcommand, ValueEnum};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario::file::ScenarioFile;
use typodont_exercise::scenario::{self, ResolveMode, Scenario};
use typodont_formats::{Library, json, zip};
use typodont_integrations::learning_platform::{Course, CourseExercise, PackageStandard};
use typodont_lesson::{library_for, scenario_files};

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: PackageCommand,
}

#[derive(Subcommand)]
enum PackageCommand {
    /// A SCORM package, for Moodle, Canvas, Blackboard, ILIAS and others
    Scorm(ScormArguments),
    /// A cmi5 package, for platforms with a learning record store
    Cmi5(CourseArguments),
}

#[derive(Args)]
struct ScormArguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Version of SCORM: every platform takes 1.2; 2004 keeps more of each result
    #[arg(long, value_name = "VERSION", default_value = "1.2")]
    version: ScormVersion,
}

#[derive(Args)]
struct CourseArguments {
    /// Scenario files, or folders that contain them
    #[arg(required = true, value_name = "EXERCISE")]
    exercises: Vec<PathBuf>,
    /// Archive to write
    #[arg(short, long, value_name = "FILE.zip")]
    output: PathBuf,
    /// Title of the course; by default that of the first exercise
    #[arg(long)]
    title: Option<String>,
    /// Folder of the web page; by default the one that was installed with the program
    #[arg(long, value_name = "FOLDER")]
    page: Option<PathBuf>,
    /// Session that counts when a learner has several of one exercise
    #[arg(long, value_name = "WHICH", default_value = "last")]
    take: AttemptPolicyName,
    /// Points of a session with a critical error: unchanged, limited to one below the pass mark, or zero
    #[arg(long, value_name = "RULE", default_value = "keep")]
    critical: CriticalErrorPolicyName,
}

#[derive(Clone, Copy, ValueEnum)]
enum ScormVersion {
    #[value(name = "1.2")]
    V12,
    #[value(name = "2004")]
    V2004,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let (standard, arguments) = match &arguments.command {
        PackageCommand::Scorm(scorm) => match scorm.version {
            ScormVersion::V12 => (PackageStandard::Scorm12, &scorm.course),
            ScormVersion::V2004 => (PackageStandard::Scorm2004, &scorm.course),
        },
        PackageCommand::Cmi5(course) => (PackageStandard::Cmi5, course),
    };
    let page = read_page(&page_folder(arguments.page.as_deref())?)?;
    let mut exercises = Vec::new();
    for path in &arguments.exercises {
        for file in scenario_files(path)? {
            exercises.push(read_exercise(&file)?);
        }
    }
    let title = arguments.title.clone().unwrap_or_else(|| exercises[0].titles[0].1.clone());
    let (critical, take) = (arguments.critical.policy(), arguments.take.policy());
    let course = Course { title, exercises, critical, take };
    let files = course.package(standard, &page).map_err(CliError::Wrong)?;
    let archive =
        zip::write(files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice()))).map_err(CliError::wrong)?;
    let size = archive.len() as f64 / 1e6;
    write_file(&arguments.output, archive)?;
    let count = course.exercises.len();
    let exercises = if count == 1 { "1 exercise".to_string() } else { format!("{count} exercises") };
    print_line(format!("{}: {exercises}, {size:.1} MB", arguments.output.display()))
}

/// Reads an exercise and all files that it names, except those which the page contains anyway.
fn read_exercise(path: &Path) -> Result<CourseExercise, CliError> {
    let source = typodont_formats::read_text(path)?;
    let library = library_for(path);
    let scenario = scenario::resolve(source.clone(), &library, ResolveMode::MakeWorkpiece)?;
    let written = json::read::<ScenarioFile>(source)?.value;
    let name = path.file_name().and_then(OsStr::to_str).unwrap_or("exercise.json").to_string();
    let shipped = Library::shipped();
    let of_instruments = written.instrument_files(&library);
    let named = written.named_files().into_iter().chain(of_instruments).filter(|name| shipped.bytes(name).is_err());
    let mut files = BTreeMap::from([(name.clone(), scenario.text.as_bytes().to_vec())]);
    for name in named {
        files.insert(name.clone(), library.bytes(&name)?.to_vec());
    }
    Ok(CourseExercise {
        id: scenario.id.clone(),
        titles: titles(&scenario),
        summary: scenario.summary.clone(),
        name,
        files,
        is_graded: scenario.rubric.is_some(),
    })
}

/// Titles by language code, English first; a title without a language is taken for English.
fn titles(scenario: &Scenario) -> Vec<(String, String)> {
    let base = ("en".to_string(), scenario.title.clone());
    let others = scenario.texts.translations(&scenario.title).unwrap_or_default();
    let english = others.get("en").map(|title| ("en".to_string(), title.clone()));
    let rest = others.into_iter().filter(|(code, _)| code != "en");
    std::iter::once(english.unwrap_or(base)).chain(rest).collect()
}

/// Folder of the web page: the one that is named, or one that was installed with the program.
fn page_folder(named: Option<&Path>) -> Result<PathBuf, CliError> {
    let is_page = |folder: &Path| folder.join("index.html").is_file();
    if let Some(folder) = named {
        return match is_page(folder) {
            true => Ok(folder.to_path_buf()),
            false => Err(CliError::wrong(format!("{}: no-page: this folder has no index.html", folder.display()))),
        };
    }
    let program = std::env::current_exe().map_err(CliError::wrong)?;
    let folder = program.parent().unwrap_or(Path::new("."));
    let installed = [folder.join("../share/typodont/web"), folder.join("web"), folder.join("../web")];
    installed.into_iter().find(|folder| is_page(folder)).ok_or_else(|| {
        CliError::wrong("no-page: the web page was not installed with this program; name its folder with --page")
    })
}

/// All files of the page, by their path below its folder.
fn read_page(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>, CliError> {
    let mut files = BTreeMap::new();
    let mut folders = vec![(folder.to_path_buf(), String::new())];
    while let Some((folder, prefix)) = folders.pop() {
        let unreadable = |e: std::io::Error| CliError::wrong(format!("{}: unreadable: {e}", folder.display()));
        for entry in fs::read_dir(&folder).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            match entry.path().is_dir() {
                true => folders.push((entry.path(), format!("{name}/"))),
                false => {
                    files.insert(name, fs::read(entry.path()).map_err(unreadable)?);
                }
            }
        }
    }
    Ok(files)
}
