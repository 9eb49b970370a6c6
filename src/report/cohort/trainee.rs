//! A page for each participant of a cohort: own attempts, rank in the class, and progress since the last attempt.
//!
//! A page names nobody but its reader. Only sessions under the same conditions are compared ([`ComparableGroup`]).

use super::page::{histogram, result_of};
use super::{Cohort, ComparableGroup, dedup};
use crate::language::{COUNT, Translator};
use crate::session_file::{GradeFile, ItemResultFile, SessionFile};
use crate::templates::Templates;
use crate::{display_format, phrases};
use minijinja::value::Value;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::path::Path;
use typodont_core::statistics::quantile;
use typodont_exercise::scenario::hex;

/// Fewest people of whom a rank and a distribution are shown: among fewer, they would say what another person achieved.
const PEOPLE_LEAST: usize = 5;

/// Most characters of a code, title or path that are shown.
const SHOWN_MAX: usize = 80;

/// Most characters of a participant's code that a file name keeps.
const FILE_NAME_MAX: usize = 60;

/// Page of a participant.
pub struct TraineePage {
    /// Name of the file, which differs between participants.
    pub file_name: String,
    pub html: String,
}

impl Cohort {
    /// A page for each participant with a code, in the language of a code. `folder` is where they will lie, from which
    /// sessions are linked.
    ///
    /// # Errors
    ///
    /// When there is no such language or the template fails.
    pub fn trainee_pages(
        &self,
        templates: &Templates,
        folder: &Path,
        language: &str,
    ) -> Result<Vec<TraineePage>, String> {
        let translator = templates.languages().translator(language)?;
        let links = self.report_links(&folder.join("page.html"));
        let codes = dedup(self.sessions.iter().map(|(_, s)| s.participant.as_str()).filter(|code| !code.is_empty()));
        let groups: Vec<ComparableGroup> = dedup(self.sessions.iter().map(|(_, s)| s.scenario.id.as_str()))
            .into_iter()
            .flat_map(|id| self.groups_of(id))
            .collect();
        let attempts: Vec<Vec<Vec<usize>>> = groups.iter().map(|group| self.attempts_by_participant(group)).collect();
        let page = |code: &str| {
            let is_own = |person: &&Vec<usize>| self.sessions[person[0]].1.participant == code;
            let parts = groups.iter().zip(&attempts).filter_map(|(group, people)| {
                let own = people.iter().find(is_own)?;
                let others = groups.iter().filter(|g| g.scenario == group.scenario).cloned().collect::<Vec<_>>();
                let conditions = (others.len() > 1).then(|| translator.translate(&group.description(&others)));
                Some(self.part(translator, own, people, &links, conditions.unwrap_or_default()))
            });
            let values = TraineeValues {
                language: translator.code(),
                style: Value::from_safe_string(templates.cohort_style().into()),
                participant: display_format::sanitize_display(code, SHOWN_MAX),
                parts: parts.collect(),
            };
            Ok(TraineePage { file_name: file_name(code), html: templates.render_trainee(&values, translator.code())? })
        };
        codes.into_iter().map(page).collect()
    }

    fn part(
        &self,
        translator: Translator,
        own: &[usize],
        people: &[Vec<usize>],
        links: &[String],
        conditions: String,
    ) -> TraineePart {
        let session = |index: usize| &self.sessions[index].1;
        let graded = |person: &[usize]| -> Vec<(usize, &GradeFile)> {
            person.iter().filter_map(|&i| Some((i, session(i).grade.as_ref()?))).collect()
        };
        let own_graded = graded(own);
        let latest = own_graded.last().copied();
        let previous = own_graded.len().checked_sub(2).map(|at| own_graded[at].1);
        // The class: everybody but the named experts, each with the last graded session. A result that its recording does not
        // give is nobody's.
        let counts = |index: usize| !self.status(&self.sessions[index].0).differs();
        let class: Vec<(usize, &GradeFile)> = people
            .iter()
            .filter(|person| !self.is_expert(session(person[0])) || person[0] == own[0])
            .filter_map(|person| graded(person).into_iter().rfind(|(index, _)| counts(*index)))
            .collect();
        let is_shown = class.len() >= PEOPLE_LEAST;
        let better = |points: f64| class.iter().filter(|(_, grade)| grade.points > points).count();
        let rank = latest.filter(|(index, _)| is_shown && counts(*index)).map(|(_, grade)| {
            let values = [("rank", (better(grade.points) + 1).to_string()), ("of", class.len().to_string())];
            translator.text("cohort.own_rank", &values)
        });
        let sessions: Vec<usize> = class.iter().map(|(index, _)| *index).collect();
        let counted = |key: &str, count: usize| translator.text(key, &[(COUNT, count.to_string())]);
        TraineePart {
            title: display_format::sanitize_display(&session(own[0]).scenario.title, SHOWN_MAX),
            conditions,
            rank_about: counted("cohort.own_rank_about", class.len()),
            rank,
            change: latest.zip(previous).map(|((_, now), before)| signed(now.points - before.points)),
            people_least: PEOPLE_LEAST,
            histogram: match latest {
                Some((_, grade)) if is_shown => histogram(translator, self, &sessions, Some(grade.points)),
                _ => String::new(),
            },
            class_people: counted("cohort.participants", class.len()),
            items: latest.map_or(Vec::new(), |(_, now)| item_lines(translator, now, previous, &class, is_shown)),
            attempts: own.iter().map(|&i| attempt(translator, session(i), &links[i])).collect(),
            latest: latest.map(|(index, grade)| {
                let (result, class) = result_of(translator, session(index));
                LatestAttempt {
                    points: display_format::points(grade.points, grade.pass_points),
                    most: display_format::plain_number(grade.max_points),
                    mark: display_format::plain_number(grade.pass_points),
                    result,
                    class,
                }
            }),
        }
    }
}

