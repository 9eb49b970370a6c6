//! `typodont run`: runs one exercise and writes its bundle.

#[cfg(feature = "devices")]
use super::link_key::{self, TypedKey};
#[cfg(feature = "devices")]
use super::live;
#[cfg(not(all(feature = "desktop", feature = "devices")))]
use super::missing_part;
use super::station::{self, Station};
use super::{CliError, SESSIONS, print_line, secret_file};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_core::device::DeviceSpec;
#[cfg(feature = "devices")]
use typodont_devices::servo::SecondHandRole;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece};
use typodont_exercise::session::OperatorFile;
use typodont_formats::Library;
use typodont_lesson::{self as lesson, LessonError, SessionConfig, SessionSeed, ToothScan};
#[cfg(feature = "devices")]
use typodont_lesson::{PendingSecondHand, second_hand};

/// Name of the window's own pointer as a device.
const MOUSE: &str = "mouse";

/// Name of the simulated device that a scripted operator moves.
const SCRIPTED: &str = "scripted";

const OUT_HELP: &str = "Folder for the bundle; without it the station's, or reports/sessions";

#[derive(Args)]
pub struct Arguments {
    /// Scenario file of the exercise
    #[arg(required_unless_present = "new_code")]
    scenario: Option<PathBuf>,
    /// Run without a window, as fast as the computer allows
    #[arg(long)]
    headless: bool,
    /// Scripted operator in the place of a trainee: careful, expert, guess, hasty, timid, or a file
    #[arg(long, value_name = "NAME|FILE.json", default_value = "careful", requires = "headless")]
    operator: String,
    /// Device of the trainee; see `typodont devices`
    #[arg(long, value_name = "NAME[:WHICH]", default_value = SCRIPTED)]
    device: String,
    /// Second device on this computer; see --second-role
    #[arg(long, value_name = "NAME[:WHICH]", conflicts_with = "second_at")]
    second: Option<String>,
    /// Address on this computer at which a second device may join from another computer
    #[arg(long, value_name = "ADDRESS:PORT")]
    second_at: Option<String>,
    /// File with the key that the other computer must have, as written by `typodont assist --new-key`; by default the key is
    /// taken from TYPODONT_LINK_KEY
    #[arg(long, value_name = "FILE", requires = "second_at")]
    second_key_file: Option<PathBuf>,
    /// The key itself, at least 8 characters; other users of this computer can read it there, so prefer --second-key-file
    #[arg(long, value_name = "KEY", requires = "second_at", conflicts_with = "second_key_file")]
    second_key: Option<String>,
    /// Purpose of the second device
    #[arg(long, value_enum, default_value_t)]
    second_role: SecondHandRoleName,
    /// Seed of the random choices of the exercise; by default drawn from the operating system
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Examination: file with the examiner's code, from which the seed is derived; "-" reads the code from the standard
    /// input. What is drawn stays unknown until the end of the session
    #[arg(long, value_name = "FILE", conflicts_with = "seed")]
    seed_sealed: Option<PathBuf>,
    /// Write a new random examiner's code to a file that only you can read, and end
    #[arg(long, value_name = "FILE", exclusive = true)]
    new_code: Option<PathBuf>,
    /// CT volume, or label map as written by `typodont import` (NRRD), used instead of the exercise's own tooth
    #[arg(long, value_name = "VOLUME")]
    tooth: Option<PathBuf>,
    /// Voxel spacing of that volume, if its header does not state it
    #[arg(long, value_name = "MM", requires = "tooth", value_parser = spacing)]
    tooth_spacing_mm: Option<f32>,
    /// FDI number of the tooth in that volume, such as 13; by default the number of the exercise's own tooth. In an
    /// exercise with a whole arch, the number of the tooth that the volume replaces
    #[arg(long, value_name = "NUMBER", requires = "tooth", value_parser = tooth_number)]
    fdi: Option<u8>,
    /// Participant code of the trainee; never a name
    #[arg(long, value_name = "CODE", default_value = "", value_parser = participant)]
    participant: String,
    #[arg(long, value_name = "DIR", help = OUT_HELP)]
    out: Option<PathBuf>,
    /// File of the station; without it the system's, then the user's, if there is one
    #[arg(long, value_name = "FILE")]
    station: Option<PathBuf>,
    /// Begin at once, without showing the instructions
    #[arg(long, conflicts_with = "headless")]
    begin: bool,
}

