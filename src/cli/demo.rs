//! `typodont demo`: the whole way, from the shipped exercises to a page about them.

use super::run::{Player, Run, operator, perform};
use super::{Failure, SESSIONS, cohort, say};
use crate::content::Library;
use crate::diagnostic::Source;
use crate::report::cohort::Cohort;
use crate::scenario::{self, Forms};
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Args)]
pub struct Arguments {
    /// Folder in which the bundles and the page are made
    #[arg(long, value_name = "DIR", default_value_os_t = PathBuf::from(SESSIONS).join("demo"))]
    out: PathBuf,
    /// Who plays the trainee: careful, expert, hasty, timid, or a file
    #[arg(long, value_name = "NAME|FILE.json", default_value = "careful")]
    operator: String,
}

/// The exercises of the thesis (8.1.1), as they ship.
const EXERCISES: [(&str, &str); 5] = [
    ("scenarios/1-introduction.json", include_str!("../../scenarios/1-introduction.json")),
    ("scenarios/2-decay.json", include_str!("../../scenarios/2-decay.json")),
    ("scenarios/3-detection.json", include_str!("../../scenarios/3-detection.json")),
    ("scenarios/4-diagnosis.json", include_str!("../../scenarios/4-diagnosis.json")),
    ("scenarios/5-grinding.json", include_str!("../../scenarios/5-grinding.json")),
];

/// The demo is the same every time.
const SEED: u64 = 1;

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let library = Library::shipped();
    let operator = operator(&arguments.operator, &library)?;
    for (name, text) in EXERCISES {
        let scenario = scenario::resolve(Source::new(name, text), &library, Forms::Made)?;
        say(format!("{}: {}", scenario.id, scenario.title))?;
        let run = Run {
            scenario: Arc::new(scenario),
            player: Player::Script(Box::new(operator.clone())),
            seed: SEED,
            participant: "demo",
            out: &arguments.out,
            digests: BTreeMap::new(),
        };
        say(format!("  {}", perform(run)?.join("report.html").display()))?;
    }
    let cohort = Cohort::read(&arguments.out);
    let page = arguments.out.join("cohort.html");
    cohort::write_all(
        &cohort,
        Some(&page),
        Some(&arguments.out.join("cohort.csv")),
        Some(&arguments.out.join("cohort.json")),
    )?;
    say(page.display())
}
