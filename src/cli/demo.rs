//! `typodont demo`: runs the shipped exercises with a scripted operator and writes a page about them.

use super::run::{RunRequest, SeedSource, SessionDriver, operator, run_session};
use super::{CliError, DEFAULT_LANGUAGE, SESSIONS, cohort, print_line, verification};
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use typodont_core::parallel::available_threads;
use typodont_exercise::scenario;
use typodont_exercise::scenario::ResolveMode;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_report::cohort::Cohort;

#[derive(Args)]
pub struct Arguments {
    /// Folder for the bundles and the page
    #[arg(long, value_name = "DIR", default_value_os_t = PathBuf::from(SESSIONS).join("demo"))]
    out: PathBuf,
    /// Scripted operator in the place of a trainee: careful, expert, hasty, timid, or a file
    #[arg(long, value_name = "NAME|FILE.json", default_value = "careful")]
    operator: String,
}

/// The exercises of the thesis (8.1.1), as shipped with the program.
const EXERCISES: [(&str, &str); 5] = [
    ("scenarios/1-introduction.json", include_str!("../../scenarios/1-introduction.json")),
    ("scenarios/2-decay.json", include_str!("../../scenarios/2-decay.json")),
    ("scenarios/3-detection.json", include_str!("../../scenarios/3-detection.json")),
    ("scenarios/4-diagnosis.json", include_str!("../../scenarios/4-diagnosis.json")),
    ("scenarios/5-grinding.json", include_str!("../../scenarios/5-grinding.json")),
];

/// Seed of all random choices; fixed, so that the demo is the same every time.
const SEED: u64 = 1;

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    super::check_output_folder(&arguments.out)?;
    let library = Library::shipped();
    let operator = operator(&arguments.operator, &library)?;
    let play = |(name, text): (&str, &str)| -> Result<(String, PathBuf), CliError> {
        let scenario = scenario::resolve(SourceText::new(name, text), &library, ResolveMode::MakeWorkpiece)?;
        let title = format!("{}: {}", scenario.id, scenario.title);
        let run = RunRequest {
            scenario: Arc::new(scenario),
            driver: SessionDriver::Script(Box::new(operator.clone())),
            seed: SeedSource::Given(SEED),
            participant: "demo",
            out: &arguments.out,
            digests: BTreeMap::new(),
        };
        Ok((title, run_session(run)?.join("report.html")))
    };
    for batch in EXERCISES.chunks(available_threads()) {
        thread::scope(|scope| {
            let sessions: Vec<_> = batch.iter().map(|exercise| scope.spawn(|| play(*exercise))).collect();
            for session in sessions {
                let (title, report) = session.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
                print_line(title)?;
                print_line(format!("  {}", report.display()))?;
            }
            Ok::<_, CliError>(())
        })?;
    }
    let mut cohort = Cohort::read(&arguments.out);
    cohort.verify(&verification::verifier()?, |_| ());
    let page = arguments.out.join("cohort.html");
    cohort::write_all(
        &cohort,
        Some(&cohort::PageRequest::new(&page, DEFAULT_LANGUAGE)?),
        Some(&arguments.out.join("cohort.csv")),
        Some(&arguments.out.join("cohort.json")),
    )?;
    print_line(page.display())
}