pub fn spacing(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(mm) if (0.01..=2.0).contains(&mm) => Ok(mm),
        _ => Err("the voxel spacing must be between 0.01 and 2 mm".into()),
    }
}

fn tooth_number(text: &str) -> Result<u8, String> {
    match text.parse::<u8>() {
        Ok(fdi) if (1..=4).contains(&(fdi / 10)) && (1..=8).contains(&(fdi % 10)) => Ok(fdi),
        _ => Err("the FDI number must be one of 11–18, 21–28, 31–38 or 41–48".into()),
    }
}

/// Role of a second hand, as the command line names it.
#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
enum SecondHandRoleName {
    /// Follows the trainee's device, and leads it while the button is held
    #[default]
    Instructor,
    /// Holds the suction tube, which touches the tooth and removes debris and water
    Suction,
    /// Holds the syringe, which touches the tooth and washes debris away while the button is held
    Irrigation,
}

#[cfg(feature = "devices")]
impl From<SecondHandRoleName> for SecondHandRole {
    fn from(role: SecondHandRoleName) -> SecondHandRole {
        match role {
            SecondHandRoleName::Instructor => SecondHandRole::Instructor,
            SecondHandRoleName::Suction => SecondHandRole::Suction,
            SecondHandRoleName::Irrigation => SecondHandRole::Irrigation,
        }
    }
}

/// Parses a participant code.
fn participant(text: &str) -> Result<String, String> {
    match lesson::is_valid_participant_code(text) {
        true => Ok(text.to_string()),
        false => Err("a participant code consists of up to 64 letters, digits, \"-\", \"_\" or \".\", and is never a \
        name"
            .into()),
    }
}

/// Inputs of a run.
pub struct RunRequest<'a> {
    pub scenario: Arc<Scenario>,
    pub driver: SessionDriver,
    pub seed: SeedSource,
    pub participant: &'a str,
    pub out: &'a Path,
    /// SHA-256 of files that the scenario does not name, by name.
    pub digests: BTreeMap<String, String>,
}

/// Source of a session's seed, before the time of its start is known.
pub enum SeedSource {
    /// The operating system.
    System,
    Given(u64),
    /// The examiner's code.
    Sealed(String),
}

/// Source of the hand's movement.
pub enum SessionDriver {
    /// A scripted operator on a simulated device, as fast as the computer allows.
    Script(Box<OperatorFile>),
    /// A person with a device, in real time.
    #[cfg(feature = "devices")]
    Person(Box<live::Hands>),
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(path) = &arguments.new_code {
        secret_file::write_new(path, &lesson::new_examiner_code()?)?;
        return print_line(format!(
            "{}: a new code; give it by --seed-sealed, or type it in the window",
            path.display()
        ));
    }
    let Some(scenario) = &arguments.scenario else { return Err(CliError::misuse("SCENARIO is required")) };
    run_exercise(arguments, scenario)
}

