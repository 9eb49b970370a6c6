//! `typodont run`: one exercise, one bundle.

use super::{Failure, SESSIONS, live, say};
use crate::app;
use crate::content::{self, Library};
use crate::device::Spec;
use crate::lesson::{self, Failed, Opening, Scan, SecondHand, second};
use crate::scenario::{Forms, Scenario};
use crate::session::OperatorFile;
use crate::sim::Role;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// The window's own pointer.
const MOUSE: &str = "mouse";

/// The device that no person holds.
const SCRIPTED: &str = "scripted";

#[derive(Args)]
pub struct Arguments {
    /// The exercise
    scenario: PathBuf,
    /// Run without a window, as fast as the machine can
    #[arg(long)]
    headless: bool,
    /// Who plays the trainee: careful, expert, hasty, timid, or a file
    #[arg(long, value_name = "NAME|FILE.json", default_value = "careful", requires = "headless")]
    operator: String,
    /// The device a person holds; see `typodont devices`
    #[arg(long, value_name = "NAME[:WHICH]", default_value = SCRIPTED)]
    device: String,
    /// A second device here; see --second-role
    #[arg(long, value_name = "NAME[:WHICH]", conflicts_with = "second_at")]
    second: Option<String>,
    /// Lets a second hand join from another machine, at this address of ours
    #[arg(long, value_name = "ADDRESS:PORT", requires = "second_key")]
    second_at: Option<String>,
    /// What that machine must know: a word of at least 8 letters
    #[arg(long, value_name = "KEY", requires = "second_at", value_parser = key)]
    second_key: Option<String>,
    /// What a second hand is there for
    #[arg(long, value_enum, default_value_t)]
    second_role: SecondRole,
    /// Decides what the exercise leaves to chance; drawn from the clock if left out
    #[arg(long)]
    seed: Option<u64>,
    /// A CT volume, or a map of its tissues as `typodont import` writes it (NRRD), to work on instead of the exercise's own tooth
    #[arg(long, value_name = "VOLUME")]
    tooth: Option<PathBuf>,
    /// Distance between that volume's voxels, where its header lacks it
    #[arg(long, value_name = "MM", requires = "tooth", value_parser = spacing)]
    tooth_spacing_mm: Option<f32>,
    /// A code for the trainee; never a name
    #[arg(long, value_name = "CODE", default_value = "", value_parser = participant)]
    participant: String,
    /// Folder in which the bundle is made
    #[arg(long, value_name = "DIR", default_value = SESSIONS)]
    out: PathBuf,
    /// Begin at once, without the instructions
    #[arg(long, conflicts_with = "headless")]
    begin: bool,
    /// Draws a picture only this often: shows that a session does not wait for it
    #[arg(long, hide = true)]
    slow_picture_ms: Option<u64>,
}

pub fn spacing(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(mm) if (0.01..=2.0).contains(&mm) => Ok(mm),
        _ => Err("a distance between voxels lies between 0.01 and 2 mm".into()),
    }
}

/// As the command line names a [`Role`].
#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
enum SecondRole {
    /// Follows the first hand, and leads it while its button is held
    #[default]
    Instructor,
    /// Holds the suction, and feels the tooth with it
    Suction,
}

impl From<SecondRole> for Role {
    fn from(role: SecondRole) -> Role {
        match role {
            SecondRole::Instructor => Role::Instructor,
            SecondRole::Suction => Role::Suction,
        }
    }
}

/// Long enough not to be guessed by somebody who tries a thousand times a second.
fn key(text: &str) -> Result<String, String> {
    match text.len() >= 8 {
        true => Ok(text.to_string()),
        false => Err("a key has at least 8 letters: it lets another machine push a person's hand".into()),
    }
}

fn participant(text: &str) -> Result<String, String> {
    match lesson::is_code(text) {
        true => Ok(text.to_string()),
        false => Err("a code has up to 64 letters, digits, \"-\", \"_\" or \".\", and is never a name".into()),
    }
}

/// What a run needs, whoever asks for it.
pub struct Run<'a> {
    pub scenario: Arc<Scenario>,
    pub player: Player,
    pub seed: u64,
    pub participant: &'a str,
    pub out: &'a Path,
    /// SHA-256 of files that the scenario does not name, by name.
    pub digests: BTreeMap<String, String>,
}