/// Values for the template. A value named `histogram` is a drawing; every other value is text, and is escaped.
#[derive(Serialize)]
struct TraineeValues<'a> {
    language: &'a str,
    style: Value,
    participant: String,
    parts: Vec<TraineePart>,
}

/// Sessions of one exercise under the same conditions.
#[derive(Serialize)]
struct TraineePart {
    title: String,
    conditions: String,
    /// The last attempt with points.
    latest: Option<LatestAttempt>,
    /// `None` if the class is too small.
    rank: Option<String>,
    rank_about: String,
    /// Change of the points since the attempt before; `None` at the first.
    change: Option<String>,
    people_least: usize,
    histogram: String,
    class_people: String,
    items: Vec<ItemLine>,
    attempts: Vec<AttemptLine>,
}

#[derive(Serialize)]
struct LatestAttempt {
    points: String,
    most: String,
    mark: String,
    result: String,
    class: &'static str,
}

#[derive(Serialize)]
struct ItemLine {
    title: String,
    before: String,
    points_before: String,
    now: String,
    points_now: String,
    class_median: String,
}

#[derive(Serialize)]
struct AttemptLine {
    started: String,
    link: String,
    points: String,
    result: String,
    class: &'static str,
}

fn attempt(translator: Translator, session: &SessionFile, link: &str) -> AttemptLine {
    let (result, class) = result_of(translator, session);
    AttemptLine {
        started: display_format::sanitize_display(&session.started.replace('T', " ").replace('Z', ""), SHOWN_MAX),
        link: link.to_string(),
        points: session.grade.as_ref().map_or("–".into(), |g| display_format::points(g.points, g.pass_points)),
        result,
        class,
    }
}

/// The criteria of the last attempt beside those of the attempt before and the median of the class.
fn item_lines(
    translator: Translator,
    now: &GradeFile,
    previous: Option<&GradeFile>,
    class: &[(usize, &GradeFile)],
    is_class_shown: bool,
) -> Vec<ItemLine> {
    let same = |grade: &'_ GradeFile, item: &ItemResultFile| -> Option<ItemResultFile> {
        grade.items.iter().find(|i| (&i.metric, &i.title) == (&item.metric, &item.title)).cloned()
    };
    let value = |item: &ItemResultFile, value: Option<f64>| {
        translator.translate(&phrases::value_text(display_format::measured(&item.metric, value)))
    };
    let points = |item: &ItemResultFile| {
        let (points, most) =
            (display_format::item_points(item.points, item.max_points), display_format::plain_number(item.max_points));
        translator.text("cohort.own_points", &[("points", points), ("most", most)])
    };
    let line = |item: &ItemResultFile| {
        let before = previous.and_then(|grade| same(grade, item));
        let mut all: Vec<f64> = class.iter().filter_map(|(_, grade)| same(grade, item)?.value).collect();
        all.sort_by(f64::total_cmp);
        // Of few people, each could derive the others' values.
        let median = (is_class_shown && all.len() >= PEOPLE_LEAST).then(|| quantile(&all, 0.5));
        ItemLine {
            title: display_format::sanitize_display(&item.title, SHOWN_MAX),
            before: before.as_ref().map_or("–".into(), |b| value(b, b.value)),
            points_before: before.as_ref().map_or(String::new(), points),
            now: value(item, item.value),
            points_now: points(item),
            class_median: median.map_or("–".into(), |median| value(item, Some(median))),
        }
    };
    now.items.iter().map(line).collect()
}

/// A difference of points with its sign.
fn signed(points: f64) -> String {
    let rounded = points.round();
    match rounded {
        r if r > 0.0 => format!("+{r}"),
        r if r < 0.0 => format!("−{}", -r),
        _ => "±0".into(),
    }
}

/// Name of a participant's page: the code as far as it fits into a file name; if anything of it had to be left out, with
/// the beginning of its digest, so that no two participants share a file.
fn file_name(code: &str) -> String {
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    let plain: String = code.chars().take(FILE_NAME_MAX).map(|c| if is_plain(c) { c } else { '_' }).collect();
    match plain == code {
        true => format!("{plain}.html"),
        false => format!("{plain}-{}.html", &hex(&Sha256::digest(code.as_bytes()))[..8]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn participants_never_share_a_file() {
        // Aim: codes that differ only in what a file name cannot keep, or in letter case, have files of their own.
        let codes = ["p07", "P07", "../p07", "a/b", "a_b", "a b", "çelik", &"x".repeat(200), &"x".repeat(201)];
        let names: std::collections::BTreeSet<String> = codes.iter().map(|c| file_name(c).to_lowercase()).collect();
        assert_eq!(names.len(), codes.len(), "{names:?}");
        assert_eq!(file_name("p07"), "p07.html");
        assert!(names.iter().all(|n| !n.contains('/') && !n.contains("..") && n.len() < 100), "{names:?}");
    }

    #[test]
    fn a_change_of_points_has_its_sign() {
        assert_eq!([12.4, -3.0, 0.2].map(signed), ["+12", "−3", "±0"]);
    }
}
