//! `typodont gradebook`: grades as a table that a school's system imports.

use super::school::Source;
use super::{Failure, say, write};
use crate::handover::gradebook::{Students, System, Take, gradebook};
use crate::handover::session_id;
use crate::report::cohort::Cohort;
use crate::review::{self, Told};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Whose gradebook
    #[arg(long = "for", value_name = "SYSTEM")]
    system: Systems,
    /// The table
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
    /// Which session of an exercise counts
    #[arg(long, value_name = "WHICH", default_value = "last")]
    take: Taken,
    /// The school's names of people: a CSV with the column participant, and those that the system knows people by
    #[arg(long, value_name = "FILE.csv")]
    students: Option<PathBuf>,
    /// Take the examiner's grade where one stands (see `typodont review`)
    #[arg(long)]
    overrides: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Systems {
    Moodle,
    Canvas,
}

#[derive(Clone, Copy, ValueEnum)]
enum Taken {
    Last,
    Best,
    First,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut read = arguments.source.read(false)?;
    let mut cohort = std::mem::take(&mut read.cohort);
    if arguments.overrides {
        take_overrides(&mut cohort, &read.judgements()?);
    }
    let students = arguments.students.as_ref().map(|path| -> Result<Students, Failure> {
        let source = crate::content::read_text(path)?;
        Students::read(&path.display().to_string(), &source.text).map_err(Failure::Wrong)
    });
    let students = students.transpose()?;
    let system = match arguments.system {
        Systems::Moodle => System::Moodle,
        Systems::Canvas => System::Canvas,
    };
    let take = match arguments.take {
        Taken::Last => Take::Last,
        Taken::Best => Take::Best,
        Taken::First => Take::First,
    };
    let made = gradebook(&cohort, system, take, students.as_ref());
    for what in &made.left_out {
        eprintln!("left out: {what}");
    }
    if made.students == 0 {
        let what = "no-grades: nobody with a code has a grade here";
        return Err(Failure::wrong(format!("{}: {what}", read.name)));
    }
    write(&arguments.output, made.csv)?;
    say(format!("{}: {} students", arguments.output.display(), made.students))
}

/// Puts examiners' grades in place of the machine's, and says how many.
fn take_overrides(cohort: &mut Cohort, told: &Told) {
    let mut count = 0;
    for (_, session) in &mut cohort.sessions {
        let id = session_id(session);
        if let Some(grade) = &mut session.grade {
            let (taken, overrides) = review::applied(grade, &id, told);
            (*grade, count) = (taken, count + usize::from(overrides > 0));
        }
    }
    eprintln!("{count} grades are an examiner's");
}