fn run_exercise(arguments: &Arguments, exercise: &Path) -> Result<(), CliError> {
    let station = station::find(arguments.station.as_deref())?;
    let own_folder = station.as_ref().and_then(|station| station.sessions.clone());
    let out = arguments.out.clone().or(own_folder).unwrap_or_else(|| SESSIONS.into());
    // With one kind of separator, also on Windows.
    let out: PathBuf = out.components().collect();
    super::check_output_folder(&out)?;
    let is_scripted = arguments.device == SCRIPTED;
    if !arguments.headless && (is_scripted || arguments.device == MOUSE) {
        return open_in_window(arguments, exercise, out, station);
    }
    let library = lesson::library_for(exercise);
    let mut scenario = lesson::read_scenario(exercise, ResolveMode::MakeWorkpiece)?;
    let mut digests = BTreeMap::new();
    if let Some(scan) = read_tooth_scan(arguments)? {
        scan.replace_teeth(&mut scenario)?;
        if arguments.fdi.is_none()
            && let Some(tooth) = scenario.scene.teeth.first()
        {
            let number = tooth.fdi;
            eprintln!("note: the volume counts as tooth {number}, the exercise's own; --fdi gives it another number");
        }
        if let Ok(workpiece) = Workpiece::make(&scenario, arguments.seed.unwrap_or_default()) {
            let warnings = lesson::caries_warnings(&scenario, &workpiece);
            warnings.iter().for_each(|w| eprintln!("warning: {}: {}; {}", w.code, w.message, w.help));
        }
        digests.insert("tooth".to_string(), scan.digest().to_string());
    }
    let driver = match is_scripted {
        true => SessionDriver::Script(Box::new(operator(&arguments.operator, &library)?)),
        false => open_devices(arguments)?,
    };
    let run = RunRequest {
        scenario: Arc::new(scenario),
        driver,
        seed: match (read_code(arguments.seed_sealed.as_deref())?, arguments.seed) {
            (Some(code), _) => SeedSource::Sealed(code),
            (None, Some(seed)) => SeedSource::Given(seed),
            (None, None) => SeedSource::System,
        },
        participant: &arguments.participant,
        out: &out,
        digests,
    };
    print_line(run_session(run)?.display())
}

/// Opens the devices of a person, and of a second one where it is asked for.
#[cfg(feature = "devices")]
fn open_devices(arguments: &Arguments) -> Result<SessionDriver, CliError> {
    let first = lesson::open_device(&arguments.device)?;
    let held = (first.name.as_str(), first.device.spec());
    let second =
        second_hand_source(arguments)?.map(|(from, role)| PendingSecondHand::join(&from, role, held)).transpose()?;
    Ok(SessionDriver::Person(Box::new(live::Hands { first, second })))
}

#[cfg(not(feature = "devices"))]
fn open_devices(_: &Arguments) -> Result<SessionDriver, CliError> {
    Err(missing_part::error("haptic devices (--device)", "devices"))
}

/// Complains that this build has no window.
#[cfg(not(feature = "desktop"))]
fn open_in_window(_: &Arguments, _: &Path, _: PathBuf, _: Option<Station>) -> Result<(), CliError> {
    Err(missing_part::error("the window; without it, give --headless", "desktop"))
}

/// Opens the exercise in the window of the desktop application.
#[cfg(feature = "desktop")]
fn open_in_window(
    arguments: &Arguments,
    exercise: &Path,
    out: PathBuf,
    station: Option<Station>,
) -> Result<(), CliError> {
    let options = typodont_app::AppOptions {
        exercise: Some(exercise.to_path_buf()),
        tooth: read_tooth_scan(arguments)?,
        second: second_hand_source(arguments)?,
        begins_at_once: arguments.begin,
        device: (arguments.device == MOUSE).then(|| MOUSE.into()),
        seed: arguments.seed,
        seed_code: read_code(arguments.seed_sealed.as_deref())?,
        participant: arguments.participant.clone(),
        ..typodont_app::AppOptions::at_exercise_list(out, super::load_templates()?)
    };
    match station {
        Some(station) => station::open_window(station, options),
        None => super::open_window(options),
    }
}