/// Who moves the hand.
pub enum Player {
    /// A script on a simulated device, as fast as the machine can.
    Script(Box<OperatorFile>),
    /// A person with a device, in real time.
    Person(Box<live::Hands>),
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let is_scripted = arguments.device == SCRIPTED;
    if !arguments.headless && (is_scripted || arguments.device == MOUSE) {
        return window(arguments);
    }
    let library = lesson::library_for(&arguments.scenario);
    let mut scenario = lesson::read(&arguments.scenario, Forms::Made)?;
    let mut digests = BTreeMap::new();
    if let Some(scan) = tooth(arguments)? {
        scan.replace_teeth(&mut scenario)?;
        digests.insert("tooth".to_string(), scan.digest().to_string());
    }
    let player = match is_scripted {
        true => Player::Script(Box::new(operator(&arguments.operator, &library)?)),
        false => {
            let first = lesson::open(&arguments.device)?;
            let held = (first.name.as_str(), first.device.spec());
            let second = second(arguments).map(|(from, role)| SecondHand::join(&from, role, held)).transpose()?;
            Player::Person(Box::new(live::Hands { first, second }))
        }
    };
    let run = Run {
        scenario: Arc::new(scenario),
        player,
        seed: arguments.seed.unwrap_or_else(|| lesson::seed_from(jiff::Timestamp::now())),
        participant: &arguments.participant,
        out: &arguments.out,
        digests,
    };
    say(perform(run)?.display())
}

/// The same exercise in the desktop program's window.
fn window(arguments: &Arguments) -> Result<(), Failure> {
    super::desktop(app::Options {
        exercise: Some(arguments.scenario.clone()),
        tooth: tooth(arguments)?,
        second: second(arguments),
        begins: arguments.begin,
        author: None,
        device: (arguments.device == MOUSE).then(|| MOUSE.into()),
        seed: arguments.seed,
        participant: arguments.participant.clone(),
        out: arguments.out.clone(),
        templates: super::templates()?,
        slow_picture: arguments.slow_picture_ms.map(Duration::from_millis),
    })
}

/// Who is to join, and as what.
fn second(arguments: &Arguments) -> Option<(second::From, Role)> {
    let from = match (&arguments.second, arguments.second_at.clone().zip(arguments.second_key.clone())) {
        (Some(name), _) => second::From::Device(name.clone()),
        (None, Some((at, key))) => second::From::Network { at, key },
        (None, None) => return None,
    };
    Some((from, arguments.second_role.into()))
}

/// The scan to work on.
fn tooth(arguments: &Arguments) -> Result<Option<Scan>, Failed> {
    arguments.tooth.as_ref().map(|path| Scan::read(path, arguments.tooth_spacing_mm)).transpose()
}

/// An operator by name, or from a file.
pub fn operator(name: &str, library: &Library) -> Result<OperatorFile, Failure> {
    match Path::new(name).extension() {
        Some(_) => Ok(content::json::read::<OperatorFile>(content::read_text(Path::new(name))?)?.value),
        None if library.bytes(&OperatorFile::file(name)).is_err() => {
            let known =
                library.held().filter_map(|(file, _)| file.strip_prefix("content/operators/")?.strip_suffix(".json"));
            let known = known.collect::<Vec<_>>().join(", ");
            Err(Failure::Wrong(format!("unknown-operator: no operator is named \"{name}\"; known: {known}, or a file")))
        }
        None => Ok(OperatorFile::read(library, name)?),
    }
}

/// Runs, records, scores and reports; returns the bundle's path.
pub fn perform(run: Run) -> Result<PathBuf, Failure> {
    let Run { scenario, player, seed, participant, out, digests } = run;
    // A page that cannot be made should be known before the work, not after.
    let templates = super::templates()?;
    let started = jiff::Timestamp::now();
    let opening = Opening { scenario, seed, participant, out, digests, templates, started };
    let workpiece = opening.make()?;
    let recorded = match player {
        Player::Script(operator) => {
            opening.prepare(workpiece, Spec::phantom_omni(), Some(&operator))?.play(*operator)?
        }
        Player::Person(hands) => {
            let prepared = opening.prepare(workpiece, hands.first.device.spec().clone(), None)?;
            live::play(prepared, *hands)?
        }
    };
    let bar = spinner("scoring and drawing");
    let bundle = recorded.complete();
    bar.finish_and_clear();
    Ok(bundle?)
}

/// A sign of life on a terminal; silent elsewhere.
pub fn spinner(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
    let bar = ProgressBar::new_spinner().with_style(style).with_message(what);
    bar.enable_steady_tick(std::time::Duration::from_millis(120));
    bar
}
