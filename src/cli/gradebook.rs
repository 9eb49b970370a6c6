//! `typodont gradebook`: writes grades as a table that a school's system imports.

use super::verification::{self, VerificationArguments};
use super::{CliError, DEFAULT_LANGUAGE, SessionSource, load_templates, print_line, write_file};
use clap::{Args, ValueEnum};
use std::collections::BTreeMap;
use std::path::PathBuf;
use typodont_integrations::gradebook::{
    AttemptPolicy, CriticalErrorPolicy, GradeChange, GradebookOptions, Lms, StudentTable, gradebook,
};
use typodont_integrations::session_id;
use typodont_report::cohort::Cohort;
use typodont_review::{self as review, OverrideDraft, OverrideSnapshot};

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: SessionSource,
    /// System that will import the table
    #[arg(long = "for", value_name = "SYSTEM")]
    system: LmsName,
    /// Table to write
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
    /// Session that counts when a participant has several of one exercise
    #[arg(long, value_name = "WHICH", default_value = "last")]
    take: AttemptPolicyName,
    /// Points of a session with a critical error: unchanged, limited to one below the pass mark, or zero
    #[arg(long, value_name = "RULE", default_value = "keep")]
    critical: CriticalErrorPolicyName,
    /// Students' identities: a CSV file with the column participant and the columns by which the system identifies students
    #[arg(long, value_name = "FILE.csv")]
    students: Option<PathBuf>,
    /// Language of the feedback in a table for Moodle, by its code: en, tr, or one that the school added
    #[arg(long, value_name = "CODE", default_value = DEFAULT_LANGUAGE)]
    language: String,
    /// Use the examiner's grade where a grade was overridden (see `typodont review`)
    #[arg(long)]
    overrides: bool,
    #[command(flatten)]
    verification: VerificationArguments,
}

#[derive(Clone, Copy, ValueEnum)]
enum LmsName {
    Moodle,
    Canvas,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum AttemptPolicyName {
    Last,
    Best,
    First,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum CriticalErrorPolicyName {
    Keep,
    Cap,
    Zero,
}

impl AttemptPolicyName {
    pub(super) fn policy(self) -> AttemptPolicy {
        match self {
            AttemptPolicyName::Last => AttemptPolicy::Last,
            AttemptPolicyName::Best => AttemptPolicy::Best,
            AttemptPolicyName::First => AttemptPolicy::First,
        }
    }
}

impl CriticalErrorPolicyName {
    pub(super) fn policy(self) -> CriticalErrorPolicy {
        match self {
            CriticalErrorPolicyName::Keep => CriticalErrorPolicy::Keep,
            CriticalErrorPolicyName::Cap => CriticalErrorPolicy::Cap,
            CriticalErrorPolicyName::Zero => CriticalErrorPolicy::Zero,
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let templates = load_templates()?;
    let translator = templates.languages().translator(&arguments.language).map_err(CliError::misuse)?;
    let mut sourced = arguments.source.read(false)?;
    let mut cohort = std::mem::take(&mut sourced.cohort);
    verification::settle(&mut cohort, &arguments.verification)?;
    let changes = match arguments.overrides {
        true => apply_overrides(&mut cohort, &sourced.overrides()?),
        false => BTreeMap::new(),
    };
    let students = arguments.students.as_ref().map(|path| -> Result<StudentTable, CliError> {
        let source = typodont_formats::read_text(path)?;
        StudentTable::read(&path.display().to_string(), &source.text).map_err(CliError::Wrong)
    });
    let students = students.transpose()?;
    let lms = match arguments.system {
        LmsName::Moodle => Lms::Moodle,
        LmsName::Canvas => Lms::Canvas,
    };
    let (policy, critical) = (arguments.take.policy(), arguments.critical.policy());
    let options =
        GradebookOptions { lms, policy, critical, students: students.as_ref(), changes: &changes, translator };
    let made = gradebook(&cohort, &options);
    for what in &made.warnings {
        eprintln!("note: {what}");
    }
    if made.students == 0 {
        let what = "no-grades: no session with a participant code has a grade";
        return Err(CliError::wrong(format!("{}: {what}", sourced.name)));
    }
    write_file(&arguments.output, made.csv)?;
    print_line(format!("{}: {} students", arguments.output.display(), made.students))
}

/// Replaces computed grades by those of examiners, and prints their number. Returns the changes in effect by session id.
fn apply_overrides(cohort: &mut Cohort, log: &OverrideSnapshot) -> BTreeMap<String, Vec<GradeChange>> {
    let mut changes = BTreeMap::new();
    for (_, session) in &mut cohort.sessions {
        let id = session_id(session);
        if let Some(grade) = &mut session.grade {
            let effective = review::effective_grade(grade, &id, log);
            let own: Vec<GradeChange> = effective.entries().filter_map(|entry| grade_change(&entry.draft)).collect();
            *grade = review::with_overrides(grade, &id, log).0;
            if !own.is_empty() {
                changes.insert(id, own);
            }
        }
    }
    eprintln!("{} grades were overridden by an examiner", changes.len());
    changes
}

fn grade_change(draft: &OverrideDraft) -> Option<GradeChange> {
    Some(GradeChange {
        item: draft.item.as_ref().map(|item| item.title.clone()),
        points: [draft.machine.points, draft.examiner?.points],
        name: draft.name.clone(),
        reason: draft.reason.clone(),
    })
}