/// Source and role of the second hand; `None` if none joins.
#[cfg(feature = "devices")]
fn second_hand_source(
    arguments: &Arguments,
) -> Result<Option<(second_hand::SecondHandSource, SecondHandRole)>, CliError> {
    let from = match (&arguments.second, arguments.second_at.clone()) {
        (Some(name), _) => second_hand::SecondHandSource::Device(name.clone()),
        (None, Some(at)) => {
            let typed = arguments.second_key.as_ref().map(|key| TypedKey { option: "--second-key", key });
            let key = link_key::read(arguments.second_key_file.as_deref(), typed, "--second-key-file")?;
            second_hand::SecondHandSource::Network { at, key }
        }
        (None, None) => return Ok(None),
    };
    Ok(Some((from, arguments.second_role.into())))
}

/// Reads an examiner's code: the first line of a file, or of the standard input for "-".
pub fn read_code(path: Option<&Path>) -> Result<Option<String>, CliError> {
    let Some(path) = path else { return Ok(None) };
    let text = match path == Path::new("-") {
        true => std::io::read_to_string(std::io::stdin()).map_err(|e| CliError::Wrong(format!("no code: {e}")))?,
        false => typodont_formats::read_text(path)?.text.clone(),
    };
    Ok(Some(text.lines().next().unwrap_or_default().trim().to_string()))
}

/// Reads the scan that replaces the exercise's own tooth.
fn read_tooth_scan(arguments: &Arguments) -> Result<Option<ToothScan>, LessonError> {
    let read = |path| ToothScan::read(path, arguments.tooth_spacing_mm, arguments.fdi);
    arguments.tooth.as_deref().map(read).transpose()
}

/// Reads a scripted operator, by name or from a file.
///
/// # Errors
/// A message if no operator has this name, or complaints if the file is not a valid operator.
pub fn operator(name: &str, library: &Library) -> Result<OperatorFile, CliError> {
    match Path::new(name).extension() {
        Some(_) => {
            Ok(typodont_formats::json::read::<OperatorFile>(typodont_formats::read_text(Path::new(name))?)?.value)
        }
        None if library.bytes(&OperatorFile::file_name(name)).is_err() => {
            let known = library
                .files_in_memory()
                .filter_map(|(file, _)| file.strip_prefix("content/operators/")?.strip_suffix(".json"));
            let known = known.collect::<Vec<_>>().join(", ");
            Err(CliError::Wrong(format!(
                "unknown-operator: there is no operator \"{name}\"; known: {known}, or a file"
            )))
        }
        None => Ok(OperatorFile::read(library, name)?),
    }
}

/// Runs, records, scores and reports a session; returns the path of its bundle.
///
/// # Errors
/// A message if the templates are invalid, or the session cannot be run or its bundle written.
pub fn run_session(run: RunRequest) -> Result<PathBuf, CliError> {
    let RunRequest { scenario, driver, seed, participant, out, digests } = run;
    // Invalid templates must be reported before the session, not after.
    let templates = super::load_templates()?;
    let started = jiff::Timestamp::now();
    let seed = match seed {
        SeedSource::System => SessionSeed::drawn()?,
        SeedSource::Given(seed) => SessionSeed::given(seed),
        SeedSource::Sealed(code) => SessionSeed::sealed(&code, participant, started, &scenario)?,
    };
    let config = SessionConfig { scenario, seed, participant, out: Some(out), digests, templates, started };
    let workpiece = config.make_workpiece()?;
    let recorded = match driver {
        SessionDriver::Script(operator) => {
            config.prepare(workpiece, DeviceSpec::phantom_omni(), Some(&operator))?.run_script(*operator)?
        }
        #[cfg(feature = "devices")]
        SessionDriver::Person(hands) => {
            let prepared = config.prepare(workpiece, hands.first.device.spec().clone(), None)?;
            live::play(prepared, *hands)?
        }
    };
    let bar = spinner("scoring and writing the report");
    let bundle = recorded.complete(&mut |_| ());
    bar.finish_and_clear();
    Ok(bundle?.path().to_path_buf())
}

/// A progress indicator on a terminal; hidden elsewhere.
pub fn spinner(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
    let bar = ProgressBar::new_spinner().with_style(style).with_message(what);
    bar.enable_steady_tick(std::time::Duration::from_millis(120));
    bar
}
